"""Writes the locks of the images: of requirements.lock, the lines that each of them needs, with their hashes.

python deploy/lock_images.py            # in the project's environment, whose packages say what they need
python deploy/lock_images.py bridge     # prints the lock of these extras
"""

import re
import sys
import tomllib
from collections.abc import Iterable, Sequence
from importlib import metadata
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

FOLDER = Path(__file__).parent
LOCK = FOLDER.parent / "requirements.lock"

EXTRAS = {
    "server": ("server", "postgresql", "dask", "tracing", "signing"),
    "bridge": ("bridge", "view"),
}
BUILD = ("editables", "hatchling", "pip", "setuptools", "uv", "wheel")
"""Packages that install the locks and build wheels: ours, and those of packages that have none."""

_HEADER = """\
# Packages that {what}: the lines of requirements.lock that it takes, written by deploy/lock_images.py (make lock).
"""


def main(extras: Sequence[str] = ()) -> int:
    """Write the locks of the images, or print that of some extras; returns the exit status."""
    entries = locked(LOCK.read_text("utf-8"))
    if extras:
        sys.stdout.write(lock_of(entries, closure(requirements(extras)), f"the extras {', '.join(extras)} need"))
        return 0
    for name, needed in wanted().items():
        what = "build the wheels of the images" if name == "build" else f"the image of the {name} holds"
        (FOLDER / f"requirements-{name}.txt").write_text(lock_of(entries, needed, what), "utf-8")
    return 0


def wanted() -> dict[str, set[str]]:
    """Return the packages in each lock, by lock."""
    return {"build": closure(BUILD), **{name: closure(requirements(extras)) for name, extras in EXTRAS.items()}}


def requirements(extras: Iterable[str]) -> list[str]:
    """Return what the project requires with some extras.

    Raises:
        KeyError: It has no such extra.
    """
    project = tomllib.loads((LOCK.parent / "pyproject.toml").read_text("utf-8"))["project"]
    optional = project["optional-dependencies"]
    return [*project["dependencies"], *(text for extra in extras for text in optional[extra])]


def locked(text: str) -> dict[str, str]:
    """Return the lines of each package in a lock, by package, without comments."""
    entries = {}
    for block in re.split(r"\n(?=[a-z0-9])", text):
        match = re.match(r"([a-z0-9][a-z0-9._-]*)(?:\[[^\]]*\])?==", block)
        if match:
            lines = (line.rstrip() for line in block.splitlines())
            kept = [line for line in lines if line and not line.lstrip().startswith("#")]
            entries[canonicalize_name(match[1])] = "\n".join(kept)
    return {str(name): entry for name, entry in entries.items()}


def lock_of(entries: dict[str, str], needed: set[str], what: str) -> str:
    """The text of a lock."""
    return _HEADER.format(what=what) + "\n".join(entries[name] for name in sorted(needed)) + "\n"


def closure(requirements: Iterable[str]) -> set[str]:
    """Return the packages that requirements name, and all that those need in turn.

    The needs are as the installed packages say, on this kind of machine.
    """
    found: set[str] = set()
    seen: set[tuple[str, tuple[str, ...]]] = set()
    waiting = [Requirement(text) for text in requirements]
    while waiting:
        requirement = waiting.pop()
        name, extras = str(canonicalize_name(requirement.name)), tuple(sorted(requirement.extras))
        if (name, extras) in seen:
            continue
        seen.add((name, extras))
        found.add(name)
        for needed in map(Requirement, metadata.requires(name) or ()):
            marker = needed.marker
            if marker is None or any(marker.evaluate({"extra": extra}) for extra in (*extras, "")):
                waiting.append(needed)
    return found


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
