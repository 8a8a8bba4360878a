"""Missions and preferences with mistakes: one message, in its place, whose fix leads to what was meant."""

import pytest

from robosc.language import parse
from robosc.source import SourceFile
from support.mistakes import first_error, obeyed
from support.models import checked

ROBOT = """robot R {
    component Door {
        outgoing message seen with type: none
        incoming message charge with type: none
        incoming message drive with type: none
        behaviour {
            initial marked state shut { on response from seen goto open on request to charge on request to drive }
            marked state open { on response from seen goto shut }
        }
    }
    §
    goal once Door.open
}
"""
LINE = 11
SOUND = "mission m { visit Door.open then Door.shut }"
DETOUR = "mission m { visit Door.open on Door.shut from anywhere visit Door.open }"


@pytest.mark.parametrize(
    ("wrong", "column", "advice", "meant"),
    [
        ("mission { visit Door.open }", 13, "Write 'rounds' before it", "mission rounds { visit Door.open }"),
        (
            "mission while Door.open { visit Door.shut }",
            13,
            "Write 'rounds' before it",
            "mission rounds while Door.open { visit Door.shut }",
        ),
        ('mission "m" { visit Door.open }', 13, "Write 'm' instead", "mission m { visit Door.open }"),
        ("missoin m { visit Door.open }", 5, "Did you mean 'mission'?", "mission m { visit Door.open }"),
        ("route m { visit Door.open }", 5, "Did you mean 'mission'?", "mission m { visit Door.open }"),
        (
            "mission m when Door.open { visit Door.shut }",
            15,
            "Did you mean 'while'?",
            "mission m while Door.open { visit Door.shut }",
        ),
        (
            "mission m if Door.open { visit Door.shut }",
            15,
            "Did you mean 'while'?",
            "mission m while Door.open { visit Door.shut }",
        ),
        ("mission m { Door.open then Door.shut }", 17, "Write 'visit' before it.", SOUND),
        ("mission m { go Door.open then Door.shut }", 17, "Did you mean 'visit'?", SOUND),
        ("mission m { visit Door.open Door.shut }", 33, "Write 'then' before it.", SOUND),
        ("mission m { visit Door.open (Door.shut) }", 33, "Write 'then'", SOUND.replace("Door.shut", "(Door.shut)")),
        ("mission m { visit Door.open, Door.shut }", 32, "Write 'then' instead of ','.", SOUND),
        ("mission m { visit Door.open; visit Door.shut }", 32, "Write 'then' instead of '; visit'.", SOUND),
        ("mission m { visit Door.open, then visit Door.shut }", 32, "Write 'then' instead of ', then visit'.", SOUND),
        ("mission m { visit Door.open -> Door.shut }", 33, "Write 'then' instead of '->'.", SOUND),
        ("mission m { visit Door.open visit Door.shut }", 33, "Write 'then' instead of 'visit'.", SOUND),
        ("mission m { visit Door.open then visit Door.shut }", 38, "Remove 'visit'.", SOUND),
        ("mission m { visit then Door.open then Door.shut }", 23, "Remove 'then'.", SOUND),
        ("mission m { visit Door.open then then Door.shut }", 38, "Remove 'then'.", SOUND),
        ("mission m { visit Door.open and then Door.shut }", 33, "Write 'visit Door.open then Door.shut'", SOUND),
        ("mission m { visit Door.open than Door.shut }", 33, "Did you mean 'then'?", SOUND),
        ("mission m { visit Door.open next Door.shut }", 33, "Write 'visit Door.open then Door.shut'", SOUND),
        ("mission m { visit Door.open then Door.shut, }", 47, "Remove ','.", SOUND),
        ("mission m visit Door.open then Door.shut }", 15, "Write '{' before it.", SOUND),
        (
            "mission m { visit Door.open on Door.shut visit Door.open }",
            46,
            "Write 'from anywhere' before it.",
            DETOUR,
        ),
        ("mission m { visit Door.open on Door.shut from visit Door.open }", 51, "Write 'anywhere' before it.", DETOUR),
        ("mission m { visit Door.open on Door.shut anywhere visit Door.open }", 46, "Write 'from' before it.", DETOUR),
        (
            "mission m { visit Door.open on Door.shut from everywhere visit Door.open }",
            51,
            "Did you mean 'anywhere'?",
            DETOUR,
        ),
        (
            "mission m { visit Door.open on Door.shut -> visit Door.open }",
            46,
            "Write 'from anywhere' instead of '->'.",
            DETOUR,
        ),
        (
            "mission m { visit Door.open on Door.shut: visit Door.open }",
            45,
            "Write 'from anywhere' instead of ':'.",
            DETOUR,
        ),
        (
            "mission m { visit Door.open on Door.shut from anywhere Door.open }",
            60,
            "Write 'visit' before it.",
            DETOUR,
        ),
        ("preference charge over drive", 5, "Did you mean 'prefer'?", "prefer charge over drive"),
        ("prefer charge, drive over {}", 12, "Write '{' before it.", "prefer { charge, drive } over {}"),
        ("prefer {} over charge, drive", 20, "Write '{' before it.", "prefer {} over { charge, drive }"),
        ("prefer charge to drive", 19, "Did you mean 'over'?", "prefer charge over drive"),
        ("prefer charge than drive", 19, "Did you mean 'over'?", "prefer charge over drive"),
        ("prefer charge rather than drive", 19, "Write 'over' instead of 'rather than'.", "prefer charge over drive"),
        ("prefer charge > drive", 19, "Write 'over' instead of '>'.", "prefer charge over drive"),
        ("prefer charge drive", 19, "Write 'over' before it.", "prefer charge over drive"),
        ("prefer charge.request over drive", 18, "Remove '.request'.", "prefer charge over drive"),
        ("prefer charge over drive.request", 29, "Remove '.request'.", "prefer charge over drive"),
    ],
)
def test_advice_that_is_followed_is_right(wrong: str, column: int, advice: str, meant: str) -> None:
    text = ROBOT.replace("§", wrong)
    (found,) = checked(text).diagnostics
    assert found.location is not None
    assert (found.location.line, found.location.column) == (LINE, column)
    assert found.code == "syntax-error"
    assert found.fix.startswith(advice)
    for _ in range(8):
        error = first_error(text)
        if error is None:
            break
        text = obeyed(text, error) or ""
    assert " ".join(text.split()) == " ".join(ROBOT.replace("§", meant).split())


@pytest.mark.parametrize(
    ("wrong", "column", "words", "fix"),
    [
        ("mission m { }", 17, "at least one visit", "Write 'visit' and a condition in it"),
        ("mission m { on Door.open from anywhere visit Door.shut }", 17, "expected 'visit'", "detours stand behind"),
        ("mission m { on Door.open from anywhere visit Door.shut visit Door.open }", 17, "expected 'visit'", "Write"),
        (
            "mission m { visit Door.open on response from seen from anywhere visit Door.open }",
            36,
            "begins with a condition, not with 'response'",
            "Let a component go to a state with 'on response from seen', and name that state here",
        ),
        ("mission m { visit Door.open on cancel to go visit Door.open }", 36, "not with 'cancel'", "'on cancel to go'"),
        ("mission m { visit Door.open on message x }", 36, "not with 'message'", "with 'on response from x', and"),
        ("mission m { visit { Door.open then Door.shut } }", 23, "'{' does not fit here", "Leave the brackets out"),
        ("mission m { visit [Door.open, Door.shut] }", 23, "'[' does not fit here", "Leave the brackets out"),
        ("mission m { visit Door.open on }", 36, "expected an expression", "Write"),
        ("mission m { visit Door.open then }", 38, "expected an expression", "Write"),
        ("visit Door.open then Door.shut", 5, "'visit' does not fit here", "Put it in a mission"),
        ("prefer charge and drive over {}", 19, "stand in braces", "as in '{ charge, drive }'."),
        ("prefer charge requirement charge needs Door.open", 19, "expected 'over'", "Write 'over' and the requests"),
    ],
)
def test_what_a_person_has_to_mend_is_told_once(wrong: str, column: int, words: str, fix: str) -> None:
    text = ROBOT.replace("§", wrong)
    (found,) = checked(text).diagnostics
    assert found.location is not None
    assert (found.location.line, found.location.column) == (LINE, column)
    assert words in found.message
    assert fix in found.fix


def test_a_brace_that_is_missing_is_told_where_it_is_missed() -> None:
    for behind in ("goal once Door.open", "requirement drive needs Door.open", "mission n { visit Door.shut }"):
        (found,) = parse(SourceFile("m", ROBOT.replace("§", f"mission m {{ visit Door.open {behind}"))).diagnostics
        assert found.location is not None
        assert (found.location.line, found.location.column) == (LINE, 33)
        assert found.fix == "Write '}' before it."


def test_each_mistake_of_a_mission_is_told() -> None:
    text = "mission m { visit Door.open Door.shut on Door.open visit Door.shut on Door.open from anywhere Door.shut }"
    found = parse(SourceFile("m", ROBOT.replace("§", f"{text} prefer charge, drive over {{}}"))).diagnostics
    assert [item.location and item.location.column for item in found] == [33, 56, 99, 118]


def test_every_mission_of_a_library_is_told_and_read_on_behind() -> None:
    text = ROBOT.replace("robot R", "library R").replace("goal once Door.open", "requirement seen needs")
    text = text.replace("§", f"{SOUND}\n    prefer charge over drive")
    found = parse(SourceFile("model.rscd", text)).diagnostics
    assert [item.code for item in found] == ["goal-in-library", "goal-in-library", "syntax-error"]
    assert [item.location.line for item in found if item.location] == [LINE, LINE + 1, LINE + 3]
    assert found[0].message.startswith("a mission is about a whole robot")
    assert found[1].message.startswith("a preference is about a whole robot")
