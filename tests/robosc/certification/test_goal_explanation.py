"""Explanations of goals that cannot be reached: their whole text, and their values."""

from dataclasses import replace
from functools import partial

import pytest
from msgspec import structs

from robosc.certification import make_supervisor
from robosc.certification.goals import GoalExplanation, NearestPlace
from robosc.explanation.parts import Part
from robosc.source import Location
from robosc.strategies import blame_goals
from support.models import bundle_of

NEAR = NearestPlace("goal once A.far", False, False, ("go.request",), {"A": "near", "A.n": 2}, ("on.request",))


@pytest.mark.parametrize(
    ("near", "text"),
    [
        (
            NEAR,
            "goal once A.far that can be reached: after go.request (A = near, A.n = 2); "
            "on.request is not allowed there",
        ),
        (
            replace(NEAR, events=(), missing=("on.request", "there.response")),
            "goal once A.far that can be reached: in the initial state (A = near, A.n = 2); on.request is not allowed "
            "there, with which the behaviours alone would go on: on.request, there.response",
        ),
        (
            replace(NEAR, is_reached=True, missing=()),
            "goal once A.far: it is true after go.request (A = near, A.n = 2), but not again and again",
        ),
        (
            replace(NEAR, is_reached=True, has_others=True, missing=()),
            "goal once A.far: it is true after go.request (A = near, A.n = 2), but not again and again together with "
            "the others",
        ),
    ],
)
def test_the_nearest_place(near: NearestPlace, text: str) -> None:
    assert str(near) == text


GOAL = Part("goal", "goal once A.far", Location("m.rscd", 3, 5, 4))
FIRST, SECOND = (Part("requirement", f"requirement {name} needs A.near", None) for name in ("on", "off"))
WHY = GoalExplanation((GOAL,), False, (FIRST,), True, ("A.near leads to A.far",), None, True)


@pytest.mark.parametrize(
    ("why", "lines"),
    [
        (
            WHY,
            [
                "can be kept from coming true:",
                "  m.rscd:3:5: goal once A.far",
                "to blame: this alone is enough",
                "  requirement on needs A.near",
                "can be reached, if the surroundings do so, with:",
                "  assume A.near leads to A.far",
            ],
        ),
        (
            replace(WHY, is_hopeless=True, blamed=(FIRST, SECOND), helpful=(), nearest=NEAR),
            [
                "cannot be reached, whatever the surroundings do:",
                "  m.rscd:3:5: goal once A.far",
                "to blame: each of these is needed, and together they are enough",
                "  requirement on needs A.near",
                "  requirement off needs A.near",
                f"the nearest to {NEAR}",
            ],
        ),
        (
            replace(WHY, blamed=(), helpful=()),
            [
                "can be kept from coming true:",
                "  m.rscd:3:5: goal once A.far",
                "no requirement is to blame: without any it is the same",
            ],
        ),
        (
            replace(WHY, blamed=(), is_minimal=False, helpful=()),
            [
                "can be kept from coming true:",
                "  m.rscd:3:5: goal once A.far",
                "which requirements are to blame is not known: the search was given up",
            ],
        ),
        # A server's text shows what it is.
        (
            replace(WHY, goals=(structs.replace(GOAL, text="\x1b[2J"),), blamed=(), helpful=()),
            [
                "can be kept from coming true:",
                "  m.rscd:3:5: \\x1b[2J",
                "no requirement is to blame: without any it is the same",
            ],
        ),
    ],
)
def test_the_whole_text(why: GoalExplanation, lines: list[str]) -> None:
    assert str(why).split("\n") == lines


DOOR = """robot Porter {
    component Door {
        incoming message open with type: none
        outgoing message opened with type: none
        behaviour {
            initial marked state shut { on request to open goto opening }
            marked state opening { on response from opened goto ajar }
            marked state ajar { }
        }
    }
    component Base {
        incoming message enter with type: none
        behaviour { initial marked state outside { on request to enter goto inside } marked state inside { } }
    }
    requirement enter needs Door.ajar
    §
}"""


def explanation_of(statements: str) -> GoalExplanation:
    found = make_supervisor(bundle_of(DOOR.replace("§", statements))).explanation
    assert isinstance(found, GoalExplanation)
    return found


def part(kind: str, text: str, line: int, column: int, length: int) -> dict[str, object]:
    place = {"file": "model.rscd", "line": line, "column": column, "length": length}
    return {"kind": kind, "text": text, "location": place}


def test_an_invariant_and_a_visit_of_the_second_mission() -> None:
    found = explanation_of(
        "requirement never Base.inside and Door.ajar mission a { visit Base.outside }\n"
        "    mission b { visit Base.outside then Base.inside }"
    )
    assert found.document() == {
        "goals": [part("visit", "visit Base.inside (visit 2 of mission b)", 17, 41, 11)],
        "is_hopeless": True,
        "blamed": [
            part("requirement", "requirement enter needs Door.ajar", 15, 5, 11),
            part("invariant", "requirement never Base.inside and Door.ajar", 16, 5, 11),
        ],
        "is_minimal": True,
        "helpful": [],
        "nearest": {
            "goal": "visit Base.inside (visit 2 of mission b)",
            "is_reached": False,
            "events": [],
            "state": {"Door": "shut", "Base": "outside"},
            "missing": ["enter.request"],
        },
        "has_counter_strategy": True,
    }
    assert found.nearest is not None and not found.nearest.has_others


def test_goals_that_exclude_each_other() -> None:
    found = explanation_of(
        "goal always eventually Base.inside goal always eventually Base.outside assume Door.opening leads to Door.ajar"
    )
    assert found.nearest is not None and found.nearest.has_others and found.nearest.is_reached


def test_what_helps_and_what_keeps_a_goal_from_coming_true() -> None:
    found = explanation_of("goal once Base.inside")
    assert (found.is_hopeless, found.nearest, found.has_counter_strategy) == (False, None, True)
    assert found.helpful == ("Door.opening leads to Door.ajar",)


def test_a_search_that_is_given_up_blames_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("robosc.strategies.blame_goals", partial(blame_goals, effort=0, least_effort=10))
    found = explanation_of("goal once Base.inside")
    assert (found.is_minimal, found.blamed) == (False, ())
