"""`robosc verify` as a user runs it: what is printed, and with which exit status."""

import json
from pathlib import Path
from typing import Any

import pytest

from robosc.cli.main import main
from robosc.supervisor import decode, encode
from robosc.targets import generate
from support.goal_porter import PORTER
from support.missions import courier
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
    assert "  controlled            1044 states, 6504 transitions (controller)" in lines
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
    assert (document["states"], document["transitions"]) == (1044, 6504)
    assert set(document["checks"].values()) == {"passed"}
    status, document = _json(capsys, wrong, NAVIGATION)
    assert (status, document["status"], document["checks"]["safe"]) == (1, "failed", "failed")
    fault = next(fault for fault in document["faults"] if fault["check"] == "safe")
    assert (fault["shortest"], fault["trace"][-1]) == (True, "navigate.request")
    assert fault["state"]["variables"]["Navigator.failures"] == 3
    assert fault["state"]["communications"]["navigate"] == "executing"


def test_what_is_not_checked_is_said_and_counts_where_it_is_to(capsys: pytest.CaptureFixture[str], right: str) -> None:
    capsys.readouterr()
    assert main(["verify", right, NAVIGATION, "--limit", "0"]) == 1
    out = capsys.readouterr().out
    assert out.startswith(f"{right}: not checked: safe, controllable, nonblocking, maximally permissive\n")
    assert "  safe                  not checked" in out
    assert "note: the certificate says 'passed' for what was not checked here: safe, controllable" in out
    assert main(["verify", right, NAVIGATION, "--limit", "0", "--strict"]) == 1
    assert "not checked: safe, controllable, nonblocking, maximally permissive" in capsys.readouterr().out
    assert _json(capsys, right, NAVIGATION, "--limit", "0")[1]["status"] == "not checked"


def test_a_strategy_is_checked_and_it_is_said_where_it_is_not(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    (tmp_path / "porter.rscd").write_text(PORTER)
    model, right, idle = (str(tmp_path / name) for name in ("porter.rscd", "porter.rsup", "idle.rsup"))
    assert main(["synth", model, "-o", right]) == 0
    capsys.readouterr()
    assert main(["verify", right, model]) == 0
    assert "  goals                 passed" in capsys.readouterr().out.splitlines()
    # Its states are few enough, but not its positions under the strategy, nor the work for sets of them.
    assert main(["verify", right, model, "--limit", "20"]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == f"{right}: not checked: maximally permissive, goals"
    assert "  nonblocking           passed" in lines and "  goals                 not checked" in lines
    assert any("; goals not checked: more than 2 positions, and the symbolic search takes" in line for line in lines)
    assert lines[-1].startswith("note: the certificate says 'passed' for what was not checked here: ")
    assert lines[-1].endswith(", goals")
    status, document = _json(capsys, right, model, "--limit", "20")
    assert (status, document["status"], document["checks"]["goals"]) == (1, "not checked", "not checked")
    assert "; goals not checked: " in document["method"]
    # A strategy that requests nothing keeps callers waiting.
    supervisor = decode(Path(right).read_bytes())
    assert supervisor.strategy is not None
    Path(idle).write_bytes(encode(change(supervisor, strategy=change(supervisor.strategy, modes=((), ())))))
    assert main(["verify", "-q", idle, model]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == f"{idle}: failed: no right supervisor of {model}"
    assert lines[1] == "certificate: it says 'goals: passed', which is false"
    assert lines[2].startswith("goals: under the strategy goal 1 may never come true again")
    assert lines[3] == "  after (there may be shorter runs): call.response"
    assert lines[4] == "  in: Door = shut, Base = outside, Caller = waiting"
    status, document = _json(capsys, idle, model)
    assert (status, document["status"], document["checks"]["goals"]) == (1, "failed", "failed")
    assert document["faults"][-1]["trace"] == ["call.response"]


COURIER = courier(
    "mission rounds while Operator.working {",
    "    visit Base.kitchen then Base.dock",
    "    on Caller.waiting from anywhere visit Base.office",
    "}",
    "mission home { visit Base.dock or Operator.working }",
    "prefer to_office over to_kitchen",
)


@pytest.fixture(scope="module")
def missions(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, str]:
    """Return the paths of a model with missions and of its supervisor."""
    folder = tmp_path_factory.mktemp("missions")
    (folder / "courier.rscd").write_text(COURIER)
    model, path = (str(folder / name) for name in ("courier.rscd", "courier.rsup"))
    assert main(["synth", model, "-o", path]) == 0
    return model, path


def test_missions_go_from_the_text_through_a_file_into_a_package(
    capsys: pytest.CaptureFixture[str], missions: tuple[str, str], tmp_path: Path
) -> None:
    model, path = missions
    capsys.readouterr()
    assert main(["verify", path, model, "--strict"]) == 0
    assert "  goals                 passed" in capsys.readouterr().out.splitlines()
    supervisor = decode(Path(path).read_bytes())
    assert encode(supervisor) == Path(path).read_bytes()
    assert supervisor.strategy is not None and len(supervisor.strategy.modes) == 4
    for target in ("python", "c99"):
        assert main(["generate", model, "--target", target, "-o", str(tmp_path / target)]) == 0
        written = generate(supervisor, target)
        assert {name: (tmp_path / target / name).read_text(encoding="utf-8") for name in written} == dict(written)


@pytest.mark.parametrize(
    ("is_idle", "words"),
    [
        (True, "under the strategy visit 1 of mission rounds may never"),
        (False, "the strategy chooses a request that is"),
    ],
)
def test_a_strategy_that_makes_no_visit_or_exchanges_them_fails(
    capsys: pytest.CaptureFixture[str], missions: tuple[str, str], tmp_path: Path, is_idle: bool, words: str
) -> None:
    model, path = missions
    supervisor = decode(Path(path).read_bytes())
    assert supervisor.strategy is not None
    kitchen, dock, *others = supervisor.strategy.modes
    bad = tmp_path / "bad.rsup"
    modes = (() if is_idle else dock, kitchen, *others)
    bad.write_bytes(encode(change(supervisor, strategy=change(supervisor.strategy, modes=modes))))
    capsys.readouterr()
    assert main(["verify", "-q", str(bad), model]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert lines[2].startswith(f"goals: {words}")


NOWHERE = {"node": "state", "component": "Lift", "state": "up"}


@pytest.mark.parametrize(
    ("path", "new", "words"),
    [
        ("strategy.modes", [], "the strategy has not one mode for each goal and each visit"),
        ("strategy.modes", [[]] * 3, "the strategy has not one mode for each goal and each visit"),
        ("strategy.modes", [[]] * 5, "the strategy has not one mode for each goal and each visit"),
        ("strategy", None, "a strategy belongs to a controller with goals or missions"),
        ("certificate.goals", None, "the certificate speaks of goals exactly where there is a strategy"),
        ("model.missions", [], "a strategy belongs to a controller with goals or missions"),
        ("model.missions.0.visits", [], "mission rounds: a mission and each of its detours need a visit"),
        ("model.missions.0.visits.0", NOWHERE, "mission rounds: there is no "),
        ("model.missions.0.detours.0.visits.0", NOWHERE, "mission rounds: there is no "),
        ("model.missions.0.detours.0.trigger", NOWHERE, "mission rounds: there is no "),
        ("model.missions.0.condition", NOWHERE, "mission rounds: there is no "),
        ("model.preferences.0.preferred", ["fly"], "preference 1: there is no communication fly"),
        ("model.preferences.0.others", ["call"], "preference 1: call has no request"),
    ],
)
def test_a_file_whose_missions_were_tampered_with_is_refused(
    capsys: pytest.CaptureFixture[str], missions: tuple[str, str], tmp_path: Path, path: str, new: Any, words: str
) -> None:
    model, right = missions
    document = json.loads(Path(right).read_bytes())
    at = document["supervisor"]
    *steps, last = [int(step) if step.isdigit() else step for step in path.split(".")]
    for step in steps:
        at = at[step]
    at[last] = new
    bad = tmp_path / "bad.rsup"
    bad.write_text(json.dumps(document), encoding="utf-8")
    capsys.readouterr()
    assert main(["verify", str(bad), model]) == 1
    printed = capsys.readouterr()
    assert words in printed.out + printed.err


def test_a_supervisor_without_its_model_is_wrong_use(capsys: pytest.CaptureFixture[str], right: str) -> None:
    assert main(["verify", right]) == 2
    assert main(["verify", right, "--property", "AG true"]) == 2
    assert capsys.readouterr().err.count("verify needs its model, too") == 2


WIDE = """robot Wide {
    component A {
        incoming message up with identifier: "/up", type: none
        incoming message down with identifier: "/down", type: none
        outgoing message got with identifier: "/got", type: none
        behaviour {
            variable n: integer(0..1000) = 5
            variable m: integer(0..1000) = 9
            initial marked state a { on request to up goto b on response from got }
            state b { on request to down goto a on response from got goto c }
            state c { on request to down goto a }
        }
    }
    requirement never A.c and A.n < A.m
    requirement up needs A.n < A.m
}
"""


def test_a_false_figure_does_not_prevent_the_search(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """The symbolic verifier gives up on comparing two wide integers, and the file says it is too large to search."""
    model, right, bad = (tmp_path / name for name in ("wide.rscd", "right.rsup", "bad.rsup"))
    model.write_text(WIDE, encoding="utf-8")
    assert main(["synth", str(model), "-o", str(right)]) == 0
    document = json.loads(right.read_bytes())
    supervisor = document["supervisor"]
    assert supervisor["added"]
    supervisor["added"] = []
    supervisor["certificate"] |= {"states": "9" * 9, "transitions": None}
    bad.write_text(json.dumps(document), encoding="utf-8")
    status, result = _json(capsys, str(bad), str(model))
    assert (status, result["status"], result["checks"]["safe"]) == (1, "failed", "failed")


LIVELOCK = """robot Live {
    component C { behaviour {
        initial marked state a { transition goto b }
        state b { transition goto a }
    } }
}
"""


def test_a_false_claim_about_the_controller_is_found(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    model, right, bad = (tmp_path / name for name in ("live.rscd", "right.rsup", "bad.rsup"))
    model.write_text(LIVELOCK, encoding="utf-8")
    assert main(["synth", "--allow-livelock", str(model), "-o", str(right)]) == 0
    assert main(["verify", str(right), str(model)]) == 0
    document = json.loads(right.read_bytes())
    assert document["supervisor"]["certificate"]["controller"]["finite_response"] == "failed"
    document["supervisor"]["certificate"]["controller"]["finite_response"] = "passed"
    bad.write_text(json.dumps(document), encoding="utf-8")
    status, result = _json(capsys, str(bad), str(model))
    assert (status, result["checks"]["certificate"]) == (1, "failed")
    assert result["faults"][0]["message"] == "it says 'finite response of the controller: passed', which is false"


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
    assert "not a supervisor file" in capsys.readouterr().err
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


def test_synthesis_verifies_up_to_the_given_limit(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["synth", NAVIGATION, "--verify-limit", "0", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["summary"]["certificate"]["safe"] == "not checked"


def test_synthesis_checks_a_strategy_up_to_the_given_limit(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    (tmp_path / "porter.rscd").write_text(PORTER)
    for limit, outcome in (("20", "not checked"), ("1000", "passed")):
        assert main(["synth", str(tmp_path / "porter.rscd"), "--verify-limit", limit, "--json"]) == 0
        certificate = json.loads(capsys.readouterr().out)["summary"]["certificate"]
        assert (certificate["nonblocking"], certificate["goals"]) == ("passed", outcome)
        how = "; goals not checked: " if outcome == "not checked" else "; goals by symbolic search (more than 10 "
        assert how in certificate["method"]
