"""Text to tokens, in one pass of one regular expression.

No branch of it can try a stretch of text twice (possessive quantifiers, no nesting), so its time is linear
in the text, whatever that is.
"""

import re
from bisect import bisect_right
from enum import IntEnum
from typing import NamedTuple

from robosc.errors import Diagnostic, Severity
from robosc.language.words import RESERVED_WORDS
from robosc.source import Location, SourceFile

_BLOCK_COMMENT = r"/\*[^*]*+\*++(?:[^/*][^*]*+\*++)*+/"
_LINE_COMMENT = r"//[^\n]*+"
_BLANK = r"[ \t\r\n]++"
_STRING = r""""[^"\\]*+(?:\\[\s\S][^"\\]*+)*+"|'[^'\\]*+(?:\\[\s\S][^'\\]*+)*+'"""

_TOKEN = re.compile(
    rf"(?:{_BLANK}|{_LINE_COMMENT}|{_BLOCK_COMMENT})*+"
    r"(?:(\^?[A-Za-z_][A-Za-z_0-9]*+)"
    r"|(->|\.\.|:=|=>|!=|<=|>=|/(?!\*)|[{}()\[\],.:=<>+\-*!])"
    r"|([0-9]++(?:\.[0-9]++)?)"
    rf"|({_STRING})"
    # What is never closed takes the rest of the text: no later quote of it needs to look for its end again.
    r"|([\"'][\s\S]*+|/\*[\s\S]*+|[\s\S])"
    # Without the end as an alternative, blanks before it would be tried once more from each of them.
    r"|(\Z))"
)

COMMENT = re.compile(f"{_LINE_COMMENT}|{_BLOCK_COMMENT}")
"""One comment of either kind."""


class Kind(IntEnum):
    """What a token is."""

    NAME = 1
    """A free name, or any word behind a `^`."""
    SIGN = 2
    NUMBER = 3
    STRING = 4
    OTHER = 5
    """A character that the language has no use for, or all that follows an opening without its end."""
    END = 6
    """Behind the last token."""
    WORD = 7
    """A reserved word."""


class Tokens(NamedTuple):
    """The tokens of a text, column by column; the last ones are of kind `END` and empty.

    Attributes:
        texts: What is written, a `^` included.
        kinds: What each is.
        starts: Offset of each in the text.
    """

    texts: list[str]
    kinds: list[int]
    starts: list[int]


class Places:
    """Offsets to lines and columns."""

    def __init__(self, file: SourceFile) -> None:
        self._name = file.name
        self._starts = [0]
        self._starts.extend(match.end() for match in re.finditer("\n", file.text))
        self._length = len(file.text)

    def location(self, begin: int, end: int) -> Location:
        """The place from `begin` to `end`, cut at the end of its first line."""
        starts = self._starts
        line = bisect_right(starts, begin)
        last = starts[line] - 1 if line < len(starts) else self._length
        return Location(self._name, line, begin - starts[line - 1] + 1, max(1, min(end, last) - begin))


# Plain numbers: looking one up in an enum would cost more than the rest of the loop.
_END, _WORD = int(Kind.END), int(Kind.WORD)
_ENDS = 3


def tokenize(text: str) -> Tokens:
    """The tokens of a text; never fails."""
    texts: list[str] = []
    kinds: list[int] = []
    starts: list[int] = []
    words = RESERVED_WORDS
    for match in _TOKEN.finditer(text):
        kind = match.lastindex or 0
        if kind == _END:
            break
        token = match[kind]
        texts.append(token)
        starts.append(match.start(kind))
        kinds.append(_WORD if kind == 1 and token in words else kind)
    # Several ends: who looks a token or two ahead need not ask whether there is one.
    texts += [""] * _ENDS
    kinds += [_END] * _ENDS
    starts += [len(text)] * _ENDS
    return Tokens(texts, kinds, starts)


def obstacle(file: SourceFile, tokens: Tokens, places: Places) -> Diagnostic | None:
    """What hides the rest of a text, so that no grammar can read it: NUL, a comment or string that never ends."""
    text = file.text

    def found(code: str, message: str, offset: int, mend: str) -> Diagnostic:
        return Diagnostic(Severity.ERROR, code, message, places.location(offset, offset + 1), mend)

    if not text or text.isspace():
        return found("empty-file", "the file is empty", 0, "Write a robot or a library.")
    nul = text.find("\0")
    if nul >= 0:
        return found("invalid-character", "the text contains a NUL character", nul, "Remove it.")
    if Kind.OTHER not in tokens.kinds:
        return None
    for index, kind in enumerate(tokens.kinds):
        if kind != Kind.OTHER:
            continue
        token, start = tokens.texts[index], tokens.starts[index]
        if token.startswith("/*"):
            return found("unclosed-comment", "this comment is never closed", start, "Close it with '*/'.")
        if token[0] in "\"'":
            return found("unclosed-string", "this text is never closed", start, f"Close it with {token[0]}.")
    return None
