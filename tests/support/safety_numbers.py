"""The numbers of the safety layer as they ship, and the table of them on its page (docs/bridge-safety.md)."""

from dataclasses import fields
from pathlib import Path

from robosc_bridge.assembly import KEYS, safety_limits
from robosc_bridge.configuration import parse
from robosc_bridge.safety import SafetyLimits
from robosc_bridge.safety.limits import BOUNDS, Bounds

PAGE = (Path(__file__).parents[2] / "docs" / "bridge-safety.md").read_text(encoding="utf-8")
HEAD = "| number | key | as it ships | may be |"
# Numbers that depend on the robot or its devices, with the key that changes them.
BY_ROBOT = {
    "linear_m_s": "linear_m_s",
    "angular_rad_s": "angular_rad_s",
    "wheel_m_s": "",
    "separation_m": "",
    "scan_timeout_s": "scan_timeout_s",
    "battery_warn_v": "battery_warning_v",
    "battery_stop_v": "battery_stop_v",
    "has_own_controls": "",
    "is_torque_off_on_operator_stop": "torque_off_on_operator_stop",
}


def shipped(base: str = "opencr", lidar: str = "lds02", robot: str = "burger", **sections: str) -> SafetyLimits:
    """Return the numbers of a bridge whose configuration says no more than it must.

    Args:
        base: Driver of its drive base.
        lidar: Driver of its LiDAR.
        robot: Robot, a TurtleBot3.
        sections: Further sections in YAML.
    """
    rest = "".join(f"{key}: {text}\n" for key, text in sections.items())
    text = f"robot: {robot}\ndrive: {{driver: {base}, port: /a}}\nscanner: {{driver: {lidar}, port: /b}}\n{rest}"
    return safety_limits(parse(text.encode(), "test.yaml").configuration)


def table() -> str:
    """Return the table of all numbers in Markdown."""
    rows = [HEAD, "|---|---|---|---|"]
    limits, keys = shipped(), {**KEYS, **BY_ROBOT}
    for each in fields(SafetyLimits):
        key, value = keys.get(each.name, ""), getattr(limits, each.name)
        ships = "the robot's or its devices'" if each.name in BY_ROBOT else "none" if value is None else f"{value:g}"
        may_be = _range(BOUNDS.get(each.name, Bounds()))
        if isinstance(value, bool):
            ships, may_be = str(value).lower(), "true or false"
        rows.append(f"| `{each.name}` | {f'`{key}`' if key else ''} | {ships} | {may_be} |")
    return "\n".join(rows)


def _range(bounds: Bounds) -> str:
    least = "above 0" if bounds.least is None else f"from {bounds.least:g}"
    joined = ", at most" if bounds.least is None else " to"
    return least if bounds.most is None else f"{least}{joined} {bounds.most:g}"
