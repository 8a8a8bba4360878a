"""Tables in HTML, as which results are displayed in a notebook."""

from collections.abc import Iterable, Sequence
from itertools import islice

MAXIMUM_ROWS = 200
"""Rows that a table shows: what has more of them is not read row by row."""

_STYLE = "text-align:left;vertical-align:top;white-space:pre-wrap"


def html_table(head: Sequence[str], rows: Iterable[Sequence[object]], *, caption: str = "") -> str:
    """Return a table; every text is escaped, and of very many rows the first are shown.

    Args:
        head: Titles of the columns.
        rows: The rows, a value for each column.
        caption: Line above the table; empty: none.
    """
    remaining = iter(rows)
    shown = list(islice(remaining, MAXIMUM_ROWS))
    left = sum(1 for _ in remaining)
    lines = ["<table>"]
    if caption:
        lines.append(f'<caption style="{_STYLE}">{_escaped(caption)}</caption>')
    lines.append(f"<thead><tr>{_cells('th', head)}</tr></thead>")
    lines.append("<tbody>")
    lines += [f"<tr>{_cells('td', row)}</tr>" for row in shown]
    if left:
        lines.append(f'<tr><td colspan="{len(head)}">... and {left} more</td></tr>')
    return "\n".join([*lines, "</tbody>", "</table>"]) + "\n"


def html_text(text: str) -> str:
    """Return a text as it would stand in a terminal."""
    return f"<pre>{_escaped(text)}</pre>\n"


def _escaped(text: str) -> str:
    from html import escape  # needed in notebooks alone

    return escape(text)


def _cells(tag: str, values: Iterable[object]) -> str:
    return "".join(f'<{tag} style="{_STYLE}">{_escaped(str(value))}</{tag}>' for value in values)
