"""`robosc verify --property` on the command line, and what its documentation shows."""

import json
import re
import shlex
from pathlib import Path
from typing import Any

import pytest

import robosc
from robosc.cli.main import main
from support.goal_porter import PORTER
from support.models import EMPTY, EXAMPLES

ROOT = Path(__file__).parents[3]
PAGE = (ROOT / "docs" / "verification.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```(\w*)\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE)
COMMANDS = [line for kind, block in BLOCKS if not kind for line in block.splitlines() if line.startswith("robosc ")]
NAVIGATION = str(EXAMPLES / "navigation" / "navigation.rscd")
HOLDS, FAILS = "AG EF Navigator.ready", "AG (Navigator.driving => AF Navigator.ready)"


def test_verdicts_decide_the_exit_status(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["verify", NAVIGATION, "--property", HOLDS]) == 0
    assert capsys.readouterr().out == f"holds  {HOLDS}\n"
    assert main(["verify", NAVIGATION, "--property", HOLDS, "--property", f"bad: {FAILS}"]) == 1
    first, second, *_ = capsys.readouterr().out.splitlines()
    assert (first, second) == (f"holds  {HOLDS}", f"FAILS  bad: {FAILS}")


def test_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["verify", NAVIGATION, "--json", "--property", f"bad: {FAILS}", "--property", HOLDS]) == 1
    found: dict[str, Any] = json.loads(capsys.readouterr().out)
    assert found["status"] == "fails"
    bad, good = found["properties"]
    assert (bad["name"], bad["property"], bad["holds"], good["holds"], good["run"]) == ("bad", FAILS, False, True, None)
    run = bad["run"]
    assert (run["kind"], run["loop"], run["left"]) == ("counterexample", 5, [])
    assert run["events"][-2:] == ["navigate.request", "person.response"]
    assert len(run["states"]) == len(run["events"]) + 1
    assert main(["explore", NAVIGATION, "--json"]) == 0
    graph: dict[str, Any] = json.loads(capsys.readouterr().out)
    numbers = [
        next(number for number, other in enumerate(graph["states"]) if state.items() <= other.items())
        for state in run["states"]
    ]
    steps = {tuple(step) for step in graph["transitions"]}
    assert numbers[0] == graph["initial"]
    assert all(step in steps for step in zip(numbers, run["events"], numbers[1:], strict=False))
    assert numbers[run["loop"]] == numbers[-1]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "verify needs a supervisor file and its model"),
        (["--property", HOLDS, "--limit", "5"], "they need FILE.rsup"),
        (["--property", HOLDS, "--strict"], "they need FILE.rsup"),
        (["--properties", "nowhere.txt"], "cannot read nowhere.txt"),
        (["--property", "AG Navigator.reday"], "property 1:1:14: error"),
        (["--property", HOLDS, "--property", ""], "property 2:1:1: error"),
        (["--property", HOLDS, "--engine", "nothing"], "unknown engine"),
    ],
)
def test_wrong_use(arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["verify", NAVIGATION, *arguments]) == 2
    assert message in capsys.readouterr().err


def test_quiet_prints_what_fails(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["verify", NAVIGATION, "-q", "--property", HOLDS]) == 0
    assert capsys.readouterr().out == ""
    assert main(["verify", NAVIGATION, "-q", "--property", HOLDS, "--property", "reachable false"]) == 1
    assert capsys.readouterr().out.startswith("FAILS  reachable false\n")


def test_properties_of_a_supervisor_that_is_handed_over(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = str(tmp_path / "nav.rsup")
    assert main(["synth", NAVIGATION, "-o", path]) == 0
    capsys.readouterr()
    assert main(["verify", path, NAVIGATION, "--property", HOLDS]) == 0
    assert capsys.readouterr().out == f"holds  {HOLDS}\n"
    assert main(["verify", path, NAVIGATION, "--property", FAILS]) == 1
    assert main(["verify", path, NAVIGATION, "--reorder"]) == 2
    capsys.readouterr()
    other = str(EXAMPLES / "maze_solver" / "maze_solver.rscd")
    assert main(["verify", path, other, "--property", "AG true"]) == 1
    assert "no right supervisor" in capsys.readouterr().out


def test_options_are_passed_to_the_engine(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["verify", NAVIGATION, "--reorder", "--property", HOLDS]) == 0
    assert main(["verify", NAVIGATION, "--max-nodes", "60", "--property", HOLDS]) == 1
    assert "BDD node limit 60 exceeded" in capsys.readouterr().err


def test_files_of_properties(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    listing = tmp_path / "p.txt"
    listing.write_text(f"# all\ngood: {HOLDS}\n", encoding="utf-8")
    assert main(["verify", NAVIGATION, "--properties", str(listing)]) == 0
    assert capsys.readouterr().out == f"holds  good: {HOLDS}\n"
    for content, message in ((b"# nothing\n", "there is no property"), (b"\xff", "not UTF-8"), (b"AG (", "p.txt:1:5")):
        listing.write_bytes(content)
        assert main(["verify", NAVIGATION, "--properties", str(listing)]) == 2
        assert message in capsys.readouterr().err
    assert main(["verify", NAVIGATION, "--json", "--properties", str(listing)]) == 2
    assert json.loads(capsys.readouterr().out)["diagnostics"][0]["line"] == 1


def test_without_a_supervisor(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = tmp_path / "empty.rscd"
    model.write_text(EMPTY, encoding="utf-8")
    assert main(["verify", str(model), "--property", "AG true"]) == 1
    assert "no supervisor exists" in capsys.readouterr().err
    assert main(["verify", str(model), "--json", "--property", "AG true"]) == 1
    found = json.loads(capsys.readouterr().out)
    assert found["status"] == "empty" and found["reason"].startswith("no supervisor exists")
    assert main(["synth", str(model), "--json"]) == 1
    assert found["explanation"] == json.loads(capsys.readouterr().out)["explanation"] is not None


def test_goals_that_cannot_be_reached(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = tmp_path / "porter.rscd"
    model.write_text("".join(line for line in PORTER.splitlines(True) if "assume" not in line), encoding="utf-8")
    assert main(["verify", str(model), "--property", "AG true"]) == 1
    shown = capsys.readouterr().err
    assert main(["verify", str(model), "--json", "--property", "AG true"]) == 1
    found = json.loads(capsys.readouterr().out)
    assert (found["status"], found["explanation"]) == ("model errors", None)
    assert main(["synth", str(model), "--json"]) == 1
    assert found["goals"] == json.loads(capsys.readouterr().out)["goals"]
    (blamed,) = found["goals"]["blamed"]
    assert blamed["text"] in shown
    assert robosc.verify(model, "AG true").report == found


def test_the_documentation(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "examples").symlink_to(EXAMPLES)
    statuses = [main(shlex.split(command)[1:]) for command in COMMANDS]
    assert statuses == [0, 0, 0, 1, 0]
    (shown,) = (block for kind, block in BLOCKS if block.startswith("FAILS"))
    assert shown in capsys.readouterr().out
    (listing,) = (block for kind, block in BLOCKS if kind == "properties")
    (tmp_path / "p.txt").write_text(listing, encoding="utf-8")
    assert main(["verify", "examples/navigation/navigation.rscd", "--properties", "p.txt"]) == 0
    assert capsys.readouterr().out.count("holds ") == 3
