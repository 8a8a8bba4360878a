"""Analysis of the reasons why events cannot happen in states, and of runs into trouble, in terms of automata.

*Trouble* is a bad state, or a state from which the requirements allow no run to a marked state without bad states. For
a state that a supervisor must avoid, the analysis shows a run into trouble. If uncontrollable events alone lead to
trouble, it is a shortest run of them, which nothing can prevent; else it is a shortest run that plants and requirements
allow. One of these runs always exists: if no trouble were reachable, all reachable states would be safe, nonblocking
and closed under uncontrollable events, so the state would be good.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from enum import StrEnum
from functools import cached_property
from typing import Any

import msgspec
from msgspec.structs import replace

from robosc.automata.compile import State
from robosc.automata.semantics import plant_invariants_on
from robosc.automata.state import subjects
from robosc.automata.structure import Automaton
from robosc.errors import InternalError
from robosc.explanation.constraints import ConstraintKind, RelaxableConstraint, without_marks
from robosc.explanation.problems import Problems
from robosc.synthesis.encoding import Encoding
from robosc.synthesis.expression_encoder import ExpressionEncoder
from robosc.synthesis.monitor import ProgressMonitor
from robosc.synthesis.runs import ShortestRuns, SystemRun
from robosc.synthesis.transitions import Steps
from robosc.synthesis.ways import WayNotFoundError, Ways

MAXIMUM_UNFOUND = 2
"""Number of failed searches for a way after which an analysis searches only for shortest ways."""


class BlockingCauseKind(StrEnum):
    """Kind of cause that keeps an event from happening."""

    BEHAVIOUR = "behaviour"
    """The plants cannot do it: mostly, a plant has no edge for the event whose guard is true."""
    RANGE = "range"
    """An update would leave a variable's range."""
    REQUIREMENT = "requirement"
    """An event condition is not true."""
    SUPERVISOR = "supervisor"
    """The event can lead to a state that must be avoided."""


class BlockingCause(msgspec.Struct, frozen=True):
    """A cause that keeps an event from happening in some states.

    Attributes:
        kind: Kind of cause.
        event: The event.
        where: The states in which the cause applies.
        automaton: The automaton that has no edge.
        plant_condition: Place in `System.plant_conditions` of the condition that is not true.
        is_impossible: True if every step would lead to states that violate the invariants of plants, or of the
            supervisor of a controlled system.
        range: The range that an update would leave.
        condition: Place in `System.conditions`.
    """

    kind: BlockingCauseKind
    event: str
    where: Any
    automaton: str | None = None
    plant_condition: int | None = None
    is_impossible: bool = False
    range: RelaxableConstraint | None = None
    condition: int | None = None


class Counterexample(msgspec.Struct, frozen=True):
    """A run into trouble, with a description of the trouble.

    Attributes:
        run: The run.
        is_forced: True if all of its events are uncontrollable.
        invariants: Places of the invariants that are not true in the last state.
        leaving: Uncontrollable events that can leave a range there.
        forbidden: Uncontrollable events that can happen there although a condition (its place) forbids them.
        detour: Way of the plants alone to a marked state, if the last state blocks but is not bad; None if the plants
            have no such way, or if the search takes too long.
        is_detour_unknown: True if the search for such a way takes too long.
        unmarked: Automata that are in no marked location, if the state blocks.
        is_marker_missed: True if the state blocks and the marker is not true there.
    """

    run: SystemRun
    is_forced: bool
    invariants: tuple[int, ...]
    leaving: tuple[tuple[str, RelaxableConstraint], ...]
    forbidden: tuple[tuple[str, int], ...]
    detour: "Detour | None"
    is_detour_unknown: bool
    unmarked: tuple[str, ...]
    is_marker_missed: bool

    @property
    def is_blocking(self) -> bool:
        """True if the state is not bad, but no marked state can be reached from it."""
        return not (self.invariants or self.leaving or self.forbidden)


class Detour(msgspec.Struct, frozen=True):
    """A run of the plants alone, and its first event that is not allowed.

    Attributes:
        events: The events of the whole run.
        stopped_at: Place of the first event that is not allowed, or that leads to a state to be avoided.
        state: The state before that event.
        blocking_causes: Causes that block the event there; none if it is uncontrollable and leads to trouble.
    """

    events: tuple[str, ...]
    stopped_at: int
    state: State
    blocking_causes: tuple[BlockingCause, ...]


class Analysis:
    """Answers to questions about one problem.

    Args:
        encoding: The variables.
        monitor: Monitor of the waiting caller.
        problems: The problem and its variants without some constraints.
        constraints: All constraints.
        good: The states that a supervisor may be in.
        dropped: Constraints that are assumed to be left out. Runs still leave no range, unless there is no other way.
    """

    def __init__(
        self,
        encoding: Encoding,
        monitor: ProgressMonitor,
        problems: Problems,
        constraints: Sequence[RelaxableConstraint],
        good: Any,
        dropped: Iterable[RelaxableConstraint] = (),
    ) -> None:
        dropped = tuple(dropped)
        self._encoding = encoding
        self._manager = encoding.manager
        self._monitor = monitor
        self._problems = problems
        self._dropped_conditions = {place for item in dropped for place in item.conditions}
        self._dropped_invariants = {place for item in dropped for place in item.invariants}
        self._dropped_ranges = tuple(item for item in dropped if item.range is not None)
        left = without_marks(encoding.system, dropped)
        self._automata, self._marker = left.automata, left.marker
        self._ranges = tuple(item for item in constraints if item.kind is ConstraintKind.RANGE)
        self._encoder = ExpressionEncoder(encoding)
        self._fixed_point, self._problem = problems.without(dropped)
        self._steps = {steps.event.name: steps for steps in self._problem.steps}
        safe = self._problem.safe
        for steps in self._problem.steps:
            safe = safe & ~steps.bad
        self.safe = safe
        """The states that are not bad."""
        self.good = good
        """The states that a supervisor may be in."""
        free = (*dropped, *(item for item in constraints if item.kind is not ConstraintKind.MARKING))
        _, self._free = problems.without(free)
        self._enabling: dict[str, tuple[BlockingCause, ...]] = {}
        self._kept: dict[str, Any] = {}
        self._unfound = 0

    @cached_property
    def _troubled(self) -> Any:
        """The states that are trouble."""
        return ~self._fixed_point.nonblocking_ahead(self._problem, self.safe)

    # Causes that block events

    def _behaviours(self, event: str) -> tuple[BlockingCause, ...]:
        """Return all causes by which the plants could block an event, each with the states where it applies."""
        if event not in self._enabling:
            system = self._encoding.system
            plants = [item for item in system.automata if event in item.alphabet]
            found = [
                BlockingCause(BlockingCauseKind.BEHAVIOUR, event, ~self._has_edge(item, event), automaton=item.name)
                for item in plants
                if event not in item.monitors
            ]
            found += [
                BlockingCause(
                    BlockingCauseKind.BEHAVIOUR, event, ~self._encoder.holds(item.condition), plant_condition=place
                )
                for place, item in enumerate(system.plant_conditions)
                if item.event == event
            ]
            if not plants:
                found.append(BlockingCause(BlockingCauseKind.BEHAVIOUR, event, self._manager.true))
            if plant_invariants_on(system, event):
                able = self._encoding.all_of(~item.where for item in found)
                where = able & ~self.wanted(event)
                found.append(BlockingCause(BlockingCauseKind.BEHAVIOUR, event, where, is_impossible=True))
            self._enabling[event] = tuple(found)
        return self._enabling[event]

    def _has_edge(self, automaton: Automaton, event: str) -> Any:
        """Return the states where an automaton has an edge for an event whose guard is true."""
        return self._encoding.any_of(
            self._encoding.in_location(automaton.name, edge.source) & self._encoder.holds(edge.guard)
            for edge in automaton.edges
            if edge.event == event
        )

    def wanted(self, event: str) -> Any:
        """Return the states where the plants would allow an event if variables had no ranges."""
        steps = self._problems.steps(event)
        return steps.plant | steps.leaving

    def possible(self, event: str, good: Any | None = None) -> Any:
        """Return the states where an event may happen and leads only to good states.

        Good states are those that a supervisor may be in, unless others are given.
        """
        good = self.good if good is None else good
        steps = self._steps[event]
        if not steps.event.is_controllable:
            return good & steps.plant
        return good & steps.plant & steps.condition & self._staying(event, good)

    def _staying(self, event: str, good: Any) -> Any:
        """Return the states from which an event, if it happens, leads only to good states."""
        if good != self.good:
            return self._steps[event].only(good)
        if event not in self._kept:
            self._kept[event] = self._steps[event].only(good)
        return self._kept[event]

    def moving(self, event: str) -> Any:
        """Return the states where an event changes the state."""
        return self._steps[event].moving()

    def blocking_causes(self, event: str, states: Any, good: Any | None = None) -> tuple[BlockingCause, ...]:
        """Return every cause that blocks an event in some of the states.

        Args:
            event: The event.
            states: The states.
            good: States that a supervisor must not leave; the states that it may be in, if None.
        """
        good = self.good if good is None else good
        steps = self._steps[event]
        found = [replace(item, where=states & item.where) for item in self._behaviours(event)]
        if steps.event.is_controllable:
            wanted = states & self.wanted(event)
            found += [
                BlockingCause(BlockingCauseKind.RANGE, event, wanted & leaving, range=item)
                for item, leaving in self._leaving(event)
            ]
            found += [
                BlockingCause(
                    BlockingCauseKind.REQUIREMENT, event, wanted & ~self._problems.condition(place), condition=place
                )
                for place in self._conditions_on(event)
            ]
            lost = states & steps.plant & steps.condition & ~self._staying(event, good)
            found.append(BlockingCause(BlockingCauseKind.SUPERVISOR, event, lost))
        return tuple(item for item in found if item.where != self._manager.false)

    def _leaving(self, event: str) -> Iterable[tuple[RelaxableConstraint, Any]]:
        """Yield each of the ranges that an event can leave, with the states where it leaves it."""
        mine = self._problems.written_by(event, self._ranges)
        for item in mine:
            if item in self._dropped_ranges:
                continue
            others = self._problems.steps(event, [other for other in mine if other != item])
            if others.event.is_controllable:
                yield item, self.wanted(event) & others.leaving
            else:
                yield item, others.under(self._manager.true).bad

    def _conditions_on(self, event: str) -> tuple[int, ...]:
        return tuple(item for item in self._problems.conditions_on(event) if item not in self._dropped_conditions)

    # Runs

    def runs(self, start: Any, possible: Mapping[str, Any]) -> ShortestRuns:
        """Shortest runs from some states by possible events."""
        return self._runs(self._steps, start, possible)

    def _runs(self, steps: Mapping[str, Steps], start: Any, possible: Mapping[str, Any]) -> ShortestRuns:
        chosen = [item for name, item in steps.items() if name in possible]
        return ShortestRuns(self._encoding, self._monitor, chosen, possible, start)

    def counterexample_after(self, start: Any) -> Counterexample:
        """Return a run into trouble from one of some states that a supervisor must avoid."""
        for steps, is_forced in self._continuations():
            possible = {
                name: item.plant & self._restricted(item)
                for name, item in steps.items()
                if not (is_forced and item.event.is_controllable)
            }
            run = self._runs(steps, start, possible).run_to(self._troubled)
            if run is not None:
                return self._named(run, is_forced)
        raise InternalError("a state that must be avoided does not run into trouble")

    def _continuations(self) -> Iterator[tuple[Mapping[str, Steps], bool]]:
        """Events for the search for trouble, and True if they are all uncontrollable; the preferred ones first."""
        if self._dropped_ranges:
            # Updates that stop at the end of a range are no steps that the robot takes.
            real = {name: self._problems.steps(name).under(steps.condition) for name, steps in self._steps.items()}
            yield real, True
            yield real, False
        yield self._steps, True
        yield self._steps, False

    def _restricted(self, steps: Steps) -> Any:
        return steps.condition if steps.event.is_controllable else self._manager.true

    def _named(self, run: SystemRun, is_forced: bool) -> Counterexample:
        state = self.predicate(run.states[-1])
        false = self._manager.false
        invariants = tuple(
            place
            for place in range(len(self._encoding.system.invariants))
            if place not in self._dropped_invariants and self._problems.invariant(place) & state == false
        )
        harmful = [steps for steps in self._problem.steps if steps.bad & state != false]
        leaving = tuple(
            (steps.event.name, item)
            for steps in harmful
            for item, where in self._leaving(steps.event.name)
            if where & state != false
        )
        forbidden = tuple(
            (steps.event.name, place)
            for steps in harmful
            if steps.plant & state != false
            for place in self._conditions_on(steps.event.name)
            if self._problems.condition(place) & state == false
        )
        is_blocking = self.safe & state != false
        detour, is_detour_unknown = None, False
        if is_blocking:
            try:
                detour = self.detour(state, self._fixed_point.marked, self.safe)
            except WayNotFoundError:
                is_detour_unknown = True
        return Counterexample(
            run,
            is_forced,
            invariants,
            leaving,
            forbidden,
            detour,
            is_detour_unknown,
            self._unmarked(state) if is_blocking else (),
            is_blocking and self._encoder.holds(self._marker) & state == false,
        )

    def _unmarked(self, state: Any) -> tuple[str, ...]:
        return tuple(
            item.name
            for item in self._automata
            if not any(
                self._encoding.in_location(item.name, location) & state != self._manager.false
                for location in item.marked
            )
        )

    def stuck(self, state: State) -> dict[str, bool]:
        """Return the automata that never get to a marked location from a state by the plants alone.

        The value is True if nothing even leaves the location that the automaton is in.
        """
        false, here = self._manager.false, self.predicate(state)
        reached = self._fixed_point.states_from(self._free, here, self._manager.true)
        return {
            item.name: not any(
                self._encoding.in_location(item.name, location) & reached != false
                for location in item.locations
                if self._encoding.in_location(item.name, location) & here == false
            )
            for item in self._automata
            if not any(self._encoding.in_location(item.name, location) & reached != false for location in item.marked)
        }

    def detour(
        self, start: Any, goal: Any, good: Any, inside: Any | None = None, runs: ShortestRuns | None = None
    ) -> Detour | None:
        """Return a way of the plants alone to a goal, and where it is stopped; None if there is none.

        The way follows allowed events as far as they lead, and only then the plants alone. So no other way avoids the
        reported event.

        Args:
            start: States where the way begins.
            goal: States at its end, which allowed events do not reach.
            good: The states that must not be left.
            inside: States that can be reached by allowed events, if that is known.
            runs: Shortest runs from the start by allowed events, if there are some already.

        Raises:
            WayNotFoundError: The search takes too long.
        """
        for ways in self._ways(goal):
            # Allowed events are the plants' own, so from what they reach no way leads on unless one does from here.
            if ways.is_none_from(start):
                continue
            if inside is None:
                inside = self._fixed_point.states_from(self._problem, start, good)
            beyond = self._way(ways, inside)
            if beyond is not None:
                break
        else:
            return None
        # Ways leave at once what is allowed: rings and layers are such that no state after the first is inside.
        event, there = beyond.events[0], self.predicate(beyond.states[1])
        leaving = inside & ways.before(event, there)
        if runs is None:
            runs = self.runs(start, {name: self.possible(name, good) for name in self._steps})
        before = runs.run_to(leaving)
        if before is None:
            raise InternalError("what can be reached is not reached")
        here = self.predicate(before.states[-1])
        return Detour(
            (*before.events, *beyond.events),
            len(before.events),
            before.states[-1],
            self.blocking_causes(event, here, good),
        )

    def _ways(self, goal: Any) -> tuple[Ways, Ways]:
        """Return the ways to a goal under the requirements, and those of the plants alone.

        They are tried in this order: an event that synthesis forbids is reported before one that requirements forbid.
        """
        return self._marked_ways if goal == self._fixed_point.marked else self._ways_to(goal)

    @cached_property
    def _marked_ways(self) -> tuple[Ways, Ways]:
        return self._ways_to(self._fixed_point.marked)

    def _ways_to(self, goal: Any) -> tuple[Ways, Ways]:
        restricted = {name: item.plant & self._restricted(item) for name, item in self._steps.items()}
        unrestricted = {item.event.name: item.plant for item in self._free.steps}
        return (
            Ways(self._encoding, self._monitor, tuple(self._steps.values()), restricted, goal),
            Ways(self._encoding, self._monitor, self._free.steps, unrestricted, goal),
        )

    def _way(self, ways: Ways, start: Any) -> SystemRun | None:
        try:
            return ways.way_from(start, is_led=self._unfound < MAXIMUM_UNFOUND)
        except WayNotFoundError:
            self._unfound += 1
            raise

    def predicate(self, state: State) -> Any:
        """Return the predicate that is true only in this state."""
        values = zip(subjects(self._encoding.system), state, strict=True)
        return self._encoding.all_of(
            self._encoding.equals(self._encoding.subjects[subject], value) for subject, value in values
        )

    def image(self, event: str, states: Any) -> Any:
        """The states that an event leads to from some states."""
        return self._steps[event].image(states)

    def bad_after(self, event: str, states: Any, good: Any) -> Any:
        """The states that are not good to which an event leads from some states."""
        steps = self._steps[event]
        return steps.image(states & steps.plant) & ~good
