"""The reserved words of part A, and the language's words for what the parser expects."""

import re
from collections.abc import Iterable
from typing import Literal

RESERVED_WORDS = frozenset(
    """
    action and array behaviour boolean cancel component datatype default disables do double enum error false
    feedback from goto if import incoming initial integer interface library links marked message needs none
    object on or outgoing provide request requirement response robot service state string to transition true
    use value variable with
    """.split()
)
"""The quoted words of A.2 and A.3; every other word is a free name."""

STARTS: dict[str, Literal[True, "a name", "names"] | frozenset[str]] = {
    "component": "a name",
    "constant": "a name",
    "datatype": frozenset({"object", "enum"}),
    "interface": "a name",
    "requirement": True,
    "provide": "a name",
    "limit": "a name",
    "goal": "a name",
    "assume": "a name",
    "mission": "a name",
    "prefer": "names",
    "visit": "a name",
    "incoming": frozenset({"message"}),
    "outgoing": frozenset({"message"}),
    "service": "a name",
    "action": "a name",
    "behaviour": frozenset({"{"}),
    "variable": "a name",
    "initial": frozenset({"marked", "state"}),
    "marked": frozenset({"state"}),
    "state": "a name",
    "on": frozenset({"request", "response", "feedback", "error", "cancel"}),
    "transition": True,
}
"""Tokens that follow a word that begins an item.

An error inside one item ends where the next one seems to begin.
"""

_DEFINITIONS = frozenset(
    {"'component'", "'constant'", "'datatype'", "'interface'", "'requirement'", "'provide'", "'limit'"}
)

_GROUPS: tuple[tuple[str, frozenset[str]], ...] = (
    ("a definition", _DEFINITIONS | {"'goal'", "'assume'", "'mission'", "'prefer'"}),
    ("a definition", _DEFINITIONS),
    ("a communication", frozenset({"'incoming'", "'outgoing'", "'service'", "'action'"})),
)
"""Words that are listed as one group, the larger groups before the smaller ones that they contain."""

_MAXIMUM_WORDS = 8

_KINDS_OF_INTEGERS = (("", "int"), ("u", "int"), ("", "Int"), ("U", "Int"))

FOREIGN_TYPES = {
    "Boolean": "boolean",
    "bool": "boolean",
    "Bool": "boolean",
    "char": "string",
    "Double": "double",
    "empty": "none",
    "Empty": "none",
    "float": "double",
    "Float": "double",
    "float32": "double",
    "Float32": "double",
    "float64": "double",
    "Float64": "double",
    "int": "integer",
    "Int": "integer",
    "Integer": "integer",
    **{f"{sign}{kind}{width}": "integer" for sign, kind in _KINDS_OF_INTEGERS for width in (8, 16, 32, 64)},
    "long": "integer",
    "None": "none",
    "null": "none",
    "number": "double",
    "real": "double",
    "short": "integer",
    "str": "string",
    "String": "string",
    "text": "string",
    "uint8_t": "integer",
    "int32_t": "integer",
    "size_t": "integer",
    "unsigned": "integer",
    "void": "none",
}
"""Names of the basic types in other languages and in ROS."""


def spelled(name: str) -> str:
    """A name as it is written: `^` keeps it from being a word of the language."""
    return f"^{name}" if name in RESERVED_WORDS else name


def expected_words(expected: Iterable[str]) -> str:
    """Return what was expected, at most eight of it, as one phrase."""
    words = dict.fromkeys(expected)
    for name, group in _GROUPS:
        if group <= words.keys():
            words = {name: None} | {word: None for word in words if word not in group}
    shown = sorted(words, key=lambda word: (not word.startswith("a"), word))
    if len(shown) > _MAXIMUM_WORDS:
        shown = [*shown[:_MAXIMUM_WORDS], "..."]
    return " or ".join([", ".join(shown[:-1]), shown[-1]]) if len(shown) > 1 else "".join(shown)


def unescape(token: str) -> str:
    """The text of a quoted token; a backslash takes the next character, n and t mean newline and tab."""
    if "\\" not in token:
        return token[1:-1]
    special = {"n": "\n", "t": "\t"}
    return re.sub(r"\\([\s\S])", lambda match: special.get(match.group(1), match.group(1)), token[1:-1])
