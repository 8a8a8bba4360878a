"""Tests of the output that passes, of torque that comes and goes, and of the inputs that count as a command."""

import math
import signal
import threading
from collections.abc import Callable
from typing import Any

import pytest

from robosc_bridge.devices.interface import STANDSTILL, BatteryLevel, Velocity
from robosc_bridge.safety import Caution, Reason
from robosc_bridge.safety.motion import within
from support.safety import LIMITS, STEP_S, Bench, near, reading


def test_nothing_passes_before_it_is_enabled() -> None:
    bench = Bench()
    bench.wanted = Velocity(0.1)
    for _ in range(100):
        found = bench.cycle()
        assert (found.velocity, found.is_torque_wanted, found.reasons) == (STANDSTILL, False, (Reason.STANDBY,))


def test_every_call_may_be_the_first() -> None:
    layer = Bench().layer
    layer.drive_failed()
    layer.operator_stop()
    assert layer.reset() == (Reason.OPERATOR_STOP,)
    layer = Bench().layer
    layer.command(Velocity(0.1), -1.0)
    first = layer.output(0.0)  # a clock may begin there
    assert Reason.COMMAND_SILENT not in first.reasons
    assert Reason.CLOCK not in first.reasons
    assert first.warnings == ()
    layer = Bench().layer
    assert layer.reset() == ()
    # Torque is wanted and given up without a word from the motors.
    layer.enable()
    assert layer.output(100.0).is_torque_wanted
    layer.disable()
    assert layer.output(100.0).is_torque_wanted
    assert layer.output(100.9).is_torque_wanted
    assert not layer.output(101.0).is_torque_wanted


def test_before_the_first_command_there_is_nothing_to_warn_of() -> None:
    layer = Bench().layer
    layer.on_scan(100.0, (math.nan,) * 360)
    assert layer.output(100.0).warnings == ()


def test_torque_comes_first_then_a_new_command() -> None:
    bench = Bench()
    bench.cycle()
    bench.wanted = Velocity(0.1)
    bench.layer.enable()
    first, second, third = bench.cycle(), bench.cycle(), bench.cycle()
    assert (first.velocity, first.is_torque_wanted, first.reasons) == (STANDSTILL, True, (Reason.TORQUE_AWAITED,))
    assert (second.velocity, second.is_torque_wanted, second.reasons) == (STANDSTILL, True, ())
    assert third.velocity == near(0.02)


def test_a_ramp_up_and_down() -> None:
    bench = Bench()
    bench.drive(0.1, 0.5)
    bench.wanted = Velocity(0.2, -0.5)
    speeds = [bench.cycle().velocity for _ in range(5)]
    # Within the wheel's limit of 0.2 m/s: the curvature of what was asked for.
    target = within(bench.wanted, LIMITS)
    assert speeds[0] == near(0.12, 0.3)
    assert speeds[2].angular_rad_s == 0.0
    assert bench.cycles(1.0).velocity == target
    bench.wanted = Velocity(0.05, -0.5)
    assert bench.cycle().velocity.linear_m_s == pytest.approx(target.linear_m_s - 2.5 * STEP_S)


def test_a_command_of_standstill_passes_at_once() -> None:
    bench = Bench()
    bench.drive(0.2)
    bench.wanted = Velocity(-0.0, 0.0)
    assert bench.cycle().velocity == STANDSTILL
    assert bench.last.reasons == ()


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("place", [0, 1, 2])
def test_what_is_no_number_is_a_stop(bad: float, place: int) -> None:
    bench = Bench()
    bench.drive(0.1, 0.1)
    numbers = [0.1, 0.1, bench.now_s]
    numbers[place] = bad
    bench.layer.command(Velocity(*numbers[:2]), numbers[2])
    found = bench.layer.output(bench.now_s)
    assert (found.velocity, found.reasons, found.warnings) == (STANDSTILL, (), (Caution.COMMAND_REFUSED,))
    found = bench.cycle()
    assert found.velocity == near(0.02, 0.08)
    assert found.warnings == ()


@pytest.mark.parametrize("huge", [1e308, 10**400])
def test_a_huge_command_is_the_limit(huge: float) -> None:
    bench = Bench()
    bench.drive(0.1)
    bench.layer.command(Velocity(huge, 0.0), bench.now_s)
    assert bench.layer.output(bench.now_s + 6 * STEP_S).velocity == Velocity(0.2)
    bench.layer.command(Velocity(-huge, huge), bench.now_s)
    assert bench.layer.output(bench.now_s + 6 * STEP_S).reasons == ()


def test_a_command_from_the_future_holds_no_longer() -> None:
    bench = Bench()
    bench.drive()
    bench.layer.command(Velocity(0.1), bench.now_s + 100)
    bench.silent.add("command")
    time_s, reason = bench.until_still(1.0)
    assert (reason, time_s <= 0.3 + 2 * STEP_S) == (Reason.COMMAND_SILENT, True)


def test_a_command_of_long_ago_does_not_count() -> None:
    bench = Bench()
    bench.drive()
    bench.layer.command(Velocity(0.1), bench.now_s - 0.31)
    assert bench.layer.output(bench.now_s).reasons == (Reason.COMMAND_SILENT,)


@pytest.mark.parametrize("after_s", [0.0624, 0.0625])
def test_an_output_holds_for_a_while_and_motion_begins_anew_after_it(after_s: float) -> None:
    bench = Bench(scan_timeout_s=None, loop_timeout_s=2.0, motor_timeout_s=0.0625)
    bench.drive(0.1)

    def next_output(after_s: float) -> Velocity:
        bench.now_s += after_s
        bench.layer.command(Velocity(0.2), bench.now_s)
        bench.layer.on_drive_reading(reading(bench.now_s, wheels_m_s=(0.1, 0.1)))
        return bench.layer.output(bench.now_s).velocity

    assert bench.last.velocity.until_s == bench.now_s + 0.0625
    # The next velocity goes on from it while it holds.
    assert next_output(after_s) == near(0.1 + after_s)
    assert next_output(0.0626) == STANDSTILL
    assert next_output(0.03) == near(0.03)


def test_what_the_drive_base_says_of_its_battery_counts() -> None:
    bench = Bench()
    bench.drive()
    bench.layer.on_drive_reading(reading(bench.now_s, battery_level=BatteryLevel.EMPTY))
    assert Reason.BATTERY_LOW in bench.layer.output(bench.now_s).reasons


def again(bench: Bench) -> None:
    bench.layer.disable()
    bench.layer.enable()


def reset(bench: Bench) -> None:
    assert bench.layer.reset() == ()
    bench.layer.enable()


@pytest.mark.parametrize("change", [again, reset, lambda bench: bench.layer.enable()])
def test_what_comes_between_two_outputs_stops_it_once(change: Callable[[Bench], object]) -> None:
    bench = Bench()
    bench.drive()
    change(bench)
    bench.report()  # a command, too
    found = bench.layer.output(bench.now_s)
    assert (found.velocity, found.is_torque_wanted, found.reasons) == (STANDSTILL, True, ())
    assert bench.cycle().velocity == near(0.02)


@pytest.mark.parametrize("change", [lambda bench: bench.layer.disable(), lambda bench: bench.layer.reset()])
def test_in_standby_no_command_is_missed(change: Callable[[Bench], object]) -> None:
    bench = Bench(motor_timeout_s=1.0)
    bench.drive()
    change(bench)
    bench.silent.add("command")
    assert bench.cycle(0.4).reasons == (Reason.STANDBY,)
    assert bench.cycles(1.0).reasons == (Reason.STANDBY,)


def test_standby_takes_torque_once_the_wheels_stand_still() -> None:
    bench = Bench()
    bench.drive()
    bench.layer.disable()
    bench.wheels_m_s = (0.0101, 0.0)
    assert bench.cycles(0.1).is_torque_wanted
    assert bench.last.reasons == (Reason.STANDBY,)
    bench.wheels_m_s = (0.01, -0.01)
    assert not bench.cycle().is_torque_wanted
    bench.wheels_m_s = (0.5, 0.5)
    assert not bench.cycles(5.0).is_torque_wanted


@pytest.mark.parametrize("wheels_m_s", [(0.02, 0.0), (0.0, -0.02), (math.nan, 0.0), (0.0, math.inf)])
def test_torque_goes_at_the_latest_after_its_time(wheels_m_s: tuple[float, float]) -> None:
    bench = Bench(torque_off_s=0.5, astray_s=5.0)
    bench.now_s = 64.0
    bench.drive()
    bench.wheels_m_s = wheels_m_s
    bench.layer.disable()
    bench.cycle()
    begin_s = bench.now_s
    bench.layer.on_drive_reading(reading(begin_s + 0.1, wheels_m_s=wheels_m_s))
    assert bench.layer.output(begin_s + 0.499).is_torque_wanted
    assert not bench.layer.output(begin_s + 0.5).is_torque_wanted


def test_wheels_that_stood_still_before_do_not_count() -> None:
    bench = Bench()
    bench.drive(0.005)  # slower than what counts as standing still
    bench.layer.disable()
    now_s = bench.now_s
    for time_s in (now_s - 0.01, now_s):
        bench.layer.on_drive_reading(reading(time_s))
        assert bench.layer.output(now_s).is_torque_wanted
    bench.layer.on_drive_reading(reading(now_s + 100))  # from the future: not after the stop either, as it is seen now
    assert bench.layer.output(now_s).is_torque_wanted
    bench.layer.on_drive_reading(reading(now_s + 0.01))
    assert not bench.layer.output(now_s + 0.02).is_torque_wanted


def test_enabling_again_keeps_torque_that_is_still_on() -> None:
    bench = Bench(astray_s=5.0, unbidden_s=5.0)
    bench.drive()
    bench.wheels_m_s = (0.1, 0.1)
    bench.layer.disable()
    assert bench.cycles(0.9).is_torque_wanted
    bench.wheels_m_s = None
    bench.layer.enable()
    assert bench.cycle().reasons == ()
    bench.wheels_m_s = (0.1, 0.1)
    bench.layer.disable()
    assert bench.cycles(0.9).is_torque_wanted  # the wait begins anew
    assert not bench.cycles(0.2).is_torque_wanted


def test_an_operators_stop_is_never_lost() -> None:
    bench = Bench()
    bench.drive()
    bench.layer.operator_stop()
    assert bench.layer.reset() == (Reason.OPERATOR_STOP,)  # it has not had its effect yet
    assert bench.cycle().velocity == STANDSTILL
    assert bench.layer.reset() == ()


def test_a_refused_reset_changes_nothing() -> None:
    bench = Bench()
    bench.drive()
    bench.layer.operator_stop()
    bench.cycle()
    bench.layer.supervisor_fault()
    assert bench.layer.reset() == (Reason.SUPERVISOR_FAULT,)
    assert bench.cycle().reasons == (Reason.OPERATOR_STOP, Reason.SUPERVISOR_FAULT)
    assert bench.layer.reset() == ()
    assert bench.cycle().reasons == (Reason.STANDBY,)


def test_all_threads_may_call_at_once() -> None:
    bench = Bench()
    bench.drive()
    layer, begin_s = bench.layer, bench.now_s
    ended = threading.Event()
    beyond: list[Velocity] = []
    calls: list[Callable[[float], Any]] = [
        layer.on_scan,
        layer.loop_cycled,
        layer.operator_seen,
        lambda now_s: layer.command(Velocity(1.0, 5.0), now_s),
        lambda now_s: layer.on_drive_reading(reading(now_s, wheels_m_s=(0.1, 0.1))),
    ]

    def call(function: Callable[[float], Any]) -> None:
        for step in range(2000):
            function(begin_s + step * 0.001)

    def put_out() -> None:
        step = 0
        while not ended.is_set() or step < 2000:
            found = layer.output(begin_s + step * 0.001).velocity
            if within(found, LIMITS) != found and max(abs(found.linear_m_s), abs(found.angular_rad_s) / 10) > 0.2:
                beyond.append(found)
            step += 1

    threads = [threading.Thread(target=call, args=(function,)) for function in calls]
    last = threading.Thread(target=put_out)
    for thread in [*threads, last]:
        thread.start()
    for thread in threads:
        thread.join(20)
    layer.operator_stop()
    ended.set()
    last.join(20)
    assert not any(thread.is_alive() for thread in [*threads, last])
    assert beyond == []
    found = layer.output(math.nan)
    assert found.velocity == STANDSTILL
    assert Reason.OPERATOR_STOP in found.reasons


def test_a_signal_handler_may_stop_it_while_its_thread_is_inside() -> None:
    bench = Bench()
    bench.drive()

    class Late(float):
        """Interrupts the layer, once, while it holds its lock."""

        is_over = False

        def __ge__(self, other: float) -> bool:
            if not self.is_over:
                self.is_over = True
                signal.raise_signal(signal.SIGUSR1)
            return super().__ge__(other)

    late = Late(bench.now_s + STEP_S)
    before = signal.signal(signal.SIGUSR1, lambda *_: bench.layer.operator_stop())
    try:
        found = bench.layer.output(late)
    finally:
        signal.signal(signal.SIGUSR1, before)
    assert late.is_over
    assert (found.velocity, found.reasons) == (STANDSTILL, (Reason.OPERATOR_STOP,))
