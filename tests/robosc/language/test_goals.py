"""Goals and assumptions with mistakes: one message, in its place, whose fix leads to what was meant."""

import pytest

from robosc.language import parse
from robosc.model.check import check
from robosc.source import Bundle, SourceFile
from support.mistakes import first_error, obeyed
from support.models import checked

ROBOT = """robot R {
    component Door {
        outgoing message seen with type: none
        behaviour {
            initial marked state shut { on response from seen goto open }
            marked state open { on response from seen goto shut }
        }
    }
    §
}
"""


@pytest.mark.parametrize(
    ("wrong", "column", "advice", "meant"),
    [
        ("goal Door.open", 10, "Write 'always eventually' before it.", "goal always eventually Door.open"),
        ("goal Door.open => Door.shut", 10, "Write 'always", "goal always eventually Door.open => Door.shut"),
        ("goal always Door.open", 17, "Write 'eventually' before it.", "goal always eventually Door.open"),
        ("goal always (Door.open)", 17, "Write 'eventually' before it.", "goal always eventually (Door.open)"),
        ("goal eventually Door.open", 10, "Write 'always' before it.", "goal always eventually Door.open"),
        ("goal never Door.open", 10, "Write 'requirement never' instead", "requirement never Door.open"),
        ("goal allow Door.shut leads to Door.open", 10, "Remove 'allow'.", "goal Door.shut leads to Door.open"),
        ("goal once Door.shut leads to Door.open", 10, "Remove 'once'.", "goal Door.shut leads to Door.open"),
        (
            "goal always eventually Door.shut leads to Door.open",
            10,
            "Remove 'always eventually'.",
            "goal Door.shut leads to Door.open",
        ),
        ("goal Door.shut leads Door.open", 26, "Write 'to' before it.", "goal Door.shut leads to Door.open"),
        ("goal Door.shut leads-to Door.open", 25, "Write 'to' instead", "goal Door.shut leads to Door.open"),
        ("goal Door.shut leadsto Door.open", 20, "Write 'leads to' instead", "goal Door.shut leads to Door.open"),
        ("goal Door.shut -> Door.open", 20, "Write 'leads to' instead", "goal Door.shut leads to Door.open"),
        ("goal Door.shut lead to Door.open", 20, "Did you mean 'leads'?", "goal Door.shut leads to Door.open"),
        ("goal Door.shut implies to Door.open", 20, "Did you mean 'leads'?", "goal Door.shut leads to Door.open"),
        ("gaol once Door.open", 5, "Did you mean 'goal'?", "goal once Door.open"),
        ("always eventually Door.open", 5, "Write 'goal' before it.", "goal always eventually Door.open"),
        ("eventually Door.open", 5, "Write 'goal' before it.", "goal always eventually Door.open"),
        ("once Door.open", 5, "Write 'goal' before it.", "goal once Door.open"),
        ("assumption Door.shut leads to Door.open", 5, "Did you mean 'assume'?", "assume Door.shut leads to Door.open"),
        ("assume Door.open", 12, "Write 'always eventually' before it.", "assume always eventually Door.open"),
        ("assume once Door.open", 12, "Write 'always eventually' instead", "assume always eventually Door.open"),
        ("assume allow Door.open", 18, "Write 'always eventually'", "assume allow always eventually Door.open"),
        (
            "assume allow allow Door.shut leads to Door.open",
            18,
            "Remove 'allow'.",
            "assume allow Door.shut leads to Door.open",
        ),
    ],
)
def test_advice_that_is_followed_is_right(wrong: str, column: int, advice: str, meant: str) -> None:
    text = ROBOT.replace("§", wrong)
    (found,) = checked(text).diagnostics
    assert found.location is not None
    assert (found.location.line, found.location.column) == (9, column)
    assert found.code == "syntax-error"
    assert found.fix.startswith(advice)
    while (error := first_error(text)) is not None:
        text = obeyed(text, error) or ""
    assert " ".join(text.split()) == " ".join(ROBOT.replace("§", meant).split())


def test_what_nobody_can_mend_is_left_to_a_person() -> None:
    text = ROBOT.replace("§", "assume never Door.open")
    found = first_error(text)
    assert found is not None
    assert "has no 'never'" in found.message
    # The text would say the opposite without the word.
    assert obeyed(text, found) is None


@pytest.mark.parametrize(
    ("text", "code", "words"),
    [
        ("goal always eventually value", "no-value-here", "received data"),
        ("goal once seen", "unknown-name", "'seen' is a communication, not a value"),
        ("goal once Door", "type-mismatch", "is a component"),
        ("goal once 3", "type-mismatch", "boolean is needed"),
        ("goal Door.ajar leads to Door.open", "unknown-name", "'ajar'"),
        ("assume Door.open leads to Door.ajar", "unknown-name", "'ajar'"),
    ],
)
def test_expressions_are_those_of_requirements(text: str, code: str, words: str) -> None:
    (found,) = checked(ROBOT.replace("§", text)).diagnostics
    assert found.code == code
    assert words in found.message


def test_every_goal_of_a_library_is_told_and_read_on_behind() -> None:
    text = ROBOT.replace("robot R", "library R").replace(
        "§", "goal once Door.open\n    assume always eventually Door.open\n    requirement seen needs"
    )
    found = parse(SourceFile("model.rscd", text)).diagnostics
    assert [item.code for item in found] == ["goal-in-library", "goal-in-library", "syntax-error"]
    assert [item.location.line for item in found if item.location] == [9, 10, 12]


def test_a_library_with_a_goal_cannot_be_imported_in_silence() -> None:
    library = ROBOT.replace("robot R", "library Doors").replace("§", "goal once Door.open")
    robot = "robot R { component Door from Doors import Door }"
    found = check(Bundle(SourceFile("r.rscd", robot), (SourceFile("doors.rscd", library),))).diagnostics
    assert [(item.code, item.location and item.location.file) for item in found] == [("goal-in-library", "doors.rscd")]
