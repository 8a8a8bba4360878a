"""Walks over the nodes of decision diagrams, the same for every engine.

Sources: O. Coudert and J. C. Madre, "A unified framework for the formal verification of sequential circuits",
ICCAD 1990, pp. 126-129 (restrict); R. E. Bryant, "Graph-based algorithms for Boolean function manipulation",
IEEE Trans. Computers C-35(8), 1986, pp. 677-691 (counting).
"""

import math
from collections.abc import Callable, Container, Mapping, Sequence
from functools import cache
from typing import Any, NamedTuple

from robosc.dd_modules import load_dd
from robosc.oxidd_diagrams import OxiddManager, Predicate
from robosc.synthesis.compiled import kernel_of
from robosc.synthesis.engines import Manager, is_compiled, is_reordering
from robosc.synthesis.walks import Nodes, walked

MATES = 8
"""Known nodes with which one that a step may have made is compared."""

_SMALL = 100
"""Nodes up to which a predicate is small."""


def cofactors(node: Any) -> tuple[Any, Any]:
    """The predicates where a node's variable is false and true: a complemented edge complements both."""
    if isinstance(node, Predicate):
        return node.cofactors
    return (~node.low, ~node.high) if node.negated else (node.low, node.high)


def is_constant(manager: Manager, node: Any) -> bool:
    """Return True if a predicate is true everywhere or false everywhere."""
    return bool(node == manager.true or node == manager.false)


def implies(manager: Manager, node: Any, other: Any) -> bool:
    """Return True if a predicate is true only where another one is; CUDD makes no node for that."""
    if isinstance(manager, OxiddManager):
        return manager.implies(node, other)
    kernel = kernel_of(manager)
    return bool(node & ~other == manager.false) if kernel is None else kernel.implies(node, other)


def meets(manager: Manager, node: Any, other: Any) -> bool:
    """Return True if two predicates are true together somewhere; CUDD makes no node for that."""
    return not implies(manager, node, ~other)


def met(manager: Manager, names: Sequence[str], node: Any, other: Any) -> Any:
    """Return the predicate that is true where some value of the variables makes both of two predicates true.

    CUDD forgets variables while it conjoins: what both are together may be far larger than what is left of it.
    """
    if not names:
        return node & other
    if isinstance(manager, OxiddManager):
        return manager.and_exist(names, node, other)
    if is_compiled(manager):
        return _and_exists()(node, other, names)
    return manager.exist(names, node & other)


@cache
def _and_exists() -> Callable[[Any, Any, Sequence[str]], Any]:
    function: Callable[[Any, Any, Sequence[str]], Any] = load_dd("cudd").and_exists
    return function


def assigned(manager: Manager, values: Mapping[str, bool], cube: Any, node: Any) -> Any:
    """A predicate in which variables have some values.

    Args:
        manager: The manager of all predicates.
        values: The values.
        cube: The predicate that the variables have these values.
        node: The predicate.
    """
    kernel = kernel_of(manager)
    # dd goes through all variables of CUDD to make the cube again: that takes longer than most small predicates.
    if kernel is not None and node.dag_size <= _SMALL:
        return kernel.restrict(node, cube)
    return manager.let(values, node)


def renamed(manager: Manager, names: Mapping[str, str], node: Any) -> Any:
    """A predicate with variables called otherwise, no two alike.

    The plain engine would build anew what stands below all of them: here that is not looked at. What is below, and
    which node a number stands for, holds only while the order does: an engine that changes it renames by itself.
    """
    if not names:
        return node
    if is_compiled(manager) or is_reordering(manager) or isinstance(manager, OxiddManager):
        return manager.let(names, node)
    return _Renaming(manager, names).walk(node)


class _Renaming:
    def __init__(self, manager: Manager, names: Mapping[str, str]) -> None:
        self._manager = manager
        self._new = {name: manager.var(new) for name, new in names.items()}
        self._deepest = max(manager.var(name).level for name in names)
        self._known: dict[Any, Any] = {}

    def walk(self, node: Any) -> Any:
        if is_constant(self._manager, node) or node.level > self._deepest:
            return node
        found = self._known.get(node)
        if found is None:
            low, high = cofactors(node)
            variable = self._new.get(node.var)
            test = self._manager.var(node.var) if variable is None else variable
            found = self._known[node] = self._manager.ite(test, self.walk(high), self.walk(low))
        return found


def count_models(manager: Manager, node: Any, variables: Sequence[str]) -> int:
    """Assignments of `variables` that make a predicate true, exactly.

    Args:
        manager: Its manager.
        node: A predicate over some of the variables.
        variables: In the manager's order.
    """
    places = {manager.var(name).level: place for place, name in enumerate(variables)}

    def count(nodes: Nodes) -> int:
        counter = _Counter(nodes, places)
        root = nodes.node(node)
        return counter.from_node(root) << counter.place(root)

    return walked(manager, count)


# Classes rather than functions in functions: two closures that call each other are a cycle that only the garbage
# collector ends, and it may take CUDD's manager away before the nodes that the cycle holds.
class _Counter:
    def __init__(self, nodes: Nodes, places: Mapping[int, int]) -> None:
        self._nodes = nodes
        self._places = places
        self._known: dict[Any, int] = {}

    def place(self, node: Any) -> int:
        """Return the number of variables that stand before a node's own."""
        level = self._nodes.level(node)
        return len(self._places) if level is None else self._places[level]

    def from_node(self, node: Any) -> int:
        """Assignments of the variables from the node's own on."""
        level = self._nodes.level(node)
        if level is None:
            return int(node == self._nodes.true)
        found = self._known.get(node)
        if found is None:
            here = self._places[level] + 1
            high, low = self._nodes.split(node)
            found = self.from_node(low) << (self.place(low) - here)
            found += self.from_node(high) << (self.place(high) - here)
            self._known[node] = found
        return found


def support_among(manager: Manager, names: tuple[str, ...], node: Any) -> set[str]:
    """Return the variables that a predicate depends on, which are some of those given."""
    return manager.support(node, names) if isinstance(manager, OxiddManager) else manager.support(node)


def regular(predicate: Any) -> Any:
    """Return the one of a predicate and its complement that stands for their node."""
    return ~predicate if predicate.negated else predicate


class Viewed(NamedTuple):
    """A node as a walk over several engines' predicates sees it; it stands for a predicate and its complement.

    Attributes:
        level: Its level; that of constants is beyond all.
        branches: The predicates where its variable is false and true; none of a constant.
    """

    node: Any
    level: float
    branches: Sequence[Any]


def viewed(predicate: Any) -> Viewed:
    """Return the node of a predicate of dd."""
    node = regular(predicate)
    return Viewed(node, math.inf, ()) if node.var is None else Viewed(node, node.level, (node.low, node.high))


def nodes_made(found: Any, known: Any, touched: Container[float], view: Callable[[Any], Viewed] = viewed) -> int:
    """Return the number of nodes that a step has made, as far as a walk finds that costs no more than they did.

    A node is known where it stands, or where one would get to by other values of the variables that the step touches:
    what is there too is not counted. Of such places no more than some are kept, so that nodes of states that the step
    has put elsewhere may be counted as made.

    Args:
        found: The states after the step.
        known: Those before it.
        touched: Levels of the variables that the step reads or changes.
        view: Function that returns the node of a predicate.
    """
    seen, waiting = set[Any](), [(found, [view(known)])]
    while waiting:
        predicate, mates = waiting.pop()
        node, level, branches = view(predicate)
        if not branches or _is_known(node, level, mates, view) or node in seen:
            continue
        seen.add(node)
        for branch in (1, 0):
            below: list[Viewed] = []
            for side in (branch, 1 - branch) if level in touched else (branch,):
                for mate in mates:
                    _add_mate(below, view(mate.branches[side]) if mate.level == level else mate)
            waiting.append((branches[branch], below))
    return len(seen)


def _is_known(node: Any, level: float, mates: list[Viewed], view: Callable[[Any], Viewed]) -> bool:
    """Follow what is known down to the level of a node, and return True if the node is part of it."""
    # The list grows meanwhile.
    for place, _ in enumerate(mates):
        while mates[place].level < level:
            low, high = mates[place].branches
            mates[place] = view(low)
            _add_mate(mates, view(high))
        if mates[place].node == node:
            return True
    return False


def _add_mate(mates: list[Viewed], mate: Viewed) -> None:
    if len(mates) < MATES and all(mate.node != other.node for other in mates):
        mates.append(mate)


def without(manager: Manager, states: Any, cubes: Sequence[Any]) -> Any:
    """States with the variables of some cubes quantified: they may have any value.

    Args:
        manager: Their manager.
        states: The states.
        cubes: The cubes, each of some variables that are true in it.
    """
    kernel = kernel_of(manager)
    if kernel is not None:
        return kernel.without(states, cubes)
    if isinstance(manager, OxiddManager):
        return manager.without(states, cubes)
    names = [name for cube in cubes for name in manager.support(cube)]
    return manager.exist(names, states) if names else states


def separated(manager: Manager, one: Any, other: Any, cubes: Sequence[Any]) -> tuple[Any, Any]:
    """Two disjoint sets of states without the variables that are not needed to distinguish them.

    The variables of each cube are left out, in order, if both sets stay disjoint without them.

    Args:
        manager: Their manager.
        one: Some states.
        other: Other states, disjoint from them.
        cubes: Cubes, each of variables that are left out together.
    """
    kernel = kernel_of(manager)
    if kernel is not None:
        return kernel.separated(one, other, cubes)
    for cube in cubes:
        fewer = without(manager, one, [cube]), without(manager, other, [cube])
        if fewer[0] & fewer[1] == manager.false:
            one, other = fewer
    return one, other


def restrict(manager: Manager, node: Any, care: Any) -> Any:
    """A predicate that equals `node` wherever `care` is true, mostly a smaller one."""
    kernel = kernel_of(manager)
    if kernel is not None:
        return kernel.restrict(node, care)
    if isinstance(manager, OxiddManager):
        care = manager.relevant(node, care)
    return walked(manager, lambda nodes: nodes.predicate(_Restrict(nodes).walk(nodes.node(node), nodes.node(care))))


class _Restrict:
    def __init__(self, nodes: Nodes) -> None:
        self._nodes = nodes
        self._level, self._split, self._false = nodes.level, nodes.split, nodes.false
        self._known = nodes.restricted

    def walk(self, f: Any, c: Any) -> Any:
        while True:
            key = (f, c)
            found = self._known.get(key)
            if found is not None:
                return found
            here, level = self._level(f), self._level(c)
            if here is None or level is None:
                return f
            if level < here:
                c = self._nodes.either(*self._split(c))
                continue
            high_f, low_f = self._split(f)
            if level > here:
                high_c = low_c = c
            else:
                high_c, low_c = self._split(c)
                if low_c == self._false:
                    f, c = high_f, high_c
                    continue
                if high_c == self._false:
                    f, c = low_f, low_c
                    continue
            found = self._known[key] = self._nodes.joined(here, self.walk(high_f, high_c), self.walk(low_f, low_c))
            return found
