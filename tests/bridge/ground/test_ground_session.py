"""A conversation with a ground station, on a clock that the test sets."""

import math
from dataclasses import dataclass, field
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as dialect

from robosc_bridge.daemon.programs import Attached, Detached, Refused, Requested
from robosc_bridge.daemon.reports import Device
from robosc_bridge.daemon.states import Command, State
from robosc_bridge.devices.interface import Velocity
from robosc_bridge.ground.session import Session
from robosc_bridge.ground.settings import GroundSettings
from robosc_bridge.safety import Reason
from support.ground import CONFIGURATION, PlayedDaemon, Station, joined_texts, of_type, reading_of, scan_of

BEGIN_S = 100.0
FASTEST = Velocity(0.2, 2.0)
OPEN = GroundSettings("udpin:127.0.0.1:0", FASTEST, obeys_unsigned=True)


@dataclass
class Talk:
    """A session with a station, both played."""

    daemon: PlayedDaemon = field(default_factory=PlayedDaemon)
    settings: GroundSettings = OPEN
    station: Station = field(default_factory=Station)
    now_s: float = BEGIN_S

    def __post_init__(self) -> None:
        self.session = Session(self.daemon.operations, self.settings, self.now_s)

    def say(self, data: bytes = b"", after_s: float = 0.0) -> list[Any]:
        """What is answered."""
        self.now_s += after_s
        return self.station.hear(self.session.step(self.now_s, data))

    def live(self, seconds: float, step_s: float = 0.05, *, is_fresh: bool = True) -> list[Any]:
        """What comes within some time, while the loop turns or hangs."""
        found = []
        for _ in range(round(seconds / step_s)):
            if is_fresh:
                self.daemon.show()
            found += self.say(after_s=step_s)
        return found

    def ask(self, number: int, *parameters: float, **how: Any) -> list[Any]:
        return self.say(self.station.command(number, *parameters, **how))

    def results(self, number: int, *parameters: float, **how: Any) -> list[int]:
        return [item.result for item in of_type("COMMAND_ACK", self.ask(number, *parameters, **how))]


@pytest.fixture
def talk() -> Talk:
    found = Talk()
    found.say()
    return found


def _layer(**values: Any) -> Talk:
    found = Talk(PlayedDaemon(is_layer=True))
    found.daemon.show(state=State.RUNNING, **values)
    found.say()
    return found


# Heartbeat.


def test_a_heartbeat_comes_each_second(talk: Talk) -> None:
    beats = of_type("HEARTBEAT", talk.live(10.02, 0.03))
    assert len(beats) == 10
    assert (beats[0].type, beats[0].autopilot, beats[0].get_srcSystem(), beats[0].get_srcComponent()) == (10, 0, 1, 1)


def test_a_loop_that_hangs_is_told_and_then_the_heartbeat_ends(talk: Talk) -> None:
    talk.daemon.show(state=State.RUNNING, reading=reading_of(), scan=scan_of({}))
    found = talk.live(2.0, is_fresh=False)
    assert {beat.system_status for beat in of_type("HEARTBEAT", found)} == {4}
    assert joined_texts(talk.live(0.1, is_fresh=False)) == ["The bridge's loop does not turn."]
    found = talk.live(3.0, is_fresh=False)
    assert {beat.system_status for beat in of_type("HEARTBEAT", found)} == {6}
    assert of_type("SYS_STATUS", talk.live(1.0, is_fresh=False)) == []
    assert of_type("HEARTBEAT", talk.live(3.0, is_fresh=False)) == []
    # Nor does anything start, which could happen later then.
    assert talk.results(400, 1.0) == [1]
    assert talk.daemon.orders == []
    assert {beat.system_status for beat in of_type("HEARTBEAT", talk.live(2.0))} == {4}


def test_the_end_is_told(talk: Talk) -> None:
    talk.daemon.show(state=State.OVER)
    found = talk.station.hear(talk.session.end(talk.now_s))
    assert of_type("HEARTBEAT", found)[-1].system_status == 7
    assert not talk.daemon.feed.is_watched


# Telemetry.


def test_telemetry_comes_as_often_as_it_should(talk: Talk) -> None:
    found = []
    for _ in range(200):
        talk.daemon.show(reading=reading_of(talk.now_s, battery_v=12.0), scan=scan_of({0: 1.0}, talk.now_s))
        found += talk.say(after_s=0.05)
    counts = {
        name: len(of_type(name, found)) for name in ("ODOMETRY", "OBSTACLE_DISTANCE", "SYS_STATUS", "BATTERY_STATUS")
    }
    assert counts["ODOMETRY"] == pytest.approx(100, abs=2)
    assert counts["OBSTACLE_DISTANCE"] == pytest.approx(100, abs=2)
    assert counts["SYS_STATUS"] == pytest.approx(10, abs=1)
    assert counts["BATTERY_STATUS"] == pytest.approx(5, abs=1)


def test_what_is_old_is_not_told(talk: Talk) -> None:
    talk.daemon.show(reading=reading_of(BEGIN_S), scan=scan_of({0: 1.0}, BEGIN_S))
    assert len(of_type("OBSTACLE_DISTANCE", talk.live(0.6))) in (4, 5, 6)
    assert of_type("OBSTACLE_DISTANCE", talk.live(0.6)) == []
    assert of_type("ODOMETRY", talk.live(1.0)) == []


def test_intervals_can_be_changed_within_bounds(talk: Talk) -> None:
    def odometry(seconds: float) -> int:
        found = []
        for _ in range(round(seconds / 0.01)):
            talk.daemon.show(reading=reading_of(talk.now_s))
            found += talk.say(after_s=0.01)
        return len(of_type("ODOMETRY", found))

    assert talk.results(511, 331, 1.0) == [0]
    assert odometry(1.0) == pytest.approx(50, abs=2)
    assert talk.results(511, 331, -1) == [0]
    assert odometry(1.0) == 0
    assert talk.results(511, 331, 0) == [0]
    assert odometry(1.0) == pytest.approx(10, abs=1)
    assert talk.results(511, 0, 5e6) == [2]
    assert talk.results(511, 245, 1e6) == [3]
    assert talk.results(511, 30, 1e5) == [0]
    talk.daemon.show(reading=reading_of(talk.now_s))
    assert of_type("ATTITUDE", talk.say(after_s=0.01))


def test_a_slow_line_is_not_filled_and_nothing_is_left_out() -> None:
    talk = Talk(settings=GroundSettings("/dev/radio", FASTEST, baud=9600))
    sent = 0
    for _ in range(600):
        talk.daemon.show(reading=reading_of(talk.now_s), scan=scan_of({0: 1.0}, talk.now_s))
        data = talk.session.step(talk.now_s)
        sent += len(data)
        talk.station.hear(data)
        talk.now_s += 0.05
    assert sent / 30.0 < 960 * 0.75
    assert len(of_type("HEARTBEAT", talk.station.heard)) == 30
    for name in ("ODOMETRY", "OBSTACLE_DISTANCE", "SYS_STATUS", "NAMED_VALUE_INT"):
        assert len(of_type(name, talk.station.heard)) >= 15, name


def test_named_values_come_at_once_when_they_change_and_every_second(talk: Talk) -> None:
    component = {"state": "down", "variables": {"load": "light", "is_full": False, "count": 3, "weight_of_all": 1.5}}
    talk.live(0.5)
    talk.daemon.show(components={"Lift": component})
    found = talk.say(after_s=0.05)
    assert {item.name: item.value for item in of_type("NAMED_VALUE_INT", found)} == {
        "Lift": 0,
        "Lift.load": 1,
        "Lift.i~a7l": 0,
        "Lift.count": 3,
    }
    assert [(item.name, item.value) for item in of_type("NAMED_VALUE_FLOAT", found)] == [("Lift.w~d5a", 1.5)]
    talk.daemon.show(components={"Lift": {**component, "state": "up"}}, state=State.RUNNING)
    found = talk.say(after_s=0.11)
    assert {item.name: item.value for item in of_type("NAMED_VALUE_INT", found)} == {"Lift": 1, "sup_state": 2}
    names = [item.name for item in of_type("NAMED_VALUE_INT", talk.live(5.0))]
    assert set(names) == {"sup_state", "blocked", "Lift", "Lift.load", "Lift.i~a7l", "Lift.count"}
    assert {names.count(name) for name in names} <= {4, 5}


def test_a_message_can_be_asked_for(talk: Talk) -> None:
    talk.live(0.2)
    found = talk.ask(512, 148)
    assert [item.get_type() for item in found if item.get_type() in ("COMMAND_ACK", "AUTOPILOT_VERSION")] == [
        "COMMAND_ACK",
        "AUTOPILOT_VERSION",
    ]
    (version,) = of_type("AUTOPILOT_VERSION", found)
    assert version.capabilities == 0x2000 | 0x8 | 0x800
    assert of_type("AUTOPILOT_VERSION", talk.ask(520, 1))
    assert talk.results(512, 242) == [3]
    assert talk.results(512, 147) == [1]
    assert talk.results(512, 331) == [1]
    talk.daemon.show(reading=reading_of(talk.now_s))
    talk.say()
    assert of_type("ATTITUDE", talk.ask(512, 30))
    assert of_type("HEARTBEAT", talk.ask(512, 0))
    assert {item.name for item in of_type("NAMED_VALUE_INT", talk.ask(512, 252))} >= {"sup_state", "blocked"}


# Texts.


def test_what_happens_is_told_in_words(talk: Talk) -> None:
    talk.live(0.2)
    talk.daemon.show(state=State.RUNNING)
    assert joined_texts(talk.live(0.2)) == ["Running: armed"]
    talk.daemon.write(kind="blocked", identifier="/cmd_vel", why="the lift is up, and with a long reason that is cut")
    talk.daemon.write(kind="event", event="drive.request")
    assert joined_texts(talk.live(0.2)) == ["Held back: /cmd_vel: the lift is up, and with a long reason that is cut"]
    talk.daemon.show(devices={Device.DRIVE: True, Device.SCANNER: False})
    assert joined_texts(talk.live(0.2)) == ["The scanner is not there"]
    talk.daemon.show(devices={Device.DRIVE: True, Device.SCANNER: True}, reasons=(Reason.COMMAND_SILENT,))
    assert joined_texts(talk.live(0.2)) == ["The scanner is there"]
    talk.daemon.show(state=State.FAULT, problem="a motor is hot", reasons=(Reason.MOTOR_FAULT,))
    assert joined_texts(talk.live(0.5)) == ["a motor is hot", "A motor tells of a fault.", "Stopped by a fault"]
    assert joined_texts(talk.live(19.0)) == []
    assert joined_texts(talk.live(2.0)) == ["a motor is hot", "A motor tells of a fault."]


def test_a_safe_stop_is_told_and_its_end_and_no_ordinary_end(talk: Talk) -> None:
    talk.daemon.show(state=State.RUNNING)
    talk.live(0.2)
    talk.daemon.show(stops=("/scan is stale",))
    assert joined_texts(talk.live(0.2)) == ["Stopped: /scan is stale"]
    talk.daemon.show(stops=())
    assert joined_texts(talk.live(0.2)) == ["It goes on"]
    talk.daemon.show(state=State.STOPPING, stops=("standby",))
    assert joined_texts(talk.live(0.2)) == ["Stopping"]
    talk.daemon.write(kind="fault", what="division by zero")
    assert joined_texts(talk.live(0.2)) == ["Fault: division by zero"]


@pytest.mark.parametrize("obeys", [True, False])
def test_a_fault_is_told_while_somebody_sends_nonsense(obeys: bool) -> None:
    talk = Talk(settings=GroundSettings("udpin:0.0.0.0:0", FASTEST, obeys_unsigned=obeys))
    for tick in range(100):
        talk.daemon.show()
        if tick == 50:
            talk.daemon.write(kind="fault", what="it burns")
            talk.daemon.show(state=State.FAULT, problem="no drive")
        nonsense = b"".join(talk.station.command(400, tick * 10 + value + 2) for value in range(4))
        talk.say(nonsense, after_s=0.05)
        if tick == 60:
            # Half a second later.
            assert {"Fault: it burns", "Stopped by a fault", "no drive"} <= set(joined_texts(talk.station.heard))


def test_a_station_that_comes_later_is_told_what_holds(talk: Talk) -> None:
    talk.daemon.show(state=State.FAULT, problem="a motor is hot")
    assert "a motor is hot" in joined_texts(talk.live(1.0))
    found = talk.say(talk.station.heartbeat())
    assert "a motor is hot" in joined_texts(found + talk.live(1.0))


def test_blocked_requests_are_counted_and_told_once(talk: Talk) -> None:
    texts = []
    for _ in range(100):
        talk.daemon.write(kind="blocked", identifier="/cmd_vel", why="no")
        texts += joined_texts(talk.live(0.05))
    assert texts.count("Held back: /cmd_vel: no") == 1
    values = [item.value for item in of_type("NAMED_VALUE_INT", talk.live(1.0)) if item.name == "blocked"]
    assert values[-1] == 100


# Commands.


def test_arming_is_answered_when_it_is_done(talk: Talk) -> None:
    assert talk.results(400, 1.0) == []
    assert talk.daemon.commands == [Command.START]
    assert talk.daemon.orders[0].by == "MAVLink 255/190"
    assert of_type("COMMAND_ACK", talk.live(0.5)) == []
    talk.daemon.orders[0].answer("")
    (ack,) = of_type("COMMAND_ACK", talk.live(0.5))
    assert (ack.command, ack.result, ack.target_system, ack.target_component) == (400, 0, 255, 190)


def test_a_refusal_comes_after_its_reason(talk: Talk) -> None:
    talk.daemon.answers[Command.START] = "the robot is starting: no scanner"
    found = talk.ask(400, 1.0)
    assert [item.get_type() for item in found if item.get_type() in ("STATUSTEXT", "COMMAND_ACK")] == [
        "STATUSTEXT",
        "COMMAND_ACK",
    ]
    assert joined_texts(found) == ["Not armed: the robot is starting: no scanner"]
    assert of_type("COMMAND_ACK", found)[0].result == 1
    # Whoever asks again is told again.
    assert joined_texts(talk.ask(400, 1.0)) == ["Not armed: the robot is starting: no scanner"]


def test_a_repeated_command_is_done_once(talk: Talk) -> None:
    assert talk.results(400, 1.0) == []
    assert talk.results(400, 1.0, confirmation=1) == [5]
    talk.daemon.orders[0].answer("")
    assert [ack.result for ack in of_type("COMMAND_ACK", talk.say())] == [0]
    assert talk.results(400, 1.0, confirmation=2) == [0]
    assert talk.daemon.commands == [Command.START]
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
    assert talk.daemon.commands == [Command.START, Command.STANDBY]
    # A late answer concerns nobody.
    talk.daemon.orders[0].answer("")
    assert of_type("COMMAND_ACK", talk.live(1.0)) == []


@pytest.mark.parametrize(
    ("number", "parameters", "expected"),
    [
        (400, (0.0,), Command.STANDBY),
        (400, (0.0, 21196.0), Command.STANDBY),
        (176, (1.0, 4.0), Command.STOP),
        (193, (0.0,), Command.STOP),
        (185, (1.0,), Command.STOP),
    ],
)
def test_stopping_is_done_before_it_is_answered(
    talk: Talk, number: int, parameters: tuple[float, ...], expected: Command
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
    assert talk.daemon.commands == [Command.STANDBY]
    # What starts in between is stopped all the same.
    talk.ask(400, 1.0)
    talk.ask(400, 0.0)
    assert talk.daemon.commands == [Command.STANDBY, Command.START, Command.STANDBY]
    talk.daemon.orders[1].answer("")
    talk.say()
    found = talk.say(b"".join(talk.station.command(400, wanted) for wanted in (0.0, 0.0, 1.0, 0.0, 0.0)))
    assert [ack.result for ack in of_type("COMMAND_ACK", found)] == [0] * 4
    assert talk.daemon.commands[3:] == [Command.STANDBY, Command.START, Command.STANDBY]


@pytest.mark.parametrize(("number", "parameters"), [(400, (0.0,)), (193, (0.0,)), (185, (1.0,)), (176, (1.0, 4.0))])
def test_every_stop_that_is_accepted_is_ordered(talk: Talk, number: int, parameters: tuple[float, ...]) -> None:
    # Another face may have resumed or started in between, which this one has not seen.
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
    # As a command of its own it is done; and so is a repetition long after the stop.
    assert talk.results(*change) == []
    assert len(talk.daemon.orders) == orders + 1
    talk.daemon.orders[-1].answer("no")
    talk.say()
    talk.live(10.1)
    assert talk.results(*change, confirmation=1) == []


def test_what_others_have_stopped_is_not_accepted_again(talk: Talk) -> None:
    talk.daemon.answers = {Command.START: "", Command.RESUME: ""}
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
    assert talk.daemon.commands == [Command.START, Command.RESUME]


def test_a_stop_does_not_wait_behind_a_packet_that_was_cut(talk: Talk) -> None:
    long = bytes.fromhex("fd ff 00 00 05 ff be 6e 00 00")
    for cut in (long, long * 3, b"\xfd", talk.station.command(400, 1.0)[:20]):
        talk.daemon.orders.clear()
        found = talk.say(cut + talk.station.command(400, 0.0)) + talk.say(after_s=0.02) + talk.say(after_s=0.04)
        assert [ack.result for ack in of_type("COMMAND_ACK", found)] == [0]
        assert talk.daemon.commands == [Command.STANDBY]


def test_a_packet_that_comes_slowly_comes(talk: Talk) -> None:
    for byte in talk.station.command(400, 0.0):
        assert talk.daemon.orders == []
        talk.say(bytes((byte,)))
        talk.say(after_s=0.06)
    assert talk.daemon.commands == [Command.STANDBY]


def test_a_flood_of_others_is_bounded(talk: Talk) -> None:
    talk.daemon.answers[Command.START] = "no"
    found = talk.say(b"".join(talk.station.command(410) for _ in range(1000)))
    assert len(of_type("COMMAND_ACK", found)) == 200
    assert talk.results(400, 1.0) == []
    assert talk.results(400, 0.0) == [0]
    talk.live(1.0)
    assert talk.results(410) == [3]


def test_modes(talk: Talk) -> None:
    # Nothing is stopped: nothing is to be done, and a mode arms nothing.
    assert talk.results(176, 1.0, 10.0) == [0]
    assert talk.daemon.orders == []
    talk.daemon.show(state=State.RUNNING, reasons=(Reason.OPERATOR_STOP,))
    assert {beat.custom_mode for beat in of_type("HEARTBEAT", talk.live(1.1))} == {4}
    assert talk.results(176, 1.0, 10.0) == []
    assert talk.daemon.commands == [Command.RESUME]
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
    assert talk.daemon.commands == [Command.STOP, Command.RESUME]
    talk.daemon.orders[1].answer("the stop has not reached the motors yet")
    assert [ack.result for ack in of_type("COMMAND_ACK", talk.say())] == [1]


def test_a_stop_that_must_hold_is_told(talk: Talk) -> None:
    talk.daemon.show(state=State.RUNNING, reasons=(Reason.OPERATOR_STOP,))
    talk.daemon.answers[Command.RESUME] = "the stop button is held"
    talk.say()
    found = talk.ask(193, 1.0)
    assert [ack.result for ack in of_type("COMMAND_ACK", found)] == [1]
    assert "Not resumed: the stop button is held" in joined_texts(found)


def test_the_old_message_for_modes(talk: Talk) -> None:
    library = talk.station.codec
    found = talk.say(talk.station.pack(library.set_mode_encode(1, 1, 4)))
    assert [(ack.command, ack.result) for ack in of_type("COMMAND_ACK", found)] == [(11, 0)]
    assert talk.daemon.commands == [Command.STOP]
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
    assert talk.daemon.commands == [Command.RESET]
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


# What stations ask when they connect.


def test_what_stations_ask_is_answered(talk: Talk) -> None:
    station, library = talk.station, talk.station.codec
    found = talk.say(station.pack(library.param_request_list_encode(1, 1)))
    parameters = [(item.param_id, item.param_index, item.param_count) for item in of_type("PARAM_VALUE", found)]
    assert parameters == [("SYSID_THISMAV", 0, 2), ("SR_INTERVAL", 1, 2)]
    for name, index in ((b"SYSID_THISMAV", -1), (b"", 0)):
        (value,) = of_type("PARAM_VALUE", talk.say(station.pack(library.param_request_read_encode(1, 1, name, index))))
        assert (value.param_id, value.param_value, value.param_type) == ("SYSID_THISMAV", 1.0, 9)
    assert of_type("PARAM_VALUE", talk.say(station.pack(library.param_request_read_encode(1, 1, b"NONE", -1)))) == []
    (value,) = of_type("PARAM_VALUE", talk.say(station.pack(library.param_set_encode(1, 1, b"SR_INTERVAL", 9.0, 9))))
    assert value.param_value == pytest.approx(0.1)
    (count,) = of_type("MISSION_COUNT", talk.say(station.pack(library.mission_request_list_encode(1, 1, 2))))
    assert (count.count, count.target_system, count.mission_type) == (0, 255, 2)
    (ping,) = of_type("PING", talk.say(station.pack(library.ping_encode(77, 5, 0, 0))))
    assert (ping.time_usec, ping.seq, ping.target_system, ping.target_component) == (77, 5, 255, 190)
    assert of_type("PING", talk.say(station.pack(library.ping_encode(77, 5, 1, 1)))) == []
    (sync,) = of_type("TIMESYNC", talk.say(station.pack(library.timesync_encode(0, 1234))))
    assert (sync.ts1, sync.tc1) == (1234, round(BEGIN_S * 1e9))
    assert of_type("TIMESYNC", talk.say(station.pack(library.timesync_encode(5, 1234)))) == []
    payload = [9, 0, 3, 4, 0, 0, 0, 0, 1, 2, 3, 4] + [0] * 239
    (refused,) = of_type(
        "FILE_TRANSFER_PROTOCOL", talk.say(station.pack(library.file_transfer_protocol_encode(0, 1, 1, payload)))
    )
    assert refused.payload[:13] == [10, 0, 3, 129, 1, 4, 0, 0, 1, 2, 3, 4, 7]


# The station itself.


def test_the_operator_is_seen_and_lost(talk: Talk) -> None:
    for _ in range(5):
        talk.say(talk.station.heartbeat(), after_s=1.0)
        talk.daemon.show()
    assert talk.daemon.seen == 5
    assert "The ground station is lost." not in joined_texts(talk.live(4.9))
    assert joined_texts(talk.live(0.3)).count("The ground station is lost.") == 1
    assert joined_texts(talk.live(30.0)) == []


def test_only_ground_stations_are_operators(talk: Talk) -> None:
    library = talk.station.codec
    talk.say(talk.station.pack(library.heartbeat_encode(18, 8, 0, 0, 4)))
    talk.say(talk.station.command(410))
    assert talk.daemon.seen == 0


# Driving by hand.


def _target(station: Station, speed_m_s: float, turn_rad_s: float = 0.0) -> bytes:
    zeros = (0.0, 0.0, 0.0)
    library = station.codec
    return station.pack(
        library.set_position_target_local_ned_encode(
            0, 1, 1, 8, 0x05E7, *zeros, speed_m_s, 0.0, 0.0, *zeros, 0.0, turn_rad_s
        )
    )


def _requested(talk: Talk) -> list[tuple[float, float]]:
    return [
        (item.data["linear"]["x"], item.data["angular"]["z"])
        for item in talk.daemon.told
        if isinstance(item, Requested)
    ]


def test_a_layer_is_asked_for_motion() -> None:
    talk = _layer()
    talk.say(_target(talk.station, 0.125, 0.5))
    attached, requested = talk.daemon.told
    assert isinstance(attached, Attached)
    assert attached.program.may_request
    assert isinstance(requested, Requested)
    assert (requested.program, requested.identifier) == (attached.program, "/cmd_vel")
    assert _requested(talk) == [(0.125, -0.5)]
    stick = talk.station.codec.manual_control_encode(1, 500, 0, 0, -250, 0)
    talk.say(talk.station.pack(stick), after_s=0.1)
    assert _requested(talk)[1:] == [(0.1, 0.5)]


def test_who_no_longer_drives_stands_still_within_half_a_second() -> None:
    talk = _layer()
    talk.say(_target(talk.station, 0.125))
    assert len(talk.daemon.told) == 2
    talk.live(0.45)
    assert len(talk.daemon.told) == 2
    found = talk.live(0.1)
    assert _requested(talk) == [(0.125, 0.0), (0.0, 0.0)]
    assert isinstance(talk.daemon.told[-1], Detached)
    assert "No set-point any more: the robot stands." in joined_texts(found)
    talk.live(2.0)
    assert len(talk.daemon.told) == 4
    # And again.
    talk.say(_target(talk.station, 0.125))
    assert isinstance(talk.daemon.told[4], Attached)


def test_a_line_that_is_lost_ends_driving_at_once() -> None:
    talk = _layer()
    talk.say(_target(talk.station, 0.125))
    talk.session.lost()
    assert _requested(talk) == [(0.125, 0.0), (0.0, 0.0)]
    assert isinstance(talk.daemon.told[-1], Detached)


def test_a_stick_at_rest_ends_in_silence() -> None:
    talk = _layer()
    talk.say(_target(talk.station, 0.0))
    found = talk.live(1.0)
    assert _requested(talk) == [(0.0, 0.0)]
    assert isinstance(talk.daemon.told[-1], Detached)
    assert [text for text in joined_texts(found) if "set-point" in text] == []


@pytest.mark.parametrize(
    ("is_layer", "values", "why"),
    [
        (False, {"state": State.RUNNING}, "this supervisor drives by itself"),
        (True, {"state": State.STANDBY}, "The robot is not armed"),
        (True, {"state": State.RUNNING, "reasons": (Reason.OPERATOR_STOP,)}, "An operator has stopped the robot"),
    ],
)
def test_set_points_that_are_not_heeded_are_told_once(is_layer: bool, values: dict[str, Any], why: str) -> None:
    talk = Talk(PlayedDaemon(is_layer=is_layer))
    talk.daemon.show(**values)
    talk.live(1.0)
    texts = []
    for _ in range(20):
        texts += joined_texts(talk.say(_target(talk.station, 0.1), after_s=0.1))
        talk.daemon.show()
    assert len([text for text in texts if why in text and "set-points" in text.lower()]) == 1
    assert talk.daemon.told == []


def test_a_layer_whose_drive_is_not_tied_is_not_driven() -> None:
    talk = Talk(PlayedDaemon(is_layer=True, configuration=CONFIGURATION.replace("channel: drive", "channel: log")))
    talk.daemon.show(state=State.RUNNING)
    assert any("whose drive is tied" in text for text in joined_texts(talk.say(_target(talk.station, 0.1))))
    assert talk.daemon.told == []


def test_what_a_layer_refuses_is_told() -> None:
    talk = _layer()
    talk.say(_target(talk.station, 0.1))
    attached = talk.daemon.told[0]
    assert isinstance(attached, Attached)
    attached.program.tell(Refused("somebody else drives"))
    assert "somebody else drives" in joined_texts(talk.live(0.2))


# Whatever comes.


def test_the_worked_arming_is_answered_byte_for_byte() -> None:
    talk = Talk(settings=GroundSettings("udpin:127.0.0.1:0", FASTEST, component=191, obeys_unsigned=True))
    talk.daemon.answers[Command.START] = ""
    for _ in range(7):
        talk.session._codec.encode(lambda library: library.heartbeat_encode(10, 0, 0, 0, 0))
    arm = bytes.fromhex("fd 20 00 00 00 ff be 4c 00 00 00 00 80 3f" + " 00" * 24 + " 90 01 01 bf e0 ee")
    # What it says by itself comes beside it.
    talk.session._texts._bucket.take(100.0)
    found = talk.session.step(talk.now_s, arm)
    assert found[:22].hex(" ") == "fd 0a 00 00 07 01 bf 4d 00 00 90 01 00 00 00 00 00 00 ff be 90 1a"


@settings(max_examples=60, deadline=None)
@given(st.lists(st.binary(max_size=300), max_size=8), st.booleans())
def test_garbage_is_dropped(pieces: list[bytes], is_datagram: bool) -> None:
    talk = Talk()
    for piece in pieces:
        talk.session.step(talk.now_s, b"\xfd" + piece, is_datagram=is_datagram)
        talk.session.overheard(talk.now_s, b"\xfd" + piece)
    assert talk.daemon.orders == []
    talk.session.lost()
    found = talk.station.hear(talk.session.step(talk.now_s, talk.station.command(400, 0.0)))
    assert len(of_type("COMMAND_ACK", found)) == 1


_HEEDED = (0, 4, 11, 20, 21, 23, 43, 69, 75, 76, 84, 110, 111)


@settings(max_examples=150, deadline=None)
@given(st.sampled_from(_HEEDED), st.binary(max_size=255), st.booleans())
def test_any_contents_of_any_message_are_survived(number: int, payload: bytes, is_layer: bool) -> None:
    talk = Talk(PlayedDaemon(is_layer=is_layer))
    talk.daemon.show(state=State.RUNNING)
    talk.say()
    head = bytes((0xFD, len(payload), 0, 0, 0, 255, 190)) + number.to_bytes(3, "little")
    checksum = dialect.x25crc(bytearray(head[1:] + payload + bytes((dialect.mavlink_map[number].crc_extra,)))).crc
    packet = head + payload + checksum.to_bytes(2, "little")
    talk.session.step(talk.now_s, packet, is_datagram=True)
    talk.session.step(talk.now_s, packet)
    talk.session.overheard(talk.now_s, packet)
    for item in talk.daemon.told:
        if isinstance(item, Requested):
            assert all(map(math.isfinite, (item.data["linear"]["x"], item.data["angular"]["z"])))
