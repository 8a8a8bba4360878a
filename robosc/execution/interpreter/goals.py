"""Goals and assumptions, as an executor keeps account of them, and the strategy that reaches them."""

from collections.abc import Iterator, Sequence
from typing import Protocol

from robosc.execution.interpreter.functions import Function, Place, State, diagram_function, function_of, holds
from robosc.expressions import Value
from robosc.model.structure import Assumption, CommunicationKind, Goal, GoalForm, Model
from robosc.supervisor import Strategy

_MEMORY = "goal memory"


class _Kept(Protocol):
    """A truth value that is kept from one stable state to the next."""

    def after(self, before: bool, state: State) -> bool:
        """Return the value after a stable state."""


class _Item:
    """A goal or an assumption.

    Args:
        item: As it is written.
        subject: Its name, such as `goal 1`.

    Attributes:
        name: Name by which strategies know what is kept of it.
    """

    def __init__(self, item: Goal | Assumption, subject: str) -> None:
        self.name = f"{subject} {'was reached' if item.form is GoalForm.ONCE else 'is owed'}"
        self._form = item.form
        self._condition = function_of(item.condition)
        self._trigger = None if item.trigger is None else function_of(item.trigger)

    def after(self, before: bool, state: State) -> bool:
        is_true = holds(self._condition, state)
        if self._form is GoalForm.ONCE:
            return before or is_true
        is_asked = before or (self._trigger is not None and holds(self._trigger, state))
        return self._form is GoalForm.LEADS_TO and is_asked and not is_true

    def is_true(self, kept: bool, state: State) -> bool:
        """Return True if it counts as come true in a stable state that was taken in."""
        match self._form:
            case GoalForm.ONCE:
                return kept
            case GoalForm.LEADS_TO:
                return not kept
        return holds(self._condition, state)


class _Held:
    """A requirement of an action, which held in a stable state while its goal runs."""

    def __init__(self, plant: str, condition: Function) -> None:
        self._plant = plant
        self._condition = condition

    def after(self, before: bool, state: State) -> bool:
        return state[self._plant, None] == "executing" and (before or holds(self._condition, state))

    def has_fallen(self, kept: bool, state: State) -> bool:
        """Return True if it held in a stable state and does not hold any more, while its goal runs."""
        return kept and state[self._plant, None] == "executing" and not holds(self._condition, state)


class GoalsOfSystem:
    """Account of the goals of one system.

    Args:
        model: The model.
        strategy: Its strategy.
        requests: Events of requests, by number.
        domains: All values of each place of the state.
    """

    def __init__(
        self, model: Model, strategy: Strategy, requests: Sequence[str], domains: dict[Place, Sequence[Value]]
    ) -> None:
        self._kept: dict[str, _Kept] = {}
        # Requirements of actions, each with the cancel that its fall brings about and its name in the memory.
        self._held: list[tuple[str, str, _Held]] = []
        for communication in model.communications:
            if communication.kind is CommunicationKind.ACTION:
                for number, item in enumerate(model.requirements_on(communication.name), start=1):
                    held = _Held(f"action {communication.name}", function_of(item.condition))
                    name = f"requirement {number} of {communication.name} was met"
                    self._held.append((f"{communication.name}.cancel", name, held))
                    self._kept[name] = held
        self._assumptions: list[_Item] = []
        for number, assumption in enumerate(model.assumptions, start=1):
            owed = _Item(assumption, f"assumption {number}")
            self._kept[owed.name] = owed
            self._assumptions.append(owed)
        self._goals = [_Item(goal, f"goal {number}") for number, goal in enumerate(model.goals, start=1)]
        self._kept |= {item.name: item for item in self._goals}
        places: dict[Place, Sequence[Value]] = dict(domains)
        places.update({(_MEMORY, name): (False, True) for name in self._kept})
        self._modes = [
            [(requests.index(item.event), diagram_function(item.condition, places)) for item in mode]
            for mode in strategy.modes
        ]
        self.restart()

    def restart(self) -> None:
        """Forget everything."""
        self._memory = dict.fromkeys(self._kept, False)
        self._mode = 0

    def observe(self, state: State) -> None:
        """Take in a stable state."""
        self._memory = {name: kept.after(self._memory[name], state) for name, kept in self._kept.items()}

    def due_cancels(self, state: State) -> Iterator[str]:
        """Yield the cancels that an executor would issue by itself now, if they are allowed."""
        for event, name, held in self._held:
            if held.has_fallen(self._memory[name], state):
                yield event

    def are_met(self, state: State) -> tuple[bool, ...]:
        """Return for each goal, then each assumption, True if it is met in a stable state that was taken in."""
        owed = (item.is_true(self._memory[item.name], state) for item in self._assumptions)
        return (*self.are_true(state), *owed)

    @property
    def mode(self) -> int:
        """Number of the goal whose turn it is."""
        return self._mode

    def are_true(self, state: State) -> tuple[bool, ...]:
        """Return for each goal True if it counts as come true in a stable state that was taken in."""
        return tuple(goal.is_true(self._memory[goal.name], state) for goal in self._goals)

    def choose(self, state: State) -> int | None:
        """Return the number of the request that the strategy chooses in a stable state, None to wait."""
        for _ in self._goals:
            goal = self._goals[self._mode]
            if not goal.is_true(self._memory[goal.name], state):
                break
            self._mode = (self._mode + 1) % len(self._goals)
        else:
            return None
        whole: dict[Place, Value] = dict(state)
        whole.update({(_MEMORY, name): value for name, value in self._memory.items()})
        return next((request for request, condition in self._modes[self._mode] if condition(whole)), None)

    def snapshot(self) -> tuple[dict[str, bool], int]:
        """Return what is kept, as a value to come back to."""
        return self._memory, self._mode

    def restore(self, snapshot: tuple[dict[str, bool], int]) -> None:
        """Back to what `snapshot` has returned."""
        self._memory, self._mode = snapshot
