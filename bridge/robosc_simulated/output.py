"""Files that are written while a robot lives."""

from collections.abc import Callable
from pathlib import Path
from typing import Protocol


class Sink(Protocol):
    """Destination to which a recorder writes; what it raises would reach the robot."""

    def write(self, text: str, /) -> object:
        """Take more of the text."""

    def flush(self) -> object:
        """Pass on what was taken."""


class Output:
    """A file: one that cannot be written to any more, such as on a full disk, ends the record and not the robot.

    Args:
        path: Of the file; what was in it is gone.
        report: Takes one sentence, once, when it cannot be written to any more.

    Raises:
        OSError: It cannot be opened.
    """

    def __init__(self, path: Path, report: Callable[[str], None]) -> None:
        self._path = path
        self._report = report
        self._is_sound = True
        self._stream = path.open("w", encoding="ascii")

    def write(self, text: str, /) -> None:
        """Write, unless the record has ended."""
        if self._is_sound:
            try:
                self._stream.write(text)
            except OSError as error:
                self._end(error)

    def flush(self) -> None:
        """Hand what was written to the system."""
        if self._is_sound:
            try:
                self._stream.flush()
            except OSError as error:
                self._end(error)

    def close(self) -> None:
        """End it; may be called again."""
        try:
            self._stream.close()
        except OSError as error:
            # It tries once more what has failed before.
            if self._is_sound:
                self._end(error)

    def _end(self, error: OSError) -> None:
        self._is_sound = False
        self._report(f"{self._path} is not whole, because it cannot be written to any more: {error.strerror}")
