"""Text to syntax tree.

textX reads the text with the grammar `robosc.tx`; `_Converter` turns what it found into our own tree. What
could hurt a recursive-descent parser (deep nesting, unclosed comments, NUL) is found by a scan before it.
"""

import re
from bisect import bisect_right
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

from robosc.errors import Diagnostic, Severity, sorted_diagnostics
from robosc.language import precedence, syntax
from robosc.language.words import RESERVED_WORDS, expected_words
from robosc.source import Location, SourceFile

MAXIMUM_NESTING = 200
"""Brackets, and levels of an expression, beyond which a text is refused."""

MAXIMUM_NAME = 255


@dataclass(frozen=True, slots=True)
class Parsed:
    """What became of a text.

    Attributes:
        tree: The syntax tree, or None where there are errors.
        diagnostics: Everything that is wrong with the text, by place.
    """

    tree: syntax.File | None
    diagnostics: tuple[Diagnostic, ...]


def parse(file: SourceFile) -> Parsed:
    """The syntax tree of a file; never raises, whatever the text."""
    places = _Places(file)
    found = _scan(file.text, places)
    if found is not None:
        return Parsed(None, (found,))
    from textx.exceptions import TextXSyntaxError

    try:
        root = _metamodel().model_from_str(file.text)
    except TextXSyntaxError as error:
        return Parsed(None, (_syntax_error(file, error),))
    except RecursionError:
        return Parsed(None, (_error("nesting-too-deep", "the text is nested too deeply", Location(file.name, 1, 1)),))
    converter = _Converter(places)
    tree = converter.file(root.content)
    diagnostics = sorted_diagnostics(converter.diagnostics)
    return Parsed(None if diagnostics else tree, diagnostics)


@cache
def _metamodel() -> Any:
    """The grammar's metamodel, built on first use."""
    from textx import metamodel_from_str

    grammar = Path(__file__).with_name("robosc.tx").read_text(encoding="utf-8")
    grammar = grammar.replace("RESERVED", "|".join(sorted(RESERVED_WORDS, reverse=True)))
    return metamodel_from_str(grammar, autokwd=True, use_regexp_group=False)


class _Places:
    """Offsets to lines and columns."""

    def __init__(self, file: SourceFile) -> None:
        self._name = file.name
        self._starts = [0, *(match.end() for match in re.finditer("\n", file.text))]
        self._ends = [*(start - 1 for start in self._starts[1:]), len(file.text)]

    def location(self, begin: int, end: int) -> Location:
        """The place from `begin` to `end`, cut at the end of its first line."""
        line = bisect_right(self._starts, begin) - 1
        end = min(end, self._ends[line])
        return Location(self._name, line + 1, begin - self._starts[line] + 1, max(1, end - begin))


_TOKEN = re.compile(
    r"""//[^\n]*|/\*(?:[^*]|\*(?!/))*\*/|"(?:\\[\s\S]|[^"\\])*"|'(?:\\[\s\S]|[^'\\])*'|/\*|["']|[{(\[]|[})\]]|\0""",
)


def _scan(text: str, places: _Places) -> Diagnostic | None:
    """The first thing that no grammar should have to meet: NUL, an unclosed comment or string, deep nesting."""
    if not text.strip():
        return _error("empty-file", "the file is empty", places.location(0, 0), "Write a robot or a library.")
    depth = 0
    for match in _TOKEN.finditer(text):
        found = match.group()
        place = places.location(match.start(), match.start() + 1)
        if found == "\0":
            return _error("invalid-character", "the text contains a NUL character", place, "Remove it.")
        if found == "/*":
            return _error("unclosed-comment", "this comment is never closed", place, "Close it with '*/'.")
        if found in ('"', "'"):
            return _error("unclosed-string", "this text is never closed", place, f"Close it with {found}.")
        if found in "{([":
            depth += 1
            if depth > MAXIMUM_NESTING:
                return _error(
                    "nesting-too-deep",
                    f"brackets are nested deeper than {MAXIMUM_NESTING}",
                    place,
                    "Split the expression or definition.",
                )
        elif found in "})]":
            depth -= 1
    return None


def _error(code: str, message: str, location: Location, mend: str = "Simplify the text.") -> Diagnostic:
    return Diagnostic(Severity.ERROR, code, message, location, mend)


def _syntax_error(file: SourceFile, error: Any) -> Diagnostic:
    """What the parser met, and what would have fitted there."""
    line, column = int(error.line), int(error.col)
    rest = file.line(line)[column - 1 :]
    token = re.match(r"[A-Za-z_][A-Za-z_0-9]*|[0-9]+(?:\.[0-9]+)?|->|\.\.|:=|=>|!=|<=|>=|\S", rest)
    met = (
        f"'{token.group()}'"
        if token
        else ("the end of the line" if rest.strip() or not _at_end(file, line, rest) else "the end of the file")
    )
    expected = expected_words(error.expected_rules or ())
    message = f"{met} does not fit here" + (f"; expected {expected}" if expected else "")
    reserved = token is not None and token.group() in RESERVED_WORDS
    mend = (
        f"If '{token.group()}' is meant as a name, write '^{token.group()}'."
        if reserved and token is not None and "a name" in expected
        else "Write one of the expected words here, or look for a bracket or comma missing before."
    )
    length = len(token.group()) if token else 1
    return _error("syntax-error", message, Location(file.name, line, column, length), mend)


def _at_end(file: SourceFile, line: int, rest: str) -> bool:
    return not rest.strip() and line >= file.text.count("\n") + 1
