"""Small helpers for writing program text of any language."""


def indent(lines: list[str], levels: int = 1) -> list[str]:
    """The lines, further right; empty ones stay empty."""
    return [f"{'    ' * levels}{line}" if line else "" for line in lines]


def ascii_line(text: str) -> str:
    """A text as one line of printable ASCII; everything else stands as an escape of Python."""
    return "".join(char if " " <= char <= "~" else char.encode("unicode_escape").decode("ascii") for char in text)


def printable(text: str) -> str:
    """A text for a comment or a docstring of generated code: one line, ASCII, no quotes that could end it."""
    return ascii_line(text).replace("\\", "\\\\").replace('"""', "'''")
