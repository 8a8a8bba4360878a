import pytest
from hypothesis import given
from hypothesis import strategies as st

from robosc_bridge.skills import EmergencyStop, EmergencyStopSettings, StopEvent

SETTINGS = EmergencyStopSettings(stop_buttons=("button_1", "bumper_1"), resume_buttons=("button_2",))
STOP, RESUME = StopEvent.STOP, StopEvent.RESUME


@pytest.mark.parametrize(
    "press",
    [{"held_buttons": ["button_1"]}, {"keys": ["x", "space"]}, {"remote": STOP}, {"held_buttons": ["bumper_1"]}],
)
@pytest.mark.parametrize("release", [{"held_buttons": ["button_2"]}, {"keys": ["r"]}, {"remote": RESUME}])
def test_every_way_stops_and_every_way_goes_on(press: dict, release: dict) -> None:  # type: ignore[type-arg]
    stop = EmergencyStop(SETTINGS)
    assert stop.update(held_buttons=[]) is None
    assert stop.update(**press) is STOP
    assert stop.is_stopped
    assert stop.update(held_buttons=[]) is None
    assert stop.update(**release) is RESUME
    assert not stop.is_stopped
    assert stop.update(held_buttons=[]) is None


def test_stop_wins_over_resume() -> None:
    stop = EmergencyStop(SETTINGS)
    assert stop.update([], ["r", "space"]) is STOP
    assert stop.update(["button_1"], ["r"]) is STOP
    assert stop.update(["button_1"], ["r"], RESUME) is None, "it is still held"
    assert stop.is_stopped


def test_a_held_button_tells_once_and_each_press_anew() -> None:
    stop = EmergencyStop(SETTINGS)
    told = [stop.update(held) for held in (["button_1"], ["button_1"], [], ["button_1"])]
    assert told == [STOP, None, None, STOP]


def test_a_second_stop_button_tells_again() -> None:
    stop = EmergencyStop(SETTINGS)
    assert stop.update(["button_1"]) is STOP
    assert stop.update(["button_1", "bumper_1"]) is STOP


def test_a_jammed_resume_button_lets_nothing_go_on() -> None:
    stop = EmergencyStop(SETTINGS)
    assert stop.update(["button_2"]) is None
    assert stop.update(["button_2", "button_1"]) is STOP
    assert stop.update(["button_2"]) is None
    assert stop.is_stopped


def test_a_resume_button_that_jammed_before_it_was_seen_lets_nothing_go_on() -> None:
    stop = EmergencyStop(SETTINGS)
    assert stop.update(None, ["space"]) is STOP
    assert stop.update(["button_2"]) is None
    assert stop.update([]) is None
    assert stop.update(["button_2"]) is RESUME


def test_unknown_buttons_are_as_they_were() -> None:
    stop = EmergencyStop(SETTINGS)
    assert stop.update(["button_1"]) is STOP
    assert stop.update(None, ["r"]) is None, "nobody has seen it let go"
    assert stop.update([], ["r"]) is RESUME


def test_a_resume_without_a_stop_tells_nothing() -> None:
    stop = EmergencyStop(SETTINGS)
    assert stop.update([], ["r"]) is None
    assert stop.update(["button_1"]) is STOP


@given(
    st.lists(
        st.tuples(
            st.none() | st.sets(st.sampled_from(["button_1", "button_2", "bumper_1", "other"])),
            st.lists(st.sampled_from(["space", "r", "x"]), max_size=2),
            st.sampled_from([None, STOP, RESUME]),
        )
    )
)
def test_what_always_holds(
    inputs: list[tuple[set[str] | None, list[str], StopEvent | None]],
) -> None:
    stop, held, last = EmergencyStop(SETTINGS), set[str](), False
    for buttons, keys, remote in inputs:
        event = stop.update(buttons, keys, remote)
        held = held if buttons is None else buttons
        wants_stop = bool(held & {"button_1", "bumper_1"}) or "space" in keys or remote is STOP
        assert stop.is_stopped or not wants_stop
        assert event is not RESUME or (last and not wants_stop)
        assert stop.is_stopped == (event is STOP or (last and event is not RESUME))
        last = stop.is_stopped
