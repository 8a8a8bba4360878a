"""Missions and preferences of the checked model."""

import json
from collections.abc import Sequence
from itertools import permutations

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robosc.errors import Severity
from robosc.expressions import Binary, StateTest, VariableRead
from robosc.formatting import format_text
from robosc.model.check import check
from robosc.model.preferences import contradiction
from robosc.model.structure import Detour, Mission, Preference
from robosc.source import Bundle, SourceFile
from support.effort import examples
from support.model_text import model_text
from support.models import bundle_of, checked, model_of
from support.random_models import random_bundle

ROBOT = """robot R {
    component Door {
        outgoing message seen with type: integer(0..9)
        outgoing message moved with type: none
        incoming message charge with type: none
        incoming message drive with type: none
        service ask with request: none, response: none links trigger
        behaviour {
            variable level: integer(0..9)
            variable fed: integer(0..9)
            variable aside: integer(0..9)
            on response from seen do level := fed, fed := value, aside := value
            initial marked state shut { on response from moved goto open }
            marked state open { on response from moved goto shut }
        }
    }
    interface trigger use Trigger from std_srvs
    §
}
"""
OPEN, SHUT = StateTest("Door", "open"), StateTest("Door", "shut")
LINE = 18


def robot(*statements: str) -> str:
    return ROBOT.replace("§", "\n    ".join(statements))


def codes(*statements: str) -> list[tuple[str, int, int]]:
    """Return the codes, lines and columns of what is found in the robot with some statements."""
    found = checked(robot(*statements)).diagnostics
    return [(item.code, item.location.line, item.location.column) for item in found if item.location]


def test_missions_and_preferences_reach_the_model() -> None:
    model = model_of(
        robot(
            "mission rounds { visit Door.open then Door.shut on Door.shut from anywhere visit Door.open then Door.shut }",
            "prefer charge over { drive, ask, drive }",
            "mission idle while Door.open { visit if Door.open then Door.shut else Door.open then Door.open }",
            "prefer { ask } over drive",
        )
    )
    assert model.missions[0] == Mission("rounds", (OPEN, SHUT), None, (Detour(SHUT, (OPEN, SHUT)),))
    assert model.missions[0].expressions == (OPEN, SHUT, SHUT, OPEN, SHUT)
    assert model.missions[0].all_visits == (OPEN, SHUT, OPEN, SHUT)
    assert model.missions[1].condition == OPEN
    assert len(model.missions[1].visits) == 2
    assert model.preferences == (Preference(("charge",), ("drive", "ask")), Preference(("ask",), ("drive",)))


def test_a_robot_has_goals_if_it_has_a_goal_or_a_mission() -> None:
    has = [model_of(robot(text)).has_goals for text in ("goal once Door.open", "mission m { visit Door.open }", "")]
    assert has == [True, True, False]
    assert not model_of(robot("assume always eventually Door.open", "prefer charge over drive")).has_goals


def test_places_point_at_the_statements_and_the_visits() -> None:
    found = checked(
        robot(
            "mission a { visit Door.open then (Door.level + 1) = 2 on Door.shut from anywhere visit not Door.open }",
            "goal once Door.open prefer charge over drive",
            "mission b { visit Door.shut }",
        )
    )
    assert found.places is not None
    assert [(place.line, place.length) for place in found.places.missions] == [(LINE, 7), (LINE + 2, 7)]
    assert [(place.line, place.column) for place in found.places.preferences] == [(LINE + 1, 25)]
    shown = [[(place.column, place.length) for place in places] for places in found.places.visits]
    assert shown == [[(23, 9), (38, 20), (92, 13)], [(23, 9)]]


@pytest.mark.parametrize(
    "statement",
    [
        "mission m { visit Door.level > 2 }",
        "mission m { visit Door.open then Door.level > 2 }",
        "mission m while Door.level > 2 { visit Door.open }",
        "mission m { visit Door.open on Door.level > 2 from anywhere visit Door.shut }",
        "mission m { visit Door.open on Door.shut from anywhere visit Door.open then Door.level > 2 }",
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


def test_words_of_missions_are_names_of_everything() -> None:
    model = model_of(
        """robot mission {
        constant anywhere: boolean = true
        datatype enum over from integer to { value > 0 -> visit default -> then }
        component while {
            outgoing message prefer with type: over
            incoming message mission with type: none
            incoming message over with type: none
            behaviour {
                variable visit: over
                on response from prefer do visit := value
                initial marked state then { on request to mission goto anywhere }
                marked state anywhere { on request to over goto then }
            }
        }
        component then from other import visit
        mission while while while.then { visit while.visit = visit then then.over then if anywhere then then.over
            else while.visit = then on anywhere from anywhere visit while.anywhere }
        mission then { visit not anywhere }
        prefer mission over over
        requirement mission needs then.over
    }""",
        other="library other { component visit { behaviour { initial marked state over { } } } }",
    )
    first, second = model.missions
    assert (first.name, second.name) == ("while", "then")
    assert first.condition == StateTest("while", "then")
    compared = first.visits[0]
    assert isinstance(compared, Binary) and compared.left == VariableRead("while", "visit")
    assert first.visits[1] == StateTest("then", "over")
    assert len(first.visits) == 3 and len(first.detours) == 1
    assert model.preferences == (Preference(("mission",), ("over",)),)


@pytest.mark.parametrize(
    ("text", "code", "words"),
    [
        ("mission m { visit value }", "no-value-here", "received data"),
        ("mission m while value > 1 { visit Door.open }", "no-value-here", "received data"),
        ("mission m { visit Door.open on value > 1 from anywhere visit Door.open }", "no-value-here", "received data"),
        ("mission m { visit seen }", "unknown-name", "'seen' is a message, not a value"),
        ("mission m { visit Door }", "type-mismatch", "is a component"),
        ("mission m { visit Door.open then Door.level }", "type-mismatch", "boolean is needed"),
        ("mission m { visit Door.open on Door.ajar from anywhere visit Door.open }", "unknown-name", "'ajar'"),
        ("mission m { visit Door.open on Door.shut from anywhere visit Door.ajar }", "unknown-name", "'ajar'"),
        ("goal once Door.open prefer charge over cahrge", "unknown-name", "did you mean 'charge'"),
        ("goal once Door.open prefer seen over charge", "preference-on-outgoing", "'seen' is an outgoing message"),
        ("goal once Door.open prefer charge over { drive, seen }", "preference-on-outgoing", "'seen' is"),
    ],
)
def test_what_stands_in_them_is_checked(text: str, code: str, words: str) -> None:
    (found,) = checked(robot(text)).diagnostics
    assert found.code == code
    assert words in found.message


def test_a_message_that_is_no_condition_is_told_how_it_becomes_one() -> None:
    (found,) = checked(robot("mission m { visit Door.open on seen from anywhere visit Door.shut }")).diagnostics
    assert found.fix.startswith("Let the behaviour of 'Door' keep it: 'on response from seen do last_seen := value'")


def test_missions_have_names_of_their_own() -> None:
    statements = ("mission a { visit Door.open }", "mission b { visit Door.open }", "mission A { visit Door.shut }")
    assert codes(*statements) == [("duplicate-mission", LINE + 2, 13)]
    assert codes("mission Door { visit Door.open }", "mission charge { visit Door.open }") == []


def test_a_preference_without_effect_is_told() -> None:
    place = ("unused-preference", LINE, 5)
    assert codes("prefer charge over drive") == [place]
    assert codes("prefer charge over drive", "assume always eventually Door.open") == [place]
    assert codes("prefer charge over {}", "goal once Door.open") == [place]
    assert codes("prefer {} over charge", "goal once Door.open") == [place]
    for aim in ("goal once Door.open", "mission m { visit Door.open }"):
        assert codes("prefer charge over drive", aim) == []


def test_preferences_in_a_circle_are_told_once_at_the_last_of_them() -> None:
    aim = "goal once Door.open"
    found = checked(
        robot("prefer charge over drive", aim, "prefer { ask, drive } over charge", "prefer ask over drive")
    )
    (error,) = found.diagnostics
    assert error.code == "contradictory-preferences"
    assert error.message == "no order of requests has 'drive' before 'charge' before 'drive'"
    assert error.location is not None and error.location.line == LINE + 2
    assert [item.location.line for item in error.related] == [LINE]
    (error,) = checked(robot(aim, "prefer charge over { drive, charge }")).diagnostics
    assert error.message == "no request comes before itself, as 'charge' would here"
    names = [f"m{number}" for number in range(9)]
    messages = " ".join(f"incoming message {name} with type: none" for name in names)
    circle = [f"prefer {one} over {other}" for one, other in zip(names, [*names[1:], names[0]], strict=True)]
    (error,) = checked(f"robot R {{ component C {{ {messages} }} goal once true {' '.join(circle)} }}").diagnostics
    assert (
        error.message
        == "no order of requests has 'm8' before 'm0' before 'm1' before 'm2' before 'm3' before ... before 'm8'"
    )


NAMES = ("a", "b", "c", "d")
sides = st.lists(st.sampled_from(NAMES), max_size=2, unique=True).map(tuple)


def is_obeyed(order: Sequence[str], preferences: Sequence[Preference]) -> bool:
    """Return True if an order of requests obeys all preferences."""
    pairs = ((one, other) for item in preferences for one in item.preferred for other in item.others)
    return all(order.index(one) < order.index(other) for one, other in pairs)


@settings(max_examples=examples(200))
@given(st.lists(st.builds(Preference, sides, sides), max_size=5))
def test_preferences_contradict_each_other_if_no_order_obeys_them(preferences: list[Preference]) -> None:
    found = contradiction(preferences)
    assert (found is None) == any(is_obeyed(order, preferences) for order in permutations(NAMES))
    if found is not None:
        following = (*found.names[1:], found.names[0])
        for one, number, other in zip(found.names, found.preferences, following, strict=True):
            assert one in preferences[number].preferred and other in preferences[number].others


def test_an_imported_component_brings_no_mission_but_a_robot_can_read_it() -> None:
    library = robot().replace("robot R", "library Doors")
    text = "robot R { component Gate from Doors import Door mission m { visit Gate.open } prefer charge over drive }"
    model = model_of(text, Doors=library)
    assert model.missions == (Mission("m", (StateTest("Gate", "open"),)),)
    assert model.preferences == (Preference(("charge",), ("drive",)),)


def test_a_library_with_a_mission_cannot_be_imported_in_silence() -> None:
    library = robot("mission m { visit Door.open }").replace("robot R", "library Doors")
    text = "robot R { component Door from Doors import Door }"
    found = check(Bundle(SourceFile("r.rscd", text), (SourceFile("doors.rscd", library),))).diagnostics
    assert [(item.code, item.location and item.location.file) for item in found] == [("goal-in-library", "doors.rscd")]


def test_missions_are_written_with_what_they_have() -> None:
    """The names of their fields are those that supervisor files have."""
    text = robot("mission m { visit Door.open }", "mission n while Door.open { visit Door.open on Door.shut from")
    text = text.replace("Door.shut from", "Door.shut from anywhere visit Door.open } prefer charge over drive")
    fields = json.loads(msgspec.json.encode(model_of(text)))
    assert [sorted(item) for item in fields["missions"]] == [
        ["name", "visits"],
        ["condition", "detours", "name", "visits"],
    ]
    assert [sorted(item) for item in fields["missions"][1]["detours"]] == [["trigger", "visits"]]
    assert [sorted(item) for item in fields["preferences"]] == [["others", "preferred"]]


def test_random_models_have_missions_that_their_texts_have_too() -> None:
    missions = detours = preferences = conditions = read = 0
    for seed in range(30):
        model = check(random_bundle(seed, goals=True)).model
        assert model is not None
        missions += len(model.missions)
        detours += sum(len(mission.detours) for mission in model.missions)
        conditions += sum(mission.condition is not None for mission in model.missions)
        preferences += len(model.preferences)
        text = model_text(model)
        again = check(bundle_of(text)).model
        if again is not None:
            # An expression is printed shorter than it was written, a text once printed is not.
            assert model_text(again) == text
            assert [item.name for item in again.missions] == [item.name for item in model.missions]
            assert again.preferences == model.preferences
            assert check(bundle_of(format_text(text))).model == again
            read += 1
    assert min(missions, detours, preferences, conditions) > 5
    assert read > 15
