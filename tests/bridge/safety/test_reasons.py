"""Every reason is provoked: it stops the robot in its time, and ends as it should."""

import math
from collections.abc import Callable
from dataclasses import replace

import pytest

from robosc_bridge.devices.interface import STANDSTILL, MotorFault, Velocity
from robosc_bridge.safety import LATCHING, TORQUE_OFF, Caution, Reason
from support.safety import STEP_S, Bench, near, reading

END_BY_THEMSELVES = {
    "scan": (Reason.SCAN_STALE, 0.6),
    "drive": (Reason.MOTOR_SILENT, 0.2),
    "loop": (Reason.LOOP_OVERRUN, 0.2),
    "operator": (Reason.OPERATOR_LOST, 5.0),
    "command": (Reason.COMMAND_SILENT, 0.3),
}


def fault(bench: Bench) -> None:
    bench.layer.on_drive_reading(reading(bench.now_s, faults=frozenset({MotorFault.OVERLOAD})))


def lose_torque(bench: Bench) -> None:
    bench.holds = False
    bench.cycle()
    bench.holds = None


def pause(bench: Bench) -> None:
    bench.now_s += 0.6
    bench.layer.loop_cycled(bench.now_s)


LATCHED: dict[Reason, Callable[[Bench], object]] = {
    Reason.OPERATOR_STOP: lambda bench: bench.layer.operator_stop(),
    Reason.SUPERVISOR_FAULT: lambda bench: bench.layer.supervisor_fault(),
    Reason.PAUSED: pause,
    Reason.MOTOR_FAULT: fault,
    Reason.TORQUE_LOST: lose_torque,
}


def restart(bench: Bench) -> None:
    """Do as an operator does after a stop."""
    bench.cycles(2.0)  # torque goes off
    assert bench.layer.reset() == ()
    assert bench.cycle().reasons == (Reason.STANDBY,)
    bench.drive(0.05)


def test_every_reason_is_a_sentence_and_either_latches_or_not() -> None:
    expected = {*LATCHED, Reason.WHEEL_ASTRAY, Reason.UNBIDDEN_MOTION, Reason.BATTERY_LOW}
    assert set(LATCHING) == expected
    others = {reason for reason, _ in END_BY_THEMSELVES.values()}
    seen = {Reason.SCAN_BLIND, Reason.SCAN_TOUCHING}
    assert expected | others | seen | {Reason.STANDBY, Reason.CLOCK, Reason.TORQUE_AWAITED} == set(Reason)
    assert all(text.endswith(".") and text[0].isupper() for text in [*Reason, *Caution])


def test_it_moves_when_nothing_is_wrong() -> None:
    bench = Bench()
    bench.drive(0.1, 0.5)
    assert bench.cycles(10.0) == bench.last
    assert bench.last.velocity == Velocity(0.1, 0.5)
    assert (bench.last.is_torque_wanted, bench.last.reasons, bench.last.warnings) == (True, (), ())


@pytest.mark.parametrize(("fact", "reason", "timeout_s"), [(f, *v) for f, v in END_BY_THEMSELVES.items()])
def test_silence_stops_it_in_time_and_ends_by_itself(fact: str, reason: Reason, timeout_s: float) -> None:
    bench = Bench()
    bench.drive()
    bench.silent.add(fact)
    time_s, found = bench.until_still(timeout_s + 2 * STEP_S)
    assert found is reason
    assert timeout_s - STEP_S <= time_s <= timeout_s + STEP_S + 1e-9
    for _ in range(50):
        assert bench.cycle().velocity == STANDSTILL
        if fact == "command":
            break
        assert bench.last.reasons == (reason,)
    # The motors hold, and no operator is needed.
    assert bench.last.is_torque_wanted
    bench.silent.clear()
    seen = [bench.cycle() for _ in range(3)]
    moving = [each.velocity.linear_m_s for each in seen if each.velocity != STANDSTILL]
    # From standstill, and with a command that was given after the end of the reason: at the first output without it
    # there is none yet.
    assert moving == pytest.approx([0.02, 0.04] if fact != "command" else [0.02, 0.04, 0.06])
    assert seen[0].reasons == ()


def test_a_command_that_was_not_repeated_never_comes_back() -> None:
    bench = Bench()
    bench.drive()
    bench.silent.add("command")
    bench.until_still(0.4)
    for _ in range(50):
        assert bench.cycle().velocity == STANDSTILL
    assert bench.last.reasons == (Reason.COMMAND_SILENT,)
    # Another reason meanwhile drops it for good.
    bench.layer.disable()
    bench.cycle()
    bench.layer.enable()
    assert bench.cycles(1.0).velocity == STANDSTILL
    assert bench.cycle().reasons == ()


def test_silence_after_a_command_to_stand_still_is_no_reason() -> None:
    bench = Bench()
    bench.drive()
    bench.wanted = STANDSTILL
    bench.cycle()
    bench.silent.add("command")
    assert bench.cycles(1.0).reasons == ()


@pytest.mark.parametrize("reason", LATCHED)
def test_what_latches_stops_at_once_until_reset(reason: Reason) -> None:
    bench = Bench()
    bench.drive()
    LATCHED[reason](bench)
    assert bench.cycle().velocity == STANDSTILL
    assert bench.last.reasons == (reason,)
    for _ in range(100):
        assert bench.cycle().velocity == STANDSTILL
        assert reason in bench.last.reasons
    assert bench.last.is_torque_wanted is (reason not in TORQUE_OFF)
    bench.layer.enable()
    assert bench.cycles(1.0).reasons == (reason,)
    restart(bench)


@pytest.mark.parametrize("motor_fault", MotorFault)
def test_every_fault_of_a_motor_but_its_voltage_stops(motor_fault: MotorFault) -> None:
    bench = Bench()
    bench.drive()
    bench.layer.on_drive_reading(reading(bench.now_s, faults=frozenset({motor_fault, MotorFault.VOLTAGE})))
    found = bench.layer.output(bench.now_s)
    assert (found.velocity == STANDSTILL) is (motor_fault is not MotorFault.VOLTAGE)
    reasons = {MotorFault.VOLTAGE: (), MotorFault.UNCOMMANDED: (Reason.UNBIDDEN_MOTION,)}
    assert found.reasons == reasons.get(motor_fault, (Reason.MOTOR_FAULT,))
    assert found.warnings == (Caution.MOTOR_VOLTAGE,)
    assert bench.cycle().warnings == ()


def test_a_fault_that_remains_forbids_the_reset() -> None:
    bench = Bench()
    bench.drive()
    fault(bench)
    assert bench.layer.reset() == (Reason.MOTOR_FAULT,)
    bench.silent.add("drive")
    bench.cycles(2.0)
    assert not bench.last.is_torque_wanted
    assert bench.layer.reset() == (Reason.MOTOR_FAULT,)
    # The supply's bit alone does not.
    bench.layer.on_drive_reading(reading(bench.now_s, faults=frozenset({MotorFault.VOLTAGE}), is_torque_on=False))
    assert bench.layer.reset() == ()


def test_a_fault_without_torque_wanted_latches_and_leaves_torque_off() -> None:
    bench = Bench()
    fault(bench)
    bench.layer.enable()
    assert bench.cycle().reasons[0] is Reason.MOTOR_FAULT
    assert not bench.cycles(1.0).is_torque_wanted


@pytest.mark.parametrize("wheels_m_s", [(0.0, 0.0), (0.1, 0.0), (0.0, 0.1), (-0.1, -0.1), (0.1, math.nan)])
def test_a_wheel_that_does_not_turn_as_commanded_stops_everything(wheels_m_s: tuple[float, float]) -> None:
    bench = Bench()
    bench.drive()
    bench.wheels_m_s = wheels_m_s
    time_s, reason = bench.until_still(1.0)
    assert reason is Reason.WHEEL_ASTRAY
    assert 0.8 <= time_s <= 0.8 + 2 * STEP_S
    bench.wheels_m_s = (0.0, 0.0)
    assert not bench.cycles(0.06).is_torque_wanted
    bench.wheels_m_s = None
    restart(bench)


def test_a_wheel_that_does_not_stop_loses_its_torque() -> None:
    bench = Bench()
    bench.drive()
    bench.wheels_m_s = (0.1, 0.1)
    bench.wanted = STANDSTILL
    assert bench.cycles(0.8).reasons == ()
    assert bench.cycles(0.06).reasons == (Reason.WHEEL_ASTRAY,)
    assert bench.cycles(0.9).is_torque_wanted
    assert bench.layer.reset() == (Reason.WHEEL_ASTRAY,)
    assert not bench.cycles(0.14).is_torque_wanted


def stopped(bench: Bench) -> tuple[Reason, ...]:
    """Let an operator stop it, which holds."""
    bench.layer.operator_stop()
    return (Reason.OPERATOR_STOP,)


def idle(bench: Bench) -> tuple[Reason, ...]:
    """Let the supervisor want to stand still."""
    bench.wanted = STANDSTILL
    return ()


@pytest.mark.parametrize("stands", [stopped, idle])
def test_wheels_that_nobody_commands_lose_their_torque_at_once(stands: Callable[[Bench], tuple[Reason, ...]]) -> None:
    """A button of the board, or an RC-100, that acts while torque is on."""
    bench = Bench()
    bench.drive()
    before = stands(bench)
    assert bench.cycles(5.0).reasons == before
    bench.wheels_m_s = (0.05, 0.05)
    assert bench.cycles(0.5).reasons == before
    assert bench.last.is_torque_wanted
    bench.cycles(2 * STEP_S)
    assert set(bench.last.reasons) == {*before, Reason.UNBIDDEN_MOTION}
    assert not bench.last.is_torque_wanted
    # A reset is allowed, as torque is off; and a start is another one.
    bench.wheels_m_s = None
    bench.cycle()
    assert bench.layer.reset() == ()
    bench.drive(0.05)


def test_motors_with_a_slow_ramp_are_not_astray() -> None:
    """At 1 rad/s2 a wheel takes 6 s to 0.2 m/s: one that goes there as it should is no fault, one that is held is."""
    bench = Bench(linear_acceleration_m_s2=1.0)
    bench.acceleration_m_s2 = 0.033
    bench.wanted = Velocity(0.2)
    bench.layer.enable()
    for cycle in range(400):
        bench.wheels_m_s = (min(0.2, cycle * STEP_S * 0.033),) * 2
        assert bench.cycle().reasons in ((), (Reason.TORQUE_AWAITED,), (Reason.TORQUE_AWAITED, Reason.MOTOR_SILENT))
    bench.wanted = STANDSTILL
    for cycle in range(400):
        bench.wheels_m_s = (max(0.0, 0.2 - cycle * STEP_S * 0.033),) * 2
        assert bench.cycle().reasons == ()
    bench.wanted = Velocity(0.2)
    bench.wheels_m_s = (0.0, 0.0)
    # It must be commanded 0.02 m/s first, and then be off for its time.
    assert bench.until_still(0.02 / 0.033 + 0.8 + 3 * STEP_S)[1] is Reason.WHEEL_ASTRAY


@pytest.mark.parametrize(("has_own_controls", "is_off"), [(True, False), (True, True), (False, False)])
def test_whoever_stops_a_board_with_own_controls_learns_that_it_holds(has_own_controls: bool, is_off: bool) -> None:
    bench = Bench(has_own_controls=has_own_controls, is_torque_off_on_operator_stop=is_off)
    bench.drive()
    assert bench.last.warnings == ()
    bench.layer.operator_stop()
    bench.cycles(0.2)
    assert bench.last.is_torque_wanted is not is_off
    assert bench.last.warnings == ((Caution.TORQUE_HELD,) if has_own_controls and not is_off else ())


def test_wheels_are_judged_anew_when_torque_comes_on() -> None:
    bench = Bench()
    bench.drive()
    bench.wheels_m_s = (0.0, 0.0)
    bench.cycles(0.7)
    bench.layer.disable()
    bench.cycles(0.1)
    assert not bench.last.is_torque_wanted
    bench.wheels_m_s = (0.5, 0.5)  # pushed by hand
    bench.cycles(3.0)
    assert bench.last.reasons == (Reason.STANDBY,)
    bench.layer.enable()
    assert bench.cycles(0.7).reasons == ()


def test_torque_that_does_not_come_is_lost() -> None:
    bench = Bench()
    bench.holds = False
    bench.layer.enable()
    bench.wanted = Velocity(0.1)
    bench.cycles(2.0)
    assert bench.last.reasons == (Reason.TORQUE_AWAITED,)
    assert bench.last.is_torque_wanted
    assert bench.cycles(0.06).reasons == (Reason.TORQUE_LOST,)
    assert not bench.last.is_torque_wanted
    bench.holds = None
    restart(bench)


def test_torque_is_late_only_beyond_its_time() -> None:
    bench = Bench(torque_on_s=0.5, operator_timeout_s=None, scan_timeout_s=None, motor_timeout_s=1.0, loop_timeout_s=2)
    layer = bench.layer
    layer.enable()
    layer.on_drive_reading(reading(64.0, is_torque_on=False))
    layer.loop_cycled(64.0)
    assert layer.output(64.0).reasons == (Reason.TORQUE_AWAITED,)
    assert layer.output(64.5).reasons == (Reason.TORQUE_AWAITED,)
    assert layer.output(math.nextafter(64.5, 65)).reasons == (Reason.TORQUE_LOST, Reason.TORQUE_AWAITED)


def test_a_reading_from_before_says_nothing_about_torque() -> None:
    bench = Bench()
    bench.layer.enable()
    bench.report()
    now_s = bench.now_s
    assert Reason.TORQUE_AWAITED in bench.layer.output(now_s).reasons
    for time_s in (now_s - 0.1, now_s, math.nan):
        bench.layer.on_drive_reading(reading(time_s, is_torque_on=True))
        assert Reason.TORQUE_AWAITED in bench.layer.output(now_s).reasons
    bench.layer.on_drive_reading(reading(math.nextafter(now_s, math.inf), is_torque_on=True))
    assert bench.layer.output(now_s).reasons == ()
    # It was on then; a late reading from before does not show that it is off.
    bench.layer.on_drive_reading(reading(now_s, is_torque_on=False))
    assert bench.layer.output(now_s).reasons == ()


def test_an_empty_battery_stops_it_until_another_one_is_in() -> None:
    bench = Bench()
    bench.drive()
    bench.battery_v = 11.4
    assert bench.cycles(4.1).warnings == (Caution.BATTERY,)
    assert bench.last.velocity == Velocity(0.1)
    bench.battery_v = 11.0
    time_s, reason = bench.until_still(4.1)
    assert reason is Reason.BATTERY_LOW
    assert time_s >= 2.0
    assert bench.cycles(2.0).is_torque_wanted
    assert bench.layer.reset() == (Reason.BATTERY_LOW,)
    bench.battery_v = 12.0
    bench.cycles(4.1)
    assert bench.last.reasons == (Reason.BATTERY_LOW,)
    assert bench.last.warnings == ()
    restart(bench)


def test_a_base_without_a_voltage_drives() -> None:
    bench = Bench()
    bench.battery_v = None
    bench.drive()
    assert bench.cycles(5.0).warnings == ()


def test_failed_exchanges_count_as_silence() -> None:
    bench = Bench()
    bench.drive()
    bench.silent.add("drive")
    for failures in range(1, 5):
        bench.layer.drive_failed()
        assert bench.cycle().reasons == (() if failures < 3 else (Reason.MOTOR_SILENT,))
    bench.silent.clear()
    assert bench.cycle().reasons == ()
    # One answer begins the count anew.
    bench.layer.drive_failed()
    assert bench.cycle().reasons == ()
    bench.layer.drive_failed()
    bench.layer.drive_failed()
    assert bench.layer.output(bench.now_s).reasons == ()
    bench.layer.drive_failed()
    assert bench.layer.output(bench.now_s).reasons == (Reason.MOTOR_SILENT,)


@pytest.mark.parametrize("now_s", [math.nan, math.inf, -math.inf, 0.0, -5.0, 500.0])
def test_a_clock_that_is_wrong_stops_it_and_begins_anew(now_s: float) -> None:
    bench = Bench()
    bench.drive()
    bench.silent |= {"scan", "loop", "operator"}
    found = bench.layer.output(now_s)
    assert found.velocity == STANDSTILL
    assert found.reasons == (Reason.CLOCK,)
    assert found.is_torque_wanted
    bench.silent.clear()
    if math.isfinite(now_s):
        bench.now_s = now_s
    assert bench.cycle().velocity == STANDSTILL
    assert bench.last.reasons == ()
    assert bench.cycle().velocity == near(0.02)
    # Facts from the time before do not stay fresh for ever.
    bench.silent |= {"scan"}
    assert bench.until_still(0.7)[1] is Reason.SCAN_STALE


def test_the_clock_may_stand_still() -> None:
    bench = Bench()
    bench.drive()
    assert bench.layer.output(bench.now_s).velocity == Velocity(0.1)
    assert bench.layer.output(math.nextafter(bench.now_s, 0)).reasons == (Reason.CLOCK,)


def test_when_the_clock_goes_back_torque_still_comes_and_goes_in_time() -> None:
    bench = Bench()
    bench.holds = False
    bench.layer.enable()
    bench.cycles(1.0)
    bench.now_s = 500.0
    assert Reason.CLOCK in bench.cycle().reasons
    assert bench.cycles(1.98).reasons == (Reason.TORQUE_AWAITED,)
    assert bench.cycles(0.06).reasons == (Reason.TORQUE_LOST,)
    bench = Bench()
    bench.drive()
    bench.wheels_m_s = (0.1, 0.1)
    bench.layer.disable()
    bench.cycles(0.5)
    bench.now_s = 500.0
    bench.cycle()
    assert bench.cycles(0.96).is_torque_wanted
    assert not bench.cycles(0.06).is_torque_wanted


def test_several_reasons_are_reported_together_in_their_order() -> None:
    bench = Bench()
    assert bench.layer.output(1000.0).reasons == (
        Reason.STANDBY,
        Reason.SCAN_STALE,
        Reason.MOTOR_SILENT,
        Reason.LOOP_OVERRUN,
        Reason.OPERATOR_LOST,
    )
    bench.drive()
    bench.layer.supervisor_fault()
    bench.layer.operator_stop()
    bench.silent |= {"scan"}
    assert bench.cycles(1.0).reasons == (Reason.OPERATOR_STOP, Reason.SUPERVISOR_FAULT, Reason.SCAN_STALE)


AHEAD, BEHIND, NOWHERE = (
    tuple(1.0 if degree in seen else math.nan for degree in range(360))
    for seen in ({*range(90), *range(270, 360)}, set(range(90, 270)), set[int]())
)


@pytest.mark.parametrize(("blind", "speed_m_s"), [(BEHIND, 0.1), (AHEAD, -0.1), (NOWHERE, 0.1), (NOWHERE, -0.1)])
def test_a_scanner_that_sees_nothing_is_reported_to_a_person(blind: tuple[float, ...], speed_m_s: float) -> None:
    bench = Bench(is_stopped_when_blind=False)
    bench.ranges_m = blind
    bench.drive(speed_m_s)
    assert bench.last.warnings == (Caution.SCAN_BLIND,)
    assert bench.last.reasons == ()
    # Not where it does not go to.
    bench.wanted = Velocity(0.0, 0.5)
    assert bench.cycle().warnings == ()
    bench.wanted = Velocity(-speed_m_s)
    assert bench.cycle().warnings == ((Caution.SCAN_BLIND,) if blind is NOWHERE else ())
    bench.wanted = Velocity(speed_m_s)
    assert bench.cycle().warnings == (Caution.SCAN_BLIND,)
    bench.layer.command(Velocity(math.nan), bench.now_s)
    assert bench.layer.output(bench.now_s).warnings == (Caution.COMMAND_REFUSED,)
    assert bench.cycle().warnings == (Caution.SCAN_BLIND,)
    bench.silent.add("command")
    bench.layer.disable()
    assert bench.cycle().warnings == ()


def test_where_the_scanner_sees_nothing_the_robot_may_not_go() -> None:
    bench = Bench()
    bench.ranges_m = AHEAD
    bench.drive(0.1)
    bench.ranges_m = BEHIND
    assert bench.cycle().velocity == STANDSTILL
    # It does not flutter while the command is repeated.
    for _ in range(50):
        assert bench.cycle().velocity == STANDSTILL
        assert bench.last.reasons == (Reason.SCAN_BLIND,)
    assert bench.last.is_torque_wanted
    # It may turn to where it sees something, and go back.
    bench.wanted = Velocity(0.0, 0.5)
    assert bench.cycle().reasons == ()
    assert bench.cycles(0.5).velocity == Velocity(0.0, 0.5)
    bench.wanted = Velocity(-0.1)
    assert bench.cycles(0.5).velocity == Velocity(-0.1)
    bench.wanted = Velocity(0.1)
    assert bench.cycle().reasons == (Reason.SCAN_BLIND,)
    bench.ranges_m = AHEAD
    assert bench.cycle().reasons == ()
    assert bench.cycles(0.5).velocity == Velocity(0.1)


def _touched(*degrees: int) -> tuple[float, ...]:
    return tuple(0.0 if degree in degrees else 3.0 for degree in range(360))


@pytest.mark.parametrize(
    ("degree", "speed_m_s"), [(0, 0.1), (30, 0.1), (330, 0.1), (150, -0.1), (180, -0.1), (210, -0.1)]
)
def test_where_something_touches_the_robot_does_not_go(degree: int, speed_m_s: float) -> None:
    bench = Bench()
    bench.ranges_m = _touched()
    bench.drive(speed_m_s)
    bench.ranges_m = _touched(degree)
    for _ in range(3):
        assert bench.cycle().velocity == STANDSTILL
        assert bench.last.reasons == (Reason.SCAN_TOUCHING,)
    # It may turn away and go back, without a person.
    bench.wanted = Velocity(0.0, 0.5)
    assert bench.cycles(0.5).velocity == Velocity(0.0, 0.5)
    bench.wanted = Velocity(-speed_m_s)
    assert bench.cycles(0.5).velocity == Velocity(-speed_m_s)
    bench.wanted = Velocity(speed_m_s)
    assert bench.cycle().reasons == (Reason.SCAN_TOUCHING,)
    bench.ranges_m = _touched()
    assert bench.cycle().reasons == ()


@pytest.mark.parametrize(("degree", "speed_m_s"), [(31, 0.1), (329, 0.1), (149, -0.1), (211, -0.1)])
def test_what_touches_beside_the_way_does_not_stop_it(degree: int, speed_m_s: float) -> None:
    bench = Bench(is_stopped_when_blind=False)
    bench.ranges_m = _touched(degree)
    bench.drive(speed_m_s)
    assert bench.last.reasons == ()


def test_motors_that_still_hold_after_a_fault_are_letting_go() -> None:
    bench = Bench()
    bench.drive()
    assert not bench.layer.is_letting_go
    fault(bench)
    bench.wheels_m_s = (0.1, 0.1)
    bench.cycle()
    assert bench.layer.is_letting_go
    bench.cycles(2.0)
    assert not bench.layer.is_letting_go


def test_torque_that_is_to_go_off_anyway_is_not_lost() -> None:
    bench = Bench()
    bench.drive()
    bench.layer.disable()
    bench.wheels_m_s = (0.1, 0.1)
    bench.cycle()
    bench.holds = False
    assert bench.cycles(1.5).reasons == (Reason.STANDBY,)


def test_a_person_learns_of_a_refused_reading_for_a_while() -> None:
    bench = Bench()
    bench.drive()
    assert not bench.last.warnings
    bench.refused = 1
    assert bench.cycle().warnings == (Caution.READING_REFUSED,)
    assert bench.last.velocity == Velocity(0.1)
    bench.cycles(9.8)
    assert bench.last.warnings == (Caution.READING_REFUSED,)
    assert not bench.cycles(0.4).warnings
    # A drive base that was opened anew counts anew.
    bench.refused = 0
    assert not bench.cycle().warnings
    bench.refused = 1
    assert bench.cycle().warnings == (Caution.READING_REFUSED,)


def test_a_reset_forgets_where_it_was_to_go() -> None:
    bench = Bench()
    bench.ranges_m = AHEAD
    bench.drive(0.1)
    bench.layer.operator_stop()
    bench.cycle()
    bench.ranges_m = BEHIND
    bench.cycle()
    bench.silent.add("command")
    assert bench.layer.reset() == ()
    assert bench.cycle().reasons == (Reason.STANDBY,)


def test_damaged_frames_are_reported() -> None:
    bench = Bench()
    bench.drive()
    bench.layer.on_noise(True)
    assert bench.cycle().warnings == (Caution.SCAN_NOISY,)
    assert bench.last.velocity == Velocity(0.1)
    bench.layer.on_noise(False)
    assert bench.cycle().warnings == ()


def test_without_scanner_and_operator_none_is_missed() -> None:
    bench = Bench(scan_timeout_s=None, operator_timeout_s=None)
    bench.silent |= {"scan", "operator"}
    bench.drive()
    assert bench.cycles(10.0).velocity == Velocity(0.1)


@pytest.mark.parametrize("is_off", [True, False])
def test_an_operators_stop_may_want_torque_off(is_off: bool) -> None:
    bench = Bench(is_torque_off_on_operator_stop=is_off)
    bench.drive()
    bench.layer.operator_stop()
    assert bench.cycle().is_torque_wanted
    assert bench.layer.reset() == ((Reason.OPERATOR_STOP,) if is_off else ())
    assert bench.cycles(0.1).is_torque_wanted is False  # after a reset: standby
    bench = Bench(is_torque_off_on_operator_stop=is_off)
    bench.drive()
    bench.layer.operator_stop()
    assert bench.cycles(2.0).is_torque_wanted is not is_off


def test_limits_decide_the_times() -> None:
    bench = Bench(command_timeout_s=0.5, motor_failures=1)
    bench.drive()
    bench.silent.add("command")
    assert bench.until_still(1.0)[0] >= 0.5
    assert replace(bench.limits, motor_failures=1) == bench.limits
    bench.layer.drive_failed()
    assert Reason.MOTOR_SILENT in bench.layer.output(bench.now_s).reasons


@pytest.mark.parametrize("is_loop_first", [True, False])
def test_a_pause_is_longer_than_its_time(is_loop_first: bool) -> None:
    bench = Bench()
    bench.drive()
    layer = bench.layer
    assert Reason.PAUSED not in layer.output(64.0).reasons
    assert Reason.PAUSED not in layer.output(64.5).reasons
    layer.loop_cycled(64.75)
    late_s = 65.25 if is_loop_first else math.nextafter(65.25, 66)
    layer.loop_cycled(64.0)  # what comes late does not take the time back
    if is_loop_first:
        layer.loop_cycled(late_s)
        assert Reason.PAUSED not in layer.output(late_s).reasons
        late_s = math.nextafter(65.75, 66)
        layer.loop_cycled(late_s)
    assert Reason.PAUSED in layer.output(late_s).reasons


@pytest.mark.parametrize("odd_s", [math.nan, math.inf, -math.inf, 0.0])
def test_a_time_that_is_none_is_no_sign_of_work_and_no_pause(odd_s: float) -> None:
    bench = Bench()
    bench.drive()
    bench.layer.loop_cycled(odd_s)
    assert bench.cycle().reasons == ()
    bench.now_s += 0.6
    bench.layer.loop_cycled(odd_s)
    assert Reason.PAUSED in bench.cycle().reasons


def test_a_time_ahead_hides_no_pause() -> None:
    bench = Bench()
    bench.drive()
    bench.layer.loop_cycled(bench.now_s + 0.4)
    assert bench.layer.output(bench.now_s).reasons == ()
    assert Reason.PAUSED in bench.layer.output(bench.now_s + 0.6).reasons


def test_what_comes_first_after_a_pause_does_not_hide_it() -> None:
    bench = Bench()
    bench.drive()
    bench.now_s += 0.6
    bench.layer.on_scan(bench.now_s)
    bench.layer.on_drive_reading(reading(bench.now_s))
    bench.layer.command(Velocity(0.1), bench.now_s)
    assert bench.layer.output(bench.now_s).velocity == STANDSTILL
    assert bench.cycle().reasons == (Reason.PAUSED,)


@pytest.mark.parametrize("is_loop_first", [True, False])
def test_after_a_pause_nothing_from_before_counts(is_loop_first: bool) -> None:
    bench = Bench(scan_timeout_s=2.0, motor_timeout_s=1.0, loop_timeout_s=2.0, command_timeout_s=1.0)
    bench.drive()
    bench.now_s += 0.6
    stale = [Reason.SCAN_STALE, Reason.MOTOR_SILENT, Reason.LOOP_OVERRUN]
    if is_loop_first:
        bench.layer.loop_cycled(bench.now_s)
        stale.remove(Reason.LOOP_OVERRUN)
    assert bench.layer.output(bench.now_s).reasons == (Reason.PAUSED, *stale)
    assert bench.last.is_torque_wanted
    restart(bench)


def test_wheels_are_judged_anew_after_a_pause() -> None:
    bench = Bench()
    bench.drive()
    bench.wheels_m_s = (0.0, 0.1)
    bench.cycles(0.6)
    pause(bench)
    assert bench.cycles(0.7).reasons == (Reason.PAUSED,)
    assert bench.cycles(0.2).reasons == (Reason.PAUSED, Reason.WHEEL_ASTRAY)


def test_wheels_are_judged_anew_when_torque_comes_back() -> None:
    bench = Bench()
    bench.drive()
    bench.wheels_m_s = (0.0, 0.1)
    bench.cycles(0.6)
    bench.layer.disable()
    bench.silent.add("drive")
    assert not bench.cycles(1.1).is_torque_wanted
    bench.silent.clear()
    bench.layer.enable()
    assert bench.cycles(0.7).reasons == ()
    assert bench.cycles(0.3).reasons == (Reason.WHEEL_ASTRAY,)


def test_a_drive_base_that_takes_its_time_is_no_pause() -> None:
    bench = Bench()
    bench.drive()
    for step in range(1, 100):
        bench.layer.loop_cycled(bench.now_s + step * 0.1)
    assert Reason.PAUSED not in bench.layer.output(bench.now_s + 10.0).reasons


@pytest.mark.parametrize("is_enabled", [True, False])
def test_without_torque_there_is_no_pause(is_enabled: bool) -> None:
    bench = Bench()
    bench.drive()
    bench.layer.disable()
    assert not bench.cycles(0.1).is_torque_wanted
    if is_enabled:
        bench.holds = False
        bench.layer.enable()
        assert Reason.TORQUE_AWAITED in bench.cycle().reasons
    pause(bench)
    assert Reason.PAUSED not in bench.cycle().reasons
