"""States as whole numbers, and remembered effects of events on them, for the explicit search.

Each place of a state has a field of bits with the index of its value. The effect of an event depends on few places, so
the explicit semantics computes it once for each combination of their values. After that, one mask and one look-up find
it.
"""

from collections.abc import Callable, Iterable
from dataclasses import replace

from robosc.automata.compile import State, subjects_read
from robosc.automata.controlled import Added
from robosc.automata.decision import Decision, index_in
from robosc.automata.semantics import Semantics, subjects_changed, subjects_deciding
from robosc.automata.state import Subject, subject_domain, subjects
from robosc.automata.structure import Event, System

REMEMBERED = 200_000
"""Values of what an event depends on that are remembered at a time."""

ORDINARY_STEPS = 100
"""Steps of one event in one state that are exempt from the counter."""

CodeTest = Callable[[int], bool]
"""A predicate over packed states."""


class Packing:
    """Position of the field of each place of a state.

    Args:
        semantics: The uncontrolled system.

    Attributes:
        semantics: The uncontrolled system.
        places: Place of each subject.
        wide_steps: Number of steps that were worked out so far beyond `ORDINARY_STEPS` of an event in one state.
    """

    def __init__(self, semantics: Semantics) -> None:
        self.semantics = semantics
        system = semantics.system
        order = subjects(system)
        self.places = {subject: place for place, subject in enumerate(order)}
        self._domains = [subject_domain(system, subject) for subject in order]
        self.shifts: list[int] = []
        self.masks: list[int] = []
        width = 0
        for domain in self._domains:
            bits = (len(domain) - 1).bit_length()
            self.shifts.append(width)
            self.masks.append((1 << bits) - 1)
            width += bits
        self.wide_steps = 0
        self._indices = [index_in(domain) for domain in self._domains]

    @property
    def system(self) -> System:
        """The system."""
        return self.semantics.system

    def initial(self) -> tuple[int, ...]:
        """The initial states."""
        return tuple(map(self.encode, self.semantics.initial_states))

    def encode(self, state: State) -> int:
        """The number of a state."""
        return self.part(state, range(len(state)))

    def decode(self, code: int) -> State:
        """The state of a number."""
        return tuple(
            domain[(code >> shift) & mask]
            for domain, shift, mask in zip(self._domains, self.shifts, self.masks, strict=True)
        )

    def field(self, places: Iterable[int]) -> int:
        """The bits of some places."""
        return sum(self.masks[place] << self.shifts[place] for place in set(places))

    def part(self, state: State, places: Iterable[int]) -> int:
        """The number of a state with nothing but some places."""
        return sum(self._indices[place](state[place]) << self.shifts[place] for place in places)

    def marking(self) -> CodeTest:
        """Return a test for whether a state is marked."""
        deciding = {
            self.places[Subject(item.name)] for item in self.system.automata if item.marked != {*item.locations}
        }
        deciding |= {self.places[subject] for subject in subjects_read(self.system.marker)}
        return remembering(self.field(deciding), lambda code: self.semantics.is_marked(self.decode(code)))

    def broken_invariants(self) -> list[CodeTest]:
        """For each invariant whether it does not hold."""
        return [
            self._broken(Semantics(replace(self.system, events=(), invariants=(invariant,))), subjects_read(invariant))
            for invariant in self.system.invariants
        ]

    def _broken(self, semantics: Semantics, read: Iterable[Subject]) -> CodeTest:
        return remembering(
            self.field(self.places[subject] for subject in read), lambda code: semantics.bad(self.decode(code))
        )

    def condition(self, added: Callable[[State], bool]) -> CodeTest:
        """An added condition over packed states."""
        if not isinstance(added, Decision):
            return lambda code: added(self.decode(code))
        shifts = [self.shifts[node.place] for node in added.nodes]
        masks = [self.masks[node.place] for node in added.nodes]

        def holds(code: int) -> bool:
            number = added.root
            while number > 1:
                number -= 2
                number = added.nodes[number].child((code >> shifts[number]) & masks[number])
            return number == 1

        return remembering(self.field(added.places()), holds)

    def tables(self, events: Iterable[Event], added: Added) -> list["EventTable"]:
        """Return the tables of the effects of some events."""
        return [EventTable(self, event, added.get(event.name)) for event in events]


def remembering(field: int, holds: CodeTest) -> CodeTest:
    """A predicate that looks at some bits only, found again where it is known."""
    known: dict[int, bool] = {}

    def look(code: int) -> bool:
        key = code & field
        found = known.get(key)
        if found is None:
            if len(known) >= REMEMBERED:
                known.clear()
            found = known[key] = holds(code)
        return found

    return look


class EventTable:
    """Effect of one event in packed states.

    Attributes:
        event: The event.
        field: The bits that decide what the event does, and those that it changes.
        known: For the values of these bits met so far, what each possible step changes: bits to turn over. Nothing
            where the plants, the ranges or, for a controllable event, its conditions do not let it happen.
        bad: The values with which the event makes a state bad.
        condition: Condition that the supervisor adds, or None.
    """

    def __init__(self, packing: Packing, event: Event, added: Callable[[State], bool] | None) -> None:
        self.event = event
        self._packing = packing
        self._semantics = self._fresh()
        touched = subjects_deciding(packing.system, event.name) | subjects_changed(packing.system, event.name)
        self._places = sorted(packing.places[subject] for subject in touched)
        self.field = packing.field(self._places)
        self.known: dict[int, tuple[int, ...]] = {}
        self.bad: set[int] = set()
        self.condition = None if added is None else packing.condition(added)

    def _fresh(self) -> Semantics:
        """The meaning of this event alone, with nothing remembered."""
        return self._packing.semantics.only(self.event)

    def changes(self, code: int) -> tuple[int, ...]:
        """Return the bits that each possible step in a state changes; see `known`.

        Raises:
            TooManyChoicesError: There are too many steps to go through them.
        """
        key = code & self.field
        found = self.known.get(key)
        return self.work_out(code) if found is None else found

    def work_out(self, code: int) -> tuple[int, ...]:
        """The same for values that are not known yet.

        Raises:
            TooManyChoicesError: There are too many steps to go through them.
        """
        key = code & self.field
        name, state = self.event.name, self._packing.decode(code)
        if self.event.is_controllable and not self._semantics.condition(state, name):
            changes: list[int] = []
        else:
            if not self.event.is_controllable and self._semantics.bad(state):
                self.bad.add(key)
            targets = self._semantics.targets(state, name)
            changes = sorted(key ^ self._packing.part(target, self._places) for target in targets)
        if len(self.known) >= REMEMBERED:
            self.known.clear()
            self._semantics = self._fresh()
        self._packing.wide_steps += max(0, len(changes) - ORDINARY_STEPS)
        result = self.known[key] = tuple(changes)
        return result

    def enabled(self, code: int) -> bool:
        """Return True if the plants enable the event; a controllable one must also stay in every range."""
        return self._semantics.enabled(self._packing.decode(code), self.event.name)

    def is_bad(self, code: int) -> bool:
        """Return True if the event makes a state bad whose changes were computed."""
        return code & self.field in self.bad
