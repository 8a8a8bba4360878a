"""Interpreter of a supervisor: plants, ranges, requirements and added conditions, each looked at anew."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from robosc.automata.plants import communication_plant_name
from robosc.execution.interpreter.description import describe
from robosc.execution.interpreter.functions import Data, Place, function_of, holds, no_data
from robosc.execution.interpreter.goals import Account, GoalsOfSystem
from robosc.execution.interpreter.missions import MissionPlace
from robosc.execution.interpreter.received import Reader
from robosc.execution.interpreter.rules import (
    EventRule,
    Participant,
    TransitionRule,
    WhenRule,
    event_rules,
    initial_state,
    place_domains,
    provided_function,
)
from robosc.execution.runtime.protocol import MATCHES, Match, Reading, batches, requesting
from robosc.expressions import Value, conjuncts
from robosc.model.structure import is_tau
from robosc.supervisor import Supervisor


@dataclass(frozen=True, slots=True)
class Successor:
    """State that an event leads to.

    Attributes:
        before: The state before.
        written: New value of each place that is written.
        skipped: Variables whose update was skipped.
        leaves_range: True if a synthesis variable would leave its range.
    """

    before: Mapping[Place, Value]
    written: dict[Place, Value]
    skipped: tuple[str, ...]
    leaves_range: bool

    @property
    def state(self) -> dict[Place, Value]:
        """The new state."""
        return {**self.before, **self.written}

    def changed(self) -> list[Place]:
        """Return the places that have another value in it."""
        return [place for place, value in self.written.items() if self.before[place] != value]


@dataclass(frozen=True, slots=True)
class Snapshot:
    """State of an interpreted system to come back to.

    Attributes:
        state: Value of each place.
        goals: Memory of the goals and missions; None where there is no strategy.
    """

    state: Mapping[Place, Value]
    goals: Account | None


class InterpretedSystem:
    """Implementation of `robosc.execution.runtime.protocol.ControlledSystem` for any supervisor.

    Args:
        supervisor: Supervisor to interpret.

    Attributes:
        description: Its static part.
        changes: Number of changes of the state.
    """

    def __init__(self, supervisor: Supervisor) -> None:
        model = supervisor.model
        self.description = describe(supervisor)
        self._model = model
        self._reader = Reader(model)
        self._events = event_rules(supervisor)
        self._requirements = {
            item.name: tuple(function_of(requirement.condition) for requirement in model.requirements_on(item.name))
            for item in model.communications
        }
        self._conjuncts = {
            item.name: tuple(
                function_of(part)
                for requirement in model.requirements_on(item.name)
                for part in conjuncts(requirement.condition)
            )
            for item in model.communications
        }
        self._provides = {
            item.name: tuple(
                (
                    None if statement.condition is None else function_of(statement.condition),
                    provided_function(statement.value),
                )
                for statement in model.provides_for(item.name)
            )
            for item in model.communications
        }
        self._when = {item.name: WhenRule.of(item) for item in model.communications if item.when is not None}
        self._limits = {
            item.name: tuple(
                (
                    None if limit.condition is None else function_of(limit.condition),
                    tuple((bound.path, bound.low, bound.high) for bound in limit.bounds),
                )
                for limit in model.limits_for(item.name)
            )
            for item in model.communications
        }
        self._initial = initial_state(model)
        self._state = self._initial
        self.changes = 0
        self._request_events = tuple(info.name + ".request" for info in requesting(self.description.communications))
        self._were_enabled: frozenset[int] = frozenset()
        self._batches = batches(self.description.communications)
        self._goals = None
        domains = place_domains(model)
        # Goals and strategies read what takes part in synthesis alone.
        self._situation = tuple(place for place in domains if place in self._initial)
        if supervisor.strategy is not None:
            self._goals = GoalsOfSystem(model, supervisor.strategy, self._request_events, domains)

    def restart(self) -> None:
        """Return to the initial state."""
        self.changes += 1
        self._were_enabled = frozenset()
        self._state = self._initial
        if self._goals is not None:
            self._goals.restart()

    def enabled(self, event: str) -> bool:
        """Return True if a controllable event is allowed now; an unknown event is a KeyError."""
        rule = self._events[event]
        state = self._state
        if not all(holds(condition, state) for condition in rule.conditions):
            return False
        if rule.added is not None and not rule.added(state):
            return False
        successor = self._successor(rule, no_data)
        if successor is None or successor.leaves_range:
            return False
        return not is_tau(event) or bool(successor.changed())

    def is_possible(self, event: str) -> bool:
        """Return True if the plants allow an event now, for any data; an unknown event is a KeyError."""
        rule = self._events[event]
        successor = self._successor(rule, no_data)
        return successor is not None and not (rule.is_controllable and successor.leaves_range)

    def snapshot(self) -> Snapshot:
        """Return the state with the memory of goals, as a value that `restore` takes."""
        return Snapshot(self._state, None if self._goals is None else self._goals.snapshot())

    def restore(self, snapshot: Snapshot) -> None:
        """Return to a state that `snapshot` has returned."""
        self.changes += 1
        self._state = dict(snapshot.state)
        if self._goals is not None and snapshot.goals is not None:
            self._goals.restore(snapshot.goals)

    def enabled_requests(self) -> tuple[int, ...]:
        """Return the numbers, in source order of all requests, of those that are allowed now."""
        return tuple(number for number, event in enumerate(self._request_events) if self.enabled(event))

    def changed_requests(self) -> tuple[int, ...]:
        """Return the numbers of the requests that are allowed now and were not at the last call, or vice versa."""
        before, self._were_enabled = self._were_enabled, frozenset(self.enabled_requests())
        return tuple(sorted(before ^ self._were_enabled))

    def enabled_silent(self) -> str | None:
        """The first reset, then the first tau, that is allowed now; None if none is."""
        silent = (*self.description.resets, *self.description.taus)
        return next((event for event in silent if self.enabled(event)), None)

    def receive(self, identifier: str, data: Any) -> tuple[tuple[str, tuple[str, ...]], ...] | None:
        """Take all events of a message; return those with skipped updates, or None if some data is unknown."""
        readings = [(event, self.read(event, data)) for _, event in self._batches[identifier]]
        if any(reading.unknown for _, reading in readings):
            return None
        taken = [(event, self.step(event, reading)) for event, reading in readings]
        return tuple((event, skipped) for event, skipped in taken if skipped)

    def read(self, event: str, data: Any) -> Reading:
        """Convert the data of an uncontrollable event (MissingData if a part is missing that cannot be unknown)."""
        rule = self._events[event]
        self._reader.require(rule.required, data)
        return self._reader.read(rule.received, rule.paths, data)

    def step(self, event: str, reading: Reading | None = None) -> tuple[str, ...] | None:
        """Take an event; return the variables whose update was skipped, or None if the state cannot accept it."""
        rule = self._events[event]
        if reading is None and rule.paths:
            reading = self.read(event, None)
        successor = self._successor(rule, no_data if reading is None else reading.values.get)
        if successor is None or (rule.is_controllable and successor.leaves_range):
            return None
        self._enter(successor)
        return successor.skipped

    def provide(self, communication: str) -> tuple[bool, Any]:
        """Data for a request: (is known, data)."""
        for condition, value in self._provides[communication]:
            if condition is None or holds(condition, self._state):
                return value(self._state)
        return True, None

    def limits(self, communication: str) -> tuple[tuple[tuple[str, ...], float, float], ...]:
        """Bounds of numbers of a request: of all limits whose condition is not false."""
        return tuple(
            bound
            for condition, bounds in self._limits[communication]
            if condition is None or condition(self._state, no_data) is not False
            for bound in bounds
        )

    def matches(self, communication: str, data: Any) -> Match:
        """Return whether a message is an incoming message, by its condition `when`."""
        rule = self._when.get(communication)
        if rule is None:
            return MATCHES
        reading = self._reader.read(rule.type, rule.paths, data)
        return Match(rule.condition({}, reading.values.get) is True, reading.unknown, reading.enum_unknown)

    def requirements(self, communication: str) -> tuple[bool, ...]:
        """Return which requirements on a request hold."""
        return tuple(holds(function, self._state) for function in self._requirements[communication])

    def conjuncts(self, communication: str) -> tuple[bool, ...]:
        """Return which top-level conjuncts of the requirements on a request hold."""
        return tuple(holds(function, self._state) for function in self._conjuncts[communication])

    def location(self, communication: str) -> str:
        """Return the location of a service or action; an unknown name is a KeyError."""
        return str(self._state[communication_plant_name(self._model.communication(communication)), None])

    def situation(self) -> tuple[Value, ...]:
        """Return the part of the state that goals and the strategy depend on."""
        return tuple(map(self._state.__getitem__, self._situation))

    def remembered(self) -> Any:
        """Return what is remembered of goals and missions; None where there is no strategy."""
        return None if self._goals is None else self._goals.remembered()

    def recall(self, remembered: Any) -> None:
        """Remember what `remembered` has returned."""
        if self._goals is not None:
            self._goals.recall(remembered)

    def observe(self) -> tuple[bool, ...]:
        """Take in a stable state, for what the strategy remembers; return what is met, and where missions are."""
        if self._goals is None:
            return ()
        self._goals.observe(self._state)
        return (*self._goals.are_met(self._state), *self._goals.where_missions_are())

    @property
    def mode(self) -> int:
        """Number of the aim whose turn it is."""
        return 0 if self._goals is None else self._goals.mode

    def choose(self) -> int | None:
        """Number of the request that the strategy chooses in this stable state, or None if it waits."""
        return None if self._goals is None else self._goals.choose(self._state)

    def is_stable(self) -> bool:
        """Return True if an executor would take no silent step now: no reset and no tau."""
        return self.enabled_silent() is None

    def reached(self) -> tuple[bool, ...]:
        """Return for each goal True if it counts as come true in this stable state; nothing without a strategy."""
        return () if self._goals is None else self._goals.are_true(self._state)

    def missions(self) -> tuple[MissionPlace, ...]:
        """Return for each mission where it is since the last stable state; nothing without a strategy."""
        return () if self._goals is None else self._goals.missions()

    def state(self) -> dict[str, dict[str, Any]]:
        """State and variables of every component with a behaviour."""
        return {
            component.name: {
                "state": self._state[component.name, None],
                "variables": {
                    variable.name: self._state[component.name, variable.name]
                    for variable in component.behaviour.variables
                },
            }
            for component in self._model.components
            if component.behaviour
        }

    def signature(self) -> Any:
        """Return a hashable value that differs between states."""
        return tuple(self._state.values())

    def _enter(self, successor: Successor) -> None:
        """Go over to the state that an event leads to."""
        if successor.changed():
            self.changes += 1
        # The new one of equal numbers counts, too, such as -0.0 after 0.0.
        if successor.written:
            self._state = successor.state

    def _successor(self, rule: EventRule, data: Data) -> Successor | None:
        """Return the successor that an event leads to by the plants alone; None if one of them blocks it."""
        old = self._state
        new: dict[Place, Value] = {}
        skipped: list[str] = []
        leaves_range = False
        if rule.plant is not None:
            name, moves = rule.plant
            location = str(old[name, None])
            if location not in moves:
                return None
            new[name, None] = moves[location]
        for participant in rule.participants:
            transition = self._chosen(participant)
            if transition is None:
                if participant.may_block:
                    return None
                continue
            if transition.target is not None:
                new[participant.name, None] = transition.target
            for update in transition.updates:
                value = update.function(old, data)
                assigned = update.assigned(value)
                leaves_range = leaves_range or update.leaves_range(value)
                if assigned is None:
                    skipped.append(f"{participant.name}.{update.variable.name}")
                else:
                    new[update.place] = assigned
        return Successor(old, new, tuple(skipped), leaves_range)

    def _chosen(self, participant: Participant) -> TransitionRule | None:
        """The transition that a component takes from its current state."""
        for transition in participant.transitions.get(str(self._state[participant.name, None]), ()):
            if transition.guard is None or holds(transition.guard, self._state):
                return transition
        return None
