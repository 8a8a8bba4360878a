"""Small helpers for writing Python text."""

import textwrap

_WIDTH = 110


def indent(lines: list[str], levels: int = 1) -> list[str]:
    """The lines, further right; empty ones stay empty."""
    return [f"{'    ' * levels}{line}" if line else "" for line in lines]


def printable(text: str) -> str:
    """A text for a comment or a docstring of generated code: one line, ASCII, no quotes that could end it."""
    ascii_text = "".join(char if " " <= char <= "~" else char.encode("unicode_escape").decode("ascii") for char in text)
    return ascii_text.replace("\\", "\\\\").replace('"""', "'''")


def comment(text: str) -> list[str]:
    """A comment, wrapped."""
    return [f"# {line}" for line in textwrap.wrap(printable(text), _WIDTH, break_on_hyphens=False)]


def docstring(text: str) -> str:
    """A one-line docstring."""
    body = printable(text)
    return f'"""{body} """' if body.endswith('"') else f'"""{body}"""'
