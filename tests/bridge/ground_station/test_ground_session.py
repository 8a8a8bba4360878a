"""A conversation with a ground station, on a clock that the test sets."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as dialect

from robosc_bridge.daemon.programs.items import MessageRequested
from robosc_bridge.daemon.states import OperatorCommand, State
from robosc_bridge.daemon.threads.reports import Device
from robosc_bridge.ground_station.settings import GroundSettings
from robosc_bridge.safety import Reason
from support.effort import examples
from support.ground import PlayedDaemon, joined_texts, of_type, reading_of, scan_of
from support.ground_talk import BEGIN_S, FASTEST, Talk

# Heartbeat.


def test_a_heartbeat_comes_each_second(talk: Talk) -> None:
    beats = of_type("HEARTBEAT", talk.live(10.02, 0.03))
    assert len(beats) == 10
    assert (beats[0].type, beats[0].autopilot, beats[0].get_srcSystem(), beats[0].get_srcComponent()) == (10, 0, 1, 1)


def test_a_loop_that_hangs_is_reported_and_then_the_heartbeat_ends(talk: Talk) -> None:
    talk.daemon.show(state=State.RUNNING, reading=reading_of(), scan=scan_of({}))
    found = talk.live(2.0, is_fresh=False)
    assert {beat.system_status for beat in of_type("HEARTBEAT", found)} == {4}
    assert joined_texts(talk.live(0.1, is_fresh=False)) == ["The bridge's loop hangs."]
    found = talk.live(3.0, is_fresh=False)
    assert {beat.system_status for beat in of_type("HEARTBEAT", found)} == {6}
    assert of_type("SYS_STATUS", talk.live(1.0, is_fresh=False)) == []
    assert of_type("HEARTBEAT", talk.live(3.0, is_fresh=False)) == []
    # Nor does anything start, which could happen later then.
    assert talk.results(400, 1.0) == [1]
    assert talk.daemon.orders == []
    assert {beat.system_status for beat in of_type("HEARTBEAT", talk.live(2.0))} == {4}


def test_the_end_is_reported(talk: Talk) -> None:
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


def test_what_is_old_is_not_sent(talk: Talk) -> None:
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


def test_what_happens_is_sent_in_words(talk: Talk) -> None:
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
    assert joined_texts(talk.live(0.5)) == ["a motor is hot", "A motor reports a fault.", "Stopped by a fault"]
    assert joined_texts(talk.live(19.0)) == []
    assert joined_texts(talk.live(2.0)) == ["a motor is hot", "A motor reports a fault."]


def test_a_safe_stop_is_reported_and_its_end_and_no_ordinary_end(talk: Talk) -> None:
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


@pytest.mark.parametrize("accepts_unsigned", [True, False])
def test_a_fault_is_reported_while_somebody_sends_nonsense(accepts_unsigned: bool) -> None:
    talk = Talk(settings=GroundSettings("udpin:0.0.0.0:0", FASTEST, accepts_unsigned=accepts_unsigned))
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


def test_a_station_that_comes_later_receives_what_holds(talk: Talk) -> None:
    talk.daemon.show(state=State.FAULT, problem="a motor is hot")
    assert "a motor is hot" in joined_texts(talk.live(1.0))
    found = talk.say(talk.station.heartbeat())
    assert "a motor is hot" in joined_texts(found + talk.live(1.0))


def test_blocked_requests_are_counted_and_reported_once(talk: Talk) -> None:
    texts = []
    for _ in range(100):
        talk.daemon.write(kind="blocked", identifier="/cmd_vel", why="no")
        texts += joined_texts(talk.live(0.05))
    assert texts.count("Held back: /cmd_vel: no") == 1
    values = [item.value for item in of_type("NAMED_VALUE_INT", talk.live(1.0)) if item.name == "blocked"]
    assert values[-1] == 100


# Questions of stations that connect.


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


# Bytes of the line.


def test_the_worked_arming_is_answered_byte_for_byte() -> None:
    talk = Talk(settings=GroundSettings("udpin:127.0.0.1:0", FASTEST, component=191, accepts_unsigned=True))
    talk.daemon.answers[OperatorCommand.START] = ""
    for _ in range(7):
        talk.session._codec.encode(lambda library: library.heartbeat_encode(10, 0, 0, 0, 0))
    arm = bytes.fromhex("fd 20 00 00 00 ff be 4c 00 00 00 00 80 3f" + " 00" * 24 + " 90 01 01 bf e0 ee")
    # Texts of its own come beside the answer.
    talk.session._texts._bucket.take(100.0)
    found = talk.session.step(talk.now_s, arm)
    assert found[:22].hex(" ") == "fd 0a 00 00 07 01 bf 4d 00 00 90 01 00 00 00 00 00 00 ff be 90 1a"


@settings(max_examples=examples(40))
@given(st.lists(st.binary(max_size=300), max_size=8), st.booleans())
def test_garbage_is_dropped(pieces: list[bytes], is_datagram: bool) -> None:
    talk = Talk()
    for piece in pieces:
        talk.session.step(talk.now_s, b"\xfd" + piece, is_datagram=is_datagram)
        talk.session.receive_from_other(talk.now_s, b"\xfd" + piece)
    assert talk.daemon.orders == []
    talk.session.lost()
    found = talk.station.hear(talk.session.step(talk.now_s, talk.station.command(400, 0.0)))
    assert len(of_type("COMMAND_ACK", found)) == 1


_HEEDED = (0, 4, 11, 20, 21, 23, 43, 69, 75, 76, 84, 110, 111)


@settings(max_examples=examples(60))
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
    talk.session.receive_from_other(talk.now_s, packet)
    for item in talk.daemon.received:
        if isinstance(item, MessageRequested):
            assert all(map(math.isfinite, (item.data["linear"]["x"], item.data["angular"]["z"])))
