"""The reserved words of part A, and the language's words for what the parser expects."""

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
    "NumberToken": "a number",
    "Integer": "a whole number",
    "StringToken": "a text in quotes",
    "Operator": "an operator",
    "PrefixSign": "",
    "ReceivedValue": "'value'",
    "PropertyColon": "':'",
    "Arrow": "'->'",
    "EOF": "the end of the file",
    "Comment": "",
}
_MAXIMUM_WORDS = 8


def expected_words(rules: Iterable[Any]) -> str:
    """What a parser's expected rules are called, at most eight of them, as one phrase."""
    words = dict.fromkeys(_word(rule) for rule in rules)
    words.pop("", None)
    if "a name" in words and "a number" in words:
        # All that begins an expression, told in one word.
        for part in ("a name", "a number", "a text in quotes", "'value'", "'true'", "'false'", "'('"):
            words.pop(part, None)
        words = {"an expression": None, **words}
    shown = sorted(words, key=lambda word: (not word.startswith("a"), word))
    if len(shown) > _MAXIMUM_WORDS:
        shown = [*shown[:_MAXIMUM_WORDS], "..."]
    return " or ".join([", ".join(shown[:-1]), shown[-1]]) if len(shown) > 1 else "".join(shown)


def _word(rule: Any) -> str:
    name = rule.rule_name
    if name in _RULES:
        return _RULES[name]
    text = getattr(rule, "to_match", None)
    return f"'{text}'" if isinstance(text, str) and text.isprintable() and len(text) < 20 else name
