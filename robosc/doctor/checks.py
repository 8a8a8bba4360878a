"""Checks of a machine: each examines one part of it, for the purposes that need this part."""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from enum import StrEnum

from robosc.dd_modules import has_cudd
from robosc.doctor.machine import Machine
from robosc.interfaces import CODENAMES, DISTRIBUTIONS
from robosc.python_versions import FIX, unsupported
from robosc.synthesis.connection import left_aside

_IMPORT_S = 30.0
_SERVER_S = 20.0

_APT = "sudo apt install "
_IMPORT_RCLPY = "import rclpy; from rclpy.utilities import get_rmw_implementation_identifier as rmw; print(rmw())"
_CONNECT = "import socket, sys; socket.create_connection((sys.argv[1], int(sys.argv[2])), 5).close()"


class Grade(StrEnum):
    """Meaning of a finding."""

    OK = "ok"
    NOTE = "note"
    """A part that is not needed is missing, or a remark is worth knowing."""
    MISSING = "missing"
    """A part that the purpose needs is missing or does not work."""


@dataclass(frozen=True, slots=True)
class Finding:
    """Finding about one part of a machine.

    Attributes:
        part: Short name of the part.
        grade: Its grade.
        message: One sentence about what is there, or what is not.
        fix: Command or instruction that puts it right; empty: none is needed.
    """

    part: str
    grade: Grade
    message: str
    fix: str = ""


class Purpose(StrEnum):
    """Purpose that a machine is to serve."""

    SYNTH = "synth"
    ROS2 = "ros2"
    ROS1 = "ros1"
    BRIDGE = "bridge"
    SERVER = "server"
    VIEW = "view"


_EXTRAS = {Purpose.BRIDGE: "bridge", Purpose.SERVER: "server", Purpose.VIEW: "view"}
"""The extra that a purpose needs."""

_TOLD_EXTRAS = (
    "client",
    "server",
    "bridge",
    "view",
    "plot",
    "mcap",
    "simulation",
    "lsp",
    "signing",
    "postgresql",
    "dask",
    "tracing",
)


def examine(machine: Machine, purposes: Iterable[Purpose] = (), server: str | None = None) -> tuple[Finding, ...]:
    """Return the findings about a machine.

    Args:
        machine: The machine.
        purposes: Purposes that it is to serve, besides checking, synthesizing and generating. Only what these need is
            `MISSING`; without any, all parts are reported.
        server: `HOST` or `HOST:PORT` of a synthesis server that it is to reach; None: none.
    """
    wanted = frozenset(purposes)
    needed, is_all = wanted or frozenset({Purpose.SYNTH}), not wanted

    def is_listed(*parts: Purpose) -> bool:
        return is_all or not needed.isdisjoint(parts)

    found = [*_python(machine), *_packages(machine, needed, all_parts=is_all)]
    if is_listed(Purpose.ROS2):
        found += _ros2(machine, Purpose.ROS2 in needed)
    if is_listed(Purpose.ROS1):
        found += _ros1(machine, Purpose.ROS1 in needed)
    if is_listed(Purpose.ROS1, Purpose.ROS2):
        found += _tools(machine, needed)
    if is_listed(Purpose.BRIDGE):
        found += _ports(machine, Purpose.BRIDGE in needed)
    if is_listed(Purpose.VIEW):
        found += _browser(machine)
    if server is not None:
        found += _server(machine, server)
    return tuple(found)


def is_ready(findings: Iterable[Finding]) -> bool:
    """Return True if nothing that is needed is missing."""
    return all(finding.grade is not Grade.MISSING for finding in findings)


def _lack(is_needed: bool) -> Grade:
    return Grade.MISSING if is_needed else Grade.NOTE


def _python(machine: Machine) -> Iterator[Finding]:
    if wrong := unsupported(machine.python_version):
        yield Finding("Python", Grade.MISSING, f"{wrong} ({machine.python})", FIX)
    else:
        version = ".".join(map(str, machine.python_version))
        yield Finding("Python", Grade.OK, f"{version} ({machine.python})")


def _packages(machine: Machine, needed: frozenset[Purpose], *, all_parts: bool) -> Iterator[Finding]:
    """RoboSC's own packages, and those of its extras."""
    requirements = machine.requirements()
    if requirements is None:
        yield Finding(
            "robosc",
            Grade.NOTE,
            "it runs from a folder and is not installed: extras are not checked",
            "install it (docs/install.md)",
        )
        return
    yield _extra(
        machine, "robosc", _required(requirements, ""), is_needed=True, fix="install it again (docs/install.md)"
    )
    if has_cudd():
        yield Finding("decision diagrams", Grade.OK, "the engine in C (cudd)")
        yield _kernel()
    else:
        yield Finding("decision diagrams", Grade.OK, "the engine in Rust (oxidd); dd comes without the one in C here")
    wanted = {_EXTRAS[purpose] for purpose in needed if purpose in _EXTRAS}
    for extra in _TOLD_EXTRAS:
        if all_parts or extra in wanted:
            parts = _required(requirements, extra)
            yield _extra(
                machine, f"extra {extra}", parts, is_needed=extra in wanted, fix=f"pip install 'robosc[{extra}]'"
            )


def _kernel() -> Finding:
    problem = left_aside()
    if not problem:
        return Finding("kernel", Grade.OK, "the inner loops of synthesis are in C")
    return Finding(
        "kernel",
        Grade.NOTE,
        f"synthesis takes the engine oxidd, and conditions take longer: {problem}",
        "docs/install.md, 'The kernel'",
    )


def _extra(machine: Machine, part: str, required: list[tuple[str, str]], *, is_needed: bool, fix: str) -> Finding:
    lacking, listed = [], []
    for package, bound in required:
        version = machine.version(package)
        if version is None:
            lacking.append(package)
        elif not _is_enough(version, bound):
            lacking.append(f"{package} {bound} (there is {version})")
        else:
            listed.append(f"{package} {version}")
    if lacking:
        return Finding(part, _lack(is_needed), f"not installed: {', '.join(lacking)}", fix)
    return Finding(part, Grade.OK, ", ".join(listed))


_REQUIREMENT = re.compile(r"([A-Za-z0-9._-]+)(?:\[[^\]]*\])?\s*([<>=!~][^;]*)?(?:;(.*))?")
_EXTRA = re.compile(r"extra\s*==\s*[\"']([^\"']+)[\"']")


def _required(requirements: Iterable[str], extra: str) -> list[tuple[str, str]]:
    """The packages of an extra with the bound of each; those that are always needed for the extra ''."""
    found = []
    for text in requirements:
        match = _REQUIREMENT.match(text)
        if match is not None:
            marker = _EXTRA.search(match[3] or "")
            if (marker[1] if marker else "") == extra:
                found.append((match[1], (match[2] or "").strip()))
    return sorted(found)


def _is_enough(version: str, bounds: str) -> bool:
    """Return True if a version is within bounds `>=` and `<`, separated by commas; other bounds are not judged."""
    return all(
        _numbers(version) >= _numbers(bound[2:])
        if bound.startswith(">=")
        else not bound.startswith("<") or bound.startswith("<=") or _numbers(version) < _numbers(bound[1:])
        for bound in map(str.strip, bounds.split(","))
    )


def _numbers(version: str) -> tuple[int, ...]:
    leading = re.match(r"\d+(?:\.\d+)*", version.strip())
    numbers = tuple(map(int, leading[0].split("."))) if leading else ()
    return numbers + (0,) * (4 - len(numbers))


def _interpreters(machine: Machine) -> Iterator[str]:
    """The interpreters that may run a node: ROS has its packages in the system's, not in a virtual environment."""
    yield from dict.fromkeys(filter(None, (machine.find_program("python3"), "/usr/bin/python3", machine.python)))


def _importing(machine: Machine, code: str) -> tuple[str, str] | None:
    """The first interpreter that can carry out a line, and what that printed last."""
    for python in _interpreters(machine):
        done = machine.run([python, "-c", code], _IMPORT_S)
        if done is not None and done.status == 0:
            return python, (done.text.splitlines() or [""])[-1]
    return None


def _ros2(machine: Machine, is_needed: bool) -> Iterator[Finding]:
    sourced = machine.environment.get("ROS_DISTRO") if machine.environment.get("ROS_VERSION", "2") == "2" else None
    installed = machine.matching("/opt/ros", "*/setup.bash")
    importing = _importing(machine, _IMPORT_RCLPY)
    if sourced is not None:
        remark = _remark(sourced, 2)
        yield Finding("ROS 2", Grade.NOTE if remark else Grade.OK, f"{sourced} is sourced{remark}")
    elif importing is None:
        fix = f"source {installed[-1]}" if installed else "install ROS 2 Jazzy, or 'pip install robosc[ros2]' to try it"
        what = "a distribution is installed, but not sourced" if installed else "no distribution is installed"
        yield Finding("ROS 2", _lack(is_needed), what, fix)
    else:
        yield Finding("ROS 2", Grade.NOTE, "no distribution is sourced; its packages are found all the same")
    if importing is None:
        fix = f"source {installed[-1]}" if installed else f"{_APT}ros-jazzy-ros-base"
        yield Finding("rclpy", _lack(is_needed), "no Python can import it and load a middleware", fix)
        return
    python, middleware = importing
    yield Finding("rclpy", Grade.OK, f"{python} imports it")
    wanted = machine.environment.get("RMW_IMPLEMENTATION")
    if wanted and wanted != middleware:
        yield Finding(
            "middleware",
            Grade.NOTE,
            f"{middleware} is used, not {wanted} of RMW_IMPLEMENTATION",
            "unset RMW_IMPLEMENTATION",
        )
    elif middleware == _ZENOH:
        what = f"{middleware}, which promises less than others"
        yield Finding("middleware", Grade.NOTE, what, "docs/generating.md, 'Zenoh', says what is weaker")
    else:
        yield Finding("middleware", Grade.OK, middleware)
    if _ZENOH in (middleware, wanted):
        yield _router(machine, is_needed)


_ZENOH = "rmw_zenoh_cpp"
_ROUTER_PORT = "7447"
_ZENOH_SETTINGS = ("ZENOH_SESSION_CONFIG_URI", "ZENOH_CONFIG_OVERRIDE")


def _router(machine: Machine, is_needed: bool) -> Finding:
    """Router of Zenoh, without which a node starts, warns once and sees nobody."""
    setting = next((name for name in _ZENOH_SETTINGS if machine.environment.get(name)), None)
    if setting is not None:
        return Finding("Zenoh router", Grade.NOTE, f"{setting} decides where it is: not examined")
    done = machine.run([machine.python, "-c", _CONNECT, "localhost", _ROUTER_PORT], _SERVER_S)
    if done is not None and done.status == 0:
        return Finding("Zenoh router", Grade.OK, f"it accepts connections at localhost:{_ROUTER_PORT}")
    what = f"none at localhost:{_ROUTER_PORT}: nodes start, and see no other node"
    return Finding("Zenoh router", _lack(is_needed), what, f"ros2 run {_ZENOH} rmw_zenohd")


def _remark(codename: str, version: int) -> str:
    """A remark on a distribution that generated packages are not tested with; empty: they are."""
    tested = [item for item in DISTRIBUTIONS if item.version == version and item.is_tested]
    if codename in {item.codename for item in tested}:
        return ""
    names = " and ".join(sorted(item.codename for item in tested))
    known = "" if codename in CODENAMES else "; models are checked against jazzy, for its interfaces are not known here"
    return f"; generated packages are tested with {names}{known}"


def _ros1(machine: Machine, is_needed: bool) -> Iterator[Finding]:
    sourced = machine.environment.get("ROS_DISTRO") if machine.environment.get("ROS_VERSION") == "1" else None
    if sourced is not None:
        remark = _remark(sourced, 1)
        yield Finding("ROS 1", Grade.NOTE if remark else Grade.OK, f"{sourced} is sourced{remark}")
    importing = _importing(machine, "import rospy, actionlib")
    if importing is None:
        fix = f"{_APT}python3-rospy python3-actionlib on Debian 12; or source /opt/ros/noetic/setup.bash"
        yield Finding("rospy", _lack(is_needed), "no Python can import rospy and actionlib", fix)
    else:
        yield Finding("rospy", Grade.OK, f"{importing[0]} imports it, with actionlib")
    if machine.find_program("rosmaster") or machine.find_program("roscore"):
        yield Finding("ROS 1 master", Grade.OK, "its program is installed")
    else:
        grade, fix = _lack(is_needed), f"{_APT}python3-rosmaster python3-roslaunch"
        yield Finding("ROS 1 master", grade, "there is no rosmaster; one on another machine serves as well", fix)


def _tools(machine: Machine, needed: frozenset[Purpose]) -> Iterator[Finding]:
    """Programs that build generated packages."""
    catkin = ("catkin_make", "catkin_make_isolated", "catkin")
    both = frozenset({Purpose.ROS1, Purpose.ROS2})
    # All of them are reported where no ROS is needed, and none is missed.
    listed = needed & both or both
    for part, names, builders, what, fix in (
        ("colcon", ("colcon",), {Purpose.ROS2}, "builds ROS 2 packages", "pip install colcon-common-extensions"),
        ("catkin", catkin, {Purpose.ROS1}, "builds ROS 1 packages", f"{_APT}catkin"),
        ("C compiler", ("cc", "gcc", "clang"), (), "builds the target c99", f"{_APT}gcc"),
        ("C++ compiler", ("c++", "g++", "clang++"), (), "builds the targets ros2-cpp and ros1-cpp", f"{_APT}g++"),
        ("CMake", ("cmake",), (), "builds ROS packages in C++ and with interfaces", f"{_APT}cmake"),
    ):
        if builders and listed.isdisjoint(builders):
            continue
        paths = list(filter(None, map(machine.find_program, names)))
        if paths:
            yield Finding(part, Grade.OK, paths[0])
        else:
            yield Finding(part, _lack(not needed.isdisjoint(builders)), f"not installed; it {what}", fix)


_RULES = "60-robosc.rules"


def _ports(machine: Machine, is_needed: bool) -> Iterator[Finding]:
    """Serial ports, who may use them, and the names that the udev rules give them."""
    named = [path for path in machine.matching("/dev", "robosc-*") if machine.is_device(path)]
    ports = [path for kind in ("ttyACM*", "ttyUSB*") for path in machine.matching("/dev", kind)]
    if not ports and not named:
        fix = "plug in the board and the LiDAR, and look at 'dmesg'; a simulated robot needs none"
        yield Finding("serial ports", _lack(is_needed), "there is none", fix)
    for port in ports or named:
        yield _port(machine, port, is_needed)
    places = ("/etc/udev/rules.d", "/usr/lib/udev/rules.d", "/lib/udev/rules.d")
    if named:
        yield Finding("udev names", Grade.OK, ", ".join(named))
    elif any(machine.matching(place, _RULES) for place in places):
        yield Finding("udev names", Grade.NOTE, "the rules are installed, and no device has a name by them")
    else:
        fix = f"sudo cp deploy/udev/{_RULES} /etc/udev/rules.d; sudo udevadm control --reload; sudo udevadm trigger"
        yield Finding("udev names", Grade.NOTE, "no rules: the names of ports depend on the order of plugging in", fix)


def _port(machine: Machine, port: str, is_needed: bool) -> Finding:
    if machine.is_usable(port):
        users = ", ".join(machine.users_of(port))
        if users:
            fix = "end what is not the bridge, such as the bring-up of ROS (docs/first-drive.md)"
            return Finding("serial port", Grade.NOTE, f"{port} is used by {users}", fix)
        return Finding("serial port", Grade.OK, f"{port} can be read and written")
    group = machine.group_of(port)
    grade = _lack(is_needed)
    if group in machine.groups():
        return Finding(
            "serial port",
            grade,
            f"{port}: no permission, though you are in its group {group}",
            f"sudo chmod g+rw {port}",
        )
    if machine.is_member(group):
        return Finding(
            "serial port", grade, f"{port}: you were put into the group {group} after you logged in", "log in again"
        )
    return Finding(
        "serial port",
        grade,
        f"{port}: no permission; it belongs to the group {group}",
        f'sudo usermod -aG {group} "$USER", then log in again',
    )


_BROWSERS = ("firefox", "firefox-esr", "chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
_FONT_FOLDERS = (
    "/usr/share/fonts",
    "/usr/local/share/fonts",
    "~/.local/share/fonts",
    "~/.fonts",
    "/System/Library/Fonts",
)


def _browser(machine: Machine) -> Iterator[Finding]:
    """Programs that show the page; they may be on another machine, so that they are never needed here."""
    paths = list(filter(None, map(machine.find_program, _BROWSERS)))
    if paths:
        yield Finding("browser", Grade.OK, paths[0])
    else:
        fix = f"{_APT}chromium, or open the page on another machine (docs/live-view.md)"
        yield Finding("browser", Grade.NOTE, "none is installed here", fix)
    if any(machine.matching(folder, "**/*.[to]tf") for folder in _FONT_FOLDERS):
        yield Finding("fonts", Grade.OK, "there are some for a browser")
    else:
        yield Finding("fonts", Grade.NOTE, "a browser on this machine would have none", f"{_APT}fonts-dejavu-core")


def _server(machine: Machine, server: str) -> Iterator[Finding]:
    """Health of a synthesis server by the client; without the client's packages, its port alone."""
    requirements = machine.requirements() or ()
    has_client = all(machine.version(package) is not None for package, _ in _required(requirements, "client"))
    if requirements and has_client:
        words = ["-m", "robosc_client.command", "health", "--server", server, "--deadline", "5"]
        what, good = "", "serves"
    else:
        host, _, port = server.rpartition(":") if re.search(r":\d+\Z", server) else (server, "", "50051")
        words = ["-c", _CONNECT, host.strip("[]"), port]
        what, good = " (asked without the extra client)", "accepts connections"
    done = machine.run([machine.python, *words], _SERVER_S)
    if done is not None and done.status == 0:
        yield Finding("server", Grade.OK, f"{server} {good}{what}")
        return
    why = "no answer in time" if done is None else (done.text.splitlines() or ["no answer"])[-1]
    fix = "start it with 'robosc-server', or look at its address, certificates and tokens (docs/security.md)"
    yield Finding("server", Grade.MISSING, f"{server}: {why}{what}", fix)
