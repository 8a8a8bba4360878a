"""The obvious twin of the memory of missions: it goes on step by step, as a person would with a finger on the text."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from robosc.expressions import Expression
from robosc.model.structure import Mission

Test = Callable[[Any], bool]

Mark = tuple[int, ...]
"""Number of the visit that a mission is at, from 1 on; then for each detour that of its own, 0 while it is idle."""


@dataclass(frozen=True)
class MissionTwin:
    """A mission over explicit states.

    Attributes:
        name: Its name.
        asked: Condition behind `while`.
        visits: Conditions of its visits.
        detours: For each detour its trigger and the conditions of its visits.
        has_while: True if there is a condition behind `while`.
    """

    name: str
    asked: Test
    visits: Sequence[Test]
    detours: Sequence[tuple[Test, Sequence[Test]]]
    has_while: bool = False

    @property
    def start(self) -> Mark:
        """Its mark before the first stable state."""
        return (1, *(0 for _ in self.detours))

    def after(self, mark: Mark, state: Any) -> Mark:
        """Return where it is after a stable state."""
        if not self.asked(state):
            return self.start
        at = mark[0]
        for _ in self.visits:
            if not self.visits[at - 1](state):
                break
            at = at + 1 if at < len(self.visits) else 1
        return (at, *(self._detour(*item, state) for item in zip(mark[1:], self.detours, strict=True)))

    def _detour(self, at: int, detour: tuple[Test, Sequence[Test]], state: Any) -> int:
        trigger, visits = detour
        passed = set[int]()
        while True:
            if at == 0:
                if not trigger(state) or len(passed) == len(visits):
                    return 0
                at = 1
            elif visits[at - 1](state):
                passed.add(at)
                at = at + 1 if at < len(visits) else 0
            else:
                return at

    def made(self, mark: Mark, state: Any) -> set[str]:
        """Return the names of the visits that are made in a stable state, before which it was at a mark."""
        found = set[str]()
        at = mark[0]
        for _ in self.visits if self.asked(state) else ():
            if not self.visits[at - 1](state):
                break
            found.add(f"visit {at} of mission {self.name}")
            at = at + 1 if at < len(self.visits) else 1
        for order, (detour, (trigger, visits)) in enumerate(zip(mark[1:], self.detours, strict=True), start=1):
            at, passed = detour or 1, set[int]()
            while self.asked(state) and at not in passed and visits[at - 1](state):
                # An idle detour begins, and one that ends begins again, where it is wanted.
                if ((detour == 0 and not passed) or (at == 1 and passed)) and not trigger(state):
                    break
                passed.add(at)
                at = at + 1 if at < len(visits) else 1
            found |= {f"visit {item} of detour {order} of mission {self.name}" for item in passed}
        return found

    def aims(self) -> Iterator[tuple[str, Callable[[Mark, Any], bool]]]:
        """Yield for each visit, then for those of each detour, its name and whether nothing is to be done for it."""
        for number in range(1, len(self.visits) + 1):
            yield f"visit {number} of mission {self.name}", partial(self._is_own_done, number)
        for order, (_, visits) in enumerate(self.detours, start=1):
            for number in range(1, len(visits) + 1):
                name = f"visit {number} of detour {order} of mission {self.name}"
                yield name, partial(self._is_detour_done, order, number)

    def interruptions(self) -> Iterator[Callable[[Mark, Any], bool] | None]:
        """Yield for each visit, then for those of each detour, whether it is not asked for; None: it always is."""
        own = (lambda mark, state: not self.asked(state) or any(mark[1:])) if self.has_while or self.detours else None
        yield from [own] * len(self.visits)
        of_detour = (lambda mark, state: not self.asked(state)) if self.has_while else None
        for _, visits in self.detours:
            yield from [of_detour] * len(visits)

    def causes(self) -> Iterator[Callable[[Any], bool]]:
        """Yield what its own visits wait for once it is true: that it is not asked for, and what begins its detours."""
        yield lambda state: not self.asked(state)
        yield from (trigger for trigger, _ in self.detours)

    def _is_own_done(self, number: int, mark: Mark, state: Any) -> bool:
        return not self.asked(state) or mark[0] != number or self.visits[number - 1](state) or any(mark[1:])

    @staticmethod
    def _is_detour_done(order: int, number: int, mark: Mark, state: Any) -> bool:
        return mark[order] != number

    def memory(self, mark: Mark) -> dict[str, bool]:
        """Return where it is in the words of the memory."""
        found = {
            f"mission {self.name} is at visit {number}": mark[0] == number for number in range(2, len(self.visits) + 1)
        }
        for order, (_, visits) in enumerate(self.detours, start=1):
            for number in range(1, len(visits) + 1):
                found[f"detour {order} of mission {self.name} is at visit {number}"] = mark[order] == number
        return found


def mission_twin(mission: Mission, test: Callable[[Expression], Test]) -> MissionTwin:
    """Return the twin of a mission.

    Args:
        mission: The mission.
        test: Function that makes a condition a function of states, false where the condition is unknown.
    """
    return MissionTwin(
        mission.name,
        (lambda state: True) if mission.condition is None else test(mission.condition),
        [test(item) for item in mission.visits],
        [(test(item.trigger), [test(visit) for visit in item.visits]) for item in mission.detours],
        mission.condition is not None,
    )
