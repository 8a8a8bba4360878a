"""`robosc explain-synthesis`, and the explanation that `robosc synth` and its kin print without a supervisor."""

from pathlib import Path

import pytest

from robosc.cli.main import main
from support.commands import run_json
from support.models import EXAMPLES

NAVIGATION = str(EXAMPLES / "navigation" / "navigation.rscd")


def test_every_controllable_event_and_warnings(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explain-synthesis", NAVIGATION]) == 0
    captured = capsys.readouterr()
    assert captured.err == ""
    assert "navigate.request: restricted\n" in captured.out
    assert "navigate.error can take Navigator.failures, which is 3, out of its range" in captured.out
    assert "warning: " in captured.out
    status, document = run_json(capsys, "explain-synthesis", NAVIGATION)
    assert (status, document["status"]) == (0, "supervisor")
    explanation = document["explanation"]
    assert explanation["empty"] is None
    reasons = {item["event"]: [reason["kind"] for reason in item["reasons"]] for item in explanation["events"]}
    assert reasons["navigate.request"] == ["requirement", "requirement", "requirement", "supervisor"]
    assert reasons["calibrate.reset"] == []


def test_one_event_in_a_state(capsys: pytest.CaptureFixture[str]) -> None:
    state = "Navigator.failures = 3, navigate.idle, Localisation.known, PersonDetector.distance = far"
    arguments = ["explain-synthesis", NAVIGATION, "--event", "navigate", "--at", state]
    status, document = run_json(capsys, *arguments)
    assert status == 0
    (event,) = document["explanation"]["state"]["events"]
    assert (event["event"], event["can_happen"]) == ("navigate.request", False)
    (reason,) = event["reasons"]
    assert reason["kind"] == "supervisor"
    assert reason["trouble"]["kind"] == "bad"
    assert main(arguments) == 0
    assert "navigate.request: cannot happen\n" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        (["--event", "nevigate"], "unknown event 'nevigate'; did you mean 'navigate'?"),
        (["--after", "navigate"], "'navigate.request' cannot happen in the initial state: "),
        (["--state", "Navigator"], "'Navigator' is not a condition"),
        (["--engine", "abacus"], "unknown engine 'abacus'"),
    ],
)
def test_wrong_use(capsys: pytest.CaptureFixture[str], arguments: list[str], problem: str) -> None:
    assert main(["explain-synthesis", NAVIGATION, *arguments]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith(f"robosc: {problem}")
    assert captured.err.count("\n") == 1


def test_without_a_supervisor(capsys: pytest.CaptureFixture[str], empty: str) -> None:
    assert main(["explain-synthesis", empty]) == 1
    captured = capsys.readouterr()
    assert captured.out.startswith("empty.rscd: no supervisor exists\ntrouble:\n")
    assert "to blame: " in captured.out
    status, document = run_json(capsys, "explain-synthesis", empty)
    assert (status, document["status"]) == (1, "empty")
    explanation = document["explanation"]["empty"]
    assert explanation["trouble"]["way"]["events"] == ["broken.response"]
    assert [item["part"]["kind"] for item in explanation["blamed"]] == ["marking"]
    assert explanation["is_minimal"]
    # The commands that need a supervisor print the same.
    for command in (["synth"], ["explore"], ["check", "--synthesize"], ["generate", "--target", "python", "-o", "x"]):
        status, found = run_json(capsys, *command, empty)
        assert (status, found["explanation"]) == (1, explanation)
        assert main([*command, empty]) == 1
        assert captured.out.partition("\n")[2] in capsys.readouterr().err


def test_a_supervisor_has_nothing_to_explain(capsys: pytest.CaptureFixture[str]) -> None:
    status, document = run_json(capsys, "synth", NAVIGATION)
    assert (status, document["explanation"]) == (0, None)


def test_a_model_with_errors(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    path = tmp_path / "wrong.rscd"
    path.write_text("robot R { requirement x needs y }", encoding="utf-8")
    assert main(["explain-synthesis", str(path)]) == 1
    assert "unknown-name" in capsys.readouterr().err
    status, document = run_json(capsys, "explain-synthesis", str(path))
    assert (status, document["status"], document["explanation"]) == (1, "model errors", None)


ROOM = """robot Courier {
    component Door {
        outgoing message opened with type: none
        behaviour { initial marked state shut { on response from opened goto ajar } marked state ajar { } }
    }
    component Base {
        incoming message enter with type: none
        incoming message leave with type: none
        behaviour {
            initial marked state outside { on request to enter goto inside }
            marked state inside { on request to leave goto outside }
        }
    }
    requirement enter needs Door.ajar
    mission delivery { visit Base.inside then Base.outside }
}
"""


@pytest.fixture
def room(tmp_path: Path) -> str:
    path = tmp_path / "room.rscd"
    path.write_text(ROOM, encoding="utf-8")
    return str(path)


def test_a_mission_that_cannot_be_made(room: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["synth", room]) == 1
    synth = capsys.readouterr().err
    assert main(["explain-synthesis", room]) == 1
    captured = capsys.readouterr()
    assert captured.err == ""
    assert captured.out.splitlines() == [
        "room.rscd: no strategy is made for the missions",
        "can be kept from coming true:",
        "  room.rscd:15:30: visit Base.inside (visit 1 of mission delivery)",
        "to blame: this alone is enough",
        "  room.rscd:14:5: requirement enter needs Door.ajar",
        "can be reached, if the surroundings do so, with:",
        "  assume Door.shut leads to Door.ajar",
        "'robosc simulate' and 'robosc view' with '--counter-strategy' play the surroundings, against you",
    ]
    assert synth.endswith(captured.out)
    status, document = run_json(capsys, "explain-synthesis", room)
    assert (status, document["status"], document["explanation"]) == (1, "model errors", None)
    assert [item["code"] for item in document["diagnostics"]] == ["unreachable-goal"]
    assert document["goals"]["helpful"] == ["Door.shut leads to Door.ajar"]
    assert document["goals"] == run_json(capsys, "synth", room)[1]["goals"]


def test_a_question_is_answered_whatever_the_goals(room: str, capsys: pytest.CaptureFixture[str]) -> None:
    for words in (["--event", "leave"], ["--state", "Base.inside"], ["--after", ""]):
        assert main(["explain-synthesis", room, *words]) == 0
        assert "leave.request" in capsys.readouterr().out
    assert main(["explain-synthesis", room, "--deployment", "layer"]) == 0
    assert "enter.request: restricted" in capsys.readouterr().out


def test_a_mission_that_can_be_made_and_an_assumption_that_can_be_broken(
    room: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assume = "    assume {}\n    mission"
    Path(room).write_text(ROOM.replace("    mission", assume.format("Door.shut leads to Door.ajar")), encoding="utf-8")
    assert main(["explain-synthesis", room]) == 0
    assert "leave.request: free" in capsys.readouterr().out
    Path(room).write_text(ROOM.replace("    mission", assume.format("always eventually Base.inside")), encoding="utf-8")
    assert main(["explain-synthesis", room]) == 1
    assert "preventable-assumption" in capsys.readouterr().err
