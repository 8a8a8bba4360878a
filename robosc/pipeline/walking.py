"""Random walks through the controlled system, and the trouble that they may find."""

from abc import ABC, abstractmethod
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from enum import StrEnum
from random import Random
from typing import TYPE_CHECKING

from robosc.execution.interpreter import InterpretedSystem
from robosc.model.structure import EventKind, Model, is_tau
from robosc.pipeline.received_data import RandomData

if TYPE_CHECKING:
    from robosc.pipeline.manual_run import ManualRun, Step
    from robosc.pipeline.simulation import Run


class TroubleKind(StrEnum):
    """Kinds of trouble that a walk may end in."""

    DEADLOCK = "deadlock"
    """No event at all can happen, in a state that is not marked."""
    WAITING = "waiting"
    """No event is allowed and no service or action is under way, in a state that is not marked: the robot waits for a
    message from outside."""
    BLOCKED = "blocked"
    """The behaviours allow a request that requirements or the supervisor forbid."""
    UNKNOWN = "unknown"
    """Data was unknown: an enum got its default because a rule was unknown, a number was moved into its range, an
    update was skipped, or the data of a request is unknown, so that it is not issued."""


ALL_TROUBLE = frozenset(TroubleKind)


@dataclass(frozen=True, slots=True)
class Trouble:
    """Trouble that has ended a walk.

    Attributes:
        kind: Kind of trouble.
        event: The event that was blocked, or whose data was unknown; empty if the trouble is about the state.
        why: Sentences that describe the trouble; at least one.
        steps: Number of events of the walk, including the event of the trouble.
    """

    kind: TroubleKind
    event: str
    why: tuple[str, ...]
    steps: int

    def __str__(self) -> str:
        place = f" at {self.event}" if self.event else ""
        return f"{self.kind}{place} after {self.steps} step{'s' if self.steps != 1 else ''}: {'; '.join(self.why)}"


class Walker(ABC):
    """Walker of one run.

    Args:
        run: The run that it leads.
    """

    def __init__(self, run: "ManualRun") -> None:
        self._run = run
        # Trouble that was found before.
        self._reported: set[tuple[TroubleKind, str, tuple[str, ...]]] = set()

    # Parts that differ

    @abstractmethod
    def _candidates(self) -> Iterable[str]:
        """The events that could happen next."""

    @abstractmethod
    def _forbidden(self) -> Iterable[str]:
        """The controllable events that could happen if they were not forbidden."""

    @abstractmethod
    def _is_issued(self, event: str) -> bool:
        """Return False for an event that could happen, but would not be taken."""

    @abstractmethod
    def _take(self, event: str, dice: Random) -> "Step":
        """Take an event with random data."""

    @abstractmethod
    def _at_event(self, event: str, count: int) -> Trouble | None:
        """Trouble with an event, which is then not taken."""

    def forget(self) -> None:
        """Forget all reported trouble, so that it is reported again."""
        self._reported.clear()

    def walk(self, steps: int, seed: int) -> "tuple[Step, ...]":
        """Take random events; parameters as of `Run.walk`."""
        dice, taken = Random(seed), list["Step"]()  # noqa: S311  # the same walk again, no secret
        while len(taken) < steps:
            candidates = [event for event in self._candidates() if self._is_issued(event)]
            if not candidates:
                break
            taken.append(self._take(dice.choice(candidates), dice))
        return tuple(taken)

    def walk_until_trouble(self, steps: int, seed: int, kinds: Collection[TroubleKind]) -> Trouble | None:
        """Take events until there is trouble; parameters as of `Run.walk_until_trouble`."""
        dice = Random(seed)  # noqa: S311  # the same walk again, no secret
        for count in range(steps + 1):
            found = self._in_state(count)
            if self._is_news(found, kinds):
                return found
            if count == steps:
                break
            event, found = self._chosen(dice, count, kinds)
            if found is not None or event is None:
                return found
            found = self._at_step(self._take(event, dice), count + 1)
            if self._is_news(found, kinds):
                return found
        return None

    def _chosen(self, dice: Random, count: int, kinds: Collection[TroubleKind]) -> tuple[str | None, Trouble | None]:
        """A random event, with its trouble if there is any; no event if nothing can happen."""
        candidates = [*self._candidates(), *(self._forbidden() if TroubleKind.BLOCKED in kinds else ())]
        while candidates:
            event = dice.choice(candidates)
            found = self._at_event(event, count)
            if found is None or self._is_news(found, kinds):
                return event, found
            candidates.remove(event)
        return None, None

    # Trouble

    def _in_state(self, count: int) -> Trouble | None:
        run = self._run
        if run.enabled or run.is_marked:
            return None
        left = run.possible
        places = {**run.state.components, **run.state.communications}
        where = ", ".join(f"{name} is {place}" for name, place in places.items())
        if not left:
            return Trouble(TroubleKind.DEADLOCK, "", (f"nothing can happen while {where}",), count)
        if any(place in ("waiting", "executing") for place in run.state.communications.values()):
            return None
        why = f"nothing is allowed while {where}: it can only wait for {', '.join(left)}"
        return Trouble(TroubleKind.WAITING, "", (why,), count)

    def _at_step(self, step: "Step", count: int) -> Trouble | None:
        why = (*step.unknown, *(f"{variable} keeps its value: its update is unknown" for variable in step.skipped))
        return Trouble(TroubleKind.UNKNOWN, step.event, why, count) if why else None

    def _is_news(self, found: Trouble | None, kinds: Collection[TroubleKind]) -> bool:
        """Return True if there is trouble of a kind that is looked for, and it was not reported before."""
        if found is None or found.kind not in kinds:
            return False
        key = (found.kind, found.event, found.why)
        is_news = key not in self._reported
        self._reported.add(key)
        return is_news


class ModelWalker(Walker):
    """Walker of a robot's run: it takes events that an executor could take in some world.

    Args:
        run: The run that it leads.
        system: The system of that run.
        model: Its model.
        data: Data that the environment sends.
    """

    def __init__(self, run: "Run", system: InterpretedSystem, model: Model, data: RandomData) -> None:
        super().__init__(run)
        self._run: Run = run
        self._system = system
        self._data = data
        self._identifiers = {event: item.identifier for item in model.communications for event in item.events}
        self._sensors = {item.identifier for item in model.communications if item.max_age is not None}

    def _candidates(self) -> Iterator[str]:
        """Yield the events that an executor and its environment could cause now."""
        silent = self._system.enabled_silent()
        if silent is not None:
            yield silent
            return
        is_deaf = self._is_deaf()
        for event in self._run.possible:
            if not (is_deaf and _is_request(event)):
                yield event

    def _is_deaf(self) -> bool:
        """Return True if a sensor with a `max_age` has sent no message yet."""
        silent = set(self._sensors)
        for step in self._run.history if silent else ():
            silent.discard(self._identifiers.get(step.event, ""))
            if not silent:
                break
        return bool(silent)

    def _forbidden(self) -> Iterator[str]:
        """Yield the requests that the behaviours allow and that are not enabled."""
        if self._system.enabled_silent() is None:
            for event in self._run.events:
                if _is_request(event) and self._system.is_possible(event) and not self._system.enabled(event):
                    yield event

    def _is_issued(self, event: str) -> bool:
        """Return False for a request whose data is unknown."""
        return not _is_request(event) or self._system.provide(event.partition(".")[0])[0]

    def _take(self, event: str, dice: Random) -> "Step":
        return self._run.step(event, self._data.draw(event, dice))

    def _at_event(self, event: str, count: int) -> Trouble | None:
        if not _is_request(event):
            return None
        if not self._system.enabled(event):
            return Trouble(TroubleKind.BLOCKED, event, self._run.reasons(event), count)
        if not self._is_issued(event):
            why = "what it sends is unknown, so that it is not issued"
            return Trouble(TroubleKind.UNKNOWN, event, (why,), count)
        return None


def _is_request(event: str) -> bool:
    return not is_tau(event) and event.rpartition(".")[2] == EventKind.REQUEST
