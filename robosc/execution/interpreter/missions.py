"""Missions, as an executor keeps account of them: plain numbers, which strategies know by names."""

from collections.abc import Sequence
from dataclasses import dataclass

from robosc.execution.interpreter.functions import Function, State, function_of, holds
from robosc.model.structure import Mission


@dataclass(frozen=True, slots=True)
class MissionPlace:
    """Progress of a mission.

    Attributes:
        visit: Number of the visit that it is at, from 0 on.
        detours: For each detour the number of its visit that it is at, from 0 on; None where it is idle.
        is_asked: True if what is behind `while` held in the last stable state.
        is_round: True if every visit was true there, so that nothing of its own is left to do.
    """

    visit: int
    detours: tuple[int | None, ...]
    is_asked: bool = False
    is_round: bool = False


class MissionOfSystem:
    """Account of one mission.

    Args:
        mission: As it is written.
    """

    def __init__(self, mission: Mission) -> None:
        self._name = f"mission {mission.name}"
        self._asked = None if mission.condition is None else function_of(mission.condition)
        self._visits = [function_of(item) for item in mission.visits]
        self._detours = [
            (function_of(item.trigger), [function_of(visit) for visit in item.visits]) for item in mission.detours
        ]
        self.start = MissionPlace(0, (None,) * len(self._detours))
        """Progress before the first stable state."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names by which strategies know the progress."""
        return tuple(self.remembered(self.start))

    def remembered(self, place: MissionPlace) -> dict[str, bool]:
        """Return progress in the words of strategies."""
        found = {f"{self._name} is at visit {item + 1}": item == place.visit for item in range(1, len(self._visits))}
        for number, ((_, visits), current) in enumerate(zip(self._detours, place.detours, strict=True), start=1):
            for item in range(len(visits)):
                found[f"detour {number} of {self._name} is at visit {item + 1}"] = item == current
        return found

    def after(self, place: MissionPlace, state: State) -> MissionPlace:
        """Return the progress after a stable state."""
        if self._asked is not None and not holds(self._asked, state):
            return self.start
        visits = len(self._visits)
        visit, left = place.visit, visits
        while left and holds(self._visits[visit], state):
            visit, left = (visit + 1) % visits, left - 1
        detours = (
            self._after_detour(current, trigger, conditions, state)
            for current, (trigger, conditions) in zip(place.detours, self._detours, strict=True)
        )
        return MissionPlace(visit, tuple(detours), is_asked=True, is_round=left == 0)

    @staticmethod
    def _after_detour(current: int | None, trigger: Function, visits: Sequence[Function], state: State) -> int | None:
        open_visits = [number for number, visit in enumerate(visits) if not holds(visit, state)]
        if current is not None:
            following = [number for number in open_visits if number >= current]
            if following:
                return following[0]
        return open_visits[0] if open_visits and holds(trigger, state) else None

    def wanted(self, place: MissionPlace, state: State) -> list[bool]:
        """Return for each visit, those of detours last, True if it is to be reached in a state that was taken in."""
        here = self.here(place)
        is_own = all(current is None for current in place.detours)
        own = [is_own and is_at and not holds(visit, state) for is_at, visit in zip(here, self._visits, strict=False)]
        return [*own, *here[len(own) :]]

    def here(self, place: MissionPlace) -> list[bool]:
        """Return for each visit, those of detours last, True if the mission or the detour is at it."""
        own = [place.is_asked and number == place.visit for number in range(len(self._visits))]
        detours = zip(self._detours, place.detours, strict=True)
        return [*own, *(number == current for (_, visits), current in detours for number in range(len(visits)))]
