"""Probe of ports: boards, servos, LiDARs and rovers that answer there, with the problems of each.

It only sends pings, read requests, and the commands that start a LiDAR's motor and stop it again.
"""

import contextlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

from robosc_bridge.devices.dynamixel_bus import DynamixelBus
from robosc_bridge.devices.lidar import LDS01, LDS02, LDS03, Lidar, Model
from robosc_bridge.devices.mavlink_link import OWN_COMPONENT, OWN_SYSTEM
from robosc_bridge.devices.opencr import BAUD as OPENCR_BAUD
from robosc_bridge.devices.robots import ROBOTS
from robosc_bridge.errors import DeviceError, LineError
from robosc_bridge.first_drive.servo_bus import LIMIT_S, find_servos
from robosc_bridge.host import Host
from robosc_bridge.protocol import opencr
from robosc_bridge.protocol.mavlink import Codec, Decoder
from robosc_bridge.protocol.mavlink_messages import ARDUPILOT, GROUND_ROVER, Heartbeat, vehicle_message
from robosc_bridge.transport.network_line import is_network_address
from robosc_bridge.transport.system_host import SYSTEM_HOST, open_line

_SCAN_S = 2.5
_HEARTBEATS_S = 1.5
_VEHICLE_BAUDS = (57_600, 115_200)
_LOW_V = 11.1
_LIDARS: tuple[Model[Any], ...] = (LDS02, LDS01, LDS03)


@dataclass(frozen=True)
class FoundDevice:
    """A device.

    Attributes:
        kind: `opencr`, `servo`, `lidar` or `vehicle`.
        name: Name for a person.
        facts: Facts that it reports, by name.
        problems: Problems with it, each with what to do; empty: none.
    """

    kind: str
    name: str
    facts: dict[str, Any] = field(default_factory=dict)
    problems: tuple[str, ...] = ()


@dataclass(frozen=True)
class ProbedPort:
    """A port after it was probed.

    Attributes:
        port: Its name.
        devices: Devices that answer there.
        problem: Reason why the port cannot be used, or a note that no device answers; empty: a device answers.
    """

    port: str
    devices: tuple[FoundDevice, ...] = ()
    problem: str = ""

    @property
    def is_well(self) -> bool:
        """True if something answers, and nothing is wrong with it."""
        return bool(self.devices) and not any(device.problems for device in self.devices)


def probe(path: str, host: Host = SYSTEM_HOST) -> ProbedPort:
    """Return what answers at a port; takes up to half a minute where nothing does.

    Args:
        path: Path of a serial port, or an address of `transport.network_line`.
        host: Host with this port.
    """
    trials: tuple[Callable[[str, Host], Iterator[FoundDevice]], ...]
    trials = (
        (_vehicles,) if is_network_address(path) else (_opencr, _rotating_lidar, _servos, _vehicles, _started_lidar)
    )
    try:
        for trial in trials:
            found = tuple(trial(path, host))
            if found:
                return ProbedPort(path, found)
    except LineError as error:
        return ProbedPort(path, problem=error.problem)
    nothing = "nothing answers: no OpenCR with firmware for ROS 2, no servo, no LiDAR, no rover"
    return ProbedPort(path, problem=f"{nothing}; is its power on?")


def _opencr(path: str, host: Host) -> Iterator[FoundDevice]:
    line = host.open_port(path, OPENCR_BAUD)
    try:
        bus = DynamixelBus(line, lambda device: "OpenCR", host=host)
        bus.begin(LIMIT_S)
        try:
            model, firmware = bus.ping(opencr.DEVICE)
            bus.settle(opencr.DEVICE)
        except DeviceError:
            return
        yield _board(bus, model, firmware)
    finally:
        line.close()


def _board(bus: DynamixelBus, model: int, firmware: int) -> FoundDevice:
    facts: dict[str, Any] = {"model_number": model, "firmware": firmware}
    problems = []
    if model != opencr.MODEL_NUMBER:
        return FoundDevice("opencr", f"device 200 of model {model}", facts, ("this is no OpenCR",))
    if firmware != opencr.FIRMWARE:
        problems.append(
            f"its firmware is version {firmware}, not {opencr.FIRMWARE}: load TurtleBot3's present one for ROS 2"
        )
    with contextlib.suppress(DeviceError):
        bus.begin(LIMIT_S)
        information = int.from_bytes(bus.read(opencr.DEVICE, opencr.MODEL_INFORMATION, 4).data, "little")
        facts["robots"] = [robot.name for robot in ROBOTS.values() if information in robot.opencr_information]
        if not facts["robots"]:
            problems.append(f"its firmware is for no robot that is known here (it reports {information})")
        bus.begin(LIMIT_S)
        block = opencr.decode_block(bus.read(opencr.DEVICE, opencr.BLOCK_ADDRESS, opencr.BLOCK_LENGTH).data)
        pressed = [name for name, is_pressed in block.buttons.items() if is_pressed]
        facts |= {
            "battery_v": block.battery_v,
            "uptime_s": block.uptime_ms / 1000,
            "has_motors": block.has_motors,
            "is_torque_on": block.is_torque_on,
            "pressed": pressed,
        }
        if not block.has_motors or block.device_status:
            problems.append("it found no wheel motors when it started: check their cables, then switch it off and on")
        if block.battery_v < _LOW_V:
            problems.append(f"the battery has {block.battery_v:.2f} V; below {_LOW_V} V the robot stops: charge it")
        if pressed:
            problems.append(
                f"pressed: {', '.join(pressed)}; its own test drive begins after 3 s, and adds to every command"
            )
        bus.begin(LIMIT_S)
        left_by_others = bus.read(opencr.DEVICE, opencr.PROFILE_ACCELERATIONS, len(opencr.NO_PROFILE)).data
        facts["profile_accelerations"] = [int.from_bytes(left_by_others[at : at + 4], "little") for at in (0, 4)]
    return FoundDevice("opencr", "OpenCR", facts, tuple(problems))


def _servos(path: str, host: Host) -> Iterator[FoundDevice]:
    line = host.open_port(path, OPENCR_BAUD)
    try:
        found = find_servos(line, host)
    finally:
        line.close()
    for servo in found:
        facts = {"id": servo.device, "baud": servo.baud, "model_number": servo.model_number, "firmware": servo.firmware}
        yield FoundDevice("servo", f"{servo.name}, id {servo.device}", facts | servo.registers, servo.problems)


def _rotating_lidar(path: str, host: Host) -> Iterator[FoundDevice]:
    """The one that rotates by itself: it is only listened to."""
    yield from _lidar(path, host, LDS02)


def _started_lidar(path: str, host: Host) -> Iterator[FoundDevice]:
    for model in _LIDARS[1:]:
        found = list(_lidar(path, host, model))
        if found:
            yield from found
            return


def _lidar(path: str, host: Host, model: Model[Any]) -> Iterator[FoundDevice]:
    scanner = Lidar(model, path, host=host)
    try:
        scanner.open()
        scan, end_s = None, host.monotonic() + _SCAN_S
        while scan is None and host.monotonic() < end_s:
            scan = scanner.receive(end_s - host.monotonic())
            # Another device sends no frames either: it is not waited for.
            if scan is None and not scanner.counters.frames and host.monotonic() > end_s - _SCAN_S / 2:
                break
        baud, counters = scanner.baud, scanner.counters
    finally:
        scanner.close()
    # By chance, noise has a frame now and then.
    if scan is None and counters.frames < 10:
        return
    facts: dict[str, Any] = {"driver": model.name, "baud": baud, "frames": counters.frames}
    facts["bad_frames"] = counters.bad_frames
    problems = []
    if scan is None:
        problems.append("it sends frames, and makes no full revolution: does something hold it?")
    else:
        valid = sum(range_m == range_m for range_m in scan.ranges_m)
        facts |= {"revolutions_per_s": round(scan.revolutions_per_s, 2), "valid_ranges": valid}
        if valid < len(scan.ranges_m) // 10:
            problems.append(f"of {len(scan.ranges_m)} ranges {valid} are valid: is it covered?")
    yield FoundDevice("lidar", model.name.upper().replace("LDS", "LDS-"), facts, tuple(problems))


def _vehicles(path: str, host: Host) -> Iterator[FoundDevice]:
    for baud in (0,) if is_network_address(path) else _VEHICLE_BAUDS:
        found: dict[tuple[int, int], Heartbeat] = {}
        line = open_line(path, baud, host)
        try:
            decoder = Decoder(Codec(OWN_SYSTEM, OWN_COMPONENT), vehicle_message)
            end_s = host.monotonic() + _HEARTBEATS_S
            while (left_s := end_s - host.monotonic()) > 0:
                for message in decoder.feed(line.read(left_s)):
                    if isinstance(message.content, Heartbeat):
                        found[message.system, message.component] = message.content
        finally:
            line.close()
        for (system, component), heartbeat in found.items():
            yield _vehicle(system, component, heartbeat, baud)
        if found:
            return


def _vehicle(system: int, component: int, heartbeat: Heartbeat, baud: int) -> FoundDevice:
    facts: dict[str, Any] = {"system": system, "component": component, "baud": baud or None}
    facts |= {"kind": heartbeat.kind, "autopilot": heartbeat.autopilot, "mode": heartbeat.mode}
    facts["is_armed"] = heartbeat.is_armed
    problems = []
    if (heartbeat.kind, heartbeat.autopilot) != (GROUND_ROVER, ARDUPILOT):
        problems.append("it is no ArduPilot Rover (type 10, autopilot 3)")
    elif heartbeat.is_armed:
        problems.append("it is armed: somebody drives it")
    return FoundDevice("vehicle", f"MAVLink vehicle {system}/{component}", facts, tuple(problems))
