"""The reserved words of part A, and the language's words for what the parser expects."""

import difflib
import re
from collections.abc import Iterable, Sequence
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

STARTS: dict[str, Literal[True, "a name"] | frozenset[str]] = {
    "component": "a name",
    "constant": "a name",
    "datatype": frozenset({"object", "enum"}),
    "interface": "a name",
    "requirement": True,
    "provide": "a name",
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

_GROUPS: tuple[tuple[str, frozenset[str]], ...] = (
    (
        "a definition",
        frozenset({"'component'", "'constant'", "'datatype'", "'interface'", "'requirement'", "'provide'"}),
    ),
    ("a communication", frozenset({"'incoming'", "'outgoing'", "'service'", "'action'"})),
)
"""Words that are told in one, the larger groups before the smaller ones that they contain."""

_WORDS_OF: dict[str, tuple[str, ...]] = {
    "an operator": ("and", "or"),
    "an expression": ("true", "false", "value", "if"),
    "a type": ("boolean", "integer", "double", "string", "array", "none"),
}
"""The words among what is expected under a common name."""

_MAXIMUM_WORDS = 8

_MAXIMUM_MEANT = 40
"""Characters of a token that are compared with what it may have been meant to be."""

_FOREIGN = {
    "&": "Write 'and' for '&&'.",
    "|": "Write 'or' for '||'.",
    ";": "Remove the ';': nothing ends with one.",
}
"""Notation of other languages."""


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


def _near_word(token: str, expected: Iterable[str]) -> str | None:
    """The word that a misspelt one was meant to be, if one of those expected is near."""
    words: list[str] = []
    for word in expected:
        words += [word.strip("'")] if word[0] == "'" else _WORDS_OF.get(word, ())
    near = difflib.get_close_matches(token[:_MAXIMUM_MEANT], words, n=1, cutoff=0.75)
    # Of a short word two letters that changed places are half.
    turned = [word for word in words if len(word) < 5 and sorted(word) == sorted(token)]
    return next(iter([*near, *turned]), None)


def unescape(token: str) -> str:
    """The text of a quoted token; a backslash takes the next character, n and t mean newline and tab."""
    if "\\" not in token:
        return token[1:-1]
    special = {"n": "\n", "t": "\t"}
    return re.sub(r"\\([\s\S])", lambda match: special.get(match.group(1), match.group(1)), token[1:-1])


def fix_syntax(before: str, token: str, expected: Sequence[str]) -> str:
    """Return advice on how to fix a syntax error.

    Args:
        before: The token before the one that does not fit.
        token: Token that does not fit; empty at the end of the text.
        expected: Words for what would have fitted.
    """
    if token in _FOREIGN:
        return _FOREIGN[token]
    if token == "=" and before == "=":
        return "Write '=' once: it compares."
    if not token.isascii():
        return "Names are made of the letters A to Z, digits and '_' only."
    if token == "message" and "'incoming'" in expected:
        return "Write 'incoming message' or 'outgoing message'."
    if token == ")":
        return "Remove it, or open it with '('."
    if token in RESERVED_WORDS and any(word in expected for word in ("a name", "an expression", "a type")):
        return f"If '{token}' is meant as a name, write '^{token}'."
    near = _near_word(token, expected)
    if near:
        return f"Did you mean '{near}'?"
    if token == "}" and "the end of the file" in expected:
        return "Remove it: there is one '}' too many, here or before."
    if len(set(expected)) == 1 and expected[0][0] == "'":
        return f"Write {expected[0]} before it, or look for a bracket or comma missing before."
    return "Write one of the expected words here, or look for a bracket or comma missing before."
