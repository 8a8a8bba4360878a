"""Cache of the last supervisors from a synthesis server, so that the robot also starts without a network."""

import contextlib
import logging
import os
import tempfile
from collections.abc import Mapping
from pathlib import Path

_log = logging.getLogger(__name__)

_FOLDER = "robosc-bridge"


def state_folder(environment: Mapping[str, str] = os.environ) -> Path | None:
    """The user's folder for what is kept from one run to the next; None: there is no home.

    Source: XDG Base Directory Specification 0.8, which also says that a path that is not absolute is ignored.
    """
    chosen = Path(environment.get("XDG_STATE_HOME", ""))
    if chosen.is_absolute():
        return chosen / _FOLDER
    try:
        return Path.home() / ".local" / "state" / _FOLDER
    except RuntimeError:
        return None


def is_cached(file: Path) -> bool:
    """Return True if there is such a file, as far as this user may know."""
    try:
        return file.is_file()
    except OSError:
        return False


def store(file: Path, data: bytes) -> None:
    """Replace a file at once, or warn that it cannot be: the start does not depend on it.

    Whoever reads it finds the old or the new one, also after a power cut.
    """
    try:
        _replace(file, data)
    except OSError as error:
        _log.warning("%s: cannot be kept for a start without network: %s", file, error.strerror or error)


def _replace(file: Path, data: bytes) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    number, name = tempfile.mkstemp(dir=file.parent, prefix=".", suffix=file.suffix)
    try:
        with os.fdopen(number, "wb") as stream:
            stream.write(data)
            stream.flush()
            os.fsync(stream.fileno())
        Path(name).replace(file)
        folder = os.open(file.parent, os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)
    except BaseException:
        with contextlib.suppress(OSError):
            Path(name).unlink()
        raise
