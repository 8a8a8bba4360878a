"""Mistakes that people make are reported in their place, with a fix that leads to a good model."""

import re
from collections import Counter
from functools import cache

import pytest

from robosc.language.advice import fix_syntax
from support.mistakes import GOOD, SLIPS, Mistake, Verdict, every_mistake, first_error, judge, obeyed

WANTED = 0.975
"""Share of all mistakes with a good message."""
WANTED_OF_EACH = 0.9
WANTED_OF_SOME = {
    # Nested parentheses over several lines do not show which one lacks its end.
    "missing comma or bracket": 0.75,
}
"""Share of each category in which a person has to think."""


@cache
def judged() -> tuple[tuple[Mistake, Verdict], ...]:
    return tuple((mistake, judge(mistake)) for mistake in every_mistake())


def share(mistakes: list[tuple[Mistake, Verdict]]) -> float:
    return sum(verdict.is_good for _, verdict in mistakes) / len(mistakes)


CATEGORIES = tuple(dict.fromkeys(mistake.category for mistake in every_mistake()))


def test_the_models_that_mistakes_are_made_in_are_good() -> None:
    assert len(GOOD) > 5
    for path in GOOD:
        assert first_error(path.read_text("utf-8")) is None, path


def test_there_are_enough_mistakes_and_always_the_same() -> None:
    counts = Counter(mistake.category for mistake, _ in judged())
    assert counts.total() >= 200
    assert min(counts.values()) >= 10
    assert set(SLIPS) < set(counts)
    assert every_mistake() == tuple(mistake for mistake, _ in judged())
    assert every_mistake(2) != every_mistake(1)


def test_the_share_of_all() -> None:
    assert share(list(judged())) >= WANTED, "make mistakes MISTAKES=--long"


@pytest.mark.parametrize("category", CATEGORIES)
def test_the_share_of_each_category(category: str) -> None:
    found = [item for item in judged() if item[0].category == category]
    assert share(found) >= WANTED_OF_SOME.get(category, WANTED_OF_EACH), category


def test_other_slips_than_those_that_were_looked_at() -> None:
    found = [(mistake, judge(mistake)) for mistake in every_mistake(seed=2026)]
    assert share(found) >= WANTED


def test_every_message_is_one_that_somebody_can_work_with() -> None:
    for mistake, verdict in judged():
        assert verdict.found is not None, mistake
        assert verdict.found.location is not None
        assert re.fullmatch(r"[A-Z][^\n]*[.?]", verdict.found.fix), verdict.found.fix


ROBOT = """robot R {
    interface t use Twist from geometry_msgs
    datatype object V { x: double }
    datatype enum E from boolean to { value -> on_ default -> off }
    component Button {
        outgoing message pressed with identifier: "/pressed", type: E
        behaviour {
            variable down: E
            on response from pressed do down := value
            initial marked state idle { transition if down = on_ goto busy }
            marked state busy { transition if down = off goto idle }
        }
    }
    component Motor {
        incoming message drive with identifier: "/drive", type: V links t
        behaviour { initial marked state still { on request to drive } }
    }
    requirement drive needs Button.busy
}
"""


@pytest.mark.parametrize(
    ("right", "wrong", "fix"),
    [
        (":= value", "= value", "Write ':=' instead of '='."),
        (":= value", "== value", "Write ':=' instead of '=='."),
        ("outgoing message", "incoming message", "Write 'outgoing message': directions are the component's"),
        ("incoming message", "outgoing message", "Write 'incoming message': directions are the component's"),
        ("initial marked state idle", "marked state idle", "Write 'initial' before this state"),
        ("marked state busy", "initial marked state busy", "Remove 'initial' before this state"),
        ('"/pressed"', "/pressed", "Write '\"/pressed\"' instead of '/pressed'."),
        ('"/pressed"', '"/pressed', "Write '\"/pressed\"' instead of '\"/pressed'."),
        ('"/pressed"', '/pressed"', "Write '\"/pressed\"' instead of '/pressed\"'."),
        ('"/pressed"', "“/pressed”", "Write '\"/pressed\"' instead of '“/pressed”'."),
        ("down: E\n", "down\n", "Write ': E' before it."),
        ("down: E\n", "down = off\n", "Write ': E' before it."),
        ("if down = on_ goto busy", "goto busy if down = on_", "Write 'if down = on_ goto busy' instead of"),
        ("transition if down = on_", "transition when down = on_", "Did you mean 'if'?"),
        ("goto idle", "goto ilde", "Write 'idle'."),
        ("do down := value", "do dwon := value", "Write 'down'."),
        ("requirement drive", "rule drive", "Did you mean 'requirement'?"),
        ("datatype object", "struct", "Did you mean 'datatype object'?"),
        ("datatype enum", "enum", "Write 'datatype' before it."),
        ("outgoing message", "publisher", "Did you mean 'outgoing message'?"),
        ("use Twist from geometry_msgs", "use geometry_msgs/Twist", "Write 'Twist from geometry_msgs' instead of"),
        ("on request to drive }", "on request to drive if true }", "Remove the condition: a request is only made"),
        ("x: double", "x: std::float", "Write 'double' instead of 'std::float'."),
        ("default -> off", "defualt -> off", "Write 'default'."),
        ("needs Button.busy", "needs not Button.down = on_", "Write 'Button.down !=', or put what is negated in"),
        ("needs Button.busy", "needs !Button.down != on_", "Write 'Button.down =', or put what is negated in"),
        ("needs Button.busy", 'needs Button.down = "on_"', "Write 'on_'."),
        ("needs Button.busy", "needs Button.down = blue", "Write 'on_' or 'off', or define the value of 'E' 'blue'."),
        ("value -> on_", "value => on_", "Write '->' instead of '=>'."),
        ("value -> on_", "value = true => on_", "Write '->' instead of '=>'."),
        ("}\n    component Motor", "\n    component Motor", "Write '}' before it."),
        ("component Motor {", "component Motor", "Write '{' before it."),
    ],
)
def test_a_fix_obeyed_to_the_letter_leads_to_a_good_model(right: str, wrong: str, fix: str) -> None:
    text = ROBOT.replace(right, wrong, 1)
    assert text != ROBOT
    found = first_error(text)
    assert found is not None
    assert found.fix.startswith(fix)
    for _ in range(3):
        if found is None:
            break
        text = obeyed(text, found) or ""
        found = first_error(text)
    assert found is None, found


def test_a_direction_that_is_used_rightly_too_is_not_turned() -> None:
    text = ROBOT.replace("on request to drive }", "on request to drive on response from drive }")
    found = first_error(text)
    assert found is not None
    assert found.fix.startswith("Use request")


def test_an_unknown_word_is_reported_without_a_guess() -> None:
    assert fix_syntax("a", "zzz", ("a name", "'on'")).startswith("Write one of the expected words here")


def test_what_another_component_reacts_to_has_its_direction() -> None:
    """Only where all that react to it are wrong the declaration is."""
    other = "component Other { behaviour { initial marked state s { on request to pressed } } }"
    text = ROBOT.replace("    component Motor", f"    {other}\n    component Motor", 1)
    found = first_error(text)
    assert found is not None
    assert found.fix.startswith("Use response")
    found = first_error(text.replace("outgoing message pressed", "incoming message pressed"))
    assert found is not None
    assert found.fix.startswith("Use request")


def test_a_fix_is_never_longer_than_a_line() -> None:
    condition = "down = on_ and " * 100 + "\n down = off"
    for part in (f"goto busy if {condition}", f"goto busy if down =\n on_ {condition[:20]} down = off"):
        found = first_error(ROBOT.replace("if down = on_ goto busy", part, 1))
        assert found is not None
        assert "\n" not in found.fix
        assert len(found.fix) <= 300
    found = first_error(ROBOT.replace('"/pressed"', "/" + "x" * 5000, 1))
    assert found is not None
    assert len(found.message) < 200


@pytest.mark.parametrize(("name", "meant"), [("pressed", "pressed_3"), ("Pressed", "Pressed_3"), ("drive", "drive_2")])
def test_another_name_is_one_that_is_free(name: str, meant: str) -> None:
    more = f"incoming message {name} with type: none outgoing message PRESSED_2 with type: none"
    found = first_error(
        ROBOT.replace("        behaviour { initial", f"        {more}\n        behaviour {{ initial", 1)
    )
    assert found is not None
    assert f"write '{meant}'" in found.fix


def test_the_type_of_a_variable_is_looked_for_in_the_begin_of_a_text() -> None:
    """Many variables without a type cost no more time than the text is long."""
    begin = "robot R { component C { behaviour { variable first do_ initial marked state s { } } } }"
    many = "variable x variable y = value variable z = blue on response from m do x := value, z := blue " * 5000
    found = first_error(begin.replace("do_", many))
    assert found is not None
    assert found.fix == "Write ': boolean' before it."


NESTED = """robot Limited {
    datatype object Vector { x: double y: double }
    datatype object Twist { linear: Vector angular: Vector }
    interface twist use Twist from geometry_msgs
    component Base { incoming message drive with identifier: "/cmd_vel", type: Twist links twist }
    ITEM
}"""


@pytest.mark.parametrize(
    ("written", "meant"),
    [
        ("limit drive.linear.x to -0.1..0.1", "limit drive to { linear: { x: -0.1..0.1 } }"),
        (
            "limit drive to { linear.x: -0.1..0.1, linear.y: 0.0..0.5, angular: { x: 0.0..1.0 } }",
            "limit drive to { linear: { x: -0.1..0.1, y: 0.0..0.5 }, angular: { x: 0.0..1.0 } }",
        ),
        ("provide drive with { linear.x: 0.5 }", "provide drive with { linear: { x: 0.5 } }"),
    ],
)
def test_a_path_to_a_property_is_shown_as_nested_objects(written: str, meant: str) -> None:
    text = NESTED.replace("ITEM", written)
    found = first_error(text)
    assert found is not None
    assert "'.' does not fit here" in found.message
    assert obeyed(text, found) == NESTED.replace("ITEM", meant)
    assert first_error(NESTED.replace("ITEM", meant)) is None


def test_a_path_in_braces_over_several_lines_is_shown_as_nested_objects() -> None:
    found = first_error(NESTED.replace("ITEM", "limit drive to {\n linear.x: 0.0..0.5,\n linear.y: 0.0..0.1 }"))
    assert found is not None
    assert found.fix == "Write '{ linear: { x: 0.0..0.5, y: 0.0..0.1 } }'."
