"""Examination of machines that are made up, one part missing at a time."""

import ast
import json
import os
import sys
import tomllib
from collections.abc import Callable, Sequence
from fnmatch import fnmatch
from pathlib import Path

import pytest

from robosc.cli import doctor as command
from robosc.cli.main import main
from robosc.cli.starting import start
from robosc.doctor import Finding, Grade, Machine, Output, Purpose, examine, is_ready
from robosc.python_versions import NEWEST, OLDEST, unsupported

ROOT = Path(__file__).parents[3]

REQUIREMENTS = (
    "dd<0.7,>=0.6",
    "msgspec>=0.19",
    "grpcio>=1.85.1; extra == 'client'",
    "grpcio>=1.85.1; extra == 'server'",
    "sqlalchemy[asyncio]>=2.0.36 ; extra == 'server'",
    "pyserial>=3.5; extra == 'bridge'",
    'aiohttp>=3.11; python_version >= "3.12" and extra == "view"',
    "ros-jazzy-rclpy==7.1.6; extra == 'ros2'",
)
VERSIONS = {
    "dd": "0.6.0", "msgspec": "0.22.0", "grpcio": "1.90.0rc1", "sqlalchemy": "2.1", "pyserial": "3.5",
    "aiohttp": "3.11",
}  # fmt: skip
PROGRAMS = (
    "python3", "colcon", "catkin_make", "rosmaster", "gcc", "g++", "cmake", "chromium",
)  # fmt: skip


class MadeUp(Machine):
    """A machine that has everything; tests take parts away."""

    def __init__(self) -> None:
        self.python, self.python_version = "/venv/bin/python", (3, 12, 1)
        self.environment = {"ROS_DISTRO": "jazzy", "ROS_VERSION": "2"}
        self.versions = dict(VERSIONS)
        self.programs = set(PROGRAMS)
        self.files = {
            "/dev/ttyACM0",
            "/dev/robosc-opencr",
            "/etc/udev/rules.d/60-robosc.rules",
            "/usr/share/fonts/a/b.ttf",
        }
        self.allowed = {"/dev/ttyACM0"}
        self.users: tuple[str, ...] = ()
        self.mine: set[str] = set()
        self.later: set[str] = set()
        self.modules = {"rclpy": "/usr/bin/python3", "rospy": "/usr/bin/python3"}
        self.middleware = "rmw_fastrtps_cpp"
        self.answer: Output | None = Output(0, "SERVING\n")
        self.commands: list[Sequence[str]] = []
        self.is_installed = True

    def requirements(self) -> tuple[str, ...] | None:
        return REQUIREMENTS if self.is_installed else None

    def version(self, package: str) -> str | None:
        return self.versions.get(package)

    def find_program(self, name: str) -> str | None:
        return f"/usr/bin/{name}" if name in self.programs else None

    def run(self, command: Sequence[str], limit_s: float) -> Output | None:
        self.commands.append(command)
        for module, python in self.modules.items():
            if f"import {module}" in command[2]:
                return Output(0, f"{self.middleware}\n") if command[0] == python else Output(1, "ModuleNotFoundError\n")
        return self.answer if "import r" not in command[2] else None

    def matching(self, folder: str, pattern: str) -> tuple[str, ...]:
        wanted = f"{folder}/{pattern}".replace("**/", "*")
        return tuple(sorted(path for path in self.files if fnmatch(path, wanted)))

    def is_usable(self, device: str) -> bool:
        return device in self.allowed

    def is_device(self, path: str) -> bool:
        return path in self.files

    def users_of(self, device: str) -> tuple[str, ...]:
        return self.users if device == "/dev/ttyACM0" else ()

    def group_of(self, device: str) -> str:
        return "dialout"

    def groups(self) -> frozenset[str]:
        return frozenset(self.mine)

    def is_member(self, group: str) -> bool:
        return group in self.later


@pytest.fixture
def machine(monkeypatch: pytest.MonkeyPatch) -> MadeUp:
    monkeypatch.setattr("robosc.doctor.checks.left_aside", lambda: "")
    return MadeUp()


def problems(machine: Machine, *purposes: Purpose, server: str | None = None) -> dict[str, Finding]:
    return {item.part: item for item in examine(machine, purposes, server) if item.grade is not Grade.OK}


@pytest.mark.parametrize("purpose", Purpose)
def test_a_machine_that_has_everything_is_ready(machine: MadeUp, purpose: Purpose) -> None:
    assert problems(machine, purpose) == {}


def test_everything_is_reported_where_no_purpose_is_given(machine: MadeUp) -> None:
    parts = [item.part for item in examine(machine)]
    assert {"Python", "robosc", "extra bridge", "ROS 2", "rclpy", "middleware", "rospy", "colcon", "catkin"} <= set(
        parts
    )
    assert {"C compiler", "serial port", "udev names", "browser", "fonts"} <= set(parts)
    assert parts.count("server") == 0


MISSING = [
    (Purpose.SYNTH, "Python", "python_version", (3, 11, 9)),
    (Purpose.SYNTH, "Python", "python_version", (3, 14, 0)),
    (Purpose.SYNTH, "robosc", "versions", {"dd": "0.6.0"}),
    (Purpose.SYNTH, "robosc", "versions", {**VERSIONS, "dd": "0.5.99"}),
    (Purpose.SYNTH, "robosc", "versions", {**VERSIONS, "dd": "0.7"}),
    (Purpose.SERVER, "extra server", "versions", {**VERSIONS, "sqlalchemy": "2.0.35"}),
    (Purpose.BRIDGE, "extra bridge", "versions", {key: VERSIONS[key] for key in VERSIONS if key != "pyserial"}),
    (Purpose.VIEW, "extra view", "versions", {key: VERSIONS[key] for key in VERSIONS if key != "aiohttp"}),
    (Purpose.ROS2, "rclpy", "modules", {}),
    (Purpose.ROS2, "colcon", "programs", {"python3"}),
    (Purpose.ROS1, "rospy", "modules", {}),
    (Purpose.ROS1, "catkin", "programs", {"python3", "roscore"}),
    (Purpose.ROS1, "ROS 1 master", "programs", {"python3", "catkin"}),
    (Purpose.BRIDGE, "serial ports", "files", set()),
    (Purpose.BRIDGE, "serial port", "allowed", set()),
]


@pytest.mark.parametrize(("purpose", "part", "attribute", "value"), MISSING)
def test_what_is_missing_comes_with_a_fix(
    machine: MadeUp, purpose: Purpose, part: str, attribute: str, value: object
) -> None:
    setattr(machine, attribute, value)
    found = problems(machine, purpose)[part]
    assert found.grade is Grade.MISSING
    assert found.message and found.fix
    assert not is_ready(examine(machine, [purpose]))
    # A need of another purpose is no more than a note.
    if purpose is not Purpose.SYNTH:
        assert is_ready(examine(machine))
        assert problems(machine)[part].grade is Grade.NOTE


def test_without_the_kernel_the_report_says_where_to_read_about_it(
    machine: MadeUp, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert "kernel" not in problems(machine, Purpose.SYNTH)
    monkeypatch.setattr("robosc.doctor.checks.left_aside", lambda: "it was not made")
    found = problems(machine, Purpose.SYNTH)["kernel"]
    assert (found.grade, found.fix) == (Grade.NOTE, "docs/install.md, 'The kernel'")
    assert found.message.endswith("it was not made")
    assert is_ready(examine(machine, [Purpose.SYNTH]))


def test_ros_that_is_not_sourced(machine: MadeUp) -> None:
    machine.environment = {}
    assert problems(machine, Purpose.ROS2)["ROS 2"].grade is Grade.NOTE
    machine.modules = {}
    machine.files |= {"/opt/ros/humble/setup.bash", "/opt/ros/jazzy/setup.bash"}
    found = problems(machine, Purpose.ROS2)
    assert (found["ROS 2"].grade, found["ROS 2"].fix) == (Grade.MISSING, "source /opt/ros/jazzy/setup.bash")
    assert found["rclpy"].fix == "source /opt/ros/jazzy/setup.bash"


@pytest.mark.parametrize("codename", ["jazzy", "kilted", "noetic"])
def test_a_distribution_that_is_tested_is_fine(machine: MadeUp, codename: str) -> None:
    version = "1" if codename == "noetic" else "2"
    machine.environment = {"ROS_DISTRO": codename, "ROS_VERSION": version}
    (found,) = (item for item in examine(machine, [Purpose(f"ros{version}")]) if item.part == f"ROS {version}")
    assert (found.grade, found.message) == (Grade.OK, f"{codename} is sourced")


def test_a_distribution_that_is_not_tested_is_reported(machine: MadeUp) -> None:
    for codename in ("humble", "lyrical", "rolling"):
        machine.environment = {"ROS_DISTRO": codename, "ROS_VERSION": "2"}
        message = problems(machine, Purpose.ROS2)["ROS 2"].message
        assert message.startswith(f"{codename} is sourced; generated packages are tested with jazzy and kilted")
        assert ("interfaces are not known" in message) is (codename == "rolling")
    machine.environment = {"ROS_DISTRO": "melodic", "ROS_VERSION": "1"}
    assert "tested with noetic" in problems(machine, Purpose.ROS1)["ROS 1"].message
    # ROS 1 is no distribution of ROS 2.
    machine.environment = {"ROS_DISTRO": "noetic", "ROS_VERSION": "1"}
    assert "no distribution is sourced" in problems(machine, Purpose.ROS2)["ROS 2"].message


def test_a_middleware_that_is_not_the_wanted_one(machine: MadeUp) -> None:
    machine.environment = {**machine.environment, "RMW_IMPLEMENTATION": "rmw_cyclonedds_cpp"}
    assert "not rmw_cyclonedds_cpp" in problems(machine, Purpose.ROS2)["middleware"].message


def test_zenoh_is_named_and_a_missing_router_is_reported(machine: MadeUp) -> None:
    assert "Zenoh router" not in {item.part for item in examine(machine, [Purpose.ROS2])}
    machine.middleware = "rmw_zenoh_cpp"
    machine.answer = Output(1, "ConnectionRefusedError")
    found = problems(machine, Purpose.ROS2)
    assert found["middleware"].message.startswith("rmw_zenoh_cpp")
    assert found["Zenoh router"].grade is Grade.MISSING
    assert found["Zenoh router"].fix == "ros2 run rmw_zenoh_cpp rmw_zenohd"
    assert ["localhost", "7447"] in [list(command[-2:]) for command in machine.commands]
    assert problems(machine)["Zenoh router"].grade is Grade.NOTE
    machine.answer = Output(0, "")
    assert "Zenoh router" not in problems(machine, Purpose.ROS2)
    machine.environment = {**machine.environment, "ZENOH_CONFIG_OVERRIDE": "mode=client"}
    found = problems(machine, Purpose.ROS2)
    assert (found["Zenoh router"].grade, "ZENOH_CONFIG_OVERRIDE" in found["Zenoh router"].message) == (Grade.NOTE, True)


def test_zenoh_that_is_wanted_and_not_there_needs_its_router_too(machine: MadeUp) -> None:
    machine.environment = {**machine.environment, "RMW_IMPLEMENTATION": "rmw_zenoh_cpp"}
    machine.answer = None
    found = problems(machine, Purpose.ROS2)
    assert "not rmw_zenoh_cpp" in found["middleware"].message
    assert found["Zenoh router"].grade is Grade.MISSING


@pytest.mark.parametrize("python", ["/usr/bin/python3", "/venv/bin/python"])
def test_every_interpreter_is_asked_for_ros(machine: MadeUp, python: str) -> None:
    machine.modules["rclpy"] = python
    messages = [item.message for item in examine(machine, [Purpose.ROS2]) if item.part == "rclpy"]
    assert messages == [f"{python} imports it"]


def test_why_a_port_cannot_be_used(machine: MadeUp) -> None:
    machine.allowed = set()
    assert "usermod -aG dialout" in problems(machine, Purpose.BRIDGE)["serial port"].fix
    machine.later = {"dialout"}
    assert problems(machine, Purpose.BRIDGE)["serial port"].fix == "log in again"
    machine.mine = {"dialout"}
    assert "chmod" in problems(machine, Purpose.BRIDGE)["serial port"].fix


def test_who_holds_a_port_is_reported(machine: MadeUp) -> None:
    machine.users = ("turtlebot3_ros (41)",)
    found = problems(machine, Purpose.BRIDGE)["serial port"]
    assert (found.grade, found.message) == (Grade.NOTE, "/dev/ttyACM0 is used by turtlebot3_ros (41)")
    assert found.fix


def test_names_by_udev(machine: MadeUp) -> None:
    machine.files.discard("/dev/robosc-opencr")
    assert problems(machine, Purpose.BRIDGE)["udev names"].fix == ""
    machine.files.discard("/etc/udev/rules.d/60-robosc.rules")
    assert "60-robosc.rules" in problems(machine, Purpose.BRIDGE)["udev names"].fix


def test_a_server_is_asked_as_the_client_asks(machine: MadeUp) -> None:
    assert problems(machine, Purpose.SYNTH, server="lab") == {}
    assert machine.commands[-1][1:5] == ["-m", "robosc_client.command", "health", "--server"]
    machine.answer = Output(3, "robosc-client: no server answers at lab:50051\n")
    found = problems(machine, Purpose.SYNTH, server="lab")["server"]
    assert (found.grade, found.message) == (Grade.MISSING, "lab: robosc-client: no server answers at lab:50051")
    machine.answer = None
    assert "no answer in time" in problems(machine, Purpose.SYNTH, server="lab")["server"].message


@pytest.mark.parametrize(
    ("server", "host", "port"),
    [("lab", "lab", "50051"), ("lab:7", "lab", "7"), ("[::1]", "::1", "50051"), ("[::1]:7", "::1", "7")],
)
def test_without_the_client_a_server_is_asked_for_its_port(machine: MadeUp, server: str, host: str, port: str) -> None:
    del machine.versions["grpcio"]
    examine(machine, [], server)
    assert machine.commands[-1][-2:] == [host, port]


def test_it_runs_from_a_folder_too(machine: MadeUp) -> None:
    machine.is_installed = False
    assert problems(machine)["robosc"].grade is Grade.NOTE


class TestThisMachine:
    """The real machine behind the examination."""

    def test_a_program_that_hangs_is_ended_with_all_that_it_has_started(self) -> None:
        code = "import subprocess, sys; subprocess.run([sys.executable, '-c', 'import signal; signal.pause()'])"
        assert Machine().run([sys.executable, "-c", code], 0.5) is None

    def test_a_program_that_is_not_there(self) -> None:
        assert Machine().run(["/no/such/program"], 5) is None

    def test_output_and_status(self) -> None:
        code = "import sys; print(sys.stdin.read() + 'out', flush=True); sys.exit('err')"
        assert Machine().run([sys.executable, "-c", code], 60) == Output(1, "out\nerr\n")

    def test_devices(self, tmp_path: Path) -> None:
        machine = Machine()
        assert machine.is_device(os.devnull) and not machine.is_device(str(tmp_path)) and not machine.is_device("/none")
        assert machine.is_usable(os.devnull) and not machine.is_usable("/dev/none")
        assert isinstance(machine.group_of(os.devnull), str) and machine.group_of("/dev/none") == "dialout"
        assert not machine.is_member("no-such-group")
        assert machine.matching("/no/such/folder", "*") == ()
        assert machine.matching("/dev", "nul[l]") == ("/dev/null",)
        assert all(isinstance(name, str) for name in machine.groups())

    def test_users_of_a_device(self) -> None:
        ours, its = os.openpty()
        try:
            found = Machine().users_of(os.ttyname(its))
        finally:
            os.close(its)
            os.close(ours)
        assert [name for name in found if name.endswith(f" ({os.getpid()})")]
        assert Machine().users_of("/dev/robosc-no-such-device") == ()

    def test_packages(self) -> None:
        machine = Machine()
        assert machine.version("robosc-no-such-package") is None
        requirements = machine.requirements()
        assert requirements is not None and any(text.startswith("dd") for text in requirements)
        # A machine without a C compiler has no kernel.
        assert set(problems(machine, Purpose.SYNTH)) <= {"kernel"}


def test_the_command_prints_findings(
    machine: MadeUp, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("robosc.doctor.Machine", lambda: machine)
    assert main(["doctor", "--for", "ros2", "--for", "bridge"]) == 0
    assert "ok       Python: 3.12.1 (/venv/bin/python)\n" in capsys.readouterr().out
    machine.programs.discard("colcon")
    assert main(["doctor", "--for", "ros2"]) == 1
    lines = capsys.readouterr().out.splitlines()
    place = lines.index("missing  colcon: not installed; it builds ROS 2 packages")
    assert lines[place + 1] == "         fix: pip install colcon-common-extensions"
    assert main(["doctor", "--for", "ros2", "--json"]) == 1
    document = json.loads(capsys.readouterr().out)
    assert (document["ok"], document["purposes"]) == (False, ["ros2"])
    (missing,) = [item for item in document["findings"] if item["grade"] == "missing"]
    assert missing["part"] == "colcon" and missing["fix"]


def test_the_command_knows_every_purpose() -> None:
    assert tuple(Purpose) == command._PURPOSES


@pytest.mark.parametrize("server", ["", "a b", "-x", "a\nb"])
def test_what_is_no_server(server: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doctor", f"--server={server}"]) == 2
    assert "neither HOST nor HOST:PORT" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("version", "message"),
    [
        ((3, 10, 12), "3.10.12 is too old; RoboSC needs 3.12 or 3.13"),
        ((3, 11, 7), "3.11.7 is too old; RoboSC needs 3.12 or 3.13"),
        ((3, 12, 0), ""),
        ((3, 13, 9), ""),
        ((3, 14, 0), "3.14.0 is newer than what is tested; RoboSC needs 3.12 or 3.13"),
    ],
)
def test_versions_of_python(version: tuple[int, ...], message: str) -> None:
    assert unsupported(version) == message


def test_the_metadata_has_the_same_versions_of_python() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    versions = [f"{OLDEST[0]}.{minor}" for minor in range(OLDEST[1], NEWEST[1] + 1)]
    assert project["requires-python"] == f">={versions[0]},<{NEWEST[0]}.{NEWEST[1] + 1}"
    message = [line.rpartition(" ")[2] for line in project["classifiers"] if line.startswith("Programming Language")]
    assert message == versions
    matrix = (ROOT / "docs" / "install.md").read_text("utf-8")
    assert all(f"| {version} |" in matrix for version in versions)


def test_an_old_python_is_refused_with_its_version(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "version_info", (3, 11, 7, "final", 0))

    def load() -> Callable[[], int]:
        raise AssertionError("it is read all the same")

    with pytest.raises(SystemExit) as left:
        start("robosc", load)
    assert left.value.code == 2
    assert "robosc: Python 3.11.7 is too old; RoboSC needs 3.12 or 3.13" in capsys.readouterr().err


def test_what_an_old_python_reads_has_nothing_newer() -> None:
    names = ("__init__.py", "_version.py", "python_versions.py", "cli/__init__.py", "cli/command.py", "cli/starting.py")
    for name in names:
        ast.parse((ROOT / "robosc" / name).read_text("utf-8"), feature_version=(3, 10))
