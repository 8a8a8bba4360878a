"""The reserved words of part A, and the language's words for what the parser expects."""

import difflib
import re
from collections.abc import Iterable
from typing import Any

RESERVED_WORDS = frozenset(
    """
    action and array behaviour boolean cancel component datatype default disables do double enum error false
    feedback from goto if import incoming initial integer interface library links marked message needs none
    object on or outgoing provide request requirement response robot service state string to transition true
    use value variable with
    """.split()
)
"""The quoted words of A.2 and A.3; every other word is a free name."""

_RULES = {
    "NameToken": "a name",
    "RootToken": "a name",
    "LiteralToken": "a number",
    "Integer": "a whole number",
    "StringToken": "a text in quotes",
    "Operator": "an operator",
    "PrefixSign": "'('",
    "ClosingSign": "",
    "PropertyColon": "':'",
    "Arrow": "'->'",
    "EOF": "the end of the file",
    "Comment": "",
}

_GROUPS: tuple[tuple[str, frozenset[str]], ...] = (
    ("an expression", frozenset({"a name", "a number", "'('"})),
    ("a value", frozenset({"a name", "a number"})),
    ("a definition", frozenset({"'component'", "'datatype'", "'interface'", "'requirement'", "'provide'"})),
    ("a type", frozenset({"a name", "'array'", "'integer'", "'string'", "'boolean'", "'double'", "'none'"})),
)
"""Words that are told in one, the larger groups before the smaller ones that they contain."""

_MAXIMUM_WORDS = 8

_FOREIGN = {
    "&": "Write 'and' for '&&'.",
    "|": "Write 'or' for '||'.",
    ";": "Remove the ';': nothing ends with one.",
}
"""What other languages write."""


def expected_words(rules: Iterable[Any]) -> str:
    """What a parser's expected rules are called, at most eight of them, as one phrase."""
    words = dict.fromkeys(_word(rule) for rule in rules)
    words.pop("", None)
    for name, group in _GROUPS:
        if group <= words.keys():
            words = {name: None} | {word: None for word in words if word not in group}
    shown = sorted(words, key=lambda word: (not word.startswith("a"), word))
    if len(shown) > _MAXIMUM_WORDS:
        shown = [*shown[:_MAXIMUM_WORDS], "..."]
    return " or ".join([", ".join(shown[:-1]), shown[-1]]) if len(shown) > 1 else "".join(shown)


def mend_syntax(before: str, token: str, expected: str) -> str:
    """How to mend a syntax error.

    Args:
        before: The line up to the token that does not fit.
        token: That token; empty at the end of a line.
        expected: What `expected_words` said.
    """
    if token in _FOREIGN:
        return _FOREIGN[token]
    if before.split()[-1:] == ["not"] and "an operator" in expected:
        return "Write '!' for 'not'."
    if token == "=" and before.endswith("="):
        return "Write '=' once: it compares."
    if not token.isascii():
        return "Names are made of the letters A to Z, digits and '_' only."
    if token in RESERVED_WORDS and any(word in expected for word in ("a name", "an expression", "a value", "a type")):
        return f"If '{token}' is meant as a name, write '^{token}'."
    near = difflib.get_close_matches(token, re.findall(r"'([a-z]+)'", expected), n=1, cutoff=0.75)
    if near:
        return f"Did you mean '{near[0]}'?"
    return "Write one of the expected words here, or look for a bracket or comma missing before."


def _word(rule: Any) -> str:
    name = rule.rule_name
    if name in _RULES:
        return _RULES[name]
    text = getattr(rule, "to_match", None)
    return f"'{text}'" if isinstance(text, str) and text.isprintable() and len(text) < 20 else name
