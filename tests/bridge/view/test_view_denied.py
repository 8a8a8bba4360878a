"""A page against the surroundings: they answer each turn, so that a goal is never reached; made anew with its file."""

import argparse
import contextlib
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import pytest

from robosc.cli.arguments import Parser
from robosc.cli.output import CommandError, UsageError
from robosc_view import command, watched_model
from support.pages_open import opened
from support.view_servers import served

GATE = """robot Gate {
    component Door {
        incoming message open with identifier: "/open", type: none
        incoming message shut with identifier: "/shut", type: none
        outgoing message opened with identifier: "/opened", type: none
        outgoing message stuck with identifier: "/stuck", type: none
        behaviour {
            initial marked state closed { on request to open goto opening }
            state opening { on response from opened goto ajar on response from stuck goto closed }
            state ajar { on request to shut goto closed }
        }
    }
    assume Door.opening leads to Door.ajar or Door.closed
    goal always eventually Door.ajar
}
"""


def arguments(*words: str) -> argparse.Namespace:
    parser: argparse.ArgumentParser = Parser(prog="robosc")
    command.add_parser(parser.add_subparsers())
    return parser.parse_args(["view", *words])


@contextlib.asynccontextmanager
async def page_of(file: Path) -> AsyncIterator[Any]:
    given = arguments("--counter-strategy", "--model", str(file))
    make, is_shared, robot = command._source(given)
    async with served(make, is_shared=is_shared, robot=robot) as server, opened(server.url) as page:
        yield page


async def done(page: Any, kind: str, **request: Any) -> dict[str, Any]:
    """Ask for something, and return the run after it."""
    await page.send(type=kind, **request)
    received: dict[str, Any] = await page.receive("run")
    return received


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "gate.rscd"
    path.write_text(GATE, encoding="utf-8")
    return path


async def test_the_surroundings_answer_each_turn(file: Path) -> None:
    async with page_of(file) as page:
        play = (await page.receive("definition"))["play"]
        assert (play["goals"], play["forms"], play["link"]) == (["goal always eventually Door.ajar"], ["log"], None)
        run = await page.receive("run")
        assert run["opposition"] == {"goals": ["not yet"], "denied": "goal 1", "denied_next": [], "assumptions": [0]}
        assert run["blocked"]["opened.response"] == ["the surroundings decide it"]
        run = await done(page, "event", line="open")
        assert run["lines"][0] == "open.request: Door = opening"
        run = await done(page, "wait")
        assert run["lines"][0] == "you wait"
        # The assumption comes true by a door that is stuck.
        for _ in range(4):
            run = await done(page, "wait")
        assert run["opposition"]["goals"] == ["not yet"]
        assert run["opposition"]["assumptions"][0] > 0
        assert any(entry["event"] == "stuck.response" for entry in page.entries())
        assert not any(entry["event"] == "opened.response" for entry in page.entries())
        count = run["steps"]
        run = await done(page, "walk", steps=10, seed=2)
        assert run["steps"] >= count + 10
        run = await done(page, "walk", steps=10, seed=2, until_finding=True)
        assert (run["kind"], "findings are looked for" in run["lines"][0]) == ("wrong", True)
        assert (await done(page, "undo"))["steps"] < count + 10


async def test_a_mission_that_cannot_be_made(file: Path) -> None:
    mission = "mission delivery { visit Bell.rung then Door.ajar }"
    bell = """component Bell {
        incoming message ring with type: none
        behaviour { initial marked state still { on request to ring goto rung } marked state rung { } }
    }
    """
    file.write_text(GATE.replace("goal always eventually Door.ajar", f"{bell}{mission}"), encoding="utf-8")
    async with page_of(file) as page:
        # Without a goal in the list, the page would show neither the wait button nor what is denied.
        assert (await page.receive("definition"))["play"]["goals"] == ["mission delivery"]
        opposition = (await page.receive("run"))["opposition"]
        assert opposition["goals"] == ["at visit 1, Bell.rung"]
        assert opposition["denied"] == "visit 1 of mission delivery"
        assert opposition["denied_next"] == ["visit 2 of mission delivery"]
        await done(page, "event", line="ring")
        run = await done(page, "event", line="open")
        for _ in range(4):
            run = await done(page, "wait")
        opposition = run["opposition"]
        assert opposition["goals"] == ["at visit 2, Door.ajar"]
        assert (opposition["denied"], opposition["denied_next"]) == ("visit 2 of mission delivery", [])
    file.write_text(file.read_text("utf-8").replace(mission, f"goal once Door.ajar {mission}"), encoding="utf-8")
    async with page_of(file) as page:
        goals = (await page.receive("definition"))["play"]["goals"]
        assert goals == ["goal once Door.ajar", "mission delivery"]
        run = await page.receive("run")
        assert run["opposition"]["goals"] == ["not yet", "at visit 1, Bell.rung"]


async def test_a_page_that_comes_back_repeats_its_turns(file: Path) -> None:
    given = arguments("--counter-strategy", "--model", str(file))
    make, is_shared, robot = command._source(given)
    async with served(make, is_shared=is_shared, robot=robot) as server:
        async with opened(server.url) as page:
            await page.receive("run")
            await page.send(type="resume", page="tab")
            run = await done(page, "walk", steps=15, seed=1)
            events = [entry["event"] for entry in page.entries()]
        async with opened(server.url) as page:
            await page.receive("run")
            await page.send(type="resume", page="tab")
            again = await page.until(lambda message: message["type"] == "run" and message["steps"])
            assert again["steps"] == run["steps"]
            assert [entry["event"] for entry in page.entries()] == events


async def test_a_changed_file_is_made_anew(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(watched_model, "LOOK_S", 0.01)
    async with page_of(file) as page:
        await page.receive("run")
        file.write_text(GATE.replace("goal always eventually Door.ajar", "goal once Door.ajar"), encoding="utf-8")
        found = await page.until(lambda message: message["type"] == "definition")
        assert found["play"]["goals"] == ["goal once Door.ajar"]
        file.write_text(GATE.replace("goal always eventually Door.ajar", "goal once Door.closed"), encoding="utf-8")
        warned = await page.until(lambda message: message["type"] == "update" and message["warnings"])
        assert "no counter-strategy" in warned["warnings"][0]["text"]


async def test_waiting_is_only_for_a_run_against_the_surroundings(file: Path) -> None:
    file.write_text(GATE.replace("goal always eventually Door.ajar", ""), encoding="utf-8")
    given = arguments("--model", str(file))
    make, is_shared, robot = command._source(given)
    async with served(make, is_shared=is_shared, robot=robot) as server, opened(server.url) as page:
        assert (await page.receive("run"))["opposition"] is None
        run = await done(page, "wait")
        assert (run["kind"], run["lines"]) == ("wrong", ["waiting is for a run against the surroundings"])


def test_wrong_use(file: Path, tmp_path: Path) -> None:
    for words in (
        ["--bridge", "127.0.0.1:1"],
        [str(tmp_path / "tank.cif")],
        [str(tmp_path / "gate.rsup")],
        [str(file), "--deployment", "layer"],
    ):
        with pytest.raises(UsageError, match="--counter-strategy is for"):
            command.run(arguments("--counter-strategy", *words))
    file.write_text(GATE.replace("goal always eventually Door.ajar", ""), encoding="utf-8")
    with pytest.raises(CommandError, match="no counter-strategy"):
        command.run(arguments("--counter-strategy", str(file)))
