"""Text to syntax tree.

textX reads the text with the grammar `robosc.tx`; `Converter` turns what it found into our own tree. What
could hurt a recursive-descent parser (deep nesting, unclosed comments, NUL) is found by a scan before it.
"""

import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from robosc.errors import Diagnostic, Severity, sorted_diagnostics
from robosc.language import syntax
from robosc.language.converter import Converter, Places
from robosc.language.scan import scan
from robosc.language.words import RESERVED_WORDS, expected_words, mend_syntax
from robosc.source import Location, SourceFile


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
    scanned = scan(file)
    if scanned.obstacle is not None:
        return Parsed(None, (scanned.obstacle,))
    from textx.exceptions import TextXSyntaxError

    try:
        # In a text without any line end, Arpeggio looks for the first one again at every token, which is quadratic.
        root = _metamodel().model_from_str(file.text if "\n" in file.text else f"{file.text}\n")
        converter = Converter(Places(file))
        tree = converter.file(root.content)
    except TextXSyntaxError as error:
        return Parsed(None, (_syntax_error(file, error),))
    except RecursionError:
        # Values of objects are the one thing that still nests in the grammar.
        message, mend = "this is nested too deeply", "Nest the objects less deeply."
        return Parsed(None, (Diagnostic(Severity.ERROR, "nesting-too-deep", message, scanned.deepest, mend),))
    diagnostics = sorted_diagnostics(converter.diagnostics)
    return Parsed(None if diagnostics else tree, diagnostics)


@cache
def _metamodel() -> Any:
    """The grammar's metamodel, built on first use."""
    from textx import metamodel_from_str

    grammar = Path(__file__).with_name("robosc.tx").read_text(encoding="utf-8")
    grammar = grammar.replace("RESERVED", "|".join(sorted(RESERVED_WORDS, reverse=True)))
    return metamodel_from_str(grammar, autokwd=True, use_regexp_group=False)


_TOKEN = re.compile(r"[A-Za-z_][A-Za-z_0-9]*|[0-9]+(?:\.[0-9]+)?|->|\.\.|:=|=>|!=|<=|>=|\S")
_MAXIMUM_SHOWN = 40


def _syntax_error(file: SourceFile, error: Any) -> Diagnostic:
    """What the parser met, and what would have fitted there."""
    line, column = int(error.line), int(error.col)
    if "\n" not in file.text and line > 1:
        line, column = 1, len(file.text) + 1
    text = file.line(line)
    token = _TOKEN.match(text, column - 1)
    found = token.group() if token else ""
    shown = found if len(found) <= _MAXIMUM_SHOWN else f"{found[:_MAXIMUM_SHOWN]}..."
    is_last = line >= file.text.count("\n") + 1
    met = f"'{shown}'" if found else "the end of the file" if is_last else "the end of the line"
    expected = expected_words(error.expected_rules or ())
    message = f"{met} does not fit here" + (f"; expected {expected}" if expected else "")
    mend = mend_syntax(text[: column - 1], shown, expected)
    location = Location(file.name, line, column, max(1, len(found)))
    return Diagnostic(Severity.ERROR, "syntax-error", message, location, mend)
