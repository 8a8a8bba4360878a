"""Progress of long work: a line with a bar on standard error, on a terminal only."""

import sys
from types import TracebackType
from typing import TYPE_CHECKING, Self

from robosc_client.results import Progress

if TYPE_CHECKING:
    import rich.progress

_MAXIMUM = 100
_BAR_WIDTH = 20

_STAGES = ("check", "synthesis", "verification", "controller")
"""Stages of making a supervisor, one after the other; the time that each takes depends on the model."""


class ProgressLine:
    """A line on standard error that shows the progress of long work, and is cleared at its end."""

    def __init__(self) -> None:
        self._bar: rich.progress.Progress | None = None
        self._line: rich.progress.TaskID | None = None

    def __enter__(self) -> Self:
        if sys.stderr.isatty():
            from rich.console import Console
            from rich.progress import BarColumn, SpinnerColumn, TextColumn, TimeElapsedColumn
            from rich.progress import Progress as ProgressBar

            # Texts of a server must not be interpreted as markup.
            words = TextColumn("{task.description}", markup=False)
            columns = (SpinnerColumn(), BarColumn(_BAR_WIDTH), words, TimeElapsedColumn())
            console = Console(stderr=True)
            self._bar = ProgressBar(
                *columns, console=console, transient=True, redirect_stdout=False, redirect_stderr=False
            )
            self._bar.start()
            self._line = self._bar.add_task("", total=None)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._bar is not None:
            self._bar.stop()

    def show(self, text: str, stage: str = "") -> None:
        """Replace the line.

        Args:
            text: Text of the line.
            stage: Stage of the work, for the bar; unknown stages show an indeterminate bar.
        """
        if self._bar is not None and self._line is not None:
            self._bar.update(self._line, description=text[:_MAXIMUM])
            if stage in _STAGES:
                self._bar.update(self._line, total=len(_STAGES), completed=_STAGES.index(stage))
            elif stage and self._bar.tasks[0].total is not None:
                self._bar.update(self._line, completed=len(_STAGES))

    def write(self, line: str) -> None:
        """Write a line of the result to standard output, above the progress line."""
        if self._bar is not None:
            self._bar.stop()
        sys.stdout.write(f"{line}\n")
        sys.stdout.flush()
        if self._bar is not None:
            self._bar.start()

    def report(self, progress: Progress) -> None:
        """Show the progress of the work."""
        self.show(f"{progress.stage}: {progress.message}", progress.stage)
