"""Fixes of findings: each makes the text that its author meant."""

import pytest

from robosc.certification import make_supervisor
from robosc.editing.fixes import fixes
from robosc.model.check import inspect
from robosc.source import Bundle, SourceFile
from support.models import STOPPING

ROBOT = """robot R {
    component C {
        outgoing message m with type: integer
        incoming message go with type: none
        behaviour {
            variable n: integer(0..3)
            on response from m do n := 1
            initial marked state a {
                on request to go goto b
            }
            state b {
                on request to go goto a
            }
        }
    }
    requirement C.a and !C.b and C.n = 2 disables go
}
"""


BATTERY = """robot R {
    interface i use BatteryState from sensor_msgs
    datatype object Battery { percentage: double cell_voltage: array(double) }
    component C { outgoing message m with type: Battery links i }
}
"""


def titles_and_texts(text: str) -> dict[str, str]:
    """Return the title of each fix for a text's first finding, and the text with it."""
    found = inspect(Bundle(SourceFile("r.rscd", text))).checked.diagnostics
    lines = text.split("\n")
    results = {}
    for item in found[:1]:
        assert item.location is not None
        for fix in fixes(item, lines[item.location.line - 1]):
            place = fix.location
            begin = sum(len(line) + 1 for line in lines[: place.line - 1]) + place.column - 1
            results[fix.title] = text[:begin] + fix.text + text[begin + place.length :]
    return results


@pytest.mark.parametrize(
    ("right", "wrong", "title"),
    [
        ("C.a and !C.b", "C.a && !C.b", "Write 'and'"),
        ("C.a and !C.b", "C.a & !C.b", "Write 'and'"),
        ("C.a and !C.b and C.n", "C.a and !C.b&&C.n", "Write 'and'"),
        ("!C.b and", "!C.b or", None),
        ("C.n = 2", "C.n == 2", "Remove '='"),
        ("type: none", "type: none;", "Remove ';'"),
        ("!C.b", "!C.b)", "Remove ')'"),
        ("incoming message", "message", "Write 'incoming message'"),
        ("outgoing message", "message", "Write 'outgoing message'"),
        ("behaviour", "behavoiur", "Write 'behaviour'"),
        ("integer(0..3)", "integer(3..0)", "Write 'integer(0..3)'"),
        ("C.n = 2", "C.n.x = 2", "Remove '.x'"),
        ("goto b", "goto bb", "Write 'b'"),
        ("on request to go goto b", "on response from go goto b", "Write 'on request'"),
        ("on response from m", "on feedback from m", "Write 'on response'"),
        ("on response from m", "on response to m", "Write 'from'"),
        ("C.n = 2", "c.n = 2", "Write 'C'"),
    ],
)
def test_what_was_meant_comes_back(right: str, wrong: str, title: str | None) -> None:
    assert right in ROBOT
    found = titles_and_texts(ROBOT.replace(right, wrong, 1))
    if title is None:
        assert found == {}
    else:
        assert found[title] == ROBOT


def test_the_model_is_sound() -> None:
    assert not any(item.severity == "error" for item in inspect(Bundle(SourceFile("r", ROBOT))).checked.diagnostics)


def test_a_word_is_made_a_name() -> None:
    found = titles_and_texts("robot R { component state { } }")
    assert found == {"Write '^state'": "robot R { component ^state { } }"}


def test_a_word_that_is_missing_is_written() -> None:
    found = titles_and_texts("robot R { component C from Parts Lamp }")
    assert found == {"Write 'import' before it": "robot R { component C from Parts import Lamp }"}


def test_bars_are_a_word() -> None:
    found = titles_and_texts("robot R { requirement A||B disables c }")
    assert found == {"Write 'or'": "robot R { requirement A or B disables c }"}


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("BatteryState", "BateryState"),
        ("percentage", "percentag"),
        ("double cell", "integer(0..100) cell"),
        ("array(double)", "double"),
        ("array(double)", "array(boolean)"),
    ],
)
def test_types_and_fields_of_ros_are_put_right(right: str, wrong: str) -> None:
    assert BATTERY in titles_and_texts(BATTERY.replace(right, wrong)).values()


def test_a_field_that_is_the_only_one_is_meant() -> None:
    text = """robot R {
    interface i use SetBool from std_srvs
    datatype object RequestedSettings { data: boolean }
    datatype object Answer { success: boolean }
    component C { service lid with request: RequestedSettings, response: Answer links i }
}
"""
    assert text in titles_and_texts(text.replace("data: boolean", "openn: boolean")).values()


DENIED = """robot Courier {
    component Door {
        incoming message open with type: none
        outgoing message opened with type: none
        behaviour {
            initial marked state shut { on request to open goto opening }
            state opening { on response from opened goto ajar }
            marked state ajar { }
        }
    }
    GOAL
} // Not its end: }
"""


@pytest.mark.parametrize(
    "goal",
    [
        "goal once Door.ajar",
        "mission delivery {\n        visit Door.shut or Door.ajar\n        then Door.ajar\n    }",
        "mission delivery { visit Door.ajar }",
    ],
)
@pytest.mark.parametrize("end", ["\n}", " }"])
def test_assumptions_that_help_are_written_at_the_end_of_the_robot(goal: str, end: str) -> None:
    text = DENIED.replace("GOAL", goal).replace("\n}", end)
    made = make_supervisor(Bundle(SourceFile("r.rscd", text)))
    (found,) = (item for item in made.diagnostics if item.code == "unreachable-goal")
    assert found.location is not None
    lines, line = text.split("\n"), found.location.line
    (fix,) = fixes(found, lines[line - 1], lambda: "\n".join(lines[line:]))
    assert fix.title == "Write 'assume Door.opening leads to Door.ajar'"
    begin = sum(len(line) + 1 for line in lines[: fix.location.line - 1]) + fix.location.column - 1
    assert text[begin : begin + fix.location.length] == "}"
    changed = text[:begin] + fix.text + text[begin + 1 :]
    assert changed.endswith("\n    assume Door.opening leads to Door.ajar\n} // Not its end: }\n")
    assert make_supervisor(Bundle(SourceFile("r.rscd", changed))).supervisor is not None


def test_no_assumption_is_written_where_none_is_known_to_help() -> None:
    text = DENIED.replace("GOAL", "goal once Door.ajar and Door.shut")
    made = make_supervisor(Bundle(SourceFile("r.rscd", text)))
    (found,) = (item for item in made.diagnostics if item.code == "unreachable-goal")
    assert found.location is not None
    assert fixes(found, text.split("\n")[found.location.line - 1], lambda: "}\n") == ()


def test_a_cancel_is_led_to_where_the_goal_has_ended() -> None:
    made = make_supervisor(Bundle(SourceFile("r.rscd", STOPPING)))
    (found,) = (item for item in made.diagnostics if item.code == "forbidden-cancel")
    assert found.location is not None
    lines = STOPPING.split("\n")
    (fix,) = fixes(found, lines[found.location.line - 1])
    line = lines[fix.location.line - 1]
    begin = fix.location.column - 1
    assert (fix.title, line[begin : begin + fix.location.length]) == ("Write 'goto idle'", "goto braking")
    lines[fix.location.line - 1] = line[:begin] + fix.text + line[begin + fix.location.length :]
    assert make_supervisor(Bundle(SourceFile("r.rscd", "\n".join(lines)))).supervisor is not None
    # A transition that has to be added is for a person to write.
    text = STOPPING.replace("on cancel to travel goto braking", "")
    made = make_supervisor(Bundle(SourceFile("r.rscd", text)))
    (found,) = (item for item in made.diagnostics if item.code == "forbidden-cancel")
    assert found.location is not None
    assert fixes(found, text.split("\n")[found.location.line - 1]) == ()
