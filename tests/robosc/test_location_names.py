"""A service called like a component: whatever prints its location says which of both is meant, and is read back so."""

import json
from pathlib import Path

import pytest

from robosc.automata import to_automata
from robosc.cli.main import main
from robosc.conditions.literals import Vocabulary
from robosc.conditions.rendering import diagram_lines
from robosc.explanation import RequestError
from robosc.explanation.requests import ModelQuestionReader
from robosc.expressions import StateTest, Unary
from robosc.expressions.text import automaton_text, expression_text
from robosc.model.structure import Deployment
from robosc.model_checking import properties_of
from robosc.model_checking.formulas import Condition
from robosc.source import SourceFile
from robosc.supervisor import DecisionDiagram, DecisionNode
from robosc.supervisor.diagram import Subject, SubjectDomain
from support.models import model_of

ROBOT = """robot R {
    interface i use S from p
    component Drive { behaviour { initial marked state waiting { transition goto idle } marked state idle { } } }
    component Arm {
        service Drive with request: none, response: none links i
        service calm with request: none, response: none links i
        incoming message go with type: none
        incoming message back with type: none
        behaviour {
            initial marked state near { on request to go goto far }
            marked state far {
                on request to back goto near
                on response from Drive goto lost
                on error from Drive goto lost
                on response from calm goto lost
                on error from calm goto lost
            }
            state lost { transition goto near }
        }
    }
    requirement never Arm.lost
}"""
"""The supervisor blocks leaving while an answer of a service may come."""

NAMES = frozenset({"Drive", "Arm"})


@pytest.fixture
def path(tmp_path: Path) -> str:
    file = tmp_path / "robot.rscd"
    file.write_text(ROBOT, encoding="utf-8")
    return str(file)


def output(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    main(list(arguments))
    return " ".join(capsys.readouterr().out.split())


def test_the_word_stands_only_where_it_is_needed() -> None:
    assert automaton_text("service Drive", NAMES) == "service Drive"
    assert automaton_text("service calm", NAMES) == "calm"
    assert automaton_text("Drive", NAMES) == "Drive"
    assert expression_text(Unary("not", StateTest("service Drive", "idle")), NAMES) == "!service Drive.idle"


@pytest.mark.parametrize("automaton", ["Drive", "service Drive", "service calm"])
def test_what_is_printed_is_read_back(automaton: str) -> None:
    model = model_of(ROBOT)
    text = expression_text(StateTest(automaton, "idle"), NAMES)
    (found,) = properties_of(model, [SourceFile("p", text)])
    assert found.formula == Condition(StateTest(automaton, "idle"))
    system = to_automata(model, Deployment.CONTROLLER)
    assert ModelQuestionReader(system, model).state(f"{text}, !{text}") is not None
    assert ModelQuestionReader(system, model).state(text) == StateTest(automaton, "idle")
    assert ModelQuestionReader(system, model).state(f"not {text}") == Unary("not", StateTest(automaton, "idle"))


def test_a_word_before_a_name_that_is_no_service() -> None:
    model = model_of(ROBOT)
    system = to_automata(model, Deployment.CONTROLLER)
    for text in ("service Arm.near", "action Drive.idle", "service go.idle"):
        with pytest.raises(RequestError, match=f"unknown {text.split()[0]}"):
            ModelQuestionReader(system, model).state(text)


def test_the_conditions_of_the_supervisor(capsys: pytest.CaptureFixture[str], path: str, tmp_path: Path) -> None:
    printed = output(capsys, "synth", path)
    assert "go.request not service Drive.waiting and not calm.waiting" in printed
    document = json.loads(output(capsys, "synth", path, "--json"))
    assert document["summary"]["added"]["go.request"] == "not service Drive.waiting and not calm.waiting"
    assert main(["generate", path, "--target", "python", "-o", str(tmp_path / "out")]) == 0
    code = "".join(file.read_text(encoding="utf-8") for file in (tmp_path / "out").rglob("*.py"))
    assert "not service Drive.waiting and not calm.waiting" in code


def test_the_lines_of_a_diagram() -> None:
    node = DecisionNode("service Drive", None, (0, 1), (0, 1))
    domains: dict[Subject, SubjectDomain] = {("service Drive", None): SubjectDomain(("idle", "waiting"), None)}
    (line,) = diagram_lines(DecisionDiagram((node,), 2), Vocabulary(domains, NAMES))
    assert "service Drive." in str(line)


def test_runs_of_properties(capsys: pytest.CaptureFixture[str], path: str) -> None:
    printed = output(capsys, "verify", path, "--property", "AG !service Drive.waiting")
    assert "service Drive = idle" in printed and "calm = idle" in printed and "service calm" not in printed
    assert "Drive.request service Drive = waiting" in printed
    # The rest of a verdict is a property again.
    document = json.loads(
        output(capsys, "verify", path, "--json", "--property", "EF (service Drive.waiting and EG !calm.failed)")
    )
    left = [item["property"] for item in document["properties"][0]["run"]["left"]]
    for text in left:
        properties_of(model_of(ROBOT), [SourceFile("p", text)])


def test_tables_and_explanations(capsys: pytest.CaptureFixture[str], path: str) -> None:
    table = output(capsys, "explore", path)
    assert "Drive Arm service Drive calm" in table
    assert "service Drive = idle" in output(capsys, "explore", path, "--dot")
    state = json.loads(output(capsys, "explore", path, "--json"))["states"][0]
    assert state["communications"] == {"Drive": "idle", "calm": "idle"}
    assert state["components"] == {"Drive": "waiting", "Arm": "near"}
    printed = output(capsys, "explain-synthesis", path, "--event", "Drive", "--state", "service Drive.waiting")
    assert "service Drive is waiting, where it has no transition on Drive.request" in printed
    assert "Drive is waiting" in printed.replace("service Drive is waiting", "") or "Drive is idle" in printed
