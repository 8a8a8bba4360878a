"""Several sensors around a vehicle: none hides another one, and the nearest counts."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robosc_bridge.devices.interface import Scan
from robosc_bridge.devices.mavlink_state import Timestamped, VehicleState
from robosc_bridge.devices.obstacle_rounds import STALE_AFTER_S, ObstacleRounds
from robosc_bridge.protocol.mavlink_messages import Attitude, ObstacleRing, SectorDistance

AUTOPILOT, COMPANION = 1, 191
STATE = VehicleState()

Report = tuple[float, int, ObstacleRing | SectorDistance]


def _sensor(distance_cm: int, orientation: int = 0, number: int = 0, *, is_valid: bool = True) -> SectorDistance:
    return SectorDistance(orientation, distance_cm, 20, 400, 0.0, number, is_valid)


def _ring(distance_cm: int, kind: int = 0) -> ObstacleRing:
    return ObstacleRing((distance_cm,) * 72, 5.0, 0.0, 20, 800, True, kind)


def _scans(*reports: Report, rounds: ObstacleRounds | None = None) -> list[Scan]:
    rounds = ObstacleRounds() if rounds is None else rounds
    found = [rounds.take(component, content, time_s, STATE) for time_s, component, content in reports]
    return [scan for scan in found if scan is not None]


def _rounds(count: int, *sensors: tuple[int, ObstacleRing | SectorDistance]) -> list[Report]:
    return [(0.1 * step, component, content) for step in range(count) for component, content in sensors]


@pytest.mark.parametrize(
    "forward",
    [
        ((AUTOPILOT, _sensor(380, number=0)), (AUTOPILOT, _sensor(30, number=1))),
        ((AUTOPILOT, _sensor(30, number=1)), (AUTOPILOT, _sensor(380, number=0))),
        ((AUTOPILOT, _sensor(380)), (COMPANION, _sensor(30))),
        ((COMPANION, _ring(380)), (AUTOPILOT, _sensor(30))),
        ((COMPANION, _ring(380)), (AUTOPILOT, _ring(30))),
        ((COMPANION, _ring(380, 0)), (COMPANION, _ring(30, 3))),
    ],
    ids=["numbers", "other order", "components", "ring and sensor", "rings", "kinds of rings"],
)
def test_the_nearest_of_all_that_look_there_counts(
    forward: tuple[tuple[int, ObstacleRing | SectorDistance], ...],
) -> None:
    behind = (AUTOPILOT, _sensor(200, 4, 7))
    scans = _scans(*_rounds(5, *forward, behind))
    assert len(scans) >= 4
    # A first ring is a scan before the others are known.
    for scan in scans[1:] if isinstance(forward[0][1], ObstacleRing) else scans:
        assert scan.ranges_m[0] == 0.3
        assert scan.ranges_m[180] in (2.0, 0.3)


def test_sensors_of_one_number_in_several_directions_are_several() -> None:
    scan = _scans(*_rounds(2, *[(AUTOPILOT, _sensor(100 + at, at)) for at in range(8)]))[-1]
    assert [scan.ranges_m[-45 * at] for at in range(8)] == [1 + at / 100 for at in range(8)]


def test_a_scan_is_complete_when_all_have_reported_whatever_their_order() -> None:
    one, two, three = ((AUTOPILOT, _sensor(100, at, at)) for at in range(3))
    rounds = ObstacleRounds()
    assert _scans(*((0.0, *each) for each in (one, two, three)), rounds=rounds) == []
    assert len(_scans((0.1, *one), rounds=rounds)) == 1
    assert [len(_scans((0.1, *each), rounds=rounds)) for each in (two, three)] == [0, 1]
    assert [len(_scans((0.2, *each), rounds=rounds)) for each in (three, one, two)] == [0, 0, 1]
    # One that has fallen silent is not waited for, and does not count any more when it is stale.
    assert len(_scans((0.3, *one), (0.3, *two), (0.4, *one), rounds=rounds)) == 1
    (last,) = _scans((0.4 + STALE_AFTER_S, *one), rounds=rounds)
    assert math.isnan(last.ranges_m[-90])


def test_an_invalid_signal_is_unknown_and_counted() -> None:
    rounds = ObstacleRounds()
    ahead = [(AUTOPILOT, _sensor(300, at, at, is_valid=False)) for at in (0, 1, 7)]
    for scan in _scans(*_rounds(3, *ahead, (AUTOPILOT, _sensor(200, 4, 4))), rounds=rounds):
        assert all(math.isnan(scan.ranges_m[at]) for at in (*range(68), *range(293, 360)))
        assert scan.ranges_m[180] == 2.0
    assert rounds.invalid == 9


def test_what_touches_is_nearer_than_all() -> None:
    (scan,) = _scans(*_rounds(2, (AUTOPILOT, _sensor(0)), (COMPANION, _sensor(25))))[:1]
    assert (scan.ranges_m[0], scan.min_m) == (0.0, 0.2)


def test_an_autopilot_that_repeats_a_ring_as_sectors_does_not_coarsen_it() -> None:
    repeated = [(AUTOPILOT, _sensor(25, at, 10 + at)) for at in range(8)]
    assert all(scan.ranges_m[0] == 2.0 for scan in _scans(*_rounds(3, (COMPANION, _ring(200)), *repeated)))
    # Alone, they are what there is; and they are again when the ring has ended.
    assert _scans(*_rounds(2, *repeated))[-1].ranges_m[0] == 0.25
    rounds = ObstacleRounds()
    _scans((0.0, COMPANION, _ring(200)), rounds=rounds)
    late = [(1.0 + time_s, component, content) for time_s, component, content in _rounds(2, *repeated)]
    assert _scans(*late, rounds=rounds)[-1].ranges_m[0] == 0.25
    # A companion's sensors are its own, whatever their numbers.
    assert _scans(*_rounds(3, (COMPANION, _ring(200)), (COMPANION, _sensor(25, 0, 10))))[-1].ranges_m[0] == 0.25


def test_a_ring_from_north_needs_a_fresh_attitude() -> None:
    north = ObstacleRing((100,) * 72, 5.0, 0.0, 20, 800, False)
    rounds = ObstacleRounds()
    assert rounds.take(1, north, 0.0, STATE) is None
    old = VehicleState(attitude=Timestamped(0.0, Attitude(0.0, 0.0, 0.0)))
    assert rounds.take(1, north, STALE_AFTER_S + 0.1, old) is None
    assert rounds.take(1, north, STALE_AFTER_S, old) is not None


reports = st.tuples(st.sampled_from([0, 1, 2]), st.sampled_from([0, 4]), st.integers(0, 450), st.booleans())


@given(st.lists(reports, max_size=30))
def test_every_scan_is_the_nearest_of_what_each_sensor_said_last(
    said: list[tuple[int, int, int, bool]],
) -> None:
    rounds, last = ObstacleRounds(), dict[tuple[int, int], float]()
    for step, (number, orientation, distance_cm, is_valid) in enumerate(said):
        time_s = step * 0.01
        known = distance_cm <= 400 and is_valid
        last[number, orientation] = (0.0 if distance_cm < 20 else distance_cm / 100) if known else math.inf
        scan = rounds.take(1, _sensor(distance_cm, orientation, number, is_valid=is_valid), time_s, STATE)
        if scan is not None:
            for bin_deg, way in ((0, 0), (180, 4)):
                nearest = min((range_m for (_, at), range_m in last.items() if at == way), default=math.inf)
                assert scan.ranges_m[bin_deg] == nearest or (math.isinf(nearest) and math.isnan(scan.ranges_m[bin_deg]))
