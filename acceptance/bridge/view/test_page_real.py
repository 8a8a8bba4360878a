"""The page before the real server: what it shows equals the state of the robot, or of its log at any of its moments."""

import asyncio
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser

from robosc.event_logs import read_log
from robosc.execution.runtime.event_log import json_line, plain
from robosc_bridge.daemon.states import OperatorCommand
from robosc_view.replay import Recording, Replay
from support.browser import visit
from support.generated import example_supervisor
from support.live import LiveRobot, large_model, supervisor_without_synthesis, viewed
from support.view_servers import served
from support.view_shown import entries_shown, shows, wanted

NEWEST = """(number) => {
  const numbers = [...document.querySelectorAll(".row")].map((row) => Number(row.dataset.number));
  return Math.max(...numbers) === number;
}"""


def state_of(robot: LiveRobot) -> str:
    requests = [f"{name}.request" for name in robot.snapshot().enabled]
    return wanted(plain(robot.system.state()), dict(robot.locations()), requests)


@pytest.mark.parametrize("name", ["maze_solver/maze_solver", "navigation/navigation", "sixty components"])
def test_the_page_equals_a_robot_that_lives(browser: Browser, name: str) -> None:
    is_large = name == "sixty components"
    robot = LiveRobot(supervisor_without_synthesis(large_model(60)) if is_large else example_supervisor(name))
    with viewed(robot) as endpoint, visit(browser, endpoint.url) as seen:
        shows(seen, state_of(robot))
        taken: list[str] = []
        for _ in range(5):
            taken += [robot.step() for _ in range(40)]
            shows(seen, state_of(robot))
        seen.wait("(count) => document.querySelector('#stream-count').textContent.startsWith(`${count} `)", len(taken))
        assert [item["event"] for item in entries_shown(seen)] == taken
        seen.picture(f"real-{name.partition('/')[0].replace(' ', '-')}")
        assert seen.errors == []


def test_a_stop_reaches_the_robot_and_commands_follow(browser: Browser) -> None:
    robot = LiveRobot(example_supervisor("maze_solver/maze_solver"))
    answer = "(words) => document.querySelector('#stop-answer').textContent.startsWith(words)"
    with viewed(robot) as endpoint, visit(browser, f"http://{endpoint.address}/") as seen:
        seen.wait("() => !document.querySelector('#stop').hidden")
        seen.page.keyboard.press("Escape")
        seen.wait(answer, "STOP was heard")
        assert [order.command for order in robot.orders] == [OperatorCommand.STOP]
        seen.wait("() => document.querySelector('#causes').textContent.includes('An operator has stopped the robot.')")
        seen.page.goto(endpoint.url)
        for command in (OperatorCommand.RESUME, OperatorCommand.STANDBY, OperatorCommand.START, OperatorCommand.RESET):
            seen.page.get_by_role("button", name=command.capitalize(), exact=True).click()
            seen.wait(answer, f"{command}: done.")
        assert [order.command for order in robot.orders[1:]] == ["resume", "standby", "start", "reset"]
        robot.refusal = "the scanner is not there"
        seen.page.get_by_role("button", name="Start", exact=True).click()
        seen.wait(answer, "start: refused. the scanner is not there")
        assert seen.errors == []


@contextmanager
def replayed(recording: Recording) -> Iterator[str]:
    """The address of a log's live view; its server runs in a thread of its own."""
    loop = asyncio.new_event_loop()
    thread = threading.Thread(target=loop.run_forever)
    thread.start()

    def do(work: Any) -> Any:
        return asyncio.run_coroutine_threadsafe(work, loop).result(20.0)

    context = served(lambda: Replay(recording), is_shared=False, robot=recording.robot)
    try:
        yield do(context.__aenter__()).url
        do(context.__aexit__(None, None, None))
    finally:
        loop.call_soon_threadsafe(loop.stop)
        thread.join()
        loop.close()


def test_the_page_equals_a_log_at_any_moment(browser: Browser, tmp_path: Path) -> None:
    supervisor = example_supervisor("navigation/navigation")
    robot = LiveRobot(supervisor)
    subscription = robot.feed.subscribe(lambda: None)
    states = [state_of(robot)]
    for _ in range(300):
        robot.step()
        states.append(state_of(robot))
    log = tmp_path / "log.jsonl"
    # An event each second, so that each has a place of its own on the slider.
    entries = [{**entry, "time": 1_750_000_000.0 + i} for i, entry in enumerate(subscription.take().entries, start=1)]
    log.write_text("".join(map(json_line, entries)), encoding="utf-8")
    with replayed(Recording(read_log(log), supervisor)) as address, visit(browser, address) as seen:
        seen.wait("() => !document.querySelector('#replay').hidden")
        slider = seen.page.get_by_role("slider", name="Time in the log")
        for number in (1, 40, 7, 299, 150, 151, 300):
            slider.fill(str(number - 1))
            shows(seen, states[number])
            seen.wait(NEWEST, number)
            numbers = [item["number"] for item in entries_shown(seen) if "number" in item]
            assert numbers == list(range(numbers[0], number + 1))
        slider.fill("290")
        shows(seen, states[291])
        seen.page.get_by_label("Speed").select_option("20")
        seen.page.get_by_role("button", name="Play").click()
        shows(seen, states[300])
        seen.wait("() => document.querySelector('#replay-play').textContent === 'Play'")
        assert not seen.page.get_by_role("button", name="STOP").is_visible()
        seen.picture("real-replay")
        assert seen.errors == []
