"""Problems of a configuration: every problem with its place, all reported at once."""

import json
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches

from robosc.source import visible
from robosc_bridge.errors import BridgeError

Path = tuple[str | int, ...]
"""Keys and indices from the top of a document to a place in it."""

_PLAIN_KEY = re.compile(r"[A-Za-z_][A-Za-z_0-9-]*\Z")
_LONGEST_SHOWN = 60


@dataclass(frozen=True, slots=True)
class Problem:
    """One problem.

    Attributes:
        message: Description of what is wrong, and of what would be right.
        path: Place in the document.
        line: Line of the file, counted from 1; None: nowhere in particular.
    """

    message: str
    path: Path = ()
    line: int | None = None

    def text(self, file: str) -> str:
        """The problem on one line, with the place that editors jump to; identifiers of a model may be any text."""
        place = file if self.line is None else f"{file}:{self.line}"
        where = f"{path_text(self.path)}: " if self.path else ""
        return visible(f"{place}: {where}{self.message}")


class ConfigurationError(BridgeError):
    """A configuration cannot be used; lists all its problems, one a line.

    Args:
        file: Name of the file.
        problems: At least one; those with a line are sorted by it, the others come last.
    """

    def __init__(self, file: str, problems: Iterable[Problem]) -> None:
        self.file = file
        self.problems = tuple(sorted(problems, key=lambda item: (item.line is None, item.line or 0)))
        super().__init__("\n".join(item.text(file) for item in self.problems))


def path_text(path: Path) -> str:
    """A place in a document as a person reads it: `channels["/scan"].channel`."""
    found = ""
    for step in path:
        if isinstance(step, int):
            found += f"[{step}]"
        elif _PLAIN_KEY.match(step):
            found += f".{step}" if found else step
        else:
            found += f"[{value_text(step)}]"
    return found


def value_text(value: object) -> str:
    """A value in a message: short, and on one line whatever is in it."""
    if isinstance(value, Mapping):
        return "a mapping"
    if isinstance(value, list):
        return "a list"
    if value is None:
        return "nothing"
    text = json.dumps(value)
    return text if len(text) <= _LONGEST_SHOWN else text[: _LONGEST_SHOWN - 3] + "..."


def hint(name: str, known: Iterable[str]) -> str:
    """Return a hint for a name that does not exist: the nearest of the existing names, or all of them."""
    there = sorted(set(known))
    close = get_close_matches(name, there, n=1)
    if close:
        return f"did you mean '{close[0]}'?"
    return f"there is {', '.join(there)}" if there else "there is none"
