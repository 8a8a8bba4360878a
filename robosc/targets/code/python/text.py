"""Small helpers for writing Python text."""

import textwrap

from robosc.targets.text import printable

_WIDTH = 88


def comment(text: str) -> list[str]:
    """A comment, wrapped."""
    return [f"# {line}" for line in textwrap.wrap(printable(text), _WIDTH, break_on_hyphens=False)]


def docstring(text: str) -> str:
    """A one-line docstring."""
    body = printable(text)
    return f'"""{body} """' if body.endswith('"') else f'"""{body}"""'
