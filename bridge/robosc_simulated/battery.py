"""The battery of a TurtleBot3: three lithium polymer cells that empty while it lives and sag while it works."""

from bisect import bisect_right

from robosc_simulated.world import World

CAPACITY_WH = 19.98
_IDLE_W, _WHEEL_W = 5.0, 3.0
# Charge and voltage of three cells at rest, about 4.2 to 3.3 V each: flat in the middle, with a knee at the end.
_CURVE = (
    (0.0, 9.9), (0.05, 10.8), (0.1, 11.1), (0.2, 11.3), (0.4, 11.5), (0.6, 11.75), (0.8, 12.05), (0.9, 12.3),
    (1.0, 12.6),
)  # fmt: skip
_SHARES = tuple(share for share, _ in _CURVE)


def voltage_at(charge: float) -> float:
    """Return the voltage without a load.

    Args:
        charge: Share of a full charge.
    """
    within = max(0.0, min(1.0, charge))
    above = min(bisect_right(_SHARES, within), len(_CURVE) - 1)
    (low, low_v), (high, high_v) = _CURVE[above - 1], _CURVE[above]
    return low_v + (high_v - low_v) * (within - low) / (high - low)


class Battery:
    """A battery that all of a robot lives from.

    Args:
        world: World of the robot.
        charge: Share of a full charge at the start.
        resistance_ohm: Inner resistance, with the cables.
    """

    def __init__(self, world: World, charge: float, resistance_ohm: float) -> None:
        self._world = world
        self._charge_wh = charge * CAPACITY_WH
        self._resistance_ohm = resistance_ohm
        self._lived_s = world.lived_s

    @property
    def charge(self) -> float:
        """Share of a full charge that is left."""
        return self._charge_wh / CAPACITY_WH

    def voltage_v(self) -> float:
        """Return the voltage now, under the load that there is."""
        world = self._world
        power_w = _IDLE_W
        for wheel in (world.left, world.right):
            if wheel.is_driven:
                # A motor that is held draws most.
                share = 1.0 if wheel.is_blocked and wheel.goal_rad_s else abs(wheel.speed_rad_s) / wheel.fastest_rad_s
                power_w += _WHEEL_W * share
        passed_s = world.lived_s - self._lived_s
        self._lived_s = world.lived_s
        self._charge_wh = max(self._charge_wh - power_w * passed_s / 3600, 0.0)
        at_rest_v = voltage_at(self.charge)
        return at_rest_v - self._resistance_ohm * power_w / at_rest_v
