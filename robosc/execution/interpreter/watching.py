"""Interpreter of a supervisor that looks again only at what a change may have allowed or forbidden."""

from collections.abc import Mapping
from typing import Any

from robosc.execution.interpreter.functions import Place
from robosc.execution.interpreter.system import InterpretedSystem, Snapshot, Successor
from robosc.expressions import Value
from robosc.supervisor import Supervisor


class _Traced:
    """A state that notes which of its places are read.

    Attributes:
        read: The places that were read so far.
    """

    __slots__ = ("_state", "read")

    def __init__(self, state: Mapping[Place, Value]) -> None:
        self._state = state
        self.read: set[Place] = set()

    def __getitem__(self, place: Place) -> Value:
        self.read.add(place)
        return self._state[place]


class WatchingSystem(InterpretedSystem):
    """Interpreted system whose cycles take no longer for a robot of many parts than for one of few.

    Whether an event is allowed is looked at once, which notes the places of the state that this depends on: as long as
    none of them has another value, to look again would go the same way to the same answer. (The idea is that of U. A.
    Acar, G. E. Blelloch and R. Harper, "Adaptive functional programming", POPL 2002.)

    Args:
        supervisor: Supervisor to interpret.
    """

    def __init__(self, supervisor: Supervisor) -> None:
        super().__init__(supervisor)
        self._silent = (*self.description.resets, *self.description.taus)
        self._watch_anew()

    def restart(self) -> None:
        """Return to the initial state."""
        super().restart()
        self._watch_anew()

    def snapshot(self) -> Snapshot:
        """Return the state with the memory of goals, as a value that `restore` takes."""
        found = super().snapshot()
        return Snapshot(dict(found.state), found.goals)

    def restore(self, snapshot: Snapshot) -> None:
        """Return to a state that `snapshot` has returned."""
        super().restore(snapshot)
        self._doubt_everything()

    def enabled_requests(self) -> tuple[int, ...]:
        """Return the numbers, in source order of all requests, of those that are allowed now."""
        self._look_at_requests()
        return tuple(sorted(self._allowed))

    def changed_requests(self) -> tuple[int, ...]:
        """Return the numbers of the requests that are allowed now and were not at the last call, or vice versa."""
        self._look_at_requests()
        turned = tuple(sorted(self._turned))
        self._turned.clear()
        return turned

    def enabled_silent(self) -> str | None:
        """The first reset, then the first tau, that is allowed now; None if none is."""
        for number in sorted(self._doubtful_silent):
            if self._look_at(self._silent[number], -1 - number):
                return self._silent[number]
            self._doubtful_silent.remove(number)
        return None

    def _watch_anew(self) -> None:
        # A copy of the initial state, in which places are written: to copy all of them takes long if they are many.
        self._state = dict(self._initial)
        self._allowed: set[int] = set()
        self._turned: set[int] = set()
        self._doubt_everything()

    def _doubt_everything(self) -> None:
        # Numbers of requests; of silent steps -1, -2 and so on.
        self._watchers: dict[Place, set[int]] = {}
        self._doubtful_requests = set(range(len(self._request_events)))
        self._doubtful_silent = set(range(len(self._silent)))

    def _look_at_requests(self) -> None:
        for number in self._doubtful_requests:
            if self._look_at(self._request_events[number], number) is not (number in self._allowed):
                self._allowed ^= {number}
                self._turned ^= {number}
        self._doubtful_requests.clear()

    def _look_at(self, event: str, number: int) -> bool:
        """Return True if an event is allowed now; its number watches what that depends on."""
        state: Any = self._state
        traced: Any = _Traced(state)
        self._state = traced
        try:
            return self.enabled(event)
        finally:
            self._state = state
            for place in traced.read:
                self._watchers.setdefault(place, set()).add(number)

    def _enter(self, successor: Successor) -> None:
        changed = successor.changed()
        if changed:
            self.changes += 1
        self._state |= successor.written
        for place in changed:
            for number in self._watchers.pop(place, ()):
                if number >= 0:
                    self._doubtful_requests.add(number)
                else:
                    self._doubtful_silent.add(-1 - number)
