"""Tests of operators' orders: in each state each command is done or refused with a sentence, never unanswered."""

import threading
from collections.abc import Callable

import pytest

from robosc_bridge.daemon.lifecycle import RESET_LIMIT_S, STOP_LIMIT_S
from robosc_bridge.daemon.loop import Key
from robosc_bridge.daemon.orders import Latches, Orders
from robosc_bridge.daemon.states import OperatorCommand, Order, State
from robosc_bridge.daemon.threads.reports import Device, DeviceDown, DeviceUp, ResetDone
from robosc_bridge.devices.interface import STANDSTILL
from robosc_bridge.safety import Reason
from support.daemons import Scene
from support.safety import Bench

DONE = ""
RESET_THEN_STANDBY = (OperatorCommand.RESET, OperatorCommand.STANDBY)


class Operated(Scene):
    """A scene with an operator who waits for answers."""

    def order(self, command: OperatorCommand) -> list[str]:
        """Give an order, and return the list that will hold the answer."""
        answers: list[str] = []
        self.daemon.post(Order(command, "a test", answers.append))
        return answers

    def ask(self, command: OperatorCommand, seconds: float) -> list[str]:
        """Give an order, and return the answers within some time."""
        answers = self.order(command)
        self.live(seconds, 2.0)
        return answers


def starting() -> Operated:
    scene = Operated(starts_itself=False, stays=True)
    scene.daemon.post(DeviceUp(Device.DRIVE))
    scene.live(0.1)
    return scene


def standby() -> Operated:
    scene = Operated(starts_itself=False, stays=True)
    scene.up()
    return scene


def running() -> Operated:
    scene = standby()
    scene.order(OperatorCommand.START)
    scene.live(0.5, 2.0)
    return scene


def stopped() -> Operated:
    scene = running()
    scene.order(OperatorCommand.STOP)
    scene.live(0.1, 2.0)
    return scene


def stopping() -> Operated:
    scene = running()
    scene.order(OperatorCommand.STANDBY)
    scene.daemon.cycle()
    return scene


def ending() -> Operated:
    scene = running()
    scene.order(OperatorCommand.QUIT)
    scene.daemon.cycle()
    return scene


def fault() -> Operated:
    scene = running()
    scene.daemon.post(DeviceDown(Device.DRIVE, "no answer", 0.25, True))
    scene.daemon.cycle()
    return scene


def over() -> Operated:
    scene = ending()
    scene.live(0.2, 2.0)
    return scene


MAKERS: dict[Callable[[], Operated], State] = {
    starting: State.STARTING,
    standby: State.STANDBY,
    running: State.RUNNING,
    stopped: State.RUNNING,
    stopping: State.STOPPING,
    ending: State.STOPPING,
    fault: State.FAULT,
    over: State.OVER,
}
FAULTY = "the robot is in fault: the drive base is lost: no answer; reset it first"
NOT_STOPPED = "no operator has stopped the robot"
ENDED = "the bridge has ended"
LATCHED = "An operator has stopped the robot. Resume or reset it first."

# Answers to each command in each state, and the state some time later.
TABLE: list[tuple[Callable[[], Operated], OperatorCommand, str, State]] = [
    (starting, OperatorCommand.START, "the robot is starting: the scanner is not there", State.STARTING),
    (starting, OperatorCommand.STANDBY, DONE, State.STARTING),
    (starting, OperatorCommand.STOP, DONE, State.STARTING),
    (starting, OperatorCommand.RESUME, NOT_STOPPED, State.STARTING),
    (starting, OperatorCommand.RESET, DONE, State.STARTING),
    (starting, OperatorCommand.QUIT, DONE, State.OVER),
    (standby, OperatorCommand.START, DONE, State.RUNNING),
    (standby, OperatorCommand.STANDBY, DONE, State.STANDBY),
    (standby, OperatorCommand.STOP, DONE, State.STANDBY),
    (standby, OperatorCommand.RESUME, NOT_STOPPED, State.STANDBY),
    (standby, OperatorCommand.RESET, DONE, State.STANDBY),
    (standby, OperatorCommand.QUIT, DONE, State.OVER),
    (running, OperatorCommand.START, DONE, State.RUNNING),
    (running, OperatorCommand.STANDBY, DONE, State.STANDBY),
    (running, OperatorCommand.STOP, DONE, State.RUNNING),
    (running, OperatorCommand.RESUME, NOT_STOPPED, State.RUNNING),
    (running, OperatorCommand.RESET, DONE, State.STANDBY),
    (running, OperatorCommand.QUIT, DONE, State.OVER),
    (stopped, OperatorCommand.START, LATCHED, State.RUNNING),
    (stopped, OperatorCommand.STANDBY, DONE, State.STANDBY),
    (stopped, OperatorCommand.STOP, DONE, State.RUNNING),
    (stopped, OperatorCommand.RESUME, DONE, State.RUNNING),
    (stopped, OperatorCommand.RESET, DONE, State.STANDBY),
    (stopped, OperatorCommand.QUIT, DONE, State.OVER),
    (stopping, OperatorCommand.START, "the robot is being stopped", State.STANDBY),
    (stopping, OperatorCommand.STANDBY, DONE, State.STANDBY),
    (stopping, OperatorCommand.STOP, DONE, State.STANDBY),
    (stopping, OperatorCommand.RESUME, NOT_STOPPED, State.STANDBY),
    (stopping, OperatorCommand.RESET, "the robot is being stopped", State.STANDBY),
    (stopping, OperatorCommand.QUIT, DONE, State.OVER),
    (ending, OperatorCommand.START, "the robot is being stopped", State.OVER),
    (ending, OperatorCommand.STANDBY, DONE, State.OVER),
    (ending, OperatorCommand.STOP, DONE, State.OVER),
    (ending, OperatorCommand.RESUME, NOT_STOPPED, State.OVER),
    (ending, OperatorCommand.RESET, "the robot is being stopped", State.OVER),
    (ending, OperatorCommand.QUIT, DONE, State.OVER),
    (fault, OperatorCommand.START, FAULTY, State.FAULT),
    (fault, OperatorCommand.STANDBY, FAULTY, State.FAULT),
    (fault, OperatorCommand.STOP, DONE, State.FAULT),
    (fault, OperatorCommand.RESUME, NOT_STOPPED, State.FAULT),
    (fault, OperatorCommand.RESET, "the drive base is not there", State.FAULT),
    (fault, OperatorCommand.QUIT, DONE, State.OVER),
    (over, OperatorCommand.START, ENDED, State.OVER),
    (over, OperatorCommand.STANDBY, ENDED, State.OVER),
    (over, OperatorCommand.STOP, ENDED, State.OVER),
    (over, OperatorCommand.RESUME, ENDED, State.OVER),
    (over, OperatorCommand.RESET, ENDED, State.OVER),
    (over, OperatorCommand.QUIT, DONE, State.OVER),
]


def test_the_table_is_complete() -> None:
    assert {(maker, command) for maker, command, _, _ in TABLE} == {(m, c) for m in MAKERS for c in OperatorCommand}


@pytest.mark.parametrize(("make", "command", "answer", "state"), TABLE)
def test_each_command_in_each_state(
    make: Callable[[], Operated], command: OperatorCommand, answer: str, state: State
) -> None:
    scene = make()
    assert scene.daemon.state is MAKERS[make]
    answers = scene.order(command)
    scene.live(0.3, None if make in (starting, fault) else 2.0)
    assert (answers, scene.daemon.state) == ([answer], state)
    if state is not State.RUNNING:
        assert scene.out == STANDSTILL


@pytest.mark.parametrize("command", [OperatorCommand.STOP, OperatorCommand.STANDBY, OperatorCommand.QUIT])
def test_what_stops_has_its_effect_before_the_loop_hears_of_it(command: OperatorCommand) -> None:
    scene = running()
    assert scene.out != STANDSTILL
    hurries = scene.hurries
    scene.order(command)
    assert scene.hurries > hurries
    scene.exchange()
    assert scene.out == STANDSTILL


@pytest.mark.parametrize("command", [OperatorCommand.STOP, OperatorCommand.STANDBY, OperatorCommand.QUIT])
@pytest.mark.parametrize("before", [OperatorCommand.START, OperatorCommand.RESUME, OperatorCommand.RESET])
def test_a_stop_wins_over_what_was_ordered_before_it(command: OperatorCommand, before: OperatorCommand) -> None:
    scene = standby() if before is OperatorCommand.START else stopped()
    answers = scene.order(before)
    scene.order(command)
    moved = []
    for _ in range(30):
        scene.live(0.02, 2.0)
        moved.append(scene.out)
    assert set(moved) == {STANDSTILL}
    # A robot that may go on, or is reset, may be put to rest as well; only an operator's stop says otherwise.
    is_done = (
        command is not OperatorCommand.STOP
        if before is OperatorCommand.RESUME
        else (before, command) == RESET_THEN_STANDBY
    )
    assert (len(answers), answers == [DONE]) == (1, is_done)


def test_an_operators_stop_and_resume_are_events_of_the_model() -> None:
    scene = running()
    scene.order(OperatorCommand.STOP)
    scene.live(0.1, 2.0)
    assert (scene.component("Eyes")["state"], scene.out) == ("stopped", STANDSTILL)
    scene.order(OperatorCommand.RESUME)
    scene.live(0.5, 2.0)
    assert (scene.component("Eyes")["state"], scene.out.linear_m_s) == ("calm", 0.1)


def test_a_stop_from_before_the_start_forbids_it_until_somebody_resumes() -> None:
    scene = standby()
    scene.order(OperatorCommand.STOP)
    scene.live(0.1, 2.0)
    assert scene.ask(OperatorCommand.START, 0.1) == [LATCHED]
    assert scene.ask(OperatorCommand.RESUME, 0.1) == [DONE]
    assert scene.ask(OperatorCommand.START, 1.0) == [DONE]
    assert scene.out.linear_m_s == 0.1


def test_a_robot_that_starts_itself_begins_stopped_and_the_model_knows() -> None:
    scene = Operated()
    scene.order(OperatorCommand.STOP)
    scene.up()
    assert (scene.daemon.state, scene.out) == (State.RUNNING, STANDSTILL)
    assert scene.component("Eyes")["state"] == "stopped"
    assert scene.ask(OperatorCommand.RESUME, 0.5) == [DONE]
    assert scene.out.linear_m_s == 0.1


def test_nothing_goes_on_while_a_stop_button_is_pressed() -> None:
    scene = running()
    scene.buttons["button_1"] = True
    scene.live(0.1, 2.0)
    held = "a button that stops the robot is pressed"
    assert scene.ask(OperatorCommand.RESUME, 0.1) == [held]
    assert scene.ask(OperatorCommand.RESET, 0.3) == [held]
    assert scene.out == STANDSTILL
    scene.buttons["button_1"] = False
    scene.live(0.1, 2.0)
    assert scene.ask(OperatorCommand.RESET, 0.1) == [DONE]


def test_keys_and_buttons_stop_and_let_go_on_in_standby_too() -> None:
    scene = standby()
    scene.buttons["button_1"] = True
    scene.live(0.1, 2.0)
    scene.buttons["button_1"] = False
    scene.live(0.1, 2.0)
    assert scene.ask(OperatorCommand.START, 0.1) == [LATCHED]
    scene.buttons["button_2"] = True
    scene.live(0.1, 2.0)
    assert scene.ask(OperatorCommand.START, 1.0) == [DONE]
    assert scene.out.linear_m_s == 0.1


def test_a_button_that_is_let_go_between_two_runs_is_no_event_of_the_next() -> None:
    scene = running()
    scene.buttons["button_2"] = True
    scene.live(0.1, 2.0)
    scene.ask(OperatorCommand.STANDBY, 1.0)
    scene.buttons["button_2"] = False
    scene.live(0.1, 2.0)
    assert scene.ask(OperatorCommand.START, 1.0) == [DONE]
    assert scene.events().count("button.response") == 1


def test_a_resume_before_the_stop_was_put_out_is_refused() -> None:
    scene = running()
    scene.order(OperatorCommand.STOP)
    answers = scene.order(OperatorCommand.RESUME)
    scene.daemon.cycle()
    assert answers == [str(Reason.OPERATOR_STOP)]
    scene.live(0.1, 2.0)
    assert scene.out == STANDSTILL
    assert scene.ask(OperatorCommand.RESUME, 0.5) == [DONE]
    assert scene.out.linear_m_s == 0.1


def test_a_resume_waits_until_the_motors_have_let_go() -> None:
    bench = Bench(is_torque_off_on_operator_stop=True)
    latches = Latches(bench.layer, Orders())
    bench.drive()
    bench.layer.operator_stop()
    bench.cycle()
    assert latches.release() == f"{Reason.OPERATOR_STOP} The motors have not let go yet; try again in a moment."
    bench.cycles(1.0)
    assert latches.release() == ""


def test_a_lost_drive_that_is_back_leaves_the_fault_and_can_be_started() -> None:
    scene = fault()
    scene.daemon.post(DeviceUp(Device.DRIVE))
    scene.live(0.2, 2.0)
    assert (scene.daemon.state, scene.daemon.problem) == (State.STANDBY, "")
    assert scene.ask(OperatorCommand.START, 1.0) == [DONE]
    assert scene.out.linear_m_s == 0.1


def test_a_drive_that_is_lost_and_back_within_a_turn_is_no_lasting_fault() -> None:
    scene = running()
    scene.daemon.post(DeviceDown(Device.DRIVE, "no answer", 0.25, True))
    scene.daemon.post(DeviceUp(Device.DRIVE))
    scene.live(0.5, 2.0)
    assert (scene.daemon.state, scene.out) == (State.STANDBY, STANDSTILL)


@pytest.mark.parametrize("device", [Device.DRIVE, Device.SCANNER])
def test_nothing_starts_without_a_device(device: Device) -> None:
    scene = standby()
    scene.daemon.post(DeviceDown(device, "gone", 0.25, True))
    answers = scene.order(OperatorCommand.START)
    scene.daemon.cycle()
    name = "drive base" if device is Device.DRIVE else "scanner"
    assert answers == [f"the {name} is not there"]
    assert scene.daemon.state is State.STANDBY


def supervisor_fault() -> Operated:
    scene = running()
    executor = scene.daemon._execution.executor
    assert executor is not None
    executor.stop("broken", is_fault=True)
    scene.live(0.3, 2.0)
    assert scene.daemon.state is State.FAULT
    return scene


def test_a_fault_is_left_by_a_reset_that_is_done_and_not_before() -> None:
    scene = supervisor_fault()
    scene.answers_reset = False
    answers = scene.order(OperatorCommand.RESET)
    scene.live(0.2, 2.0)
    assert (answers, scene.daemon.state) == ([], State.FAULT)
    start = scene.order(OperatorCommand.START)
    scene.live(0.1, 2.0)
    assert start[0].startswith("the robot is in fault: ")
    scene.daemon.post(ResetDone())
    scene.live(0.1, 2.0)
    assert (answers, scene.daemon.state, scene.daemon.problem) == ([DONE], State.STANDBY, "")
    assert scene.ask(OperatorCommand.START, 1.0) == [DONE]
    assert scene.out.linear_m_s == 0.1


def test_a_reset_that_is_overtaken_by_a_stop_forgets_nothing() -> None:
    scene = supervisor_fault()
    scene.live(0.1)
    answers = scene.order(OperatorCommand.RESET)
    scene.order(OperatorCommand.STOP)
    scene.live(0.1)
    assert answers == [str(Reason.OPERATOR_STOP)]
    reasons = scene.safety.output(scene.clock.monotonic()).reasons
    assert {Reason.SUPERVISOR_FAULT, Reason.OPERATOR_STOP} <= set(reasons)


@pytest.mark.parametrize("problem", ["the motor is hot", None])
def test_a_reset_that_fails_or_never_ends_is_answered_and_the_fault_stays(problem: str | None) -> None:
    scene = supervisor_fault()
    scene.answers_reset = False
    answers = scene.order(OperatorCommand.RESET)
    scene.live(0.2, 2.0)
    if problem is not None:
        scene.daemon.post(ResetDone(problem))
    else:
        scene.clock.advance(RESET_LIMIT_S)
    scene.live(0.2, 2.0)
    assert answers == [problem or f"the motors were not reset within {RESET_LIMIT_S:g} s"]
    assert scene.daemon.state is State.FAULT


def test_motors_that_do_not_let_go_are_a_fault_in_the_answer_to_the_order() -> None:
    scene = running()
    answers = scene.order(OperatorCommand.STANDBY)
    scene.daemon.cycle()
    scene.clock.advance(STOP_LIMIT_S)
    scene.daemon.cycle()
    assert answers == [f"the motors have not let go within {STOP_LIMIT_S:g} s"]
    assert scene.daemon.state is State.FAULT


def test_an_end_that_is_ordered_comes_though_the_drive_is_lost_on_the_way() -> None:
    scene = ending()
    scene.daemon.post(DeviceDown(Device.DRIVE, "no answer", 0.25, True))
    scene.daemon.cycle()
    assert scene.daemon.state is State.OVER


def test_who_wants_standby_before_the_start_gets_it() -> None:
    scene = Operated()
    scene.order(OperatorCommand.STANDBY)
    scene.up()
    assert (scene.daemon.state, scene.torque) == (State.STANDBY, False)


def test_all_that_waits_is_answered_at_the_end_and_after_it() -> None:
    scene = supervisor_fault()
    scene.answers_reset = False
    waiting = scene.order(OperatorCommand.RESET)
    scene.live(0.1)
    end, late = scene.order(OperatorCommand.QUIT), scene.order(OperatorCommand.START)
    scene.live(0.1)
    assert scene.daemon.state is State.OVER
    assert (waiting, end, late) == ([ENDED], [DONE], ["the robot is being stopped"])
    assert scene.order(OperatorCommand.START) == [ENDED]


@pytest.mark.parametrize("command", [OperatorCommand.RESUME, OperatorCommand.RESET])
def test_a_stop_in_the_middle_of_a_reset_holds(command: OperatorCommand, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = stopped()
    if command is OperatorCommand.RESET:
        scene.order(OperatorCommand.STANDBY)
        scene.live(0.3, 2.0)
    reset = scene.safety.reset

    def overtaken() -> tuple[Reason, ...]:
        # From another thread, when the loop has looked whether a stop is coming, and nothing of it is left then.
        scene.order(OperatorCommand.STOP)
        scene.exchange()
        return reset()

    monkeypatch.setattr(scene.safety, "reset", overtaken)
    answers = scene.order(command)
    scene.live(0.3, 2.0)
    assert answers == [str(Reason.OPERATOR_STOP)]
    assert Reason.OPERATOR_STOP in scene.safety.output(scene.clock.monotonic()).reasons
    assert scene.out == STANDSTILL


@pytest.mark.parametrize("how", ["button", "key"])
def test_a_stop_at_the_robot_while_a_reset_waits_for_the_standstill_holds(how: str) -> None:
    scene = running()
    answers = scene.order(OperatorCommand.RESET)
    scene.daemon.cycle()
    assert scene.daemon.state is State.STOPPING
    if how == "key":
        scene.daemon.post(Key("space"))
    else:
        scene.buttons["button_1"] = True
    scene.exchange()
    scene.daemon.cycle()
    scene.buttons["button_1"] = False
    scene.live(1.0, 2.0)
    assert answers == [str(Reason.OPERATOR_STOP)]
    assert scene.ask(OperatorCommand.START, 0.1) == [LATCHED]


@pytest.mark.parametrize("command", [OperatorCommand.RESUME, OperatorCommand.RESET])
def test_a_standby_in_the_middle_of_a_reset_is_no_operators_stop(
    command: OperatorCommand, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = stopped()
    if command is OperatorCommand.RESET:
        scene.order(OperatorCommand.STANDBY)
        scene.live(0.3, 2.0)
    reset = scene.safety.reset

    def overtaken() -> tuple[Reason, ...]:
        remaining = reset()
        scene.order(OperatorCommand.STANDBY)
        return remaining

    monkeypatch.setattr(scene.safety, "reset", overtaken)
    assert scene.ask(command, 0.3) == [DONE]
    assert (scene.daemon.state, scene.out) == (State.STANDBY, STANDSTILL)
    assert scene.safety.output(scene.clock.monotonic()).reasons == (Reason.STANDBY,)
    monkeypatch.undo()
    assert scene.ask(OperatorCommand.START, 1.0) == [DONE]
    assert scene.out.linear_m_s == 0.1


def test_a_standby_in_the_middle_of_a_start_is_not_undone(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = standby()
    enable = scene.safety.enable

    def overtaken() -> None:
        scene.order(OperatorCommand.STANDBY)
        enable()

    monkeypatch.setattr(scene.safety, "enable", overtaken)
    scene.order(OperatorCommand.START)
    scene.daemon.cycle()
    assert Reason.STANDBY in scene.safety.output(scene.clock.monotonic()).reasons
    scene.live(0.3, 2.0)
    assert (scene.daemon.state, scene.out) == (State.STANDBY, STANDSTILL)


def test_nothing_starts_by_itself_while_a_reset_is_under_way() -> None:
    scene = Operated(stays=True)
    scene.answers_reset = False
    scene.daemon.post(DeviceUp(Device.DRIVE))
    scene.live(0.1)
    answers = scene.order(OperatorCommand.RESET)
    scene.daemon.cycle()
    scene.daemon.post(DeviceUp(Device.SCANNER))
    scene.live(0.3, 2.0)
    assert (answers, scene.daemon.state, scene.out) == ([], State.STANDBY, STANDSTILL)
    scene.daemon.post(ResetDone())
    scene.live(0.1, 2.0)
    assert answers == [DONE]
    assert scene.ask(OperatorCommand.START, 1.0) == [DONE]


def test_a_fault_outlives_a_drive_that_is_lost_and_back() -> None:
    scene = running()
    executor = scene.daemon._execution.executor
    assert executor is not None
    executor.stop("broken", is_fault=True)
    scene.daemon.cycle()
    # The drive fails while the robot is being stopped.
    scene.daemon.post(DeviceDown(Device.DRIVE, "no answer", 0.25, True))
    scene.daemon.cycle()
    scene.daemon.post(DeviceUp(Device.DRIVE))
    scene.live(0.3, 2.0)
    assert scene.daemon.state is State.FAULT
    assert scene.daemon.problem.endswith("; the drive base is lost: no answer")
    assert scene.ask(OperatorCommand.RESET, 0.2) == [DONE]
    assert (scene.daemon.state, scene.daemon.problem) == (State.STANDBY, "")


def test_an_end_that_is_ordered_in_a_fault_is_an_orderly_one() -> None:
    scene = fault()
    assert scene.ask(OperatorCommand.QUIT, 0.1) == [DONE]
    assert (scene.daemon.state, scene.daemon.problem) == (State.OVER, "")


def test_a_loop_that_breaks_answers_what_is_open(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = supervisor_fault()
    scene.answers_reset = False
    waiting = scene.order(OperatorCommand.RESET)
    scene.live(0.1)

    def broken(now_s: float) -> None:
        raise RuntimeError(now_s)

    monkeypatch.setattr(scene.safety, "loop_cycled", broken)
    late = scene.order(OperatorCommand.START)
    with pytest.raises(RuntimeError):
        scene.daemon.run()
    assert waiting == [ENDED]
    # It had been taken out of the inbox when the loop broke.
    assert (late, scene.order(OperatorCommand.START)) == ([ENDED], [ENDED])


def test_an_order_that_breaks_the_loop_is_answered(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = standby()

    def broken() -> None:
        raise RuntimeError

    monkeypatch.setattr(scene.safety, "enable", broken)
    answers = scene.order(OperatorCommand.START)
    with pytest.raises(RuntimeError):
        scene.daemon.run()
    assert answers == [ENDED]


def test_an_answer_that_raises_harms_nobody() -> None:
    scene = running()

    def hostile(why: str) -> None:
        raise ValueError(why)

    scene.daemon.post(Order(OperatorCommand.START, "a test", hostile))
    scene.live(0.1, 2.0)
    assert scene.daemon.state is State.RUNNING


def test_orders_from_many_threads_while_the_loop_ends_are_all_answered() -> None:
    scene = running()
    found: list[list[str]] = []

    def ask() -> None:
        found.extend(scene.order(OperatorCommand.START) for _ in range(200))

    threads = [threading.Thread(target=ask) for _ in range(4)]
    for thread in threads:
        thread.start()
    scene.order(OperatorCommand.QUIT)
    while scene.daemon.state is not State.OVER:
        scene.live(0.02, 2.0)
    for thread in threads:
        thread.join()
    assert [len(answers) for answers in found] == [1] * 800
