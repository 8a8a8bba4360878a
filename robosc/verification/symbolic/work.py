"""Bound on the work of a symbolic check: counted in nodes, so that it ends at the same point on every machine."""

from collections.abc import Callable
from typing import Any

from robosc.errors import RoboscError, SynthesisCancelled

PROGRESS_INTERVAL = 64
"""Steps between two reports of progress."""

_FEW = 100
"""Nodes that are few."""

_MADE = 4
"""Nodes that the engine makes in a step, in the time in which a part with one node is looked at."""


class TooMuchWorkError(RoboscError):
    """The check would take more work than it may."""


class Work:
    """Counts work, and ends it where it is too much.

    Args:
        limit: Nodes of all diagrams that are made, each counted each time, and values that expressions are worked
            out for.
        should_stop: Asked at each step; once true, the work ends.
        on_progress: Called now and then with one short line that says how far the work is.

    Attributes:
        tend: Function that lets the engine throw away what nobody needs; None if it does by itself.
    """

    def __init__(self, limit: int, should_stop: Callable[[], bool], on_progress: Callable[[str], None]) -> None:
        self.limit = limit
        self.done = 0
        self.tend: Callable[[], None] | None = None
        self._steps = 0
        self._should_stop = should_stop
        self._on_progress = on_progress

    def again(self, times: int = 1) -> "Work":
        """Return fresh work of the same limit, or of that so many times."""
        work = Work(times * self.limit, self._should_stop, self._on_progress)
        work.tend = self.tend
        return work

    def spend(self, amount: int) -> None:
        """Count some work.

        Raises:
            TooMuchWorkError: It is more than is left.
            SynthesisCancelled: The work is to end.
        """
        if self._should_stop():
            raise SynthesisCancelled("the symbolic check was stopped")
        if self.tend is not None:
            self.tend()
        self.done += amount
        if self.done > self.limit:
            raise TooMuchWorkError(f"more than {self.limit} nodes")
        self._steps += 1
        if self._steps % PROGRESS_INTERVAL == 0:
            self._on_progress(f"symbolic search, {self.done} nodes")

    def count(self, node: Any) -> Any:
        """Count a diagram that was made; returns it."""
        self.spend(int(node.dag_size))
        return node

    def count_near(self, node: Any, deepest: int) -> Any:
        """Count a diagram that was made by a step which works on the levels down to one; returns it.

        If few of its nodes are so high, these alone count: what is below them was there before, or counts later. Else
        all nodes do, as made by the engine.
        """
        seen: set[Any] = set()
        stack = [node]
        while stack and len(seen) <= _FEW:
            item = stack.pop()
            if item.level <= deepest and item not in seen:
                seen.add(item)
                stack += (item.low, item.high)
        self.spend(int(node.dag_size) // _MADE if stack else 1 + len(seen))
        return node
