"""Copyright notices of generated ROS packages: the top of each source file as ament_copyright reads it, and LICENSE."""

from collections.abc import Collection
from importlib import resources
from pathlib import PurePosixPath

from robosc.targets.registry import PackageMetadata

_WITH_TEXT = frozenset({"BSD-3-Clause", "MIT"})
"""Licences whose notice speaks of a file `LICENSE`; that of any other says all, or where the licence can be read."""

_KNOWN = _WITH_TEXT | {"Apache-2.0", "BSD-2-Clause", "BSL-1.0", "GPL-3.0-or-later", "LGPL-3.0-or-later", "MIT-0"}

_MARKS = {".c": "//", ".cpp": "//", ".h": "//", ".hpp": "//", ".py": "#"}
"""Beginning of a comment's line by the ending of a source file."""


def is_known(name: str) -> bool:
    """Return True if ament_copyright knows a licence of this name."""
    return name in _KNOWN


def with_notices(
    files: dict[str, str], metadata: PackageMetadata, scripts: Collection[str] = frozenset()
) -> dict[str, str]:
    """Return the files of a package with a notice at the top of each source file, and a licence where that names one.

    Args:
        files: Their texts by path.
        metadata: Data of the package about itself.
        scripts: Paths of programs in Python, whose first line stays the first.
    """
    found = {}
    for path, text in files.items():
        mark = "#" if path in scripts else _MARKS.get(PurePosixPath(path).suffix)
        if mark is not None:
            end_of_first = text.index("\n") + 1 if path in scripts else 0
            text = f"{text[:end_of_first]}{_notice(metadata, mark)}\n{text[end_of_first:]}"
        found[path] = text
    if metadata.license in _WITH_TEXT:
        found["LICENSE"] = _read(f"text/{metadata.license}").replace("{copyright}", metadata.holder)
    return found


def _notice(metadata: PackageMetadata, mark: str) -> str:
    known = is_known(metadata.license)
    terms = _read(f"header/{metadata.license}") if known else f"License: {metadata.license}\n"
    lines = f"Copyright {metadata.holder}\n\n{terms}".splitlines()
    return "".join(f"{mark} {line}".rstrip() + "\n" for line in lines)


def _read(name: str) -> str:
    return resources.files("robosc.targets.ros").joinpath(f"licenses/{name}.txt").read_text(encoding="utf-8")
