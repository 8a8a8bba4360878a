"""The page of the documentation says what the code does."""

from pathlib import Path

from robosc_bridge.ros2 import clock_offset, command, relay, uncertainty
from robosc_bridge.ros2.messages import NODE, WHEEL_JOINTS
from robosc_bridge.terminal.formatting import STALE_S

DOCS = Path(__file__).parents[3] / "docs"
PAGE = " ".join((DOCS / "bridge-ros2.md").read_text(encoding="utf-8").split())


def test_the_page_is_listed() -> None:
    assert "(bridge-ros2.md)" in (DOCS / "README.md").read_text(encoding="utf-8")


def test_names() -> None:
    assert f"`{NODE}: `" in PAGE
    assert ", ".join(f"`{name}`" for name in WHEEL_JOINTS) in PAGE


def test_times() -> None:
    for text in (
        f"`--rate` ({command.RATE_HZ:g})",
        f"smallest difference of the last {clock_offset.WINDOW_S:g} s",
        f"older than {relay.STALE_S:g} s",
        f"is silent for {relay.SILENCE_S:g} s, or its loop has not run for {STALE_S:g} s",
    ):
        assert text in PAGE
    assert (command.REPORT_S, command.RETRY_S, relay.BATTERY_S) == (1.0, 1.0, 1.0)


def test_covariances() -> None:
    for text in (
        f"| distance | {uncertainty.WAY_M2_PER_M:.0e} m²".replace("e-0", "e-"),
        f"| heading | {uncertainty.HEADING_RAD2_PER_M:.0e} rad² for each metre and for each radian".replace(
            "e-0", "e-"
        ),
        f"{uncertainty.LINEAR_M2_S2:.0e} m²/s² along x and y, {uncertainty.ANGULAR_RAD2_S2:.0e} rad²/s²".replace(
            "e-0", "e-"
        ),
        f"| {uncertainty.UNMEASURED:.0e} |".replace("e+0", "e"),
        f"{uncertainty.ANGULAR_VELOCITY_RAD2_S2:g} rad²/s², {uncertainty.LINEAR_ACCELERATION_M2_S4:g} m²/s⁴, "
        f"{uncertainty.ORIENTATION_RAD2:g} rad²",
        f"pose also begins with {uncertainty.INITIAL:.0e}".replace("e-0", "e-"),
    ):
        assert text in PAGE
    assert uncertainty.HEADING_RAD2_PER_M == uncertainty.HEADING_RAD2_PER_RAD
