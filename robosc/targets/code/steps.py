"""Statements of a generated step of one event: their meaning and order, which all languages share."""

from abc import ABC, abstractmethod
from collections.abc import Sequence

from robosc.automata.executable import ExecutableEvent, Participant
from robosc.model.structure import Transition, Update, Variable
from robosc.targets.code.conditions import accepted
from robosc.targets.code.expression_writer import ExpressionWriter
from robosc.targets.code.expressions import Code

Branch = tuple[tuple[str, ...], list[str]]
"""States of a component, and the statements of what it does in them; at least one of each."""


class StepWriter(ABC):
    """Writes the statements of one event.

    Args:
        executable: The event.
        before: Writes expressions over the state in which nothing has changed yet.
    """

    def __init__(self, executable: ExecutableEvent, before: ExpressionWriter) -> None:
        self._executable = executable
        self._before = before

    @abstractmethod
    def _refuse_outside(self, automaton: str, locations: tuple[str, ...]) -> list[str]:
        """Refuse the event unless an automaton is in one of some locations."""

    @abstractmethod
    def _refuse_unless(self, words: str, condition: Code) -> list[str]:
        """Refuse the event unless a condition holds, which words explain."""

    @abstractmethod
    def _move(self, automaton: str, sources: tuple[str, ...], target: str) -> list[str]:
        """Move an automaton that is in one of some locations."""

    @abstractmethod
    def _update(self, component: str, variable: Variable, update: Update) -> list[str]:
        """Assign a variable, or skip the update where its value is unknown or out of range."""

    @abstractmethod
    def _choice(self, component: str, branches: Sequence[Branch], states: int) -> list[str]:
        """Choose among the statements of a component by its state.

        Args:
            component: The component.
            branches: Its branches in order; they share no state.
            states: Number of its states; a branch of so many is done in any case.
        """

    def _refusals(self) -> list[str]:
        """Refuse where the event is not accepted, before anything changes."""
        lines = []
        if (moves := self._executable.moves) is not None:
            lines += self._refuse_outside(moves.plant, moves.sources)
        if self._executable.is_issued:
            for words, condition in accepted(self._executable, self._before):
                lines += self._refuse_unless(words, condition)
        return lines

    def _plant(self) -> list[str]:
        """Move the plant of a service or action."""
        moves = self._executable.moves
        return [] if moves is None or moves.target is None else self._move(moves.plant, moves.sources, moves.target)

    def _components(self) -> list[str]:
        """Let each component do its part."""
        return [line for participant in self._executable.participants for line in self._part(participant)]

    def _part(self, participant: Participant) -> list[str]:
        bodies = ((states, self._transition(participant, states, each)) for states, each in participant.branches)
        branches = [(states, body) for states, body in bodies if body]
        return self._choice(participant.component, branches, len(participant.behaviour.states))

    def _transition(self, participant: Participant, states: tuple[str, ...], transition: Transition) -> list[str]:
        variables = {variable.name: variable for variable in participant.behaviour.variables}
        lines = []
        for update in transition.updates:
            lines += self._update(participant.component, variables[update.variable], update)
        if transition.target is not None and states != (transition.target,):
            lines += self._move(participant.component, states, transition.target)
        return lines
