"""Goals in the words of the language, what a strategy chooses for them, and what it remembers."""

import json

import pytest

from robosc.certification import make_supervisor
from robosc.conditions.goals import assumption_text, goal_text, goals_in_words
from robosc.conditions.rendering import in_words
from robosc.conditions.summary import strategy_lines, summary_json, summary_text
from robosc.expressions import Binary, StateTest, Unary, VariableRead
from robosc.expressions.text import expression_text
from robosc.supervisor import Supervisor
from support.models import bundle_of, model_of

COURIER = """robot Courier {
    component Door {
        incoming message open with identifier: "/door/open", type: none
        outgoing message opened with identifier: "/door/opened", type: none
        outgoing message closed with identifier: "/door/closed", type: none
        behaviour {
            initial marked state shut { on request to open goto opening }
            state opening { on response from opened goto ajar }
            state ajar { on response from closed goto shut }
        }
    }
    component Caller {
        outgoing message call with identifier: "/call", type: none
        behaviour {
            initial marked state quiet { on response from call goto waiting }
            marked state waiting { on request to enter goto quiet }
        }
    }
    component Base {
        incoming message enter with identifier: "/enter", type: none
        incoming message leave with identifier: "/leave", type: none
        behaviour {
            initial marked state outside { on request to enter goto inside }
            marked state inside { on request to leave goto outside }
        }
    }
    assume allow always eventually not Door.opening
    goal Caller.waiting leads to Base.inside
    goal always eventually Base.outside and not Door.opening
    goal once Door.ajar or Base.inside
}
"""


@pytest.fixture(scope="module")
def supervisor() -> Supervisor:
    made = make_supervisor(bundle_of(COURIER)).supervisor
    assert made is not None
    return made


def test_goals_and_assumptions_are_written_as_a_user_writes_them() -> None:
    model = model_of(COURIER)
    assert [goal_text(goal) for goal in model.goals] == [
        "Caller.waiting leads to Base.inside",
        "always eventually Base.outside and not Door.opening",
        "once Door.ajar or Base.inside",
    ]
    assert [assumption_text(item) for item in model.assumptions] == ["allow always eventually not Door.opening"]
    lines = "".join(f"    goal {goal_text(goal)}\n" for goal in model.goals)
    again = model_of(COURIER.partition("    goal ")[0] + lines + "}\n")
    assert again.goals == model.goals


def test_what_is_remembered_reads_as_sentences(supervisor: Supervisor) -> None:
    names = [place.name for place in supervisor.executable.obligations.places]
    assert names == ["goal 1 is owed", "goal 3 was reached"]
    owed, reached = (VariableRead("goal memory", name) for name in names)
    condition = Binary("and", Unary("not", owed), Binary("or", Unary("not", reached), StateTest("Door", "ajar")))
    assert in_words(condition, ()) == "goal 1 is not owed and (goal 3 was not reached or Door.ajar)"
    assert expression_text(Unary("not", Binary("or", owed, reached))) == "!(goal 1 is owed or goal 3 was reached)"
    met = VariableRead("goal memory", "requirement 2 of navigate was met")
    assert expression_text(Unary("not", met)) == "requirement 2 of navigate was not met"


def test_the_summary_tells_for_each_goal_what_is_requested_where(supervisor: Supervisor) -> None:
    text = summary_text(supervisor)
    start = text.index("  the strategy approaches")
    assert (
        text[start : text.index("  controller\n")]
        == """\
  the strategy approaches its goals in turn; it requests the first that applies
    for goal 1, Caller.waiting leads to Base.inside
      enter.request  always
    for goal 2, always eventually Base.outside and not Door.opening
      leave.request  where Base.inside
      nothing        otherwise
    for goal 3, once Door.ajar or Base.inside
      open.request   where not Door.opening
      enter.request  meanwhile for others, where Caller.waiting
      nothing        otherwise
  it assumes of the surroundings
    assumption 1, allow always eventually not Door.opening
"""
    )
    assert "    goals                 passed\n" in text
    found = json.loads(json.dumps(summary_json(supervisor)))
    assert found["goals"][1] == {
        "name": "goal 2",
        "goal": "always eventually Base.outside and not Door.opening",
        "choices": [{"event": "leave.request", "condition": "Base.inside"}],
        "meanwhile": [],
    }
    assert found["assumptions"] == ["allow always eventually not Door.opening"]
    assert found["certificate"]["goals"] == "passed"


def test_a_condition_that_no_formula_tells_is_told_node_by_node(
    supervisor: Supervisor, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("robosc.conditions.rendering.Formulas.formula", lambda *arguments, **options: None)
    assert "where a decision diagram of 1 node, to be read from [1] on:" in summary_text(supervisor)
    (choice,) = summary_json(supervisor)["goals"][1]["choices"]  # type: ignore[index]
    assert choice["diagram"] == [{"node": 1, "cases": [{"if": "Base.inside", "then": True}], "else": False}]


def test_a_strategy_that_never_requests_anything_is_told_as_such() -> None:
    goals = "goal once Base.outside\n    goal once Door.shut\n}\n"
    made = make_supervisor(bundle_of(COURIER.partition("    assume ")[0] + goals)).supervisor
    assert made is not None
    assert strategy_lines(made) == [
        "the strategy never requests anything: nothing has to be requested for its goals",
        "  for goal 1, once Base.outside",
        "    nothing  at all",
        "  for goal 2, once Door.shut",
        "    nothing  at all",
    ]


def test_without_goals_there_is_nothing_to_tell() -> None:
    without = "\n".join(line for line in COURIER.splitlines() if " goal " not in line and " assume " not in line)
    made = make_supervisor(bundle_of(without)).supervisor
    assert made is not None and goals_in_words(made) == ()
    assert not {"strategy", "goals", "assumes"} & set(summary_text(made).split())
    found = summary_json(made)
    assert (found["goals"], found["assumptions"]) == ([], [])
    assert "goals" not in found["certificate"]  # type: ignore[operator]
