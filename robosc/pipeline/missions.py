"""Progress of missions in a run, in the model's words."""

from collections.abc import Iterator
from dataclasses import dataclass

from robosc.conditions.rendering import in_words
from robosc.execution.interpreter.missions import MissionPlace
from robosc.model.structure import Mission


@dataclass(frozen=True, slots=True)
class DetourProgress:
    """Detour that is under way.

    Attributes:
        number: Number of the detour in its mission, from 1 on.
        visit: Number of its visit that it is at, from 1 on.
        condition: Condition of that visit, as a user writes it.
    """

    number: int
    visit: int
    condition: str

    def __str__(self) -> str:
        return f"detour {self.number} under way, at visit {self.visit}, {self.condition}"


@dataclass(frozen=True, slots=True)
class MissionProgress:
    """Progress of a mission.

    Attributes:
        name: Name of the mission.
        is_asked: True if it is asked for: its condition behind `while` is true, or it has none.
        visit: Number of the visit that it is at, from 1 on.
        condition: Condition of that visit, as a user writes it.
        is_round: True if every visit is true now, so that none is left to be made.
        detours: Detours that are under way; meanwhile the mission's own visits wait.
    """

    name: str
    is_asked: bool
    visit: int
    condition: str
    is_round: bool
    detours: tuple[DetourProgress, ...]

    def __str__(self) -> str:
        return f"{self.name}: {self.words}"

    @property
    def words(self) -> str:
        """Progress in words, without the name of the mission."""
        if not self.is_asked:
            return "not asked for"
        own = "every visit is true" if self.is_round else f"at visit {self.visit}, {self.condition}"
        return "; ".join([own, *map(str, self.detours)])


def progress(mission: Mission, place: MissionPlace) -> MissionProgress:
    """Return the progress of a mission in words.

    Args:
        mission: The mission.
        place: Its progress, as the interpreter keeps account of it.
    """
    detours = enumerate(zip(mission.detours, place.detours, strict=True), start=1)
    return MissionProgress(
        mission.name,
        place.is_asked,
        place.visit + 1,
        in_words(mission.visits[place.visit], ()),
        place.is_round,
        tuple(
            DetourProgress(number, visit + 1, in_words(detour.visits[visit], ()))
            for number, (detour, visit) in detours
            if visit is not None
        ),
    )


def visits_made(mission: Mission, before: MissionPlace, after: MissionPlace) -> Iterator[str]:
    """Yield the names of the visits that are made from one stable state to the next.

    Args:
        mission: The mission.
        before: Its progress at the first one.
        after: Its progress at the next one.
    """
    if not after.is_asked:
        return
    name, count = f"mission {mission.name}", len(mission.visits)
    # All visits were made at once where every one was true already.
    if not before.is_round:
        made = count if after.is_round else (after.visit - before.visit) % count
        for number in range(before.visit, before.visit + made):
            yield f"visit {number % count + 1} of {name}"
    for order, (detour, was, now) in enumerate(zip(mission.detours, before.detours, after.detours, strict=True), 1):
        first, last = was or 0, len(detour.visits) if now is None else now
        if was is None and now is None:
            continue
        # A detour that is before where it was has ended, and has begun again.
        numbers = range(first, last) if last >= first else (*range(first, len(detour.visits)), *range(last))
        yield from (f"visit {number + 1} of detour {order} of {name}" for number in numbers)
