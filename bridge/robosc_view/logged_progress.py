"""Progress of a strategy at each moment of an event log, as far as its lines tell.

They tell when a goal was reached and how often, which one is approached, and which assumptions are owed for too long;
whether a goal is true at other moments does not stand in a log.
"""

from bisect import bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import isfinite
from typing import Any

from robosc.execution.interpreter import describe
from robosc.execution.runtime.progress import Progress, Standing
from robosc.supervisor import Supervisor


@dataclass(frozen=True, slots=True)
class _Told:
    """Content of the lines up to a moment.

    Attributes:
        approached: Name of the goal that is approached; None: none.
        times: Number of times that each goal was reached.
        owed: Time since when each assumption is owed that was reported.
    """

    approached: str | None = None
    times: Mapping[str, int] = field(default_factory=dict)
    owed: Mapping[str, float] = field(default_factory=dict)


class LoggedProgress:
    """Progress at each moment of a log.

    Args:
        supervisor: Supervisor under which the log was written.
        documents: Entries of the log.
        times_s: Time of each entry.
    """

    def __init__(
        self, supervisor: Supervisor, documents: Sequence[Mapping[str, Any]], times_s: Sequence[float]
    ) -> None:
        description = describe(supervisor)
        self._aims, self._assumptions = description.aims, description.assumptions
        known = {item.name for item in (*self._aims, *self._assumptions)}
        # After how many entries something else was told, and what.
        self._counts: list[int] = []
        self._told: list[_Told] = []
        told = _Told()
        for count, (document, time_s) in enumerate(zip(documents, times_s, strict=True), 1):
            now = _after(told, document, time_s, known)
            if now is not told:
                self._counts.append(count)
                self._told.append(now)
                told = now

    def at(self, count: int, time_s: float) -> Progress | None:
        """Return the progress after a number of entries; None: nothing is told of goals anywhere in the log.

        Args:
            count: Number of entries that have happened.
            time_s: Time of the moment.
        """
        if not self._told:
            return None
        place = bisect_right(self._counts, count) - 1
        told = _Told() if place < 0 else self._told[place]
        return Progress(
            aims=tuple(
                Standing(item.name, item.words, False, told.times.get(item.name, 0), None, item.mission)
                for item in self._aims
            ),
            assumptions=tuple(
                Standing(item.name, item.words, False, 0, self._owed_s(told, item.name, time_s))
                for item in self._assumptions
            ),
            overdue=tuple(item.name for item in self._assumptions if item.name in told.owed),
            is_followed=True,
            approached=told.approached,
            chosen=None,
        )

    @staticmethod
    def _owed_s(told: _Told, name: str, time_s: float) -> float | None:
        return max(time_s - told.owed[name], 0.0) if name in told.owed else None


def _after(told: _Told, document: Mapping[str, Any], time_s: float, known: set[str]) -> _Told:
    """Return what is told after an entry, whatever it holds; the same value if it tells nothing of goals."""
    name: Any = document.get("assumption") if document.get("kind") in ("owed", "met") else document.get("aim")
    is_known = isinstance(name, str) and name in known
    match document.get("kind"):
        case "restart":
            return _Told() if told != _Told() else told
        case "approach" if name is None or is_known:
            return replace(told, approached=name)
        case "reached" if is_known:
            count = document.get("count")
            if isinstance(count, int) and count >= 0:
                return replace(told, times={**told.times, name: count})
        case "owed" if is_known:
            owed_s = document.get("owed_s")
            if isinstance(owed_s, int | float) and isfinite(owed_s):
                return replace(told, owed={**told.owed, name: time_s - owed_s})
        case "met" if is_known:
            return replace(told, owed={key: since_s for key, since_s in told.owed.items() if key != name})
    return told
