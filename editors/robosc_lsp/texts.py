"""Texts of an editor: conversion of positions, and edits."""

import re
from bisect import bisect_left, bisect_right
from collections.abc import Iterable

from lsprotocol import types as lsp

from robosc.source import Location

_LINE_END = re.compile(r"\r\n|\r|\n")
_UTF_16_LONG = 0xFFFF
_WIDE: dict[str, re.Pattern[str]] = {
    lsp.PositionEncodingKind.Utf16: re.compile("[\U00010000-\U0010ffff]"),
    lsp.PositionEncodingKind.Utf8: re.compile("[^\x00-\x7f]"),
}
"""The characters that take more than one unit of an encoding."""
_SURROGATE = re.compile("[\ud800-\udfff]")
_MARK = "\ufeff"


class Text:
    """A text with the lines and columns of an editor and of findings.

    For an editor, a carriage return ends a line as well, and columns are code units of an encoding; findings count
    characters in lines that end with a line feed.

    Args:
        text: All of it.
        encoding: Encoding in which the editor counts: `utf-8`, `utf-16` or `utf-32`.
    """

    def __init__(self, text: str, encoding: str = lsp.PositionEncodingKind.Utf16) -> None:
        self.text = _sound(text)
        self._encoding = encoding
        self._starts = [0, *(match.end() for match in _LINE_END.finditer(self.text))]
        self._own_starts = [0, *(match.end() for match in re.finditer("\n", self.text))]
        # Offsets of the characters that take more than one unit, and how many more all of them take up to each.
        self._wide: list[int] = []
        self._more = [0]
        for match in _WIDE[encoding].finditer(self.text) if encoding in _WIDE and not self.text.isascii() else ():
            self._wide.append(match.start())
            self._more.append(self._more[-1] + self._units(match[0]) - 1)

    @property
    def whole(self) -> lsp.Range:
        """All of it."""
        return self.range(0, len(self.text))

    def offset(self, position: lsp.Position) -> int:
        """Return the offset of a position, clipped to the end of its line and of the text."""
        if position.line >= len(self._starts):
            return len(self.text)
        begin = self._starts[position.line]
        length = len(self._line(position.line))
        units = range(min(position.character, length) + 1)
        # The characters are as many as the units at most: the first whose units reach so far, or else the end of the
        # line.
        taken = self._taken(begin)
        found = bisect_left(units, position.character, key=lambda count: count + self._taken(begin + count) - taken)
        return begin + min(found, length)

    def position(self, offset: int) -> lsp.Position:
        """The position of an offset."""
        line = bisect_right(self._starts, offset) - 1
        begin = self._starts[line]
        return lsp.Position(line, offset - begin + self._taken(offset) - self._taken(begin))

    def range(self, begin: int, end: int) -> lsp.Range:
        """The range between two offsets."""
        return lsp.Range(self.position(begin), self.position(end))

    def begin_of(self, location: Location) -> int:
        """Return the offset of a location, clipped to the text."""
        if location.line > len(self._own_starts):
            return len(self.text)
        return min(self._own_starts[location.line - 1] + location.column - 1, len(self.text))

    def range_of(self, location: Location) -> lsp.Range:
        """The range of a location."""
        begin = self.begin_of(location)
        return self.range(begin, min(begin + location.length, len(self.text)))

    def line_of(self, location: Location) -> str:
        """The line in which a location is, as findings count lines, without its end."""
        number = min(location.line, len(self._own_starts))
        end = self._own_starts[number] - 1 if number < len(self._own_starts) else len(self.text)
        return self.text[self._own_starts[number - 1] : end]

    def behind_line_of(self, location: Location) -> str:
        """The text behind the line in which a location is, and behind its end."""
        return self.text[self._own_starts[location.line] :] if location.line < len(self._own_starts) else ""

    def line_and_column(self, offset: int) -> tuple[int, int]:
        """Line and column of an offset as findings count them, from 1."""
        line = bisect_right(self._own_starts, offset)
        return line, offset - self._own_starts[line - 1] + 1

    def edited(self, changes: Iterable[lsp.TextDocumentContentChangeEvent]) -> "Text":
        """The text after some changes, one after the other."""
        text = self
        for change in changes:
            if isinstance(change, lsp.TextDocumentContentChangeWholeDocument):
                text = Text(change.text, self._encoding)
            else:
                begin, end = sorted((text.offset(change.range.start), text.offset(change.range.end)))
                text = Text(text.text[:begin] + change.text + text.text[end:], self._encoding)
        return text

    def _line(self, number: int) -> str:
        """The line of a number, without its end."""
        end = self._starts[number + 1] if number + 1 < len(self._starts) else len(self.text)
        line = self.text[self._starts[number] : end]
        return line.removesuffix("\n").removesuffix("\r") if number + 1 < len(self._starts) else line

    def _taken(self, offset: int) -> int:
        """Return the number of units that the characters before an offset take beyond one each."""
        return self._more[bisect_left(self._wide, offset)]

    def _units(self, character: str) -> int:
        if self._encoding == lsp.PositionEncodingKind.Utf16:
            return 2 if ord(character) > _UTF_16_LONG else 1
        if self._encoding == lsp.PositionEncodingKind.Utf8:
            return len(character.encode("utf-8", errors="surrogatepass"))
        return 1


def _sound(text: str) -> str:
    """Return a valid text with the same offsets.

    Lone surrogates, which an editor may send, become U+FFFD, and a byte order mark becomes a blank.
    """
    if _SURROGATE.search(text):
        text = text.encode("utf-16-le", errors="surrogatepass").decode("utf-16-le", errors="replace")
    return " " + text[1:] if text.startswith(_MARK) else text
