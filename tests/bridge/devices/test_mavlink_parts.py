"""Tests of a vehicle's reports, its position, and the time of signed packets: without a line."""

import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robosc_bridge.devices.interface import Pose, Velocity
from robosc_bridge.devices.mavlink_odometry import VehicleOdometry, estimate
from robosc_bridge.devices.mavlink_state import Timestamped, VehicleState
from robosc_bridge.protocol.mavlink_messages import (
    Answer,
    Attitude,
    BatteryState,
    Content,
    Heartbeat,
    LocalPosition,
    Message,
    MotionEstimate,
    Text,
)
from robosc_bridge.protocol.mavlink_signing import Signing, SigningError

OWN = (254, 191)
ROVER = Heartbeat(10, 3, False, 0)


def _after(*contents: Content, state: VehicleState | None = None, system: int = 1, component: int = 1) -> VehicleState:
    state = VehicleState() if state is None else state
    for time_s, content in enumerate(contents):
        state = state.after(Message(system, component, content), float(time_s), OWN)
    return state


def test_the_first_rover_is_the_vehicle_and_stays_it() -> None:
    state = _after(Heartbeat(6, 8, False, 0), Heartbeat(10, 12, False, 0), ROVER)
    assert (state.system, state.component) == (1, 1)
    assert state.stranger == Heartbeat(10, 12, False, 0)
    other = _after(Heartbeat(10, 3, True, 15), Attitude(1.0, 1.0, 1.0), state=state, system=2)
    assert other.heartbeat == state.heartbeat
    assert other.attitude is None
    assert _after(ROVER, state=VehicleState(2)).heartbeat is None


def test_a_component_without_autopilot_is_no_stranger() -> None:
    assert _after(Heartbeat(18, 8, False, 0), component=191).stranger is None


def test_answers_to_others_are_none_of_ours() -> None:
    state = _after(ROVER, Answer(400, 4, 255, 191), Answer(400, 4, 254, 1))
    assert state.answers == {}
    assert _after(Answer(400, 0, 0, 0), state=state).answers[400].content.result == 0


def test_batteries_are_kept_apart() -> None:
    main, pack = BatteryState(True, None, 0.5), BatteryState(False, 12.0, None)
    second, later = BatteryState(False, 5.0, 0.1, 3, 1), BatteryState(False, 5.1, 0.2, 1, 1)
    state = _after(ROVER, main, pack, second)
    assert (state.battery, state.packs) == (main, {0: pack, 1: second})
    assert _after(later, state=state).packs == {0: pack, 1: later}


def _texts(*pieces: tuple[float, Text], until_s: float) -> list[str]:
    """Return the texts that are known at a time after these pieces came."""
    state = _after(ROVER)
    for time_s, piece in pieces:
        state = state.after(Message(1, 1, piece), time_s, OWN)
    return [report.content.text for report in state.at(until_s).texts]


BEGIN, MIDDLE, END = Text(2, b"a" * 50, 7, 0), Text(2, b"b" * 50, 7, 1), Text(2, b"c", 7, 2)
MISSING = "[a part of this text is missing]"


def test_long_texts_are_joined_in_the_order_of_their_pieces() -> None:
    whole = "a" * 50 + "b" * 50 + "c"
    assert _texts((0.0, BEGIN), (0.1, MIDDLE), until_s=1.0) == []
    assert _texts((0.0, BEGIN), (0.1, MIDDLE), (0.2, END), until_s=0.2) == [whole]
    # Datagrams overtake each other, or come twice.
    assert _texts((0.0, MIDDLE), (0.0, BEGIN), (0.0, BEGIN), (0.0, END), until_s=0.0) == [whole]
    # A text that fills its pieces ends with an empty one.
    assert _texts((0.0, BEGIN), (0.1, Text(2, b"", 7, 1)), until_s=0.1) == ["a" * 50]


def test_other_texts_between_the_pieces_hide_none() -> None:
    other, long = Text(6, b"EKF3 is using GPS"), (Text(4, b"d" * 50, 8, 0), Text(4, b"e", 8, 1))
    found = _texts((0, BEGIN), (0, other), (0, long[0]), (0, MIDDLE), (0, long[1]), (0, END), until_s=0)
    assert found == ["EKF3 is using GPS", "d" * 50 + "e", "a" * 50 + "b" * 50 + "c"]


@pytest.mark.parametrize(
    ("pieces", "text"),
    [
        ((MIDDLE, END), f"{MISSING} " + "b" * 50 + "c"),
        ((BEGIN, END), "a" * 50 + f" {MISSING} c"),
        ((BEGIN, MIDDLE), "a" * 50 + "b" * 50 + f" {MISSING}"),
        ((MIDDLE,), f"{MISSING} " + "b" * 50 + f" {MISSING}"),
    ],
    ids=["first", "middle", "last", "first and last"],
)
def test_a_text_whose_pieces_are_lost_is_shown_after_a_while_and_says_so(pieces: tuple[Text, ...], text: str) -> None:
    arrived = [(0.1 * number, piece) for number, piece in enumerate(pieces)]
    last_s = arrived[-1][0]
    assert _texts(*arrived, until_s=last_s + 0.9) == []
    assert _texts(*arrived, until_s=last_s + 1.1) == [text]
    # Any later report of the vehicle shows it, too, and nothing is shown twice.
    assert _texts(*arrived, (9.0, Text(6, b"later")), until_s=99.0) == [text, "later"]


def test_a_number_that_is_used_again_is_another_text() -> None:
    found = _texts((0.0, BEGIN), (0.1, Text(2, b"x" * 50, 7, 0)), (0.2, Text(2, b"y", 7, 1)), until_s=0.2)
    assert found == ["a" * 50 + f" {MISSING}", "x" * 50 + "y"]


def test_endless_texts_have_an_end() -> None:
    state = _after(ROVER, *[Text(2, b"x" * 50, 7, index) for index in range(200)])
    assert len(state.texts) <= 8
    assert max(len(report.content.data) for report in state.texts) <= 20 * 50 + 2 * len(MISSING) + 2
    for number in range(1, 100):
        state = state.after(Message(1, 1, Text(2, b"x" * 50, number, 0)), 200.0, OWN)
    assert len(state._unfinished) <= 8


def test_a_clock_that_goes_back_is_a_restart_and_an_overtaken_packet_is_none() -> None:
    state = _after(ROVER, Attitude(100.0, 0.0, 0.0), Attitude(99.9, 0.0, 0.0))
    assert state.restarts == 0
    assert _after(Attitude(0.5, 0.0, 0.0), Attitude(0.6, 0.0, 0.0), state=state).restarts == 1


WRAP_S = 2**32 / 1000


@pytest.mark.parametrize("overtaken", [False, True])
def test_a_clock_that_begins_anew_after_49_days_is_no_restart(overtaken: bool) -> None:
    times = [WRAP_S - 0.1, 0.05, WRAP_S - 0.05, 0.1] if overtaken else [WRAP_S - 0.1, WRAP_S - 0.05, 0.0, 0.05]
    state = _after(ROVER, *[Attitude(boot_s, 0.0, 0.0) for boot_s in times])
    assert state.restarts == 0
    # The two messages have the same clock.
    assert _after(LocalPosition(0.1, 0, 0, 0, 0), state=state).restarts == 0


@pytest.mark.parametrize("before_s", [100.0, 20 * 86400.0, 30 * 86400.0, 49 * 86400.0])
def test_a_restart_after_any_time_is_one(before_s: float) -> None:
    state = _after(ROVER, Attitude(before_s, 0.0, 0.0))
    assert _after(Attitude(0.5, 0.0, 0.0), state=state).restarts == 1


def test_reports_that_a_line_has_held_back_are_no_restart() -> None:
    state = _after(ROVER, Attitude(100.0, 0.0, 0.0), Attitude(130.0, 0.0, 0.0), Attitude(130.1, 0.0, 0.0))
    assert state.restarts == 0


def test_an_estimate_is_as_old_as_its_older_part() -> None:
    state = _after(ROVER, Attitude(1.0, math.pi / 2, 0.3))
    assert estimate(state) is None
    report = estimate(_after(LocalPosition(1.0, 2.0, 3.0, 0.1, 0.4), state=state))
    assert report is not None
    assert report.time_s == 0.0
    assert (report.content.linear_m_s, report.content.angular_rad_s) == pytest.approx((0.4, 0.3))
    motion = MotionEstimate(1.0, 2.0, 0.0, 0.0, 0.0)
    place = LocalPosition(1.0, 2.0, 3.0, 0.1, 0.4)
    both = _after(None, motion, place, state=state)
    assert estimate(both) == Timestamped(1.0, motion)
    # It comes no longer; the other estimate is another frame.
    later = _after(None, None, None, Attitude(2.0, 0.0, 0.0), place, state=both)
    found = estimate(later)
    assert found is not None
    assert found.content.resets != motion.resets


places = st.floats(-100, 100)
headings = st.floats(-3.1, 3.1)


@given(places, places, headings, st.lists(st.tuples(places, places, headings), min_size=1, max_size=5))
def test_it_is_where_it_is_seen_from_its_first_place(
    x_m: float, y_m: float, heading_rad: float, way: list[tuple[float, float, float]]
) -> None:
    odometry = VehicleOdometry().advanced(MotionEstimate(x_m, y_m, heading_rad, 0.0, 0.0))
    assert odometry.pose == Pose()
    for place in way:
        odometry = odometry.advanced(MotionEstimate(*place, 0.1, 0.2))
    last_x_m, last_y_m, last_heading_rad = way[-1]
    cosine, sine = math.cos(heading_rad), math.sin(heading_rad)
    east_m, north_m = last_x_m - x_m, last_y_m - y_m
    expected = (east_m * cosine + north_m * sine, north_m * cosine - east_m * sine)
    assert (odometry.pose.x_m, odometry.pose.y_m) == pytest.approx(expected, abs=1e-6)
    assert math.remainder(odometry.pose.heading_rad - (last_heading_rad - heading_rad), 2 * math.pi) == pytest.approx(
        0, abs=1e-9
    )
    assert -math.pi < odometry.pose.heading_rad <= math.pi
    assert odometry.velocity == Velocity(0.1, 0.2)


def test_a_reset_and_a_new_beginning_are_no_motion() -> None:
    odometry = VehicleOdometry().advanced(MotionEstimate(0, 0, 0, 0, 0)).advanced(MotionEstimate(1, 0, 0, 0, 0))
    jumped = odometry.advanced(MotionEstimate(50, 50, 2.0, 0, 0, resets=1))
    assert jumped.pose == odometry.pose
    assert jumped.rebases == 1
    assert odometry.rebased().advanced(MotionEstimate(50, 50, 2.0, 0, 0)).pose == odometry.pose
    # Ahead is where it looks now.
    moved = jumped.advanced(MotionEstimate(50 + math.cos(2.0), 50 + math.sin(2.0), 2.0, 0, 0, resets=1))
    assert (moved.pose.x_m, moved.pose.y_m) == pytest.approx((2.0, 0.0))


# The time of signed packets.


def test_no_time_is_used_twice(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    key_file = tmp_path / "key"
    key_file.write_bytes(bytes(range(32)))
    now_s = 1_500_000_000.0
    monkeypatch.setattr("time.time", lambda: now_s)
    first = Signing(key_file).begin()
    assert first.key == bytes(range(32))
    assert first.timestamp() == (1_500_000_000 - 1_420_070_400) * 100_000
    used = first.timestamp() + 3_000_000
    first.reserve(used)
    # Killed, and the computer's clock is wrong afterwards.
    now_s -= 1_000_000.0
    second = Signing(key_file).begin()
    assert second.timestamp() > used
    far = second.timestamp() + 2**40
    second.reserve(far)
    assert Signing(key_file).begin().timestamp() > far
    assert sorted(path.name for path in tmp_path.iterdir()) == ["key", "key.timestamp"]


@pytest.mark.parametrize("key", [b"", b"x" * 31, b"zz" * 32, b"00" * 31])
def test_a_key_of_another_length_is_reported(tmp_path: Path, key: bytes) -> None:
    (tmp_path / "key").write_bytes(key)
    with pytest.raises(SigningError, match="is 32 bytes, or 64 hexadecimal digits, not "):
        Signing(tmp_path / "key").begin()


def test_a_missing_key_and_a_time_that_cannot_be_kept_are_reported(tmp_path: Path) -> None:
    with pytest.raises(SigningError, match="cannot be read: No such file"):
        Signing(tmp_path / "none").begin()
    (tmp_path / "key").write_text("00" * 32 + "\n")
    (tmp_path / "key.timestamp").write_text("soon")
    with pytest.raises(SigningError, match="time of the last signed packet cannot be read"):
        Signing(tmp_path / "key").begin()
    (tmp_path / "key.timestamp").unlink()
    (tmp_path / "key.timestamp.new").mkdir()
    with pytest.raises(SigningError, match="cannot be kept"):
        Signing(tmp_path / "key").begin()
