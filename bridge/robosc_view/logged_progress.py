"""Progress of a strategy at each moment of an event log, as far as it stands in its lines.

The lines say when a goal was reached and how often, which one is approached, and which assumptions are owed for too
long; whether a goal is true at other moments does not stand in a log.
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
class _Logged:
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
        # The progress that entries have changed, with the numbers of entries up to each change.
        self._counts: list[int] = []
        self._logged: list[_Logged] = []
        logged = _Logged()
        for count, (document, time_s) in enumerate(zip(documents, times_s, strict=True), 1):
            now = _after(logged, document, time_s, known)
            if now is not logged:
                self._counts.append(count)
                self._logged.append(now)
                logged = now

    def at(self, count: int, time_s: float) -> Progress | None:
        """Return the progress after a number of entries; None: the log has nothing about goals.

        Args:
            count: Number of entries that have happened.
            time_s: Time of the moment.
        """
        if not self._logged:
            return None
        place = bisect_right(self._counts, count) - 1
        logged = _Logged() if place < 0 else self._logged[place]
        return Progress(
            aims=tuple(
                Standing(item.name, item.words, False, logged.times.get(item.name, 0), None, item.mission)
                for item in self._aims
            ),
            assumptions=tuple(
                Standing(item.name, item.words, False, 0, self._owed_s(logged, item.name, time_s))
                for item in self._assumptions
            ),
            overdue=tuple(item.name for item in self._assumptions if item.name in logged.owed),
            is_followed=True,
            approached=logged.approached,
            chosen=None,
        )

    @staticmethod
    def _owed_s(logged: _Logged, name: str, time_s: float) -> float | None:
        return max(time_s - logged.owed[name], 0.0) if name in logged.owed else None


def _after(logged: _Logged, document: Mapping[str, Any], time_s: float, known: set[str]) -> _Logged:
    """Return the progress after an entry, whatever it holds; the same value if it has nothing about goals."""
    name: Any = document.get("assumption") if document.get("kind") in ("owed", "met") else document.get("aim")
    is_known = isinstance(name, str) and name in known
    match document.get("kind"):
        case "restart":
            return _Logged() if logged != _Logged() else logged
        case "approach" if name is None or is_known:
            return replace(logged, approached=name)
        case "reached" if is_known:
            count = document.get("count")
            if isinstance(count, int) and count >= 0:
                return replace(logged, times={**logged.times, name: count})
        case "owed" if is_known:
            owed_s = document.get("owed_s")
            if isinstance(owed_s, int | float) and isfinite(owed_s):
                return replace(logged, owed={**logged.owed, name: time_s - owed_s})
        case "met" if is_known:
            return replace(logged, owed={key: since_s for key, since_s in logged.owed.items() if key != name})
    return logged
