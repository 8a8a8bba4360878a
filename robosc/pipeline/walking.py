"""Walks by chance through the controlled system, and the findings that they may end in."""

from abc import ABC, abstractmethod
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from enum import StrEnum
from random import Random
from typing import Protocol

from robosc.pipeline.steps import Step, SteppedRun


class WalkFindingKind(StrEnum):
    """Kinds of findings that a walk may end in."""

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


ALL_FINDINGS = frozenset(WalkFindingKind)


@dataclass(frozen=True, slots=True)
class WalkFinding:
    """Finding that a walk has ended in.

    Attributes:
        kind: Kind of the finding.
        event: The event that was blocked, or at which something was unknown; empty: it is about the state.
        why: Sentences that say what is the matter; at least one.
        steps: Number of events that the walk took, including the event of the finding.
    """

    kind: WalkFindingKind
    event: str
    why: tuple[str, ...]
    steps: int

    def __str__(self) -> str:
        place = f" at {self.event}" if self.event else ""
        return f"{self.kind}{place} after {self.steps} step{'s' if self.steps != 1 else ''}: {'; '.join(self.why)}"


class WalkedRun(SteppedRun, Protocol):
    """Run as the walker that leads it sees it."""

    @property
    def is_marked(self) -> bool:
        """True if the state counts as completed."""

    @property
    def possible(self) -> tuple[str, ...]:
        """Every event that can happen now."""


class Walker(ABC):
    """Walker of one run.

    Args:
        run: The run that it leads.

    Attributes:
        follows_strategy: True if the controller follows its strategy, and only the world plays by chance.
    """

    def __init__(self, run: WalkedRun) -> None:
        self._run = run
        self.follows_strategy = False
        # Findings that were reported before.
        self._reported: set[tuple[WalkFindingKind, str, tuple[str, ...]]] = set()

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
    def _take(self, event: str, dice: Random) -> Step:
        """Take an event, with data by chance."""

    @abstractmethod
    def _at_event(self, event: str, count: int) -> WalkFinding | None:
        """Finding about an event, which is then not taken."""

    def forget(self) -> None:
        """Begin anew: every finding is new again."""
        self._reported.clear()

    def walk(self, steps: int, seed: int) -> tuple[Step, ...]:
        """Take events by chance; parameters as of `Run.walk`."""
        dice, taken = Random(seed), list[Step]()  # noqa: S311  # the same walk again, no secret
        while len(taken) < steps:
            candidates = [event for event in self._candidates() if self._is_issued(event)]
            if not candidates:
                break
            taken.append(self._take(dice.choice(candidates), dice))
        return tuple(taken)

    def walk_until_finding(self, steps: int, seed: int, kinds: Collection[WalkFindingKind]) -> WalkFinding | None:
        """Take events until there is a finding; parameters as of `Run.walk_until_finding`."""
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

    def _chosen(
        self, dice: Random, count: int, kinds: Collection[WalkFindingKind]
    ) -> tuple[str | None, WalkFinding | None]:
        """An event by chance, with the finding about it, if there is one; no event where nothing can happen."""
        candidates = [*self._candidates(), *(self._forbidden() if WalkFindingKind.BLOCKED in kinds else ())]
        while candidates:
            event = dice.choice(candidates)
            found = self._at_event(event, count)
            if found is None or self._is_news(found, kinds):
                return event, found
            candidates.remove(event)
        return None, None

    # Findings

    def _in_state(self, count: int) -> WalkFinding | None:
        run = self._run
        if run.enabled or run.is_marked:
            return None
        left = run.possible
        places = {**run.state.components, **run.state.communications}
        where = ", ".join(f"{name} is {place}" for name, place in places.items())
        if not left:
            return WalkFinding(WalkFindingKind.DEADLOCK, "", (f"nothing can happen while {where}",), count)
        if any(place in ("waiting", "executing") for place in run.state.communications.values()):
            return None
        why = f"nothing is allowed while {where}: it can only wait for {', '.join(left)}"
        return WalkFinding(WalkFindingKind.WAITING, "", (why,), count)

    def _at_step(self, step: Step, count: int) -> WalkFinding | None:
        why = (*step.unknown, *(f"{variable} keeps its value: its update is unknown" for variable in step.skipped))
        return WalkFinding(WalkFindingKind.UNKNOWN, step.event, why, count) if why else None

    def _is_news(self, found: WalkFinding | None, kinds: Collection[WalkFindingKind]) -> bool:
        """Return True if there is a finding of a kind that is looked for, and it was not reported before."""
        if found is None or found.kind not in kinds:
            return False
        key = (found.kind, found.event, found.why)
        is_news = key not in self._reported
        self._reported.add(key)
        return is_news
