"""Extended finite automata: what synthesis, verification and exploration work on.

Definitions after Ouedraogo, Kumar, Malik and Akesson, "Nonblocking and safe control of discrete-event
systems modeled as extended finite automata", IEEE T-ASE 8(3), 2011, pp. 560-569. Automata synchronise
on shared events; guards may read the locations and variables of every automaton.

This structure does not depend on RoboSC: a component is an automaton like any other. In expressions,
`VariableRead(component=A, variable=v)` is variable v of automaton A, `StateTest(A, l)` is true if
A is in location l, and `Received(path)` is the event's input of that path.
"""

from dataclasses import dataclass, replace
from enum import StrEnum

from robosc.expressions import TRUE, Expression, PathStep, Type, Unary, Value, conjunction


@dataclass(frozen=True, slots=True)
class Event:
    """A named occurrence. The supervisor may disable controllable events only."""

    name: str
    is_controllable: bool


@dataclass(frozen=True, slots=True)
class DiscreteVariable:
    """A variable that edges of its automaton assign.

    Attributes:
        name: Unique in its automaton.
        type: A finite type.
        initial: The values it may begin with, at least one.
    """

    name: str
    type: Type
    initial: tuple[Value, ...]


@dataclass(frozen=True, slots=True)
class InputVariable:
    """A part of the data that one occurrence of an event carries, chosen by the environment.

    Attributes:
        event: The event that carries it.
        path: The `Received` path that reads it.
        type: A finite type.
        may_be_unknown: True if the environment may also leave it out (an element of an array). Elements
            of one array that differ only in the last index: a later one is known only if every
            earlier one is. In general the environment chooses the length of every array on the path, and
            a datum is known exactly if each index on its path is below its array's length.
    """

    event: str
    path: tuple[PathStep, ...]
    type: Type
    may_be_unknown: bool = False


@dataclass(frozen=True, slots=True)
class Assignment:
    """`variable := expression` of an edge, reading the state before the transition.

    If the expression is unknown the variable keeps its value; if it leaves the variable's range, a
    controllable event is disabled and for an uncontrollable one the state is bad.
    """

    variable: str
    expression: Expression


@dataclass(frozen=True, slots=True)
class Edge:
    """An arc of an automaton; it takes part when its guard is true."""

    source: str
    event: str
    target: str
    guard: Expression = TRUE
    updates: tuple[Assignment, ...] = ()


class Role(StrEnum):
    """Role of an automaton in a synthesis problem."""

    PLANT = "plant"
    """Automaton that says what can happen."""
    REQUIREMENT = "requirement"
    """Automaton that says what may happen: it watches the plants, and an event without an edge in it violates it.

    An event of which only requirements know is always possible in the plants.
    """


@dataclass(frozen=True, slots=True)
class Automaton:
    """A plant, or a requirement.

    Attributes:
        name: Unique; a component's name, or e.g. `service calibrate`, which no identifier can be.
        locations: Names, at least one.
        initial: The locations it may begin in; without any the system has no initial state.
        marked: Marked locations.
        alphabet: Events that it takes part in. Without a possible edge for an event, a plant cannot do it, and a
            requirement forbids it.
        edges: Its arcs. If several edges for one event are possible, it takes one of them nondeterministically.
        variables: Its variables.
        role: Its role, plant or requirement.
        monitors: Events of the alphabet that it neither blocks nor forbids: where no edge for one takes part, it stays
            as it is.
    """

    name: str
    locations: tuple[str, ...]
    initial: tuple[str, ...]
    marked: frozenset[str]
    alphabet: frozenset[str]
    edges: tuple[Edge, ...]
    variables: tuple[DiscreteVariable, ...] = ()
    role: Role = Role.PLANT
    monitors: frozenset[str] = frozenset()


@dataclass(frozen=True, slots=True)
class EventCondition:
    """A state-event exclusion invariant: `event` only where `condition` is true."""

    event: str
    condition: Expression


def disables(condition: Expression, event: str) -> EventCondition:
    """The other form of a state-event exclusion invariant: `event` only where `condition` is not true."""
    return EventCondition(event, Unary("not", Unary("holds", condition)))


@dataclass(frozen=True, slots=True)
class System:
    """Plants and requirements of one synthesis problem, in source order.

    Attributes:
        name: Name of the system.
        events: All events.
        automata: Plants and requirement automata; the synchronous composition of the plants is the uncontrolled
            system.
        inputs: Received data that updates read.
        conditions: Requirements on events; several on one event must all be true.
        invariants: Requirements on states: conditions that must be true in every one.
        initial: A condition that is true in every initial state, beside what automata and variables say.
        marker: A condition that is true in every marked state, beside what the automata say.
        plant_conditions: Conditions without which the plants cannot do an event, controllable or not.
        plant_invariants: Conditions that are true in every state that there is: what would lead to another one cannot
            happen, and the system does not begin in one. No supervisor has to see to them.
        is_controlled: True if its requirements are a supervisor that was made already: nothing is synthesized, and a
            controllable event does not lead where an invariant is not true. See `composed`.
    """

    name: str
    events: tuple[Event, ...]
    automata: tuple[Automaton, ...]
    inputs: tuple[InputVariable, ...] = ()
    conditions: tuple[EventCondition, ...] = ()
    invariants: tuple[Expression, ...] = ()
    initial: Expression = TRUE
    marker: Expression = TRUE
    plant_conditions: tuple[EventCondition, ...] = ()
    plant_invariants: tuple[Expression, ...] = ()
    is_controlled: bool = False

    def automaton(self, name: str) -> Automaton:
        """The automaton called `name` (KeyError if there is none)."""
        for automaton in self.automata:
            if automaton.name == name:
                return automaton
        raise KeyError(name)

    def role_of(self, automaton: Automaton) -> str:
        """The role of an automaton in a word: the requirements of a controlled system are its supervisor."""
        return "supervisor" if self.is_controlled and automaton.role is Role.REQUIREMENT else str(automaton.role)

    def event(self, name: str) -> Event:
        """The event called `name` (KeyError if there is none)."""
        for event in self.events:
            if event.name == name:
                return event
        raise KeyError(name)


def as_controlled(system: System) -> System:
    """Return automata whose requirements are taken for a supervisor that was made already.

    No state is one that a supervisor excludes, so the system begins in none either.
    """
    if system.is_controlled:
        return system
    return replace(system, initial=conjunction(system.initial, *system.invariants), is_controlled=True)


def composed(system: System) -> System:
    """Return a controlled system as it runs: the parts of its supervisor take part as plants do; others as they are.

    What the supervisor would prevent does not happen then, even if it is uncontrollable; `robosc.verification` finds
    that, in the system as it was given.
    """
    if not system.is_controlled:
        return system
    return replace(
        system,
        automata=tuple(replace(item, role=Role.PLANT) for item in system.automata),
        conditions=(),
        invariants=(),
        plant_conditions=(*system.plant_conditions, *system.conditions),
        plant_invariants=(*system.plant_invariants, *system.invariants),
    )
