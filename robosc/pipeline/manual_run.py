"""Manual runs, event by event: the common part of runs of robots and of automata without a model."""

from abc import ABC, abstractmethod
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import Any

from robosc.certification.supervisor_file import StateInWords
from robosc.errors import RoboscError, UnknownNameError
from robosc.pipeline.conditions import unknown_event
from robosc.pipeline.files import FileAccessError, FileName, given_path, write_whole
from robosc.pipeline.missions import MissionProgress
from robosc.pipeline.received_data import DataField
from robosc.pipeline.saved_runs import event_log
from robosc.pipeline.steps import Step, changes_text, event_text
from robosc.pipeline.walking import ALL_FINDINGS, Walker, WalkFinding, WalkFindingKind
from robosc.tables import html_table


class UnknownEventError(UnknownNameError):
    """An event that the model does not have; the message names the nearest one."""


class EventNotPossibleError(RoboscError, ValueError):
    """An event that cannot happen in the current state; the message says why."""


class NoStrategyError(RoboscError, ValueError):
    """A strategy that is to be followed where the supervisor has none."""


class ManualRun(ABC):
    """A run of a controlled system, from its initial state.

    Args:
        name: Name of the system.
        events: Every event in source order, with True if it is controllable.
    """

    def __init__(self, name: str, events: Mapping[str, bool]) -> None:
        self._name = name
        self._events = dict(events)
        # The steps, each with the state before it; and those that were taken back, the last one first.
        self._taken: list[tuple[Step, Any]] = []
        self._undone: list[tuple[Step, Any]] = []
        self._initial = self.state
        self._walker = self._make_walker()

    # Parts that differ

    @property
    def locations(self) -> dict[str, str]:
        """Location of each service and action, by its name; automata have none."""
        return {}

    def actor(self, event: str) -> str:
        """Return whose event it is, where two sides play; empty where a person plays both."""
        return ""

    @property
    def has_strategy(self) -> bool:
        """True if the supervisor has a strategy, which reaches the goals and visits of its model."""
        return False

    @property
    def chosen(self) -> str | None:
        """Request that the strategy chooses now; None where it waits, and where there is no strategy."""
        return None

    @property
    def reached(self) -> tuple[bool, ...]:
        """For each goal True if it counts as come true now; nothing where there is no strategy."""
        return ()

    @property
    def missions(self) -> tuple[MissionProgress, ...]:
        """Progress of each mission; nothing where there is no strategy."""
        return ()

    @property
    def cancelling(self) -> tuple[str, ...]:
        """Actions whose goal an executor would be cancelling: it has not ended yet. Automata have none."""
        return ()

    @property
    @abstractmethod
    def state(self) -> StateInWords:
        """The current state."""

    @property
    @abstractmethod
    def is_marked(self) -> bool:
        """True if the state is marked."""

    @abstractmethod
    def _make_walker(self) -> Walker:
        """The walker of this run."""

    @abstractmethod
    def _can_happen(self, event: str) -> bool:
        """Return True if an event can happen now."""

    @abstractmethod
    def _why_not(self, event: str) -> tuple[str, ...]:
        """The reasons why an event that cannot happen now cannot happen."""

    @abstractmethod
    def _snapshot(self) -> Any:
        """The current state, for `_restore`."""

    @abstractmethod
    def _restore(self, snapshot: Any) -> None:
        """Return to a state."""

    @abstractmethod
    def _begin(self) -> None:
        """Return to the initial state."""

    @abstractmethod
    def data_fields(self, event: str) -> tuple[DataField, ...]:
        """The parts of the data of an event that a caller can give.

        Raises:
            UnknownEventError: There is no such event; the message names the nearest one.
        """

    # Events that can happen

    @property
    def name(self) -> str:
        """Name of the system."""
        return self._name

    def event_called(self, name: str) -> str:
        """The event that a name stands for.

        Raises:
            UnknownEventError: There is no such event; the message names the nearest one.
        """
        return self._require_event(name)

    @property
    def initial(self) -> StateInWords:
        """The initial state."""
        return self._initial

    @property
    def events(self) -> tuple[str, ...]:
        """Every event, in source order."""
        return tuple(self._events)

    @property
    def enabled(self) -> tuple[str, ...]:
        """Controllable events that are allowed now, in source order."""
        return tuple(name for name, is_own in self._events.items() if is_own and self._can_happen(name))

    @property
    def possible(self) -> tuple[str, ...]:
        """Every event that can happen now, in source order: the `enabled` ones and those of the environment."""
        return tuple(filter(self._can_happen, self._events))

    def is_controllable(self, event: str) -> bool:
        """Return True if the controller takes an event by itself.

        Raises:
            UnknownEventError: There is no such event; the message names the nearest one.
        """
        return self._events[self._require_event(event)]

    def blocked(self) -> dict[str, tuple[str, ...]]:
        """Every event that cannot happen now, with the reasons, one sentence each."""
        return {event: self._why_not(event) for event in self._events if not self._can_happen(event)}

    def reasons(self, event: str) -> tuple[str, ...]:
        """Return the reasons why an event cannot happen now, one sentence each; none if it can.

        Raises:
            UnknownEventError: There is no such event; the message names the nearest one.
        """
        return () if self._can_happen(self._require_event(event)) else self._why_not(event)

    def _require_event(self, event: str) -> str:
        """Return the event if it exists.

        Raises:
            UnknownEventError: There is no such event.
        """
        if event not in self._events:
            raise UnknownEventError(unknown_event(event, self._events))
        return event

    def _require_possible(self, event: str) -> None:
        """Do nothing if an event can happen now.

        Raises:
            EventNotPossibleError: It cannot; the message says why.
        """
        if not self._can_happen(event):
            verb = "is not allowed" if self._events[event] else "cannot happen"
            raise EventNotPossibleError(f"'{event}' {verb} now: {'; '.join(self.reasons(event))}; {self._allowed()}")

    # Steps

    @property
    def history(self) -> tuple[Step, ...]:
        """The events so far."""
        return tuple(step for step, _ in self._taken)

    @property
    def undone(self) -> tuple[Step, ...]:
        """The events that were taken back, in the order in which `redo` takes them again."""
        return tuple(step for step, _ in reversed(self._undone))

    def _take(self, step: Step, before: Any) -> Step:
        """Add a step that has been taken to the history."""
        self._taken.append((step, before))
        self._undone.clear()
        return step

    def undo(self) -> Step | None:
        """Take back the last event, and return it; None if there is none."""
        return self._move(self._taken, self._undone)

    def redo(self) -> Step | None:
        """Take again the event that was taken back last, and return it; None if there is none."""
        return self._move(self._undone, self._taken)

    def _move(self, source: list[tuple[Step, Any]], target: list[tuple[Step, Any]]) -> Step | None:
        if not source:
            return None
        step, other = source.pop()
        target.append((step, self._snapshot()))
        self._restore(other)
        return step

    def restart(self) -> None:
        """Return to the initial state, with an empty history."""
        self._begin()
        self._taken.clear()
        self._undone.clear()
        self._walker.forget()

    def walk(self, steps: int, seed: int = 0, *, strategy: bool = False) -> tuple[Step, ...]:
        """Take random events that an executor could take in some world; ends early if nothing can happen.

        As in an executor, resets and tau transitions are taken as soon as they are allowed, and nothing is requested
        before the first message of a sensor with a `max_age`. Otherwise all possible events are equally likely. Their
        data is known, and its numbers are near to those in the model.

        Args:
            steps: Number of events.
            seed: Seed of the random numbers: the same seed gives the same events.
            strategy: True if only the world plays by chance: of the requests, the strategy's choice alone is taken.

        Raises:
            NoStrategyError: The supervisor has no strategy.
        """
        self._lead(strategy)
        return self._walker.walk(steps, seed)

    def walk_until_finding(
        self,
        steps: int = 1000,
        seed: int = 0,
        kinds: Collection[WalkFindingKind] = ALL_FINDINGS,
        *,
        strategy: bool = False,
    ) -> WalkFinding | None:
        """Walk by chance until there is a finding, and return it; None if there was none.

        Trouble that was found is not reported again: the next walk of this run looks for other trouble.

        Args:
            steps: Most events to take.
            seed: Seed of the chance.
            kinds: Kinds of findings to look for.
            strategy: True if only the world plays by chance, as of `walk`.

        Raises:
            NoStrategyError: The supervisor has no strategy.
        """
        self._lead(strategy)
        return self._walker.walk_until_finding(steps, seed, kinds)

    def _lead(self, strategy: bool) -> None:
        """Begin a walk, in which the controller may follow its strategy.

        Raises:
            NoStrategyError: The supervisor has none.
        """
        if strategy and not self.has_strategy:
            raise NoStrategyError(f"the supervisor of {self._name} has no strategy: there are no goals or missions")
        self._walker.follows_strategy = strategy

    def save(self, file: FileName) -> Path:
        """Write the events so far as an event log (`.jsonl`) with one second for each event; return its path.

        Raises:
            FileAccessError: The file cannot be written, or its name has another ending.
        """
        path = given_path(file)
        if path.suffix != ".jsonl":
            raise FileAccessError(f"{path}: the name of a saved run ends in .jsonl, as event logs do")
        write_whole(path, event_log(self.history).encode())
        return path

    # Its forms for people

    def _allowed(self) -> str:
        enabled = self.enabled
        return f"allowed are {', '.join(enabled)}" if enabled else "nothing is allowed"

    def __repr__(self) -> str:
        count = len(self._taken)
        return f"<run of {self._name}: {count} step{'s' if count != 1 else ''}; {self._allowed()}>"

    def __str__(self) -> str:
        lines = [f"{number:4}  {': '.join(filter(None, row))}" for number, row in self._rows()]
        return "\n".join([*lines, f"now {self.state}", self._allowed()])

    def __iter__(self) -> Iterator[Step]:
        return iter(self.history)

    def __len__(self) -> int:
        return len(self._taken)

    def _repr_html_(self) -> str:
        rows = ((number, *row) for number, row in self._rows())
        return html_table(("", "event", "changes"), rows, caption=f"{self._name}: {self._allowed()}")

    def _rows(self) -> Iterator[tuple[int, tuple[str, str]]]:
        """Yield for each step its number, the event with its data, and the changes of the state."""
        before = self._initial
        for number, step in enumerate(self.history, start=1):
            yield number, (event_text(step), changes_text(before, step.state))
            before = step.state
