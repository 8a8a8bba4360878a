"""The page about the safety layer lists every reason, as it is."""

import re
from pathlib import Path

from robosc_bridge.driver_registry import features_of
from robosc_bridge.safety import LATCHING, SCAN_TIMEOUTS_S, TORQUE_OFF, Caution, Reason
from support.safety_numbers import shipped

LIMITS = shipped()
PAGE = (Path(__file__).parents[3] / "docs" / "bridge-safety.md").read_text(encoding="utf-8")
ROWS = {
    cells[0].strip("`"): cells[1:]
    for cells in (
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in re.findall(r"^\| `[A-Z_]+` .*$", PAGE, re.MULTILINE)
    )
}


def test_every_reason_has_its_row_in_order() -> None:
    assert list(ROWS) == [reason.name for reason in Reason]
    assert all(f"`{caution.name}`" in PAGE for caution in Caution)


def test_how_each_ends_and_whether_torque_goes() -> None:
    for reason in Reason:
        _, zero, torque, end = ROWS[reason.name]
        assert end.startswith("reset") is (reason in LATCHING), reason
        is_off = reason in TORQUE_OFF or reason is Reason.STANDBY
        at_once = reason is Reason.UNBIDDEN_MOTION
        assert torque.startswith("once" if not at_once else "at once") is is_off, reason
        assert zero.startswith(("at once", "timeout and one call"))


def test_its_numbers_are_those_that_ship() -> None:
    times = {
        Reason.COMMAND_SILENT: LIMITS.command_timeout_s,
        Reason.MOTOR_SILENT: LIMITS.motor_timeout_s,
        Reason.LOOP_OVERRUN: LIMITS.loop_timeout_s,
        Reason.WHEEL_ASTRAY: LIMITS.astray_s,
        Reason.PAUSED: LIMITS.pause_s,
        Reason.UNBIDDEN_MOTION: LIMITS.unbidden_s,
    }
    for reason, time_s in times.items():
        assert f"more than {time_s} s" in ROWS[reason.name][0]
    for scanner, time_s in SCAN_TIMEOUTS_S.items():
        assert f"{time_s} s ({scanner[:3].upper()}-{scanner[3:]})" in ROWS["SCAN_STALE"][0]
    rover = features_of("mavlink-rover")
    assert rover is not None
    text = f"within {LIMITS.torque_on_s:g} s ({rover.torque_on_s:g} s for a MAVLink rover)"
    assert text in ROWS["TORQUE_LOST"][0]
    assert f"the mean over {LIMITS.battery_mean_s:g} s is at or below the voltage" in ROWS["BATTERY_LOW"][0]
    assert f"{2 * LIMITS.battery_mean_s:g} s and two readings" in ROWS["BATTERY_LOW"][1]
    for driver, robot, name in (
        ("opencr", "burger", "`opencr`"),
        ("dynamixel", "burger", "`dynamixel`, Burger (XL430-W250)"),
        ("dynamixel", "waffle", "`dynamixel`, Waffle (XM430-W210)"),
    ):
        found = shipped(driver, robot=robot)
        assert f"\n| {name} | {found.battery_warn_v:g} V | {found.battery_stop_v:g} V |" in PAGE
    rover_limits = shipped("mavlink-rover")
    assert (rover_limits.battery_warn_v, rover_limits.battery_stop_v) == (None, None)
    assert f"faster than {LIMITS.standstill_m_s} m/s, or that {LIMITS.torque_off_s:g} s has passed" in " ".join(
        PAGE.split()
    )
    assert f"more than {LIMITS.astray_m_s} m/s" in ROWS["WHEEL_ASTRAY"][0]
    astray = f"for more than {LIMITS.astray_s} s ({rover.astray_m_s} m/s and {rover.astray_s:g} s for a MAVLink rover)"
    assert astray in ROWS["WHEEL_ASTRAY"][0]
    assert f"faster than {LIMITS.astray_m_s} m/s" in ROWS["UNBIDDEN_MOTION"][0]
    assert f"lose their torque {LIMITS.unbidden_s} s later" in " ".join(PAGE.split())
    assert LIMITS.motor_failures == 3
