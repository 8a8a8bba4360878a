"""Markdown with every part escaped, so that no name of a topic can break a table.

Written for CommonMark with the tables of GitHub (https://github.github.com/gfm), which most viewers know.
"""

import re
from collections.abc import Iterable, Sequence

from robosc.source import visible

_PLAIN_CODE = re.compile(r"[^`|\\ ](?:[^`|\\]*[^`|\\ ])?")
"""Text that stands in a code span just as it is, also in a cell of a table."""

_PLAIN_TEXT = re.compile(r"[A-Za-z0-9 ,;()'/-]")
"""Characters that mean nothing to Markdown wherever they stand inside a line."""


def quoted(text: str) -> str:
    """A free text as it is, or in quotes and with escapes where it is empty or holds what cannot be seen."""
    if text and text.isprintable():
        return text
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{visible(escaped)}"'


def code(text: str) -> str:
    """Text in the typeface of code, on one line."""
    shown = visible(text)
    if _PLAIN_CODE.fullmatch(shown):
        return f"`{shown}`"
    # A code span cannot hold these: HTML can, with every character that Markdown knows as a reference.
    return f"<code>{entities(shown)}</code>"


def entities(text: str) -> str:
    """Text in which every character that could mean something to Markdown or HTML is a reference by number."""
    return "".join(
        character if _PLAIN_TEXT.match(character) or ord(character) > 127 else f"&#{ord(character)};"
        for character in visible(text)
    )


def codes(texts: Iterable[str], conjunction: str = "and") -> str:
    """Several texts as code: `a`, `b` and `c`."""
    listed = [code(text) for text in texts]
    return f" {conjunction} ".join(filter(None, (", ".join(listed[:-1]), *listed[-1:])))


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table; cells are Markdown on one line."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)


def bullets(items: Iterable[str], depth: int = 0) -> str:
    """A list; items are Markdown on one line."""
    return "\n".join(f"{'  ' * depth}- {item}" for item in items)


def heading(level: int, text: str) -> str:
    """A heading; the text is Markdown on one line."""
    return f"{'#' * level} {text}"


def fence(language: str, text: str) -> str:
    """A block of code in a language that the viewer may know; `text` has no line that begins with a back quote."""
    return f"```{language}\n{text}\n```"


def blocks(*parts: str) -> str:
    """Parts with an empty line between them; empty parts are left out."""
    return "\n\n".join(part for part in parts if part)


def count(number: int, noun: str, plural: str = "") -> str:
    """For instance `1 state`, `2 states`, `no states`."""
    return f"{number or 'no'} {noun if number == 1 else plural or f'{noun}s'}"
