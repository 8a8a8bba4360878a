"""Locations, variables and received data as Boolean variables, and expressions as predicates over them.

A value of a finite domain is encoded by its index, most significant bit first. Each bit has a variable for the current
state. Next to it in the order, it has one for the next state if forward images need it, because some event writes
other values than one constant. Bits of received data are interleaved with those of the first variable, in the order,
that the data is written to: if they were separate, a relation that copies several data would have to represent all of
them at once. Bits of wide integers that are compared or computed with each other are interleaved, those of equal weight
side by side, unless these are long chains: see `blocks`.
"""

from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from functools import cached_property
from typing import Any

import msgspec

from robosc.automata.state import Subject, initial_values, subject_domain, subject_type, subjects
from robosc.automata.structure import InputVariable, System
from robosc.expressions import Expression, IntegerType, PathStep, Type, Value, domain
from robosc.recursion import allow_depth
from robosc.synthesis.blocks import Datum, blocks_of
from robosc.synthesis.changes import computed_subjects
from robosc.synthesis.engines import Manager
from robosc.synthesis.order import Blocks, block_order, input_targets
from robosc.synthesis.result import Order

_FRAMES_PER_LEVEL = 4
"""The plain engine and the walks of `nodes` and `diagrams` go down a level at a time."""


class Bits(msgspec.Struct, frozen=True):
    """The variables that encode one value of a finite domain.

    Attributes:
        names: Current-state variables, most significant first.
        domain: The values, in the order of their indices.
        type: Type of the value, or None for a location.
        known: Variable that is true if the value is known, or None if it always is.
    """

    names: tuple[str, ...]
    domain: Sequence[Value]
    type: Type | None
    known: str | None = None


def next_name(name: str) -> str:
    """The next-state variable of a current-state one."""
    return name + "'"


class Encoding:
    """The Boolean variables of one system in one manager.

    Attributes:
        manager: The manager.
        system: The system.
        subjects: Bits of each place of a state.
        places: The same, in the order of a state's values.
        blocks: The places, topmost first; bits of places in one block stand among each other.
        state_names: Every current-state variable, in the manager's order.
        order: Every variable, in the order in which they were declared.
        order_name: Name of the order of the blocks.
        pause: Called again and again while expressions become predicates: it may end the work with an error.
    """

    def __init__(
        self,
        system: System,
        manager: Manager,
        pause: Callable[[], None] = lambda: None,
        conditions: Iterable[Expression] = (),
        followed: Collection[Subject] = (),
        order: tuple[Order, Blocks] | None = None,
    ) -> None:
        self.system = system
        self.manager = manager
        self.subjects: dict[Subject, Bits] = {}
        found = blocks_of(system)
        self.order_name, self.blocks = order or block_order(system, found.places, conditions)
        for number, subject in enumerate(subject for block in self.blocks for subject in block):
            self.subjects[subject] = self._bits(f"s{number}", subject_domain(system, subject), self._type(subject))
        self.places = tuple(self.subjects[subject] for subject in subjects(system))
        self.inputs = tuple((item, self._input(number, item)) for number, item in enumerate(system.inputs))
        self.pause = pause
        self.order: list[str] = []
        self._choices = 0
        self._valid_states: Any = None
        self._declare(found.data, computed_subjects(system) | set(followed))
        state_names = {name for bits in self.subjects.values() for name in bits.names}
        self.state_names = tuple(name for name in self.order if name in state_names)
        # Twice the bits of a state, for the next one; choices are few.
        levels = 2 * len(self.state_names) + sum(len(_names(bits)) for _, bits in self.inputs)
        allow_depth(levels, _FRAMES_PER_LEVEL)

    def _type(self, subject: Subject) -> Type | None:
        return None if subject.variable is None else subject_type(self.system, subject)

    @staticmethod
    def _bits(prefix: str, values: Sequence[Value], type_: Type | None, known: str | None = None) -> Bits:
        width = (len(values) - 1).bit_length()
        return Bits(tuple(f"{prefix}.{place}" for place in range(width)), values, type_, known)

    def _input(self, number: int, item: InputVariable) -> Bits:
        known = f"i{number}.known" if item.may_be_unknown else None
        return self._bits(f"i{number}", domain(item.type), item.type, known)

    def _declare(self, computed_with: Mapping[Datum, Subject], followed: Collection[Subject]) -> None:
        """Put all variables in order.

        Args:
            computed_with: For some data the first place of the block that they belong to.
            followed: Places that have next-state variables.
        """
        targets = input_targets(self.system)
        beside: defaultdict[Subject | None, list[Bits]] = defaultdict(list)
        block_of = {subject: block for block in self.blocks for subject in block}
        for item, bits in self.inputs:
            written = targets.get((item.event, item.path), set())
            home = computed_with.get((item.event, item.path))
            among = self.subjects if home is None else block_of[home]
            beside[next((subject for subject in among if subject in written), home)].append(bits)
        for block in self.blocks:
            self._add(*_interleaved([(self.subjects[item], item in followed, beside[item]) for item in block]))
        for bits in beside[None]:
            self._add(*_names(bits))

    def _add(self, *names: str) -> None:
        """Put variables below those there are."""
        self.manager.declare(*names)
        self.order += names

    def choice(self, count: int) -> Bits:
        """Fresh variables for a choice among `count` edges."""
        bits = self._bits(f"c{self._choices}", range(count), None)
        self._choices += 1
        self._add(*bits.names)
        return bits

    def inputs_of(self, event: str) -> dict[tuple[PathStep, ...], Bits]:
        """Bits of the data that an event carries, by path."""
        return {item.path: bits for item, bits in self.inputs if item.event == event}

    # Predicates

    def code(self, bits: Bits, index: int) -> Any:
        """Return the predicate that is true where a value has an index."""
        result = self.manager.true
        for place, name in enumerate(reversed(bits.names)):
            variable = self.manager.var(name)
            result = result & (variable if (index >> place) & 1 else ~variable)
        return result

    def equals(self, bits: Bits, value: Value) -> Any:
        """Return the predicate that is true where a value is `value`."""
        return self.code(bits, bits.domain.index(value))

    def in_location(self, automaton: str, location: str) -> Any:
        """Return the predicate that is true where an automaton is in a location."""
        return self.equals(self.subjects[Subject(automaton)], location)

    def state(self, values: Sequence[Value]) -> Any:
        """Return the predicate that is true in one state, given as values in the order of `subjects`."""
        return self.all_of(
            self.equals(self.subjects[subject], value)
            for subject, value in zip(subjects(self.system), values, strict=True)
        )

    def any_of(self, predicates: Iterable[Any]) -> Any:
        """Return the predicate that is true where one of the predicates is true."""
        result = self.manager.false
        for predicate in _lowest_first(predicates):
            result = result | predicate
        return result

    def all_of(self, predicates: Iterable[Any]) -> Any:
        """Return the predicate that is true where all of the predicates are true."""
        result = self.manager.true
        for predicate in _lowest_first(predicates):
            result = result & predicate
        return result

    def valid(self, bits: Bits) -> Any:
        """Return the predicate that is true where the bits encode a value at all."""
        return ~self.at_least(bits, len(bits.domain))

    def at_least(self, bits: Bits, index: int) -> Any:
        """Return the predicate that is true where the code of a value is an index or a larger one."""
        if index >> len(bits.names):
            return self.manager.false
        # From the least significant bit up.
        result = self.manager.true
        for place, name in enumerate(reversed(bits.names)):
            variable = self.manager.var(name)
            if (index >> place) & 1:
                result = self.manager.ite(variable, result, self.manager.false)
            else:
                result = self.manager.ite(variable, self.manager.true, result)
        return result

    @cached_property
    def levels(self) -> tuple[tuple[tuple[int, tuple[int, ...]], ...], ...]:
        """Blocks of places: for each place how many values it can hold, and the levels of its bits."""
        level = {name: level for level, name in enumerate(self.order)}
        places = {
            subject: (len(bits.domain), tuple(level[name] for name in bits.names))
            for subject, bits in self.subjects.items()
        }
        return tuple(tuple(places[subject] for subject in block) for block in self.blocks)

    def blocks_with(self, names: Iterable[str]) -> list[int]:
        """Return the numbers of the blocks in which some current-state variables are, topmost first."""
        return sorted({self._block_of[name] for name in names})

    @cached_property
    def _block_of(self) -> dict[str, int]:
        return {
            name: number
            for number, block in enumerate(self.blocks)
            for subject in block
            for name in self.subjects[subject].names
        }

    def valid_states(self) -> Any:
        """Return the predicate that is true where every place of the state encodes a value."""
        if self._valid_states is None:
            self._valid_states = self.all_of(self.valid(bits) for bits in self.subjects.values())
        return self._valid_states

    def initial_places(self) -> Any:
        """Return the predicate that is true where every location and variable has a value that it may begin with."""
        begin = zip(subjects(self.system), initial_values(self.system), strict=True)
        return self.all_of(self.one_of(self.subjects[subject], values) for subject, values in begin)

    def one_of(self, bits: Bits, values: Sequence[Value]) -> Any:
        """Return the predicate that is true where a value is one of `values`."""
        if len(values) == len(bits.domain):
            return self.valid(bits)
        return self.any_of(self.equals(bits, value) for value in values)

    def marked_locations(self) -> Any:
        """Return the predicate that is true where every automaton is in a marked location."""
        return self.all_of(
            self.any_of(self.in_location(automaton.name, location) for location in sorted(automaton.marked))
            for automaton in self.system.automata
        )

    def possible_inputs(self, event: str) -> Any:
        """The data that an event can carry: valid codes, and arrays without gaps."""
        inputs = [(item, bits) for item, bits in self.inputs if item.event == event]
        result = self.all_of(self.valid(bits) for _, bits in inputs)
        for item, bits in inputs:
            for other, other_bits in inputs:
                if bits.known and other_bits.known and _implied(item, other):
                    later, earlier = self.manager.var(bits.known), self.manager.var(other_bits.known)
                    result = result & (~later | earlier)
        return result

    def input_names(self, event: str) -> tuple[str, ...]:
        """The variables of the data that an event carries."""
        return tuple(name for item, bits in self.inputs if item.event == event for name in _names(bits))


def _lowest_first(predicates: Iterable[Any]) -> list[Any]:
    """Predicates in an order in which nothing that was built of some is built anew for those above them."""
    return sorted(predicates, key=lambda predicate: -predicate.level)


def _names(bits: Bits) -> tuple[str, ...]:
    return bits.names if bits.known is None else (bits.known, *bits.names)


def _interleaved(block: Sequence[tuple[Bits, bool, Sequence[Bits]]]) -> list[str]:
    """Names of places of the state and of received data beside them; bits of equal weight stand together.

    Args:
        block: For each place its bits, whether it has next-state variables, and the data beside it.
    """
    ranked: list[tuple[int, tuple[str, ...]]] = []
    for place, has_next, inputs in block:
        for bits in (place, *inputs):
            for rank, name in enumerate(_names(bits), start=0 if bits.known is None else -1):
                is_doubled = bits is place and has_next
                ranked.append((len(bits.names) - rank, (name, next_name(name)) if is_doubled else (name,)))
    # Stable: within one weight a place comes before its data.
    ranked.sort(key=lambda item: -item[0])
    return [name for _, names in ranked for name in names]


def _implied(later: InputVariable, earlier: InputVariable) -> bool:
    """Return True if an element is known wherever another one is.

    It is if every array that its path goes through is one of the other's and is indexed lower or alike there.
    """
    lengths = {later.path[:place]: step for place, step in enumerate(later.path) if isinstance(step, int)}
    needed = {earlier.path[:place]: step for place, step in enumerate(earlier.path) if isinstance(step, int)}
    return (
        later != earlier
        and bool(needed)
        and all(array in lengths and index <= lengths[array] for array, index in needed.items())
    )


Inputs = Mapping[tuple[PathStep, ...], Bits]


def offset_of(bits: Bits) -> int:
    """Return the number that is added to an index to get an integer's value."""
    return int(bits.domain[0]) if isinstance(bits.type, IntegerType) else 0
