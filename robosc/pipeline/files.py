"""Files of a user: reading is bounded, and a file is written whole or not at all."""

import errno
import os
from pathlib import Path

from robosc.errors import RoboscError

type FileName = str | os.PathLike[str]
"""Name of a file or folder."""


class FileAccessError(RoboscError, OSError):
    """A file or folder that does not exist, or cannot be read or written."""


def given_path(name: FileName) -> Path:
    """A file or folder that a caller names.

    Raises:
        FileAccessError: The name is empty, which does not mean the current folder.
    """
    text = os.fspath(name)
    if not text:
        raise FileAccessError("the name of a file or folder is empty")
    return Path(text)


def read_bounded(path: Path, most: int) -> bytes:
    """Return the bytes of a file; if it is too large, one byte more than allowed.

    Args:
        path: The file.
        most: Number of allowed bytes.

    Raises:
        FileAccessError: The file cannot be read.
    """
    try:
        with path.open("rb") as stream:
            # Reading one byte more than is allowed shows that the file is too large; a device might never end.
            return stream.read(most + 1)
    except OSError as error:
        raise FileAccessError(f"cannot read {path}: {error.strerror or error}") from error


def write_whole(path: Path, content: bytes) -> None:
    """Write a result file whole or not at all; a device or pipe is written to directly.

    Raises:
        FileAccessError: The file cannot be written.
    """
    temporary: Path | None = None
    try:
        target = Path(os.path.realpath(path))
        if target.is_symlink():
            raise OSError(errno.ELOOP, os.strerror(errno.ELOOP))
        if target.exists() and not target.is_file():
            with target.open("wb") as place:
                place.write(content)
            return
        mode = target.stat().st_mode & 0o777 if target.exists() else 0o666 & ~_umask()
        import tempfile  # as long to load as to read a model

        handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.")
        temporary = Path(name)
        with os.fdopen(handle, "wb") as file:
            file.write(content)
        temporary.chmod(mode)
        temporary.replace(target)
    except OSError as error:
        if temporary is not None:
            temporary.unlink(missing_ok=True)
        raise FileAccessError(f"cannot write {path}: {error.strerror or error}") from error


class SupervisorFile:
    """Mixin of supervisors that have a file of their own."""

    __slots__ = ()

    def encode(self) -> bytes:
        """Return the content of the supervisor's file; raises UnsupportedModelError as `write`."""
        raise NotImplementedError

    def write(self, file: FileName) -> Path:
        """Write the supervisor's file (`.rsup`), whole or not at all, and return its path.

        Raises:
            FileAccessError: The file cannot be written.
            UnsupportedModelError: The file would become too large, or an expression is nested too deeply.
        """
        path = given_path(file)
        write_whole(path, self.encode())
        return path


def _umask() -> int:
    """The permissions that this process removes from new files; the mask can only be read by setting it."""
    mask = os.umask(0o077)
    os.umask(mask)
    return mask
