"""Finds the definitions of the middleware types that a model uses: the `.msg`, `.srv` and `.action` files of ROS.

ROS itself is not needed for that, only its files; where there are none, nothing is checked against them.
"""

import os
import sys
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from robosc.language.tokens import Kind, tokenize
from robosc.source import SourceFile

INTERFACE_KINDS = ("msg", "srv", "action")
"""Folders and endings of the files."""

_MAXIMUM_BYTES = 256 * 1024


def interface_folders() -> tuple[Path, ...]:
    """Folders that hold a folder for each ROS package, as the environment of an installed ROS names them."""
    prefixes = [*_paths("AMENT_PREFIX_PATH"), *_paths("CMAKE_PREFIX_PATH"), Path(sys.prefix)]
    folders = [*(prefix / "share" for prefix in prefixes), *_paths("ROS_PACKAGE_PATH")]
    return tuple(dict.fromkeys(folder for folder in folders if folder.is_dir()))


def _paths(variable: str) -> list[Path]:
    return [Path(part) for part in os.environ.get(variable, "").split(os.pathsep) if part]


def find_interfaces(texts: Iterable[str], folders: Sequence[Path]) -> tuple[SourceFile, ...]:
    """Return the definitions that some texts use, named like `std_msgs/msg/Bool.msg`, sorted by name.

    Args:
        texts: Models and libraries.
        folders: Folders with packages; the first that has a definition wins.
    """
    found: dict[str, SourceFile] = {}
    for type_, package in sorted({use for text in texts for use in _used(text)}):
        for kind in INTERFACE_KINDS:
            name = f"{package}/{kind}/{type_}.{kind}"
            text = next((text for folder in folders if (text := _read(folder / name)) is not None), None)
            if text is not None:
                found[name] = SourceFile(name, text)
    return tuple(found[name] for name in sorted(found))


def _used(text: str) -> Iterator[tuple[str, str]]:
    """Type and package of every `interface x use Type from package`."""
    if "interface" not in text:
        return
    texts, kinds, _ = tokenize(text)
    for index, token in enumerate(texts[:-4]):
        if token == "interface" and texts[index + 2] == "use" and texts[index + 4] == "from":
            names = (index + 3, index + 5)
            # Only names of the language: nothing in them can lead out of the folder.
            if all(kinds[place] == Kind.NAME for place in names):
                yield texts[names[0]].removeprefix("^"), texts[names[1]].removeprefix("^")


def _read(path: Path) -> str | None:
    try:
        if not path.is_file() or path.stat().st_size > _MAXIMUM_BYTES:
            return None
        return path.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return None
