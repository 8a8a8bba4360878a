"""The parts of a text, one inside the other, and what of it can be folded."""

from collections.abc import Iterator
from dataclasses import dataclass

from robosc.editing.definitions import Definition, DefinitionKind, definitions
from robosc.language import Parsed, syntax
from robosc.language.tokens import Kind, tokenize_broken

_INSIDE = frozenset({DefinitionKind.ELEMENT})
"""Kinds of definitions that are no part of a text that users look for."""


@dataclass(frozen=True, slots=True)
class Part:
    """A definition with its contents.

    Attributes:
        definition: The definition.
        begin: Offset of the first character of the definition.
        end: Offset behind its last one.
        parts: Definitions inside it.
    """

    definition: Definition
    begin: int
    end: int
    parts: tuple["Part", ...] = ()


def outline(parsed: Parsed, text: str) -> Part | None:
    """The robot or library of a text, as far as it is sound."""
    if parsed.sound is None:
        return None
    by_tree: dict[int, list[Definition]] = {}
    first, *others = definitions(parsed.sound)
    for item in others:
        if item.kind not in _INSIDE and not isinstance(item.tree, syntax.EnumDefinition | syntax.Quantifier):
            by_tree.setdefault(id(item.tree), []).append(item)
    enums = {id(item.tree): item for item in others if item.kind is DefinitionKind.ENUM}
    # Inner extents come before those that they stand in: what was not taken yet is part of the next outer one.
    open_: list[Part] = []
    for extent in parsed.extents:
        named = by_tree.get(id(extent.item), [])
        if id(extent.item) in enums:
            named = [enums[id(extent.item)]]
        if not named:
            continue
        # They stand in the order of the text: those inside are the last ones.
        first_inside = len(open_)
        while first_inside and extent.begin <= open_[first_inside - 1].begin:
            first_inside -= 1
        open_[first_inside:] = [Part(named[0], extent.begin, extent.end, tuple(open_[first_inside:]))]
    begin = len(text) - len(text.lstrip())
    return Part(first, begin, max(begin, len(text.rstrip())), tuple(open_))


def parts(part: Part) -> Iterator[Part]:
    """A part and all that stands in it."""
    yield part
    for inner in part.parts:
        yield from parts(inner)


def folds(text: str) -> Iterator[tuple[int, int, bool]]:
    """Yield the ranges that can be folded: offsets of the first and the last character, and True for a comment."""
    texts, kinds, starts = tokenize_broken(text)
    opened: list[int] = []
    for token, start in zip(texts, starts, strict=True):
        if token == "{":
            opened.append(start)
        elif token == "}" and opened:
            yield opened.pop(), start, False
    ends = [0, *(start + len(token) for token, start in zip(texts, starts, strict=True))]
    for (before, behind), kind in zip(zip(ends, starts, strict=False), kinds, strict=False):
        gap = text[before:behind]
        comment = gap.strip()
        if comment:
            begin = before + gap.index(comment[0])
            yield begin, begin + len(comment) - 1, True
        if kind == Kind.END:
            break
