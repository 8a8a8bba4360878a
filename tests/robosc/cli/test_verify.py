"""`robosc verify` as a user runs it: what is printed, and with which exit status."""

import json
from pathlib import Path
from typing import Any

import pytest

from robosc.cli.main import main
from robosc.supervisor import decode, encode
from support.models import EXAMPLES
from support.mutants import change

NAVIGATION = str(EXAMPLES / "navigation" / "navigation.rscd")
MAZE_SOLVER = str(EXAMPLES / "maze_solver" / "maze_solver.rscd")


@pytest.fixture(scope="module")
def right(tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("verify") / "nav.rsup"
    assert main(["synth", NAVIGATION, "-o", str(path)]) == 0
    return str(path)


@pytest.fixture(scope="module")
def wrong(right: str) -> str:
    """The supervisor without what it adds."""
    path = Path(right).with_name("wrong.rsup")
    path.write_bytes(encode(change(decode(Path(right).read_bytes()), added=())))
    return str(path)


def _json(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, dict[str, Any]]:
    capsys.readouterr()
    status = main(["verify", *arguments, "--json"])
    document = json.loads(capsys.readouterr().out)
    assert isinstance(document, dict)
    return status, document


def test_a_right_supervisor_passes(capsys: pytest.CaptureFixture[str], right: str) -> None:
    capsys.readouterr()
    assert main(["verify", right, NAVIGATION]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == f"{right}: passed: a right supervisor of {NAVIGATION}"
    assert "  maximally permissive  passed" in lines
    assert "  controlled            784 states, 4792 transitions (controller)" in lines
    assert main(["verify", right, NAVIGATION, "-q", "--strict", "--deployment", "controller"]) == 0
    assert capsys.readouterr().out == ""


def test_a_wrong_one_fails_with_a_run_into_the_trouble(capsys: pytest.CaptureFixture[str], wrong: str) -> None:
    capsys.readouterr()
    assert main(["verify", "-q", wrong, NAVIGATION]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == f"{wrong}: failed: no right supervisor of {NAVIGATION}"
    at = lines.index("not safe: navigate.error can take a variable out of its range")
    assert lines[at + 1].startswith("  after: ")
    assert lines[at + 1].count("navigate.error") == 3
    assert "Navigator.failures = 3" in lines[at + 2]


def test_json(capsys: pytest.CaptureFixture[str], right: str, wrong: str) -> None:
    status, document = _json(capsys, right, NAVIGATION)
    assert (status, document["status"], document["faults"], document["remarks"]) == (0, "passed", [], [])
    assert (document["states"], document["transitions"]) == (784, 4792)
    assert set(document["checks"].values()) == {"passed"}
    status, document = _json(capsys, wrong, NAVIGATION)
    assert (status, document["status"], document["checks"]["safe"]) == (1, "failed", "failed")
    fault = next(fault for fault in document["faults"] if fault["check"] == "safe")
    assert (fault["shortest"], fault["trace"][-1]) == (True, "navigate.request")
    assert fault["state"]["variables"]["Navigator.failures"] == 3
    assert fault["state"]["communications"]["navigate"] == "executing"


def test_what_is_not_checked_is_said_and_counts_where_it_is_to(capsys: pytest.CaptureFixture[str], right: str) -> None:
    capsys.readouterr()
    assert main(["verify", right, NAVIGATION, "--limit", "0"]) == 0
    out = capsys.readouterr().out
    assert "  safe                  not checked" in out
    assert "note: the certificate says 'passed' for what was not checked here: safe, controllable" in out
    assert main(["verify", right, NAVIGATION, "--limit", "0", "--strict"]) == 1
    assert "failed: not checked: safe, controllable, nonblocking, maximally permissive" in capsys.readouterr().out


def test_another_model_and_another_deployment_fail(capsys: pytest.CaptureFixture[str], right: str) -> None:
    status, document = _json(capsys, right, MAZE_SOLVER)
    assert (status, document["checks"]["model"], document["checks"]["safe"]) == (1, "failed", "not checked")
    assert document["faults"][0]["message"] == "name: 'Navigation' in the supervisor, 'MazeSolver' in the model"
    status, document = _json(capsys, right, NAVIGATION, "--deployment", "layer")
    assert (status, document["checks"]["deployment"]) == (1, "failed")


def test_what_is_no_supervisor_fails(capsys: pytest.CaptureFixture[str], tmp_path: Path, right: str) -> None:
    path = tmp_path / "x.rsup"
    path.write_text("{}")
    capsys.readouterr()
    assert main(["verify", str(path), NAVIGATION]) == 1
    assert "no supervisor file" in capsys.readouterr().err
    status, document = _json(capsys, str(path), NAVIGATION)
    assert (status, document["status"]) == (1, "failed")
    broken = tmp_path / "broken.rscd"
    broken.write_text("robot R { requirement x needs true }")
    assert main(["verify", right, str(broken)]) == 1
    captured = capsys.readouterr()
    assert "unknown-name" in captured.err
    assert "the texts hold no model that it could be for" in captured.out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([NAVIGATION], "verify needs a supervisor file and its model"),
        (["/nowhere.rsup", NAVIGATION], "cannot read /nowhere.rsup"),
        ([NAVIGATION, "/nowhere.rscd"], "there is no file /nowhere.rscd"),
        ([NAVIGATION, NAVIGATION, "--engine", "steam"], "unknown engine 'steam'"),
    ],
)
def test_wrong_use(capsys: pytest.CaptureFixture[str], arguments: list[str], message: str) -> None:
    assert main(["verify", *arguments]) == 2
    assert message in capsys.readouterr().err


@pytest.mark.parametrize("limit", ["-1", "many", "9999999999999"])
def test_a_limit_is_a_number(limit: str, right: str) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["verify", right, NAVIGATION, "--limit", limit])
    assert ended.value.code == 2


def test_synthesis_verifies_as_far_as_it_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["synth", NAVIGATION, "--verify-limit", "0", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["summary"]["certificate"]["safe"] == "not checked"
