"""Text to tokens, in one pass of one regular expression.

No branch of it can try a stretch of text twice (possessive quantifiers, no nesting), so its time is linear
in the text, whatever that is.
"""

import re
from bisect import bisect_right
from collections.abc import Collection
from enum import IntEnum
from typing import NamedTuple

from robosc.errors import Diagnostic, Severity
from robosc.language.words import RESERVED_WORDS
from robosc.source import Location, SourceFile

_BLOCK_COMMENT = r"/\*[^*]*+\*++(?:[^/*][^*]*+\*++)*+/"
_LINE_COMMENT = r"//[^\n]*+"
_BLANK = r"[ \t\r\n]++"
_STRING = r""""[^"\\]*+(?:\\[\s\S][^"\\]*+)*+"|'[^'\\]*+(?:\\[\s\S][^'\\]*+)*+'"""
_STRING_OF_A_LINE = r""""[^"\\\n]*+(?:\\.[^"\\\n]*+)*+"|'[^'\\\n]*+(?:\\.[^'\\\n]*+)*+'"""


def _pattern(string: str, open_string: str) -> re.Pattern[str]:
    """One token with the blanks and comments before it."""
    return re.compile(
        rf"(?:{_BLANK}|{_LINE_COMMENT}|{_BLOCK_COMMENT})*+"
        r"(?:(\^?[A-Za-z_][A-Za-z_0-9]*+)"
        r"|(->|\.\.|:=|=>|!=|<=|>=|/(?!\*)|[{}()\[\],.:=<>+\-*!])"
        r"|([0-9]++(?:\.[0-9]++)?)"
        rf"|({string})"
        # A text that is never closed takes the rest: no later quote of it needs to look for its end again.
        rf"|({open_string}|/\*[\s\S]*+|[\s\S])"
        # The end is an alternative, so that blanks before it are not tried once more from each of them.
        r"|(\Z))"
    )


_TOKEN = _pattern(_STRING, r"[\"'][\s\S]*+")
_TOKEN_BY_LINE = _pattern(_STRING_OF_A_LINE, r"[\"'][^\n]*+")

_LONGEST = 300
"""Characters of a text without a quote that are looked at."""

COMMENT = re.compile(f"{_LINE_COMMENT}|{_BLOCK_COMMENT}")
"""One comment of either kind."""


class Kind(IntEnum):
    """Kind of a token."""

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
        texts: Text of each as written, a `^` included.
        kinds: Kind of each.
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
    return _tokens(text, _TOKEN)


def tokenize_broken(text: str) -> Tokens:
    """Tokenize like `tokenize`; if a text in quotes is never closed, every such text ends at the end of its line.

    One quote too many swaps texts and code in all that follows. Ended by line, it spoils only its own line.
    """
    tokens = tokenize(text)
    last = len(tokens.texts) - _ENDS - 1
    is_open = last >= 0 and tokens.kinds[last] == Kind.OTHER and is_open_string(tokens.texts[last])
    return _tokens(text, _TOKEN_BY_LINE) if is_open else tokens


def _tokens(text: str, pattern: re.Pattern[str]) -> Tokens:
    return tokens_of(text, pattern, RESERVED_WORDS, word=_WORD, end=_END)


def tokens_of(text: str, pattern: re.Pattern[str], words: Collection[str], *, word: int, end: int) -> Tokens:
    """The tokens that a pattern finds, each kind in the group of its number, in a text of this language or another.

    Args:
        text: The text.
        pattern: Pattern of a token with the blanks before it; the first group is of names.
        words: Names that are reserved words.
        word: Kind of these.
        end: Kind of the end of the text.
    """
    texts: list[str] = []
    kinds: list[int] = []
    starts: list[int] = []
    for match in pattern.finditer(text):
        kind = match.lastindex or 0
        if kind == end:
            break
        token = match[kind]
        texts.append(token)
        starts.append(match.start(kind))
        kinds.append(word if kind == 1 and token in words else kind)
    # Several ends: who looks a token or two ahead need not ask whether there is one.
    texts += [""] * _ENDS
    kinds += [end] * _ENDS
    starts += [len(text)] * _ENDS
    return Tokens(texts, kinds, starts)


def is_open_comment(token: str) -> bool:
    """Return True if a token of kind `OTHER` is a comment that is never closed."""
    return token.startswith("/*")


def is_open_string(token: str) -> bool:
    """Return True if a token of kind `OTHER` is a text in quotes that is never closed."""
    return token[:1] in ("'", '"')


def readable_tokens(text: str) -> Tokens:
    """The tokens of a text that has an obstacle, as a grammar can read them.

    A text in quotes that is never closed is closed at the end of its line, and a comment that is never closed ends
    everything.
    """
    found = tokenize_broken(text)
    count = found.kinds.index(_END)
    if count and found.kinds[count - 1] == Kind.OTHER and is_open_comment(found.texts[count - 1]):
        for column in found:
            del column[count - 1]
    kinds = [
        int(Kind.STRING) if kind == Kind.OTHER and is_open_string(token) else kind
        for token, kind in zip(found.texts, found.kinds, strict=True)
    ]
    return Tokens(found.texts, kinds, found.starts)


_PATH = r"[\w/~{}.\-]+"


def _open_string(text: str, quote: str, start: int, places: Places) -> Diagnostic:
    """Return the error that one of the two quotes around a text is missing."""
    message, begin, end = "this text is never closed", start, start + 1
    fix = f"Close it with {quote}."
    before = re.search(rf":[ \t]*+({_PATH})\Z", text[max(0, start - _LONGEST) : start])
    behind = re.match(_PATH, text[start + 1 : start + _LONGEST])
    if before is not None:
        message, begin = "this text has no opening quote", start - len(before[1])
        written, meant = f"{before[1]}{quote}", f"{quote}{before[1]}{quote}"
        fix = f"Write '{meant}' instead of '{written}'."
    elif behind is not None:
        end += len(behind[0])
        written = text[start:end]
        fix = f"Write '{written}{quote}' instead of '{written}'."
    return Diagnostic(Severity.ERROR, "unclosed-string", message, places.location(begin, end), fix)


def obstacle(file: SourceFile, tokens: Tokens, places: Places) -> Diagnostic | None:
    """Return the error that hides the rest of a text from the grammar.

    The cause is NUL, or a comment or text in quotes that is never closed.
    """
    text = file.text

    def found(code: str, message: str, offset: int, fix: str) -> Diagnostic:
        return Diagnostic(Severity.ERROR, code, message, places.location(offset, offset + 1), fix)

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
        if is_open_comment(token):
            return found("unclosed-comment", "this comment is never closed", start, "Close it with '*/'.")
        if is_open_string(token):
            # A missing quote swaps texts and code in all that follows: tokens by line show where it is missing.
            for other, other_kind, begin in zip(*tokenize_broken(text), strict=True):
                if other_kind == Kind.OTHER and is_open_string(other):
                    token, start = other, begin
                    break
            return _open_string(text, token[0], start, places)
    return None
