"""Search for the definitions of the middleware types that a model uses: the `.msg`, `.srv` and `.action` files of ROS.

It needs only the files of ROS, not ROS itself.
"""

import os
import sys
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from robosc.interfaces import (
    INTERFACE_KINDS,
    MalformedDefinitionError,
    distribution_of,
    nested_types,
    parse_definition,
)
from robosc.interfaces.catalogue import INDEX
from robosc.language.tokens import Kind, tokenize
from robosc.source import SourceFile

_MAXIMUM_BYTES = 256 * 1024
_MAXIMUM_FILES = 500
"""Definitions that are read for one model: the types of fields lead to further ones."""

_NEARBY = 3
"""Folders of a model that are searched: its own and those above it, where the packages of a workspace lie."""

_GENERATED = ("idl",)
"""Endings of definitions that are not read, but show that a type exists."""


_CORE = "std_msgs"
"""Package that only the folders of a distribution itself have."""


def sourced_distribution() -> str:
    """The distribution of an installed ROS that was sourced; empty: none, or one that RoboSC does not know."""
    codename = os.environ.get("ROS_DISTRO", "")
    return codename if distribution_of(codename) is not None else ""


def interface_folders(distribution: str = "") -> tuple[Path, ...]:
    """Folders that hold a folder for each ROS package, as the environment of an installed ROS names them.

    Args:
        distribution: Distribution that is meant: folders of another one are left out. Empty: whatever is there.
    """
    sourced = [*_paths("AMENT_PREFIX_PATH"), *_paths("CMAKE_PREFIX_PATH")]
    folders = [*(prefix / "share" for prefix in sourced), *_paths("ROS_PACKAGE_PATH")]
    if distribution and distribution != os.environ.get("ROS_DISTRO"):
        folders = [folder for folder in folders if not (folder / _CORE).is_dir()]
    # The distribution of packages that stand beside this Python is not known.
    own = Path(sys.prefix) / "share"
    if not distribution or not (own / _CORE).is_dir():
        folders.append(own)
    return tuple(dict.fromkeys(folder for folder in folders if folder.is_dir()))


def nearby_folders(model: Path) -> tuple[Path, ...]:
    """The folder of a model and those above it, in which the packages of its workspace may lie."""
    return tuple(Path(os.path.realpath(model)).parents)[:_NEARBY]


def _paths(variable: str) -> list[Path]:
    return [Path(part) for part in os.environ.get(variable, "").split(os.pathsep) if part]


def find_interfaces(texts: Iterable[str], folders: Sequence[Path]) -> tuple[SourceFile, ...]:
    """Return the definitions that some texts use, named like `std_msgs/msg/Bool.msg`, sorted by name.

    With them come the messages that their fields are made of, from whatever package, and of each package that lacks a
    type which a text uses the names of those that it has (`std_msgs/types.txt`).

    Args:
        texts: Models and libraries.
        folders: Folders with packages, or packages themselves; the first that has a definition wins.
    """
    found: dict[str, SourceFile] = {}
    lacking: set[str] = set()
    for type_, package in sorted({use for text in texts for use in _used(text)}):
        files = [file for kind in INTERFACE_KINDS if (file := _definition(folders, package, kind, type_)) is not None]
        found |= {file.name: file for file in files}
        if not files:
            lacking.add(package)
    wanted = list(found.values())
    seen: set[str] = set()
    while wanted and len(found) < _MAXIMUM_FILES:
        for name in sorted(_nested(wanted.pop(0)) - seen):
            seen.add(name)
            package, _, type_ = name.partition("/")
            file = _definition(folders, package, "msg", type_)
            if file is not None and file.name not in found:
                found[file.name] = file
                wanted.append(file)
    for package in sorted(lacking):
        names = _names(folders, package)
        if names:
            found[f"{package}/{INDEX}"] = SourceFile(f"{package}/{INDEX}", "".join(f"{name}\n" for name in names))
    return tuple(found[name] for name in sorted(found))


def _nested(file: SourceFile) -> set[str]:
    """The messages that a definition is made of, as `package/Type`."""
    package = file.name.partition("/")[0]
    try:
        found = set(nested_types(parse_definition(file.text, package)))
    except MalformedDefinitionError:
        return set()
    # The name `Header` alone is that of std_msgs in ROS 1.
    return found | ({"std_msgs/Header"} if f"{package}/Header" in found else set())


def _homes(folders: Sequence[Path], package: str) -> Iterator[Path]:
    """The folders in which the interfaces of a package may lie."""
    for folder in folders:
        if folder.name == package:
            yield folder
        yield folder / package
        yield folder / package / "share" / package


def _definition(folders: Sequence[Path], package: str, kind: str, type_: str) -> SourceFile | None:
    name = f"{kind}/{type_}.{kind}"
    texts = (_read(home / name) for home in _homes(folders, package))
    text = next((text for text in texts if text is not None), None)
    return None if text is None else SourceFile(f"{package}/{name}", text)


def _names(folders: Sequence[Path], package: str) -> list[str]:
    """The names of the interfaces that a package has, such as `msg/Bool`, sorted."""
    files = (
        (kind, file)
        for home in _homes(folders, package)
        for kind in INTERFACE_KINDS
        for ending in (kind, *_GENERATED)
        for file in (home / kind).glob(f"*.{ending}")
    )
    return sorted({f"{kind}/{file.stem}" for kind, file in files})


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


__all__ = ["INTERFACE_KINDS", "find_interfaces", "interface_folders", "nearby_folders", "sourced_distribution"]
