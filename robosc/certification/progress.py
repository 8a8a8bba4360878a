"""Progress of long work."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Progress:
    """Progress of long work.

    Attributes:
        stage: `check`, `synthesis`, `verification` or `controller`.
        message: One short line.
    """

    stage: str
    message: str
