"""Cancellation and progress of a synthesis."""

from collections.abc import Callable
from typing import Any

from robosc.errors import SynthesisCancelled
from robosc.synthesis.result import SynthesisProgress


class ProgressMonitor:
    """Monitor of a synthesis: it ends the work when its caller stops it, reports progress, and counts nodes.

    Args:
        should_stop: Asked before each step of the work with one event; once true, the work ends.
        on_progress: Called after each event's encoding and after each round.
        check_nodes: Asked before each step, too: raises an error where there are too many.

    Attributes:
        peak_nodes: Most nodes of a predicate of which progress was reported.
    """

    def __init__(
        self,
        should_stop: Callable[[], bool],
        on_progress: Callable[[SynthesisProgress], None],
        check_nodes: Callable[[], None] = lambda: None,
    ) -> None:
        self._should_stop = should_stop
        self._on_progress = on_progress
        self._check_nodes = check_nodes
        self.peak_nodes = 0

    def check_stop(self, steps: int = 1) -> None:
        """Before each step.

        Args:
            steps: Number of steps since the last call, which may stand for several.

        Raises:
            SynthesisCancelled: The work is to end.
            NodeLimitError: There are more nodes than there may be.
        """
        if self._should_stop():
            raise SynthesisCancelled("synthesis was stopped")
        self._check_nodes()

    def spend(self, nodes: int) -> None:
        """After some work.

        Args:
            nodes: Nodes that it was about, the same for every engine.
        """

    def report(self, phase: str, rounds: int, states: Any) -> None:
        """After each round: its phase and number, and the predicate that was found."""
        self.tell(SynthesisProgress(phase, rounds, states.dag_size))

    def tell(self, progress: SynthesisProgress) -> None:
        """Pass on progress."""
        self.peak_nodes = max(self.peak_nodes, progress.nodes)
        self._on_progress(progress)


class EffortSpentError(Exception):
    """The work has taken more steps than it may.

    Args:
        monitor: Monitor whose limit ended it.
    """

    def __init__(self, monitor: "BoundedMonitor") -> None:
        super().__init__(f"more than {monitor.limit} steps")
        self.monitor = monitor


class BoundedMonitor(ProgressMonitor):
    """A monitor that counts steps, and ends the work at a limit once one is set.

    Args:
        monitor: Monitor of the waiting caller.
        limit: Steps beyond which the work ends; None for no limit.

    Attributes:
        steps: Steps so far; the same for every engine.
        limit: Steps beyond which the work ends.
    """

    def __init__(self, monitor: ProgressMonitor, limit: int | None = None) -> None:
        super().__init__(lambda: False, lambda progress: None)
        self._monitor = monitor
        self.steps = 0
        self.limit = limit

    def check_stop(self, steps: int = 1) -> None:
        """Before each step.

        Args:
            steps: Number of steps since the last call, which may stand for several.

        Raises:
            SynthesisCancelled: The work is to end.
            NodeLimitError: There are more nodes than there may be.
            EffortSpentError: It has taken more steps than it may.
        """
        self.steps += steps
        # The kernel asks less often and goes a little beyond the limit: those steps are not counted.
        beyond = 0 if self.limit is None else max(0, self.steps - self.limit - 1)
        self.steps -= beyond
        self._monitor.check_stop(steps - beyond)
        if self.limit is not None and self.steps > self.limit:
            raise EffortSpentError(self)

    def spend(self, nodes: int) -> None:
        """Pass on work."""
        self._monitor.spend(nodes)

    def tell(self, progress: SynthesisProgress) -> None:
        """Pass on progress."""
        self._monitor.tell(progress)

    def result_of[T](self, work: Callable[[], T]) -> T | None:
        """Return the result of some work under this monitor, or None if its limit has ended the work."""
        # No context manager: those of contextlib keep the frames of an error, and their predicates, in a cycle.
        try:
            return work()
        except EffortSpentError as error:
            if error.monitor is not self:
                raise
            return None
