"""Memory that a strategy keeps beside the state: what has been judged in stable states so far.

Each place of it is a truth value. In every stable state it becomes a function of itself and of that state; the
executor and the game observe it at the same moments.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from robosc.automata.structure import Automaton, DiscreteVariable, System
from robosc.expressions import TRUE, Binary, BooleanType, Expression, StateTest, Unary, VariableRead
from robosc.model.structure import Assumption, EventKind, Goal, GoalForm

if TYPE_CHECKING:
    from robosc.automata.executable import ExecutableSystem

MEMORY = "goal memory"
"""Name of the automaton whose variables are the memory: no component can be called so."""


@dataclass(frozen=True, slots=True)
class Place:
    """A truth value that is remembered.

    Attributes:
        name: Its name, unique in the memory: words that say that it is true, with `is` or `was` in them.
        update: Its value after a stable state, as a condition over that state and the memory before.
    """

    name: str
    update: Expression

    @property
    def read(self) -> Expression:
        """The condition that it is true."""
        return VariableRead(MEMORY, self.name)


@dataclass(frozen=True, slots=True)
class Judgement:
    """A goal or an assumption as a condition that is to be true again and again.

    Attributes:
        condition: Condition over the state and the memory.
        place: Place of the memory that it needs, or None.
    """

    condition: Expression
    place: Place | None = None


def judgement(item: Goal | Assumption, name: str) -> Judgement:
    """Return a goal or an assumption as a condition that is to be true again and again.

    `P leads to E` waits for an answer from a stable state in which P is true up to one in which E is true.

    Args:
        item: The goal or assumption.
        name: Its name, such as `goal 1`.
    """
    condition = holds(item.condition)
    if item.form is GoalForm.ALWAYS_EVENTUALLY:
        return Judgement(condition)
    if item.form is GoalForm.ONCE:
        name = f"{name} was reached"
        place = Place(name, Binary("or", VariableRead(MEMORY, name), condition))
        return Judgement(place.read, place)
    name = f"{name} is owed"
    trigger = TRUE if item.trigger is None else holds(item.trigger)
    waiting = Binary("and", Binary("or", VariableRead(MEMORY, name), trigger), Unary("not", condition))
    place = Place(name, waiting)
    return Judgement(Unary("not", place.read), place)


def holds(condition: Expression) -> Expression:
    """Return the condition that another one is true, and not unknown."""
    return Unary("holds", condition)


@dataclass(frozen=True, slots=True)
class Cancel:
    """A cancel that the executor issues by itself (semantics 3.4).

    Attributes:
        event: The cancel event.
        running: Condition that a goal of its action runs.
        places: For each requirement of the action, the place that remembers that it held since the request.
        conditions: The requirements.
    """

    event: str
    running: Expression
    places: tuple[Place, ...]
    conditions: tuple[Expression, ...]

    @property
    def is_due(self) -> Expression:
        """Condition that a requirement held and does not hold any more."""
        fallen: Expression | None = None
        for place, condition in zip(self.places, self.conditions, strict=True):
            item = Binary("and", place.read, Unary("not", condition))
            fallen = item if fallen is None else Binary("or", fallen, item)
        return self.running if fallen is None else Binary("and", self.running, fallen)


def own_cancels(executable: "ExecutableSystem") -> Iterator[Cancel]:
    """Yield the cancels that the executor may issue, in its order."""
    for event in executable.events.values():
        if event.kind is not EventKind.CANCEL or not event.moves or not event.communication:
            continue
        requirements = executable.model.requirements_on(event.communication.name)
        if not requirements:
            continue
        (location,) = event.moves.targets
        running = StateTest(event.moves.plant, location)
        conditions = tuple(holds(item.condition) for item in requirements)
        places = tuple(
            _held(f"requirement {number} of {event.communication.name} was met", running, condition)
            for number, condition in enumerate(conditions, start=1)
        )
        yield Cancel(event.name, running, places, conditions)


def _held(name: str, running: Expression, condition: Expression) -> Place:
    return Place(name, Binary("and", running, Binary("or", VariableRead(MEMORY, name), condition)))


def remembering(system: System, places: Sequence[Place]) -> System:
    """Return a system with a memory beside it, which no event moves."""
    variables = tuple(DiscreteVariable(place.name, BooleanType(), (False,)) for place in places)
    memory = Automaton(MEMORY, ("only",), ("only",), frozenset({"only"}), frozenset(), (), variables)
    return replace(system, automata=(*system.automata, memory))


@dataclass(frozen=True, slots=True)
class Obligations:
    """Goals and assumptions of a robot, with the memory that judging them needs.

    Attributes:
        goals: Condition of each goal, to be true again and again.
        assumptions: Condition of each assumption, true again and again.
        cancels: Own cancels of the executor, in its order.
        places: Places of the memory: of the cancels, of the assumptions, of the goals.
    """

    goals: tuple[Expression, ...]
    assumptions: tuple[Expression, ...]
    cancels: tuple[Cancel, ...]
    places: tuple[Place, ...]


def obligations(executable: "ExecutableSystem") -> Obligations:
    """Return the goals and assumptions of an executable system's model."""
    cancels = tuple(own_cancels(executable))
    model = executable.model
    owed = [judgement(item, f"assumption {number}") for number, item in enumerate(model.assumptions, start=1)]
    wanted = [judgement(item, f"goal {number}") for number, item in enumerate(model.goals, start=1)]
    judged = (item.place for item in (*owed, *wanted))
    return Obligations(
        tuple(item.condition for item in wanted),
        tuple(item.condition for item in owed),
        cancels,
        (*(place for cancel in cancels for place in cancel.places), *(place for place in judged if place)),
    )
