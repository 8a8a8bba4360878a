"""Text to tokens, in one pass of one regular expression, which takes the longest token everywhere.

No branch of it can try a stretch of text twice (possessive quantifiers), so its time is linear in the text.
"""

import re
from enum import IntEnum

from robosc.cif.reserved_words import KEYWORDS
from robosc.language.tokens import Tokens, tokens_of

_ID = r"\$?[A-Za-z_][A-Za-z0-9_]*+"
_WHOLE = r"(?:0|[1-9][0-9]*+)"
_TOKEN = re.compile(
    r"(?:[ \t\r\n]++|//[^\n]*+|/\*[^*]*+\*++(?:[^/*][^*]*+\*++)*+/)*+"
    rf"(?:([.^]?{_ID}(?:\.{_ID})*+)"
    rf"|({_WHOLE}(?:\.[0-9]++(?:[eE][+-]?[0-9]++)?|[eE][+-]?[0-9]++))"
    rf"|({_WHOLE})"
    r'|("(?:[^"\\\n]|\\[nt"\\])*+")'
    r"|(@@?[A-Za-z_][A-Za-z0-9_]*+(?::[A-Za-z_][A-Za-z0-9_]*+)*+)"
    r"|(:=|<=>|<=|>=|=>|!=|\.\.|/(?!\*)|[,;:'!?~*<=>+\-{}()\[\]])"
    r"|(/\*[\s\S]*+|[\s\S])"
    r"|(\Z))"
)


class Kind(IntEnum):
    """Kind of a token."""

    NAME = 1
    """A plain, relative, absolute or root name."""
    REAL = 2
    INTEGER = 3
    STRING = 4
    ANNOTATION = 5
    SIGN = 6
    OTHER = 7
    """A character that the language has no use for, an unclosed string or an unclosed comment."""
    END = 8
    WORD = 9
    """A reserved word."""


_WORD, _END = int(Kind.WORD), int(Kind.END)


def tokenize(text: str) -> Tokens:
    """The tokens of a text; never fails."""
    return tokens_of(text, _TOKEN, KEYWORDS, word=_WORD, end=_END)
