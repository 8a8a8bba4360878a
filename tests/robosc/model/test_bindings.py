"""Tests of the meaning of names: everything that a name stands for can be renamed, and the model stays the same."""

from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robosc.editing.definitions import DefinitionKind, walk
from robosc.editing.names import Names
from robosc.language import load_bundle, parse, syntax
from robosc.model.check import check, inspect
from robosc.source import Bundle, Location, SourceFile
from support.models import EXAMPLE_NAMES, EXAMPLES, bundle_of
from support.random_models import models

SHARED = """library Lib {
    constant LIMIT: integer = 3
    interface point use Point from geometry_msgs
    datatype object Point { x: double y: double }
    datatype enum Side from Point to { value.x < 0.0 -> left value.y > 5.0 -> up default -> right }
    component Platform {
        outgoing message seen with type: Side links point
        incoming message go with type: Point links point
        behaviour {
            variable side: Side
            variable n: integer(0..9) = LIMIT
            on response from seen do Platform.side := value, n := if side = left then 1 else LIMIT
            initial marked state ^state { on request to go goto away transition if Platform.away goto away }
            state away { transition if Platform.n > LIMIT goto ^state }
        }
    }
    requirement go needs Platform.^state
    provide go with { x: 1.0, y: double(LIMIT) } if Platform.side = Side.left
}"""
ROBOT = """robot R {
    component Base from Lib import Platform
    interface scan use LaserScan from sensor_msgs
    datatype object Scan { ranges: array(double) }
    datatype enum Near from Scan to { any(r in value.ranges[1..3]: r < FAR) -> near default -> far }
    constant FAR: double = 0.5
    component Lidar {
        outgoing message scans with type: Near links scan
        incoming message note with type: boolean, when: value = true
        behaviour {
            variable near: Near = far
            on response from scans do near := value
            initial marked state on_ { on request to note }
        }
    }
    requirement { go, note } needs Base.side = right and Lidar.near = Near.far
    requirement always Lidar.on_
    provide note with Base.away => Lidar.on_
}"""

_NO_NAMES = ("Interface.type", "Interface.package", "Call.function", "Quantifier.word")
"""Names that mean nothing of the model: of the middleware and of the language itself."""


def names_of(tree: object) -> Iterator[syntax.Name]:
    """Every name of a tree that stands for something in the model."""
    for node in walk(tree):
        if isinstance(node, syntax.Name) or not isinstance(node, msgspec.Struct):
            continue
        for field in node.__struct_fields__:
            value = getattr(node, field)
            if isinstance(value, tuple):
                parts = [part for item in value for part in (item if isinstance(item, tuple) else (item,))]
            else:
                parts = [value]
            is_other = f"{type(node).__name__}.{field}" in _NO_NAMES or field == "preposition"
            if not is_other and not (isinstance(node, syntax.Option) and node.key == "qos"):
                yield from (part for part in parts if isinstance(part, syntax.Name))


def renamed(bundle: Bundle, places: list[Location], name: str) -> Bundle:
    """A bundle with other words at some places."""

    def changed(file: SourceFile) -> SourceFile:
        lines = file.text.split("\n")
        for place in sorted((place for place in places if place.file == file.name), reverse=True):
            line = lines[place.line - 1]
            lines[place.line - 1] = line[: place.column - 1] + name + line[place.column - 1 + place.length :]
        return SourceFile(file.name, "\n".join(lines))

    return Bundle(changed(bundle.main), tuple(map(changed, bundle.libraries)), bundle.searched, bundle.interfaces)


def shape(bundle: Bundle) -> list[tuple[str, int, str]]:
    """Return the data that a renaming must not change: each finding's code, line, severity, and the model's shape."""
    found = check(bundle)
    counts = msgspec.json.encode(found.model).count(b"{") if found.model is not None else 0
    return [*((item.code, item.location.line if item.location else 0, item.severity) for item in found.diagnostics),
            ("", counts, "")]  # fmt: skip


def check_bindings(bundle: Bundle, step: int = 1) -> int:
    """Every name is bound, and every definition can be renamed; how many definitions there are."""
    inspected = inspect(bundle)
    names = Names(inspected)
    bound = {place for file in bundle.files for place, _ in names.occurrences(file.name)}
    main = parse(bundle.main).tree
    assert main is not None
    assert [name for name in names_of(main) if name.location not in bound] == []
    expected = shape(bundle)
    for number, definition in enumerate(names.definitions.values()):
        if number % step == 0:
            there = renamed(bundle, [definition.location, *names.uses(definition)], "Renamed")
            found = shape(there)
            # A property has the name of the field that it stands for.
            codes = {code for code, _, _ in found}
            if definition.kind is not DefinitionKind.PROPERTY or not codes & {"unknown-field", "needless-property"}:
                assert sorted(found) == sorted(expected), definition
    return len(names.definitions)


@given(models(goals=True))
def test_definitions_of_random_models_can_be_renamed(bundle: Bundle) -> None:
    if check(bundle).model is not None:
        check_bindings(bundle, step=5)


@pytest.mark.parametrize("example", EXAMPLE_NAMES)
def test_definitions_of_examples_can_be_renamed(example: str) -> None:
    assert check_bindings(load_bundle(EXAMPLES / f"{example}.rscd")) > 20


def test_all_that_can_be_named_can_be_renamed() -> None:
    bundle = bundle_of(ROBOT, lib=SHARED)
    assert [str(item) for item in check(bundle).diagnostics if item.severity == "error"] == []
    assert check_bindings(bundle) == 32


@given(models(), st.data())
def test_names_of_a_text_that_is_being_typed(bundle: Bundle, data: st.DataObject) -> None:
    """With something cut out, what is bound is bound to a definition of that name."""
    text = bundle.main.text
    begin = data.draw(st.integers(0, len(text)))
    end = data.draw(st.integers(begin, min(len(text), begin + 30)))
    cut = SourceFile(bundle.main.name, text[:begin] + text[end:])
    inspected = inspect(Bundle(cut, bundle.libraries))
    assert inspected.checked.diagnostics == check(Bundle(cut, bundle.libraries)).diagnostics
    names = Names(inspected)
    lines = cut.text.split("\n")
    for place, definition in names.occurrences(cut.name):
        there = lines[place.line - 1][place.column - 1 : place.column - 1 + place.length]
        assert there.removeprefix("^") == definition.name


def test_one_broken_item_leaves_the_names_of_the_others(tmp_path: Path) -> None:
    broken = ROBOT.replace("provide note with", "provide note wth")
    names = Names(inspect(bundle_of(broken, lib=SHARED)))
    whole = Names(inspect(bundle_of(ROBOT, lib=SHARED)))
    lost = {definition.location for definition in whole.definitions.values()} - names.definitions.keys()
    assert lost == set()
    note = next(item for item in names.definitions.values() if item.name == "note")
    assert len(names.uses(note)) == len(whole.uses(note)) - 1 == 2
