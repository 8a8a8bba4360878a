"""Comments and blank lines between the tokens of a text, which the formatter keeps."""

import re
from collections.abc import Mapping
from typing import NamedTuple

from robosc.language.tokens import COMMENT, Kind, Tokens

_PART = re.compile(rf"{COMMENT.pattern}|\n")

_BLANKS = " \t\r\n"

_MOVED_BEHIND = frozenset({",", "{"})
"""A line never begins with one of these, so a comment that ends the line before it goes behind it."""


class Gap(NamedTuple):
    """Comments and blank lines before a token.

    Attributes:
        segments: The comments, line by line. The first segment stands on the line of the token before, the last one
            on the line of the token behind; if there is but one, both tokens share a line.
        blanks: For each segment, whether a blank line stands before it; never before the first.
    """

    segments: tuple[tuple[str, ...], ...]
    blanks: tuple[bool, ...]

    @property
    def is_breaking(self) -> bool:
        """True if a comment ends its line, so that the tokens around the gap cannot share one."""
        return any(self.segments[:-1])

    @property
    def inline(self) -> tuple[str, ...]:
        """The comments of a gap that is not breaking."""
        return self.segments[-1]

    @property
    def has_blank_line(self) -> bool:
        """True if there is a blank line anywhere."""
        return any(self.blanks)


def find_gaps(text: str, tokens: Tokens) -> Mapping[int, Gap]:
    """The gaps that are worth keeping, each by the index of the token behind it; the first end counts as a token."""
    found: dict[int, Gap] = {}
    end, carried = 0, ""
    for index, (token, kind, start) in enumerate(zip(*tokens, strict=True)):
        between = _joined(carried, text[end:start]) if carried else text[end:start]
        carried = ""
        end = start + len(token)
        # Most gaps are one blank or nothing.
        if index and kind != Kind.END and "/" not in between and between.count("\n") < 2:
            continue
        # Before the text there is no line for a comment to end, and the end of the text ends every line.
        gap = _read("\n" * (not index) + between + "\n" * (kind == Kind.END))
        if gap.is_breaking and token in _MOVED_BEHIND:
            carried = between
        elif any(gap.segments) or gap.has_blank_line:
            found[index] = gap
        if kind == Kind.END:
            break
    return found


def _joined(before: str, behind: str) -> str:
    """The gaps before and behind a token as one; the line end between them counts once."""
    comments = before.rstrip(_BLANKS)
    ends_line = "\n" in before[len(comments) :]
    rest = behind.lstrip(_BLANKS)
    blanks = behind[: len(behind) - len(rest)]
    if not rest and blanks.count("\n") < 2:
        return comments + "\n" * ends_line
    return comments + "\n" * (ends_line and "\n" not in blanks) + behind


def _read(between: str) -> Gap:
    segments: list[list[str]] = [[]]
    blanks = [False]
    for match in _PART.finditer(between):
        part = match[0]
        if part != "\n":
            segments[-1].append(_stripped(part))
        elif segments[-1] or len(segments) == 1:
            segments.append([])
            blanks.append(False)
        else:
            blanks[-1] = True
    return Gap(tuple(map(tuple, segments)), tuple(blanks))


def _stripped(comment: str) -> str:
    """A comment without blanks at the ends of its lines."""
    if "\n" not in comment:
        return comment.rstrip(_BLANKS)
    return "\n".join(line.rstrip(_BLANKS) for line in comment.split("\n"))
