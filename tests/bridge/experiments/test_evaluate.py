"""`robosc evaluate` as a user calls it, with runs that were recorded before."""

import argparse
import json
import sys
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from robosc.cli.main import guarded, make_parser
from robosc.cli.plugins import Plugin
from robosc_experiments import evaluate
from robosc_experiments.scenario import Outcome, ScenarioError
from support.models import EXAMPLES
from support.recorded_runs import recorded

# The code of a model that is counted is the same each time.
_sizes = cache(evaluate._sizes)


@pytest.fixture
def asked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[tuple[Any, ...]]:
    """Requests that the scenarios received; over ROS 1 none can be run."""
    found: list[tuple[Any, ...]] = []

    def run(folder: Path, scene: str, *, speed: float, say: Any, seed: int) -> Outcome:
        found.append((folder.name, scene, speed, seed))
        say("on its way")
        return recorded(folder)

    def fail(folder: Path, scene: str, **options: Any) -> Outcome:
        raise ScenarioError("ROS 1 is not installed")

    for name, function in (("maze", run), ("line", run), ("ros1", fail)):
        module = ModuleType(f"robosc_experiments.{name}")
        vars(module).update(run_maze=function, run_line=function, MODEL=EXAMPLES / "maze_solver" / "maze_solver.rscd")
        monkeypatch.setitem(sys.modules, module.__name__, module)
    monkeypatch.setattr(evaluate, "_sizes", _sizes)
    monkeypatch.chdir(tmp_path)
    return found


def call(*arguments: str) -> int:
    """The command, as it is called through `robosc`."""
    parser = make_parser([Plugin("evaluate", evaluate)])
    parsed = parser.parse_args(["evaluate", *arguments])
    return guarded("robosc", lambda: int(parsed.run(parsed)), as_json=parsed.json)


def test_a_report_is_written(asked: list[tuple[Any, ...]], capsys: pytest.CaptureFixture[str]) -> None:
    for number in (1, 2):
        assert call("--experiment", "maze", "--no-cycles") == 0
        assert Path(f"out/evaluation/maze-serial-{number}/sequence.html").is_file()
    assert asked == [("maze-serial-1", "maze-rooms", 10.0, 0), ("maze-serial-2", "maze-rooms", 10.0, 0)]
    assert capsys.readouterr().out.splitlines()[:4] == [
        "maze over serial, maze-rooms: 10 events, log: no violation, motion: as required",
        "Nothing was wrong in 1 scenario.",
        "out/evaluation/report.html",
        "out/evaluation/report.md",
    ]
    text = Path("out/evaluation/report.md").read_text(encoding="utf-8")
    assert "maze-serial-2/sequence.png" in text
    assert "Table I" not in text
    assert "Figure 13" in text


def test_a_line_is_followed_on_each_of_its_scenes_or_on_the_one_that_is_wanted(
    asked: list[tuple[Any, ...]], capsys: pytest.CaptureFixture[str]
) -> None:
    # The reason against another connection is reported once for all scenes.
    assert call("--experiment", "line", "--connection", "serial", "--connection", "ros1", "--no-cycles", "--json") == 1
    assert asked == [("line-serial-1", "line-oval", 2.0, 0), ("line-serial-2", "line-curves", 2.0, 0)]
    found = json.loads(capsys.readouterr().out)
    assert found["not_run"] == [{"experiment": "line", "connection": "ros1", "why": "ROS 1 is not installed"}]
    assert call("--experiment", "line", "--scene", "line-curves", "--no-cycles", "--seed", "0") == 0
    assert asked[2:] == [("line-serial-3", "line-curves", 2.0, 0)]


def test_a_scenario_that_cannot_be_run_is_reported_beside_those_that_can(
    asked: list[tuple[Any, ...]], capsys: pytest.CaptureFixture[str]
) -> None:
    options = ("--connection", "serial", "--connection", "ros1", "--scene", "mine.yaml", "--speed", "4", "--seed", "7")
    assert call("--experiment", "maze", *options, "-o", "here", "--no-cycles", "--json") == 1
    assert asked == [("maze-serial-1", "mine.yaml", 4.0, 7)]
    found = json.loads(capsys.readouterr().out)
    assert (found["status"], found["report"]) == ("failed", "here/report.html")
    assert found["not_run"] == [{"experiment": "maze", "connection": "ros1", "why": "ROS 1 is not installed"}]
    (run,) = found["runs"]
    assert (run["events"], run["requests"], run["violations"], run["figures"]["way_m"]) == (10, 3, 0, "0.19")


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        (["--scene", "maze-rooms"], "--scene is the world of one experiment: name it with --experiment"),
        (["--experiment", "maze", "-o", "taken"], "cannot write taken: File exists"),
    ],
)
@pytest.mark.usefixtures("asked")
def test_what_cannot_be_is_one_clear_message(
    arguments: list[str], problem: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("taken").touch()
    assert call(*arguments) == 2
    assert capsys.readouterr().err == f"robosc: {problem}\n"


@pytest.mark.parametrize(
    "arguments",
    [
        ["--speed", "0"],
        ["--speed", "nan"],
        ["--experiment", "golf"],
        ["--seed", "x"],
        ["--seed", "-1"],
        ["--seed", "1000000000000000"],
    ],
)
def test_arguments_that_are_wrong(arguments: list[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        call(*arguments)
    assert caught.value.code == 2


def test_the_plugin_is_a_command() -> None:
    (commands,) = (
        item
        for item in make_parser([Plugin("evaluate", evaluate)])._actions
        if isinstance(item, argparse._SubParsersAction)
    )
    assert "evaluate" in commands.choices
