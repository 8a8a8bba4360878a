"""LiDARs: worked frames, and what a tiny, obvious decoder makes of their bytes, in virtual time."""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from robosc_bridge.errors import LineLostError
from robosc_simulated import SimulatedTurtleBot3, VirtualHost, room
from robosc_simulated.lidar_frames import crc8, lds01_frame, lds02_frame, lds03_frame, lds03_identity
from support.wire import Host

BAUDS = {"lds01": 230_400, "lds02": 115_200, "lds03": 230_400}
START_03 = "aa 55 f0 0f"
STOP_03 = "aa 55 f5 0a"


def hexed(text: str) -> bytes:
    return bytes.fromhex(text)


def test_the_worked_frame_of_lds01() -> None:
    points = [(500, 1000), (501, 1000), (502, 1000), (0, 0), (2000, 900), (3499, 850)]
    assert lds01_frame(0, 3000, points) == hexed(
        "fa a0 b8 0b e8 03 f4 01 00 00 e8 03 f5 01 00 00 e8 03 f6 01 00 00 00 00 00 00 00 00 84 03 d0 07 00 00"
        "52 03 ab 0d 00 00 94 94"
    )


def test_the_worked_frame_of_lds02() -> None:
    assert crc8(b"123456789") == 0xC3
    points = [(224, 228), (220, 226), (0, 0), *((1000 + more, 200) for more in range(8)), (176, 234)]
    assert lds02_frame(2152, 32427, 33470, 6714, points) == hexed(
        "54 2c 68 08 ab 7e e0 00 e4 dc 00 e2 00 00 00 e8 03 c8 e9 03 c8 ea 03 c8 eb 03 c8 ec 03 c8 ed 03 c8 ee 03 c8"
        "ef 03 c8 b0 00 ea be 82 3a 1a 51"
    )


def test_the_worked_frames_of_lds03() -> None:
    assert lds03_frame(0xC9, 0, 0, [(1000, 200)]) == hexed("aa 55 c9 01 01 00 01 00 e0 5b 20 a3 0f")
    points = [(1000, 200), (1010, 199), (0, 0), (12000, 60), (500, 255)]
    assert lds03_frame(0, 640, 870, points) == hexed(
        "aa 55 00 05 01 05 cd 06 6c ef 20 a3 0f 1c cb 0f 00 00 00 f0 80 bb fd d3 07"
    )
    identity = "fa fa a5 5a 14 00 e3 02 01 43 4f 49 4e 2d 44 34" + 12 * " 00" + " 01"
    assert lds03_identity() == hexed(identity)


# Decoders that look at every place of all that came: counter-clockwise degrees and metres.
Points = Iterator[tuple[float, float]]


def decode_lds01(data: bytes) -> Points:
    for at in range(len(data) - 41):
        frame = data[at : at + 42]
        if frame[0] == 0xFA and 0xA0 <= frame[1] <= 0xDB and frame[40] == frame[41] == 0xFF - sum(frame[:40]) % 256:
            for place in range(6):
                distance_mm = int.from_bytes(frame[6 + 6 * place : 8 + 6 * place], "little")
                yield 359.0 - (6 * (frame[1] - 0xA0) + place), distance_mm / 1000


def decode_lds02(data: bytes) -> Points:
    for at in range(len(data) - 46):
        frame = data[at : at + 47]
        if frame[:2] == b"\x54\x2c" and crc8(frame[:46]) == frame[46]:
            start, end = (int.from_bytes(frame[index : index + 2], "little") for index in (4, 42))
            step = (end - start) % 36000 // 11
            for place in range(12):
                distance_mm = int.from_bytes(frame[6 + 3 * place : 8 + 3 * place], "little")
                raw = (start + place * step) / 100 % 360
                if distance_mm:
                    x, y = distance_mm + 5.9, 0.11923 * distance_mm - 20.14
                    yield (360 - raw + math.degrees(math.atan(y / x))) % 360, math.hypot(x, y) / 1000
                else:
                    yield (360 - raw) % 360, 0.0


def decode_lds03(data: bytes) -> Points:
    for at in range(len(data) - 9):
        count = data[at + 3]
        frame = data[at : at + 10 + 3 * count]
        if frame[:2] != b"\xaa\x55" or not count or len(frame) < 10 + 3 * count:
            continue
        even = odd = 0
        covered = frame[:8] + frame[10:]
        for index, byte in enumerate(covered):
            if (index < 8 and index % 2 == 0) or (index >= 8 and (index - 8) % 3 < 2):
                even ^= byte
            else:
                odd ^= byte
        if bytes((even, odd)) != frame[8:10]:
            continue
        first, last = ((int.from_bytes(frame[index : index + 2], "little") >> 1) / 64 for index in (4, 6))
        for place in range(count):
            _, middle, high = frame[10 + 3 * place : 13 + 3 * place]
            yield -(first + place * (last - first) / max(count - 1, 1)) % 360, (high * 64 + (middle >> 2)) / 1000


DECODERS: dict[str, Callable[[bytes], Points]] = {
    "lds01": decode_lds01,
    "lds02": decode_lds02,
    "lds03": decode_lds03,
}


class Scene:
    """A simulated LiDAR, and the host's end of its line.

    Attributes:
        time: Virtual host on which both live.
        robot: Robot that has the LiDAR.
        host: The host's end of its line.
    """

    def __init__(self, time: VirtualHost, robot: SimulatedTurtleBot3, lidar: str, baud: int | None) -> None:
        self.time = time
        self.robot = robot
        self.lidar = lidar
        self._baud = BAUDS[lidar] if baud is None else baud
        self.open()

    def open(self) -> None:
        self.host = Host(self.robot.scanner_path, self._baud, self.time)

    def start(self) -> None:
        if self.lidar == "lds03":
            self.host.send(START_03)
            assert self.robot.scanner.is_spinning

    def heard(self, seconds: float) -> bytes:
        """Return the bytes that come while time passes; read in between, as a full line loses bytes."""
        found = b""
        for _ in range(round(seconds / 0.05)):
            self.time.sleep(0.05)
            found += self.host.port.read(self.host.port.in_waiting)
        return found

    def points(self, seconds: float) -> list[tuple[float, float]]:
        return list(DECODERS[self.lidar](self.heard(seconds)))


@contextmanager
def scene(lidar: str, baud: int | None = None, **arguments: Any) -> Iterator[Scene]:
    with VirtualHost() as time, SimulatedTurtleBot3(lidar=lidar, clock=time, **arguments) as robot:
        yield Scene(time, robot, lidar, baud)


@pytest.mark.parametrize("lidar", DECODERS)
def test_a_turn_shows_the_walls_where_they_are(lidar: str) -> None:
    with scene(lidar, walls=room(3.0, 2.0), pose=(0.3, 0.2, 0.7)) as seen:
        seen.start()
        points = seen.points(0.5)
        assert len({round(degrees) % 360 for degrees, _ in points}) == 360
        expected = seen.robot.world.ranges([math.radians(degrees) for degrees, _ in points])
        for (degrees, range_m), true_m in zip(points, expected, strict=True):
            # Half a millimetre of rounding, twice that through the correction of LDS-02, and a glancing wall.
            assert range_m == pytest.approx(true_m, abs=0.0025), f"at {degrees} degrees"


@pytest.mark.parametrize(("lidar", "rate"), [("lds01", 300 * 42), ("lds02", 191.67 * 47), ("lds03", 4000 * 3)])
def test_frames_are_paced_in_time(lidar: str, rate: float) -> None:
    with scene(lidar) as seen:
        seen.start()
        came = len(seen.heard(2.0))
        # LDS-03 has ten bytes more per frame, seventeen frames a turn.
        more = 10 * 17 * 10 if lidar == "lds03" else 0
        assert came == pytest.approx(2.0 * (rate + more), rel=0.01)


@pytest.mark.parametrize("lidar", DECODERS)
def test_a_slow_motor_takes_longer_for_a_turn_and_reports_it(lidar: str) -> None:
    with scene(lidar) as seen:
        seen.robot.scanner.set_speed(0.5)
        seen.start()
        data = seen.heard(1.0)
        turned = {round(degrees) % 360 for degrees, _ in DECODERS[lidar](data[: len(data) // 6])}
        assert len(turned) < 360
        speed = {"lds01": b"\xdc\x05", "lds02": (1076).to_bytes(2, "little"), "lds03": bytes((50 << 1 | 1,))}[lidar]
        header = {"lds01": b"\xfa\xa5", "lds02": b"\x54\x2c", "lds03": b"\xaa\x55"}[lidar]
        assert header + speed in data


@pytest.mark.parametrize("lidar", DECODERS)
def test_a_covered_one_measures_nothing(lidar: str) -> None:
    with scene(lidar) as seen:
        seen.robot.scanner.is_covered = True
        seen.start()
        points = seen.points(0.5)
        assert points
        assert {range_m for _, range_m in points} == {0.0}


@pytest.mark.parametrize("lidar", DECODERS)
def test_a_stalled_one_is_silent(lidar: str) -> None:
    with scene(lidar) as seen:
        seen.start()
        assert seen.heard(0.2)
        seen.robot.scanner.is_stalled = True
        assert not seen.heard(0.5)
        seen.robot.scanner.is_stalled = False
        assert seen.heard(0.2)


def test_lds01_stops_and_starts_as_commanded() -> None:
    with scene("lds01") as seen:
        assert seen.heard(0.1)
        seen.host.send(b"e")
        assert not seen.robot.scanner.is_spinning
        seen.host.port.reset_input_buffer()
        assert not seen.heard(0.5)
        seen.host.send(b"b")
        assert seen.robot.scanner.is_spinning
        data = seen.heard(0.3)
        # The first frame is cut somewhere; from the second on all are whole.
        assert data[0] != 0xFA or data[1] < 0xA0
        assert len(list(decode_lds01(data))) >= 6 * 88


def test_lds03_is_idle_until_started_and_reports_what_it_is() -> None:
    with scene("lds03") as seen:
        assert not seen.heard(0.5)
        seen.host.send("00 aa aa 55 f0")
        seen.host.send("0f")
        assert seen.robot.scanner.is_spinning
        seen.time.sleep(0.05)
        greeting = seen.host.receive(2 + 29 + 7)
        assert greeting == b"\xa5\x5a" + lds03_identity() + hexed("a5 5a 00 00 80 01 81")
        seen.host.send(STOP_03)
        assert not seen.robot.scanner.is_spinning
        seen.host.port.reset_input_buffer()
        assert not seen.heard(0.5)


@pytest.mark.parametrize("lidar", DECODERS)
def test_another_baud_rate_hears_noise(lidar: str) -> None:
    with scene(lidar, 9600) as seen:
        if lidar == "lds03":
            seen.host.send(START_03)
            assert seen.host.hears_nothing()
            assert not seen.robot.scanner.is_spinning
        else:
            data = seen.heard(0.5)
            assert data
            assert not list(DECODERS[lidar](data))


def test_wire_faults_spoil_frames() -> None:
    with scene("lds01") as seen:
        whole = len(seen.points(1.0))
        seen.robot.scanner_faults.corrupt_share = 0.5
        corrupted = len(seen.points(1.0))
        seen.robot.scanner_faults.clear()
        seen.robot.scanner_faults.lose_bytes_share = 0.01
        shortened = len(seen.points(1.0))
        seen.robot.scanner_faults.clear()
        seen.robot.scanner_faults.drop_share = 0.5
        dropped = len(seen.heard(1.0))
        assert whole >= 6 * 298
        assert 0.35 * whole < corrupted < 0.65 * whole
        assert 0.5 * whole < shortened < 0.8 * whole
        assert 0.35 * 300 * 42 < dropped < 0.65 * 300 * 42


def test_an_unplugged_one_begins_anew() -> None:
    with scene("lds01") as seen:
        seen.robot.scanner_line.disconnect()
        with pytest.raises(LineLostError):
            seen.host.port.read(1)
        seen.robot.scanner_line.reconnect()
        seen.open()
        assert seen.heard(0.2)
