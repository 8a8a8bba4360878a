"""A race: several ways to one result take turns, and the first that comes to its end wins.

Nobody knows beforehand which of them is quick, and the slow one may take a thousand times as long. So they take turns,
with equal shares of work, measured in nodes of decision diagrams: these are the same on every machine and for every
engine, and so is the winner. None begins anew when its turn comes. The first one has a head start, within which most
races end; after that `n` ways take `n` times the work of the quickest one, and the head start, at most.

A way is interrupted in the midst of recursive functions, of Python and of C. So each but the first has a stack of its
own: it is a greenlet, which needs no thread and no system call, so that confined processes may have it. The caller's
questions whether to stop, and reports of progress, are on the caller's stack.

Source: B. A. Huberman, R. M. Lukose and T. Hogg, "An economics approach to hard computational problems", Science 275,
1997, pp. 51-54 (portfolios of algorithms that run interleaved).
"""

from collections.abc import Callable, Sequence
from typing import Any

from greenlet import getcurrent, greenlet

from robosc.errors import NodeLimitError
from robosc.synthesis.monitor import ProgressMonitor
from robosc.synthesis.result import SynthesisProgress

HEAD_START = 1_000_000
"""Nodes that the first way may work on alone: some tenths of a second at most with the fastest engine."""

SHARE = 100_000
"""Nodes of one turn: some milliseconds with the fastest engine, and some tenths of a second with the slowest one."""


class _OvertakenError(Exception):
    """Another way has come to its end before.

    Args:
        race: The race, of which there may be one within another.
    """

    def __init__(self, race: "Race") -> None:
        super().__init__("another way was quicker")
        self.race = race


class _DismissedError(Exception):
    """The race goes on without this way, or is over."""


class Runner[T]:
    """One way in a race.

    Args:
        work: Function that goes it; it may be called again where the way has been given up for a while.

    Attributes:
        nodes: Nodes that it has worked on.
        has_won: True if it came to its end first.
        is_given_up: True if it would have taken more nodes than there may be.
    """

    def __init__(self, work: Callable[[], T]) -> None:
        self.work = work
        self.nodes = 0
        self.has_won = False
        self.is_given_up = False
        self.result: T | None = None
        self.peak_nodes = 0
        self.target = 0
        self.stack: greenlet | None = None
        self.error: BaseException | None = None
        self.is_dismissed = False
        self.is_at_end = False
        self.steps = 0
        self.progress: list[SynthesisProgress] = []

    @property
    def has_begun(self) -> bool:
        """True if it has worked at all."""
        return self.nodes > 0


class Race(ProgressMonitor):
    """A monitor for all ways of one race; once the race is over it passes on what it is told.

    Args:
        monitor: Monitor of the waiting caller.

    Attributes:
        peak_nodes: Most nodes of a predicate of which the winner has reported progress.
    """

    def __init__(self, monitor: ProgressMonitor) -> None:
        super().__init__(lambda: False, lambda progress: None)
        self._monitor = monitor
        self._rivals: list[Runner[Any]] = []
        self._running: Runner[Any] | None = None
        self._caller = getcurrent()

    # The caller's stack

    def first_of[T](self, runners: Sequence[Runner[T]]) -> T:
        """Return the result of the way that comes to its end first.

        Where there are more nodes than there may be, all ways but the first are given up. If the first one takes too
        many nodes alone, they begin anew, one after the other.

        Args:
            runners: The ways; the likeliest first.

        Raises:
            NodeLimitError: Every way takes more nodes than there may be.
        """
        left = list(runners)
        while True:
            try:
                winner = self._led_by(left[0], left[1:])
            except NodeLimitError:
                left[0].is_given_up = True
                # A way that was given up for the sake of the first one has another chance.
                left = [runner for runner in left[1:] if not runner.is_given_up or runner.is_dismissed]
                if not left:
                    raise
                continue
            winner.has_won = True
            self.peak_nodes = winner.peak_nodes
            found, winner.result = winner.result, None
            return found  # type: ignore[return-value]  # the winner has one

    def _led_by[T](self, first: Runner[T], rivals: Sequence[Runner[T]]) -> Runner[T]:
        """Return the winner, which has its result."""
        for runner in (first, *rivals):
            runner.is_given_up = runner.is_dismissed = runner.is_at_end = False
            runner.target = runner.nodes
        first.target += HEAD_START
        self._rivals, self._running, self._caller = list(rivals), first, getcurrent()
        try:
            first.result = first.work()
        except _OvertakenError as error:
            if error.race is not self:
                raise
            return next(rival for rival in rivals if rival.has_won)
        else:
            return first
        finally:
            self._dismiss()
            self._running = None

    def _take_turns(self, first: Runner[Any]) -> None:
        """Let the others do as much as the first way has done beyond its head start."""
        while first.nodes >= first.target and self._rivals:
            first.target += SHARE
            for rival in tuple(self._rivals):
                rival.target += SHARE
                # All are dismissed where there have come to be too many nodes.
                if rival.nodes < rival.target and not rival.is_dismissed:
                    self._let_run(rival, first)

    def _let_run(self, rival: Runner[Any], first: Runner[Any]) -> None:
        before = rival.nodes
        self._running = rival
        if rival.stack is None:
            rival.stack = greenlet(self._run)
        rival.stack.switch(rival)
        self._running = first
        for item in rival.progress:
            self._monitor.tell(item)
        rival.progress.clear()
        if rival.is_at_end:
            self._rivals.remove(rival)
            rival.stack = None
        error, rival.error = rival.error, None
        try:
            if error is not None:
                raise error
        finally:
            # Its frames are in the error, and would be in a cycle with it.
            del error
        if rival.has_won:
            raise _OvertakenError(self)
        self._monitor.spend(rival.nodes - before)
        steps, rival.steps = rival.steps, 0
        self._check(steps)

    def _check(self, steps: int) -> None:
        """Ask the caller's monitor; where there are too many nodes, give up the others first."""
        try:
            self._monitor.check_stop(steps)
            return
        except NodeLimitError:
            if all(rival.stack is None for rival in self._rivals):
                raise
        for rival in self._rivals:
            rival.is_given_up = True
        self._dismiss()
        self._monitor.check_stop(0)

    def _dismiss(self) -> None:
        """End the work of all others."""
        running = self._running
        rivals, self._rivals = self._rivals, []
        for rival in rivals:
            rival.is_dismissed = True
            if rival.stack is not None:
                self._running = rival
                while not rival.stack.dead:
                    rival.stack.switch(rival)
                rival.stack = None
        self._running = running
        for rival in rivals:
            if rival.error is not None:
                # It came while the work ended.
                raise rival.error

    # The stack of a rival

    def _run(self, rival: Runner[Any]) -> None:
        try:
            rival.result = rival.work()
            rival.has_won = True
        except _DismissedError:
            pass
        except NodeLimitError:
            rival.is_given_up = True
        except BaseException as error:  # the caller raises it
            rival.error = error
        rival.is_at_end = True

    # Any stack

    def check_stop(self, steps: int = 1) -> None:
        """Before each step: see `ProgressMonitor`."""
        runner = self._running
        if runner is None or runner.stack is None:
            self._check(steps)
        elif runner.is_dismissed:
            raise _DismissedError
        else:
            runner.steps += steps

    def spend(self, nodes: int) -> None:
        """After some work; where a share of it is used up, it is the turn of others."""
        runner = self._running
        if runner is None:
            self._monitor.spend(nodes)
            return
        runner.nodes += nodes
        if runner.stack is None:
            self._monitor.spend(nodes)
            self._take_turns(runner)
        elif runner.nodes >= runner.target:
            self._caller.switch()
            if runner.is_dismissed:
                raise _DismissedError

    def tell(self, progress: SynthesisProgress) -> None:
        """Pass on progress."""
        runner = self._running
        if runner is not None:
            runner.peak_nodes = max(runner.peak_nodes, progress.nodes)
        if runner is None or runner.stack is None:
            self.peak_nodes = max(self.peak_nodes, progress.nodes)
            self._monitor.tell(progress)
        else:
            runner.progress.append(progress)
