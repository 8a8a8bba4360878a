"""
Runs of silent steps that do not end.

A run is deterministic: equal states are followed by equal steps. It ends if and only if no state
occurs twice. R. P. Brent's algorithm finds a repeated state and remembers only one state ("An
improved Monte Carlo factorization algorithm", BIT 20, 1980, pp. 176-184, section 7).
"""

from __future__ import annotations

from typing import Any, Callable

PATIENCE = 8
"""Number of first steps that are not checked: almost every run is shorter."""


class LivelockError(Exception):
    """A run of silent steps does not end."""


class LivelockDetector:
    """
    Detector of a livelock in one run.

    :param bound: More steps than this can only be a run that does not end.
    """

    __slots__ = ('_bound', '_distance', '_power', '_remembered', '_steps')

    def __init__(self, bound: int) -> None:
        self._bound = bound
        self._steps = 0
        self._power = 1
        self._distance = 0
        self._remembered: Any = None

    def check(self, signature: Callable[[], Any], event: str) -> None:
        """
        Check the state after one more step, taken by `event`.

        :param signature: Function that returns a value that identifies the state; not called in
            a short run.
        :param event: The step's event.
        :raises LivelockError: The state is one that the run was in before, or the bound is passed.
        """
        self._steps += 1
        if self._steps > self._bound:
            raise LivelockError(
                'silent steps do not end: more than {} in a row, the last {}'.format(
                    self._bound, event
                )
            )
        if self._steps <= PATIENCE:
            return
        now = signature()
        if now == self._remembered:
            raise LivelockError(
                'silent steps do not end: a state came twice, the last step was {}'.format(event)
            )
        self._distance += 1
        if self._distance == self._power:
            self._remembered = now
            self._power *= 2
            self._distance = 0
