"""The loop turn by turn, on a clock that the test sets: what the safety layer and the supervisor are told."""

import math

import pytest

from robosc_bridge.daemon.lifecycle import STOP_LIMIT_S
from robosc_bridge.daemon.loop import Key
from robosc_bridge.daemon.states import OperatorCommand, State
from robosc_bridge.daemon.threads.reports import Device, DeviceDown, DeviceUp, SafetyNotice
from robosc_bridge.devices.interface import STANDSTILL, Velocity
from robosc_bridge.safety import Caution, Reason
from support.daemons import CONFIGURATION, MODEL, PERIOD_S, Scene


@pytest.fixture
def scene() -> Scene:
    return Scene()


def test_nothing_moves_before_all_devices_are_there(scene: Scene) -> None:
    states: list[tuple[State, bool]] = []
    for came in (None, DeviceUp(Device.DRIVE), DeviceUp(Device.SCANNER)):
        if came is not None:
            scene.daemon.post(came)
        scene.live(0.5)
        states.append((scene.daemon.state, scene.torque))
    assert states == [(State.STARTING, False)] * 3
    scene.live(1.0, 2.0)
    assert (scene.daemon.state, scene.out) == (State.RUNNING, Velocity(0.1, 0.0))
    # The scan from before the start was used: nothing was decided on what is not known.
    assert "turn.request" not in scene.events()


def test_in_standby_it_waits_with_torque_off_until_somebody_says_start() -> None:
    scene = Scene(starts_itself=False)
    scene.up()
    assert (scene.daemon.state, scene.torque, scene.events()) == (State.STANDBY, False, [])
    scene.daemon.post(OperatorCommand.START)
    scene.live(1.0, 2.0)
    assert (scene.daemon.state, scene.out) == (State.RUNNING, Velocity(0.1, 0.0))
    scene.daemon.post(OperatorCommand.STANDBY)
    scene.live(0.5, 2.0)
    assert (scene.daemon.state, scene.torque, scene.out) == (State.STANDBY, False, STANDSTILL)


def test_an_obstacle_stops_the_wheels_with_the_very_scan_that_shows_it(scene: Scene) -> None:
    scene.up()
    assert scene.out.linear_m_s == 0.1
    hurries = scene.hurries
    scene.scan(0.3)
    scene.daemon.cycle()
    scene.exchange()
    assert scene.out == STANDSTILL
    assert scene.hurries > hurries


def test_it_turns_by_the_angle_that_is_asked_for_and_tells_when_it_has(scene: Scene) -> None:
    scene.up(0.3)
    scene.live(4.0, 0.3)
    assert scene.events().count("turn.request") >= 1
    assert "turned.response" in scene.events()
    scene.live(0.5, 2.0)
    quarter = math.remainder(scene.heading_rad, math.pi / 2)
    assert abs(quarter) < 0.05 or scene.daemon.state is State.RUNNING


def test_a_turn_is_steered_at_the_period_of_the_exchanges(scene: Scene) -> None:
    """Exchanges keep their period: if each new speed hurried the next one, there would be no pause."""
    scene.up(0.3)
    speeds_rad_s, hurries = [scene.out.angular_rad_s], scene.hurries
    while scene.out != STANDSTILL:
        scene.live(PERIOD_S, 0.3)
        speeds_rad_s.append(scene.out.angular_rad_s)
    assert len(set(speeds_rad_s)) > 10
    # That it has arrived is worth one.
    assert scene.hurries == hurries + 1


def test_a_silent_scanner_stops_the_wheels_and_they_go_on_when_it_is_back(scene: Scene) -> None:
    scene.up()
    scene.live(1.0)
    assert (scene.out, scene.torque, scene.daemon.state) == (STANDSTILL, True, State.RUNNING)
    assert Reason.SCAN_STALE in scene.safety.output(scene.clock.monotonic()).reasons
    scene.live(1.0, 2.0)
    assert scene.out.linear_m_s == 0.1


def test_a_scanner_that_is_unplugged_is_told_to_the_supervisor_once(scene: Scene) -> None:
    scene.up()
    for is_first in (True, False, False):
        scene.daemon.post(DeviceDown(Device.SCANNER, "/dev/scanner: the line is gone", 0.25, is_first))
    scene.live(0.1)
    assert scene.events().count("lost.response") == 1


def test_a_turn_waits_for_a_silent_scanner_and_goes_on(scene: Scene) -> None:
    scene.up(0.3)
    assert "turn.request" in scene.events()
    scene.live(0.3, 0.3)
    assert scene.out.angular_rad_s > 0.0
    scene.live(1.5)
    assert (scene.out, scene.daemon.state) == (STANDSTILL, State.RUNNING)
    # Not the safety layer alone: nothing is asked of it.
    assert scene.daemon._wish == STANDSTILL
    heading_rad = scene.heading_rad
    scene.live(0.5)
    assert scene.heading_rad == heading_rad
    scene.live(5.0, 0.3)
    assert "turned.response" in scene.events()


def test_a_motor_fault_ends_the_run_with_its_name(scene: Scene) -> None:
    scene.up()
    scene.daemon.post(SafetyNotice((Reason.MOTOR_FAULT,), ()))
    scene.live(0.5, 2.0)
    assert (scene.daemon.state, scene.daemon.problem) == (State.OVER, "A motor reports a fault.")
    assert (scene.out, scene.torque) == (STANDSTILL, False)


def test_a_notice_that_ends_by_itself_is_no_fault(scene: Scene) -> None:
    scene.up()
    scene.daemon.post(SafetyNotice((Reason.SCAN_STALE, Reason.OPERATOR_STOP), (Caution.BATTERY,)))
    scene.live(0.2, 2.0)
    assert scene.daemon.state is State.RUNNING


def test_why_nothing_moves_is_told_while_it_runs_and_not_before(scene: Scene, caplog: pytest.LogCaptureFixture) -> None:
    notice = SafetyNotice((Reason.SCAN_STALE, Reason.COMMAND_SILENT), ())
    scene.daemon.post(notice)
    scene.daemon.cycle()
    assert not [item for item in caplog.records if item.levelname == "WARNING"]
    scene.up()
    scene.daemon.post(notice)
    scene.daemon.cycle()
    assert [item.message for item in caplog.records if item.levelname == "WARNING"] == [Reason.SCAN_STALE]


def test_a_thread_that_has_ended_is_a_fault(scene: Scene) -> None:
    scene.up()
    scene.is_alive = False
    scene.live(0.1, 2.0)
    assert scene.daemon.problem == "a thread of a device or a remote endpoint has ended"


def test_a_velocity_from_before_an_operators_stop_does_not_move_the_robot_afterwards(scene: Scene) -> None:
    scene.up()
    scene.daemon.post(Key("space"))
    scene.daemon.cycle()
    assert scene.daemon._wish == STANDSTILL
    scene.live(0.1, 2.0)
    # Meanwhile something came into the way: nothing asks for a velocity any more.
    scene.live(0.4, 0.3)
    scene.daemon.post(Key("r"))
    moved = []
    for _ in range(20):
        scene.live(0.02, 0.3)
        moved.append(scene.out.linear_m_s)
    assert set(moved) == {0.0}


def test_a_drive_base_that_is_lost_ends_the_run_as_a_fault(scene: Scene) -> None:
    scene.up()
    scene.daemon.post(DeviceDown(Device.DRIVE, "/dev/base: the line is gone", 0.25, True))
    scene.daemon.cycle()
    assert scene.daemon.problem == "the drive base is lost: /dev/base: the line is gone"
    assert scene.daemon.state is State.OVER
    assert "lost.response" in scene.events()


def test_where_somebody_can_start_it_again_it_waits_and_never_moves_by_itself() -> None:
    scene = Scene(stays=True)
    scene.up()
    scene.daemon.post(DeviceDown(Device.DRIVE, "/dev/base: the line is gone", 0.25, True))
    scene.daemon.cycle()
    assert scene.daemon.state is State.FAULT
    scene.daemon.post(DeviceUp(Device.DRIVE))
    scene.live(1.0, 2.0)
    assert (scene.daemon.state, scene.out, scene.torque) == (State.STANDBY, STANDSTILL, False)
    scene.daemon.post(OperatorCommand.START)
    scene.live(1.0, 2.0)
    assert scene.out.linear_m_s == 0.1


def test_quitting_stops_the_wheels_and_lets_go_first(scene: Scene) -> None:
    scene.up()
    scene.daemon.post(OperatorCommand.QUIT)
    # The safety layer hears of it at once, without the loop.
    assert scene.safety.output(scene.clock.monotonic()).velocity == STANDSTILL
    scene.daemon.cycle()
    assert scene.daemon.state is State.STOPPING
    scene.live(0.2, 2.0)
    assert (scene.daemon.state, scene.torque, scene.daemon.problem) == (State.OVER, False, "")


def test_quitting_does_not_wait_for_ever_for_motors(scene: Scene) -> None:
    scene.up()
    scene.daemon.post(OperatorCommand.QUIT)
    scene.daemon.cycle()
    scene.clock.advance(STOP_LIMIT_S)
    scene.daemon.cycle()
    assert scene.daemon.state is State.OVER


def test_an_operators_stop_wins_over_everything_until_he_lets_it_go_on(scene: Scene) -> None:
    scene.up()
    scene.daemon.post(OperatorCommand.STOP)
    scene.exchange()
    assert scene.out == STANDSTILL
    scene.live(1.0, 2.0)
    assert scene.out == STANDSTILL
    scene.daemon.post(OperatorCommand.RESET)
    scene.live(0.5, 2.0)
    assert (scene.daemon.state, scene.resets) == (State.STANDBY, 1)
    scene.daemon.post(OperatorCommand.START)
    scene.live(1.0, 2.0)
    assert scene.out.linear_m_s == 0.1


def test_a_stop_button_reaches_safety_layer_and_supervisor(scene: Scene) -> None:
    scene.up()
    scene.buttons["button_1"] = True
    scene.live(0.2, 2.0)
    assert scene.out == STANDSTILL
    assert "stop.response" in scene.events()
    scene.buttons["button_1"] = False
    scene.live(0.2, 2.0)
    assert scene.out == STANDSTILL
    scene.buttons["button_2"] = True
    scene.live(1.0, 2.0)
    assert "resume.response" in scene.events()
    assert scene.events().count("button.response") == 1
    assert scene.out.linear_m_s == 0.1


def test_a_key_stops_and_lets_go_on(scene: Scene) -> None:
    scene.up()
    scene.daemon.post(Key("space"))
    scene.live(0.1, 2.0)
    assert scene.out == STANDSTILL
    scene.daemon.post(Key("r"))
    scene.live(1.0, 2.0)
    assert scene.out.linear_m_s == 0.1


def test_decisions_that_are_late_by_periods_are_left_out_and_counted(scene: Scene) -> None:
    scene.up()
    before = len(scene.events())
    scene.clock.advance(5 * PERIOD_S)
    scene.daemon.cycle()
    assert scene.daemon.overruns == 5
    assert len(scene.events()) <= before + 1


def test_a_loop_that_hangs_stops_the_wheels(scene: Scene) -> None:
    scene.up()
    for _ in range(12):
        scene.clock.advance(PERIOD_S)
        scene.exchange()
    assert scene.out == STANDSTILL
    assert Reason.LOOP_OVERRUN in scene.safety.output(scene.clock.monotonic()).reasons


def test_a_turn_that_fails_unheard_is_a_fault() -> None:
    """The model would wait for its end for ever."""
    scene = Scene(text=CONFIGURATION.replace("outcome: any", "outcome: done"))
    scene.up(0.3)
    scene.live(0.3, 0.3)
    scene.daemon.post(OperatorCommand.STOP)
    scene.live(0.2, 0.3)
    assert scene.daemon.problem.startswith("a rotation has failed, and the model has no message for that: ")


def test_the_scan_from_before_the_start_is_decided_on_whatever_the_model_says_of_its_age() -> None:
    scene = Scene(model=MODEL.replace(", max_age: 0.8", ""))
    scene.daemon.post(DeviceUp(Device.DRIVE))
    scene.daemon.post(DeviceUp(Device.SCANNER))
    scene.scan(2.0)
    scene.live(0.1)
    assert scene.daemon.state is State.RUNNING
    assert "drive.request" in scene.events()
    assert "turn.request" not in scene.events()
