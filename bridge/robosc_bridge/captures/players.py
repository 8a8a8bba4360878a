"""Players of a line's records, one for each kind of line: they show how the drivers' decoders interpret them.

The player of a LiDAR is its driver, on a host whose time and bytes are those of the capture. Requests to the wheels are
the recorded ones: the players of these lines find the answers to the requests, and pass them through the decoders and
the odometry of the drivers.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from dynamixel_sdk import INST_PING, INST_READ, INST_SYNC_READ, INST_SYNC_WRITE, INST_WRITE

from robosc_bridge.captures.capture_file import Kind, LineInfo, Record
from robosc_bridge.devices.board_yaw import BoardYaw
from robosc_bridge.devices.interface import DriveLimits, Pose, Scan, Velocity
from robosc_bridge.devices.kinematics import body_velocity
from robosc_bridge.devices.lidar import Lidar
from robosc_bridge.devices.mavlink_odometry import VehicleTracker, estimate
from robosc_bridge.devices.mavlink_state import VehicleState
from robosc_bridge.devices.obstacle_rounds import ObstacleRounds
from robosc_bridge.devices.odometry import Odometry
from robosc_bridge.devices.plausibility import Verdict, WheelCounts, wheel_judge
from robosc_bridge.devices.robots import ROBOTS, Wheels
from robosc_bridge.driver_registry import Kind as DriverKind
from robosc_bridge.driver_registry import available_drivers, make_range_scanner
from robosc_bridge.errors import LineLostError
from robosc_bridge.protocol import opencr, servo
from robosc_bridge.protocol.dynamixel import status_of
from robosc_bridge.protocol.dynamixel_frames import Packet, PacketDecoder
from robosc_bridge.protocol.framing import FrameCounts
from robosc_bridge.protocol.mavlink import Codec, Decoder
from robosc_bridge.protocol.mavlink_messages import (
    Heartbeat,
    Message,
    ObstacleRing,
    SectorDistance,
    vehicle_message,
)
from robosc_bridge.transport.system_host import SystemHost

_NS = 1_000_000_000
_SILENCE_S = 0.5
# Time by which answers may come late.
_COUNTS_LAG_S = 0.1
# A capture does not say what the vehicle may be commanded; what any body may do holds.
_ANY_BODY = DriveLimits(0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Item:
    """Finding of a decoder in a line's bytes.

    Attributes:
        time_s: Time since the capture began, in seconds.
        line: Name of the line.
        kind: `reading`, `scan`, `request`, `text`, `event` or `problem`.
        values: Values by name.
    """

    time_s: float
    line: str
    kind: str
    values: dict[str, Any]


@dataclass
class Summary:
    """Figures of a line.

    Attributes:
        driver: Driver that used the line.
        readings: Readings of a drive base.
        scans: Full revolutions, or rounds of obstacles.
        frames: Well-formed frames that came.
        bad_frames: Frames with a wrong checksum or impossible contents.
        skipped_bytes: Received bytes that belong to no frame.
        bytes_in: Bytes that came.
        bytes_out: Bytes that were sent.
        unanswered: Requests that got no answer before the next one.
        problems: Number of problems of each kind.
    """

    driver: str
    readings: int = 0
    scans: int = 0
    frames: int = 0
    bad_frames: int = 0
    skipped_bytes: int = 0
    bytes_in: int = 0
    bytes_out: int = 0
    unanswered: int = 0
    problems: dict[str, int] = field(default_factory=dict)

    def note(self, item: Item) -> None:
        """Count an item."""
        self.readings += item.kind == "reading"
        self.scans += item.kind == "scan"
        if item.kind == "problem":
            what = str(item.values["problem"])
            self.problems[what] = self.problems.get(what, 0) + 1

    def count(self, counts: FrameCounts) -> None:
        """Take over the counts of a decoder."""
        self.frames, self.bad_frames, self.skipped_bytes = counts.frames, counts.bad_frames, counts.skipped_bytes


def play(info: LineInfo, records: Sequence[Record], begin_ns: int, summary: Summary) -> Iterator[Item]:
    """Yield what the decoders of a line make of its records, in the order of time; the summary grows with it."""
    for record in records:
        summary.bytes_in += len(record.data) if record.kind is Kind.IN else 0
        summary.bytes_out += len(record.data) if record.kind is Kind.OUT else 0
    found: Iterable[Item]
    if info.driver in ("opencr", "dynamixel"):
        found = _Servos(info, begin_ns, summary).play(records)
    elif info.driver == "mavlink-rover":
        found = _Vehicle(info, begin_ns, summary).play(records)
    elif info.driver in {driver.name for driver in available_drivers(DriverKind.RANGE_SCANNER)}:
        found = _lidar(info, records, begin_ns, summary)
    else:
        found = [Item(0.0, info.name, "problem", {"problem": f"there is no driver '{info.driver}' here"})]
    for item in found:
        summary.note(item)
        yield item


def _motion(pose: Pose, velocity: Velocity, wheels_m_s: tuple[float, float]) -> dict[str, Any]:
    return {
        "x_m": round(pose.x_m, 6),
        "y_m": round(pose.y_m, 6),
        "heading_rad": round(pose.heading_rad, 6),
        "linear_m_s": round(velocity.linear_m_s, 6),
        "angular_rad_s": round(velocity.angular_rad_s, 6),
        "wheels_m_s": [round(speed, 6) for speed in wheels_m_s],
    }


def _ranges(ranges_m: Sequence[float]) -> dict[str, Any]:
    valid = [range_m for range_m in ranges_m if math.isfinite(range_m)]
    return {
        "valid": len(valid),
        "nearest_m": round(min(valid), 4) if valid else None,
        "nearest_deg": ranges_m.index(min(valid)) if valid else None,
        "ranges_m": [round(range_m, 4) if math.isfinite(range_m) else None for range_m in ranges_m],
    }


class _Player:
    """Base of the players of request and answer.

    Args:
        info: The line.
        begin_ns: Time at which the capture began.
        summary: Figures of the line, which grow.
    """

    def __init__(self, info: LineInfo, begin_ns: int, summary: Summary) -> None:
        self.info = info
        self.begin_ns = begin_ns
        self.summary = summary
        self.time_s = 0.0

    def item(self, kind: str, **values: Any) -> Item:
        """Return an item of now."""
        return Item(self.time_s, self.info.name, kind, values)

    def problem(self, problem: str, **values: Any) -> Item:
        """Return a problem of now."""
        return self.item("problem", problem=problem, **values)


class _Servos(_Player):
    """Requests to OpenCR or to two servos, and their answers."""

    def __init__(self, info: LineInfo, begin_ns: int, summary: Summary) -> None:
        super().__init__(info, begin_ns, summary)
        self._out, self._in = PacketDecoder(), PacketDecoder()
        self._wheels = _wheels_of(info)
        self._odometry = Odometry(self._wheels.tick_m, self._wheels.separation_m)
        self._judge = wheel_judge("", _COUNTS_LAG_S)
        self._yaw = BoardYaw("") if info.options.get("heading", "fused") == "fused" else None
        motors = info.options.get("motors", (1, 2))
        self._motors: tuple[int, ...] = tuple(motors) if isinstance(motors, (list, tuple)) else (1, 2)
        mirrored = info.options.get("mirrored")
        if not (isinstance(mirrored, list | tuple) and len(mirrored) == 2):
            mirrored = (False, True)
        # Mounted the other way round, one counts backward unless it is set to reverse.
        self._mirrored = dict(zip(self._motors, map(bool, mirrored), strict=False))
        self._signs = {motor: -1 if is_mirrored else 1 for motor, is_mirrored in self._mirrored.items()}
        self._asked: dict[int, Packet] = {}
        self._measured: dict[int, servo.Measurement] = {}
        self._answered_s: float | None = None

    def play(self, records: Sequence[Record]) -> Iterator[Item]:
        for record in records:
            self.time_s = (record.time_ns - self.begin_ns) / _NS
            match record.kind:
                case Kind.EVENTS:
                    if record.event.get("event") in ("open", "close", "lost line", "lost"):
                        yield self.item("event", **record.event)
                    if record.event.get("event") == "open":
                        self._judge.forget()
                        self._odometry = self._odometry.rebased()
                    self._in.forget()
                    self._out.forget()
                case Kind.OUT:
                    for packet in self._out.feed(record.data):
                        yield from self._request(packet)
                case Kind.IN:
                    for packet in self._in.feed(record.data):
                        yield from self._answer(packet)
        self.summary.count(self._in.counts)
        if self._out.counts.bad_frames or self._out.counts.skipped_bytes:
            yield self.problem("requests in the capture are damaged")

    def _request(self, packet: Packet) -> Iterator[Item]:
        self.summary.unanswered += len(self._asked)
        self._asked.clear()
        match packet.instruction:
            case _ if packet.instruction == INST_SYNC_READ:
                self._asked = dict.fromkeys(packet.parameters[4:], packet)
                self._measured = {}
            case _ if packet.instruction != INST_SYNC_WRITE:
                self._asked = {packet.device: packet}
        if packet.instruction in (INST_WRITE, INST_SYNC_WRITE):
            address = int.from_bytes(packet.parameters[:2], "little")
            is_servo = self.info.driver == "dynamixel"
            if address == (servo.TORQUE if is_servo else opencr.TORQUE):
                yield self.item("request", torque=bool(packet.parameters[-1]))

    def _answer(self, packet: Packet) -> Iterator[Item]:
        if not packet.is_answer:
            # Adapters may return what was sent.
            return
        status = status_of([255, 255, 253, 0, packet.device, 0, 0, packet.instruction, *packet.parameters, 0, 0])
        asked = self._asked.pop(packet.device, None)
        if status is None or asked is None:
            yield self.problem("an answer that nobody waits for", device=packet.device)
            return
        if self._answered_s is not None and self.time_s - self._answered_s > _SILENCE_S:
            yield self.problem(
                f"silence of more than {_SILENCE_S:g} s", seconds=round(self.time_s - self._answered_s, 3)
            )
        self._answered_s = self.time_s
        if status.is_alert:
            yield self.problem(f"device {packet.device} has a hardware error")
        if status.number:
            yield self.problem(f"device {packet.device} refuses a request: {status.refusal}")
        elif asked.instruction in (INST_READ, INST_SYNC_READ):
            address = int.from_bytes(asked.parameters[:2], "little")
            length = int.from_bytes(asked.parameters[2:4], "little")
            if len(status.data) != length:
                yield self.problem(f"device {packet.device} answers with another length than was asked for")
            else:
                yield from self._data(packet.device, address, status.data)
        elif asked.instruction == INST_PING and len(status.data) == 3:
            yield self.item(
                "event",
                event="ping",
                device=packet.device,
                model=int.from_bytes(status.data[:2], "little"),
                firmware=status.data[2],
            )

    def _data(self, device: int, address: int, data: bytes) -> Iterator[Item]:
        if self.info.driver == "opencr":
            if (address, len(data)) == (opencr.BLOCK_ADDRESS, opencr.BLOCK_LENGTH):
                yield from self._board(data)
            return
        if address <= servo.DRIVE_MODE < address + len(data) and device in self._signs:
            is_reverse = bool(data[servo.DRIVE_MODE - address] & servo.REVERSE)
            self._signs[device] = 1 if is_reverse == self._mirrored[device] else -1
        if (address, len(data)) == (servo.MEASUREMENT_ADDRESS, servo.MEASUREMENT_LENGTH):
            self._measured[device] = servo.decode_measurement(data)
            if set(self._measured) == set(self._motors):
                yield from self._pair([self._measured[motor] for motor in self._motors])
                self._measured = {}

    def _moved(self, ticks: tuple[int, int], raw: tuple[int, int], block: opencr.Block | None = None) -> Iterator[Item]:
        """Yield the problem of counts that cannot be; move the odometry by others, and yield their reading."""
        verdict = self._judge.judge(WheelCounts(ticks, raw), self.time_s)
        if verdict is Verdict.REFUSED:
            yield self._refused("; ".join(filter(None, self._judge.excess)))
            return
        if verdict is Verdict.ANEW:
            is_left, is_right = map(bool, self._judge.excess)
            self._odometry = self._odometry.rebased(is_left, is_right)
            yield self.problem("the wheels count from another place")
        measured = None if self._yaw is None or block is None else self._yaw.rotation(block)
        self._odometry = self._odometry.advanced(*ticks, measured)
        left_m_s, right_m_s = (speed * self._wheels.raw_m_s for speed in raw)
        velocity = body_velocity(left_m_s, right_m_s, self._wheels.separation_m)
        yield self.item("reading", **_motion(self._odometry.pose, velocity, (left_m_s, right_m_s)))

    def _refused(self, reason: str) -> Item:
        return self.problem("a reading that cannot be is refused", reason=reason)

    def _board(self, data: bytes) -> Iterator[Item]:
        reason = opencr.impossibility(data)
        if reason:
            yield self._refused(reason)
            return
        block = opencr.decode_block(data)
        more = {
            "is_torque_on": block.is_torque_on,
            "battery_v": block.battery_v,
            "uptime_ms": block.uptime_ms,
            "buttons": [name for name, is_pressed in block.buttons.items() if is_pressed],
        }
        yield from _with(self._moved(block.ticks, block.velocities_raw, block), more)

    def _pair(self, measured: Sequence[servo.Measurement]) -> Iterator[Item]:
        left, right = measured[0], measured[-1]
        signs = [self._signs[motor] for motor in self._motors]
        found = self._moved(
            (signs[0] * left.ticks, signs[-1] * right.ticks),
            (signs[0] * left.velocity_raw, signs[-1] * right.velocity_raw),
        )
        more = {
            "battery_v": min(one.voltage_v for one in measured),
            "temperature_c": max(one.temperature_c for one in measured),
        }
        yield from _with(found, more)


def _with(items: Iterable[Item], more: dict[str, Any]) -> Iterator[Item]:
    """Yield items, the readings among them with more values."""
    for item in items:
        yield replace(item, values=item.values | more) if item.kind == "reading" else item


def _wheels_of(info: LineInfo) -> Wheels:
    """Return the wheels that the odometry went by; those of a Burger where the capture does not say."""
    known = ROBOTS.get(info.robot) or ROBOTS["burger"]
    if info.robot or not info.separation_m:
        return known.wheels
    radius_m = _above_zero(info.options.get("wheel_radius_m"), known.wheel_radius_m)
    return Wheels(radius_m, info.separation_m, _above_zero(info.options.get("gear_ratio"), 1.0))


def _above_zero(value: object, usual: float) -> float:
    """Return a number of an untrusted file."""
    return float(value) if isinstance(value, int | float) and math.isfinite(value) and value > 0 else usual


class _Vehicle(_Player):
    """Messages of a MAVLink rover."""

    def play(self, records: Sequence[Record]) -> Iterator[Item]:
        options = self.info.options
        own = (_number(options.get("own_system"), 254), _number(options.get("own_component"), 191))
        system = options.get("system")
        state = VehicleState(system if isinstance(system, int) else None)
        decoder = Decoder(Codec(*own), vehicle_message)
        tracker, rounds = VehicleTracker("", _ANY_BODY), ObstacleRounds()
        for record in records:
            self.time_s = (record.time_ns - self.begin_ns) / _NS
            if record.kind is Kind.EVENTS:
                decoder.forget()
                yield self.item("event", **record.event)
            if record.kind is not Kind.IN:
                continue
            for message in decoder.feed(record.data):
                before, state = state, state.after(message, self.time_s, own)
                yield from self._reported(message, before, state)
                yield from self._seen(message, state, rounds)
                yield from self._tracked(state, tracker)
        yield from self._texts(state, state.at_end())
        self.summary.count(decoder.counts)

    def _tracked(self, state: VehicleState, tracker: VehicleTracker) -> Iterator[Item]:
        """Yield the reading of a new estimate, or why it does not count."""
        refused, begun_anew = tracker.judge.refused, tracker.judge.begun_anew
        if tracker.take(estimate(state)):
            if tracker.judge.begun_anew > begun_anew:
                yield self.problem("the vehicle's estimate has jumped")
            batteries = [found for found in (state.battery, *state.packs.values()) if found is not None]
            yield self.item(
                "reading",
                **_motion(tracker.odometry.pose, tracker.odometry.velocity, (math.nan, math.nan))
                | {"wheels_m_s": None},
                battery_v=next((found.voltage_v for found in batteries if found.voltage_v is not None), None),
            )
        elif tracker.judge.refused > refused:
            yield self.problem("a reading that cannot be is refused", reason="; ".join(tracker.judge.excess))

    def _seen(self, message: Message, state: VehicleState, rounds: ObstacleRounds) -> Iterator[Item]:
        """Yield the scan that a message completes."""
        if isinstance(message.content, (ObstacleRing, SectorDistance)) and message.system == state.system:
            scan = rounds.take(message.component, message.content, self.time_s, state)
            if scan is not None:
                yield self.item("scan", **_ranges(scan.ranges_m))

    def _reported(self, message: Message, before: VehicleState, state: VehicleState) -> Iterator[Item]:
        if isinstance(message.content, Heartbeat):
            heartbeat = message.content
            last = None if before.heartbeat is None else before.heartbeat.content
            if state.heartbeat is not before.heartbeat and heartbeat != last:
                yield self.item("event", event="heartbeat", mode=heartbeat.mode, is_armed=heartbeat.is_armed)
        yield from self._texts(before, state)
        if state.restarts != before.restarts:
            yield self.problem("the vehicle has restarted")

    def _texts(self, before: VehicleState, state: VehicleState) -> Iterator[Item]:
        """Yield the texts that have been joined since a state."""
        known = {id(report) for report in before.texts}
        for report in state.texts:
            if id(report) not in known:
                yield self.item("text", severity=report.content.severity, text=report.content.text)


def _number(value: object, default: int) -> int:
    return value if isinstance(value, int) else default


class _RecordedPort:
    """A port whose bytes are those of a capture; what is written goes nowhere."""

    def __init__(self, host: "_RecordedHost", path: str, baud: int) -> None:
        self.path = path
        self.baud = baud
        self._host = host

    def read(self, limit_s: float) -> bytes:
        return self._host.next_bytes(limit_s)

    def write(self, data: bytes, limit_s: float = 0.1) -> None:
        """Send nothing: the device is not there."""

    def discard_input(self) -> None:
        """Forget nothing: what was discarded then is not in the capture."""

    def set_baud(self, baud: int) -> None:
        self.baud = baud

    def set_dtr(self, is_on: bool) -> None:
        """A capture has no modem lines."""

    def wake(self) -> None:
        """Do nothing: no thread waits."""

    def close(self) -> None:
        """A capture is read once."""


class _RecordedHost(SystemHost):
    """A host whose time is that of a capture's records."""

    def __init__(self, records: Sequence[Record], begin_ns: int) -> None:
        self._records = [record for record in records if record.kind is Kind.IN]
        self._begin_ns = begin_ns
        self._next = 0
        self._now_s = 0.0
        # Asked for as an attribute, and of this host alone.
        self.monotonic = lambda: self._now_s

    def open_port(self, path: str, baud: int) -> Any:
        return _RecordedPort(self, path, baud)

    def next_bytes(self, limit_s: float) -> bytes:
        """Return the bytes that came next, and let time pass until they did.

        Raises:
            LineLostError: The capture is over.
        """
        if self._next >= len(self._records):
            raise LineLostError("capture", "the capture is over")
        record = self._records[self._next]
        time_s = (record.time_ns - self._begin_ns) / _NS
        if time_s > self._now_s + limit_s:
            self._now_s += limit_s
            return b""
        self._now_s = max(self._now_s, time_s)
        self._next += 1
        return record.data


def _lidar(info: LineInfo, records: Sequence[Record], begin_ns: int, summary: Summary) -> Iterator[Item]:
    host = _RecordedHost(records, begin_ns)
    scanner = make_range_scanner(info.driver, path="capture", host=host, **info.options)
    if not isinstance(scanner, Lidar):
        yield Item(0.0, info.name, "problem", {"problem": f"'{info.driver}' is a driver without a replay"})
        return
    for record in records:
        if record.kind is Kind.EVENTS and record.event.get("event") in ("open", "close", "lost line", "lost"):
            yield Item((record.time_ns - begin_ns) / _NS, info.name, "event", record.event)
    scanner.open()
    while True:
        try:
            scan = scanner.receive(_SILENCE_S)
        except LineLostError:
            break
        if scan is None:
            yield Item(host.monotonic(), info.name, "problem", {"problem": f"no revolution within {_SILENCE_S:g} s"})
        else:
            yield _scan_item(info, scan)
    counters = scanner.counters
    summary.frames, summary.bad_frames = counters.frames, counters.bad_frames
    summary.skipped_bytes = counters.skipped_bytes


def _scan_item(info: LineInfo, scan: Scan) -> Item:
    values = _ranges(scan.ranges_m)
    return Item(scan.time_s, info.name, "scan", values | {"revolutions_per_s": round(scan.revolutions_per_s, 4)})
