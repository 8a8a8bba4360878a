"""A safety layer between a commander and wheels that obey, on a clock that the test moves."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from robosc_bridge.devices.interface import STANDSTILL, DriveReading, Pose, Velocity
from robosc_bridge.safety import Output, Reason, SafetyLayer, SafetyLimits

LIMITS = SafetyLimits(
    linear_m_s=0.2,
    angular_rad_s=2.0,
    wheel_m_s=0.2,
    separation_m=0.16,
    scan_timeout_s=0.6,
    operator_timeout_s=5.0,
    loop_timeout_s=0.2,
    angular_acceleration_rad_s2=4.0,
    battery_warn_v=11.5,
    battery_stop_v=11.1,
)
STEP_S = 0.02


def reading(time_s: float, **changes: Any) -> DriveReading:
    """Return a reading of wheels at rest, torque on, with a full battery."""
    sound = DriveReading(time_s, Pose(), STANDSTILL, (0.0, 0.0), is_torque_on=True, battery_v=12.0)
    return replace(sound, **changes)


def near(linear_m_s: float, angular_rad_s: float = 0.0) -> Any:
    """Equal to velocities that differ from this one by rounding."""
    parts: list[Any] = [pytest.approx(linear_m_s, abs=1e-12), pytest.approx(angular_rad_s, abs=1e-12)]
    return Velocity(*parts)


class Bench:
    """Bench that does what the threads of a bridge do, once for each cycle.

    Attributes:
        layer: Safety layer under test.
        now_s: Time of the last cycle, in seconds.
        last: Output of the last cycle.
        silent: Names of reports that are left out: "scan", "drive", "loop", "operator", "command".
        wheels_m_s: Speeds of the wheels, in m/s; None: as ordered.
        holds: True if the motors hold; None: as ordered.
        ranges_m: Ranges of a full scan, in metres.
        acceleration_m_s2: Acceleration that the motors report; None: as fast as they can.
        refused: Number of readings that the drive base has refused.
    """

    def __init__(self, **changes: Any) -> None:
        self.limits = replace(LIMITS, **changes)
        self.layer = SafetyLayer(self.limits)
        self.now_s = 1000.0
        self.silent: set[str] = set()
        self.wanted = STANDSTILL
        self.wheels_m_s: tuple[float, float] | None = None
        self.holds: bool | None = None
        self.battery_v: float | None = 12.0
        self.ranges_m: tuple[float, ...] = ()
        self.acceleration_m_s2: float | None = None
        self.refused = 0
        self.last = Output(STANDSTILL, False, (), ())

    def report(self) -> None:
        """Make the reports of the other threads at this time."""
        facts: dict[str, Callable[[float], None]] = {
            "scan": lambda now_s: self.layer.on_scan(now_s, self.ranges_m),
            "loop": self.layer.loop_cycled,
            "operator": self.layer.operator_seen,
        }
        for name, report in facts.items():
            if name not in self.silent:
                report(self.now_s)
        if "command" not in self.silent:
            self.layer.command(self.wanted, self.now_s)

    def cycle(self, step_s: float = STEP_S) -> Output:
        """The next exchange."""
        if "drive" not in self.silent:
            v, turn = self.last.velocity.linear_m_s, self.last.velocity.angular_rad_s * self.limits.separation_m / 2
            self.layer.on_drive_reading(
                reading(
                    self.now_s + STEP_S / 2,
                    wheels_m_s=self.wheels_m_s or (v - turn, v + turn),
                    is_torque_on=self.last.is_torque_wanted if self.holds is None else self.holds,
                    battery_v=self.battery_v,
                    acceleration_m_s2=self.acceleration_m_s2,
                    refused=self.refused,
                )
            )
        self.now_s += step_s
        self.report()
        self.last = self.layer.output(self.now_s)
        return self.last

    def cycles(self, time_s: float) -> Output:
        """Run as many cycles as fill this time."""
        for _ in range(round(time_s / STEP_S)):
            self.cycle()
        return self.last

    def drive(self, linear_m_s: float = 0.1, angular_rad_s: float = 0.0) -> Velocity:
        """Enable, and command until that velocity is reached."""
        self.wanted = Velocity(linear_m_s, angular_rad_s)
        self.layer.enable()
        assert self.cycles(1.5).velocity == self.wanted, self.last
        return self.last.velocity

    def until_still(self, limit_s: float) -> tuple[float, Reason]:
        """Run until standstill is put out; return the time that it takes, in seconds, and the reason."""
        begin_s = self.now_s
        while self.cycle().velocity != STANDSTILL:
            assert self.now_s - begin_s <= limit_s, "still moving"
        (reason,) = self.last.reasons
        return self.now_s - begin_s, reason
