"""Goals, missions and assumptions, as an executor keeps account of them, and the strategy that reaches them."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from robosc.execution.interpreter.functions import Function, Place, State, diagram_function, function_of, holds
from robosc.execution.interpreter.missions import MissionOfSystem, MissionPlace
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


class _Watched:
    """An action with requirements: which of them held since its request, and whether its cancel was asked for.

    Args:
        name: Name of the action.
        conditions: Its requirements.

    Attributes:
        names: Names by which strategies know what is kept of its requirements.
        asked: Name by which they know that its cancel was asked for.
    """

    def __init__(self, name: str, conditions: Sequence[Function]) -> None:
        self._plant = f"action {name}"
        self._conditions = conditions
        self.names = [f"requirement {number} of {name} was met" for number, _ in enumerate(conditions, start=1)]
        self.asked = f"the cancel of {name} was asked for"

    def after(self, kept: Mapping[str, bool], state: State) -> dict[str, bool]:
        """Return what is kept after a stable state."""
        is_running = state[self._plant, None] == "executing"
        holding = [holds(condition, state) for condition in self._conditions]
        pairs = list(zip((kept[name] for name in self.names), holding, strict=True))
        is_asked = kept[self.asked] or any(held and not now for held, now in pairs)
        goes_on = is_running and not is_asked
        after = {name: goes_on and (held or now) for name, (held, now) in zip(self.names, pairs, strict=True)}
        return {**after, self.asked: is_running and is_asked}


@dataclass(frozen=True, slots=True)
class Account:
    """All that is remembered.

    Attributes:
        kept: Truth values, by name.
        missions: For each mission, where it is.
        mode: Number of the goal or visit that is approached.
    """

    kept: Mapping[str, bool]
    missions: tuple[MissionPlace, ...]
    mode: int


class GoalsOfSystem:
    """Account of the goals and missions of one system.

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
        actions = (item.name for item in model.communications if item.kind is CommunicationKind.ACTION)
        requirements = ((name, model.requirements_on(name)) for name in actions)
        self._watched = [
            _Watched(name, [function_of(item.condition) for item in items]) for name, items in requirements if items
        ]
        self._assumptions: list[_Item] = []
        for number, assumption in enumerate(model.assumptions, start=1):
            owed = _Item(assumption, f"assumption {number}")
            self._kept[owed.name] = owed
            self._assumptions.append(owed)
        self._goals = [_Item(goal, f"goal {number}") for number, goal in enumerate(model.goals, start=1)]
        self._kept |= {item.name: item for item in self._goals}
        self._missions = [MissionOfSystem(mission) for mission in model.missions]
        places: dict[Place, Sequence[Value]] = dict(domains)
        watched = (name for item in self._watched for name in (*item.names, item.asked))
        self._names = (*watched, *self._kept)
        names = [*self._names, *(name for mission in self._missions for name in mission.names)]
        places.update({(_MEMORY, name): (False, True) for name in names})
        self._modes = [
            [(requests.index(item.event), diagram_function(item.condition, places)) for item in mode]
            for mode in strategy.modes
        ]
        self.restart()

    def restart(self) -> None:
        """Forget everything."""
        missions = tuple(mission.start for mission in self._missions)
        self._account = Account(dict.fromkeys(self._names, False), missions, 0)

    def observe(self, state: State) -> None:
        """Take in a stable state."""
        before = self._account
        kept: dict[str, bool] = {}
        for watched in self._watched:
            kept |= watched.after(before.kept, state)
        kept |= {name: item.after(before.kept[name], state) for name, item in self._kept.items()}
        places = zip(self._missions, before.missions, strict=True)
        self._account = Account(kept, tuple(item.after(place, state) for item, place in places), before.mode)

    def are_met(self, state: State) -> tuple[bool, ...]:
        """Return for each goal, visit and assumption True if it is met in a stable state that was taken in."""
        owed = (item.is_true(self._account.kept[item.name], state) for item in self._assumptions)
        return (*self._is_nothing_wanted(state), *owed)

    def where_missions_are(self) -> tuple[bool, ...]:
        """Return for each visit if its mission or detour is at it, then for each mission if every visit is true."""
        places = self._account.missions
        pairs = zip(self._missions, places, strict=True)
        visits = (is_here for mission, place in pairs for is_here in mission.here(place))
        return (*visits, *(place.is_round for place in places))

    @property
    def mode(self) -> int:
        """Number of the goal or visit whose turn it is."""
        return self._account.mode

    def are_true(self, state: State) -> tuple[bool, ...]:
        """Return for each goal True if it counts as come true in a stable state that was taken in."""
        return tuple(goal.is_true(self._account.kept[goal.name], state) for goal in self._goals)

    def missions(self) -> tuple[MissionPlace, ...]:
        """Return for each mission where it is since the last stable state that was taken in."""
        return self._account.missions

    def _is_nothing_wanted(self, state: State) -> Iterator[bool]:
        """Yield for each goal and each visit True if nothing is to be done for it in a state that was taken in."""
        yield from self.are_true(state)
        for mission, place in zip(self._missions, self._account.missions, strict=True):
            yield from (not is_wanted for is_wanted in mission.wanted(place, state))

    def choose(self, state: State) -> int | None:
        """Return the number of the request that the strategy chooses in a stable state, None to wait."""
        account, done = self._account, tuple(self._is_nothing_wanted(state))
        mode = next((mode for mode in (*range(account.mode, len(done)), *range(account.mode)) if not done[mode]), None)
        if mode is None:
            return None
        self._account = Account(account.kept, account.missions, mode)
        whole: dict[Place, Value] = dict(state)
        whole.update({(_MEMORY, name): value for name, value in account.kept.items()})
        for mission, place in zip(self._missions, account.missions, strict=True):
            whole.update({(_MEMORY, name): value for name, value in mission.remembered(place).items()})
        return next((request for request, condition in self._modes[mode] if condition(whole)), None)

    def remembered(self) -> tuple[int, tuple[bool, ...], tuple[MissionPlace, ...]]:
        """Return what is remembered, as a hashable value."""
        account = self._account
        return account.mode, tuple(account.kept.values()), account.missions

    def recall(self, remembered: tuple[int, tuple[bool, ...], tuple[MissionPlace, ...]]) -> None:
        """Remember what `remembered` has returned."""
        mode, kept, missions = remembered
        self._account = Account(dict(zip(self._names, kept, strict=True)), missions, mode)

    def snapshot(self) -> Account:
        """Return what is kept, as a value to come back to."""
        return self._account

    def restore(self, snapshot: Account) -> None:
        """Back to what `snapshot` has returned."""
        self._account = snapshot
