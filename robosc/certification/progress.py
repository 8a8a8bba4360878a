"""Progress of long work, for callers who follow it and may stop it."""

from collections.abc import Callable

import msgspec


class Progress(msgspec.Struct, frozen=True):
    """Progress of long work.

    Attributes:
        stage: `check`, `synthesis`, `verification` or `controller`.
        message: One short line.
    """

    stage: str
    message: str


type OnProgress = Callable[[Progress], None]
"""Function that is called with the progress."""

type ShouldStop = Callable[[], bool]
"""Function that is called again and again; once it returns true, the work ends."""


def ignored(progress: Progress) -> None:
    """Ignore where the work is."""


def never() -> bool:
    """Return False: the work goes on to its end."""
    return False
