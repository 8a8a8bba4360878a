"""LiDARs over real pseudo-terminals: the test is the device."""

import math
import termios
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import pytest

from robosc_bridge.devices.interface import BINS, RangeScanner, Scan, ScannerCounters
from robosc_bridge.devices.lidar import (
    BAUD_TRIAL_S,
    LDS01,
    LDS02,
    LDS03,
    Lidar,
    Model,
    make_lds01,
    make_lds02,
    make_lds03,
)
from robosc_bridge.driver_registry import Kind, available_drivers, make_range_scanner
from robosc_bridge.errors import LineError, LineLostError, LineMissingError
from robosc_bridge.transport.serial_line import SerialLine
from support.lidar_frames import lds01_frame, lds02_frame, lds03_frame
from support.pty_end import LIMIT_S, HeldHost, PtyEnd
from support.waiting import PATIENCE_S, wait_until

START_LDS03 = bytes.fromhex("aa 55 f0 0f")
STOP_LDS03 = bytes.fromhex("aa 55 f5 0a")
NEVER_S = 3600.0
"""Longer than any test waits."""


def _lds01_revolution(distance_mm: int) -> list[bytes]:
    return [lds01_frame(k, [(9, distance_mm)] * 6) for k in range(60)]


def _lds02_revolution(distance_mm: int) -> list[bytes]:
    return [lds02_frame(at, (at + 1100) % 36000, [(distance_mm, 200)] * 12) for at in range(0, 36000, 1200)]


def _lds03_revolution(distance_mm: int) -> list[bytes]:
    frames = [lds03_frame(at, at + 19, [(distance_mm, 200)] * 20) for at in range(0, 360, 20)]
    return [lds03_frame(0, 0, [(distance_mm, 200)], ring_start_dhz=100), *frames]


@dataclass(frozen=True)
class Kit:
    """A model, as its device knows it."""

    model: Model[Any]
    make: Callable[..., Lidar[Any]]
    revolution: Callable[[int], list[bytes]]
    start: bytes
    stop: bytes
    revolutions_per_s: float
    # Range of a distance of 1 m after correction.
    range_m: float


KITS = {
    "lds01": Kit(LDS01, make_lds01, _lds01_revolution, b"b", b"e", 5.0, 1.0),
    "lds02": Kit(LDS02, make_lds02, _lds02_revolution, b"", b"", 2152 / 360, math.hypot(1005.9, 99.09) / 1000),
    "lds03": Kit(LDS03, make_lds03, _lds03_revolution, START_LDS03, STOP_LDS03, 10.0, 1.0),
}


class Rig:
    """An open LiDAR and its device."""

    def __init__(self, kit: Kit, **arguments: Any) -> None:
        self.kit = kit
        self.pty = PtyEnd()
        self.clock = HeldHost(self.pty)
        self.lidar = kit.make(self.pty.path, host=self.clock, **arguments)
        self.lidar.open()

    def scans(self, frames: list[bytes]) -> list[Scan]:
        """Return the scans that the driver makes of frames that are read a few at a time."""
        found = []
        for begin in range(0, len(frames), 8):
            self.pty.send(b"".join(frames[begin : begin + 8]))
            while scan := self.lidar.receive(0.01):
                found.append(scan)
        return found

    def whole_scan(self, distance_mm: int = 1000) -> Scan:
        """One from a turn and the beginning of the next."""
        revolution = self.kit.revolution(distance_mm)
        [scan] = self.scans(revolution + revolution[:1])
        return scan

    def close(self) -> None:
        self.lidar.close()
        self.pty.unplug()


@pytest.fixture(params=KITS)
def rig(request: pytest.FixtureRequest) -> Iterator[Rig]:
    made = Rig(KITS[request.param])
    yield made
    made.close()


@pytest.fixture
def rig_lds01() -> Iterator[Rig]:
    made = Rig(KITS["lds01"])
    yield made
    made.close()


@pytest.fixture
def rig_lds03() -> Iterator[Rig]:
    made = Rig(KITS["lds03"])
    yield made
    made.close()


def _is_known(ranges_m: tuple[float, ...]) -> list[bool]:
    return [not math.isnan(range_m) for range_m in ranges_m]


class Waiting:
    """A `receive` in another thread."""

    def __init__(self, lidar: Lidar[Any]) -> None:
        self.outcome: Scan | Exception | None = None
        self._lidar = lidar
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        try:
            self.outcome = self._lidar.receive(NEVER_S)
        except LineError as error:
            self.outcome = error

    def end(self) -> Scan | Exception | None:
        self._thread.join(PATIENCE_S)
        assert not self._thread.is_alive()
        return self.outcome


# Scans


def test_a_turn_is_a_scan(rig: Rig) -> None:
    before_s = rig.clock()
    scan = rig.whole_scan()
    assert before_s <= scan.time_s <= rig.clock()
    assert len(scan.ranges_m) == BINS
    assert all(_is_known(scan.ranges_m))
    assert (min(scan.ranges_m), max(scan.ranges_m)) == pytest.approx((rig.kit.range_m, rig.kit.range_m))
    assert scan.revolutions_per_s == pytest.approx(rig.kit.revolutions_per_s)
    assert len(scan.raw.angles_rad) == len(scan.raw.ranges_m) == len(scan.raw.intensities) >= 360
    assert all(0 <= angle_rad < 2 * math.pi for angle_rad in scan.raw.angles_rad)
    assert rig.lidar.counters.scans == 1
    assert rig.lidar.counters.bad_frames == 0
    assert rig.lidar.counters.frames >= len(rig.kit.revolution(0))


def test_the_time_of_a_scan_is_that_of_its_last_byte(rig: Rig) -> None:
    revolution = rig.kit.revolution(1000)
    frames = revolution + revolution[:1] if rig.kit.model is not LDS01 else revolution
    assert rig.scans(frames[:-1]) == []
    rig.pty.send(frames[-1][:-1])
    assert rig.lidar.receive(0.01) is None
    rig.clock.skip(0.05)
    before_s = rig.clock()
    rig.pty.send(frames[-1][-1:])
    scan = rig.lidar.receive(LIMIT_S)
    assert scan
    assert before_s <= scan.time_s <= rig.clock()


def test_a_scan_without_a_reading_is_a_scan_of_nan(rig: Rig) -> None:
    scan = rig.whole_scan(0)
    assert not any(_is_known(scan.ranges_m))
    assert not any(_is_known(scan.raw.ranges_m))


def test_lost_frames_leave_nan_and_no_earlier_range(rig: Rig) -> None:
    near, far = rig.kit.revolution(500), rig.kit.revolution(2000)
    lost = slice(len(near) // 2, len(near) // 2 + len(near) // 6)
    holed = far[: lost.start] + far[lost.stop :]
    first, second = rig.scans(near + holed + near[:1])
    assert all(_is_known(first.ranges_m))
    assert max(first.ranges_m) < 0.6
    known = [range_m for range_m in second.ranges_m if not math.isnan(range_m)]
    assert 290 <= len(known) <= 310
    assert min(known) > 1.9


def test_half_a_turn_is_no_scan(rig: Rig) -> None:
    revolution = rig.kit.revolution(1000)
    assert rig.scans(revolution[len(revolution) // 2 :] + revolution[:1]) == []


def test_a_frame_with_a_wrong_checksum_is_counted_and_dropped(rig: Rig) -> None:
    revolution = rig.kit.revolution(1000)
    broken = bytearray(revolution[20 % len(revolution)])
    broken[20] ^= 0x10
    [scan] = (
        rig.scans([*revolution[:20], bytes(broken), *revolution[21:], revolution[0]])
        if rig.kit.model is not LDS03
        else rig.scans([*revolution[:5], bytes(broken[:13]), *revolution[6:], revolution[0]])
    )
    assert rig.lidar.counters.bad_frames >= (rig.kit.model is not LDS03)
    assert rig.lidar.counters.skipped_bytes >= 13
    assert 330 <= sum(_is_known(scan.ranges_m)) < 360


def test_of_several_turns_in_one_read_the_newest_is_reported(rig_lds01: Rig) -> None:
    # The line holds more than one turn; a late reader wants the present one.
    stream = b"".join(_lds01_revolution(500) + _lds01_revolution(600))[:4000]
    rig_lds01.pty.send(stream)
    first = rig_lds01.lidar.receive(LIMIT_S)
    assert first
    rig_lds01.pty.send(b"".join(_lds01_revolution(600))[4000 - 2520 :])
    second = rig_lds01.lidar.receive(LIMIT_S)
    assert second
    assert (first.ranges_m[0], second.ranges_m[0]) == (0.5, 0.6)
    assert rig_lds01.lidar.counters.scans == 2


# Place and direction


@pytest.mark.parametrize(
    ("front_deg", "is_upside_down", "found"),
    [(0, False, 270), (90, False, 0), (-90, False, 180), (0, True, 90), (90, True, 180), (725, False, 275)],
)
def test_a_turned_or_hanging_lidar(front_deg: float, is_upside_down: bool, found: int) -> None:
    made = Rig(KITS["lds03"], front_rad=math.radians(front_deg), is_upside_down=is_upside_down)
    try:
        revolution = _lds03_revolution(0)
        # An object at 90 degrees clockwise of its front.
        revolution[5] = lds03_frame(80, 99, [(0, 0)] * 10 + [(1000, 200)] + [(0, 0)] * 9)
        [scan] = made.scans(revolution + revolution[:1])
        assert [k for k in range(BINS) if not math.isnan(scan.ranges_m[k])] == [found]
        [angle_rad] = [a for a, r in zip(scan.raw.angles_rad, scan.raw.ranges_m, strict=True) if not math.isnan(r)]
        assert angle_rad == pytest.approx(math.radians(found), abs=1e-9)
    finally:
        made.close()


# Silence


def test_nothing_in_time_is_no_scan(rig: Rig) -> None:
    before_s = rig.clock()
    assert rig.lidar.receive(0.05) is None
    assert rig.clock() - before_s >= 0.049


@pytest.mark.parametrize("noise", [b"", bytes(100)], ids=["silence", "noise"])
def test_halves_on_both_sides_of_a_silence_are_no_scan(rig: Rig, noise: bytes) -> None:
    revolution = rig.kit.revolution(1000)
    half = len(revolution) // 2
    assert rig.scans(revolution[:half]) == []
    for _ in range(5):
        rig.clock.skip(rig.kit.model.stale_after_s / 4)
        rig.pty.send(noise)
        assert rig.lidar.receive(0.01) is None
    assert rig.scans(revolution[half:] + revolution[:1]) == []
    assert len(rig.scans(revolution[1:] + revolution[:1])) == 1


def test_frames_are_found_in_the_midst_of_lasting_noise(rig: Rig) -> None:
    for _ in range(12):
        rig.clock.skip(rig.kit.model.stale_after_s / 4)
        rig.pty.send(bytes(100))
        assert rig.lidar.receive(0.01) is None
    assert rig.whole_scan()


def test_halves_of_a_frame_on_both_sides_of_a_silence_are_no_frame(rig: Rig) -> None:
    first, second = rig.kit.revolution(1000)[1:3]
    rig.pty.send(first[:11])
    for _ in range(5):
        assert rig.lidar.receive(0.01) is None
        rig.clock.skip(rig.kit.model.stale_after_s / 4)
    rig.pty.send(first[11:] + second[:2])
    assert rig.lidar.receive(0.05) is None
    assert rig.lidar.counters.frames == 0
    assert rig.lidar.counters.skipped_bytes >= 11


def test_halves_on_both_sides_of_a_short_pause_are_a_scan(rig: Rig) -> None:
    revolution = rig.kit.revolution(1000)
    half = len(revolution) // 2
    assert rig.scans(revolution[:half]) == []
    rig.clock.skip(rig.kit.model.stale_after_s / 2)
    assert len(rig.scans(revolution[half:] + revolution[:1])) == 1


def test_what_waited_too_long_in_the_line_is_discarded(rig: Rig) -> None:
    assert rig.lidar.receive(0.0) is None
    revolution = rig.kit.revolution(500)
    rig.pty.send(b"".join(revolution + revolution[:1]))
    rig.clock.skip(rig.kit.model.stale_after_s + 0.1)
    assert rig.lidar.receive(0.05) is None
    assert rig.lidar.counters.frames == 0
    assert max(rig.whole_scan(2000).ranges_m) > 1.9


# Waking


def test_wake_ends_a_receive_that_waits(rig: Rig) -> None:
    waiting = Waiting(rig.lidar)
    rig.lidar.wake()
    assert waiting.end() is None


def test_wake_ends_a_receive_while_frames_come(rig: Rig) -> None:
    rig.pty.send(rig.kit.revolution(1000)[1])
    rig.lidar.wake()
    waiting = Waiting(rig.lidar)
    assert waiting.end() is None


def test_wake_holds_once(rig: Rig) -> None:
    rig.lidar.wake()
    assert rig.lidar.receive(LIMIT_S) is None
    revolution = rig.kit.revolution(1000)
    waiting = Waiting(rig.lidar)
    rig.pty.send(b"".join(revolution[:4]))
    wait_until(lambda: rig.lidar.counters.frames > 0)
    rig.pty.send(b"".join(revolution[4:] + revolution[:1]))
    assert isinstance(waiting.end(), Scan)


def test_wake_of_a_closed_lidar_does_nothing(rig: Rig) -> None:
    rig.lidar.close()
    rig.lidar.wake()


# Opening, starting, closing


def test_opening_starts_the_motor_and_closing_stops_it(rig: Rig) -> None:
    assert rig.pty.receive(len(rig.kit.start)) == rig.kit.start
    assert rig.pty.is_silent()
    rig.lidar.close()
    assert rig.pty.receive(len(rig.kit.stop)) == rig.kit.stop
    rig.lidar.close()
    assert rig.pty.is_silent()
    assert rig.lidar.baud is None


def test_the_line_has_the_speed_of_the_model(rig: Rig) -> None:
    expected = {"lds01": termios.B230400, "lds02": termios.B115200, "lds03": termios.B230400}[rig.kit.model.name]
    assert rig.pty.baud_constant() == expected


def test_the_line_has_the_speed_that_was_asked_for() -> None:
    made = Rig(KITS["lds03"], baud=57600)
    try:
        assert made.pty.baud_constant() == termios.B57600
        made.clock.skip(10 * BAUD_TRIAL_S)
        assert made.lidar.receive(0.0) is None
        assert made.pty.baud_constant() == termios.B57600
    finally:
        made.close()


def test_a_missing_port() -> None:
    with pytest.raises(LineMissingError):
        make_lds01("/dev/no-such-port").open()


def test_a_lidar_that_is_not_open(rig: Rig) -> None:
    rig.lidar.close()
    with pytest.raises(LineLostError, match="not open"):
        rig.lidar.receive(0.0)
    with pytest.raises(LineLostError, match="not open"):
        rig.lidar.restart()


def test_a_line_that_is_lost_while_it_waits(rig: Rig) -> None:
    waiting = Waiting(rig.lidar)
    rig.pty.unplug()
    assert isinstance(waiting.end(), LineLostError)
    rig.lidar.close()


def test_opening_anew_begins_a_turn_anew_and_keeps_the_counters(rig: Rig) -> None:
    revolution = rig.kit.revolution(1000)
    half = len(revolution) // 2
    assert rig.scans(revolution[:half]) == []
    frames = rig.lidar.counters.frames
    assert frames
    rig.lidar.open()
    assert rig.scans(revolution[half:] + revolution[:1]) == []
    assert rig.lidar.counters.frames > frames


def test_a_lidar_whose_start_cannot_be_written_is_closed(monkeypatch: pytest.MonkeyPatch) -> None:
    pty = PtyEnd()

    def fail(self: SerialLine, data: bytes, limit_s: float = 0.1) -> None:
        raise LineLostError(self.path, "no")

    try:
        monkeypatch.setattr(SerialLine, "write", fail)
        lidar = make_lds01(pty.path)
        with pytest.raises(LineLostError):
            lidar.open()
        # The port is free again.
        SerialLine(pty.path, 9600).close()
    finally:
        pty.unplug()


@pytest.mark.parametrize(("name", "expected"), [("lds01", []), ("lds02", []), ("lds03", [False])])
def test_only_the_lds03_has_its_modem_line_dropped(
    monkeypatch: pytest.MonkeyPatch, name: str, expected: list[bool]
) -> None:
    levels: list[bool] = []
    monkeypatch.setattr(SerialLine, "set_dtr", lambda self, is_on: levels.append(is_on))
    Rig(KITS[name]).close()
    assert levels == expected


def test_restart_of_an_lds01_is_its_start(rig_lds01: Rig) -> None:
    rig_lds01.lidar.restart()
    assert rig_lds01.pty.receive(2) == b"bb"


def test_an_lds02_cannot_be_restarted() -> None:
    made = Rig(KITS["lds02"])
    try:
        made.lidar.restart()
        assert made.pty.is_silent()
    finally:
        made.close()


def test_restart_of_an_lds03_waits_between_stop_and_start_without_blocking(rig_lds03: Rig) -> None:
    pty, lidar, clock = rig_lds03.pty, rig_lds03.lidar, rig_lds03.clock
    assert pty.receive(4) == START_LDS03
    rig_lds03.whole_scan()
    before_s = clock()
    lidar.restart()
    assert clock() - before_s < 0.5
    assert pty.receive(4) == STOP_LDS03
    clock.skip(0.4)
    assert lidar.receive(0.0) is None
    assert pty.is_silent()
    clock.skip(0.6)
    assert lidar.receive(0.0) is None
    assert pty.receive(4) == START_LDS03
    # Once, and the speed of the line is known already.
    clock.skip(10 * BAUD_TRIAL_S)
    assert lidar.receive(0.0) is None
    assert pty.is_silent()
    assert pty.baud_constant() == termios.B230400


def test_the_start_that_a_restart_owes_is_sent_while_receive_waits(rig_lds03: Rig) -> None:
    rig_lds03.pty.receive(4)
    rig_lds03.whole_scan()
    rig_lds03.lidar.restart()
    rig_lds03.pty.receive(4)
    rig_lds03.clock.skip(0.8)
    waiting = Waiting(rig_lds03.lidar)
    assert rig_lds03.pty.receive(4) == START_LDS03
    rig_lds03.lidar.wake()
    assert waiting.end() is None


# The speed of an LDS-03's line


def test_without_frames_the_other_speed_is_tried_and_the_motor_started_again(rig_lds03: Rig) -> None:
    pty, lidar, clock = rig_lds03.pty, rig_lds03.lidar, rig_lds03.clock
    assert pty.receive(4) == START_LDS03
    for constant, baud in ((termios.B115200, 115_200), (termios.B230400, 230_400), (termios.B115200, 115_200)):
        pty.send(b"noise of another speed")
        clock.skip(BAUD_TRIAL_S / 2)
        before = pty.baud_constant()
        assert lidar.receive(0.0) is None
        assert pty.baud_constant() == before
        clock.skip(BAUD_TRIAL_S / 2 + 0.01)
        assert lidar.receive(0.0) is None
        assert pty.baud_constant() == constant
        assert lidar.baud == baud
        assert pty.receive(4) == START_LDS03
    rig_lds03.whole_scan()
    clock.skip(10 * BAUD_TRIAL_S)
    assert lidar.receive(0.0) is None
    assert pty.baud_constant() == termios.B115200


def test_what_came_at_one_speed_is_not_read_at_the_other(rig_lds03: Rig) -> None:
    frame = _lds03_revolution(1000)[1]
    rig_lds03.pty.send(frame[:30])
    assert rig_lds03.lidar.receive(0.05) is None
    for _ in range(4):
        rig_lds03.clock.skip(0.2)
        assert rig_lds03.lidar.receive(0.0) is None
    rig_lds03.pty.send(frame[30:])
    rig_lds03.clock.skip(0.2)
    assert rig_lds03.lidar.receive(0.05) is None
    assert rig_lds03.pty.baud_constant() == termios.B115200
    assert rig_lds03.lidar.counters == ScannerCounters(skipped_bytes=30)


def test_another_speed_is_tried_while_receive_waits(rig_lds03: Rig) -> None:
    rig_lds03.pty.receive(4)
    rig_lds03.clock.skip(BAUD_TRIAL_S - 0.1)
    waiting = Waiting(rig_lds03.lidar)
    assert rig_lds03.pty.receive(4) == START_LDS03
    assert rig_lds03.pty.baud_constant() == termios.B115200
    rig_lds03.lidar.wake()
    assert waiting.end() is None


# By name


@pytest.mark.parametrize("name", KITS)
def test_the_registry_makes_them(name: str) -> None:
    assert name in {info.name for info in available_drivers(Kind.RANGE_SCANNER)}
    scanner: RangeScanner = make_range_scanner(name, path="/dev/ttyUSB0", front_rad=1.0, is_upside_down=True)
    assert isinstance(scanner, Lidar)
    assert scanner.model.name == name
    assert scanner.counters == ScannerCounters()


def test_they_are_range_scanners() -> None:
    scanners: list[RangeScanner] = [make_lds01("x"), make_lds02("x"), make_lds03("x")]
    assert scanners
