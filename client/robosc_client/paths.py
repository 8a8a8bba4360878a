"""Validation of file names from a server: only names that are harmless on any system are accepted.

In addition to what `robosc.targets.GeneratedFiles` refuses (absolute paths, `..`, backslashes, drives, what Windows
forbids, the manifest) these checks refuse names with a special meaning on some system, and names that collide.
"""

import unicodedata
from collections.abc import Iterable
from pathlib import PurePosixPath

_MAXIMUM_NAME_BYTES = 255
"""Maximum size of one part of a path, in bytes: the limit of the usual file systems."""

_MAXIMUM_PATH_BYTES = 1024
"""Maximum size of a whole path, in bytes."""

_DEVICES = frozenset(
    ["con", "prn", "aux", "nul", "conin$", "conout$"]
    + [f"{name}{number}" for name in ("com", "lpt") for number in "0123456789¹²³"]
)
"""Device names of Windows, with any extension."""


def _path_problem(path: str) -> str:
    """Return the problem with one path; empty: none."""
    try:
        length = len(path.encode("utf-8"))
    except UnicodeEncodeError:
        return "it is not valid Unicode"
    if length > _MAXIMUM_PATH_BYTES:
        return f"it has more than {_MAXIMUM_PATH_BYTES} bytes"
    if not path.isprintable():
        return "it has characters that are not printable"
    for part in PurePosixPath(path).parts:
        if len(part.encode("utf-8")) > _MAXIMUM_NAME_BYTES:
            return f"a name in it has more than {_MAXIMUM_NAME_BYTES} bytes"
        if part != part.strip() or part.endswith("."):
            return "a name in it begins or ends with a blank, or ends with a full stop"
        if part.startswith("."):
            # Hidden files can configure shells, editors or git; no target generates one.
            return "a name in it begins with a full stop"
        if part.partition(".")[0].rstrip().casefold() in _DEVICES:
            return "a name in it is a device name on Windows"
    return ""


def paths_problem(paths: Iterable[str]) -> str:
    """Return the problem with some paths, together; empty: none.

    Two names that differ in case, or in how their letters are composed, are one file on some systems; and a file
    cannot
    be the folder of another.
    """
    files: set[str] = set()
    folders: set[str] = set()
    for path in paths:
        problem = _path_problem(path)
        if problem:
            return f"{path[:100]!r}: {problem}"
        folded = PurePosixPath(unicodedata.normalize("NFKC", path).casefold())
        if str(folded) in files:
            return f"{path!r}: two files differ only in the case of letters"
        files.add(str(folded))
        folders.update(str(parent) for parent in folded.parents)
    both = sorted(files & folders)
    return f"{both[0]!r}: a file and a folder have the same name" if both else ""
