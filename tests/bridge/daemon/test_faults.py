"""Every fault of a robot and its lines, on a whole bridge: within the stated time its wheels are commanded to stop.

The bridge is the real one with all its threads, on a virtual host; the devices are simulated at the other end of its
serial lines, and what counts is what the simulated motors are commanded. The supervisor always wants to move.
`acceptance/bridge/daemon/test_faults_in_real_time.py` is the witness on real lines. The times stand in
docs/bridge-safety.md ("Every fault, measured at the motors"), whose table is read here.
"""

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from robosc.execution.runtime.requests import PolicyDecisions
from robosc_bridge.daemon.loop import Key
from robosc_bridge.daemon.robot.motion import MotionTarget
from robosc_bridge.daemon.states import OperatorCommand, State
from robosc_bridge.devices.interface import STANDSTILL
from robosc_bridge.errors import LineDeniedError
from robosc_bridge.host import Port
from robosc_bridge.safety import SCAN_TIMEOUTS_S, Caution, Output, Reason, SafetyLayer
from robosc_simulated import SimulatedTurtleBot3
from robosc_simulated.virtual_host import VirtualHost
from support.driven import LIMIT_S, PATIENT, Driven, driven
from support.robot_faults import BASES, GRAVE, STATED_S, TABLE, Fault, answer_as, cases, speak, wires

# A section `remote`; nothing listens there, the test itself is the operator.
REACHABLE = "{grpc_address: '127.0.0.1:1'}"
# Enough for anything that goes on by itself to show.
WHILE_S = 0.3


class Bug(Exception):
    """A bug in a part of the bridge."""


# Faults of a line that do no harm.
HARMLESS = (
    {"split_s": 0.0},
    {"garbage": b"\xff\xff\xfd\x00\x01"},
    {"delay_s": 0.004},
    {"cut_next": 1},
    {"corrupt_next": 1},
    {"drop_next": 1},
)


@pytest.mark.parametrize(("base", "fault"), cases(GRAVE))
def test_a_grave_fault_stops_the_wheels_in_time_and_ends_the_run(base: str, fault: Fault) -> None:
    with driven(base, options="{}" if fault.is_line or base not in BASES else PATIENT) as bridge:
        bridge.stopped_after(lambda: fault.cause(bridge), STATED_S[fault.row])
        problem = bridge.ended()
        assert fault.problem in problem
        assert problem in bridge.messages
        assert bridge.log.events().count("lost.response") == int(fault.is_line)
        bridge.stays(WHILE_S)


# The trials of three exchanges, and those of letting the motors go.
@pytest.mark.parametrize(("base", "trials"), [("opencr", 3 + 3), ("dynamixel", 3 + 6)])
def test_a_base_that_is_silent_counts_as_lost_after_three_answers_that_do_not_come(base: str, trials: int) -> None:
    with driven(base, options="{answer_limit_s: 0.3}") as bridge:
        bridge.steady()
        begin_s = bridge.host.monotonic()
        wires(bridge, is_deaf=True)
        bridge.until(lambda: "lost.response" in bridge.log.events(), "the loss")
        # Beside the rest of a cycle, and what is sent to a device that may wait for more of a packet.
        assert bridge.host.monotonic() - begin_s == pytest.approx(trials * 0.3, abs=0.1)


@pytest.mark.parametrize(
    ("base", "limit_s"),
    [
        ("opencr", 0.84),  # Those and a wait for a board that is slow, 0.65 s in all, and a last word.
        ("dynamixel", 0.48),  # The same, and a last word to both motors.
        ("mavlink-rover", 2.0),  # Its last estimate holds for a second, and for another one it is asked to disarm.
    ],
)
def test_a_run_ends_so_soon_after_the_last_answer(base: str, limit_s: float) -> None:
    """After three exchanges in a row without an answer: noise alone does not end it, and nothing waits for longer."""
    with driven(base, options="{}") as bridge:
        bridge.steady()
        begin_s = bridge.host.monotonic()
        bridge.robot.base_faults.drop_share = 1.0
        assert "the drive base is lost" in bridge.ended()
        # Up to a cycle passes before it is asked again.
        assert bridge.host.monotonic() - begin_s == pytest.approx(limit_s, abs=0.06)


def test_the_fault_that_a_motor_reports_is_named() -> None:
    with driven("dynamixel") as bridge:
        bridge.steady()
        bridge.robot.left.overload()
        bridge.ended()
        bridge.reports("the motors report: overload")


def test_a_voltage_that_is_out_of_range_is_reported_and_stops_nothing() -> None:
    with driven("dynamixel") as bridge:
        bridge.steady()
        bridge.robot.left.brown_out(14.5)
        bridge.reports("the motors report: input voltage")
        before = len(bridge.trace.commanded)
        bridge.until(lambda: len(bridge.trace.heard_s) > 100, "a hundred exchanges")
        assert (bridge.state, bridge.trace.commanded[before:]) == (State.RUNNING, [])


@pytest.mark.parametrize("base", BASES)
@pytest.mark.parametrize("wire", HARMLESS, ids=lambda wire: next(iter(wire)))
def test_a_disturbed_line_does_not_stop_the_wheels_for_good(base: str, wire: dict[str, object]) -> None:
    with driven(base) as bridge:
        bridge.steady()
        wires(bridge, **wire)
        heard = len(bridge.trace.heard_s)
        bridge.until(lambda: len(bridge.trace.heard_s) > heard + 50, "fifty requests")
        bridge.steady()
        assert (bridge.state, bridge.log.events().count("lost.response")) == (State.RUNNING, 0)


# Requests of the supervisor.


@pytest.mark.parametrize("base", BASES)
@pytest.mark.parametrize("velocity", [(5.0, 0.0), (-5.0, 0.0), (0.0, 50.0), (5.0, -50.0)])
def test_no_wheel_is_commanded_more_than_its_limit_nor_at_once(base: str, velocity: tuple[float, float]) -> None:
    linear_m_s2, angular_rad_s2, reach_s = 0.25, 2.0, 0.1
    safety = (
        f"{{linear_m_s: 0.1, angular_rad_s: 0.8, linear_acceleration_m_s2: {linear_m_s2}, "
        f"angular_acceleration_rad_s2: {angular_rad_s2}}}"
    )
    with driven(base, velocity=velocity, safety=safety) as bridge:
        bridge.steady()
        half_m = bridge.limits.separation_m / 2
        commands = bridge.trace.commanded[1:]
        for at_s, left_m_s, right_m_s in commands:
            linear_m_s, angular_rad_s = (left_m_s + right_m_s) / 2, (right_m_s - left_m_s) / 2 / half_m
            # Servos and OpenCR take whole steps: 0.8 mm/s of a wheel, and 0.01 m/s and 0.01 rad/s.
            assert abs(linear_m_s) <= 0.1 + 1e-3
            assert abs(angular_rad_s) <= 0.8 + 1e-2
            # The device hears a little later of events at the same speed before.
            since_s = at_s - commands[0][0] + reach_s
            assert abs(linear_m_s) <= linear_m_s2 * since_s
            assert abs(angular_rad_s) <= angular_rad_s2 * since_s
        fastest_m_s = max(abs(speed) for _, *wheels in commands for speed in wheels)
        assert fastest_m_s > 0.06


@pytest.mark.parametrize("acceleration_rad_s2", [1.0, 3.0])
def test_motors_that_go_to_their_goals_slowly_are_no_fault_and_a_wheel_that_is_held_is(
    acceleration_rad_s2: float,
) -> None:
    options = f"{{answer_limit_s: 0.3, acceleration_rad_s2: {acceleration_rad_s2}}}"
    with driven("dynamixel", velocity=(0.2, 0.0), options=options) as bridge:
        bridge.moves()
        # The way to 0.2 m/s and back, and as long again.
        bridge.host.sleep(2 * 6.1 / acceleration_rad_s2)
        assert (bridge.state, bridge.machine.daemon.problem) == (State.RUNNING, "")
        bridge.stopped_after(bridge.robot.left.block_wheel, STATED_S["a wheel is held"])
        assert bridge.ended() in (Reason.MOTOR_FAULT, Reason.WHEEL_ASTRAY)


@pytest.mark.parametrize(
    ("base", "voltage_v"), [("opencr", 11.4), ("opencr", 11.5), ("dynamixel", 6.9), ("mavlink-rover", 0.0)]
)
def test_a_battery_that_is_low_is_reported_and_stops_nothing(base: str, voltage_v: float) -> None:
    with driven(base) as bridge:
        bridge.steady()
        for servo in (bridge.robot.left, bridge.robot.right):
            if base == "dynamixel":
                servo.brown_out(voltage_v)
        if bridge.robot.opencr is not None:
            bridge.robot.opencr.set_battery(voltage_v)
        if bridge.robot.rover is not None:
            bridge.robot.rover.charge_state = 2
        bridge.reports("The battery will soon be empty.")
        bridge.host.sleep(5.0)
        assert bridge.state is State.RUNNING
        assert bridge.wheels_m_s != (0.0, 0.0)


@pytest.mark.parametrize(("base", "voltage_v"), [("dynamixel", 11.1), ("mavlink-rover", 7.4)])
def test_a_supply_that_is_not_a_turtlebot3s_is_no_empty_battery(base: str, voltage_v: float) -> None:
    """A bench supply of 11.1 V, and a rover with a pack of two cells."""
    with driven(base) as bridge:
        for servo in (bridge.robot.left, bridge.robot.right):
            servo.brown_out(voltage_v)
        if bridge.robot.rover is not None:
            bridge.robot.rover.battery_v = voltage_v
        bridge.steady()
        bridge.host.sleep(5.0)
        assert bridge.state is State.RUNNING
        assert not any("battery" in message for message in bridge.messages)


# A write of 24 bytes at address 150 of OpenCR, and one of the goals (104) of both servos; what follows is the order.
ORDERS = {
    "opencr": (bytes.fromhex("ff ff fd 00 c8 1d 00 03 96 00"), bytes(24)),
    "dynamixel": (
        bytes.fromhex("ff ff fd 00 fe 11 00 83 68 00 04 00"),
        bytes.fromhex("01 00 00 00 00 02 00 00 00 00"),
    ),
}


def _orders(bridge: Driven, base: str, since: int) -> list[bool]:
    """Tell of each order that the base has heard since then whether it was to stand still."""
    if base in ORDERS:
        order, zero = ORDERS[base]
        found = [data for data in bridge.trace.heard[since:] if data.startswith(order)]
        return [data.startswith(order + zero) for data in found]
    assert bridge.robot.rover is not None
    return [target["vx"] == 0.0 for target in bridge.robot.rover.targets[since:]]


# Longer than an output holds; shorter and longer than the time limits of the devices.
@pytest.mark.parametrize("base", [*BASES, "mavlink-rover"])
@pytest.mark.parametrize("gap_s", [0.22, 0.45, 0.7, 5.0])
def test_a_thread_that_is_halted_between_decision_and_writing_sends_no_old_velocity(
    base: str, gap_s: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    with driven(base, velocity=(0.15, 0.0)) as bridge:
        bridge.steady()
        decided = SafetyLayer.output
        gaps, ends = [gap_s], list[int]()

        def output(layer: SafetyLayer, now_s: float) -> Output:
            found = decided(layer, now_s)
            if gaps and found.velocity != STANDSTILL:
                bridge.host.sleep(gaps.pop())
                rover = bridge.robot.rover
                ends.append(len(bridge.trace.heard) if rover is None else len(rover.targets))
            return found

        monkeypatch.setattr(SafetyLayer, "output", output)
        bridge.until(lambda: ends and _orders(bridge, base, ends[0]), "the first order after the gap")
        assert _orders(bridge, base, ends[0])[0]
        # Later requests are decided anew, and begin at standstill.
        before = len(bridge.trace.commanded)
        bridge.host.sleep(1.0)
        assert all(max(map(abs, wheels)) < 0.05 for _, *wheels in bridge.trace.commanded[before : before + 1])


# The loop and the supervisor.


@pytest.mark.parametrize("base", BASES)
@pytest.mark.parametrize(
    ("row", "safety", "message"),
    [
        ("the loop hangs", "{}", "The supervisor's loop has not run for too long."),
        ("no command comes", "{overrun_s: 1.0}", ""),
    ],
)
def test_a_loop_that_hangs_stops_the_wheels_until_it_turns_again(
    base: str, row: str, safety: str, message: str
) -> None:
    with driven(base, safety=safety) as bridge:
        bridge.stopped_after(lambda: setattr(bridge.log, "hangs", True), STATED_S[row])
        bridge.stays(WHILE_S)
        bridge.log.hangs = False
        bridge.moves()
        if message:
            bridge.reports(message)


@pytest.mark.parametrize("base", BASES)
def test_an_exception_in_the_executor_stops_the_wheels_and_ends_the_run(
    base: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(*_: object) -> bool:
        raise Bug("in a decision")

    with driven(base) as bridge:
        bridge.stopped_after(
            lambda: monkeypatch.setattr(PolicyDecisions, "decide", fails), STATED_S["the executor fails"]
        )
        assert "Bug: in a decision" in bridge.ended()
        bridge.stays(WHILE_S)


@pytest.mark.parametrize("base", BASES)
def test_an_exception_in_the_loop_stops_the_wheels(base: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: object) -> None:
        raise Bug("in the loop")

    with driven(base) as bridge:
        bridge.stopped_after(lambda: monkeypatch.setattr(MotionTarget, "refresh", fails), STATED_S["the loop fails"])
        bridge.thread.join(LIMIT_S)
        assert isinstance(bridge.error, Bug)
        bridge.stays(WHILE_S)


# The operator.


@pytest.mark.parametrize("is_off", [None, False])
@pytest.mark.parametrize("is_button", [True, False])
def test_what_is_stopped_stays_stopped_whatever_others_send_to_opencr(is_off: bool | None, is_button: bool) -> None:
    """Its buttons and its remote control move nothing without torque; with it, for half a second."""
    safety = "{}" if is_off is None else "{torque_off_on_operator_stop: false}"
    with driven("opencr", safety=safety) as bridge:
        bridge.stopped_after(lambda: bridge.machine.daemon.post(OperatorCommand.STOP), STATED_S["an operator stops it"])
        bridge.host.sleep(1.0)
        board = bridge.robot.opencr
        assert board is not None
        begin_s = bridge.host.monotonic()
        if is_button:
            board.press(button_1=True)
        else:
            board.steer(0.1, 0.0)
        if is_off is None:
            bridge.stays(6.0)
            return
        bridge.reports(Caution.TORQUE_HELD)
        bridge.moves()
        moved_s = bridge.host.monotonic()
        assert moved_s - begin_s == pytest.approx(3.0 if is_button else 0.0, abs=0.1)
        bridge.until(lambda: bridge.wheels_m_s == (0.0, 0.0), "the end of it")
        assert bridge.host.monotonic() - moved_s <= STATED_S["OpenCR's remote control steers"]
        bridge.stays(6.0)
        assert Reason.UNBIDDEN_MOTION in bridge.ended()


@pytest.mark.parametrize("base", BASES)
@pytest.mark.parametrize("how", [OperatorCommand.STOP, Key("space")], ids=["command", "key"])
def test_an_operators_stop_holds_until_somebody_lets_it_go_on(base: str, how: OperatorCommand | Key) -> None:
    with driven(base) as bridge:
        bridge.stopped_after(lambda: bridge.machine.daemon.post(how), STATED_S["an operator stops it"])
        bridge.stays(WHILE_S)
        assert _ordered(bridge, OperatorCommand.RESET) == ""
        assert bridge.state is State.STANDBY
        bridge.stays(WHILE_S)
        assert _ordered(bridge, OperatorCommand.START) == ""
        bridge.moves()


@pytest.mark.parametrize("base", BASES)
@pytest.mark.parametrize("is_off", [False, True], ids=["hold", "let go"])
def test_a_resume_lets_it_go_on_also_where_the_motors_have_let_go(base: str, is_off: bool) -> None:
    with driven(base, safety=f"{{torque_off_on_operator_stop: {str(is_off).lower()}}}") as bridge:

        def has_torque() -> bool:
            return any(wheel.table["torque enable"] for wheel in (bridge.robot.left, bridge.robot.right))

        bridge.stopped_after(lambda: bridge.machine.daemon.post(OperatorCommand.STOP), STATED_S["an operator stops it"])
        if is_off:
            bridge.until(lambda: not has_torque(), "the motors to let go")
        bridge.stays(WHILE_S)
        assert has_torque() is not is_off
        assert bridge.state is State.RUNNING
        assert _ordered(bridge, OperatorCommand.RESUME) == ""
        bridge.moves()


def test_an_operator_who_is_lost_stops_the_wheels_until_he_is_back() -> None:
    with driven("opencr", remote=REACHABLE, safety="{operator_link_timeout_s: 0.3}") as bridge:
        is_there = True

        def sees() -> None:
            while bridge.state is not State.OVER:
                if is_there:
                    bridge.machine.operations.operator_seen()
                bridge.host.sleep(0.02)

        def leaves() -> None:
            nonlocal is_there
            is_there = False

        operator = bridge.host.thread(sees, "operator")
        operator.start()
        try:
            bridge.stopped_after(leaves, STATED_S["the operator is lost"])
            bridge.reports("The link to the operator is lost.")
            bridge.stays(WHILE_S)
            assert bridge.state is State.RUNNING
            is_there = True
            bridge.moves()
        finally:
            bridge.machine.quit()
            operator.join(LIMIT_S)


# The bridge stays if an operator can learn of it; nothing moves before an operator resumes.


def _ordered(bridge: Driven, command: OperatorCommand) -> str:
    """Give an order, and return the reason why it cannot be executed, or nothing."""
    answer = bridge.machine.operations.order(command, "test")
    bridge.until(answer.done, "an answer to the order", 2 * LIMIT_S)
    return answer.result()


@pytest.mark.parametrize("base", BASES)
def test_a_base_that_is_plugged_in_again_moves_when_somebody_says_so(base: str) -> None:
    with driven(base, remote=REACHABLE) as bridge:
        line = bridge.robot.base_line
        bridge.stopped_after(line.disconnect, STATED_S["the base is unplugged"])
        bridge.until(lambda: bridge.state is State.FAULT, "the fault")
        assert "the drive base is lost" in bridge.machine.daemon.problem
        line.reconnect()
        bridge.until(lambda: bridge.state is State.STANDBY, "the standby with the base back")
        bridge.stays(2 * WHILE_S)
        assert _ordered(bridge, OperatorCommand.START) == ""
        bridge.moves()


def _suspend(bridge: Driven, seconds: float) -> None:
    """Let the whole bridge stand still, as a computer that sleeps; its devices go on."""
    host_of(bridge.robot).suspend(seconds, "drive", "scanner", "loop", f"MAVLink {bridge.robot.base_path}")


# A rover alone goes on meanwhile, until its own time limit.
@pytest.mark.parametrize("base", [*BASES, "mavlink-rover"])
@pytest.mark.parametrize("gap_s", [0.6, 30.0])
def test_a_bridge_that_stood_still_moves_nothing_before_somebody_says_so(base: str, gap_s: float) -> None:
    row = "the bridge stands still" if base in BASES else "a rover's bridge is killed or halted"
    limit_s = min(STATED_S[row], gap_s + 0.06)
    with driven(base, remote=REACHABLE) as bridge:
        bridge.stopped_after(lambda: _suspend(bridge, gap_s), limit_s)
        bridge.until(lambda: bridge.state is State.FAULT, "the fault")
        assert Reason.PAUSED in bridge.machine.daemon.problem
        bridge.stays(2 * WHILE_S)
        assert _ordered(bridge, OperatorCommand.START) != ""
        assert _ordered(bridge, OperatorCommand.RESET) == ""
        bridge.stays(WHILE_S)
        # After so long a time the scanner is started anew.
        bridge.until(lambda: _ordered(bridge, OperatorCommand.START) == "", "a start that is accepted")
        bridge.moves()


# A process that is killed never goes on; what it has sent is the last that its devices hear.
@pytest.mark.parametrize(
    ("base", "row"),
    [
        ("opencr", "the bridge is killed"),
        ("dynamixel", "the bridge is killed"),
        ("mavlink-rover", "a rover's bridge is killed or halted"),
    ],
)
def test_a_bridge_that_is_killed_leaves_wheels_that_stop_by_themselves(base: str, row: str) -> None:
    with driven(base) as bridge:
        bridge.stopped_after(lambda: _suspend(bridge, 10.0), STATED_S[row])


@pytest.mark.parametrize(
    ("row", "happens", "problem"),
    [
        ("a rover is unplugged", lambda bridge: bridge.robot.base_line.disconnect(), "the drive base is lost"),
        # It still reports that it moves.
        ("a rover hears nothing", lambda bridge: wires(bridge, is_deaf=True), Reason.MOTOR_FAULT),
    ],
)
def test_a_rover_that_is_not_reached_stops_by_itself(
    row: str, happens: Callable[[Driven], object], problem: str
) -> None:
    with driven("mavlink-rover") as bridge:
        bridge.stopped_after(lambda: happens(bridge), STATED_S[row])
        assert problem in bridge.ended()


def test_whoever_arms_a_rover_learns_how_long_it_goes_on_alone() -> None:
    with driven("mavlink-rover", remote=REACHABLE) as bridge:
        bridge.steady()
        for command in (OperatorCommand.STANDBY, OperatorCommand.START):
            assert _ordered(bridge, command) == ""
        bridge.moves()
        bridge.reports("it drives on for up to 3 s, until its target expires")


@pytest.mark.parametrize("base", [*BASES, "mavlink-rover"])
def test_a_bridge_that_stood_still_for_a_moment_goes_on(base: str) -> None:
    with driven(base, remote=REACHABLE) as bridge:
        bridge.steady()
        _suspend(bridge, 0.3)
        bridge.host.sleep(1.0)
        assert bridge.state is State.RUNNING
        assert bridge.wheels_m_s != (0.0, 0.0)


@pytest.mark.parametrize("fault", [fault for fault in GRAVE if fault.is_line], ids=lambda fault: fault.row)
def test_a_line_that_is_sound_again_moves_nothing_by_itself(fault: Fault) -> None:
    with driven(fault.bases[0], remote=REACHABLE, options="{}") as bridge:
        bridge.steady()
        fault.cause(bridge)
        bridge.until(lambda: bridge.state is State.FAULT, "the fault")
        bridge.robot.base_line.reconnect()
        bridge.robot.base_faults.clear()
        answer_as(bridge.robot, None)
        for servo in (bridge.robot.left, bridge.robot.right):
            servo.brown_out(12.0)
        if bridge.robot.bus is not None:
            speak(bridge, 3)
        bridge.until(lambda: bridge.state is State.STANDBY, "the standby with the base back")
        bridge.stays(WHILE_S)


def test_a_motor_that_is_overloaded_is_restarted_by_a_reset_and_moves_after_a_start() -> None:
    with driven("dynamixel", remote=REACHABLE) as bridge:
        bridge.stopped_after(bridge.robot.left.overload, STATED_S["a motor is overloaded"])
        bridge.until(lambda: bridge.state is State.FAULT, "the fault")
        assert _ordered(bridge, OperatorCommand.START) != ""
        bridge.stays(WHILE_S)
        assert _ordered(bridge, OperatorCommand.RESET) == ""
        assert bridge.state is State.STANDBY
        bridge.stays(WHILE_S)
        assert _ordered(bridge, OperatorCommand.START) == ""
        bridge.moves()


# The LiDAR.


@pytest.mark.parametrize(
    ("base", "lidar"), [("opencr", "lds01"), ("dynamixel", "lds02"), ("opencr", "lds03"), ("dynamixel", "lds03")]
)
@pytest.mark.parametrize("how", ["is_stalled", "is_covered"])
def test_a_lidar_that_shows_nothing_stops_the_wheels_until_it_does(base: str, lidar: str, how: str) -> None:
    with driven(base, lidar) as bridge:
        row = f"{lidar} is silent" if how == "is_stalled" else f"{lidar} is covered"
        bridge.stopped_after(lambda: setattr(bridge.robot.scanner, how, True), STATED_S[row])
        bridge.reports(f"scanner: no full revolution with valid ranges for {SCAN_TIMEOUTS_S[lidar]:g} s")
        bridge.reports("The scanner has made no full revolution for too long.")
        bridge.stays(WHILE_S)
        assert (bridge.state, bridge.log.events().count("lost.response")) == (State.RUNNING, 1)
        setattr(bridge.robot.scanner, how, False)
        bridge.moves()
        assert bridge.log.events().count("back.response") == 1


@pytest.mark.parametrize("base", BASES)
def test_a_lidar_that_is_unplugged_stops_the_wheels_until_it_is_back(base: str) -> None:
    with driven(base) as bridge:
        line = bridge.robot.scanner_line
        bridge.stopped_after(line.disconnect, STATED_S["lds03 is silent"])
        bridge.reports(f"scanner: {line.path}: the ")
        bridge.stays(WHILE_S)
        assert bridge.state is State.RUNNING
        line.reconnect()
        bridge.moves()
        assert [event for event in bridge.log.events() if event != "drive.request"] == [
            "lost.response",
            "back.response",
        ]


@pytest.mark.parametrize("base", BASES)
def test_noise_from_a_lidar_is_no_scan(base: str) -> None:
    with driven(base) as bridge:
        faults = bridge.robot.scanner_faults
        bridge.stopped_after(lambda: setattr(faults, "corrupt_share", 1.0), STATED_S["lds03 is covered"])
        bridge.stays(WHILE_S)
        faults.clear()
        bridge.moves()


# Faults at the start.


def host_of(robot: SimulatedTurtleBot3) -> VirtualHost:
    assert isinstance(robot.time.clock, VirtualHost)
    return robot.time.clock


def _busy(robot: SimulatedTurtleBot3) -> Callable[[], object]:
    return host_of(robot).open_port(robot.base_path, 1_000_000).close


def _missing(robot: SimulatedTurtleBot3) -> Callable[[], object]:
    robot.base_line.disconnect()
    return robot.base_line.reconnect


def _deaf(robot: SimulatedTurtleBot3) -> Callable[[], object]:
    robot.base_faults.is_deaf = True
    return robot.base_faults.clear


def _foreign(robot: SimulatedTurtleBot3) -> Callable[[], object]:
    answer_as(robot, 7)
    return lambda: answer_as(robot, None)


def _forbidden(robot: SimulatedTurtleBot3) -> Callable[[], object]:
    patch = pytest.MonkeyPatch()
    host = host_of(robot)
    opened = host.open_port

    def refused(path: str, baud: int) -> Port:
        if path == robot.base_path:
            raise LineDeniedError(path, "no permission; is this user in the group dialout?")
        return opened(path, baud)

    patch.setattr(host, "open_port", refused)
    return patch.undo


@pytest.mark.parametrize("base", BASES)
@pytest.mark.parametrize(
    ("happens", "message"),
    [
        (_busy, "another program uses this port"),
        (_missing, "there is no such port; is the device plugged in?"),
        (_deaf, "does not answer"),
        (_foreign, "does not answer"),
        (_forbidden, "no permission; is this user in the group dialout?"),
    ],
    ids=["busy", "missing", "silent", "another id", "denied"],
)
def test_a_base_that_cannot_be_opened_is_reported_once_and_tried_until_it_can(
    base: str, happens: Callable[[SimulatedTurtleBot3], Callable[[], object]], message: str
) -> None:
    fixed: list[Callable[[], object]] = []
    with driven(base, before=lambda robot: fixed.append(happens(robot))) as bridge:
        try:
            bridge.reports(message)
            # Two attempts more, at least, which are not reported.
            bridge.stays(2.5 * WHILE_S)
            bridge.reports(message)
            assert bridge.state is State.STARTING
        finally:
            fixed[0]()
        bridge.moves()


def test_another_baud_is_reported_with_what_to_do() -> None:
    def slow(robot: SimulatedTurtleBot3) -> None:
        for servo in (robot.left, robot.right):
            servo.table["baud rate"] = 1

    with driven("dynamixel", before=slow) as bridge:
        bridge.reports(
            "does not answer at 1000000 baud; does it have power? A motor fresh from the factory speaks 57600"
        )
        bridge.stays(WHILE_S)
        assert bridge.state is State.STARTING


# The page.


def test_every_row_of_the_page_is_shown_here() -> None:
    text = Path(__file__).read_text(encoding="utf-8")
    shown = {fault.row for fault in GRAVE} | {
        f"{lidar} is {how}" for lidar in SCAN_TIMEOUTS_S for how in ("silent", "covered")
    }
    assert {row for row in STATED_S if row not in shown and f'"{row}"' not in text} == set()
    assert shown <= set(STATED_S)
    assert set(re.findall(r"`(test_\w+)`", TABLE)) <= set(re.findall(r"^def (test_\w+)", text, re.MULTILINE))
