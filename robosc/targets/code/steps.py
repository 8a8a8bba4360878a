"""Statements of a generated step of one event: their meaning and order, which all languages share."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence

from robosc.automata.executable import CALLED_KINDS, ExecutableEvent, ExecutableSystem, Participant
from robosc.automata.plants import communication_plant_name
from robosc.expressions import Type
from robosc.expressions.text import expression_text
from robosc.model.structure import Transition
from robosc.targets.code.conditions import accepted
from robosc.targets.code.expression_writer import ExpressionWriter
from robosc.targets.code.expressions import TRUE_CODE, Code
from robosc.targets.code.naming import Namer
from robosc.targets.code.statements import Assign, Block, Comment, Let, Return, Statement, when


class StepWriter(ABC):
    """Builds the statements of one event.

    Args:
        executable: The event.
        before: Writes expressions over the state in which nothing has changed yet.
        values: Writes the values of updates, which read that state while the other one is written.
        after: Writes places of the state that the event leads to.
        namer: Names the local variables.

    Attributes:
        may_skip: True if an update may be skipped, so far.
    """

    refused: Code
    """The result of a step that is refused."""

    def __init__(
        self,
        executable: ExecutableEvent,
        before: ExpressionWriter,
        values: ExpressionWriter,
        after: ExpressionWriter,
        namer: Namer,
    ) -> None:
        self._executable = executable
        self._before, self._values, self._after = before, values, after
        self._namer = namer
        self._conditions = accepted(executable, before) if executable.is_issued else []
        self.may_skip = False

    @abstractmethod
    def _write(self, place: Code, value: Code, may_stay: bool) -> list[Statement]:
        """Assign a place of the state; it holds another value before unless it `may_stay`."""

    @abstractmethod
    def _choice(self, branches: Sequence[tuple[Code, Block]], is_whole: bool) -> Block:
        """Choose among what a component does by the state that it is in.

        Args:
            branches: The tests and what is done then, in order; one of them holds at most.
            is_whole: True if one of them holds in any case.
        """

    @abstractmethod
    def _assigned(self, type_: Type, value: Code) -> Code:
        """The value of an update as a variable of a type takes it."""

    def _stored(self, type_: Type, value: Code) -> Code:
        """The same as the place of a variable takes it."""
        return value

    @abstractmethod
    def _is_at_hand(self, type_: Type, value: Code) -> bool:
        """Return True if an update is never skipped, and its value can stand where it is written."""

    @abstractmethod
    def _unless_skipped(self, name: str, type_: Type, held: Code, written: Block) -> Block:
        """Statements that are executed unless the update of a variable is skipped, whose value a local one holds."""

    def _refusals(self) -> list[Statement]:
        """Refuse where the event is not accepted, before anything changes."""
        refuse = Return(self.refused)
        found: list[Statement] = []
        if (moves := self._executable.moves) is not None:
            found.append(when(self._before.in_one_of(moves.plant, moves.sources, False), refuse))
        for words, condition in self._conditions:
            found += [Comment(words), when(self._before.negated(condition), refuse)]
        return found

    def _plant(self) -> list[Statement]:
        """Move the plant of a service or action."""
        moves = self._executable.moves
        return [] if moves is None or moves.target is None else self._move(moves.plant, moves.sources, moves.target)

    def _components(self) -> list[Statement]:
        """Let each component do its part."""
        return [item for participant in self._executable.participants for item in self._part(participant)]

    def _part(self, participant: Participant) -> Block:
        count, tested = len(participant.behaviour.states), 0
        branches: list[tuple[Code, Block]] = []
        for states, transition in participant.branches:
            if body := self._transition(participant, states, transition):
                test = self._before.in_one_of(participant.component, states) if len(states) < count else TRUE_CODE
                branches.append((test, body))
                tested += len(states)
        for test, body in branches:
            # The event is refused otherwise.
            if any(test == condition for _, condition in self._conditions):
                return body
        return self._choice(branches, tested == count)

    def _transition(self, participant: Participant, states: tuple[str, ...], transition: Transition) -> Block:
        component, types = participant.component, {item.name: item.type for item in participant.behaviour.variables}
        found: list[Statement] = []
        for name, expression in ((update.variable, update.expression) for update in transition.updates):
            found.append(Comment(f"{component}: do {name} := {expression_text(expression)}"))
            place, type_ = self._after.variable_place(component, name), types[name]
            value = self._assigned(type_, self._values.value(expression))
            if self._is_at_hand(type_, value):
                found += self._write(place, self._stored(type_, value), True)
            else:
                held = value.held_in(self._namer.name(f"new_{name}"))
                written = self._write(place, self._stored(type_, held), True)
                found += [Let(held, value), *self._unless_skipped(f"{component}.{name}", type_, held, written)]
        if transition.target is not None and states != (transition.target,):
            found += self._move(component, states, transition.target)
        return found

    def _move(self, automaton: str, sources: tuple[str, ...], target: str) -> list[Statement]:
        """Move an automaton that is in one of some locations."""
        place, value = self._after.location_place(automaton), self._after.location_code(automaton, target)
        return self._write(place, value, target in sources)


def initial_state(
    system: ExecutableSystem, after: ExpressionWriter, initial: Callable[[Type, bool | int | float | str], Code]
) -> list[Statement]:
    """Return the assignments of the initial state; `initial` writes a constant of a type."""
    found: list[Statement] = []
    for component, behaviour in system.behaviours:
        found.append(Assign(after.location_place(component), after.location_code(component, behaviour.initial)))
        for item in behaviour.variables:
            found.append(Assign(after.variable_place(component, item.name), initial(item.type, item.initial)))
    plants = (communication_plant_name(item) for item in system.model.communications if item.kind in CALLED_KINDS)
    return [*found, *(Assign(after.location_place(plant), after.location_code(plant, "idle")) for plant in plants)]
