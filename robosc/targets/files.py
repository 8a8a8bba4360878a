"""Generated files as values, and the only function that writes them.

A manifest beside the files records what was generated, so that a later generation replaces unchanged files and never
loses a user's change.
"""

import contextlib
import hashlib
import json
import os
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from robosc.errors import RoboscError
from robosc.tables import html_table

MANIFEST = ".robosc-manifest.json"
"""Name of the manifest in the folder written to: {"version": 1, "files": {path: SHA-256}}."""

_MANIFEST_VERSION = 1
_MAXIMUM_LISTED = 10


class OverwriteError(RoboscError):
    """Writing would lose something of the user's; nothing was written."""


class UnwritableError(OverwriteError, OSError):
    """The folder that files should go to cannot be written."""


@dataclass(frozen=True, slots=True)
class Removal:
    """Outcome for the files of an earlier run.

    Attributes:
        removed: Paths of the files that are gone, sorted.
        kept: Paths of the files that a user changed, sorted; they are still there.
    """

    removed: tuple[Path, ...] = ()
    kept: tuple[Path, ...] = ()


class GeneratedFiles(Mapping[str, str]):
    """Texts by relative path (with `/`), sorted; frozen.

    Attributes:
        executables: Paths of the files that are programs.
    """

    __slots__ = ("_texts", "executables")

    def __init__(self, texts: Mapping[str, str], executables: frozenset[str] = frozenset()) -> None:
        """Sort and check the paths.

        Raises:
            ValueError: A path is absolute, leads out of the folder, or names the manifest.
        """
        for path in texts:
            _check_path(path)
        if not executables <= texts.keys():
            raise ValueError(f"not among the files: {', '.join(sorted(executables - texts.keys()))}")
        self._texts = {path: texts[path] for path in sorted(texts)}
        self.executables = executables

    def __getitem__(self, path: str) -> str:
        return self._texts[path]

    def __iter__(self) -> Iterator[str]:
        return iter(self._texts)

    def __len__(self) -> int:
        return len(self._texts)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, GeneratedFiles):
            return NotImplemented
        return self._texts == other._texts and self.executables == other.executables

    def __hash__(self) -> int:
        return hash((tuple(self._texts.items()), self.executables))

    def __repr__(self) -> str:
        return f"<{len(self._texts)} generated file{'s' if len(self._texts) != 1 else ''}>"

    def __str__(self) -> str:
        return "\n".join(self._texts)

    def _repr_html_(self) -> str:
        rows = [(path, len(text.splitlines())) for path, text in self._texts.items()]
        return html_table(("file", "lines"), rows, caption=f"{len(rows)} generated files")

    def write(self, folder: str | os.PathLike[str], *, force: bool = False) -> tuple[Path, ...]:
        """Write the files into a folder, as `write_files`."""
        return write_files(self, Path(folder), force)


def _check_path(path: str) -> None:
    """Refuse whatever could leave the folder, on any system."""
    parts = PurePosixPath(path).parts
    usable = parts and not path.startswith("/") and str(PurePosixPath(path)) == path and ".." not in parts
    if not usable or any(char in path for char in '\\:\0\n<>|"?*') or path == MANIFEST:
        raise ValueError(f"not a relative path inside the folder: {path!r}")


def write_files(files: GeneratedFiles, directory: Path, force: bool = False) -> tuple[Path, ...]:
    """Write files into a folder, each atomically, and the manifest last.

    A file that is there is replaced if it is what an earlier run generated, or if `force` is set. One that
    already has the right content is left alone, and so are files that only an earlier run generated: several
    packages may stand in one folder (see `remove_earlier`).

    Returns:
        The path of every generated file, sorted.

    Raises:
        OverwriteError: A file was changed since it was generated; nothing was written.
        UnwritableError: The place cannot be written.
    """
    try:
        earlier = _read_manifest(directory)
        _refuse_links(files, directory)
        if not force:
            _refuse_changed(files, directory, earlier)
        for path, text in files.items():
            _write_atomically(directory / path, text, path in files.executables)
        _write_manifest(directory, {**earlier, **{path: _digest(text.encode("utf-8")) for path, text in files.items()}})
    except OSError as error:
        raise _unwritable(error, directory) from error
    return tuple(directory / path for path in files)


def remove_earlier(directory: Path, folders: Iterable[str]) -> Removal:
    """Remove files of earlier runs from some folders below the one written to, and folders that become empty.

    Only unchanged files of the manifest are removed, and none through a symbolic link.

    Raises:
        UnwritableError: Something cannot be removed.
    """
    wanted = frozenset(folders)
    removed, kept = [], []
    try:
        manifest = _read_manifest(directory)
        for path in sorted(path for path in manifest if PurePosixPath(path).parts[0] in wanted):
            place = directory / path
            if place.is_symlink() or _linked_folder(path, directory) is not None:
                kept.append(place)
            elif not place.exists():
                del manifest[path]
            elif place.is_file() and _digest(place.read_bytes()) == manifest[path]:
                place.unlink()
                del manifest[path]
                removed.append(place)
            else:
                kept.append(place)
        _remove_empty_folders(removed, directory)
        if (directory / MANIFEST).exists():
            _write_manifest(directory, manifest)
    except OSError as error:
        raise _unwritable(error, directory) from error
    return Removal(tuple(removed), tuple(kept))


def _remove_empty_folders(removed: Iterable[Path], directory: Path) -> None:
    folders = {folder for place in removed for folder in place.parents if directory in folder.parents}
    for folder in sorted(folders, key=lambda folder: len(folder.parts), reverse=True):
        with contextlib.suppress(OSError):  # The folder has other files.
            folder.rmdir()


def _unwritable(error: OSError, directory: Path) -> UnwritableError:
    place = error.filename or directory
    return UnwritableError(f"cannot write to {place}: {(error.strerror or str(error)).lower()}")


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def _write_manifest(directory: Path, digests: Mapping[str, str]) -> None:
    text = json.dumps({"version": _MANIFEST_VERSION, "files": digests}, indent=2, sort_keys=True) + "\n"
    _write_atomically(directory / MANIFEST, text, is_executable=False)


def _read_manifest(directory: Path) -> dict[str, str]:
    """Digest by path of what an earlier run generated; empty where there is no readable manifest.

    The manifest lies in the user's folder, so nothing in it is trusted: a path that leads out of the folder
    is dropped.
    """
    try:
        content = json.loads((directory / MANIFEST).read_text(encoding="utf-8"))
        entries = content["files"].items() if content["version"] == _MANIFEST_VERSION else ()
    except FileNotFoundError:
        return {}
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return {}
    manifest = {}
    for path, digest in entries:
        with contextlib.suppress(ValueError):
            _check_path(path)
            manifest[path] = str(digest)
    return manifest


def _content(place: Path) -> bytes | None:
    """Return the content of a file, or None if there is none."""
    try:
        return place.read_bytes()
    except FileNotFoundError:
        return None


def _refuse_links(files: GeneratedFiles, directory: Path) -> None:
    """No folder below the target folder may be a link: it could lead anywhere."""
    for path in files:
        folder = _linked_folder(path, directory)
        if folder is not None:
            raise OverwriteError(f"{folder} is a symbolic link; nothing was written")


def _linked_folder(path: str, directory: Path) -> Path | None:
    """A folder on the way to a file that is a link, if there is one."""
    folders = (directory / folder for folder in list(PurePosixPath(path).parents)[:-1])
    return next((folder for folder in folders if folder.is_symlink()), None)


def _refuse_changed(files: GeneratedFiles, directory: Path, earlier: Mapping[str, str]) -> None:
    changed = []
    for path, text in files.items():
        content = _content(directory / path)
        if content is not None and content != text.encode("utf-8") and _digest(content) != earlier.get(path):
            changed.append(path)
    if changed:
        listed = ", ".join(changed[:_MAXIMUM_LISTED]) + (", ..." if len(changed) > _MAXIMUM_LISTED else "")
        raise OverwriteError(
            f"{directory}: not overwritten, because changed since generated (or not generated by RoboSC): {listed}; "
            "nothing was written; use --force (in Python: force=True) to overwrite"
        )


def _write_atomically(place: Path, text: str, is_executable: bool) -> None:
    """Write a file so that a reader sees the old or the new text, never half of one."""
    content = text.encode("utf-8")
    mode = 0o755 if is_executable else 0o644
    if not place.is_symlink() and _content(place) == content:
        place.chmod(mode)
        return
    place.parent.mkdir(parents=True, exist_ok=True)
    handle, temporary = tempfile.mkstemp(prefix=f".{place.name[:50]}.", dir=place.parent)
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(content)
        Path(temporary).chmod(mode)
        Path(temporary).replace(place)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise
