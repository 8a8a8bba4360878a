"""Layout of statements: one line for each statement if it fits, else broken at its groups.

A group is broken if it does not fit on the rest of its line or holds a comment that ends a line, and then at all of
its breaks (consistent breaking: D. C. Oppen, Prettyprinting, ACM TOPLAS 2(4), 1980, 465-483). The widths of
all stretches of a statement come from one sum over its tokens, so the time is linear.
"""

from collections.abc import Mapping, Sequence
from itertools import accumulate

from robosc.formatting.gaps import Gap
from robosc.formatting.statements import Break, Group, Statement, Structure

WIDTH = 120
"""Columns that a line should keep to."""

INDENTATION = 4
"""Blanks a level."""

_DEEPEST = 20
"""Levels beyond which nothing is indented further: some of the line must be left, and the text must not explode."""

_TIGHT_BEFORE = frozenset({",", ":", ".", "..", ")", "]", "["})
_TIGHT_BEHIND = frozenset({"(", "[", ".", ".."})
_TIGHT_INSIDE = frozenset({"(", "["})
_TIGHT_BEHIND_COMMENT = frozenset({",", ":", ")", "]"})
_NO_LINES = Gap(((), ()), (False, False))


def lay_out(texts: Sequence[str], gaps: Mapping[int, Gap], structure: Structure, line_end: str) -> str:
    """Return the canonical text.

    Args:
        texts: The tokens as written, an empty one behind the last.
        gaps: Comments and blank lines, by the token behind them.
        structure: Structure that says what belongs to one line, and where lines may be broken.
        line_end: Characters that end a line.
    """
    writer = _Writer(texts, gaps, structure, line_end)
    for statement in structure.statements:
        writer.statement(statement)
    writer.end(structure.statements[-1].last + 1)
    return "".join(writer.parts)


class _Open:
    """A group that is being written.

    Attributes:
        last: Its last token.
        level: Indentation of its lines.
        outer: Indentation of the line with its closing bracket.
        is_broken: True if its breaks are taken.
    """

    __slots__ = ("is_broken", "last", "level", "outer")

    def __init__(self, last: int, level: int, outer: int, *, is_broken: bool) -> None:
        self.last = last
        self.level = level
        self.outer = outer
        self.is_broken = is_broken


class _Measures:
    """Widths in a statement that is written on one line, and where it can or must be broken.

    Attributes:
        starts: Column of each token, from that of the first.
        ends: Column behind each token.
        stops: For each token, the first one behind it with a possible break before it; else the one behind the last.
        forced: For each token, how many breaks up to the one before it must be taken.
    """

    def __init__(self, separators: Sequence[str], texts: Sequence[str], breaks: Sequence[int], forced: Sequence[bool]):
        widths = [len(separator) + len(text) for separator, text in zip(separators, texts, strict=True)]
        self.ends = list(accumulate(widths))
        self.starts = [end - len(text) for end, text in zip(self.ends, texts, strict=True)]
        self.forced = list(accumulate(forced))
        self.stops = [len(texts)] * len(texts)
        for index in range(len(texts) - 2, -1, -1):
            can_break = breaks[index + 1] or forced[index + 1]
            self.stops[index] = index + 1 if can_break else self.stops[index + 1]

    def must_break(self, first: int, last: int) -> bool:
        """Return True if a break between these tokens must be taken."""
        return self.forced[last] > self.forced[first]

    def width(self, first: int, last: int, *, with_gap: bool) -> int:
        """Columns of these tokens, perhaps with the gap before them, and of what cannot be broken off behind them."""
        begin = self.ends[first - 1] if with_gap else self.starts[first]
        return self.ends[self.stops[last] - 1] - begin


class _Writer:
    """Writer of a text, statement by statement.

    Attributes:
        parts: Parts of the text that have been written.
    """

    def __init__(self, texts: Sequence[str], gaps: Mapping[int, Gap], structure: Structure, line_end: str) -> None:
        self.parts: list[str] = []
        self._texts = texts
        self._gaps = gaps
        self._breaks = structure.breaks
        self._tight = structure.tight
        self._line_end = line_end
        self._column = 0
        self._level = 0

    def statement(self, statement: Statement) -> None:
        """Write a statement on new lines; a closing brace of nothing stays behind the opening one."""
        first, level = statement.first, statement.level
        gap = self._gaps.get(first, _NO_LINES)
        is_closing = self._texts[first] == "}"
        if is_closing and self._texts[first - 1] == "{" and not gap.is_breaking:
            self._write(self._separator(first))
        else:
            self._break(first, level, level + is_closing, is_closing=is_closing, keeps_blanks=True)
        line = self._one_line(statement)
        if line is None:
            self._lines(statement)
        else:
            self._write(line)

    def end(self, index: int) -> None:
        """Write what stands before the end, the token of this index, and end the last line."""
        self._break(index, 0, 0, is_closing=True, keeps_blanks=True)

    # One line

    def _one_line(self, statement: Statement) -> str | None:
        """A statement on one line, or None if it does not fit on one."""
        texts, gaps = self._texts, self._gaps
        parts = [texts[statement.first]]
        for index in range(statement.first + 1, statement.last + 1):
            if index in gaps and self._is_forced(index):
                return None
            parts.append(self._separator(index))
            parts.append(texts[index])
        line = "".join(parts)
        return line if self._column + len(line) <= WIDTH else None

    def _separator(self, index: int) -> str:
        """Return the text that stands before a token on the line of the one before it."""
        gap = self._gaps.get(index)
        if gap is not None and gap.inline:
            before = "" if self._texts[index - 1] in _TIGHT_INSIDE else " "
            behind = "" if self._texts[index] in _TIGHT_BEHIND_COMMENT else " "
            return f"{before}{self._joined(gap.inline)}{behind}"
        if self._tight[index] or self._texts[index] in _TIGHT_BEFORE or self._texts[index - 1] in _TIGHT_BEHIND:
            return ""
        return " "

    def _is_forced(self, index: int) -> bool:
        """Return True if a token in a statement must begin a line: after a comment, or where a blank line is kept."""
        gap = self._gaps.get(index)
        if gap is None:
            return False
        keeps_blank = self._breaks[index] == Break.ENTRY and self._texts[index - 1] != "{"
        return gap.is_breaking or (keeps_blank and gap.has_blank_line)

    # Several lines

    def _lines(self, statement: Statement) -> None:
        first = statement.first
        measures = self._measures(statement)
        opened: dict[int, list[Group]] = {}
        for group in reversed(statement.groups):
            opened.setdefault(group.first, []).append(group)
        stack = [_Open(statement.last, statement.level + 1, statement.level, is_broken=True)]
        for index in range(first, statement.last + 1):
            groups = opened.get(index, [])
            stack += [self._open(group, first, measures, stack) for group in groups if group.is_clause]
            if index > first:
                self._gap(index, stack[-1])
            for group in groups:
                if not group.is_clause:
                    stack.append(self._open(group, first, measures, stack))
            self._write(self._texts[index])
            while stack and stack[-1].last == index:
                stack.pop()

    def _measures(self, statement: Statement) -> _Measures:
        first, behind = statement.first, statement.last + 1
        inner = range(first + 1, behind)
        return _Measures(
            ["", *map(self._separator, inner)],
            self._texts[first:behind],
            self._breaks[first:behind],
            [False, *map(self._is_forced, inner)],
        )

    def _open(self, group: Group, offset: int, measures: _Measures, stack: Sequence[_Open]) -> _Open:
        """Decide whether a group, which begins here, is broken."""
        around = stack[-1]
        first, last = group.first - offset, group.last - offset
        is_broken = around.is_broken and (
            measures.must_break(first, last)
            or self._column + measures.width(first, last, with_gap=group.is_clause) > WIDTH
        )
        # A bracket at the end of a statement's first line closes under the begin of that line.
        outer = self._level if group.is_bracket and len(stack) == 1 else around.level
        return _Open(group.last, outer + group.levels, outer, is_broken=is_broken)

    def _gap(self, index: int, group: _Open) -> None:
        """Write what stands before a token that is not the first of its statement."""
        kind = self._breaks[index]
        if not ((kind and group.is_broken) or self._is_forced(index)):
            self._write(self._separator(index))
            return
        is_closing = kind == Break.CLOSE
        level = group.outer if is_closing else group.level
        keeps_blanks = is_closing or kind == Break.ENTRY
        self._break(index, level, group.level, is_closing=is_closing, keeps_blanks=keeps_blanks)

    # Line ends and comments

    def _break(self, index: int, level: int, comment_level: int, *, is_closing: bool, keeps_blanks: bool) -> None:
        """End a line, write the comments before a token, and begin its line.

        Args:
            index: The token.
            level: Its indentation.
            comment_level: Indentation of comments on lines of their own.
            is_closing: True if it closes something, so that no comment goes before it on its line.
            keeps_blanks: True if blank lines are kept.
        """
        gap = self._gaps.get(index, _NO_LINES)
        if len(gap.segments) == 1:
            # A comment between two tokens of one line goes with the second, unless that is a closing bracket.
            head = gap.segments[0]
            gap = Gap((head, ()) if is_closing else ((), head), (False, False))
        head, *behind = gap.segments
        if head:
            self._write(f"  {self._joined(head)}")
        own = list(zip(behind, gap.blanks[1:], strict=True))
        leading, has_blank = ((), False) if is_closing and behind[-1] else own.pop()
        # No blank line stands behind what opens something, or before what closes it.
        keeps_next = keeps_blanks and bool(self.parts) and self._texts[index - 1] != "{"
        for comments, has_blank_before in own:
            self._new_line(comment_level, blank=has_blank_before and keeps_next)
            self._write(self._joined(comments))
            keeps_next = keeps_blanks
        self._new_line(level, blank=has_blank and keeps_next and not is_closing)
        if leading:
            self._write(f"{self._joined(leading)} ")

    def _new_line(self, level: int, *, blank: bool) -> None:
        if self.parts:
            self.parts.append(self._line_end * (1 + blank))
        self._level = level
        self._column = min(level, _DEEPEST) * INDENTATION
        self.parts.append(" " * self._column)

    def _joined(self, comments: Sequence[str]) -> str:
        return " ".join(comments).replace("\n", self._line_end)

    def _write(self, text: str) -> None:
        self.parts.append(text)
        if "\n" in text:
            self._column = 0
            text = text[text.rindex("\n") + 1 :]
        self._column += len(text)
