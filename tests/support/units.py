"""Content of a unit of systemd."""

import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Unit:
    """A unit's file.

    Attributes:
        sections: By section and key, the values in their order.
    """

    sections: Mapping[str, Mapping[str, tuple[str, ...]]]

    def all(self, key: str, section: str = "Service") -> tuple[str, ...]:
        """Every value of a key."""
        return self.sections[section].get(key, ())

    def one(self, key: str, section: str = "Service") -> str:
        """The value of a key that stands once."""
        (value,) = self.all(key, section)
        return value

    def command(self, key: str, specifiers: Mapping[str, str]) -> list[str]:
        """A command line, with what its specifiers (such as `%S`) stand for."""
        return shlex.split(_filled(self.one(key), specifiers))

    def environment(self, specifiers: Mapping[str, str]) -> dict[str, str]:
        """Return the environment that its program is given."""
        pairs = (_filled(text, specifiers).partition("=") for text in self.all("Environment"))
        return {name: value for name, _, value in pairs}


def read_unit(path: Path) -> Unit:
    """A unit from its file."""
    sections: dict[str, dict[str, tuple[str, ...]]] = {}
    for line in path.read_text().splitlines():
        if line.startswith("["):
            current = sections.setdefault(line.strip("[]"), {})
        elif line.strip() and not line.startswith("#"):
            key, _, value = line.partition("=")
            current[key] = (*current.get(key, ()), value)
    return Unit(sections)


def _filled(text: str, specifiers: Mapping[str, str]) -> str:
    for name, value in specifiers.items():
        text = text.replace(name, value)
    assert "%" not in text, text
    return text
