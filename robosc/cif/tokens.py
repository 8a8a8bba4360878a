"""Text to tokens, in one pass of one regular expression, which takes the longest token everywhere.

No branch of it can try a stretch of text twice (possessive quantifiers), so its time is linear in the text.
"""

import re
from enum import IntEnum
from typing import NamedTuple

from robosc.cif.reserved_words import KEYWORDS

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


class Tokens(NamedTuple):
    """The tokens of a text, column by column; the last ones are of kind `END` and empty.

    Attributes:
        texts: Text of each as written.
        kinds: Kind of each.
        starts: Offset of each in the text.
    """

    texts: list[str]
    kinds: list[int]
    starts: list[int]


_NAME, _WORD, _END = int(Kind.NAME), int(Kind.WORD), int(Kind.END)


def tokenize(text: str) -> Tokens:
    """The tokens of a text; never fails."""
    texts: list[str] = []
    kinds: list[int] = []
    starts: list[int] = []
    for match in _TOKEN.finditer(text):
        kind = match.lastindex or 0
        if kind == _END:
            break
        token = match[kind]
        texts.append(token)
        starts.append(match.start(kind))
        kinds.append(_WORD if kind == _NAME and token in KEYWORDS else kind)
    # Several ends: who looks a token or two ahead need not ask whether there is one.
    texts += [""] * 3
    kinds += [_END] * 3
    starts += [len(text)] * 3
    return Tokens(texts, kinds, starts)
