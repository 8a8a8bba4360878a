"""Random sequences: the layer says what its slow and obvious twin says, and what must never happen does not."""

import math
from typing import Any

import hypothesis.strategies as st
import pytest
from hypothesis import settings
from hypothesis.stateful import RuleBasedStateMachine, initialize, precondition, rule

from robosc_bridge.devices.interface import STANDSTILL, BatteryLevel, MotorFault, Velocity
from robosc_bridge.safety import LATCHING, Output, Reason, SafetyLayer
from support.effort import examples
from support.safety import LIMITS, STEP_S, reading
from support.safety_twin import SafetyTwin

SPEEDS = st.sampled_from([0.0, -0.0, 0.005, 0.1, 0.2, -0.2, 0.5, 3.0, -3.0, math.nan, math.inf]) | st.floats(-3, 3)
# Behind the clock or ahead of it, and no time at all; most reports come just in time.
SHIFTS = st.sampled_from([0.0] * 6 + [0.01, 0.1, 50.0, -0.1, -0.4, -1.0, math.nan, math.inf])
SEEN, NOT_SEEN = (1.0,) * 180, (math.nan,) * 180
# Front and left, back and right, all and nothing; something that touches in front, behind and beside; or unknown.
TOUCHED = [tuple(0.0 if degree == at else 1.0 for degree in range(360)) for at in (30, 31, 150, 330)]
SCANS = st.sampled_from(
    [(), SEEN + SEEN, SEEN + NOT_SEEN, NOT_SEEN + SEEN, (*SEEN[90:], *NOT_SEEN, *SEEN[90:]), NOT_SEEN * 2, *TOUCHED]
)
STEPS = st.sampled_from([STEP_S] * 8 + [0.0, 0.001, 0.15, 0.25, 0.7, 2.1, 6.0])
FAULTS = st.sampled_from([frozenset[MotorFault]()] * 8 + [frozenset({fault}) for fault in MotorFault])


class Sequence(RuleBasedStateMachine):
    """Possible actions of threads, motors and operators, in any order."""

    def __init__(self) -> None:
        super().__init__()
        self.now_s = 100.0
        self.last = Output(STANDSTILL, False, (), ())

    @initialize(
        is_off=st.booleans(),
        needs_all=st.booleans(),
        is_driving=st.sampled_from([True, True, False]),
        is_stopped=st.booleans(),
    )
    def begin(self, is_off: bool, needs_all: bool, is_driving: bool, is_stopped: bool) -> None:
        changes: dict[str, Any] = {"is_torque_off_on_operator_stop": is_off, "is_stopped_when_blind": is_stopped}
        changes |= {"battery_mean_s": 0.1, "astray_s": 0.1, "unbidden_s": 0.05}
        if not needs_all:
            changes |= {"scan_timeout_s": None, "operator_timeout_s": None}
        self.limits = LIMITS.__class__(**{**LIMITS.__dict__, **changes})
        self.layer, self.twin = SafetyLayer(self.limits), SafetyTwin(self.limits)
        # Reasons that must be reset before anything may move again; then whether it is enabled.
        self.stopped: set[Reason] = set()
        self.is_enabled = False
        if is_driving:
            self.enable()
            self.healthy(4, 0.2, 0.3)
            assert self.last.velocity != STANDSTILL

    @rule()
    def enable(self) -> None:
        self.layer.enable()
        self.twin.happens("enable")
        self.is_enabled = True

    @rule()
    @precondition(lambda self: self.last.velocity != STANDSTILL)
    def disable(self) -> None:
        self.layer.disable()
        self.twin.happens("disable")
        self.is_enabled = False

    @rule(linear=SPEEDS, angular=SPEEDS, shift_s=SHIFTS)
    def command(self, linear: float, angular: float, shift_s: float) -> None:
        velocity = Velocity(linear, angular)
        self.layer.command(velocity, self.now_s + shift_s)
        self.twin.happens("command", velocity, self.now_s + shift_s)

    @rule(name=st.sampled_from(["scan", "loop", "operator"]), shift_s=SHIFTS)
    def fact(self, name: str, shift_s: float) -> None:
        self._report(name, self.now_s + shift_s)

    def _report(self, name: str, time_s: float) -> None:
        report = {"scan": self.layer.on_scan, "loop": self.layer.loop_cycled, "operator": self.layer.operator_seen}
        report[name](time_s)
        if name == "loop":
            self.twin.loop_cycled(time_s)
        else:
            self.twin.happens(name, None, time_s)

    @rule(
        shift_s=SHIFTS,
        wheels=st.none() | st.tuples(SPEEDS, SPEEDS),
        is_obeying=st.sampled_from([True] * 9 + [False]),
        faults=FAULTS,
        battery_v=st.sampled_from([None, 12.0, 12.0, 11.6, 11.0, math.nan]),
        acceleration_m_s2=st.sampled_from([None, None, None, 0.05, 0.5]),
        level=st.sampled_from([None, None, None, *BatteryLevel]),
    )
    def drive(
        self,
        shift_s: float,
        wheels: tuple[float, float] | None,
        is_obeying: bool,
        faults: frozenset[MotorFault],
        battery_v: float | None,
        acceleration_m_s2: float | None,
        level: BatteryLevel | None,
    ) -> None:
        is_torque_on = self.last.is_torque_wanted is is_obeying
        self._read(self.now_s + shift_s, wheels, is_torque_on, faults, battery_v, acceleration_m_s2, level)

    def _read(
        self,
        time_s: float,
        wheels: tuple[float, float] | None = None,
        is_torque_on: bool = True,
        faults: frozenset[MotorFault] = frozenset(),
        battery_v: float | None = 12.0,
        acceleration_m_s2: float | None = None,
        level: BatteryLevel | None = None,
    ) -> None:
        turn = self.last.velocity.angular_rad_s * self.limits.separation_m / 2
        commanded = (self.last.velocity.linear_m_s - turn, self.last.velocity.linear_m_s + turn)
        found = reading(
            time_s,
            wheels_m_s=wheels or commanded,
            is_torque_on=is_torque_on,
            faults=faults,
            battery_v=battery_v,
            acceleration_m_s2=acceleration_m_s2,
            battery_level=level,
        )
        self.layer.on_drive_reading(found)
        self.twin.answers(found)
        if faults - {MotorFault.VOLTAGE, MotorFault.UNCOMMANDED}:
            self.stopped.add(Reason.MOTOR_FAULT)
        if MotorFault.UNCOMMANDED in faults:
            self.stopped.add(Reason.UNBIDDEN_MOTION)

    @rule(ranges_m=SCANS)
    def scan(self, ranges_m: tuple[float, ...]) -> None:
        self.layer.on_scan(self.now_s, ranges_m)
        self.twin.happens("scan", ranges_m, self.now_s)

    @rule()
    def failure(self) -> None:
        self.layer.drive_failed()
        self.twin.happens("failure")

    @rule(is_operator=st.booleans())
    @precondition(lambda self: self.last.velocity != STANDSTILL)
    def stop(self, is_operator: bool) -> None:
        if is_operator:
            self.layer.operator_stop()
            self.twin.happens("stop")
            self.stopped.add(Reason.OPERATOR_STOP)
        else:
            self.layer.supervisor_fault()
            self.twin.happens("fault")
            self.stopped.add(Reason.SUPERVISOR_FAULT)

    @rule()
    def reset(self) -> None:
        remaining = self.layer.reset()
        assert remaining == self.twin.reset()
        if not remaining:
            self.stopped, self.is_enabled = set(), False

    @rule(
        cycles=st.integers(1, 12),
        speed=st.sampled_from([0.0, 0.0, 0.015, 0.05, math.nan]),
        acceleration_m_s2=st.sampled_from([None, 0.05, 0.5]),
    )
    def rotate(self, cycles: int, speed: float, acceleration_m_s2: float | None) -> None:
        """The wheels rotate so, whatever is commanded, and all else goes on."""
        for _ in range(cycles):
            self._read(self.now_s + STEP_S / 2, (speed, 0.0), acceleration_m_s2=acceleration_m_s2)
            self.now_s += STEP_S
            for name in ("scan", "loop", "operator"):
                self._report(name, self.now_s)
            self._judge(self.now_s)

    @rule(cycles=st.integers(1, 8))
    def wait(self, cycles: int) -> None:
        """The loop turns alone, while the drive base takes its time."""
        for _ in range(cycles):
            self.now_s += 0.4
            self._report("loop", self.now_s)

    @rule(step_s=STEPS)
    def output(self, step_s: float) -> None:
        self.now_s += step_s
        self._judge(self.now_s)

    @rule(now_s=st.sampled_from([math.nan, math.inf, -math.inf, 99.0, 0.0]) | st.floats(90, 110))
    def odd_output(self, now_s: float) -> None:
        self._judge(now_s)
        if math.isfinite(now_s):
            self.now_s = now_s

    @rule(cycles=st.integers(1, 8), linear=st.floats(-0.3, 0.3), angular=st.floats(-3, 3))
    def healthy(self, cycles: int, linear: float, angular: float) -> None:
        """Some cycles as they should be."""
        for _ in range(cycles):
            self._read(self.now_s + STEP_S / 2, is_torque_on=self.last.is_torque_wanted)
            self.now_s += STEP_S
            for name in ("scan", "loop", "operator"):
                self._report(name, self.now_s)
            self.command(linear, angular, 0.0)
            self._judge(self.now_s)

    def _judge(self, now_s: float) -> None:
        before, last_s = self.last.velocity, self.twin.past_now_s()
        found, expected = self.layer.output(now_s), self.twin.output(now_s)
        self.last = found
        assert found.reasons == expected.reasons
        assert found.is_torque_wanted == expected.is_torque_wanted
        v, w = found.velocity.linear_m_s, found.velocity.angular_rad_s
        assert v == pytest.approx(expected.velocity.linear_m_s, abs=1e-12)
        assert w == pytest.approx(expected.velocity.angular_rad_s, abs=1e-12)
        # Facts that hold whatever the twin says.
        assert self.stopped <= set(found.reasons)
        assert not set(found.reasons) & set(LATCHING) or found.velocity == STANDSTILL
        if found.velocity == STANDSTILL:
            return
        assert self.is_enabled and not self.stopped and not found.reasons
        assert found.is_torque_wanted
        assert abs(v) <= self.limits.linear_m_s and abs(w) <= self.limits.angular_rad_s
        assert abs(v) + abs(w) * self.limits.separation_m / 2 <= self.limits.wheel_m_s * (1 + 1e-12)
        step_s = now_s - last_s
        assert step_s >= 0
        assert abs(v) <= abs(before.linear_m_s) + self.limits.linear_acceleration_m_s2 * step_s + 1e-12
        assert abs(w) <= abs(before.angular_rad_s) + self.limits.angular_acceleration_rad_s2 * step_s + 1e-12


Sequence.TestCase.settings = settings(max_examples=examples(50), stateful_step_count=40)
test_random_sequences = Sequence.TestCase
