"""A whole bridge whose supervisor always wants a rover to go ahead: what its sensors say of their own measurements.

The obstacles come over the rover's own line, byte for byte. The model reads none of them, so that what stops the rover
is the safety layer.
"""

import pytest

from robosc_bridge.safety import Reason
from robosc_simulated import Rover, SimulatedTurtleBot3
from support.driven import Driven, driven

AHEAD = (0.1, 0.0)
# A period of the reports, a cycle, and a little.
LIMIT_S = 0.4


def _rover(robot: SimulatedTurtleBot3) -> Rover:
    assert robot.rover is not None
    return robot.rover


def _reports(kind: str, sensors: dict[int, int] | None = None, quality: int = 0) -> object:
    def before(robot: SimulatedTurtleBot3) -> None:
        _rover(robot).obstacles = kind
        _rover(robot).reported_cm = dict(sensors or {})
        _rover(robot).signal_quality = quality

    return before


def _reasons(bridge: Driven) -> set[Reason]:
    snapshot = bridge.machine.operations.feed.snapshot
    return set() if snapshot is None else set(snapshot.reasons)


@pytest.mark.parametrize(
    ("kind", "sector", "distance_cm"),
    [("ring", 0, 0), ("ring", 0, 4), ("ring", 5, 0), ("ring", 67, 1), ("sensors", 0, 0), ("sensors", 0, 4)],
)
def test_a_rover_does_not_go_on_to_what_it_touches(kind: str, sector: int, distance_cm: int) -> None:
    before = _reports(kind)
    with driven("mavlink-rover", "mavlink-rover", AHEAD, before=before) as bridge:  # type: ignore[arg-type]
        bridge.stopped_after(lambda: _rover(bridge.robot).reported_cm.update({sector: distance_cm}), LIMIT_S)
        bridge.until(lambda: Reason.SCAN_TOUCHING in _reasons(bridge), "the reason")
        bridge.stays(1.0)
        # It is taken away, and the rover goes on.
        _rover(bridge.robot).reported_cm.clear()
        bridge.moves()


@pytest.mark.parametrize(("kind", "sector"), [("ring", 8), ("ring", 36), ("sensors", 4), ("sensors", 2)])
def test_what_touches_beside_or_behind_does_not_stop_it(kind: str, sector: int) -> None:
    before = _reports(kind, {sector: 0})
    with driven("mavlink-rover", "mavlink-rover", AHEAD, before=before) as bridge:  # type: ignore[arg-type]
        bridge.steady()
        assert Reason.SCAN_TOUCHING not in _reasons(bridge)


def test_a_rover_does_not_go_where_its_sensors_mark_their_signals_as_invalid() -> None:
    with driven("mavlink-rover", "mavlink-rover", AHEAD, before=_reports("sensors")) as bridge:  # type: ignore[arg-type]

        def invalid() -> None:
            _rover(bridge.robot).signal_quality = 1

        bridge.stopped_after(invalid, 1.2)
        bridge.stays(1.0)
        _rover(bridge.robot).signal_quality = 100
        bridge.moves()
