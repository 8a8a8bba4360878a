"""Driving by hand through a supervision layer from a ground station, on a clock that the test sets."""

from typing import Any

import pytest

from robosc_bridge.daemon.programs.items import Attached, Detached, MessageRequested, Refused
from robosc_bridge.daemon.states import State
from robosc_bridge.safety import Reason
from support.ground import CONFIGURATION, PlayedDaemon, Station, joined_texts
from support.ground_talk import Talk, layer_talk


def _target(station: Station, speed_m_s: float, yaw_rate_rad_s: float = 0.0) -> bytes:
    zeros = (0.0, 0.0, 0.0)
    library = station.codec
    return station.pack(
        library.set_position_target_local_ned_encode(
            0, 1, 1, 8, 0x05E7, *zeros, speed_m_s, 0.0, 0.0, *zeros, 0.0, yaw_rate_rad_s
        )
    )


def _requested(talk: Talk) -> list[tuple[float, float]]:
    return [
        (item.data["linear"]["x"], item.data["angular"]["z"])
        for item in talk.daemon.received
        if isinstance(item, MessageRequested)
    ]


def test_a_layer_is_asked_for_motion() -> None:
    talk = layer_talk()
    talk.say(_target(talk.station, 0.125, 0.5))
    attached, requested = talk.daemon.received
    assert isinstance(attached, Attached)
    assert attached.program.may_request
    assert isinstance(requested, MessageRequested)
    assert (requested.program, requested.identifier) == (attached.program, "/cmd_vel")
    assert _requested(talk) == [(0.125, -0.5)]
    stick = talk.station.codec.manual_control_encode(1, 500, 0, 0, -250, 0)
    talk.say(talk.station.pack(stick), after_s=0.1)
    assert _requested(talk)[1:] == [(0.1, 0.5)]


def test_who_no_longer_drives_stands_still_within_half_a_second() -> None:
    talk = layer_talk()
    talk.say(_target(talk.station, 0.125))
    assert len(talk.daemon.received) == 2
    talk.live(0.45)
    assert len(talk.daemon.received) == 2
    found = talk.live(0.1)
    assert _requested(talk) == [(0.125, 0.0), (0.0, 0.0)]
    assert isinstance(talk.daemon.received[-1], Detached)
    assert "No set-point any more: the robot stands." in joined_texts(found)
    talk.live(2.0)
    assert len(talk.daemon.received) == 4
    # And again.
    talk.say(_target(talk.station, 0.125))
    assert isinstance(talk.daemon.received[4], Attached)


def test_a_line_that_is_lost_ends_driving_at_once() -> None:
    talk = layer_talk()
    talk.say(_target(talk.station, 0.125))
    talk.session.lost()
    assert _requested(talk) == [(0.125, 0.0), (0.0, 0.0)]
    assert isinstance(talk.daemon.received[-1], Detached)


def test_a_stick_at_rest_ends_in_silence() -> None:
    talk = layer_talk()
    talk.say(_target(talk.station, 0.0))
    found = talk.live(1.0)
    assert _requested(talk) == [(0.0, 0.0)]
    assert isinstance(talk.daemon.received[-1], Detached)
    assert [text for text in joined_texts(found) if "set-point" in text] == []


@pytest.mark.parametrize(
    ("is_layer", "values", "why"),
    [
        (False, {"state": State.RUNNING}, "this supervisor drives by itself"),
        (True, {"state": State.STANDBY}, "The robot is not armed"),
        (True, {"state": State.RUNNING, "reasons": (Reason.OPERATOR_STOP,)}, "An operator has stopped the robot"),
    ],
)
def test_set_points_that_are_not_heeded_are_reported_once(is_layer: bool, values: dict[str, Any], why: str) -> None:
    talk = Talk(PlayedDaemon(is_layer=is_layer))
    talk.daemon.show(**values)
    talk.live(1.0)
    texts = []
    for _ in range(20):
        texts += joined_texts(talk.say(_target(talk.station, 0.1), after_s=0.1))
        talk.daemon.show()
    assert len([text for text in texts if why in text and "set-points" in text.lower()]) == 1
    assert talk.daemon.received == []


def test_a_layer_whose_drive_is_not_tied_is_not_driven() -> None:
    talk = Talk(PlayedDaemon(is_layer=True, configuration=CONFIGURATION.replace("channel: drive", "channel: log")))
    talk.daemon.show(state=State.RUNNING)
    assert any("whose drive is mapped" in text for text in joined_texts(talk.say(_target(talk.station, 0.1))))
    assert talk.daemon.received == []


def test_what_a_layer_refuses_is_reported() -> None:
    talk = layer_talk()
    talk.say(_target(talk.station, 0.1))
    attached = talk.daemon.received[0]
    assert isinstance(attached, Attached)
    attached.program.send(Refused("somebody else drives"))
    assert "somebody else drives" in joined_texts(talk.live(0.2))
