"""The page of a whole bridge on a simulated TurtleBot3, served by it and by `robosc view`: all as programs."""

import json
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser

from robosc_simulated import SimulatedTurtleBot3
from support.bridge_process import LIMIT_S, MODEL, configured, stands_still
from support.bridge_runs import Running
from support.browser import Visit, visit
from support.view_shown import EQUALS, entries_shown, wanted
from support.waiting import wait_until

pytestmark = pytest.mark.real_time

FRESHNESS_IS = "(word) => document.documentElement.dataset.freshness === word"
STATE_IS = "(word) => document.querySelector('#state-word').textContent === word"
ANSWER_BEGINS = "(words) => document.querySelector('#stop-answer').textContent.startsWith(words)"


class Bridge(Running):
    """Bridge with a live view."""

    def __init__(self, configuration: Path) -> None:
        super().__init__(configuration, "--view", "127.0.0.1:0", model=MODEL)

    def status(self) -> Any:
        """Return the status that a terminal gets."""
        line = [sys.executable, "-m", "robosc_bridge.command", "status", "--json", "--address", self.address()]
        done = subprocess.run(line, capture_output=True, text=True, check=True, timeout=LIMIT_S)
        return json.loads(done.stdout)

    @property
    def url(self) -> str:
        """URL of its live view, with the token."""
        return self.said(r"the live view: (\S+)\n")


@pytest.fixture
def bridge(robot: SimulatedTurtleBot3, tmp_path: Path) -> Iterator[Bridge]:
    file = configured(tmp_path, robot, "opencr", "'127.0.0.1:0'")
    file.write_text(file.read_text().replace("  folder: null", f"  folder: {tmp_path / 'log'}"))
    with Bridge(file) as started:
        yield started


@contextmanager
def viewed_by_itself(bridge: Bridge) -> Iterator[str]:
    """The page that the bridge serves."""
    yield bridge.url


@contextmanager
def viewed_over_grpc(bridge: Bridge) -> Iterator[str]:
    """The page that `robosc view` serves of it."""
    line = [sys.executable, "-m", "robosc.cli.main", "view", "--bridge", bridge.address(), "--address", "127.0.0.1:0"]
    with subprocess.Popen(line, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            yield process.stdout.readline().strip()
            process.send_signal(signal.SIGINT)
            assert process.wait(LIMIT_S) == 0
        finally:
            process.kill()


def equals_status(seen: Visit, bridge: Bridge) -> bool:
    """Return True if the page shows what is reported to the terminal.

    The robot stands still, and soon nothing changes any more.
    """
    status = bridge.status()
    components = {item["name"]: item for item in status["components"]}
    assert set(components) == {"LidarSensor", "Rotator", "Platform"}
    places = {item["name"]: item["location"] for item in status["communications"]}
    state = wanted(components, places, [f"{name}.request" for name in status["enabled"]])
    return bool(seen.page.evaluate(EQUALS, state))


def logged(folder: Path) -> list[str]:
    """The events that the bridge has written down."""
    (file,) = folder.rglob("*.jsonl")
    # The last line is perhaps being written.
    lines = file.read_text(encoding="utf-8").rpartition("\n")[0].splitlines()
    return [entry["event"] for entry in map(json.loads, lines) if entry["kind"] == "event"]


def shown(seen: Visit) -> list[str]:
    """The same of the page."""
    return [entry["event"] for entry in entries_shown(seen) if entry["kind"] == "event"]


@pytest.mark.parametrize(
    ("viewed", "freshness", "sentence"),
    [
        (viewed_by_itself, "lost", "Connection lost: nothing shown here is live."),
        (viewed_over_grpc, "gone", "The source is lost: "),
    ],
)
def test_a_whole_bridge_is_shown_stopped_started_and_missed(
    viewed: Callable[[Bridge], Any],
    freshness: str,
    sentence: str,
    browser: Browser,
    robot: SimulatedTurtleBot3,
    bridge: Bridge,
    tmp_path: Path,
) -> None:
    with viewed(bridge) as url, visit(browser, url) as seen:
        seen.wait(FRESHNESS_IS, "live")
        seen.wait(STATE_IS, "standby")
        assert stands_still(robot)
        seen.page.get_by_role("button", name="Start", exact=True).click()
        seen.wait(STATE_IS, "running")
        wait_until(lambda: not stands_still(robot), limit_s=LIMIT_S)
        seen.wait("() => document.querySelector('#map-text').textContent.includes('Motors hold.')")

        seen.page.get_by_role("button", name="STOP").click()
        wait_until(lambda: stands_still(robot), limit_s=LIMIT_S)
        seen.wait(ANSWER_BEGINS, "STOP was heard")
        seen.wait("() => document.querySelector('#causes').textContent.includes('An operator has stopped the robot.')")
        wait_until(lambda: equals_status(seen, bridge), limit_s=LIMIT_S)
        count = len(logged(tmp_path / "log"))
        seen.picture(f"whole-{freshness}")

        seen.page.get_by_role("button", name="Resume", exact=True).click()
        wait_until(lambda: not stands_still(robot), limit_s=LIMIT_S)
        seen.wait(ANSWER_BEGINS, "resume: done.")

        bridge.process.send_signal(signal.SIGTERM)
        assert bridge.process.wait(LIMIT_S) == 0
        assert stands_still(robot)
        seen.wait(FRESHNESS_IS, freshness)
        assert seen.page.get_by_role("alert").inner_text().startswith(sentence)
        # Event by event what is written down; what came last is perhaps not sent any more.
        listed, written = shown(seen), logged(tmp_path / "log")
        assert len(listed) >= count > 0
        assert listed == written[: len(listed)]
