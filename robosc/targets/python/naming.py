"""Python names for the model's names: readable, unique, and never a keyword or a name of our own."""

import builtins
import keyword
import re
from collections.abc import Iterable

_BUILTINS = frozenset(dir(builtins))


class Namer:
    """Hands out distinct Python names; the same requests in the same order give the same names.

    Args:
        taken: Names that must not be handed out.
    """

    def __init__(self, taken: Iterable[str] = ()) -> None:
        self._taken = set(taken)

    def name(self, wish: str) -> str:
        """A new name as close as possible to `wish`."""
        base = python_name(wish)
        name, number = base, 2
        while name in self._taken:
            name, number = f"{base}_{number}", number + 1
        self._taken.add(name)
        return name


def python_name(text: str) -> str:
    """A legal Python name for any text; no keyword, no built-in, and not mangled inside a class."""
    name = re.sub(r"[^A-Za-z0-9_]", "_", text)
    if not name or name[0].isdigit() or name.startswith("_"):
        name = f"x{name}"
    # Soft keywords and built-ins are legal, but a reader would stumble over them.
    return f"{name}_" if keyword.iskeyword(name) or keyword.issoftkeyword(name) or name in _BUILTINS else name


def snake_case(text: str) -> str:
    """A lower-case name with single underscores, starting with a letter: `LineFollower` -> `line_follower`."""
    spaced = re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", text)
    name = re.sub(r"_+", "_", re.sub(r"[^a-z0-9]", "_", spaced.lower())).strip("_")
    return name if name and name[0].isalpha() else f"robot_{name}".rstrip("_")
