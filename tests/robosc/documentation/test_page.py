"""The page of a robot, read back by a strict reader and compared with the model."""

from pathlib import Path

import msgspec
import pytest
from hypothesis import given, settings

from robosc.documentation import page
from robosc.documentation.diagram import MAXIMUM_LABEL, MAXIMUM_TRANSITIONS, label
from robosc.documentation.markdown import quoted
from robosc.errors import Diagnostic, LanguageError, Severity
from robosc.expressions import Constant, EnumType
from robosc.expressions.text import expression_text
from robosc.language import load_bundle
from robosc.model.check import check
from robosc.model.structure import Behaviour, Model, Variable
from robosc.source import Location, visible
from support.corpus import bundle_of_case, cases
from support.effort import examples
from support.models import EXAMPLE_NAMES, EXAMPLES, example_model, model_of
from support.pages import Diagram, Section, read_page, read_text
from support.random_pages import TEXTS, models

GOLDEN = Path(__file__).with_name("line_follower.md")


def section(sections: list[Section], title: str) -> Section:
    """The one section with a title below the others."""
    found = [item for item in sections if item.title == title]
    assert len(found) == 1
    return found[0]


def agrees(model: Model, text: str) -> None:
    """The page says of every part of the model what the model says, and is well formed."""
    sections = read_page(text)
    assert (sections[0].level, sections[0].title) == (1, model.name)
    titles = [item.title for item in sections if item.level == 2]
    assert titles == sorted(titles, key=_ORDER.index)
    places = iter(item for item in _below(sections, "Components") if item.level == 3)
    for component in model.components:
        place = next(places)
        assert place.title == component.name
        if component.behaviour:
            _behaviour_agrees(component.behaviour, place)
    assert next(places, None) is None
    _communications_agree(model, sections)
    types = [item.title for item in _below(sections, "Data types")]
    assert types == [*(item.name for item in model.enums), *(item.name for item in model.objects)]
    _counts_agree(model, sections)


_ORDER = ["Overview", "Components", "Communications", "Data types", "Requirements", "Data of requests", "Findings"]


def _below(sections: list[Section], title: str) -> list[Section]:
    """The sections of the third level below one of the second."""
    found: list[Section] = []
    is_inside = False
    for item in sections:
        if item.level == 2:
            is_inside = item.title == title
        elif is_inside:
            found.append(item)
    return found


def _behaviour_agrees(behaviour: Behaviour, place: Section) -> None:
    labels = [label(item) for item in behaviour.transitions]
    is_small = len(labels) <= MAXIMUM_TRANSITIONS
    assert len(place.diagrams) == is_small
    if is_small:
        _diagram_agrees(behaviour, place.diagrams[0])
    tables = list(place.tables)
    if not is_small or any(len(text) > MAXIMUM_LABEL for text in labels):
        rows = tables.pop(0)[1:]
        assert [(row[0], row[1], row[4]) for row in rows] == [
            (item.source or "any state", item.event, item.target or "the same state") for item in behaviour.transitions
        ]
        assert [bool(row[2]) for row in rows] == [item.guard is not None for item in behaviour.transitions]
    if behaviour.variables:
        assert [row[0:1] + row[2:] for row in tables.pop(0)[1:]] == [_variable(item) for item in behaviour.variables]
    assert not tables


def _variable(item: Variable) -> list[str]:
    initial = str(item.initial) if isinstance(item.type, EnumType) else visible(expression_text(Constant(item.initial)))
    return [item.name, initial, "synthesis" if item.is_synthesis else "code only"]


def _diagram_agrees(behaviour: Behaviour, drawn: Diagram) -> None:
    anywhere = ["(any state)"] if any(item.source is None for item in behaviour.transitions) else []
    assert drawn.states == [item.name for item in behaviour.states] + anywhere
    assert drawn.initial == behaviour.initial
    assert drawn.marked == {item.name for item in behaviour.states if item.is_marked}
    expected = []
    for item in behaviour.transitions:
        text, source = label(item), item.source or "(any state)"
        shown = text if len(text) <= MAXIMUM_LABEL else text[: MAXIMUM_LABEL - 3] + "..."
        expected.append((source, shown, item.target or source))
    assert drawn.transitions == expected


def _communications_agree(model: Model, sections: list[Section]) -> None:
    if not model.communications:
        assert not any(item.title == "Communications" and item.level == 2 for item in sections)
        return
    rows = next(item for item in sections if item.level == 2 and item.title == "Communications").tables[0]
    head = rows[0]
    table = [dict(zip(head, row, strict=True)) for row in rows[1:]]
    assert [row["name"] for row in table] == [item.name for item in model.communications]
    assert [row["identifier"] for row in table] == [quoted(item.identifier) for item in model.communications]
    frames = ["" if item.frame is None else quoted(item.frame) for item in model.communications]
    assert [row.get("stamped with frame", "") for row in table] == frames
    whens = ["" if item.when is None else visible(expression_text(item.when)) for item in model.communications]
    assert [row.get("when", "") for row in table] == whens


def _counts_agree(model: Model, sections: list[Section]) -> None:
    counts = {row[0]: int(row[1]) for row in section(sections[:2], "Overview").tables[0][1:]}
    assert counts["components"] == len(model.components)
    assert counts["communications"] == len(model.communications)
    assert counts["requirements"] == len(model.requirements) + len(model.invariants)
    lines = [item for item in sections if item.level == 2 and item.title == "Requirements"]
    sentences = [line for item in lines for line in item.lines if " requested " in line or line.startswith("There ")]
    assert len(sentences) >= counts["requirements"]
    assert bool(sentences) == bool(counts["requirements"])


@pytest.mark.parametrize("name", EXAMPLE_NAMES)
def test_every_example_has_a_page_that_agrees_with_it(name: str) -> None:
    model = example_model(name)
    agrees(model, page(model))


@pytest.mark.parametrize("case", cases())
def test_every_sound_model_of_the_corpus_has_a_page(case: str) -> None:
    try:
        found = check(bundle_of_case(case))
    except LanguageError:
        return
    if found.model is not None:
        agrees(found.model, page(found.model, found.diagnostics))


@settings(max_examples=examples(60))
@given(models())
def test_hostile_names_and_texts_break_neither_table_nor_diagram(model: Model) -> None:
    text = page(model)
    agrees(model, text)
    assert page(model) == text


def test_the_page_of_the_line_follower_is_the_golden_one() -> None:
    # Made anew with: robosc doc examples/line_follower/line_follower.rscd -o <this file>
    assert page(example_model("line_follower/line_follower")) == GOLDEN.read_text(encoding="utf-8")


def test_a_page_does_not_depend_on_the_folder(tmp_path: Path) -> None:
    source = EXAMPLES / "navigation" / "navigation.rscd"
    copy = tmp_path / "other" / "name.rscd"
    copy.parent.mkdir()
    copy.write_text(source.read_text(encoding="utf-8"), encoding="utf-8")
    one, other = (check(load_bundle(file, (), (EXAMPLES,))) for file in (source, copy))
    assert one.diagnostics
    assert page(one.model_or_raise(), one.diagnostics) == page(other.model_or_raise(), other.diagnostics)


@pytest.mark.parametrize("text", TEXTS)
def test_an_identifier_is_shown_whole(text: str) -> None:
    model = model_of("robot R { component C { outgoing message m with type: none } }")
    hostile = msgspec.structs.replace(model.communications[0], identifier=text)
    model = msgspec.structs.replace(model, communications=(hostile,))
    table = section(read_page(page(model)), "Communications").tables[0]
    assert table[1][table[0].index("identifier")] == quoted(text)


def test_different_identifiers_are_shown_differently() -> None:
    assert len({quoted(text) for text in ("a\nb", "a\\nb", 'a\\"b\n', 'a"b\n', "")}) == 5


REQUIREMENTS = """robot R {
    component C {
        incoming message go with type: none
        incoming message stay with type: none
        behaviour {
            initial marked state a { on request to go goto b on request to stay }
            marked state b { on request to stay goto a }
        }
    }
    %s
}"""


@pytest.mark.parametrize(
    ("requirement", "lines"),
    [
        ("requirement go needs C.a", ["go is requested only while C.a."]),
        ("requirement C.b disables go", ["go is never requested while C.b."]),
        ("requirement {go, stay} needs C.a or C.b", ["go and stay are requested only while C.a or C.b."]),
        (
            "requirement go needs C.a and !C.b",
            ["go is requested only while all of these hold:", "C.a", "!C.b"],
        ),
        (
            "requirement C.a and C.b or C.b or C.a disables {go, stay}",
            ["go and stay are never requested while any of these holds:", "C.a and C.b", "C.b", "C.a"],
        ),
        ("requirement never C.a and C.b", ["There is never a state with C.a and C.b."]),
        ("requirement always C.a or C.b", ["There are only states with C.a or C.b."]),
    ],
)
def test_a_requirement_is_a_sentence(requirement: str, lines: list[str]) -> None:
    sections = read_page(page(model_of(REQUIREMENTS % requirement)))
    assert section(sections, "Requirements").lines == lines


@pytest.mark.parametrize(
    ("statement", "title", "lines"),
    [
        ("goal always eventually C.a", "Goals", ["The robot reaches again and again C.a."]),
        ("goal once C.a or C.b", "Goals", ["The robot reaches at least once C.a or C.b."]),
        (
            "goal once C.a and !C.b",
            "Goals",
            ["The robot reaches at least once a state where all of these hold:", "C.a", "!C.b"],
        ),
        ("goal C.a leads to C.b", "Goals", ["Whenever C.a held, the robot reaches later, or at once, C.b."]),
        ("assume always eventually C.a", "Assumptions", ["The surroundings bring about again and again C.a."]),
        (
            "assume allow always eventually C.a",
            "Assumptions",
            ["The surroundings bring about again and again, unless the robot itself keeps it from coming true, C.a."],
        ),
        (
            "assume C.a leads to C.b",
            "Assumptions",
            ["Whenever C.a held, the surroundings bring about later, or at once, C.b."],
        ),
        (
            "assume allow C.a leads to C.b",
            "Assumptions",
            [
                "Whenever C.a held, the surroundings bring about later, or at once, unless the robot itself keeps it "
                "from coming true, C.b."
            ],
        ),
        ("mission m { visit C.a }", "Missions", ["m: The robot reaches, round after round, C.a."]),
        (
            "mission m while C.b { visit C.a then C.b and C.a on C.a or C.b from anywhere visit C.a then C.b "
            "on C.b from anywhere visit C.a }",
            "Missions",
            [
                "m: While C.b, the robot reaches, round after round, C.a, then C.b and C.a. Whenever C.a or C.b, it "
                "first reaches C.a, then C.b. Whenever C.b, it first reaches C.a."
            ],
        ),
        (
            "goal once C.a prefer go over stay",
            "Preferences",
            ["go is requested rather than stay, where both lead nearer to a goal."],
        ),
        (
            "goal once C.a prefer {go, stay} over {}",
            "Preferences",
            ["A preference without effect: one of its sides names no request."],
        ),
    ],
)
def test_goals_and_assumptions_are_sentences(statement: str, title: str, lines: list[str]) -> None:
    sections = read_page(page(model_of(REQUIREMENTS % statement)))
    assert section(sections, title).lines == lines


def test_only_a_robot_with_goals_counts_them() -> None:
    def counted(*statements: str) -> dict[str, list[str]]:
        model = model_of(REQUIREMENTS % " ".join(statements))
        return {row[0]: row[1:] for row in section(read_page(page(model)), "Overview").tables[0]}

    younger = {"goals", "assumptions", "missions", "preferences"}
    assert not younger & counted("requirement go needs C.a").keys()
    found = counted("goal once C.a", "goal once C.b", "assume always eventually C.a", "assume allow C.a leads to C.b")
    assert found["goals"] == ["2", ""]
    assert found["assumptions"] == ["2", "1 that the robot may break"]
    assert not {"missions", "preferences"} & found.keys()
    found = counted("mission a { visit C.a then C.b }", "mission b { visit C.a }", "prefer go over stay")
    assert (found["missions"], found["preferences"]) == (["2", "3 visits"], ["1", ""])
    assert "goals" not in found
    found = counted("mission a { visit C.a on C.b from anywhere visit C.a }")
    assert found["missions"] == ["1", "1 visit, 1 detour"]


PROVIDES = """robot R {
    component C {
        incoming message go with type: double
        outgoing message seen with type: boolean
        behaviour { variable v: boolean on response from seen do v := value initial marked state a { } }
    }
    %s
}"""


@pytest.mark.parametrize(
    ("provides", "lines"),
    [
        ("provide go with 0.5", ["go is sent with 0.5."]),
        ("provide go with 0.5 provide go with 0.7", ["go is sent with 0.5."]),
        (
            "provide go with 0.5 if C.v provide go with 0.7 if !C.v provide go with 0.1 provide go with 0.2 if C.v",
            [
                "go is sent with the first of these that applies:",
                "0.5 if C.v",
                "0.7 if !C.v",
                "otherwise 0.1",
            ],
        ),
        (
            "provide go with 0.5 if C.v",
            [
                "go is sent with the first of these that applies:",
                "0.5 if C.v",
                "otherwise the default of the middleware",
            ],
        ),
    ],
)
def test_the_data_of_a_request_is_a_sentence(provides: str, lines: list[str]) -> None:
    sections = read_page(page(model_of(PROVIDES % provides)))
    assert section(sections, "Data of requests").lines == lines


def test_what_extends_a_communication_has_columns_of_its_own() -> None:
    model = model_of(
        """robot R {
            component C {
                outgoing message seen with type: integer, qos: best_effort, depth: 3, max_age: 0.5
                incoming message fast with identifier: "/v", type: double, when: value > 1.0
                incoming message slow with identifier: "/v", type: double
            }
        }"""
    )
    rows = section(read_page(page(model)), "Communications").tables[0]
    table = [dict(zip(rows[0], row, strict=True)) for row in rows[1:]]
    assert [row["QoS"] for row in table] == ["best_effort, depth 3", "reliable, depth 10", "reliable, depth 10"]
    assert [row["stale after"] for row in table] == ["0.5 s", "", ""]
    assert [row["when"] for row in table] == ["", "value > 1.0", ""]
    assert "stamped with frame" not in rows[0]


def test_findings_are_reported_with_their_line() -> None:
    place = Location("/somewhere/robot.rscd", 7, 3)
    finding = Diagnostic(Severity.NOTE, "partial-update", "<b> *can* | be", place, "Fix `it`.")
    lines = section(read_page(page(model_of("robot R { }"), [finding])), "Findings").lines
    assert lines == ["note (partial-update, line 7): <b> *can* | be. Fix `it`."]


def test_an_empty_robot_has_a_page() -> None:
    sections = read_page(page(model_of("robot R { }")))
    assert [item.title for item in sections] == ["R", "Overview"]


@pytest.mark.parametrize("text", ["a | b", "`a", "<b>", "*a*", "a\\"])
def test_the_strict_reader_refuses_what_is_not_escaped(text: str) -> None:
    with pytest.raises(AssertionError):
        read_text(text)
