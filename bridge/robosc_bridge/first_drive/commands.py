"""`robosc-bridge probe`, `setup-servo`, `calibrate` and `doctor`: the commands before the first drive."""

import argparse
import json
import math
import os
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robosc.doctor import Finding, Grade, Machine, Purpose, examine, is_ready
from robosc_bridge.assembly import drive_base, range_scanner
from robosc_bridge.configuration import ConfigurationError, load
from robosc_bridge.configuration.structure import Configuration
from robosc_bridge.devices.robots import ROBOTS
from robosc_bridge.driver_options import DriverOptionError
from robosc_bridge.errors import BridgeError, DeviceError
from robosc_bridge.first_drive import calibration
from robosc_bridge.first_drive.calibration import CalibrationError
from robosc_bridge.first_drive.ports import serial_ports, stable_name
from robosc_bridge.first_drive.servo_bus import BAUD_NUMBERS, BAUDS
from robosc_bridge.first_drive.servo_setup import MOST_ID, Change, RequestedSettings, ServoSetup
from robosc_bridge.host import Host
from robosc_bridge.transport.network_line import is_network_address
from robosc_bridge.transport.system_host import SYSTEM_HOST

if TYPE_CHECKING:
    from robosc_bridge.first_drive.probe import ProbedPort

WELL, NOT_WELL, WRONG_USE = 0, 1, 2

_EPILOG = "exit status: 0 all is well; 1 something is wrong or missing, or was declined; 2 wrong use or files"
_WHEELS = {"left": RequestedSettings(1, BAUDS[0], False), "right": RequestedSettings(2, BAUDS[0], True)}

type Ask = Callable[[str], str]
"""Asks a person something, and returns the answer."""


def add_commands(commands: Any) -> None:
    """Add the commands to subparsers of argparse."""
    probed = commands.add_parser(
        "probe", help="list what is plugged in (boards, servos, LiDARs) and the problems of each", epilog=_EPILOG
    )
    probed.add_argument(
        "--port",
        metavar="PATH",
        action="append",
        default=[],
        help="probe this port, or udpin:HOST:PORT for a rover; repeatable (default: all serial ports)",
    )
    probed.add_argument("--json", action="store_true", help="for programs")
    probed.set_defaults(run=_probe)

    setup = commands.add_parser(
        "setup-servo", help="set up a servo as a wheel: id, baud rate, direction", epilog=_EPILOG
    )
    setup.add_argument("--port", metavar="PATH", required=True, help="port of the adapter")
    setup.add_argument("--id", metavar="N", type=_id, help="its id (default: the only servo that answers)")
    setup.add_argument("--baud", metavar="N", type=_baud, help="its baud rate (default: found out)")
    setup.add_argument(
        "--wheel", choices=tuple(_WHEELS), help="as TurtleBot3 has it: left 1, right 2 and reversed, both at 1000000"
    )
    setup.add_argument("--new-id", metavar="N", type=_id, help=f"id to write, 0 to {MOST_ID}")
    setup.add_argument("--new-baud", metavar="N", type=_baud, help="baud rate to write")
    setup.add_argument("--direction", choices=("normal", "reverse"), help="direction to write")
    setup.add_argument("--yes", action="store_true", help="write without asking")
    setup.set_defaults(run=_setup)

    calibrate = commands.add_parser(
        "calibrate", help="measure wheels and LiDAR, with torque off and the robot moved by hand", epilog=_EPILOG
    )
    calibrate.add_argument("what", choices=tuple(_CALIBRATIONS), help="figure to measure")
    calibrate.add_argument("--config", metavar="FILE", type=Path, required=True, help="the configuration (YAML)")
    calibrate.add_argument(
        "--radius-factor",
        metavar="X",
        type=float,
        default=1.0,
        help="for wheel-separation: the factor that wheel-radius has measured (default: 1)",
    )
    calibrate.add_argument(
        "--json", action="store_true", help="for programs: the figures alone, questions go to stderr"
    )
    calibrate.set_defaults(run=_calibrate)

    doctor = commands.add_parser(
        "doctor", help="examine this computer, and the ports of a configuration; nothing is opened", epilog=_EPILOG
    )
    doctor.add_argument("--config", metavar="FILE", type=Path, help="the configuration (YAML), to be examined, too")
    doctor.add_argument("--json", action="store_true", help="for programs")
    doctor.set_defaults(run=_doctor)


def _id(text: str) -> int:
    if not text.isascii() or not text.isdecimal() or int(text) > MOST_ID:
        raise argparse.ArgumentTypeError(f"{text}: an id is a whole number from 0 to {MOST_ID}")
    return int(text)


def _baud(text: str) -> int:
    if not text.isascii() or not text.isdecimal() or int(text) not in BAUD_NUMBERS:
        raise argparse.ArgumentTypeError(f"{text}: a servo has {', '.join(map(str, sorted(BAUD_NUMBERS)))} baud")
    return int(text)


def _ask(question: str) -> str:
    sys.stderr.write(question)
    sys.stderr.flush()
    return sys.stdin.readline().strip()


# Devices that are plugged in.


def _probe(arguments: argparse.Namespace, host: Host = SYSTEM_HOST) -> int:
    # All drivers, which take long to load.
    from robosc_bridge.first_drive.probe import probe

    ports = arguments.port or serial_ports()
    found = [probe(port, host) for port in ports]
    if arguments.json:
        document = [{**asdict(one), "stable_name": _stable(one.port), "is_well": one.is_well} for one in found]
        sys.stdout.write(json.dumps({"ports": document}, indent=2) + "\n")
    elif not found:
        sys.stdout.write("there is no serial port: plug in the board and the LiDAR, and look at `dmesg`\n")
    else:
        for one in found:
            sys.stdout.writelines(f"{line}\n" for line in _port_lines(one))
    return WELL if found and all(one.is_well for one in found) else NOT_WELL


def _stable(port: str) -> str:
    return port if is_network_address(port) else stable_name(port)


def _port_lines(probed: "ProbedPort") -> list[str]:
    stable = _stable(probed.port)
    lines = [probed.port + (f" (better: {stable})" if stable != probed.port else "")]
    if probed.problem:
        lines.append(f"  ! {probed.problem}")
    for device in probed.devices:
        text = ", ".join(f"{name.replace('_', ' ')} {_word(value)}" for name, value in device.facts.items())
        lines.append(f"  {device.name}: {text}")
        lines += [f"    ! {problem}" for problem in device.problems]
    return lines


def _word(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return " ".join(map(str, value)) or "none" if isinstance(value, list) else str(value)


# Servos.


def _setup(arguments: argparse.Namespace, host: Host = SYSTEM_HOST, ask: Ask = _ask) -> int:
    usual = RequestedSettings() if arguments.wheel is None else _WHEELS[arguments.wheel]
    direction = None if arguments.direction is None else arguments.direction == "reverse"
    wish = RequestedSettings(
        usual.device if arguments.new_id is None else arguments.new_id,
        arguments.new_baud or usual.baud,
        usual.is_reversed if direction is None else direction,
    )
    line = host.open_port(arguments.port, BAUDS[0])
    try:
        setup = ServoSetup(line, host, arguments.port, BAUDS if arguments.baud is None else (arguments.baud,))
        device = setup.find(arguments.id)
        changes = setup.plan(wish)
        sys.stdout.write(f"{arguments.port}: servo {device} at {setup.baud} baud\n")
        sys.stdout.writelines(f"  {_change_text(change)}\n" for change in changes)
        if not changes:
            sys.stdout.write("  nothing is to be written\n")
            return WELL
        if not arguments.yes and ask("Torque goes off, and these are written for good. Go on? [y/N] ") not in (
            "y",
            "yes",
        ):
            sys.stdout.write("nothing was written\n")
            return NOT_WELL
        setup.write(changes)
    except DeviceError as error:
        sys.stderr.write(f"robosc-bridge: {error}\n")
        return NOT_WELL
    finally:
        line.close()
    sys.stdout.write(f"written: servo {setup.device} at {setup.baud} baud\n")
    return WELL


def _change_text(change: Change) -> str:
    if change.name == "baud rate":
        bauds = {number: baud for baud, number in BAUD_NUMBERS.items()}
        return (
            f"baud rate (address {change.address}): {bauds.get(change.before, change.before)} -> {bauds[change.after]}"
        )
    return f"{change.name} (address {change.address}): {change.before} -> {change.after}"


# Figures.


def _calibrate(arguments: argparse.Namespace, host: Host = SYSTEM_HOST, ask: Ask = _ask) -> int:
    configuration = load(arguments.config).configuration
    try:
        figures = _CALIBRATIONS[arguments.what](configuration, host, ask, arguments.radius_factor)
    except CalibrationError as error:
        sys.stderr.write(f"robosc-bridge: {error}\n")
        return NOT_WELL
    if arguments.json:
        sys.stdout.write(json.dumps(figures, indent=2) + "\n")
    else:
        sys.stdout.writelines(f"{name}: {value}\n" for name, value in figures.items())
    return WELL


def _by_hand(configuration: Configuration, host: Host, ask: Ask, begin: str, end: str) -> calibration.RolledMotion:
    """The way on which a person moves the robot between two answers."""
    _, separation_m = _wheels(configuration)
    base = drive_base(configuration, host)
    base.open()
    try:
        ask(begin)
        with _answer_to(end, host, ask) as is_over:
            return calibration.follow(base, host, is_over, separation_m)
    finally:
        base.close()


@contextmanager
def _answer_to(question: str, host: Host, ask: Ask) -> Iterator[Callable[[], bool]]:
    """Ask a question in a thread of its own; gives a function that returns whether it was answered."""
    is_answered = threading.Event()

    def wait() -> None:
        ask(question)
        is_answered.set()

    waiting = host.thread(wait, "person")
    waiting.start()
    yield is_answered.is_set
    waiting.join()


def _number(ask: Ask, question: str) -> float:
    answer = ask(question).replace(",", ".")
    try:
        found = float(answer)
    except ValueError as error:
        raise CalibrationError(f"'{answer}' is no number") from error
    if not 0.0 < found < 1e3:
        raise CalibrationError(f"'{answer}' is not possible")
    return found


def _wheels(configuration: Configuration) -> tuple[float, float]:
    """Radius of the wheels and distance between them, as the odometry goes by."""
    if configuration.drive.driver not in ("opencr", "dynamixel"):
        raise CalibrationError(
            "only the wheels of `opencr` and `dynamixel` are measured; a rover's autopilot has its own"
        )
    robot = configuration.robot
    if isinstance(robot, str):
        return ROBOTS[robot].wheel_radius_m, ROBOTS[robot].wheel_separation_m
    radius_m = configuration.drive.options.get("wheel_radius_m")
    if not isinstance(radius_m, int | float):
        raise CalibrationError("drive.options.wheel_radius_m is missing: give the approximate radius of the wheels")
    return float(radius_m), robot.wheel_separation_m


def _radius(configuration: Configuration, host: Host, ask: Ask, factor: float) -> dict[str, float]:
    radius_m, _ = _wheels(configuration)
    begin = "Torque is off. Put the robot at the beginning of a tape measure; press Enter. "
    end = "Push it straight ahead, 2 m or more, without lifting it; press Enter. "
    way = _by_hand(configuration, host, ask, begin, end)
    measured_m = _number(ask, "How many metres does the tape measure say? ")
    found_m = calibration.wheel_radius_m(way, measured_m, radius_m)
    return {
        "odometry_m": round(abs(way.forward_m), 4),
        "measured_m": measured_m,
        "wheel_radius_m": round(found_m, 5),
        "radius_factor": round(found_m / radius_m, 5),
    }


def _separation(configuration: Configuration, host: Host, ask: Ask, factor: float) -> dict[str, float]:
    _, separation_m = _wheels(configuration)
    begin = "Torque is off. Mark on the floor where the robot looks; press Enter. "
    end = "Turn it on the spot, by 5 whole revolutions or more, back to the mark; press Enter. "
    way = _by_hand(configuration, host, ask, begin, end)
    revolutions = _number(ask, "How many revolutions was it? ")
    if revolutions != int(revolutions):
        raise CalibrationError("turn it by whole revolutions, back to the mark")
    found_m = calibration.wheel_separation_m(way, int(revolutions), separation_m, factor)
    return {"odometry_rad": round(abs(way.rotation_rad), 4), "wheel_separation_m": round(found_m, 5)}


def _front(configuration: Configuration, host: Host, ask: Ask, factor: float) -> dict[str, float]:
    if configuration.scanner is None:
        raise CalibrationError("the configuration has no scanner")
    given = configuration.scanner.options.get("front_rad", 0.0)
    if not isinstance(given, (int, float)):
        raise DriverOptionError("option 'front_rad' is no number")
    ask("Put the robot squarely before a plain wall, half a metre to a metre away; press Enter. ")
    scanner = range_scanner(configuration.scanner, host)
    scanner.open()
    try:
        found = calibration.lidar_front_rad(scanner, host, float(given))
    finally:
        scanner.close()
    return {"front_rad": round(found, 4), "change_deg": round((found - float(given)) * 57.29578, 2)}


def _place(configuration: Configuration, host: Host, ask: Ask, factor: float) -> dict[str, float]:
    from robosc_bridge.first_drive.lidar_place import lidar_place

    if configuration.scanner is None:
        raise CalibrationError("the configuration has no scanner")
    _, separation_m = _wheels(configuration)
    base, scanner = drive_base(configuration, host), range_scanner(configuration.scanner, host)
    base.open()
    try:
        scanner.open()
        ask(
            "Torque is off. Put the robot before a plain wall that is 1 m wide or more, half a metre to a metre away, "
            "looking at it; press Enter. "
        )
        with _answer_to(
            "Turn it on the spot by a whole revolution or more, slowly: 20 seconds for each; press Enter. ", host, ask
        ) as is_over:
            found = lidar_place(base, scanner, host, is_over, separation_m)
    finally:
        scanner.close()
        base.close()
    return {
        "x_m": round(found.x_m, 4),
        "y_m": round(found.y_m, 4),
        "deviation_m": round(found.deviation_m, 5),
        "stray_m": round(found.stray_m, 4),
        "rotation_deg": round(math.degrees(found.rotation_rad), 1),
        "scans": found.sightings,
    }


_CALIBRATIONS: dict[str, Callable[[Configuration, Host, Ask, float], dict[str, float]]] = {
    "wheel-radius": _radius,
    "wheel-separation": _separation,
    "lidar-front": _front,
    "lidar-place": _place,
}


# The computer.


def _doctor(arguments: argparse.Namespace) -> int:
    found = list(examine(Machine(), (Purpose.BRIDGE,)))
    if arguments.config is not None:
        found += _configuration_findings(arguments.config)
    is_well = is_ready(found)
    if arguments.json:
        findings = [{**asdict(item), "grade": str(item.grade)} for item in found]
        sys.stdout.write(json.dumps({"ok": is_well, "findings": findings}, indent=2) + "\n")
    else:
        for item in found:
            fix = f"\n{'':9}{item.fix}" if item.fix else ""
            sys.stdout.write(f"{item.grade:8} {item.part}: {item.message}{fix}\n")
    return WELL if is_well else NOT_WELL


def _configuration_findings(file: Path) -> list[Finding]:
    part = "configuration"
    try:
        configuration = load(file).configuration
        drive_base(configuration)
        if configuration.scanner is not None:
            range_scanner(configuration.scanner)
    except (ConfigurationError, BridgeError, OSError) as error:
        return [Finding(part, Grade.MISSING, " ".join(str(error).split()), f"correct {file}")]
    found = [Finding(part, Grade.OK, str(file))]
    ports = {"drive": configuration.drive.port}
    if configuration.scanner is not None:
        ports["scanner"] = configuration.scanner.port
    for name, port in ports.items():
        if not is_network_address(port):
            found.append(_port_finding(name, port))
    return found


def _port_finding(name: str, port: str) -> Finding:
    part = f"{name}.port"
    if not Path(port).exists():
        return Finding(part, Grade.MISSING, f"{port}: there is no such port", "`robosc-bridge probe` lists the ports")
    if not os.access(port, os.R_OK | os.W_OK):
        return Finding(
            part, Grade.MISSING, f"{port}: no permission", 'sudo usermod -aG dialout "$USER", then log in again'
        )
    stable = stable_name(port)
    if stable != port and not Path(port).is_symlink():
        return Finding(
            part, Grade.NOTE, f"{port}: this name depends on the order of plugging in", f"{name}.port: {stable}"
        )
    return Finding(part, Grade.OK, f"{port} can be read and written")
