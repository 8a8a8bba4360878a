"""The maximally permissive supervisor on packed states, for the comparison with a given supervisor.

It is the same fixed point as in `explicit_synthesis`, for about ten times as many states; tests compare the two.
"""

from array import array

import msgspec

from robosc.automata.semantics import TooManyChoicesError
from robosc.verification.packing import EventTable, Packing
from robosc.verification.search import Effort


class Allowed(msgspec.Struct, frozen=True):
    """States and steps that a supervisor can allow.

    Attributes:
        numbers: The number of each state that plants and conditions can reach without going on from bad ones.
        events: The table number of each step's event.
        steps: Index where each state's steps begin, and where the last one's end.
        targets: The states that steps lead to, one step's after another's.
        offsets: Index where each step's targets begin, and where the last one's end.
        good: True for each state where a supervisor can keep the system safe and nonblocking.
    """

    numbers: dict[int, int]
    events: "array[int]"
    steps: "array[int]"
    targets: "array[int]"
    offsets: "array[int]"
    good: bytearray

    def allows(self, code: int, event: int) -> bool:
        """Return True if a controllable event (the number of its table) may happen in a state."""
        number = self.numbers.get(code)
        if number is None or not self.good[number]:
            return False
        for step in range(self.steps[number], self.steps[number + 1]):
            if self.events[step] == event:
                return self.stays(step)
        return False

    def stays(self, step: int) -> bool:
        """Return True if a step leads to good states only."""
        return all(self.good[target] for target in self.targets[self.offsets[step] : self.offsets[step + 1]])


def allowed(packing: Packing, tables: list[EventTable], effort: Effort) -> Allowed | None:
    """Return all that the maximally permissive supervisor allows, or None for more states than the effort allows.

    Raises:
        SynthesisCancelled: The work is to end.
    """
    codes = list(dict.fromkeys(packing.initial()))
    numbers = {code: number for number, code in enumerate(codes)}
    found = Allowed(numbers, array("I"), array("L", [0]), array("I"), array("L", [0]), bytearray())
    packing.wide_steps = 0
    try:
        if not _explore(found, codes, packing, tables, effort):
            return None
    except TooManyChoicesError:
        return None
    is_marked = packing.marking()
    marked = [number for number, code in enumerate(codes) if found.good[number] and is_marked(code)]
    controllable = [table.event.is_controllable for table in tables]
    while True:
        effort.check(0)
        left = found.good.count(1)
        _keep_nonblocking(found, controllable, marked)
        _keep_controllable(found, controllable)
        if found.good.count(1) == left:
            return found


def _explore(found: Allowed, codes: list[int], packing: Packing, tables: list[EventTable], effort: Effort) -> bool:
    """Fill in the steps of every state, and which states are not bad; False if there are too many."""
    broken = packing.broken_invariants()
    numbers, targets = found.numbers, found.targets
    uncontrollable = [table for table in tables if not table.event.is_controllable]
    for number, code in enumerate(codes):
        effort.check(number)
        for table in uncontrollable:
            table.changes(code)
        is_bad = any(test(code) for test in broken) or any(table.is_bad(code) for table in uncontrollable)
        found.good.append(not is_bad)
        for place, table in enumerate(tables if not is_bad else ()):
            changes = table.changes(code)
            if changes:
                # The loop stands in `search`, too, which keeps causes beside: a call for each transition would take
                # most of the time.
                for change in changes:
                    target = code ^ change
                    reached = numbers.get(target)
                    if reached is None:
                        reached = numbers[target] = len(codes)
                        codes.append(target)
                    targets.append(reached)
                found.events.append(place)
                found.offsets.append(len(targets))
        found.steps.append(len(found.events))
        if effort.is_exceeded(len(codes), len(targets), packing):
            return False
    return True


def _keep_nonblocking(found: Allowed, controllable: list[bool], marked: list[int]) -> None:
    """Take away what cannot reach a marked state through good ones."""
    good, targets = found.good, found.targets
    predecessors: dict[int, list[int]] = {}
    for number, is_good in enumerate(good):
        if not is_good:
            continue
        for step in range(found.steps[number], found.steps[number + 1]):
            # A supervisor allows a controllable event as a whole or not at all.
            if not controllable[found.events[step]] or found.stays(step):
                for target in targets[found.offsets[step] : found.offsets[step + 1]]:
                    predecessors.setdefault(target, []).append(number)
    reaches = bytearray(len(good))
    frontier = [number for number in marked if good[number]]
    for number in frontier:
        reaches[number] = True
    while frontier:
        for number in predecessors.get(frontier.pop(), ()):
            if not reaches[number]:
                reaches[number] = True
                frontier.append(number)
    good[:] = reaches


def _keep_controllable(found: Allowed, controllable: list[bool]) -> None:
    """Take away what an uncontrollable event leads out of the good states, until none does."""
    sources: dict[int, list[int]] = {}
    waiting = []
    for number, is_good in enumerate(found.good):
        if not is_good:
            continue
        for step in range(found.steps[number], found.steps[number + 1]):
            if not controllable[found.events[step]]:
                for target in found.targets[found.offsets[step] : found.offsets[step + 1]]:
                    if not found.good[target]:
                        waiting.append(number)
                    else:
                        sources.setdefault(target, []).append(number)
    while waiting:
        number = waiting.pop()
        if found.good[number]:
            found.good[number] = False
            waiting.extend(sources.get(number, ()))
