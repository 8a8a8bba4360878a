"""`robosc plot`, `robosc convert-log` and `robosc check-log` as a user runs them."""

import json
from pathlib import Path

import pytest

from robosc.cli.main import main
from robosc.execution.interpreter import InterpretedSystem
from robosc.execution.runtime.event_log import json_line
from robosc.supervisor import encode
from support.execution import Bench
from support.generated import example_supervisor
from support.models import EXAMPLES

MODEL = str(EXAMPLES / "maze_solver" / "maze_solver.rscd")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the maze solver's supervisor and a log of it, to work in."""
    monkeypatch.chdir(tmp_path)
    supervisor = example_supervisor("maze_solver/maze_solver")
    (tmp_path / "maze.rsup").write_bytes(encode(supervisor))
    bench = Bench(InterpretedSystem(supervisor))
    bench.receive("/scan", {"ranges": [0.2] * 360})
    bench.tick(2)
    bench.receive("/rotate_done")
    bench.tick()
    bench.executor.restart()
    (tmp_path / "maze.jsonl").write_text("".join(map(json_line, bench.log.entries)), encoding="utf-8")
    return tmp_path


def change(folder: Path, old: str, new: str) -> None:
    file = folder / "maze.jsonl"
    text = file.read_text(encoding="utf-8")
    assert old in text
    file.write_text(text.replace(old, new, 1), encoding="utf-8")


@pytest.mark.parametrize("model", ["maze.rsup", MODEL])
def test_a_right_log_passes(model: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check-log", "maze.jsonl", "--model", model]) == 0
    output = "passed against the supervisor of MazeSolver: 6 events, 2 of them requests, 1 restarts"
    assert capsys.readouterr().out == f"maze.jsonl: {output}\n"


def test_a_wrong_log_fails_with_the_line(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    change(folder, '"rotate_left.request"', '"move.request"')
    assert main(["check-log", "maze.jsonl", "--model", "maze.rsup"]) == 1
    wrong, last = capsys.readouterr().out.splitlines()
    assert wrong.startswith("maze.jsonl:4: move.request was not allowed: its requirements do not hold; the state after")
    assert "Rotator is in idle, not in " in wrong
    output = "failed: 1 violations against the supervisor of MazeSolver: 6 events, 2 of them requests, 1 restarts"
    assert last == f"maze.jsonl: {output}"


def test_for_machines(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    change(folder, '"scan_front.response"', '"scan_back.response"')
    with (folder / "maze.jsonl").open("a") as file:
        file.write('{"time":')
    assert main(["check-log", "maze.jsonl", "--model", "maze.rsup", "--deployment", "layer", "--json"]) == 1
    found = json.loads(capsys.readouterr().out)
    assert found | {"violations": ...} == {
        "status": "failed", "model": "MazeSolver", "events": 6, "requests": 2, "blocked": 0, "unjudged": 0,
        "restarts": 1, "dropped": 0, "notes": ["line 8, the last one, is cut off and was left out"],
        "violation_count": 1, "violations": ...,
    }  # fmt: skip
    assert [(item["line"], item["message"]) for item in found["violations"]] == [
        (1, "scan_back.response is not an event of the model")
    ]


def test_a_plot_is_drawn(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plot", "maze.jsonl"]) == 0
    assert capsys.readouterr().out == "maze.png: 6 events of 5 kinds, 0.000 s to 0.300 s\n"
    assert (folder / "maze.png").read_bytes().startswith(b"\x89PNG")
    arguments = ["--from", "0.05", "--to", "0.15", "--event", "*.request", "--title", "Left", "--json"]
    assert main(["plot", "maze.jsonl", "-o", "left.svg", *arguments]) == 0
    assert json.loads(capsys.readouterr().out) == {
        "file": "left.svg", "events": 1, "marks": 1, "blocked": 0, "curves": [],
        "bands": ["LidarSensor", "Rotator", "Platform"], "rows": ["rotate_left.request"], "begin_s": 0.05,
        "end_s": 0.15, "notes": [],
    }  # fmt: skip
    assert "Left" in (folder / "left.svg").read_text(encoding="utf-8")


def test_a_log_is_converted(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["convert-log", "maze.jsonl"]) == 0
    assert capsys.readouterr().out == "maze.mcap: 22 messages on 8 topics of 7 entries\n"
    assert (folder / "maze.mcap").read_bytes().startswith(b"\x89MCAP")
    assert main(["convert-log", "maze.jsonl", "--layout", "maze.json"]) == 0
    assert capsys.readouterr().out.endswith("maze.json: a layout for Foxglove\n")
    assert "/robosc/state/Rotator.data" in (folder / "maze.json").read_text(encoding="utf-8")
    assert main(["convert-log", "maze.jsonl", "-o", "other.mcap", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["file"], found["entries"], found["motion"], found["notes"]) == ("other.mcap", 7, False, [])
    assert found["topics"]["/robosc/state/Rotator"] == "std_msgs/msg/String"


@pytest.mark.parametrize(
    ("arguments", "status", "problem"),
    [
        (["plot", "none.jsonl"], 2, "cannot read none.jsonl: No such file or directory"),
        (["plot", "maze.rsup"], 2, "maze.rsup, line 1: "),
        (["plot", "maze.jsonl", "-o", "maze.jsonl"], 2, "maze.jsonl is the log itself"),
        (["plot", "maze.jsonl", "-o", "maze.gif"], 2, "plots are .png, .svg, .html files"),
        (["plot", "maze.jsonl", "-o", "no/maze.png"], 2, "cannot write no/maze.png: No such file or directory"),
        (["plot", "maze.jsonl", "--event", "halt"], 2, "no event of the log is called 'halt'"),
        (["plot", "maze.jsonl", "--variable", "Lidar.*"], 2, "no variable of the log is called 'Lidar.*'; there are "),
        (["plot", "maze.jsonl", "--clock", "robot"], 2, "--clock robot needs a record of the robot's motion"),
        (["plot", "maze.jsonl", "--clock", "robot", "--motion", "none.jsonl"], 2, "none.jsonl: there is no such file"),
        (["plot", "maze.jsonl", "--motion", "motion.jsonl"], 2, "--motion goes with --clock robot"),
        (["plot", "maze.jsonl", "--from", "9"], 2, "no event in the time window"),
        (["convert-log", "none.jsonl"], 2, "cannot read none.jsonl: No such file or directory"),
        (["convert-log", "maze.rsup"], 2, "maze.rsup, line 1: "),
        (["convert-log", "maze.jsonl", "-o", "maze.bag"], 2, "maze.bag: logs are converted to .mcap files"),
        (["convert-log", "maze.jsonl", "-o", "no/maze.mcap"], 2, "cannot write no/maze.mcap: No such file"),
        (["convert-log", "maze.jsonl", "--layout", "maze.yaml"], 2, "maze.yaml: layouts of Foxglove are .json files"),
        (["convert-log", "maze.jsonl", "--layout", "no/maze.json"], 2, "cannot write no/maze.json: No such file"),
        (["convert-log", "maze.jsonl", "--motion", "none.jsonl"], 2, "none.jsonl: there is no such file"),
        (
            ["convert-log", "maze.jsonl", "--motion", "maze.jsonl"],
            2,
            "maze.jsonl:1: is not an entry of a motion record",
        ),
        (["check-log", "maze.jsonl", "--model", "none.rscd"], 2, "there is no file none.rscd"),
        (["check-log", "maze.jsonl", "--model", "none.rsup"], 2, "cannot read none.rsup"),
        (["check-log", "none.jsonl", "--model", "maze.rsup"], 2, "cannot read none.jsonl"),
        (["check-log", MODEL, "--model", "maze.rsup"], 2, "line 1: no entry of an event log"),
    ],
)
def test_what_cannot_be_is_one_clear_message(
    folder: Path, arguments: list[str], status: int, problem: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments) == status
    output = capsys.readouterr()
    assert (output.out, output.err.count("\n")) == ("", 1)
    assert problem in output.err
