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
from robosc_experiments import corpus, evaluate
from robosc_experiments.cycles.times import CycleTimes
from robosc_experiments.lines_of_code import CodeSize
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
    first, lengths, *rest = capsys.readouterr().out.splitlines()
    assert first == "maze over serial, maze-rooms: 10 events, log: no violation, motion: as required"
    assert lengths.startswith("lines of code, times the model's (medians of 1): c99 ")
    assert rest[:3] == [
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
    assert found["cycles"] == []
    (run,) = found["runs"]
    assert (run["events"], run["requests"], run["violations"], run["figures"]["way_m"]) == (10, 3, 0, "0.19")


def write_corpus(folder: Path) -> None:
    """Write models with and without a recorded run, and a library."""
    text = 'robot R { component A { outgoing message m with identifier: "/m", type: none } }\n'
    files = {
        "robots/recorded.rscd": text,
        "robots/recorded.json": '{"findings": [], "run": []}',
        "robots/broken.rscd": "robot",
        "robots/broken.json": '{"findings": ["error"]}',
        "robots/new.rscd": "robot",
        "parts.rscd": "library L { interface i use Twist from geometry_msgs }\n",
    }
    for name, content in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(content, encoding="utf-8")


def test_the_code_of_all_recorded_models_is_counted_unless_experiments_are_chosen(
    asked: list[tuple[Any, ...]], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    write_corpus(Path("corpus"))
    monkeypatch.setattr(corpus, "CORPUS", Path("corpus"))
    said: list[str] = []
    monkeypatch.setattr("robosc.cli.output.ProgressLine.show", lambda self, text: said.append(text))
    assert call("--no-runs", "--no-cycles", "--json") == 0
    assert asked == []
    found = json.loads(capsys.readouterr().out)["lines_of_code"]
    assert list(found) == ["maze", "line", "robots/new", "robots/recorded"]
    assert said[-2:] == ["lines of code, model 1 of 2: robots/new", "lines of code, model 2 of 2: robots/recorded"]
    assert found["robots/new"] == {"model": {"lines": 1, "files": 1, "why_not": "the model has errors"}}
    sizes = found["robots/recorded"]
    assert list(sizes) == ["model", "c99", "cif", "promela", "python", "ros1", "ros1-cpp", "ros2", "ros2-cpp"]
    assert sizes["model"] == {"lines": 1, "files": 1, "why_not": ""}
    assert all(size["lines"] for size in sizes.values())
    assert call("--experiment", "maze", "--no-runs", "--no-cycles", "--json") == 0
    assert list(json.loads(capsys.readouterr().out)["lines_of_code"]) == ["maze"]


@pytest.mark.usefixtures("asked")
def test_models_are_files_and_folders(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    sizes = (CodeSize("model", 10, 1), CodeSize("cif", 15, 1))
    monkeypatch.setattr(corpus, "scenario_sizes", lambda model: sizes)
    monkeypatch.setattr(evaluate, "_sizes", lambda experiment: (sizes, None))
    write_corpus(Path("mine"))
    options = ("--no-runs", "--no-cycles", "--experiment", "maze", "--models", "mine/robots/recorded.rscd")
    Path("mine/maze.rscd").write_text("robot", encoding="utf-8")
    assert call(*options, "--models", "mine", "--json") == 0
    # A file is counted once; one with a recording that has no run is left out of a folder, not by name.
    found = json.loads(capsys.readouterr().out)["lines_of_code"]
    assert list(found) == ["maze", "recorded", "mine/maze.rscd", "robots/new"]
    assert call(*options, "--models", "mine/robots/broken.rscd", "-o", "here") == 0
    assert capsys.readouterr().out.splitlines()[:2] == [
        "lines of code, times the model's (medians of 3): cif 1.5",
        "No scenario was run.",
    ]
    assert "## Scenarios" not in Path("here/report.md").read_text(encoding="utf-8")


@pytest.mark.usefixtures("asked")
def test_models_of_one_name_have_two() -> None:
    write_corpus(Path("one"))
    write_corpus(Path("two"))
    found = corpus.models_of([Path("one/robots/new.rscd"), Path("two/robots/new.rscd")])
    assert found == {"new": Path("one/robots/new.rscd"), "two/robots/new.rscd": Path("two/robots/new.rscd")}


def test_the_corpus_has_the_robots_and_no_model_with_errors() -> None:
    found = corpus.models_of([corpus.CORPUS])
    assert {"robots/arm", "robots/maze_solver", "robots/line_follower", "grammar/taus"} <= set(found)
    assert not [name for name in found if name.startswith(("errors/", "shared/"))]


@pytest.mark.usefixtures("asked")
def test_cycles_are_in_the_document(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    rows = (
        CycleTimes("maze", "generated C, roscpp", True, (5.0, 1.0, 9.0, 2.0), 3000, median_us=4.0),
        CycleTimes("maze", "generated C, rclcpp", True, None, why="rclcpp is not installed"),
    )
    monkeypatch.setattr(evaluate, "_cycles", lambda experiment, controller: rows)
    assert call("--experiment", "maze", "--no-runs", "--json") == 0
    assert [
        (row["what"], row["median_us"], row["cycles"], row["not_measured"])
        for row in json.loads(capsys.readouterr().out)["cycles"]
    ] == [
        ("generated C, roscpp", 4.0, 3000, ""),
        ("generated C, rclcpp", None, 0, "rclcpp is not installed"),
    ]


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        (["--scene", "maze-rooms"], "--scene is the world of one experiment: name it with --experiment"),
        (["--experiment", "maze", "-o", "taken"], "cannot write taken: File exists"),
        (["--models", "nowhere"], "cannot read nowhere: No such file or directory"),
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
