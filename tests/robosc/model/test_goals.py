"""Goals and assumptions of the checked model."""

import json

import msgspec
import pytest
from hypothesis import given, settings

from robosc.errors import Severity
from robosc.expressions import Binary, StateTest, Unary, VariableRead
from robosc.formatting import format_text
from robosc.model.check import check
from robosc.model.structure import Assumption, Goal, GoalForm, Model
from robosc.source import Bundle, SourceFile
from support.effort import examples
from support.model_text import model_text
from support.models import bundle_of, checked, model_of
from support.random_models import models, random_bundle

ROBOT = """robot R {
    component Door {
        outgoing message seen with type: integer(0..9)
        behaviour {
            variable level: integer(0..9)
            variable fed: integer(0..9)
            variable aside: integer(0..9)
            on response from seen do level := fed, fed := value, aside := value
            initial marked state shut { on response from seen goto open }
            marked state open { on response from seen goto shut }
        }
    }
    §
}
"""
OPEN, SHUT = StateTest("Door", "open"), StateTest("Door", "shut")


def robot(*statements: str) -> str:
    return ROBOT.replace("§", "\n    ".join(statements))


def test_each_form_reaches_the_model() -> None:
    model = model_of(
        robot(
            "goal always eventually Door.open",
            "assume Door.shut leads to not Door.shut",
            "goal Door.shut leads to Door.open",
            "assume allow always eventually Door.open",
            "goal once Door.open",
            "assume allow Door.shut leads to Door.open",
        )
    )
    assert model.goals == (
        Goal(GoalForm.ALWAYS_EVENTUALLY, OPEN),
        Goal(GoalForm.LEADS_TO, OPEN, SHUT),
        Goal(GoalForm.ONCE, OPEN),
    )
    assert model.assumptions == (
        Assumption(GoalForm.LEADS_TO, Unary("not", SHUT), SHUT),
        Assumption(GoalForm.ALWAYS_EVENTUALLY, OPEN, is_allowed=True),
        Assumption(GoalForm.LEADS_TO, OPEN, SHUT, is_allowed=True),
    )
    assert model.goals[1].expressions == (SHUT, OPEN)
    assert model.assumptions[1].expressions == (OPEN,)


def test_places_point_at_the_statements() -> None:
    found = checked(robot("goal once Door.open", "assume always eventually Door.open", "goal once Door.shut"))
    assert found.places is not None
    assert [(place.line, place.length) for place in found.places.goals] == [(13, 4), (15, 4)]
    assert [(place.line, place.length) for place in found.places.assumptions] == [(14, 6)]


@pytest.mark.parametrize(
    "statement",
    [
        "goal always eventually Door.level > 2",
        "goal once Door.level > 2",
        "goal Door.level > 2 leads to Door.open",
        "goal Door.open leads to Door.level > 2",
        "assume always eventually Door.level > 2",
        "assume allow Door.level > 2 leads to Door.open",
    ],
)
def test_variables_that_are_read_take_part_in_synthesis(statement: str) -> None:
    behaviour = model_of(robot(statement)).components[0].behaviour
    assert behaviour is not None
    assert {item.name for item in behaviour.variables if item.is_synthesis} == {"level", "fed"}
    (found,) = [
        item
        for item in checked(robot(statement).replace("level: integer(0..9)", "level: integer")).diagnostics
        if item.severity is Severity.ERROR
    ]
    assert found.code == "integer-range-required"


def test_words_of_goals_are_names_of_everything() -> None:
    model = model_of(
        """robot goal {
        constant eventually: boolean = true
        datatype enum leads from integer to { value > 0 -> allow default -> assume }
        component once {
            outgoing message goal with type: leads
            incoming message assume with type: none
            behaviour {
                variable allow: leads
                on response from goal do allow := value
                initial marked state always { on request to assume goto eventually }
                marked state eventually { on request to assume goto always }
            }
        }
        component allow from other import once
        requirement assume needs once.always or allow.goal
        goal once.always leads to eventually
        goal once once.allow = allow and allow.goal
        goal always eventually once.eventually
        assume allow.goal leads to once.always
        assume allow eventually leads to once.allow = assume
    }""",
        other="library other { component once { behaviour { initial marked state goal { } } } }",
    )
    assert [item.form for item in model.goals] == [GoalForm.LEADS_TO, GoalForm.ONCE, GoalForm.ALWAYS_EVENTUALLY]
    assert model.goals[0].trigger == StateTest("once", "always")
    compared = model.goals[1].condition
    assert isinstance(compared, Binary) and isinstance(compared.left, Binary)
    assert compared.left.left == VariableRead("once", "allow")
    assert [item.is_allowed for item in model.assumptions] == [False, True]


def test_a_model_without_goals_is_written_as_before() -> None:
    """The names of its fields are those that supervisor files have had."""
    model = model_of(robot("requirement never Door.level > 8"))
    fields = json.loads(msgspec.json.encode(model))
    assert {"goals", "assumptions"} & fields.keys() == set()
    younger = ("goals", "assumptions", "missions", "preferences", "limits")
    assert list(fields) == [name for name in Model.__struct_fields__ if name not in younger]
    goal = json.loads(msgspec.json.encode(model_of(robot("goal once Door.open"))))["goals"]
    assert [sorted(item) for item in goal] == [["condition", "form"]]


def test_an_imported_component_brings_no_goal_but_a_robot_can_read_it() -> None:
    library = robot().replace("robot R", "library Doors")
    text = "robot R { component Gate from Doors import Door goal once Gate.open }"
    assert model_of(text, Doors=library).goals == (Goal(GoalForm.ONCE, StateTest("Gate", "open")),)


@settings(max_examples=examples(60))
@given(models(goals=True))
def test_random_models_with_goals_have_no_errors(bundle: Bundle) -> None:
    found = check(bundle)
    assert [item for item in found.diagnostics if item.severity is Severity.ERROR] == []
    assert found.model is not None
    assert found.model.goals or found.model.assumptions


def test_random_models_have_every_form_and_the_same_rest_without() -> None:
    forms = set[tuple[object, ...]]()
    for seed in range(60):
        model, rest = (check(random_bundle(seed, goals=goals)).model for goals in (True, False))
        assert model is not None and rest is not None
        assert not rest.goals and not rest.assumptions
        assert {item.name for item in model.communications} == {item.name for item in rest.communications}
        forms |= {(type(item), item.form) for item in model.goals}
        forms |= {(type(item), item.form, item.is_allowed) for item in model.assumptions}
    assert len(forms) == 3 + 4


def test_the_text_of_a_model_has_its_goals() -> None:
    read = 0
    for seed in range(20):
        model = check(random_bundle(seed, goals=True)).model
        assert model is not None
        again = check(bundle_of(model_text(model))).model
        if again is not None:
            # An expression is printed shorter than it was written, a text once printed is not.
            assert model_text(again) == model_text(model)
            assert [item.form for item in again.goals] == [item.form for item in model.goals]
            allowed = [[(item.form, item.is_allowed) for item in one.assumptions] for one in (model, again)]
            assert allowed[0] == allowed[1]
            read += 1
    assert read > 10


@given(models(goals=True))
@settings(max_examples=examples(30))
def test_the_layout_does_not_matter(bundle: Bundle) -> None:
    text = format_text(bundle.main.text)
    assert format_text(text) == text
    one, other = (check(Bundle(SourceFile("m", item), bundle.libraries)).model for item in (bundle.main.text, text))
    assert one == other
