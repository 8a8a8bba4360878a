"""The patterns for orders do what docs/goals.md says, event by event, and nothing about them is a mistake."""

from pathlib import Path

import pytest

import robosc

GOALS = Path(__file__).parents[2] / "examples" / "goals"
PATTERNS = sorted(path.stem for path in GOALS.glob("*/*.rscd") if path.stem != "parts")


def run_of(pattern: str) -> robosc.Run:
    supervisor = robosc.synthesize(GOALS / pattern / f"{pattern}.rscd").supervisor
    assert supervisor is not None
    return robosc.simulate(supervisor)


def drive(run: robosc.Run, ends: str = "response") -> None:
    """Drive once, to the end that is given."""
    for event in ("request", ends, *(["reset"] if ends != "cancel" else [])):
        run.step(f"navigate.{event}")


def is_asked_for(run: robosc.Run) -> bool:
    return "navigate.request" in run.enabled


@pytest.mark.parametrize("pattern", PATTERNS)
def test_a_pattern_has_no_warnings(pattern: str) -> None:
    found = robosc.synthesize(GOALS / pattern / f"{pattern}.rscd").diagnostics
    assert [item.code for item in found if item.severity is not robosc.Severity.NOTE] == []
    # A patrol alone goes on by itself.
    assert ("unprompted-request" in {item.code for item in found}) == (pattern == "patrol")


def test_an_order_is_carried_out_once() -> None:
    run = run_of("one_shot")
    assert not is_asked_for(run)
    run.step("order.response")
    run.step("order.response")
    drive(run)
    assert not is_asked_for(run)


def test_orders_wait_in_a_queue_of_five() -> None:
    run = run_of("mission_queue")
    for _ in range(7):
        run.step("order.response")
    for _ in range(5):
        drive(run)
    assert not is_asked_for(run)
    run.step("order.response")
    run.step("clear.response")
    assert not is_asked_for(run)


def test_a_patrol_goes_round_until_it_is_stopped() -> None:
    run = run_of("patrol")
    assert not is_asked_for(run)
    run.step("start.response")
    places = []
    for _ in range(4):
        sent = run.step("navigate.request").provided
        places.append((sent["pose"]["pose"]["position"]["x"], sent["pose"]["pose"]["position"]["y"]))
        run.step("navigate.response")
        run.step("navigate.reset")
    assert places == [(0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 0.0)]
    run.step("navigate.request")
    assert "navigate.cancel" not in run.enabled
    run.step("stop.response")
    run.step("navigate.cancel")
    assert not is_asked_for(run)


def test_an_order_is_tried_three_times() -> None:
    run = run_of("retry")
    for end in ("error", "response"):
        run.step("order.response")
        tries = 0
        while True:
            for event in ("Order.tau_1", "Order.tau_2"):
                if event in run.enabled:
                    run.step(event)
            if not is_asked_for(run):
                break
            drive(run, end)
            tries += 1
        assert tries == (3 if end == "error" else 1)


def test_a_low_battery_comes_before_an_order() -> None:
    run = run_of("dock_when_low")
    run.step("order.response")
    run.step("navigate.request")
    run.step("battery.response", percentage=0.1)
    assert "dock.request" not in run.enabled
    run.step("navigate.cancel")
    assert not is_asked_for(run)
    run.step("dock.request")
    run.step("dock.error")
    run.step("dock.reset")
    # It is tried again when the battery has reported once more.
    assert "dock.request" not in run.enabled
    run.step("battery.response", percentage=0.1)
    for event in ("dock.request", "dock.response", "dock.reset"):
        run.step(event)
    assert "undock.request" not in run.enabled
    run.step("battery.response", percentage=0.95)
    for event in ("undock.request", "undock.response", "undock.reset"):
        run.step(event)
    # The order was kept.
    drive(run)
    assert not is_asked_for(run)
