"""Tests of completion: in a sound text, every word is offered where it stands, and every name."""

import pytest
from hypothesis import given

from robosc.editing.completion import Candidate, Surroundings, complete
from robosc.editing.names import Names
from robosc.editing.place import place_at
from robosc.language import load_bundle, parse, syntax
from robosc.language.tokens import Kind, tokenize
from robosc.model.check import check, inspect
from robosc.source import Bundle, SourceFile
from support.models import EXAMPLE_NAMES, EXAMPLES, bundle_of
from support.random_models import models

NOTHING = Surroundings()


def surroundings_of(bundle: Bundle) -> Surroundings:
    """The libraries of a bundle."""
    trees = [parse(file).tree for file in bundle.libraries]
    return Surroundings(
        {
            tree.name.text: tuple(item.name.text for item in tree.items if isinstance(item, syntax.Component))
            for tree in trees
            if tree is not None
        }
    )


def offered(text: str, surroundings: Surroundings = NOTHING, **libraries: str) -> dict[str, Candidate]:
    """Return the candidates that are offered at the `|` of a text."""
    before, _, behind = text.partition("|")
    _, found = complete(
        before + behind, len(before), inspect(bundle_of(before + behind, **libraries)), lambda: surroundings
    )
    assert len({item.text for item in found}) == len(found)
    return {item.text: item for item in found}


def check_every_word(bundle: Bundle, step: int) -> int:
    """Each word and bound name of a sound text, with its first character typed alone; how many there were."""
    text = bundle.main.text
    texts, kinds, starts = tokenize(text)
    lines = [0]
    for line in text.split("\n"):
        lines.append(lines[-1] + len(line) + 1)
    used = {
        lines[place.line - 1] + place.column - 1
        for place, definition in Names(inspect(bundle)).occurrences(bundle.main.name)
        if place != definition.location
    }
    count = 0
    for number, (word, kind, start) in enumerate(zip(texts, kinds, starts, strict=True)):
        if number % step or not (kind == Kind.WORD or start in used):
            continue
        typed = text[: start + 1] + text[start + len(word) :]
        inspected = inspect(
            Bundle(SourceFile(bundle.main.name, typed), bundle.libraries, bundle.searched, bundle.interfaces)
        )
        begin, found = complete(typed, start + 1, inspected, lambda: surroundings_of(bundle))
        assert begin == start
        # A `^` may stand before any name.
        names = {item.text.removesuffix(":").removeprefix("^") for item in found}
        assert word.removeprefix("^") in names, (text[:start][-80:], word)
        count += 1
    return count


@given(models(goals=True))
def test_every_word_of_a_random_model_is_offered(bundle: Bundle) -> None:
    if check(bundle).model is not None:
        check_every_word(bundle, 9)


@pytest.mark.parametrize("example", EXAMPLE_NAMES)
def test_every_word_of_an_example_is_offered(example: str) -> None:
    assert check_every_word(load_bundle(EXAMPLES / f"{example}.rscd"), 3) > 20


def test_comments_that_have_ended_hold_nothing() -> None:
    text = "robot R {{ component C {{ behaviour {{ initial marked state s {{ transition goto {} }} }} }} }}"
    for before in ("/* http://a.b */ |", "// a\n |", "// /* a\n |", "/* a\n// */ |", "/* a */ /* // */|"):
        assert "s" in offered(text.format(before)), before
    for before in ("// |", "/* a */ // |", "// /* a */ |", "/* |", "/* a */ /* // |", "/* a */ // /* |"):
        assert not offered(text.format(before)), before


TYPED = """robot R {{
    datatype enum Level from double to {{ value > 0.5 -> high  default -> low }}
    datatype enum Mode from double to {{ value > 0.5 -> calm  default -> hurried }}
    datatype object Sector {{ near: double level: Level }}
    datatype object Scan {{ sectors: array(Sector) levels: array(Level) grid: array(array(Sector)) scanned: Mode }}
    interface scan use Scan from robot_msgs
    constant usual: Level = low
    component C {{
        incoming message sent with type: Scan links scan
        incoming message told with type: Level
        outgoing message seen with type: Scan links scan
        behaviour {{
            variable last: Level = low
            variable mode: Mode
            on response from seen do {update}
            initial marked state s {{ }}
        }}
    }}
    requirement told needs {condition}
    provide told with 0.1
}}
"""
SOUND = {"update": "last := low", "condition": "C.last = low"}


@pytest.mark.parametrize(
    ("part", "words", "first"),
    [
        ("update", "last := |", ["high", "low"]),
        ("update", "last := if C.s then |", ["high", "low"]),
        ("update", "last := if C.s then low else |", ["high", "low"]),
        ("update", "last := if C.s then (if C.s then low else high) else |", ["high", "low"]),
        ("update", "last := if (if C.s then true else false) then |", ["high", "low"]),
        ("update", "last := if C.s then low else if C.s then |", ["high", "low"]),
        ("update", "last := (|", ["high", "low"]),
        ("update", "last := ((|)", ["high", "low"]),
        ("update", "last := if mode = |", ["calm", "hurried"]),
        ("update", "last := if mode = (if C.s then |", ["calm", "hurried"]),
        ("update", "mode := h|", ["calm", "hurried"]),
        ("condition", "| = C.last", ["high", "low"]),
        ("condition", "C.s and | != C.mode or C.s", ["calm", "hurried"]),
        ("condition", "hi|gh = (C.mode)", ["calm", "hurried"]),
        ("condition", "C.s or (| = usual)", ["high", "low"]),
        ("condition", "usual = |", ["high", "low"]),
        ("update", "last := if any(x in value.levels: x = |", ["high", "low"]),
        ("update", "last := if any(x in value.levels: | = x) then low else high", ["high", "low"]),
        ("update", "last := if all(x in value.levels[1..2]: x = |", ["high", "low"]),
        ("update", "last := if all(x in value.sectors: x.level = |", ["high", "low"]),
        ("update", "last := if any(x in value.sectors: x.|", ["near", "level"]),
        ("update", "last := if any(x in value.sectors[1..3]: x.|", ["near", "level"]),
        ("update", "last := if any(x in value.grid[1]: x.|", ["near", "level"]),
        ("update", "last := if any(r in value.grid: any(x in r: x.|", ["near", "level"]),
        ("update", "last := if value.sectors[length(value.grid[1])].|", ["near", "level"]),
        ("update", "last := if any(mode in mode: mode.|", []),
    ],
)
def test_what_has_the_needed_type_comes_first(part: str, words: str, first: list[str]) -> None:
    found = [*offered(TYPED.format(**{**SOUND, part: words}))]
    assert found[: len(first)] == first and (first or not found)


def test_nothing_but_what_has_the_needed_type_comes_first() -> None:
    for condition in ("max(|", "C.s and |", "C.s = true or |", "any(x in value.levels: |", "| < C.last"):
        found = offered(TYPED.format(**{**SOUND, "condition": condition}))
        assert found and not any(item.is_wanted for item in found.values()), condition


def test_what_a_condition_of_a_message_is_about_is_known() -> None:
    text = TYPED.format(**SOUND)
    for words, first in (
        ("type: Scan, when: value.|", ["sectors", "levels", "grid", "scanned"]),
        ("type: Scan, when: value.scanned = |", ["calm", "hurried"]),
        ("type: Scan, when: any(x in value.sectors: x.|", ["near", "level"]),
        ("type: Level, when: value = |", ["high", "low"]),
        ("type: integer, when: value.|", []),
    ):
        found = [*offered(text.replace("sent with type: Scan", f"sent with {words}"))]
        assert found[: len(first)] == first and (first or not found), words


def test_the_text_that_is_completed_is_sound() -> None:
    assert check(bundle_of(TYPED.format(**SOUND))).model is not None


MOVING = (
    "robot R {{ datatype object Part {{ u: double v: double }} "
    "datatype object Twist {{ x: double y: double part: Part }} "
    'component C {{ incoming message go with identifier: "go", type: Twist }} '
    "provide go with {{ {written} | }} }}"
)


@pytest.mark.parametrize(
    ("written", "expected"),
    [
        ("", {"x:", "y:", "part:"}),
        ("x: 1.0,", {"y:", "part:"}),
        ("part: { u: 0.5 }, x: 1.0,", {"y:"}),
        ("x: 1.0, part: { u: 0.5,", {"v:"}),
    ],
)
def test_a_property_is_offered_once(written: str, expected: set[str]) -> None:
    assert set(offered(MOVING.format(written=written))) == expected


NEGATED = """robot R {
    component Door {
        incoming message open with type: none
        behaviour { variable NAME: boolean initial marked state closed { transition if not | } }
    }
    requirement open needs not ?
}"""


def test_behind_not_stands_an_operand() -> None:
    for text in (NEGATED.replace("?", ""), NEGATED.replace("|", "").replace("?", "|")):
        found = offered(text.replace("NAME", "jammed"))
        assert {"Door", "true", "not", "any"} <= found.keys()
        assert not {"and", "or"} & found.keys()
    assert "jammed" in offered(NEGATED.replace("NAME", "jammed").replace("?", ""))
    assert "closed" in offered(NEGATED.replace("|", "").replace("not ?", "not Door.|").replace("NAME", "jammed"))


def test_behind_what_is_called_not_stands_an_operator_too() -> None:
    found = offered(NEGATED.replace("NAME", "not").replace("?", ""))
    assert {"Door", "true", "not", "and", "or"} <= found.keys()


AIMED = """robot R {{
    component goal {{
        outgoing message seen with type: none
        incoming message push with type: none
        behaviour {{ initial marked state shut {{ on response from seen goto open }} marked state open {{ }} }}
    }}
    requirement never goal.shut and goal.open
    {}
}}"""


@pytest.mark.parametrize(
    ("words", "expected", "unfit"),
    [
        ("|", {"goal", "assume", "requirement"}, {"always", "once", "leads"}),
        ("goal |", {"always", "once", "goal", "not", "true"}, {"eventually", "allow", "seen", "and"}),
        ("goal al|", {"always"}, set()),
        ("goal always |", {"eventually"}, {"always", "once", "true"}),
        ("goal always eventually |", {"goal", "not", "if"}, {"eventually", "always", "leads"}),
        ("goal always eventually goal.|", {"shut", "open"}, {"goal"}),
        ("goal once |", {"goal", "not"}, {"once", "always"}),
        ("goal goal.open |", {"leads", "and", "or"}, {"to", "always"}),
        ("goal goal.open leads |", {"to"}, {"leads", "goal"}),
        ("goal goal.open leads to |", {"goal", "not"}, {"to"}),
        ("assume |", {"allow", "always", "goal"}, {"once", "eventually"}),
        ("assume allow |", {"always", "goal"}, {"once", "allow"}),
        ("assume allow always |", {"eventually"}, {"once", "allow"}),
        ("goal once goal.open assume goal.open leads to goal.|", {"open"}, {"goal"}),
        ("|", {"mission", "prefer"}, {"visit", "while", "over"}),
        ("mission |", set(), {"goal", "mission", "while", "true"}),
        ("mission m |", {"while"}, {"visit", "mission"}),
        ("mission m while |", {"goal", "not", "true"}, {"visit", "while"}),
        ("mission m while goal.open |", {"and", "or"}, {"visit", "while"}),
        ("mission m {{ |", {"visit"}, {"on", "then", "goal"}),
        ("mission m {{ visit |", {"goal", "not"}, {"then", "visit"}),
        ("mission m {{ visit goal.|", {"shut", "open"}, {"goal"}),
        ("mission m {{ visit goal.open |", {"then", "on", "and"}, {"visit", "from"}),
        ("mission m {{ visit goal.open then |", {"goal", "not"}, {"then"}),
        ("mission m {{ visit goal.open on |", {"goal", "not"}, {"response", "from"}),
        ("mission m {{ visit goal.open on goal.shut |", {"from", "and"}, {"visit", "anywhere"}),
        ("mission m {{ visit goal.open on goal.shut from |", {"anywhere"}, {"seen", "goal"}),
        ("mission m {{ visit goal.open on goal.shut from anywhere |", {"visit"}, {"then"}),
        ("mission m {{ visit goal.open on goal.shut from anywhere visit |", {"goal"}, {"visit"}),
        ("prefer |", {"push"}, {"seen", "goal", "over"}),
        ("prefer push |", {"over"}, {"push", "and"}),
        ("prefer push over |", {"push"}, {"seen", "goal"}),
        ("prefer {{ |", {"push"}, {"seen", "goal"}),
        ("prefer {{ push, |", {"push"}, {"seen", "goal"}),
        ("prefer {{ push }} |", {"over"}, {"push"}),
        ("prefer {{ push }} over |", {"push"}, {"seen", "goal"}),
        ("prefer {{ push }} over {{ push, |", {"push"}, {"seen", "goal"}),
    ],
)
def test_the_words_of_goals_are_offered(words: str, expected: set[str], unfit: set[str]) -> None:
    found = offered(AIMED.format(words.replace("{{", "{").replace("}}", "}"))).keys()
    assert expected <= found
    assert not unfit & found


def test_goals_begin_items_and_names_do_not() -> None:
    def item(words: str) -> str:
        place = place_at(f"robot R {{ {words} ", len(words) + len("robot R {  "))
        assert place is not None
        return " ".join(place.item)

    for before in ("requirement a needs b", "requirement a needs 1", "provide m with goal.once", "component C { }"):
        for word in ("goal once", "assume allow", "mission m", "prefer a"):
            assert item(f"{before} {word}") == word, before
    for words in ("component goal", "constant assume", "requirement a needs not goal", "goal once goal", "goal goal"):
        assert item(words) == words
    assert item("component C { behaviour { variable goal") == "variable goal"
    assert item("datatype object O { a: T goal") == "a : T goal"


FIELDS = """robot R {
    interface i use Odometry from nav_msgs
    datatype object Odometry { child_frame_id: string pose: Pose | }
    datatype object Pose { covariance: array(double) %s }
    component C { outgoing message m with type: Odometry links i }
}"""


def test_fields_of_a_message_are_offered_in_its_object_type() -> None:
    assert list(offered(FIELDS % "")) == ["header:", "twist:"]
    inside = offered(FIELDS.replace("|", "") % "|")
    assert list(inside) == ["pose:"]
    assert inside["pose:"].detail == "geometry_msgs/Pose"
    battery = """robot R {
        interface i use BatteryState from sensor_msgs
        datatype object Battery { per| }
        component C { outgoing message m with type: Battery links i }
    }"""
    found = offered(battery)
    assert {"percentage: double", "present: boolean", "cell_voltage: array(double)", "header:"} <= found.keys()
    assert "percentage: double" not in offered(battery.replace("Battery links i", "none links i"))


LIMITED = """robot R {{
    interface twist use Twist from geometry_msgs
    interface power use SetBool from std_srvs
    datatype object Vector {{ x: double y: double }}
    datatype object Twist {{ linear: Vector angular: Vector }}
    datatype object Power {{ data: boolean }}
    component Base {{
        incoming message walk with type: Twist links twist
        outgoing message bump with type: none
        service up with identifier: "/arm", request: Power, response: none{option} links power
    }}
    {item}
}}
"""


@pytest.mark.parametrize(
    ("item", "names"),
    [
        ("limit |", ["walk", "up"]),
        ("limit walk to { |", ["linear:", "angular:"]),
        ("limit walk to { linear: { x: 0.0..1.0, |", ["y:"]),
        ("limit walk to { linear: { x: 0.0..1.0 } } if |", ["Base"]),
    ],
)
def test_names_in_limits(item: str, names: list[str]) -> None:
    found = offered(LIMITED.format(option="", item=item))
    assert [name for name, candidate in found.items() if candidate.kind is not None][: len(names)] == names
    assert "bump" not in found


def test_the_condition_of_a_request_reads_its_data_or_is_the_word_default() -> None:
    assert {"default", "value"} <= offered(LIMITED.format(option=", when: |", item="")).keys()
    assert "data" in offered(LIMITED.format(option=", when: value.|", item=""))
