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


@pytest.mark.parametrize(
    "steps",
    [
        pytest.param(
            [(["button_1"], [], STOP), (["button_1"], [], None), ([], [], None), (["button_1"], [], STOP)],
            id="a held button stops once and each press anew",
        ),
        pytest.param(
            [(["button_1"], [], STOP), (["button_1", "bumper_1"], [], STOP)], id="a second stop button stops again"
        ),
        pytest.param(
            [(["button_2"], [], None), (["button_2", "button_1"], [], STOP), (["button_2"], [], None)],
            id="a jammed resume button lets nothing go on",
        ),
        pytest.param(
            [(None, ["space"], STOP), (["button_2"], [], None), ([], [], None), (["button_2"], [], RESUME)],
            id="nor one that jammed before it was seen",
        ),
        pytest.param(
            [(["button_1"], [], STOP), (None, ["r"], None), ([], ["r"], RESUME)],
            id="unknown buttons are as they were: nobody has seen it let go",
        ),
        pytest.param([([], ["r"], None), (["button_1"], [], STOP)], id="a resume without a stop sends nothing"),
    ],
)
def test_buttons_and_keys_one_after_the_other(
    steps: list[tuple[list[str] | None, list[str], StopEvent | None]],
) -> None:
    stop = EmergencyStop(SETTINGS)
    for buttons, keys, event in steps:
        assert stop.update(buttons, keys) is event


@given(
    st.lists(
        st.tuples(
            st.none() | st.sets(st.sampled_from(["button_1", "button_2", "bumper_1", "other"])),
            st.lists(st.sampled_from(["space", "r", "x"]), max_size=2),
            st.sampled_from([None, STOP, RESUME]),
        )
    )
)
def test_what_always_holds(inputs: list[tuple[set[str] | None, list[str], StopEvent | None]]) -> None:
    stop, held, last = EmergencyStop(SETTINGS), set[str](), False
    for buttons, keys, remote in inputs:
        event = stop.update(buttons, keys, remote)
        held = held if buttons is None else buttons
        wants_stop = bool(held & {"button_1", "bumper_1"}) or "space" in keys or remote is STOP
        assert stop.is_stopped or not wants_stop
        assert event is not RESUME or (last and not wants_stop)
        assert stop.is_stopped == (event is STOP or (last and event is not RESUME))
        last = stop.is_stopped
