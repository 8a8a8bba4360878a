"""Cheap scans of a whole text, linear in its length, for what must be known before the grammar reads it.

They see comments, strings and brackets only, so they work on broken texts too.
"""

import re
from dataclasses import dataclass

from robosc.errors import Diagnostic, Severity
from robosc.source import Location, SourceFile

MAXIMUM_NESTING = 200
"""Brackets, and levels of an expression, beyond which a text is refused."""

MAXIMUM_BRACES = 40
"""Braces in braces beyond which a text is refused: the grammar reads them by recursion, some 16 calls a level."""

_COMMENT = r"//[^\n]*|/\*[\s\S]*?\*/"
_STRING = r""""[^"\\]*+(?:\\[\s\S][^"\\]*+)*+"|'[^'\\]*+(?:\\[\s\S][^'\\]*+)*+'"""
_SIGNS = rf"(?:[!-]\s*+){{{MAXIMUM_NESTING + 1}}}"
_TOKEN = re.compile(rf"""{_COMMENT}|{_STRING}|/\*|["'{{(\[\])}}]|{_SIGNS}""")
# What is never closed hides the rest: to look for its end once more at every later beginning would take forever.
_HIDDEN = re.compile(rf"""{_COMMENT}|{_STRING}|/\*[\s\S]*|["'][\s\S]*""")
_LIBRARY = re.compile(r"(?<![A-Za-z_0-9^])library\s+\^?([A-Za-z_][A-Za-z_0-9]*)")
_IMPORT = re.compile(r"(?<![A-Za-z_0-9^])from\s+\^?([A-Za-z_][A-Za-z_0-9]*)\s+import(?![A-Za-z_0-9])")


def declared_libraries(text: str) -> frozenset[str]:
    """The libraries that a text declares, be it sound or broken."""
    return frozenset(_LIBRARY.findall(_HIDDEN.sub(" ", text)))


def imported_libraries(text: str) -> tuple[str, ...]:
    """The libraries that a text imports from, in the order of the text."""
    return tuple(dict.fromkeys(_IMPORT.findall(_HIDDEN.sub(" ", text))))


@dataclass(frozen=True, slots=True)
class Scanned:
    """What a scan found.

    Attributes:
        obstacle: The first thing that no grammar should have to meet, or None.
        deepest: Where the brackets are nested deepest.
    """

    obstacle: Diagnostic | None
    deepest: Location


def scan(file: SourceFile) -> Scanned:
    """Look for an empty text, NUL, an unclosed comment or string, and nesting beyond `MAXIMUM_NESTING`."""
    text = file.text
    deepest, levels, depth, braces = 0, 0, 0, 0

    def found(code: str, message: str, offset: int, mend: str) -> Scanned:
        place = _place(file, offset)
        return Scanned(Diagnostic(Severity.ERROR, code, message, place, mend), place)

    if not text or text.isspace():
        return found("empty-file", "the file is empty", 0, "Write a robot or a library.")
    nul = text.find("\0")
    if nul >= 0:
        return found("invalid-character", "the text contains a NUL character", nul, "Remove it.")
    for match in _TOKEN.finditer(text):
        token = match.group()
        if token == "/*":
            return found("unclosed-comment", "this comment is never closed", match.start(), "Close it with '*/'.")
        if token in ('"', "'"):
            return found("unclosed-string", "this text is never closed", match.start(), f"Close it with {token}.")
        if len(token) > MAXIMUM_NESTING and token[0] in "!-":
            what = f"more than {MAXIMUM_NESTING} signs stand before one operand"
            return found("nesting-too-deep", what, match.start(), "Remove signs that cancel each other.")
        if token in "})]":
            depth -= 1
            braces -= token == "}"
        elif token in "{([":
            depth += 1
            braces += token == "{"
            if depth > levels:
                levels, deepest = depth, match.start()
            if depth > MAXIMUM_NESTING or braces > MAXIMUM_BRACES:
                what = f"braces are nested deeper than {MAXIMUM_BRACES}"
                if depth > MAXIMUM_NESTING:
                    what = f"brackets are nested deeper than {MAXIMUM_NESTING}"
                return found("nesting-too-deep", what, match.start(), "Split the expression or definition.")
    return Scanned(None, _place(file, deepest))


def _place(file: SourceFile, offset: int) -> Location:
    line_start = file.text.rfind("\n", 0, offset) + 1
    return Location(file.name, file.text.count("\n", 0, offset) + 1, offset - line_start + 1)
