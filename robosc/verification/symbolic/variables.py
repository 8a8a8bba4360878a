"""Places of a state and received data as Boolean variables of a decision diagram."""

from collections.abc import Collection, Iterable, Mapping, Sequence, Set
from dataclasses import dataclass, replace
from typing import Any

from robosc.automata.compile import Carried, State
from robosc.automata.decision import Decision
from robosc.automata.inputs import connected_inputs, valuations
from robosc.automata.state import Subject, initial_values, subject_domain, subjects
from robosc.automata.structure import InputVariable, System
from robosc.dd_modules import load_dd
from robosc.expressions import IntegerType, Received, Value, domain, leaves
from robosc.oxidd_diagrams import OxiddManager
from robosc.recursion import allow_depth
from robosc.verification.symbolic.order import place_order, tied
from robosc.verification.symbolic.work import Work

_FRAMES_PER_LEVEL = 6
"""Python frames that the plain engine has open for each variable."""

_CACHE_SLOTS = 2**14
_MEMORY_ESTIMATE_BYTES = 2**24
_LOOSE_SLOTS = 6_710_886
"""Sizes that CUDD begins with.

With the sizes of its own choice, setting it up takes longer than verifying a dozen states. Its tables grow as fast as
by its own choice, and as large.
"""

_MANY = 64
"""Variables, for each one of some, from which these are few."""


@dataclass(frozen=True, slots=True)
class Digits:
    """The variables that hold the index of a value, most significant first.

    Attributes:
        names: In the state before an event (or in the data of its occurrence).
        values: The values, in the order of their indices.
        known: The variable that is true if the received datum is known, or None if it always is.
    """

    names: tuple[str, ...]
    values: Sequence[Value]
    known: str | None = None

    def after(self) -> "Digits":
        """The same of the state after an event."""
        return replace(self, names=tuple(map(after, self.names)))

    def size(self) -> int:
        """Return the number of choices."""
        return len(self.values) + (self.known is not None)

    def choices(self) -> tuple[Value | None, ...]:
        """Every value, and then None where it may be unknown."""
        return tuple(self.values) if self.known is None else (*self.values, None)


def after(name: str) -> str:
    """The variable of the state after an event that belongs to one of the state before it."""
    return name + "'"


def make_manager(engine: str) -> Any:
    """A fresh manager of decision diagrams: CUDD's where it is installed, else OxiDD's, whatever synthesis has used.

    Args:
        engine: `autoref` for the one in plain Python; with any other name the choice is free.
    """
    if engine == "autoref":
        manager = load_dd("autoref").BDD()
    else:
        try:
            manager = load_dd("cudd").BDD(initial_cache_size=_CACHE_SLOTS, memory_estimate=_MEMORY_ESTIMATE_BYTES)
        except ImportError:
            return OxiddManager()
        manager.configure(loose_up_to=_LOOSE_SLOTS)
    # The order is chosen below, so that the work is the same wherever it is done.
    manager.configure(reordering=False)
    return manager


class Variables:
    """All variables of a system.

    Args:
        system: The system.
        engine: Engine of the decision diagrams: see `make_manager`.
        work: Count of the work.
        followers: For some places of a state that no event moves, what they depend on: see `place_order`.

    Attributes:
        manager: The decision diagrams.
        system: The system.
        places: The digits of each place of a state.
        names: Every variable of the state before an event, topmost first.
        level: Depth of each variable, of all there are.
    """

    def __init__(
        self, system: System, engine: str, work: Work, followers: Mapping[Subject, Set[Subject]] | None = None
    ) -> None:
        self.system = system
        self.manager = make_manager(engine)
        if isinstance(self.manager, OxiddManager):
            work.tend = self.manager.tend
        self.work = work
        order = subjects(system)
        self.place_of = {subject: place for place, subject in enumerate(order)}
        self.places = tuple(_digits(f"s{place}", subject_domain(system, item)) for place, item in enumerate(order))
        self.data = {
            (item.event, item.path): _digits(
                f"d{number}", domain(item.type), f"d{number}.known" if item.may_be_unknown else None
            )
            for number, item in enumerate(system.inputs)
        }
        self.level: dict[str, int] = {}
        self.names = self._declare(place_order(system, followers))
        allow_depth(2 * len(self.names) + sum(len(item.names) + 1 for item in self.data.values()), _FRAMES_PER_LEVEL)

    def _add(self, *names: str) -> None:
        """Put variables below those there are."""
        self.manager.declare(*names)
        for name in names:
            self.level[name] = len(self.level)

    def _declare(self, order: Sequence[int]) -> tuple[str, ...]:
        """Declare the variables; returns those of a state."""
        widths = {place: len(digits.names) for place, digits in enumerate(self.places)}
        groups = tied(self.system, self.place_of, widths, {key: len(item.names) for key, item in self.data.items()})
        beside = self._data_beside(order, groups)
        group_of = {item: group for group in groups for item in group}
        rank_of = {place: rank for rank, place in enumerate(order)}
        names: list[str] = []
        placed = set[int]()
        for place in order:
            if place not in placed:
                # Groups hold data, too, which the order does not.
                group = group_of.get(place, {place})
                members = sorted((item for item in group if isinstance(item, int)), key=rank_of.__getitem__)
                placed.update(members)
                names += self._declare_together(members, beside)
        return tuple(names)

    def _declare_together(self, members: Sequence[int], beside: Mapping[int, Sequence[Digits]]) -> list[str]:
        """Declare some places and the data beside them: digits of one weight stand together, so that copies are small.

        Integers that are computed with together are so, too: what has to be remembered of them is a carry.
        """
        names: list[str] = []
        data = [item for place in members for item in beside.get(place, [])]
        self._add(*(item.known for item in data if item.known is not None))
        widths = [*(len(self.places[place].names) for place in members), *(len(item.names) for item in data)]
        for rank in range(max(widths), 0, -1):
            for place in members:
                own = self.places[place]
                if rank <= len(own.names):
                    names.append(own.names[-rank])
                    self._add(own.names[-rank], after(own.names[-rank]))
                self._add(*(item.names[-rank] for item in beside.get(place, []) if rank <= len(item.names)))
        return names

    def _data_beside(self, order: Sequence[int], groups: Sequence[Set[Any]]) -> dict[int, list[Digits]]:
        """For some places the data that stand with them: what they are computed with or written to, or anywhere."""
        level = {place: number for number, place in enumerate(order)}
        written: dict[Any, int] = {}
        for automaton in self.system.automata:
            for edge in automaton.edges:
                for update in edge.updates:
                    place = self.place_of[Subject(automaton.name, update.variable)]
                    for leaf in leaves(update.expression):
                        if isinstance(leaf, Received):
                            key = (edge.event, leaf.path)
                            written[key] = min(written.get(key, place), place, key=lambda item: level[item])
        for group in groups:
            members = [place for place in order if place in group]
            for key in self.data:
                if members and key in group and written.get(key) not in members:
                    written[key] = members[0]
        found: dict[int, list[Digits]] = {}
        for key, digits in self.data.items():
            found.setdefault(written.get(key, order[-1]), []).append(digits)
        return found

    # Predicates. Synthesis has `any_of` and `all_of`, too: verification shares no code with it, on purpose.

    def any_of(self, predicates: Iterable[Any]) -> Any:
        """Return the predicate that one of the predicates is true."""
        result = self.manager.false
        for predicate in predicates:
            result = result | predicate
        return result

    def all_of(self, predicates: Iterable[Any]) -> Any:
        """Return the predicate that all of the predicates are true."""
        result = self.manager.true
        # The lowest first: so nothing is built anew for those above.
        for predicate in sorted(predicates, key=lambda item: -item.level):
            result = result & predicate
        return result

    def without(self, names: Sequence[str], predicate: Any) -> Any:
        """Return the predicate that is true where some values of variables make one true."""
        if not self._are_few(names):
            return self.manager.exist(names, predicate) if names else predicate
        for name in names:
            ends = (self.manager.let({name: end}, predicate) for end in (self.manager.true, self.manager.false))
            predicate = self.any_of(ends)
        return predicate

    def renamed(self, names: Mapping[str, str], predicate: Any) -> Any:
        """A predicate with variables called otherwise, by names that it does not depend on."""
        if not self._are_few(names):
            return self.manager.let(dict(names), predicate) if names else predicate
        for name, new in names.items():
            predicate = self.manager.let({name: self.manager.var(new)}, predicate)
        return predicate

    def _are_few(self, names: Collection[str]) -> bool:
        """Return True if variables are better dealt with one by one: all at once, dd goes through all there are."""
        return _MANY * len(names) < len(self.level)

    def chosen(self, digits: Digits, branches: Sequence[Any]) -> Any:
        """The branch of the value that some digits have; false where they have none.

        Args:
            digits: The digits.
            branches: A predicate for each of `digits.choices()`.
        """
        level = [*branches[: len(digits.values)]]
        level += [self.manager.false] * ((1 << len(digits.names)) - len(level))
        for name in reversed(digits.names):
            variable = self.manager.var(name)
            level = [
                low if low == high else self.manager.ite(variable, high, low)
                for low, high in zip(level[::2], level[1::2], strict=True)
            ]
        if digits.known is None:
            return level[0]
        return self.manager.ite(self.manager.var(digits.known), level[0], branches[-1])

    def has_index(self, digits: Digits, index: int) -> Any:
        """Return the predicate that some digits hold an index."""
        result = self.manager.true
        for place, name in enumerate(reversed(digits.names)):
            variable = self.manager.var(name)
            result = (variable if (index >> place) & 1 else ~variable) & result
        return result

    def has_value(self, digits: Digits, value: Value) -> Any:
        """Return the predicate that some digits hold a value."""
        return self.has_index(digits, digits.values.index(value))

    def in_location(self, automaton: str, location: str) -> Any:
        """Return the predicate that an automaton is in a location."""
        return self.has_value(self.places[self.place_of[Subject(automaton)]], location)

    def unchanged(self, place: int) -> Any:
        """Return the predicate that a place has one value before and after an event."""
        return self.all_of(
            self.manager.ite(self.manager.var(name), self.manager.var(after(name)), ~self.manager.var(after(name)))
            for name in reversed(self.places[place].names)
        )

    def states(self, states: Iterable[State]) -> Any:
        """Return the predicate that the state is one of some states."""
        return self.any_of(
            self.all_of(self.has_value(digits, value) for digits, value in zip(self.places, state, strict=True))
            for state in states
        )

    def initial(self) -> list[Any]:
        """Return for each place the predicate that it has a value that it may begin with."""
        return [
            self.any_of(self.has_value(digits, value) for value in values)
            for digits, values in zip(self.places, initial_values(self.system), strict=True)
        ]

    def marked(self) -> list[Any]:
        """Return for each automaton the predicate that it is in a marked location."""
        return [
            self.chosen(
                self.places[self.place_of[Subject(item.name)]],
                [self.manager.true if location in item.marked else self.manager.false for location in item.locations],
            )
            for item in self.system.automata
        ]

    def possible_data(self, event: str) -> Any:
        """The data that an occurrence of an event can carry."""
        inputs = [item for item in self.system.inputs if item.event == event]
        result = self.manager.true
        for item in inputs:
            digits = self.data[event, item.path]
            is_value = self._has_any_value(digits)
            if digits.known is not None:
                is_value = is_value | ~self.manager.var(digits.known)
            result = result & is_value
        for group in connected_inputs(inputs):
            if any(item.may_be_unknown for item in group):
                result = result & self._possible_knowledge(group)
        return result

    def carried(self, event: str, data: Carried) -> Any:
        """Return the predicate that an occurrence of an event carries some data."""
        result = self.manager.true
        for path, value in data:
            digits = self.data[event, path]
            known = self.manager.true if digits.known is None else self.manager.var(digits.known)
            result = result & (~known if value is None else known & self.has_value(digits, value))
        return result

    def _has_any_value(self, digits: Digits) -> Any:
        """Return the predicate that some digits hold the index of a value at all."""
        if len(digits.values) == 1 << len(digits.names):
            return self.manager.true
        return self._by_ranges(digits.names, (0, len(digits.values)), (self.manager.true, self.manager.false))

    def _possible_knowledge(self, group: Sequence[InputVariable]) -> Any:
        """Return the predicate that a combination of the data of an array can be known together."""
        # The choices with one value each differ in which data are known.
        single = [replace(item, type=IntegerType(0, 0)) for item in group]
        found = self.manager.false
        for data in valuations(single):
            self.work.spend(1)
            combination = self.manager.true
            for item in group:
                known = self.data[item.event, item.path].known
                if known is not None:
                    variable = self.manager.var(known)
                    combination = combination & (~variable if data[item.path] is None else variable)
            found = found | combination
        return found

    def decision(self, decision: Decision) -> Any:
        """Return the predicate that a supervisor's condition is true."""
        made = [self.manager.false, self.manager.true]
        for node in decision.nodes:
            digits = self.places[node.place]
            branches = [made[child] for child in node.children]
            self.work.spend(len(branches))
            found = self._by_ranges(digits.names, node.starts, branches)
            # Another order of variables can make a small diagram large; an honest one hardly does.
            if found.dag_size > 4 * len(made) * len(digits.names):
                self.work.count(found)
            made.append(found)
        return made[decision.root]

    def _by_ranges(self, names: Sequence[str], starts: Sequence[int], branches: Sequence[Any]) -> Any:
        """The branch whose range an index lies in; the ranges begin at `starts`, the first at 0."""
        if len(starts) == 1:
            return branches[0]
        half = 1 << (len(names) - 1)
        split = next((number for number, start in enumerate(starts) if start >= half), len(starts))
        low = self._by_ranges(names[1:], starts[:split], branches[:split])
        if split == len(starts) or starts[split] > half:
            # The range before it goes on in the upper half.
            upper, above = [0, *(start - half for start in starts[split:])], branches[split - 1 :]
        else:
            upper, above = [start - half for start in starts[split:]], branches[split:]
        return self.manager.ite(self.manager.var(names[0]), self._by_ranges(names[1:], upper, above), low)

    # States

    def a_state(self, predicate: Any) -> State:
        """A state in which a predicate over the state's variables is true (it is true somewhere): the first one."""
        values = dict.fromkeys(self.names, False)
        node = predicate
        while node != self.manager.true:
            low, high = cofactors(node)
            if low == self.manager.false:
                values[node.var] = True
            node = high if low == self.manager.false else low
        return tuple(
            digits.values[sum(values[name] << rank for rank, name in enumerate(reversed(digits.names)))]
            for digits in self.places
        )

    def count(self, predicate: Any) -> int:
        """Return the exact number of states in which a predicate over the state's variables is true."""
        level = {name: number for number, name in enumerate(self.names)}
        nodes: set[Any] = set()
        stack = [predicate]
        while stack:
            node = stack.pop()
            if node not in (self.manager.true, self.manager.false) and node not in nodes:
                nodes.add(node)
                stack.extend(cofactors(node))
        counts = {self.manager.false: 0, self.manager.true: 1}
        levels = {self.manager.false: len(level), self.manager.true: len(level)}
        levels |= {node: level[node.var] for node in nodes}
        # Lowest first: what a node leads to is counted before it.
        for node in sorted(nodes, key=lambda node: -levels[node]):
            counts[node] = sum(counts[child] << (levels[child] - levels[node] - 1) for child in cofactors(node))
        return counts[predicate] << levels[predicate]


def cofactors(node: Any) -> tuple[Any, Any]:
    """Return the cofactors of a diagram: where its topmost variable is false, and where it is true."""
    return (~node.low, ~node.high) if node.negated else (node.low, node.high)


def _digits(prefix: str, values: Sequence[Value], known: str | None = None) -> Digits:
    width = (len(values) - 1).bit_length()
    return Digits(tuple(f"{prefix}.{place}" for place in range(width)), values, known)
