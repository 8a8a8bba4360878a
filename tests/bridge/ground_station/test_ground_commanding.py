"""Tests of a ground station's commands on a clock that the test sets: answered, ordered, held and refused ones."""

import pytest

from robosc_bridge.daemon.states import OperatorCommand, State
from robosc_bridge.daemon.threads.reports import Device
from robosc_bridge.safety import Reason
from support.ground import Station, joined_texts, of_type
from support.ground_talk import Talk


def test_arming_is_answered_when_it_is_done(talk: Talk) -> None:
    assert talk.results(400, 1.0) == []
    assert talk.daemon.commands == [OperatorCommand.START]
    assert talk.daemon.orders[0].by == "MAVLink 255/190"
    assert of_type("COMMAND_ACK", talk.live(0.5)) == []
    talk.daemon.orders[0].answer("")
    (ack,) = of_type("COMMAND_ACK", talk.live(0.5))
    assert (ack.command, ack.result, ack.target_system, ack.target_component) == (400, 0, 255, 190)


def test_a_refusal_comes_after_its_reason(talk: Talk) -> None:
    talk.daemon.answers[OperatorCommand.START] = "the robot is starting: no scanner"
    found = talk.ask(400, 1.0)
    assert [item.get_type() for item in found if item.get_type() in ("STATUSTEXT", "COMMAND_ACK")] == [
        "STATUSTEXT",
        "COMMAND_ACK",
    ]
    assert joined_texts(found) == ["Not armed: the robot is starting: no scanner"]
    assert of_type("COMMAND_ACK", found)[0].result == 1
    # A repeated command is answered again.
    assert joined_texts(talk.ask(400, 1.0)) == ["Not armed: the robot is starting: no scanner"]


def test_a_repeated_command_is_done_once(talk: Talk) -> None:
    assert talk.results(400, 1.0) == []
    assert talk.results(400, 1.0, confirmation=1) == [5]
    talk.daemon.orders[0].answer("")
    assert [ack.result for ack in of_type("COMMAND_ACK", talk.say())] == [0]
    assert talk.results(400, 1.0, confirmation=2) == [0]
    assert talk.daemon.commands == [OperatorCommand.START]
    # A new one is new, and so is one after a long time.
    assert talk.results(400, 1.0) == []
    talk.daemon.orders[1].answer("")
    talk.say()
    talk.live(11.0)
    assert talk.results(400, 1.0, confirmation=1) == []
    assert len(talk.daemon.orders) == 3


def test_an_arming_that_is_not_answered_is_undone(talk: Talk) -> None:
    talk.ask(400, 1.0)
    found = talk.live(5.2)
    assert [ack.result for ack in of_type("COMMAND_ACK", found)] == [4]
    assert "Not armed: the bridge's loop does not answer." in joined_texts(found)
    assert talk.daemon.commands == [OperatorCommand.START, OperatorCommand.STANDBY]
    # A late answer has no effect.
    talk.daemon.orders[0].answer("")
    assert of_type("COMMAND_ACK", talk.live(1.0)) == []


@pytest.mark.parametrize(
    ("number", "parameters", "expected"),
    [
        (400, (0.0,), OperatorCommand.STANDBY),
        (400, (0.0, 21196.0), OperatorCommand.STANDBY),
        (176, (1.0, 4.0), OperatorCommand.STOP),
        (193, (0.0,), OperatorCommand.STOP),
        (185, (1.0,), OperatorCommand.STOP),
    ],
)
def test_stopping_is_done_before_it_is_answered(
    talk: Talk, number: int, parameters: tuple[float, ...], expected: OperatorCommand
) -> None:
    talk.daemon.show(state=State.RUNNING)
    talk.say()
    assert talk.results(number, *parameters) == [0]
    assert talk.daemon.commands == [expected]
    # Again, and as the other kind of command; and while the loop hangs.
    talk.now_s += 60.0
    assert talk.results(number, *parameters, confirmation=1) == [0]
    talk.now_s += 1.0
    found = talk.say(talk.station.command_int(number, *parameters))
    assert [ack.result for ack in of_type("COMMAND_ACK", found)] == [0]
    assert talk.daemon.commands == [expected] * 3


def test_a_flood_of_stops_is_answered_each_and_ordered_seldom(talk: Talk) -> None:
    found = talk.say(b"".join(talk.station.command(400, 0.0) for _ in range(300)))
    assert len(of_type("COMMAND_ACK", found)) == 300
    assert talk.daemon.commands == [OperatorCommand.STANDBY]
    # A start in between is stopped all the same.
    talk.ask(400, 1.0)
    talk.ask(400, 0.0)
    assert talk.daemon.commands == [OperatorCommand.STANDBY, OperatorCommand.START, OperatorCommand.STANDBY]
    talk.daemon.orders[1].answer("")
    talk.say()
    found = talk.say(b"".join(talk.station.command(400, wanted) for wanted in (0.0, 0.0, 1.0, 0.0, 0.0)))
    assert [ack.result for ack in of_type("COMMAND_ACK", found)] == [0] * 4
    assert talk.daemon.commands[3:] == [OperatorCommand.STANDBY, OperatorCommand.START, OperatorCommand.STANDBY]


@pytest.mark.parametrize(("number", "parameters"), [(400, (0.0,)), (193, (0.0,)), (185, (1.0,)), (176, (1.0, 4.0))])
def test_every_stop_that_is_accepted_is_ordered(talk: Talk, number: int, parameters: tuple[float, ...]) -> None:
    # Another endpoint may have resumed or started in between, which this one has not seen.
    for count in range(1, 4):
        assert talk.results(number, *parameters) == [0]
        assert len(talk.daemon.orders) == count
        talk.now_s += 0.001


@pytest.mark.parametrize(
    ("change", "stop"), [((400, 1.0), (400, 0.0)), ((193, 1.0), (193, 0.0)), ((400, 1.0), (193, 0.0))]
)
@pytest.mark.parametrize("is_answered", [True, False])
def test_what_was_accepted_before_a_stop_is_not_accepted_again(
    talk: Talk, change: tuple[int, float], stop: tuple[int, float], is_answered: bool
) -> None:
    talk.daemon.show(reasons=(Reason.OPERATOR_STOP,))
    assert talk.results(*change) == []
    if is_answered:
        talk.daemon.orders[0].answer("")
        talk.say()
    assert talk.results(*stop) == [0]
    if not is_answered:
        talk.daemon.orders[0].answer("")
        assert [ack.result for ack in of_type("COMMAND_ACK", talk.say())] == [0]
    orders = len(talk.daemon.orders)
    found = talk.ask(*change, confirmation=1)
    assert [ack.result for ack in of_type("COMMAND_ACK", found)] == [1]
    assert any("the robot was stopped meanwhile; send it anew." in text for text in joined_texts(found))
    assert len(talk.daemon.orders) == orders
    # A command of its own is done; and so is a repetition long after the stop.
    assert talk.results(*change) == []
    assert len(talk.daemon.orders) == orders + 1
    talk.daemon.orders[-1].answer("no")
    talk.say()
    talk.live(10.1)
    assert talk.results(*change, confirmation=1) == []


def test_what_others_have_stopped_is_not_accepted_again(talk: Talk) -> None:
    talk.daemon.answers = {OperatorCommand.START: "", OperatorCommand.RESUME: ""}
    assert talk.results(400, 1.0) == [0]
    talk.daemon.show(state=State.RUNNING)
    talk.live(1.5)
    assert talk.results(400, 1.0, confirmation=1) == [0]
    talk.daemon.show(state=State.STANDBY)
    talk.live(0.1)
    assert talk.results(400, 1.0, confirmation=2) == [1]
    talk.daemon.show(reasons=(Reason.OPERATOR_STOP,))
    talk.live(0.1)
    assert talk.results(193, 1.0) == [0]
    talk.daemon.show(reasons=())
    talk.live(1.5)
    assert talk.results(193, 1.0, confirmation=1) == [0]
    talk.daemon.show(reasons=(Reason.OPERATOR_STOP,))
    talk.live(0.1)
    assert talk.results(193, 1.0, confirmation=1) == [1]
    assert talk.daemon.commands == [OperatorCommand.START, OperatorCommand.RESUME]


def test_a_stop_does_not_wait_behind_a_packet_that_was_cut(talk: Talk) -> None:
    long = bytes.fromhex("fd ff 00 00 05 ff be 6e 00 00")
    for cut in (long, long * 3, b"\xfd", talk.station.command(400, 1.0)[:20]):
        talk.daemon.orders.clear()
        found = talk.say(cut + talk.station.command(400, 0.0)) + talk.say(after_s=0.02) + talk.say(after_s=0.04)
        assert [ack.result for ack in of_type("COMMAND_ACK", found)] == [0]
        assert talk.daemon.commands == [OperatorCommand.STANDBY]


def test_a_packet_that_comes_slowly_comes(talk: Talk) -> None:
    for byte in talk.station.command(400, 0.0):
        assert talk.daemon.orders == []
        talk.say(bytes((byte,)))
        talk.say(after_s=0.06)
    assert talk.daemon.commands == [OperatorCommand.STANDBY]


def test_a_flood_of_others_is_bounded(talk: Talk) -> None:
    talk.daemon.answers[OperatorCommand.START] = "no"
    found = talk.say(b"".join(talk.station.command(410) for _ in range(1000)))
    assert len(of_type("COMMAND_ACK", found)) == 200
    assert talk.results(400, 1.0) == []
    assert talk.results(400, 0.0) == [0]
    talk.live(1.0)
    assert talk.results(410) == [3]


def test_modes(talk: Talk) -> None:
    # The robot is not stopped: resuming has no effect, and a mode arms nothing.
    assert talk.results(176, 1.0, 10.0) == [0]
    assert talk.daemon.orders == []
    talk.daemon.show(state=State.RUNNING, reasons=(Reason.OPERATOR_STOP,))
    assert {beat.custom_mode for beat in of_type("HEARTBEAT", talk.live(1.1))} == {4}
    assert talk.results(176, 1.0, 10.0) == []
    assert talk.daemon.commands == [OperatorCommand.RESUME]
    talk.daemon.orders[0].answer("")
    talk.daemon.show(reasons=())
    found = talk.live(1.1)
    assert [ack.result for ack in of_type("COMMAND_ACK", found)] == [0]
    assert {beat.custom_mode for beat in of_type("HEARTBEAT", found)} == {10}
    # The other running mode is the same, and it is said which one it is.
    found = talk.ask(176, 1.0, 15.0)
    assert [ack.result for ack in of_type("COMMAND_ACK", found)] == [0]
    assert joined_texts(found) == ["The supervisor runs in mode AUTO, not GUIDED."]
    found = talk.ask(176, 1.0, 0.0)
    assert [ack.result for ack in of_type("COMMAND_ACK", found)] == [2]
    assert joined_texts(found) == ["There is no mode MANUAL here; there are HOLD, AUTO and GUIDED."]


def test_going_on_right_after_a_stop_is_ordered_though_it_does_not_show_yet(talk: Talk) -> None:
    assert talk.results(193, 0.0) == [0]
    assert talk.results(193, 1.0) == []
    assert talk.daemon.commands == [OperatorCommand.STOP, OperatorCommand.RESUME]
    talk.daemon.orders[1].answer("the stop has not reached the motors yet")
    assert [ack.result for ack in of_type("COMMAND_ACK", talk.say())] == [1]


def test_a_stop_that_must_hold_is_answered_with_its_reason(talk: Talk) -> None:
    talk.daemon.show(state=State.RUNNING, reasons=(Reason.OPERATOR_STOP,))
    talk.daemon.answers[OperatorCommand.RESUME] = "the stop button is held"
    talk.say()
    found = talk.ask(193, 1.0)
    assert [ack.result for ack in of_type("COMMAND_ACK", found)] == [1]
    assert "Not resumed: the stop button is held" in joined_texts(found)


def test_the_old_message_for_modes(talk: Talk) -> None:
    library = talk.station.codec
    found = talk.say(talk.station.pack(library.set_mode_encode(1, 1, 4)))
    assert [(ack.command, ack.result) for ack in of_type("COMMAND_ACK", found)] == [(11, 0)]
    assert talk.daemon.commands == [OperatorCommand.STOP]
    assert of_type("COMMAND_ACK", talk.say(talk.station.pack(library.set_mode_encode(2, 1, 4)))) == []
    found = talk.say(talk.station.pack(library.set_mode_encode(1, 1, 11)))
    assert [ack.result for ack in of_type("COMMAND_ACK", found)] == [2]
    assert len(talk.daemon.orders) == 1


def test_a_reset_is_for_a_robot_at_rest(talk: Talk) -> None:
    talk.daemon.show(state=State.RUNNING)
    talk.say()
    found = talk.ask(246, 1.0)
    assert [ack.result for ack in of_type("COMMAND_ACK", found)] == [1]
    assert "The robot is armed: disarm it before it is reset." in joined_texts(found)
    talk.daemon.show(state=State.FAULT, problem="hot")
    talk.say()
    assert talk.results(246, 1.0) == []
    assert talk.daemon.commands == [OperatorCommand.RESET]
    assert of_type("COMMAND_ACK", talk.live(15.0)) == []
    talk.daemon.orders[0].answer("")
    assert [ack.result for ack in of_type("COMMAND_ACK", talk.say())] == [0]


def test_checks_before_arming(talk: Talk) -> None:
    assert talk.results(401) == [0]
    talk.daemon.show(devices={Device.DRIVE: True, Device.SCANNER: False}, reasons=(Reason.OPERATOR_STOP,))
    talk.live(1.0)
    found = talk.ask(401)
    assert [ack.result for ack in of_type("COMMAND_ACK", found)] == [1]
    assert set(joined_texts(found)) == {"The scanner is not there", "An operator has stopped the robot."}


@pytest.mark.parametrize(("to", "count"), [((1, 1), 1), ((1, 0), 1), ((0, 0), 1), ((2, 1), 0), ((1, 191), 0)])
def test_only_what_is_for_us_is_answered(talk: Talk, to: tuple[int, int], count: int) -> None:
    assert len(talk.results(410, to=to)) == count
    assert len(talk.results(400, 0.0, to=to)) == count
    assert len(talk.daemon.orders) == count


def test_our_own_packets_that_come_back_are_not_heeded() -> None:
    talk = Talk(station=Station(system=1, component=1))
    assert talk.results(400, 0.0) == []
    assert talk.daemon.orders == []


def test_two_stations_are_answered_each(talk: Talk) -> None:
    other = Station(system=254, component=230)
    found = talk.say(talk.station.command(410) + other.command(410))
    assert [(ack.target_system, ack.target_component) for ack in of_type("COMMAND_ACK", found)] == [
        (255, 190),
        (254, 230),
    ]


def test_pending_commands_are_bounded(talk: Talk) -> None:
    found = []
    for system in range(200, 220):
        found += talk.say(Station(system=system).command(400, 1.0))
    assert [ack.result for ack in of_type("COMMAND_ACK", found)] == [1] * 12
    assert len(talk.daemon.orders) == 8
