"""Judgement of readings by what a body can do: none moves it further or faster than physics allows.

A right checksum says that the bytes came as they were sent, and nothing about their contents: firmware spoils an answer
before it signs it, a motor restarts and counts anew, an estimator is reset. So each driver lets a `ReadingJudge` see a
reading before it counts. A reading that cannot follow the last one is refused, counted and told, and the driver asks
again. If the next one agrees with it, the device has begun to count from another place: the driver begins anew there,
and what lies between the two is no motion.
"""

import logging
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Protocol

from robosc_bridge.devices.interface import DriveLimits
from robosc_bridge.devices.robots import RAW_RPM, TICKS_PER_TURN

FASTEST_RAW = 1023
"""Fastest velocity of a servo in its own unit: the largest that the X series can be set to, far above what they do."""

FASTEST_BODY_M_S, FASTEST_BODY_RAD_S = 5.0, 2 * math.pi
"""Speeds that any body may have while a person drives or pushes it, whatever the bridge commands it at most."""

FASTEST_SHARE = 2.0
"""Speed that a body may have, by the fastest that it is commanded, where that is more, such as downhill."""

MOST_LAG_S = 1.0
"""Longest time by which reports may come late, so that several come at once, in seconds."""

TOLD_S = 10.0
"""Shortest time between two warnings of one judge, in seconds; each refused reading is counted."""

_FASTEST_TICKS_S = FASTEST_RAW * RAW_RPM / 60 * TICKS_PER_TURN
_MODULUS = 2**32
# Half a revolution: a motor that restarts begins again within one, and worlds that are simulated pass faster.
_SLACK_TICKS = TICKS_PER_TURN // 2
_SIDES = ("left", "right")
# Ways that an estimate may be corrected by without a jump.
_SLACK_M, _SLACK_RAD = 0.25, 0.2
_YAW_SLACK_RAD = 0.1
# Ranges of the inertial sensors that the boards have (2000 degrees/s, 16 g), and more.
_MEASURABLE = {"angular_velocity": 40.0, "linear_acceleration": 200.0}

_log = logging.getLogger(__name__)


class Verdict(Enum):
    """Judgement of a reading."""

    SOUND = "sound"
    REFUSED = "refused"
    ANEW = "begun anew"


type Excess = tuple[str, ...]
"""Reason why each part of a reading cannot follow an earlier one; empty for a part that can."""


class ReadingJudge[Reading]:
    """Judge of the successive readings of one device.

    Args:
        name: Name of the device, for warnings; empty: nobody is warned.
        excess: Function that returns why a reading cannot follow an earlier one within a time in seconds.
        absurdity: Function that returns why a reading is impossible on its own; empty: it is not.

    Attributes:
        refused: Number of readings that were refused.
        begun_anew: Number of times that a device has begun to count from another place.
        excess: Reasons of the last judgement, by part.
    """

    def __init__(
        self,
        name: str,
        excess: Callable[[Reading, Reading, float], Excess],
        absurdity: Callable[[Reading], str] = lambda reading: "",
    ) -> None:
        self.refused = self.begun_anew = 0
        self.excess: Excess = ()
        self._name = name
        self._excess_of = excess
        self._absurdity_of = absurdity
        self._last: tuple[Reading, float] | None = None
        # The last reading that was refused: if the next one agrees, it was right.
        self._candidate: tuple[Reading, float] | None = None
        self._told_s = -math.inf

    def forget(self) -> None:
        """Let any reading follow, as after the device was opened or has restarted."""
        self._last = self._candidate = None

    def judge(self, reading: Reading, time_s: float) -> Verdict:
        """Return whether a reading counts; one of the time of a refused one does not confirm it.

        Args:
            reading: Reading of the device.
            time_s: Time of the reading, in seconds.
        """
        absurdity = self._absurdity_of(reading)
        if absurdity:
            self.excess = (absurdity,)
            self._refuse(absurdity, time_s)
            return Verdict.REFUSED
        self.excess = self._since(self._last, reading, time_s)
        if not any(self.excess):
            self._last, self._candidate = (reading, time_s), None
            return Verdict.SOUND
        reason = "; ".join(filter(None, self.excess))
        candidate = self._candidate
        if candidate is not None and time_s > candidate[1] and not any(self._since(candidate, reading, time_s)):
            self.begin_anew(reading, time_s)
            if self._name:
                _log.warning("%s: it counts from another place, and is followed from there: %s", self._name, reason)
            return Verdict.ANEW
        self._candidate = reading, time_s
        self._refuse(reason, time_s)
        return Verdict.REFUSED

    def refuse(self, reason: str, time_s: float) -> None:
        """Refuse a reading for a reason that its driver knows."""
        self._refuse(reason, time_s)

    def begin_anew(self, reading: Reading, time_s: float) -> None:
        """Follow a device from this reading on, which was refused, as its driver knows that it may count anew."""
        self._last, self._candidate = (reading, time_s), None
        self.begun_anew += 1

    def _since(self, before: tuple[Reading, float] | None, reading: Reading, time_s: float) -> Excess:
        return () if before is None else self._excess_of(before[0], reading, abs(time_s - before[1]))

    def _refuse(self, reason: str, time_s: float) -> None:
        self.refused += 1
        if self._name and not 0.0 <= time_s - self._told_s < TOLD_S:
            self._told_s = time_s
            _log.warning("%s: a reading is refused (%d so far): %s", self._name, self.refused, reason)


@dataclass(frozen=True, slots=True)
class WheelCounts:
    """Counts of two wheels: the left and the right one.

    Attributes:
        ticks: Counts of the encoders, modulo 2**32.
        velocities_raw: Velocities in the unit of the servos.
    """

    ticks: tuple[int, int]
    velocities_raw: tuple[int, int]


def wheel_judge(name: str, lag_s: float) -> ReadingJudge[WheelCounts]:
    """Return a judge of the counts of two servos; its parts are the left and the right wheel.

    Args:
        name: Name of the device, for warnings.
        lag_s: Time by which a reading may be later than its time says, in seconds.
    """

    def excess(before: WheelCounts, now: WheelCounts, passed_s: float) -> Excess:
        reach = _SLACK_TICKS + _FASTEST_TICKS_S * (passed_s + lag_s)
        found = []
        for side, start, end in zip(_SIDES, before.ticks, now.ticks, strict=True):
            step = (end - start + _MODULUS // 2) % _MODULUS - _MODULUS // 2
            text = f"the {side} wheel would have turned by {step / TICKS_PER_TURN:.2f} revolutions in {passed_s:.3f} s"
            found.append("" if abs(step) <= reach else text)
        return tuple(found)

    def absurdity(now: WheelCounts) -> str:
        fastest = max(now.velocities_raw, key=abs)
        return "" if abs(fastest) <= FASTEST_RAW else f"a wheel would turn at {fastest * RAW_RPM:.0f} rpm"

    return ReadingJudge(name, excess, absurdity)


class PlanarMotion(Protocol):
    """Place, heading and velocity of a body, with the times at which the place and the heading were measured."""

    @property
    def x_m(self) -> float:
        """Place along the first axis."""

    @property
    def y_m(self) -> float:
        """Place along the second axis."""

    @property
    def heading_rad(self) -> float:
        """Heading."""

    @property
    def linear_m_s(self) -> float:
        """Velocity forward."""

    @property
    def angular_rad_s(self) -> float:
        """Yaw rate."""

    @property
    def place_s(self) -> float:
        """Time of the place by the device's own clock."""

    @property
    def heading_s(self) -> float:
        """Time of the heading by the device's own clock."""


def body_judge(name: str, limits: DriveLimits) -> ReadingJudge[PlanarMotion]:
    """Return a judge of the estimates that a vehicle makes of its motion; they have one part.

    Times are those at which they came. Of estimates that come late, and together, the vehicle's clock says how much
    time is between them; it is believed up to `MOST_LAG_S` more than has passed here.

    Args:
        name: Name of the vehicle, for warnings.
        limits: Limits of what it is commanded.
    """
    fastest_m_s = max(FASTEST_BODY_M_S, FASTEST_SHARE * limits.linear_m_s)
    fastest_rad_s = max(FASTEST_BODY_RAD_S, FASTEST_SHARE * limits.angular_rad_s)

    def excess(before: PlanarMotion, now: PlanarMotion, passed_s: float) -> Excess:
        def between_s(start_s: float, end_s: float) -> float:
            return max(passed_s, min(abs(end_s - start_s), passed_s + MOST_LAG_S))

        way_m = math.hypot(now.x_m - before.x_m, now.y_m - before.y_m)
        place_s, turn_s = between_s(before.place_s, now.place_s), between_s(before.heading_s, now.heading_s)
        if way_m > fastest_m_s * place_s + _SLACK_M:
            return (f"the body would have moved by {way_m:.2f} m in {place_s:.3f} s",)
        turn_rad = abs(math.remainder(now.heading_rad - before.heading_rad, math.tau))
        if turn_rad > fastest_rad_s * turn_s + _SLACK_RAD:
            return (f"the body would have turned by {math.degrees(turn_rad):.0f} degrees in {turn_s:.3f} s",)
        return ("",)

    def absurdity(now: PlanarMotion) -> str:
        if abs(now.linear_m_s) > fastest_m_s:
            return f"the body would move at {now.linear_m_s:.2f} m/s"
        return (
            "" if abs(now.angular_rad_s) <= fastest_rad_s else f"the body would turn at {now.angular_rad_s:.2f} rad/s"
        )

    return ReadingJudge(name, excess, absurdity)


def yaw_judge(name: str) -> ReadingJudge[float]:
    """Return a judge of the yaw in radians that an inertial sensor reports; times are the sensor's own.

    Args:
        name: Name of the sensor, for warnings.
    """

    def excess(before: float, now: float, passed_s: float) -> Excess:
        turn_rad = abs(math.remainder(now - before, math.tau))
        if turn_rad <= FASTEST_BODY_RAD_S * passed_s + _YAW_SLACK_RAD:
            return ("",)
        return (f"the inertial sensor would have turned by {math.degrees(turn_rad):.0f} degrees in {passed_s:.3f} s",)

    return ReadingJudge(name, excess)


def measurable(motion: Mapping[str, float]) -> dict[str, float]:
    """Return the measurements of an inertial sensor, such as `angular_velocity_z`, that its ranges have."""
    return {name: value for name, value in motion.items() if abs(value) <= _MEASURABLE.get(name[:-2], math.inf)}
