"""Decision diagrams of OxiDD behind the interface that dd's have, in managers that grow.

OxiDD (https://oxidd.net) has wheels for every version of Python and for all common machines. It wants to know at the
beginning how many nodes there may be and how many results of operations it is to remember. The managers here begin
small and are rebuilt into larger ones when they are full: a predicate stays the same object, and gets its node in the
new manager.

Source: N. Husung, C. Dubslaff, H. Hermanns and M. A. Koehl, "OxiDD: a safe, concurrent, modular, and performant
decision diagram framework in Rust", TACAS 2024, LNCS 14572, pp. 255-275.
"""

import gc
import importlib
import mmap
import os
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from importlib.util import find_spec, module_from_spec
from operator import attrgetter
from types import ModuleType
from typing import TYPE_CHECKING, Any, Self


def _load() -> ModuleType:
    """Return OxiDD's extension, loaded without the package around it, which reads the data of its distribution first.

    That takes thirty times as long as the rest. Another program that imports the package gets all of it.
    """
    name = "oxidd"
    if name in sys.modules:
        return importlib.import_module("oxidd._oxidd")
    spec = find_spec(name)
    if spec is None:
        raise ModuleNotFoundError("the package 'oxidd' is not installed", name=name)
    sys.modules[name] = module_from_spec(spec)
    try:
        return importlib.import_module("oxidd._oxidd")
    finally:
        del sys.modules[name]


# OxiDD reads this whenever it makes a thread. With one thread all work is done by the caller, on the caller's stack.
os.environ.setdefault("OXIDD_STACK_SIZE", str(2**18))

if TYPE_CHECKING:
    from oxidd._oxidd import BCDDFunction as BCDDFunction
    from oxidd._oxidd import BCDDManager, BCDDSubstitution
    from oxidd._oxidd import BooleanOperator as BooleanOperator
    from oxidd._oxidd import DDMemoryError as DDMemoryError
else:
    _module = _load()
    BCDDFunction, BCDDManager, BCDDSubstitution, BooleanOperator, DDMemoryError = (
        _module.BCDDFunction,
        _module.BCDDManager,
        _module.BCDDSubstitution,
        _module.BooleanOperator,
        _module.DDMemoryError,
    )
    # OxiDD reads this with each operation, and takes an interrupt in a function of Python for an error of types.
    type.__setattr__(BooleanOperator, "value", property(attrgetter("_value_")))

FIRST_NODES = 2**24
"""Nodes that a manager has room for at the beginning: memory is taken only for those that are there.

An operation that needs more begins anew in a larger manager. It cannot be interrupted, but it can be in between.
"""

_LEAST_NODES = 2**16
"""Nodes that a manager begins with where memory is short."""

_SHARE = 3
"""Times the memory for a new store that there has to be: others will be made, and Python wants some, too."""

FIRST_SLOTS = 2**18
"""Results of operations that a manager remembers at the beginning: setting them up takes two milliseconds and 5 MB."""

MAXIMUM_SLOTS = 2**25
MAXIMUM_NODES = 2**31

_NODES_GROW = 4
_SLOTS_GROW = 8
"""Factors by which managers become larger."""

_MANY = 1_000
"""Nodes from which an operation takes longer than to look at one case."""

_MOVES = 2_000
"""Places at which variables are tried when a better order is looked for: each takes half a millisecond at least."""

_NODE_BYTES = 16
_TABLE_BYTES = 12
"""A node, and its place in the table of all nodes, once more while that table is enlarged."""

_SLOT_BYTES = 20

_THREAD_BYTES = 2**22
"""Stacks of the threads that OxiDD makes for each manager, which mostly wait."""

_MAXIMUM_KEPT = 100_000
"""Results of one kind of work that are kept for the next one."""

BELOW = 2**31
"""Level of the constants."""


class Predicate:
    """A predicate in a manager: what dd calls a function.

    Args:
        manager: The manager.
        function: The predicate in OxiDD's manager; it is another one once the manager has been rebuilt.
    """

    __slots__ = ("function", "manager")

    def __init__(self, manager: "OxiddManager", function: BCDDFunction) -> None:
        self.manager = manager
        self.function = function

    def __and__(self, other: Self) -> "Predicate":
        try:
            return Predicate(self.manager, self.function & other.function)
        except DDMemoryError:
            return self.manager.again(Predicate.__and__, self, other)

    def __or__(self, other: Self) -> "Predicate":
        try:
            return Predicate(self.manager, self.function | other.function)
        except DDMemoryError:
            return self.manager.again(Predicate.__or__, self, other)

    def __invert__(self) -> "Predicate":
        return Predicate(self.manager, ~self.function)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Predicate) and self.function == other.function

    def __hash__(self) -> int:
        return hash(self.function)

    @property
    def var(self) -> str | None:
        """Name of the topmost variable, or None for a constant."""
        number = self.function.node_var()
        return None if number is None else self.manager.names[number]

    @property
    def level(self) -> int:
        """Level of the topmost variable; constants are below all of them."""
        found = self.function.node_level()
        return BELOW if found is None else found

    @property
    def dag_size(self) -> int:
        """Number of nodes below this one, itself and the constant included."""
        return self.function.node_count()

    @property
    def negated(self) -> bool:
        """True if the predicate is the complement of its node."""
        # The one of a predicate and its complement that is true where all variables are comes first.
        return not self.function < ~self.function

    @property
    def low(self) -> "Predicate":
        """The node below, where the topmost variable is false; a complement has the same one."""
        low = self.cofactors[0]
        return ~low if self.negated else low

    @property
    def high(self) -> "Predicate":
        """The node below, where the topmost variable is true; a complement has the same one."""
        high = self.cofactors[1]
        return ~high if self.negated else high

    @property
    def cofactors(self) -> "tuple[Predicate, Predicate]":
        """The predicates where the topmost variable is false and true."""
        found = self.function.cofactors()
        if found is None:
            raise ValueError("a constant has no cofactors")
        return Predicate(self.manager, found[1]), Predicate(self.manager, found[0])


class OxiddManager:
    """A store of shared nodes over ordered Boolean variables, which grows.

    Args:
        nodes: Nodes that it has room for at the beginning.
        slots: Results of operations that it remembers at the beginning.

    Attributes:
        names: The variables, in the order in which they were declared.
        true: The predicate that is true everywhere.
        false: The predicate that is true nowhere.
        pause: Called before an operation begins anew with more room: it may end the work with an error.
        generation: Number of times that it has been rebuilt: what is made of OxiDD's functions holds for one of them.

    Raises:
        MemoryError: There is no room for a manager.
    """

    def __init__(self, nodes: int = FIRST_NODES, slots: int = FIRST_SLOTS) -> None:
        self.names: list[str] = []
        self.generation = 0
        self.pause: Callable[[], None] = lambda: None
        self._numbers: dict[str, int] = {}
        self._maximum = MAXIMUM_NODES
        self._is_reordering = False
        self._is_in_order = True
        self._is_last_attempt = False
        self._open(nodes, slots, min(nodes, _LEAST_NODES))
        self.true = Predicate(self, self._store.true())
        self.false = Predicate(self, self._store.false())

    def _open(self, nodes: int, slots: int, least: int) -> None:
        """Begin with an empty store of some nodes, or of fewer if there is no room, but not of fewer than the least."""
        nodes = _with_room(nodes, slots, least)
        slots = min(slots, nodes)
        self._nodes, self._slots = nodes, slots
        self._due = slots
        self._store = BCDDManager(nodes, slots, 1)
        self._store.add_named_vars(self.names)
        self._variables = {name: self._store.var(number) for number, name in enumerate(self.names)}
        self._no = self._store.false()
        self._cubes: dict[tuple[str, ...], BCDDFunction] = {}
        self._masks: dict[tuple[str, ...], int] = {}
        self._kept: dict[str, dict[Any, Any]] = {}

    def kept(self, name: str) -> dict[Any, Any]:
        """Return what has been found about functions by some work, for the next one like it."""
        found = self._kept.get(name)
        if found is None or len(found) > _MAXIMUM_KEPT:
            found = self._kept[name] = {}
        return found

    # Memory

    def __len__(self) -> int:
        return self._store.num_inner_nodes()

    def collect_garbage(self) -> None:
        """Throw away what nobody needs."""
        self._cubes.clear()
        self._kept.clear()
        self._store.gc()

    def limit(self, nodes: int) -> None:
        """Let no single operation make more nodes than this, beside those there are."""
        self._maximum = nodes
        if self._nodes > nodes and len(self) < nodes // 2:
            self._rebuild(nodes, self._slots)

    def tend(self) -> None:
        """Throw away what nobody needs if that is due; if much is left, there is more room from now on.

        Whoever calls this keeps predicates, and no functions: they may be those of a store that is left.
        """
        made = self._store.approx_num_inner_nodes()
        if made <= self._due:
            return
        self.collect_garbage()
        if self._is_reordering:
            reorder(self)
        left = len(self)
        nodes, slots = self._nodes, self._slots
        if left > nodes // _NODES_GROW:
            nodes = max(nodes, min(2 * _NODES_GROW * left, self._maximum))
        if left > slots // 2 or made > 4 * self._due:
            slots = min(MAXIMUM_SLOTS, _SLOTS_GROW * slots)
        if (nodes, slots) != (self._nodes, self._slots):
            # If there is no memory for that, what there is may do.
            with suppress(MemoryError):
                self._rebuild(nodes, slots)
        self._due = max(self._slots, 3 * left)

    def attempt[T](self, work: Callable[[], T]) -> T:
        """Do some work on OxiDD's functions, which takes them from predicates each time that it is called.

        Raises:
            DDMemoryError: It needs more nodes than there may be.
            MemoryError: There is no more room.
        """
        try:
            return work()
        except DDMemoryError:
            return self.again(work)

    def again[*Ts, T](self, work: Callable[[*Ts], T], *arguments: *Ts) -> T:
        """Do some work that has failed for want of room again, with more of it.

        Raises:
            DDMemoryError: It needs more nodes than there may be.
            MemoryError: There is no more room.
        """
        while True:
            is_last = self._nodes >= self._maximum
            if is_last and self._is_last_attempt:
                raise DDMemoryError("there are more nodes than there may be")
            self.pause()
            nodes = min(_NODES_GROW * self._nodes, self._maximum)
            if is_last:
                # Errors keep predicates in cycles.
                gc.collect()
            # A new store in any case: OxiDD's own collector, which may be at work, keeps what it has found for a while.
            self._rebuild(nodes, min(MAXIMUM_SLOTS, _SLOTS_GROW * self._slots), nodes if is_last else self._nodes + 1)
            self._is_last_attempt = is_last
            try:
                return work(*arguments)
            except DDMemoryError:
                if is_last:
                    raise
            finally:
                self._is_last_attempt = False

    def _rebuild(self, nodes: int, slots: int, least: int = 0) -> None:
        """Go on in another store, with all predicates that there are.

        Raises:
            DDMemoryError: They do not fit into it.
            MemoryError: There is no room for it.
        """
        old = dict(self.__dict__)
        order = self.order()
        # Only the garbage collector knows all predicates: to note each of them would take longer than most operations.
        predicates = [item for item in gc.get_referrers(self) if type(item) is Predicate]
        try:
            self._open(nodes, slots, max(least, len(self.names) + 2))
            if not self._is_in_order:
                self._store.set_var_order([self._numbers[name] for name in order])
            copy = _Copy(self._store)
            functions = [copy.copied(item.function) for item in predicates]
        except MemoryError:
            self.__dict__.update(old)
            raise
        self.generation += 1
        for item, function in zip(predicates, functions, strict=True):
            item.function = function

    # Order

    def configure(self, **options: bool) -> dict[str, bool]:
        """Set whether the order of variables may change; return what was set."""
        before = {"reordering": self._is_reordering}
        self._is_reordering = options.get("reordering", self._is_reordering)
        return before

    def set_order(self, names: Sequence[str]) -> None:
        """Put variables into an order, topmost first.

        Raises:
            DDMemoryError: There are more nodes meanwhile than there may be.
        """
        for place, name in enumerate(names):
            if self.order()[place] != name:
                self.move(name, place)

    def move(self, name: str, place: int) -> None:
        """Move a variable to a place in the order, and the others aside.

        Raises:
            DDMemoryError: There are more nodes meanwhile than there may be.
        """
        # OxiDD ends the process where it lacks room for this. One variable does not make the diagrams twice as large.
        while len(self) > self._nodes // _NODES_GROW:
            if self._nodes >= self._maximum:
                raise DDMemoryError("there are more nodes than there may be")
            self._rebuild(min(_NODES_GROW * self._nodes, self._maximum), self._slots, self._nodes + 1)
        order = [other for other in self.order() if other != name]
        order.insert(place, name)
        self._store.set_var_order([self._numbers[item] for item in order])
        self._is_in_order = order == self.names
        self._masks.clear()

    def order(self) -> list[str]:
        """The variables, topmost first."""
        if self._is_in_order:
            return list(self.names)
        return [self.names[self._store.level_to_var(level)] for level in range(len(self.names))]

    # Variables

    def by_level(self) -> list[BCDDFunction]:
        """Return the function of the variable at each level; they hold for one generation."""
        return [self._variables[name] for name in self.order()]

    def declare(self, *names: str) -> None:
        """Add variables below those there are."""
        new = [name for name in dict.fromkeys(names) if name not in self._numbers]
        self._store.add_named_vars(new)
        self._numbers |= {name: number for number, name in enumerate(new, start=len(self.names))}
        self.names += new
        self.attempt(lambda: self._variables.update({name: self._store.var(name) for name in new}))

    def var(self, name: str) -> Predicate:
        """The predicate that a variable is true."""
        return Predicate(self, self._variables[name])

    # Operations

    def ite(self, test: Predicate, then: Predicate, otherwise: Predicate) -> Predicate:
        """Return the predicate that is `then` where `test` is true, and `otherwise` elsewhere."""
        try:
            return Predicate(self, test.function.ite(then.function, otherwise.function))
        except DDMemoryError:
            return self.again(self.ite, test, then, otherwise)

    def let(self, definitions: Mapping[str, Any], node: Predicate) -> Predicate:
        """Substitute variables at once: all by truth values, all by names, or all by predicates."""
        try:
            return Predicate(self, node.function.substitute(self.substitution(definitions)))
        except DDMemoryError:
            return self.again(self.let, definitions, node)

    def substitution(self, definitions: Mapping[str, Any]) -> BCDDSubstitution:
        """Return what OxiDD substitutes, with definitions as `let` has them; it holds for one generation."""
        return BCDDFunction.make_substitution(
            [(self._numbers[name], self._function(value)) for name, value in definitions.items()]
        )

    def _function(self, value: bool | str | Predicate) -> BCDDFunction:
        if isinstance(value, Predicate):
            return value.function
        if isinstance(value, str):
            return self._variables[value]
        return self._store.true() if value else self._no

    def cube(self, values: Mapping[str, bool]) -> Predicate:
        """Return the predicate that some variables have some values."""
        return self.attempt(lambda: Predicate(self, self._cube(values)))

    def _cube(self, values: Mapping[str, bool]) -> BCDDFunction:
        level = self._store.var_to_level
        found = self._store.true()
        for name in sorted(values, key=lambda name: level(self._numbers[name]), reverse=True):
            variable = self._variables[name]
            found = found & (variable if values[name] else ~variable)
        return found

    def support(self, node: Predicate, among: tuple[str, ...] | None = None) -> set[str]:
        """Return the variables that a predicate depends on.

        Args:
            node: The predicate.
            among: Variables of which it depends on no other, as far as is known: mostly few nodes are looked at then.
        """
        possible = (1 << len(self.names)) - 1
        if among is not None:
            possible = self._masks.get(among) or self._levels(among)
        found, seen, stack = 0, set[BCDDFunction](), [node.function]
        while stack:
            item = stack.pop()
            level = item.node_level()
            if level is not None and (possible & ~found) >> level and item not in seen:
                seen.add(item)
                found |= 1 << level
                stack += item.cofactors()  # type: ignore[arg-type]  # it is no constant
        order, names = self.order(), set[str]()
        while found:
            lowest = found & -found
            names.add(order[lowest.bit_length() - 1])
            found ^= lowest
        return names

    def _levels(self, names: tuple[str, ...]) -> int:
        """Return the levels of variables, as bits."""
        level_of = self._store.var_to_level
        found = self._masks[names] = sum(1 << level_of(self._numbers[name]) for name in names)
        return found

    def variables(self, names: Iterable[str]) -> BCDDFunction:
        """Return the conjunction of variables; it holds for one generation."""
        key = tuple(names)
        found = self._cubes.get(key)
        if found is None:
            found = self._cubes[key] = self._cube(dict.fromkeys(key, True))
        return found

    def exist(self, names: Iterable[str], node: Predicate) -> Predicate:
        """Return the predicate that is true where some value of the variables makes a predicate true."""
        names = tuple(names)
        try:
            return Predicate(self, node.function.exists(self.variables(names)))
        except DDMemoryError:
            return self.again(self.exist, names, node)

    def without(self, node: Predicate, cubes: Sequence[Predicate]) -> Predicate:
        """Return a predicate without the variables of some cubes: they may have any value."""
        try:
            all_ = self._store.true()
            for cube in cubes:
                all_ = all_ & cube.function
            return Predicate(self, node.function.exists(all_))
        except DDMemoryError:
            return self.again(self.without, node, cubes)

    def relevant(self, node: Predicate, care: Predicate) -> Predicate:
        """Return a set without the variables that stand above all of a predicate's own, or below them.

        To restrict the predicate to it comes to the same; the sets in between are smaller.
        """
        order, own = self.order(), self.support(node)
        places = [place for place, name in enumerate(order) if name in own]
        return self.exist(order[: places[0]] + order[places[-1] + 1 :], care) if places else care

    def and_exist(self, names: Iterable[str], node: Predicate, other: Predicate) -> Predicate:
        """Return the predicate that is true where some value of the variables makes both of two predicates true."""
        names = tuple(names)
        try:
            cube = self.variables(names)
            return Predicate(self, node.function.apply_exists(BooleanOperator.AND, other.function, cube))
        except DDMemoryError:
            return self.again(self.and_exist, names, node, other)

    def implies(self, node: Predicate, other: Predicate) -> bool:
        """Return True if a predicate is true only where another one is."""
        try:
            if node.function.node_count() > _MANY:
                # One case may be enough to tell that it is not.
                case = node.function.pick_cube() or ()
                if not other.function.eval([(number, bool(value)) for number, value in enumerate(case)]):
                    return False
            return (node.function & ~other.function) == self._no
        except DDMemoryError:
            return self.again(self.implies, node, other)


def reorder(manager: OxiddManager, levels: Mapping[str, int] | None = None) -> None:
    """Put the variables into an order, or into a better one: a variable at a time goes where diagrams are smallest.

    Source: R. Rudell, "Dynamic variable ordering for ordered binary decision diagrams", ICCAD 1993, pp. 42-47.

    Args:
        manager: The manager.
        levels: The level of each variable; None for a better order.
    """
    if levels is not None:
        manager.set_order(sorted(levels, key=levels.__getitem__))
        return
    moves = 0
    for name in tuple(manager.order()):
        manager.pause()
        best, least = manager.order().index(name), len(manager)
        for place in range(len(manager.names)):
            manager.move(name, place)
            if len(manager) < least:
                best, least = place, len(manager)
        manager.move(name, best)
        moves += len(manager.names)
        if moves > _MOVES:
            break


def _with_room(nodes: int, slots: int, least: int) -> int:
    """Return the number of nodes, at most as many as given, that there is memory for several times.

    Raises:
        MemoryError: There is memory for fewer than the least.
    """
    # OxiDD ends the process where it is refused memory.
    while True:
        try:
            needed = (_NODE_BYTES + _TABLE_BYTES) * nodes + _SLOT_BYTES * min(slots, nodes) + _THREAD_BYTES
            mmap.mmap(-1, _SHARE * needed).close()
            return nodes
        except (OSError, ValueError) as error:
            nodes //= 2
            if nodes < least:
                raise MemoryError("the decision diagrams were refused memory") from error


class _Copy:
    """Copies functions into a store with the same order of variables."""

    def __init__(self, store: BCDDManager) -> None:
        self._store = store
        self._variables = [store.var(number) for number in range(store.num_vars())]
        self._known: dict[BCDDFunction, BCDDFunction] = {}
        self._true = store.true()

    def copied(self, function: BCDDFunction) -> BCDDFunction:
        """Return a function of another store in this one."""
        number = function.node_var()
        if number is None:
            return self._true if function.valid() else ~self._true
        found = self._known.get(function)
        if found is None:
            opposite = self._known.get(~function)
            if opposite is not None:
                return ~opposite
            high, low = function.cofactors()  # type: ignore[misc]  # it is no constant
            found = self._known[function] = self._variables[number].ite(self.copied(high), self.copied(low))
        return found
