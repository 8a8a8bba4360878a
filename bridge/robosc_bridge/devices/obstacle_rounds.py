"""Rounds of the obstacles that a vehicle's sensors report, for a scanner and for the replay of its line.

A vehicle may have several sensors, of its autopilot and of companion computers, and several may look in one direction:
none hides another one, and the nearest counts. A sensor is identified by its component, its number and its direction, a
ring of distances by its component and its kind. ArduPilot repeats a ring of others as eight sectors, with numbers from
10 on: these are ignored while there is a ring.
"""

import math

from robosc_bridge.devices.interface import RawScan, Scan
from robosc_bridge.devices.mavlink_state import Timestamped, VehicleState
from robosc_bridge.protocol.mavlink_messages import AUTOPILOT, ObstacleRing, SectorDistance
from robosc_bridge.protocol.mavlink_obstacles import Sector, nearest_in_sectors, ring_sectors, sensor_sector

STALE_AFTER_S = 0.5
"""Age from which a measurement does not count any more; ArduPilot, too, ignores older ones."""

_FIRST_REPEATED, _LAST_REPEATED = 10, 17

type Obstacle = ObstacleRing | SectorDistance
type _Key = tuple[str, int, int, int]


class ObstacleRounds:
    """Rounds in which each sensor reports once.

    Attributes:
        invalid: Number of measurements that the sensors themselves have marked as invalid.
    """

    def __init__(self) -> None:
        self.invalid = 0
        self._found: dict[_Key, Timestamped[tuple[Sector, ...]]] = {}
        # Sensors that have reported since the last scan.
        self._reported: set[_Key] = set()
        # False until it is known which sensors there are.
        self._is_known = False

    def forget(self) -> None:
        """Begin anew, with sensors that are not known yet."""
        self._found.clear()
        self._reported.clear()
        self._is_known = False

    def take(self, component: int, content: Obstacle, time_s: float, state: VehicleState) -> Scan | None:
        """Return the scan that a report completes: when all sensors have reported, or one has reported again.

        Args:
            component: Component that it comes from.
            content: Report of one sensor.
            time_s: Time when it came, in seconds.
            state: State of the vehicle then.
        """
        if isinstance(content, ObstacleRing):
            key = ("ring", component, content.kind, 0)
            sectors = ring_sectors(content, _heading_rad(state, time_s))
        else:
            key = ("sensor", component, content.number, content.orientation)
            sector = sensor_sector(content)
            sectors = None if sector is None or self._is_repetition(component, content, time_s) else (sector,)
            self.invalid += not content.is_valid
        if sectors is None:
            return None
        is_first_ring = not self._found and key[0] == "ring"
        self._found[key] = Timestamped(time_s, sectors)
        fresh = {key: found for key, found in self._found.items() if time_s - found.time_s <= STALE_AFTER_S}
        is_repeated = key in self._reported
        self._reported.add(key)
        if not (is_repeated or is_first_ring or (self._is_known and self._reported >= fresh.keys())):
            return None
        self._is_known = True
        self._reported = {key} if is_repeated else set()
        return _scan(tuple(sector for found in fresh.values() for sector in found.content), time_s)

    def _is_repetition(self, component: int, content: SectorDistance, time_s: float) -> bool:
        is_repeated = component == AUTOPILOT and _FIRST_REPEATED <= content.number <= _LAST_REPEATED
        return is_repeated and any(
            key[0] == "ring" and time_s - found.time_s <= STALE_AFTER_S for key, found in self._found.items()
        )


def _heading_rad(state: VehicleState, time_s: float) -> float | None:
    attitude = state.attitude
    is_known = attitude is not None and abs(time_s - attitude.time_s) <= STALE_AFTER_S
    return attitude.content.heading_rad if attitude is not None and is_known else None


def _scan(sectors: tuple[Sector, ...], time_s: float) -> Scan:
    raw = RawScan(
        tuple(math.radians(sector.middle_deg) for sector in sectors),
        tuple(sector.range_m for sector in sectors),
        (math.nan,) * len(sectors),
    )
    # Fixed sensors have no rotation whose speed could be given: it is NaN.
    min_m = min(sector.min_m for sector in sectors)
    max_m = max(sector.max_m for sector in sectors)
    return Scan(time_s, nearest_in_sectors(sectors), raw, math.nan, min_m, max_m)
