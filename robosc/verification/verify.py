"""Judges a synthesized supervisor by forward search of the controlled system.

The controlled system is searched state by state under the plants, the requirements and the conditions
that the supervisor adds. What is checked is what semantics part 2 promises, one property after the other:
safe, controllable, nonblocking; maximally permissive by synthesizing anew, explicitly, and comparing.
"""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

from robosc.automata.compile import State
from robosc.automata.controlled import Added, ControlledGraph, controlled_graph
from robosc.automata.semantics import Semantics
from robosc.automata.state import subjects
from robosc.automata.structure import System
from robosc.verification.explicit import ExplicitSupervisor, synthesize_explicit

DEFAULT_LIMIT = 100_000
"""States up to which the controlled system is searched."""

DEFAULT_PERMISSIVE_LIMIT = 20_000
"""States up to which the supervisor is recomputed."""


class Outcome(StrEnum):
    """What became of the check of one property."""

    PASSED = "passed"
    FAILED = "failed"
    NOT_CHECKED = "not checked"


@dataclass(frozen=True, slots=True)
class Failure:
    """Why a property does not hold.

    Attributes:
        property: `safe`, `controllable`, `nonblocking` or `maximally permissive`.
        trace: Events of a shortest run from the initial state into the trouble.
        state: The state that it leads to, in the order of `subjects`.
        message: What is wrong there, in words.
    """

    property: str
    trace: tuple[str, ...]
    state: State
    message: str


@dataclass(frozen=True, slots=True)
class Verification:
    """The judgement.

    Attributes:
        states: Reachable states of the controlled system, or None where the search was given up.
        transitions: Transitions between them, or None.
        safe: No reachable bad state.
        controllable: No uncontrollable event that the plant enables is disabled.
        nonblocking: From every reachable state a marked state is reachable.
        maximally_permissive: Nothing more is disabled than needed.
        failures: For each property that failed the first trouble found, in the order above.
    """

    states: int | None
    transitions: int | None
    safe: Outcome
    controllable: Outcome
    nonblocking: Outcome
    maximally_permissive: Outcome
    failures: tuple[Failure, ...] = ()

    @property
    def trace(self) -> tuple[str, ...]:
        """Events into the first trouble; none if nothing failed."""
        return self.failures[0].trace if self.failures else ()

    @property
    def message(self) -> str:
        """The first trouble in words; empty if nothing failed."""
        return f"not {self.failures[0].property}: {self.failures[0].message}" if self.failures else ""


def verify(
    system: System,
    added: Added,
    *,
    limit: int = DEFAULT_LIMIT,
    permissive_limit: int = DEFAULT_PERMISSIVE_LIMIT,
    should_stop: Callable[[], bool] = lambda: False,
) -> Verification:
    """Whether a supervisor is safe, controllable, nonblocking and maximally permissive.

    Args:
        system: Plants and event conditions.
        added: For each event to which the supervisor adds a condition, that condition over states.
        limit: Number of states of the controlled system beyond which nothing is checked.
        permissive_limit: Number of states that the plants reach under the event conditions beyond which
            permissiveness is not checked. Both count `TRANSITIONS_PER_STATE` transitions as a state, too.
        should_stop: Asked now and then; once true, the work ends.

    Raises:
        SynthesisCancelled: `should_stop` became true.
        ValueError: A condition is added to something that is no event of the system.
    """
    unknown = sorted(set(added) - {event.name for event in system.events})
    if unknown:
        raise ValueError(f"conditions are added to events that the system does not have: {', '.join(unknown)}")
    semantics = Semantics(system)
    graph = controlled_graph(semantics, added, limit=limit, should_stop=should_stop)
    if graph is None:
        skipped = Outcome.NOT_CHECKED
        return Verification(None, None, skipped, skipped, skipped, skipped)
    judge = _Judge(semantics, added, graph)
    failures = {"safe": judge.unsafe(), "controllable": judge.uncontrollable(), "nonblocking": judge.blocking()}
    explicit = synthesize_explicit(system, limit=permissive_limit, should_stop=should_stop)
    if explicit is not None:
        failures["maximally permissive"] = judge.restrictive(explicit)

    def outcome(name: str) -> Outcome:
        if name not in failures:
            return Outcome.NOT_CHECKED
        return Outcome.PASSED if failures[name] is None else Outcome.FAILED

    return Verification(
        states=len(graph.states),
        transitions=graph.transition_count,
        safe=outcome("safe"),
        controllable=outcome("controllable"),
        nonblocking=outcome("nonblocking"),
        maximally_permissive=outcome("maximally permissive"),
        failures=tuple(failure for failure in failures.values() if failure is not None),
    )


@dataclass(frozen=True, slots=True)
class _Judge:
    """Looks for the first trouble of each kind, nearest to the initial state."""

    semantics: Semantics
    added: Added
    graph: ControlledGraph

    def unsafe(self) -> Failure | None:
        """A reachable bad state."""
        for number, state in enumerate(self.graph.states):
            trouble = self.semantics.trouble(state)
            if trouble is not None:
                return self._failure("safe", number, trouble)
        return None

    def uncontrollable(self) -> Failure | None:
        """A reachable state where the supervisor stands in the way of an uncontrollable event."""
        events = [item.name for item in self.semantics.system.events if not item.is_controllable]
        for event in (event for event in events if event in self.added):
            for number, state in enumerate(self.graph.states):
                if self.semantics.enabled(state, event) and not self.added[event](state):
                    return self._failure("controllable", number, f"the uncontrollable {event} is disabled")
        return None

    def blocking(self) -> Failure | None:
        """A reachable state from which no marked one is reachable."""
        predecessors: list[list[int]] = [[] for _ in self.graph.states]
        for number, steps in enumerate(self.graph.steps):
            for _, targets in steps:
                for target in targets:
                    predecessors[target].append(number)
        frontier = [number for number, state in enumerate(self.graph.states) if self.semantics.is_marked(state)]
        found = set(frontier)
        while frontier:
            for number in predecessors[frontier.pop()]:
                if number not in found:
                    found.add(number)
                    frontier.append(number)
        for number in range(len(self.graph.states)):
            if number not in found:
                return self._failure("nonblocking", number, "no marked state can be reached")
        return None

    def restrictive(self, explicit: ExplicitSupervisor) -> Failure | None:
        """A reachable state where a controllable event is disabled that a supervisor could allow."""
        events = [
            item.name for item in self.semantics.system.events if item.is_controllable and item.name in self.added
        ]
        for number, state in enumerate(self.graph.states):
            for event in events:
                if explicit.allows(state, event) and not self.added[event](state):
                    message = f"{event} is disabled although it could be allowed"
                    return self._failure("maximally permissive", number, message)
        return None

    def _failure(self, property_: str, number: int, message: str) -> Failure:
        places = zip(subjects(self.semantics.system), self.graph.states[number], strict=True)
        where = ", ".join(f"{subject} = {value}" for subject, value in places)
        return Failure(property_, self.graph.trace(number), self.graph.states[number], f"{message} in {where}")
