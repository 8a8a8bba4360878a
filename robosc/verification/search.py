"""Forward search of the controlled system, state by state, in little memory: states are packed, steps are numbers."""

from array import array
from collections.abc import Callable

import msgspec

from robosc.automata.controlled import TRANSITIONS_PER_STATE, Added
from robosc.automata.semantics import TooManyChoicesError
from robosc.errors import SynthesisCancelled
from robosc.verification.packing import CodeTest, EventTable, Packing

STOP_INTERVAL = 256
"""States handled between two questions whether to stop."""

PROGRESS_INTERVAL = 8192
"""States handled between two reports of progress."""

WIDE_STEPS = 100_000
"""Steps beyond `ORDINARY_STEPS` that may be worked out, or half as many as allowed states if these are more.

One wide integer that is received makes tens of thousands of them at a time, and states in which it makes them again.
"""


class Effort:
    """Bound of a search, which also reports progress.

    Args:
        limit: Number of states, and of `TRANSITIONS_PER_STATE` transitions, beyond which to give up.
        should_stop: Function called now and then; once it returns true, the work ends.
        on_progress: Function called now and then with the progress of the work, in one short line.
        what: Name of what is counted, for that line.
    """

    def __init__(
        self, limit: int, should_stop: Callable[[], bool], on_progress: Callable[[str], None], what: str
    ) -> None:
        self.limit = limit
        self._should_stop = should_stop
        self._on_progress = on_progress
        self._what = what

    def check(self, handled: int) -> None:
        """Ask whether to stop, and report progress.

        Raises:
            SynthesisCancelled: The work is to end.
        """
        if handled % STOP_INTERVAL == 0 and self._should_stop():
            raise SynthesisCancelled(f"the search of {self._what} was stopped")
        if handled % PROGRESS_INTERVAL == 0 and handled:
            self._on_progress(f"{handled} {self._what}")

    def is_exceeded(self, states: int, transitions: int, packing: Packing) -> bool:
        """Return True if there is too much to go on."""
        return (
            states > self.limit
            or transitions > TRANSITIONS_PER_STATE * self.limit
            or packing.wide_steps > max(WIDE_STEPS, self.limit // 2)
        )


class Reached(msgspec.Struct, frozen=True):
    """The controlled system; a state's number is its place in `codes`.

    Attributes:
        packing: Packing of the states.
        tables: Effect of each event, by name.
        codes: Reachable states, breadth-first, the initial ones first.
        parents: For each state the number of the state it was found from; an initial one's is itself.
        causes: For each state the number of the table of the event it was found by.
        targets: The steps of all states, one state's after another's.
        offsets: Index where each state's steps begin, and where the last one's end.
    """

    packing: Packing
    tables: list[EventTable]
    codes: list[int]
    parents: "array[int]"
    causes: "array[int]"
    targets: "array[int]"
    offsets: "array[int]"

    def trace(self, number: int) -> tuple[str, ...]:
        """Events of a shortest run from an initial state."""
        events: list[str] = []
        while self.parents[number] != number:
            events.append(self.tables[self.causes[number]].event.name)
            number = self.parents[number]
        return tuple(reversed(events))


def _begins_anywhere(code: int) -> bool:
    """The supervisor lets the system begin wherever it likes."""
    return True


def search(packing: Packing, added: Added, effort: Effort, begins: CodeTest = _begins_anywhere) -> Reached | None:
    """Every state of the controlled system, or None if there are more than the effort allows.

    It begins in the initial states in which the supervisor lets it begin.

    A controllable event happens where the plants, the ranges, its event conditions and its added condition
    allow it; an uncontrollable one where the plants do and what is added to it, if anything, holds.

    Raises:
        SynthesisCancelled: The work is to end.
    """
    tables = packing.tables(sorted(packing.system.events, key=lambda event: event.name), added)
    try:
        codes = [code for code in dict.fromkeys(packing.initial()) if begins(code)]
    except TooManyChoicesError:
        return None
    numbers = {code: number for number, code in enumerate(codes)}
    found = Reached(
        packing, tables, codes, array("I", range(len(codes))), array("I", [0] * len(codes)), array("I"), array("L", [0])
    )
    try:
        return found if _spread(found, numbers, effort) else None
    except TooManyChoicesError:
        return None


def _spread(found: Reached, numbers: dict[int, int], effort: Effort) -> bool:
    """Go on from every state that is found; False if there are too many."""
    tables, codes, parents, causes = found.tables, found.codes, found.parents, found.causes
    targets, offsets = found.targets, found.offsets
    rows = [(place, t.field, t.known.get, t.work_out, t.condition) for place, t in enumerate(tables)]
    # The list grows while it is gone through.
    for number, code in enumerate(codes):
        effort.check(number)
        for place, field, look, work_out, condition in rows:
            changes = look(code & field)
            if changes is None:
                changes = work_out(code)
            if changes and (condition is None or condition(code)):
                for change in changes:
                    target = code ^ change
                    reached = numbers.get(target)
                    if reached is None:
                        reached = numbers[target] = len(codes)
                        codes.append(target)
                        parents.append(number)
                        causes.append(place)
                    targets.append(reached)
        offsets.append(len(targets))
        if effort.is_exceeded(len(codes), len(targets), found.packing):
            return False
    return True


def blocking_state(found: Reached) -> int | None:
    """The first state from which no marked one can be reached, or None if there is none."""
    is_marked = found.packing.marking()
    targets, offsets = found.targets, found.offsets
    reaches = bytearray(is_marked(code) for code in found.codes)
    # States are visited from the last one found to the first: one sweep mostly marks nearly all that reach a marked
    # state, without a list of predecessors.
    for number in range(len(reaches) - 1, -1, -1):
        if not reaches[number] and any(reaches[target] for target in targets[offsets[number] : offsets[number + 1]]):
            reaches[number] = True
    rest = [number for number, known in enumerate(reaches) if not known]
    predecessors: dict[int, list[int]] = {number: [] for number in rest}
    frontier = []
    for number in rest:
        for target in targets[offsets[number] : offsets[number + 1]]:
            if reaches[target]:
                frontier.append(number)
                break
            predecessors[target].append(number)
    for number in frontier:
        reaches[number] = True
    while frontier:
        for number in predecessors[frontier.pop()]:
            if not reaches[number]:
                reaches[number] = True
                frontier.append(number)
    return next((number for number in rest if not reaches[number]), None)
