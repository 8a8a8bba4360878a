"""The recorder of lines: complete while its disk keeps up, bounded, and never in the way of a line."""

import errno
import io
import threading
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest

from robosc_bridge.captures import recorder as module
from robosc_bridge.captures.capture_file import CaptureError, Kind, LineInfo, read_capture
from robosc_bridge.captures.commands import replay
from robosc_bridge.captures.players import Item
from robosc_bridge.captures.recorder import PARTS, Recorder, RecordingHost, part
from robosc_bridge.devices.interface import DriveReading, Velocity
from robosc_bridge.devices.robots import ROBOTS, Body, Robot
from robosc_bridge.driver_registry import make_drive_base, make_range_scanner
from robosc_bridge.errors import LineError, LineLostError
from robosc_simulated import SimulatedTurtleBot3
from robosc_simulated.virtual_host import VirtualHost

MIB = 1 << 20
BASE = LineInfo("base", "opencr", "burger", {}, "/virtual/base")


@pytest.fixture
def host() -> Iterator[VirtualHost]:
    with VirtualHost() as found:
        yield found


class Stuck(io.BytesIO):
    """A file on a disk that does not answer until it is released."""

    def __init__(self, goes_on: threading.Event) -> None:
        super().__init__()
        self.goes_on = goes_on

    def write(self, data: bytes) -> int:  # type: ignore[override]
        self.goes_on.wait()
        return super().write(data)

    def close(self) -> None:
        """Stay open, to be looked at later."""


class Full(io.BytesIO):
    """A file on a disk that is full."""

    def write(self, data: bytes) -> int:  # type: ignore[override]
        if self.tell() > 2000:
            raise OSError(errno.ENOSPC, "No space left on device")
        return super().write(data)


OWN = {"wheel_radius_m": 0.04, "gear_ratio": 1.5, "mirrored": (True, False)}


@pytest.mark.parametrize(
    ("kind", "robot", "options"),
    [
        ("opencr", ROBOTS["burger"], {}),
        ("opencr", ROBOTS["burger"], {"heading": "wheels"}),
        ("dynamixel", ROBOTS["burger"], {}),
        ("dynamixel", Body(0.1, 0.5, 0.2), OWN),
    ],
)
def test_a_replay_reads_what_the_driver_has_read(
    kind: str, robot: Robot | Body, options: dict[str, Any], host: VirtualHost, tmp_path: Path
) -> None:
    file = tmp_path / "run.mcap"
    separation_m = robot.wheel_separation_m if isinstance(robot, Body) else 0.0
    info = LineInfo("base", kind, "" if separation_m else "burger", options, separation_m=separation_m)
    with SimulatedTurtleBot3("burger", kind, clock=host) as device:
        recorder = Recorder(file, {device.base_path: info}, host, 64 * MIB)
        recording = RecordingHost(host, recorder)
        base = make_drive_base(kind, path=device.base_path, robot=robot, host=recording, **options)
        base.open()
        base.set_torque(True)
        readings: list[DriveReading] = []
        for step in range(100):
            readings.append(base.exchange(Velocity(0.1, 0.02 * step)))
            host.sleep(0.02)
        base.close()
        recorder.close()
    assert recorder.lost == 0
    capture = read_capture(file)
    assert capture.is_whole
    items = list(replay(capture, {}))
    assert [item for item in items if item.kind == "problem"] == []
    found = [item.values for item in items if item.kind == "reading"]
    expected = [
        {
            "x_m": pytest.approx(reading.pose.x_m, abs=1e-6),
            "y_m": pytest.approx(reading.pose.y_m, abs=1e-6),
            "heading_rad": pytest.approx(reading.pose.heading_rad, abs=1e-6),
            "wheels_m_s": pytest.approx(list(reading.wheels_m_s), abs=1e-6),
            "battery_v": reading.battery_v,
        }
        for reading in readings
    ]
    # Opening it and closing it read, too.
    first = next(index for index, values in enumerate(found) if _has(values, expected[5])) - 5
    assert all(_has(values, one) for values, one in zip(found[first:], expected, strict=False))
    assert len(found) >= first + 100
    assert abs(readings[-1].pose.heading_rad) > 0.5
    assert [item.values for item in items if item.kind == "request"][-2:] == [{"torque": True}, {"torque": False}]


def _has(values: Mapping[str, object], expected: Mapping[str, object]) -> bool:
    return all(values[name] == value for name, value in expected.items())


@pytest.mark.parametrize("kind", ["lds01", "lds02", "lds03"])
def test_a_replay_sees_what_the_lidar_s_driver_has_seen(kind: str, host: VirtualHost, tmp_path: Path) -> None:
    file = tmp_path / "run.mcap"
    with SimulatedTurtleBot3("burger", "opencr", kind, clock=host, noise_m=0.01) as robot:
        recorder = Recorder(file, {robot.scanner_path: LineInfo("scanner", kind)}, host, 64 * MIB)
        scanner = make_range_scanner(kind, path=robot.scanner_path, host=RecordingHost(host, recorder))
        scanner.open()
        scans = [scan for _ in range(20) if (scan := scanner.receive(0.5)) is not None]
        scanner.close()
        recorder.close()
    found = [item for item in replay(read_capture(file), {}) if item.kind == "scan"]
    assert len(scans) > 10
    assert [_ranges(item) for item in found] == [
        [None if range_m != range_m else round(range_m, 4) for range_m in scan.ranges_m] for scan in scans
    ]


def _ranges(item: Item) -> list[float | None]:
    found: list[float | None] = item.values["ranges_m"]
    return found


def test_what_happens_to_a_line_is_recorded_and_passed_on(host: VirtualHost, tmp_path: Path) -> None:
    with SimulatedTurtleBot3("burger", "opencr", clock=host) as robot:
        path = robot.base_path
        recorder = Recorder(tmp_path / "run.mcap", {path: BASE}, host, 64 * MIB)
        port = RecordingHost(host, recorder).open_port(path, 57_600)
        port.set_baud(1_000_000)
        port.discard_input()
        assert (port.baud, port.path) == (1_000_000, path)
        robot.base_line.disconnect()
        with pytest.raises(LineLostError):
            port.read(0.1)
        port.close()
        recorder.close()
    events = [record.event for record in read_capture(tmp_path / "run.mcap").records]
    assert [event["event"] for event in events] == ["open", "baud", "discard", "lost line", "close"]
    assert (events[0]["baud"], events[1]["baud"]) == (57_600, 1_000_000)


def test_a_line_of_another_name_and_one_that_is_not_there_are_none_of_its_business(
    host: VirtualHost, tmp_path: Path
) -> None:
    recorder = Recorder(tmp_path / "run.mcap", {"/virtual/base": BASE}, host, 64 * MIB)
    with pytest.raises(LineError):
        RecordingHost(host, recorder).open_port("/virtual/base", 57_600)
    assert recorder.tap("/virtual/other") is None
    recorder.close()
    assert read_capture(tmp_path / "run.mcap").records == ()


def test_parts_are_bounded_and_the_newest_stay(host: VirtualHost, tmp_path: Path) -> None:
    file, data = tmp_path / "run.mcap", bytes(1000)
    recorder = Recorder(file, {"/virtual/base": BASE}, host, MIB)
    tap = recorder.tap("/virtual/base")
    assert tap is not None
    for number in range(5000):
        tap(Kind.IN, data + number.to_bytes(2, "big"))
    recorder.close()
    files = sorted(tmp_path.iterdir())
    assert files == sorted(part(file, number) for number in range(PARTS))
    assert sum(one.stat().st_size for one in files) <= 1.02 * MIB
    captures = [read_capture(part(file, number)) for number in reversed(range(PARTS))]
    assert all(capture.is_whole and capture.lines["base"] == BASE for capture in captures)
    numbers = [int.from_bytes(record.data[-2:], "big") for capture in captures for record in capture.records]
    assert numbers == list(range(numbers[0], 5000))
    assert len(numbers) > 700


def test_a_recording_that_is_there_becomes_an_older_part(host: VirtualHost, tmp_path: Path) -> None:
    for number in range(PARTS + 2):
        recorder = Recorder(tmp_path / "run.mcap", {"/virtual/base": BASE}, host, MIB)
        tap = recorder.tap("/virtual/base")
        assert tap is not None
        tap(Kind.OUT, bytes((number,)))
        recorder.close()
    found = [read_capture(part(tmp_path / "run.mcap", number)).records[0].data[0] for number in range(PARTS)]
    assert found == [5, 4, 3, 2]
    assert len(list(tmp_path.iterdir())) == PARTS


def test_another_file_is_not_overwritten(host: VirtualHost, tmp_path: Path) -> None:
    file = tmp_path / "thesis.mcap"
    file.write_text("all of it")
    with pytest.raises(CaptureError, match=r"thesis.mcap: this file is no capture, and is not overwritten"):
        Recorder(file, {"/virtual/base": BASE}, host, MIB)
    assert file.read_text() == "all of it"


def _on_disk(stream: io.BytesIO, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: Callable[..., object] = Path.open

    def open_(path: Path, mode: str = "r", **arguments: object) -> object:
        return stream if mode == "xb" else opened(path, mode, **arguments)

    monkeypatch.setattr(Path, "open", open_)


def test_a_disk_that_does_not_answer_costs_records_and_no_time(
    host: VirtualHost, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    goes_on = threading.Event()
    goes_on.set()
    stream = Stuck(goes_on)
    _on_disk(stream, monkeypatch)
    recorder = Recorder(tmp_path / "run.mcap", {"/virtual/base": BASE}, host, 64 * MIB)
    tap = recorder.tap("/virtual/base")
    assert tap is not None
    goes_on.clear()
    # It would hang here for ever if it waited.
    for _ in range(3 * module._MOST_WAITING):
        tap(Kind.IN, b"\0")
    assert recorder.lost >= 2 * module._MOST_WAITING - 2
    lost = recorder.lost
    goes_on.set()
    recorder.close()
    monkeypatch.undo()
    file = tmp_path / "kept.mcap"
    file.write_bytes(stream.getvalue())
    records = read_capture(file).records
    counts = [record.event["records"] for record in records if record.kind is Kind.EVENTS]
    # Once, or twice where some were lost before the disk was asked for the first time.
    assert sum(counts) == lost
    assert 1 <= len(counts) <= 2
    assert len(records) == 3 * module._MOST_WAITING - lost + len(counts)


def test_a_full_disk_ends_the_recording_with_one_line_and_nothing_else(
    host: VirtualHost, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    _on_disk(Full(), monkeypatch)
    recorder = Recorder(tmp_path / "run.mcap", {"/virtual/base": BASE}, host, 64 * MIB)
    tap = recorder.tap("/virtual/base")
    assert tap is not None
    for _ in range(500):
        tap(Kind.IN, bytes(100))
    recorder.close()
    for _ in range(2 * module._MOST_WAITING):
        tap(Kind.IN, b"\0")
    assert recorder.lost == 0
    (line,) = caplog.messages
    assert "run.mcap: the recording ends here, and the robot goes on: [Errno 28] No space left on device" in line
