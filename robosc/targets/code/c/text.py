"""Small helpers for writing C text."""

import textwrap

from robosc.targets.text import printable

_WIDTH = 105

_MAXIMUM_NESTING = 200
"""Parentheses in each other; common compilers take at least 256."""


def safe(text: str) -> str:
    """A text for a comment: printable ASCII that neither ends the comment nor is a trigraph or a spliced line."""
    shown = printable(text).replace("*/", "* /").replace("/*", "/ *")
    # The first pass leaves two of three question marks in a row.
    while "??" in shown:
        shown = shown.replace("??", "? ?")
    return f"{shown} " if shown.endswith("\\") else shown


def comment(text: str) -> list[str]:
    """A comment, wrapped."""
    lines = textwrap.wrap(safe(text), _WIDTH, break_on_hyphens=False) or [""]
    return [f"/* {line}" if place == 0 else f"   {line}" for place, line in enumerate(lines[:-1])] + [
        f"{'/*' if len(lines) == 1 else '  '} {lines[-1]} */"
    ]


def string_literal(text: str) -> str:
    """A C string literal of the text in UTF-8; whatever is not plain stands as an octal escape of three digits."""
    parts = []
    for byte in text.encode("utf-8", "surrogatepass"):
        char = chr(byte)
        parts.append(char if " " <= char <= "~" and char not in '"\\?' else f"\\{byte:03o}")
    return f'"{"".join(parts)}"'


def declared(c_type: str, name: str) -> str:
    """A declaration of one name."""
    return f"{c_type}{name}" if c_type.endswith("*") else f"{c_type} {name}"


def pointer_to(raw: str, name: str) -> str:
    """The declaration of a pointer to constant data."""
    return f"{raw}const *{name}" if raw.endswith("*") else f"const {raw} *{name}"


def is_nested_too_deeply(source: str) -> bool:
    """Return True if a line has more parentheses in each other than every compiler takes."""
    return any(line.count("(") > _MAXIMUM_NESTING and _nesting(line) > _MAXIMUM_NESTING for line in source.splitlines())


def _nesting(line: str) -> int:
    depth = deepest = 0
    for char in line:
        depth += (char == "(") - (char == ")")
        deepest = max(deepest, depth)
    return deepest
