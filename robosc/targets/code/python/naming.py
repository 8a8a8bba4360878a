"""Python names for the model's names: readable, unique, and never a keyword or a name of our own."""

import builtins
import keyword

from robosc.targets.code.naming import Namer

_BUILTINS = frozenset(dir(builtins))


class PythonNamer(Namer):
    """Hands out distinct Python names."""

    def legal(self, preferred_name: str) -> str:
        """A legal Python name for any text; no keyword, no built-in, and not mangled inside a class."""
        name = super().legal(preferred_name)
        if not name or name[0].isdigit() or name.startswith("_"):
            name = f"x{name}"
        # Soft keywords and built-ins are legal, but a reader would stumble over them.
        return f"{name}_" if keyword.iskeyword(name) or keyword.issoftkeyword(name) or name in _BUILTINS else name
