"""The three LiDARs of the TurtleBot3, as bytes: frames paced in time, from what the world's walls return.

Behaviour after the vendors' drivers (see `lidar_frames`). All rotate clockwise. What goes on the wire is what the real
sensor would measure, so that a driver that corrects as the stock one does finds the walls where they are:

- LDS-01: sample i of a revolution is at 359 - i degrees counter-clockwise;
- LDS-02: distances are from the optical centre, beside the axis and in a direction that deviates from the nominal one;
- LDS-03: angles are counter-clockwise when negated.
"""

import math
import random
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from robosc_simulated.lidar_frames import lds01_frame, lds02_frame, lds03_frame, lds03_identity
from robosc_simulated.line import Sending
from robosc_simulated.scene import Look
from robosc_simulated.walls import Floats
from robosc_simulated.world import Looks, World

# A thread that was late sends what was missed, but not for longer than this.
_BACKLOG_S = 0.5
# Least share of its full speed that a starting motor has: slower, its frames would be too rare to differ from silence.
_SLOWEST_SHARE = 0.2
_LOOKS = tuple(Look)
_DARK, _GLASS = _LOOKS.index(Look.DARK), _LOOKS.index(Look.GLASS)


@dataclass(frozen=True)
class _Frame:
    """A frame before it is measured.

    Attributes:
        degrees: Angles at which it looks, clockwise from the front.
        encoded: Function that makes its bytes of the distances there, in mm; 0: nothing.
    """

    degrees: Sequence[float]
    encoded: Callable[[Sequence[int]], bytes]


class Lidar(ABC):
    """A LiDAR on the robot.

    Args:
        world: World that it sees.
        seed: Seed of the angle at which it begins, and of the noise.
        noise_m: Standard deviation of what it measures, beside what the world's profile says.
        starts_mid_frame: True if the first frame after a start is cut, as when a host begins to listen at any time.

    Attributes:
        is_covered: True if something covers it: it measures nothing.
        is_stalled: True if it has fallen silent.
        baud: Baud rate of its line; None: any.
        nominal_hz: Revolutions a second.
        nearest_m: Shortest distance that it measures.
        farthest_m: Longest distance that it measures.
        beams: Beams of a revolution at the nominal speed.
    """

    baud: int | None
    nominal_hz: float
    nearest_m: float
    farthest_m: float
    beams: int

    def __init__(self, world: World, *, seed: int = 0, noise_m: float = 0.0, starts_mid_frame: bool = True) -> None:
        self.is_covered = False
        self.is_stalled = False
        self._speed_share = 1.0
        self._world = world
        self._time = world.time
        self._chance = random.Random(seed)  # noqa: S311 (noise is no secret)
        self._noise_m = noise_m
        self._starts_mid_frame = starts_mid_frame
        self._is_cut = False
        self._profile = world.profile
        # Time at which its motor began to rotate, and begin and end of its next stall.
        self._spun_s = -math.inf
        self._stalls_s = math.inf
        self._stalled_until_s = -math.inf
        self._is_spinning = False
        self._frame_world_s = 0.0
        self.plug_in()

    @property
    def is_spinning(self) -> bool:
        """True if its motor is on."""
        return self._is_spinning

    @property
    def revolutions_per_s(self) -> float:
        """Revolutions per second of world time, as it rotates now."""
        return self.nominal_hz * self._speed_share * self._spin_share()

    def _spin_share(self) -> float:
        """Share of its speed that a motor has that was started a while ago."""
        spin_up_s = self._profile.spin_up_s
        if not spin_up_s:
            return 1.0
        return max(_SLOWEST_SHARE, min(1.0, (self._time.world_s() - self._spun_s) / spin_up_s))

    def set_speed(self, share: float) -> None:
        """Rotate at this share of the nominal speed.

        Raises:
            ValueError: The share is not above 0, or above 2.
        """
        if not 0 < share <= 2:
            raise ValueError(f"a LiDAR rotates at a share above 0 and up to 2 of its speed, not at {share}")
        with self._time.lock:
            self._speed_share = share

    def plug_in(self) -> None:
        """Power comes: it rotates by itself."""
        self._spin()

    def due_s(self) -> float:
        """Return the time at which the next frame is complete."""
        if not self._is_spinning:
            return math.inf
        return self._time.now_s() + (self._frame_world_s - self._time.world_s()) / self._time.factor

    def update(self) -> Iterable[Sending]:
        """All frames that are complete; what they show is measured at once, where the robot is now."""
        now_s = self._time.world_s()
        self._frame_world_s = max(self._frame_world_s, now_s - _BACKLOG_S)
        frames: list[_Frame] = []
        while self._is_spinning and self._frame_world_s <= now_s + 1e-9:
            if self.is_stalled or self._has_stalled(now_s):
                self._frame_world_s = now_s + self._frame_s()
                break
            frames.append(self._frame())
            self._frame_world_s += self._frame_s()
        if not frames:
            return ()
        distances_mm = self._distances_mm([degree for frame in frames for degree in frame.degrees])
        found = []
        start = 0
        for frame in frames:
            end = start + len(frame.degrees)
            data = frame.encoded(distances_mm[start:end])
            start = end
            if self._is_cut:
                data = data[self._chance.randrange(1, len(data)) :]
                self._is_cut = False
            found.append(Sending(data))
        return found

    def receive(self, data: bytes, baud: int) -> Iterable[Sending]:
        """Receive bytes: a LiDAR has no ears, unless a model says otherwise."""
        return ()

    def _spin(self) -> None:
        if not self._is_spinning:
            self._is_spinning = True
            self._is_cut = self._starts_mid_frame
            self._begin_revolution(self._chance.random())
            self._spun_s = self._time.world_s()
            self._stalls_s = self._spun_s + self._until_stall_s()
            self._frame_world_s = self._time.world_s() + self._frame_s()

    def _halt(self) -> None:
        self._is_spinning = False

    def _until_stall_s(self) -> float:
        mean_s = self._profile.stall_every_s
        return self._chance.expovariate(1.0 / mean_s) if mean_s else math.inf

    def _has_stalled(self, now_s: float) -> bool:
        """Return True if its motor stands still; when it goes on, it must come to its speed again."""
        if now_s >= self._stalls_s:
            self._stalled_until_s = now_s + self._profile.stall_s
            self._stalls_s = self._stalled_until_s + self._until_stall_s()
            self._spun_s = self._stalled_until_s
        return now_s < self._stalled_until_s

    @abstractmethod
    def _begin_revolution(self, share: float) -> None:
        """Be at this share of a revolution when the motor starts."""

    @abstractmethod
    def _frame_s(self) -> float:
        """Return the duration of the frame that is being measured, in seconds."""

    @abstractmethod
    def _frame(self) -> _Frame:
        """The frame that is complete now."""

    def _distances_mm(self, device_degrees: Sequence[float]) -> list[int]:
        """Return the distances measured at clockwise angles from the front, in mm; 0: nothing."""
        angles = -np.radians(np.asarray(device_degrees))
        directions = np.stack((np.cos(angles), np.sin(angles)), axis=1)
        return self._measured(*self._world.seen(None, directions))

    def _measured(self, true_m: Floats, looks: Looks | None) -> list[int]:
        profile, chance = self._profile, self._chance
        lengths_m = true_m
        if self._noise_m:
            lengths_m = lengths_m + [chance.gauss(0.0, self._noise_m) for _ in range(len(lengths_m))]
        if profile.lidar_share:
            lengths_m = lengths_m * [1.0 + chance.gauss(0.0, profile.lidar_share) for _ in range(len(lengths_m))]
        is_seen = (lengths_m >= self.nearest_m) & (lengths_m <= self.farthest_m) & (not self.is_covered)
        if profile.dropout_share:
            is_seen &= np.array([chance.random() for _ in range(len(lengths_m))]) >= profile.dropout_share
        if looks is not None:
            is_seen &= (looks != _DARK) | (true_m <= profile.dark_reach * self.farthest_m)
            returns = np.array([chance.random() for _ in range(len(lengths_m))]) < profile.sees_glass
            is_seen &= (looks != _GLASS) | returns
        found: list[int] = np.rint(np.where(is_seen, lengths_m, 0.0) * 1000).astype(int).tolist()
        return found


class Lds01(Lidar):
    """LDS-01 (HLS-LFCD2): `b` starts the motor, `e` stops it; it rotates at power-on without a command."""

    baud = 230_400
    nominal_hz = 5.0
    nearest_m = 0.12
    farthest_m = 3.5
    beams = 360

    def receive(self, data: bytes, baud: int) -> Iterable[Sending]:
        """Obey the last command in it."""
        for byte in data:
            if byte == ord("b"):
                self._spin()
            elif byte == ord("e"):
                self._halt()
        return ()

    def _begin_revolution(self, share: float) -> None:
        self._index = int(share * 60)

    def _frame_s(self) -> float:
        return 1.0 / (60 * self.revolutions_per_s)

    def _frame(self) -> _Frame:
        degrees = [6 * self._index + place + 1 for place in range(6)]
        encoded = partial(self._encoded, self._index, round(self.revolutions_per_s * 600))
        self._index = (self._index + 1) % 60
        return _Frame(degrees, encoded)

    @staticmethod
    def _encoded(index: int, tenths_rpm: int, distances_mm: Sequence[int]) -> bytes:
        return lds01_frame(index, tenths_rpm, [(distance_mm, 1000 * bool(distance_mm)) for distance_mm in distances_mm])


class Lds02(Lidar):
    """LDS-02 (LD08): it only talks, from power-on."""

    baud = 115_200
    nominal_hz = 2152 / 360
    nearest_m = 0.16
    farthest_m = 8.0

    _POINTS = 12
    _SAMPLES_PER_S = 2300.0
    beams = round(_SAMPLES_PER_S / nominal_hz)
    # Corrected point of a distance d (mm) at angle 0: (d + 5.9, 0.11923 d - 20.14).
    _CENTRE_M = (0.0059, -0.02014)
    _DIRECTION = (1.0, 0.11923)

    def _begin_revolution(self, share: float) -> None:
        self._degrees = share * 360

    def _frame_s(self) -> float:
        return self._POINTS / self._SAMPLES_PER_S

    def _frame(self) -> _Frame:
        speed = self.revolutions_per_s * 360
        start = round(self._degrees * 100) % 36_000
        span = round(speed / self._SAMPLES_PER_S * 100 * (self._POINTS - 1))
        # A host places the points in whole hundredths of a degree.
        step = span // (self._POINTS - 1)
        degrees = [(start + place * step) / 100 for place in range(self._POINTS)]
        stamp_ms = int(self._time.world_s() * 1000) % 65_536
        encoded = partial(self._encoded, round(speed), start, (start + span) % 36_000, stamp_ms)
        self._degrees = (self._degrees + self._POINTS * speed / self._SAMPLES_PER_S) % 360
        return _Frame(degrees, encoded)

    @staticmethod
    def _encoded(speed: int, start: int, end: int, stamp_ms: int, distances_mm: Sequence[int]) -> bytes:
        return lds02_frame(speed, start, end, stamp_ms, [(each, 200 * bool(each)) for each in distances_mm])

    def _distances_mm(self, device_degrees: Sequence[float]) -> list[int]:
        """Return the distances from its optical centre, along the rays on which the corrected points lie."""
        angles = -np.radians(np.asarray(device_degrees))
        cosines, sines = np.cos(angles), np.sin(angles)

        def turned(vector: tuple[float, float]) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
            x, y = vector
            return np.stack((x * cosines - y * sines, x * sines + y * cosines), axis=1)

        return self._measured(*self._world.seen(turned(self._CENTRE_M), turned(self._DIRECTION)))


class Lds03(Lidar):
    """LDS-03 (COIN-D4): idle until a command starts it; it sends its identity then.

    Which speeds its two exposures have is not documented: 6 and 10 revolutions a second.
    """

    baud = 230_400
    nominal_hz = 10.0
    nearest_m = 0.05
    farthest_m = 12.0

    _SAMPLES_PER_S = 4000.0
    beams = round(_SAMPLES_PER_S / nominal_hz)
    _FULL = 25
    _START, _STOP, _SLOW, _FAST, _VERSION = (
        bytes((0xAA, 0x55, code, 0xFF - code)) for code in (0xF0, 0xF5, 0xF1, 0xF2, 0xFC)
    )
    _GREETING = bytes.fromhex("a55a0000800181")

    def plug_in(self) -> None:
        """Power comes: it waits for its start command."""
        self._heard = b""
        self._halt()

    def receive(self, data: bytes, baud: int) -> Iterable[Sending]:
        """Obey what it knows; the rest is noise."""
        found: list[Sending] = []
        held = self._heard + data
        while len(held) >= 4:
            command, held = held[:4], held[4:]
            match command:
                case self._START:
                    if not self._is_spinning:
                        found += [Sending(self._GREETING[:2]), Sending(lds03_identity()), Sending(self._GREETING)]
                    self._spin()
                case self._STOP:
                    self._halt()
                case self._SLOW:
                    self.nominal_hz = 6.0
                case self._FAST:
                    self.nominal_hz = 10.0
                case self._VERSION:
                    found.append(Sending(lds03_identity()))
                case _:
                    held = command[1:] + held
        self._heard = held
        return found

    def _begin_revolution(self, share: float) -> None:
        # The part of a revolution that is left, in samples.
        self._degrees = share * 360
        self._begins_revolution = False

    @property
    def _degrees_per_sample(self) -> float:
        return 360 * self.revolutions_per_s / self._SAMPLES_PER_S

    def _samples(self) -> int:
        if self._begins_revolution:
            return 1
        left = math.ceil((360 - self._degrees) / self._degrees_per_sample - 1e-6)
        return max(1, min(self._FULL, left))

    def _frame_s(self) -> float:
        return self._samples() / self._SAMPLES_PER_S

    def _frame(self) -> _Frame:
        count = self._samples()
        step = self._degrees_per_sample
        first, last = (_angle(self._degrees + place * step) for place in (0, count - 1))
        # Hosts place the samples at these angles.
        degrees = [(first + place * (last - first) / max(count - 1, 1)) / 64 for place in range(count)]
        kind = (round(self.revolutions_per_s * 10) << 1 | 1) & 0xFF if self._begins_revolution else 0
        self._degrees += count * step
        self._begins_revolution = self._degrees >= 360 - 1e-6
        if self._begins_revolution:
            self._degrees = max(self._degrees - 360, 0.0)
        return _Frame(degrees, partial(self._encoded, kind, first, last))

    @staticmethod
    def _encoded(kind: int, first: int, last: int, distances_mm: Sequence[int]) -> bytes:
        return lds03_frame(kind, first, last, [(each, 200 * bool(each)) for each in distances_mm])


def _angle(degrees: float) -> int:
    """Return the angle in degrees / 64, below a whole revolution."""
    return min(round(degrees * 64), 360 * 64 - 1)


LIDARS: dict[str, Callable[..., Lidar]] = {"lds01": Lds01, "lds02": Lds02, "lds03": Lds03}
