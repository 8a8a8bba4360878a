"""The page of a whole bridge on a simulated TurtleBot3, served by it and by `robosc view`: all as programs."""

import json
import re
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
from support.browser import Visit, visit
from support.models import EXAMPLES
from support.real_time import preferred
from support.view_shown import EQUALS, entries_shown, wanted
from support.waiting import wait_until

pytestmark = pytest.mark.real_time

MODEL = EXAMPLES / "maze_solver" / "maze_solver.rscd"
START_LIMIT_S, LIMIT_S = 90.0, 30.0
FRESHNESS_IS = "(word) => document.documentElement.dataset.freshness === word"
STATE_IS = "(word) => document.querySelector('#state-word').textContent === word"
ANSWER_BEGINS = "(words) => document.querySelector('#stop-answer').textContent.startsWith(words)"


def configured(folder: Path, robot: SimulatedTurtleBot3) -> Path:
    """A configuration as `init` writes it, with the ports of a simulated robot, a remote endpoint and a log."""
    line = [sys.executable, "-m", "robosc_bridge.main", "init", "--model", str(MODEL)]
    line += ["--drive", "opencr", "--scanner", "lds01"]
    text = subprocess.run(line, capture_output=True, text=True, check=True).stdout
    ports = iter((robot.base_path, robot.scanner_path))
    text = re.sub(r"^  port: .*$", lambda _: f"  port: {next(ports)}", text, flags=re.MULTILINE)
    # A machine on which tests run is not one for robots.
    text = text.replace("\nscanner:\n", "  options: {answer_limit_s: 0.3}\n\nscanner:\n", 1)
    times = r"^  (overrun_s|motor_timeout_s|scan_timeout_s|command_timeout_s): .*$"
    text = re.sub(times, r"  \1: 1.0", text, flags=re.MULTILINE)
    text = text.replace("  grpc_address: null", "  grpc_address: '127.0.0.1:0'")
    text = text.replace("  folder: null", f"  folder: {folder / 'log'}")
    file = folder / "bridge.yaml"
    file.write_text(text)
    return file


class Bridge:
    """The program.

    Args:
        configuration: Its file.
        errors: File that it writes to.
    """

    def __init__(self, configuration: Path, errors: Path) -> None:
        self._errors = errors
        line = [sys.executable, "-m", "robosc_bridge.main", "run", "--standby", "--view", "127.0.0.1:0"]
        line += ["--model", str(MODEL), "--config", str(configuration)]
        with errors.open("w") as file:
            self.process = subprocess.Popen(line, stdout=subprocess.DEVNULL, stderr=file)

    def said(self, pattern: str) -> str:
        """Return the words of the program about itself that a pattern finds."""

        def look() -> re.Match[str] | None:
            assert self.process.poll() is None, self._errors.read_text()
            return re.search(pattern, self._errors.read_text())

        return wait_until(look, limit_s=START_LIMIT_S)[1]

    def status(self) -> Any:
        """Return the status that a terminal gets."""
        line = [sys.executable, "-m", "robosc_bridge.command", "status", "--json", "--address", self.address]
        done = subprocess.run(line, capture_output=True, text=True, check=True, timeout=LIMIT_S)
        return json.loads(done.stdout)

    @property
    def address(self) -> str:
        """Address of its remote endpoint."""
        return self.said(r"the remote endpoint listens on (\S+)\n")

    @property
    def url(self) -> str:
        """URL of its live view, with the token."""
        return self.said(r"the live view: (\S+)\n")


@pytest.fixture
def robot() -> Iterator[SimulatedTurtleBot3]:
    with preferred(), SimulatedTurtleBot3("burger", "opencr", "lds01") as made:
        yield made


@pytest.fixture
def bridge(robot: SimulatedTurtleBot3, tmp_path: Path) -> Iterator[Bridge]:
    started = Bridge(configured(tmp_path, robot), tmp_path / "errors.txt")
    try:
        yield started
    finally:
        started.process.kill()
        started.process.wait()


@contextmanager
def viewed_by_itself(bridge: Bridge) -> Iterator[str]:
    """The page that the bridge serves."""
    yield bridge.url


@contextmanager
def viewed_over_grpc(bridge: Bridge) -> Iterator[str]:
    """The page that `robosc view` serves of it."""
    line = [sys.executable, "-m", "robosc.cli.main", "view", "--bridge", bridge.address, "--address", "127.0.0.1:0"]
    with subprocess.Popen(line, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            yield process.stdout.readline().strip()
            process.send_signal(signal.SIGINT)
            assert process.wait(LIMIT_S) == 0
        finally:
            process.kill()


def moves(robot: SimulatedTurtleBot3) -> bool:
    robot.world.catch_up()
    return (robot.world.left.speed_rad_s, robot.world.right.speed_rad_s) != (0.0, 0.0)


def equals_status(seen: Visit, bridge: Bridge) -> bool:
    """Return True if the page shows what is reported to the terminal.

    The robot stands still, and soon nothing changes any more.
    """
    told = bridge.status()
    components = {item["name"]: item for item in told["components"]}
    assert set(components) == {"LidarSensor", "Rotator", "Platform"}
    places = {item["name"]: item["location"] for item in told["communications"]}
    state = wanted(components, places, [f"{name}.request" for name in told["enabled"]])
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
        assert not moves(robot)
        seen.page.get_by_role("button", name="Start", exact=True).click()
        seen.wait(STATE_IS, "running")
        wait_until(lambda: moves(robot), limit_s=LIMIT_S)
        seen.wait("() => document.querySelector('#map-text').textContent.includes('Motors hold.')")

        seen.page.get_by_role("button", name="STOP").click()
        wait_until(lambda: not moves(robot), limit_s=LIMIT_S)
        seen.wait(ANSWER_BEGINS, "STOP was heard")
        seen.wait("() => document.querySelector('#causes').textContent.includes('An operator has stopped the robot.')")
        wait_until(lambda: equals_status(seen, bridge), limit_s=LIMIT_S)
        count = len(logged(tmp_path / "log"))
        seen.picture(f"whole-{freshness}")

        seen.page.get_by_role("button", name="Resume", exact=True).click()
        wait_until(lambda: moves(robot), limit_s=LIMIT_S)
        seen.wait(ANSWER_BEGINS, "resume: done.")

        bridge.process.send_signal(signal.SIGTERM)
        assert bridge.process.wait(LIMIT_S) == 0
        assert not moves(robot)
        seen.wait(FRESHNESS_IS, freshness)
        assert seen.page.get_by_role("alert").inner_text().startswith(sentence)
        # Event by event what is written down; what came last is perhaps not told any more.
        told, written = shown(seen), logged(tmp_path / "log")
        assert len(told) >= count > 0
        assert told == written[: len(told)]
