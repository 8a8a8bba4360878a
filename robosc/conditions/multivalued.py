"""Decision diagrams over finitely many values as a store of shared nodes: joined, subtracted, searched.

Values that no diagram distinguishes form one class, and a node has one child for each class, however large the range
is. Every operation counts its steps. An operation that needs too many raises `EffortExceededError`, on every machine at
the same step.

Source: A. Srinivasan, T. Kam, S. Malik and R. K. Brayton, "Algorithms for discrete function manipulation", IEEE
ICCAD 1990, pp. 92-95.
"""

from bisect import bisect_right
from collections.abc import Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager
from graphlib import CycleError, TopologicalSorter
from itertools import pairwise
from types import ModuleType
from typing import Self

from robosc.conditions.literals import Indices, merged
from robosc.expressions import IntegerType
from robosc.kernel import kernel_module
from robosc.supervisor import DecisionDiagram, DecisionNode
from robosc.supervisor.diagram import Domains, Subject

MAXIMUM_SUBJECTS = 100
"""Places that the diagrams of one store may test."""

MAXIMUM_RUNS = 128
"""Ranges of one place's values that the diagrams of one store may distinguish."""

Node = int
"""A node's number: 0 false, 1 true."""

Cube = tuple[int, ...]
"""For each place a set of classes, as bits: the states whose places all hold a value of their set."""


class EffortExceededError(Exception):
    """The bounds are too low for a result."""


class Effort:
    """A number of steps that work may take.

    Args:
        steps: Steps that are left.
        whole: The effort that this one is a part of.
    """

    def __init__(self, steps: int, whole: "Effort | None" = None) -> None:
        # All parts of one effort share a count, so that a step takes as long however deep they are nested.
        self._taken: list[int] = [0] if whole is None else whole._taken
        self._own_end = self._taken[0] + steps
        self._end: int = self._own_end if whole is None else min(self._own_end, whole._end)

    def spend(self, steps: int = 1) -> None:
        """Take some steps.

        Raises:
            EffortExceededError: There are not so many left.
        """
        self._taken[0] += steps
        if self._taken[0] > self._end:
            raise EffortExceededError

    @property
    def left(self) -> int:
        """Steps that are left, as far as the whole has as many."""
        return self._own_end - self._taken[0]

    @property
    def available(self) -> int:
        """Steps that can be taken before there are no more."""
        return self._end - self._taken[0]

    def part(self, steps: int) -> "Effort":
        """A part of it for work of its own."""
        return Effort(steps, self)


class Space:
    """A store of nodes over the places that some diagrams test.

    Args:
        diagrams: Diagrams that decide which values form a class of their own.
        domains: Values that the places can hold.
        effort: Effort that the work may take.
        apart: Places each of whose values is a class of its own.

    Attributes:
        subjects: The places, in the order of the diagrams.
        integers: Numbers of the places that hold integers.
        classes: For each place, the indices of each class.
        full: The cube of all states.
        effort: Effort that further work may take.

    Raises:
        EffortExceededError: The diagrams test too many places or distinguish too many values.
    """

    def __init__(
        self,
        diagrams: Sequence[DecisionDiagram],
        domains: Domains,
        effort: Effort,
        apart: Collection[Subject] = (),
    ) -> None:
        self.effort = effort
        self.subjects = _ordered(diagrams)
        if len(self.subjects) > MAXIMUM_SUBJECTS:
            raise EffortExceededError
        self._variables = {subject: place for place, subject in enumerate(self.subjects)}
        nodes: dict[Subject, list[DecisionNode]] = {subject: [] for subject in self.subjects}
        for node in (node for diagram in diagrams for node in diagram.nodes):
            nodes[node.automaton, node.variable].append(node)
        self.integers = frozenset(
            place for place, subject in enumerate(self.subjects) if isinstance(domains[subject].type, IntegerType)
        )
        # Each class of an integer is one range, so that relations between integers can compare classes.
        ranges = {self.subjects[place] for place in self.integers} if len(self.integers) > 1 else ()
        self.classes = [
            _singles(len(domains[subject]), effort)
            if subject in apart
            else _classes(nodes[subject], len(domains[subject]), effort, are_ranges=subject in ranges)
            for subject in self.subjects
        ]
        self.full: Cube = tuple((1 << len(classes)) - 1 for classes in self.classes)
        # The constants are tested below everything.
        self._nodes: list[tuple[int, tuple[Node, ...]]] = [(len(self.subjects), ())] * 2
        self._numbers: dict[tuple[int, tuple[Node, ...]], Node] = {}
        self._known: dict[tuple[str, Node, Node], Node] = {}
        self._cubes: dict[Cube, Node] = {}

    @contextmanager
    def within(self, effort: Effort) -> Iterator[Self]:
        """Work that has an effort of its own."""
        before, self.effort = self.effort, effort
        try:
            yield self
        finally:
            self.effort = before

    # Nodes

    def variable(self, node: Node) -> int:
        """The place that a node tests."""
        return self._node(node)[0]

    def children(self, node: Node) -> tuple[Node, ...]:
        """Its child for each class."""
        return self._node(node)[1]

    def _node(self, node: Node) -> tuple[int, tuple[Node, ...]]:
        return self._nodes[node]

    def make(self, variable: int, children: tuple[Node, ...]) -> Node:
        """The node with these children, which test later places; a child where all are equal."""
        self.effort.spend()
        if children.count(children[0]) == len(children):
            return children[0]
        key = (variable, children)
        number = self._numbers.get(key)
        if number is None:
            number = self._numbers[key] = len(self._nodes)
            self._nodes.append(key)
        return number

    def both(self, a: Node, b: Node) -> Node:
        """Return the node that is true where both are true."""
        if a == b or b == 1:
            return a
        if a == 0 or b == 0:
            return 0
        return b if a == 1 else self._apply("both", min(a, b), max(a, b))

    def either(self, a: Node, b: Node) -> Node:
        """Return the node that is true where one of them is true."""
        if a == b or b == 0:
            return a
        if a == 1 or b == 1:
            return 1
        return b if a == 0 else self._apply("either", min(a, b), max(a, b))

    def without(self, a: Node, b: Node) -> Node:
        """Return the node that is true where the first is true and the second is not."""
        if a == b or a == 0 or b == 1:
            return 0
        return a if b == 0 else self._apply("without", a, b)

    def _apply(self, operation: str, a: Node, b: Node) -> Node:
        key = (operation, a, b)
        found = self._known.get(key)
        if found is None:
            self.effort.spend()
            variable = min(self.variable(a), self.variable(b))
            work = getattr(self, operation)
            pairs = zip(self._below(a, variable), self._below(b, variable), strict=True)
            found = self._known[key] = self.make(variable, tuple(work(first, second) for first, second in pairs))
        return found

    def _below(self, node: Node, variable: int) -> tuple[Node, ...]:
        here, children = self._node(node)
        return children if here == variable else (node,) * len(self.classes[variable])

    def fixed(self, node: Node, variable: int) -> tuple[Node, ...]:
        """For each class of a place's values what is left of a node."""
        known: dict[Node, tuple[Node, ...]] = {}

        def left(item: Node) -> tuple[Node, ...]:
            here, children = self._node(item)
            if here == variable:
                return children
            if here > variable:
                return (item,) * len(self.classes[variable])
            found = known.get(item)
            if found is None:
                self.effort.spend()
                below = [left(child) for child in children]
                found = known[item] = tuple(self.make(here, row) for row in zip(*below, strict=True))
            return found

        return left(node)

    # Cubes

    def of_cube(self, cube: Cube) -> Node:
        """The node of a cube."""
        node = self._cubes.get(cube)
        if node is not None:
            return node
        node = 1
        for variable in reversed(range(len(cube))):
            if cube[variable] != self.full[variable]:
                count = len(self.classes[variable])
                node = self.make(variable, tuple(node if cube[variable] >> item & 1 else 0 for item in range(count)))
        self._cubes[cube] = node
        return node

    def enclosing_cube(self, node: Node) -> Cube:
        """The smallest cube around a node that is not false."""
        masks = [0] * len(self.subjects)
        # Every child but false leads to true.
        seen, stack = {0, 1}, [node]
        self._untested(masks, 0, node)
        while stack:
            item = stack.pop()
            if item in seen:
                continue
            seen.add(item)
            self.effort.spend()
            variable, children = self._node(item)
            for place, child in enumerate(children):
                if child:
                    masks[variable] |= 1 << place
                    self._untested(masks, variable + 1, child)
                    stack.append(child)
        return tuple(masks)

    def _untested(self, masks: list[int], first: int, node: Node) -> None:
        """Let places from one on up to a node's hold whatever they can."""
        last = self.variable(node)
        masks[first:last] = self.full[first:last]

    def all_of(self, nodes: Iterable[Node]) -> Node:
        """Return the node that is true where all of some nodes are true."""
        result = 1
        for node in nodes:
            result = self.both(result, node)
        return result

    def sum_of(self, cubes: Iterable[Cube]) -> Node:
        """Return the node that is true where one of some cubes is."""
        node = 0
        for cube in cubes:
            node = self.either(node, self.of_cube(cube))
        return node

    def meets(self, node: Node, cube: Cube) -> bool:
        """Return True if a node is true somewhere in a cube."""
        if node < 2:
            return node == 1
        seen, stack, found = {node}, [node], False
        while stack and not found:
            variable, children = self._nodes[stack.pop()]
            mask = cube[variable]
            for place, child in enumerate(children):
                if child == 0 or not mask >> place & 1 or child in seen:
                    continue
                if child == 1:
                    found = True
                    break
                seen.add(child)
                stack.append(child)
        self.effort.spend(len(seen))
        return found

    def meeting(self, node: Node, cube: Cube, variable: int) -> int:
        """The classes of one place, as bits, with which a node is true somewhere in a cube, whatever its own are."""
        known: dict[Node, bool] = {}
        seen, stack = {node}, [node] if node else []
        found = 0
        while stack and found != self.full[variable]:
            item = stack.pop()
            here, children = self._nodes[item]
            if here > variable:
                found = self.full[variable] if self._leads(item, cube, known) else found
                continue
            for place, child in enumerate(children):
                if here == variable:
                    if child and not found >> place & 1 and self._leads(child, cube, known):
                        found |= 1 << place
                elif child and cube[here] >> place & 1 and child not in seen:
                    seen.add(child)
                    stack.append(child)
        self.effort.spend(len(seen) + len(known))
        return found

    def _leads(self, node: Node, cube: Cube, known: dict[Node, bool]) -> bool:
        """Return True if a node is true somewhere in a cube."""
        if node < 2:
            return node == 1
        found = known.get(node)
        if found is None:
            variable, children = self._nodes[node]
            mask = cube[variable]
            found = known[node] = any(
                self._leads(child, cube, known) for place, child in enumerate(children) if mask >> place & 1
            )
        return found

    def paths(self, node: Node) -> int:
        """Ways from a node to true, those through one and the same nodes counted once."""
        counts = {0: 0, 1: 1}

        def count(item: Node) -> int:
            if item not in counts:
                self.effort.spend()
                counts[item] = sum(count(child) for child in set(self.children(item)))
            return counts[item]

        return count(node)

    def shortest_path(self, node: Node) -> Cube:
        """A largest cube among the paths to true of a node that is not false; the first of several."""
        lengths: dict[Node, int] = {1: 0}

        def length(item: Node) -> int:
            found = lengths.get(item)
            if found is None:
                self.effort.spend()
                found = lengths[item] = 1 + min(length(child) for child in self.children(item) if child)
            return found

        cube = list(self.full)
        while node != 1:
            variable, children = self._nodes[node]
            node = min((child for child in dict.fromkeys(children) if child), key=length)
            cube[variable] = sum(1 << place for place, child in enumerate(children) if child == node)
        return tuple(cube)

    # Diagrams

    def of(self, diagram: DecisionDiagram) -> Node:
        """The node of one of the diagrams that the store was made for."""
        nodes: list[Node] = [0, 1]
        for node in diagram.nodes:
            variable = self._variables[node.automaton, node.variable]
            firsts = [indices[0].start for indices in self.classes[variable]]
            nodes.append(
                self._chosen(variable, [nodes[node.children[bisect_right(node.starts, i) - 1]] for i in firsts])
            )
        return nodes[diagram.root]

    def _chosen(self, variable: int, children: Sequence[Node]) -> Node:
        if all(self.variable(child) > variable for child in children):
            return self.make(variable, tuple(children))
        # A file's diagram may test a place twice, or in another order each time.
        result = 0
        for place, child in enumerate(children):
            cube = list(self.full)
            cube[variable] = 1 << place
            result = self.either(result, self.both(child, self.of_cube(tuple(cube))))
        return result

    def diagram(self, root: Node) -> DecisionDiagram:
        """A node's diagram, with numbers that depend on its function and the order of places alone."""
        numbers: dict[Node, int] = {0: 0, 1: 1}
        found: list[DecisionNode] = []

        def number(node: Node) -> int:
            if node not in numbers:
                self.effort.spend()
                variable, children = self._node(node)
                runs = sorted(
                    (run.start, child)
                    for indices, child in zip(self.classes[variable], children, strict=True)
                    for run in indices
                )
                kept = runs[:1] + [later for earlier, later in pairwise(runs) if later[1] != earlier[1]]
                branches = tuple(number(child) for _, child in kept)
                found.append(DecisionNode(*self.subjects[variable], tuple(start for start, _ in kept), branches))
                numbers[node] = len(found) + 1
            return numbers[node]

        last = number(root)
        return DecisionDiagram(tuple(found), last)


class CompiledSpace(Space):
    """The same with the operations that take most of its time in the kernel: the same nodes after the same steps.

    Args:
        module: The kernel.
        empty: A store without nodes, whose place it takes.
    """

    def __init__(self, module: ModuleType, empty: Space) -> None:
        vars(self).update(vars(empty))
        self._module = module
        self._store = module.space(tuple(map(len, self.classes)))

    def _node(self, node: Node) -> tuple[int, tuple[Node, ...]]:
        if node >= len(self._nodes):
            self._nodes += self._module.space_nodes(self._store, len(self._nodes))
        return self._nodes[node]

    def make(self, variable: int, children: tuple[Node, ...]) -> Node:
        """The node with these children."""
        return self._counted(self._module.space_make(self._store, variable, children, self.effort.available))

    def _apply(self, operation: str, a: Node, b: Node) -> Node:
        number = _OPERATIONS.index(operation)
        return self._counted(self._module.space_apply(self._store, number, a, b, self.effort.available))

    def meets(self, node: Node, cube: Cube) -> bool:
        """Return True if a node is true somewhere in a cube."""
        if node < 2:
            return node == 1
        return bool(self._counted(self._module.space_meets(self._store, node, cube)))

    def meeting(self, node: Node, cube: Cube, variable: int) -> int:
        """The classes of one place, as bits, with which a node is true somewhere in a cube, whatever its own are."""
        return self._counted(self._module.space_meeting(self._store, node, cube, variable))

    def shortest_path(self, node: Node) -> Cube:
        """A largest cube among the paths to true of a node that is not false; the first of several."""
        path, steps = self._module.space_shortest_path(self._store, node, self.effort.available)
        self._spend(steps)
        cube = list(self.full)
        for variable, mask in path:
            cube[variable] = mask
        return tuple(cube)

    def _counted(self, answer: tuple[int, int]) -> int:
        """Return the number in an answer of the kernel; the other one are the steps that it took."""
        found, steps = answer
        self._spend(steps)
        return found

    def _spend(self, steps: int) -> None:
        # An answer without a step is one that Python gives without asking, however little is left.
        if steps:
            self.effort.spend(steps)


_OPERATIONS = ("both", "either", "without")
"""Operations, by their numbers in the kernel."""

_MOST_CLASSES = 64
"""Classes of one place that the kernel can handle."""


def space_of(
    diagrams: Sequence[DecisionDiagram], domains: Domains, effort: Effort, apart: Collection[Subject] = ()
) -> Space:
    """Return the fastest store for some diagrams; the arguments and errors are those of `Space`."""
    module = kernel_module()
    plain = Space(diagrams, domains, effort, apart)
    if module is None or any(len(classes) > _MOST_CLASSES for classes in plain.classes):
        return plain
    return CompiledSpace(module, plain)


def _ordered(diagrams: Sequence[DecisionDiagram]) -> tuple[Subject, ...]:
    """The places that diagrams test, each before those that are tested below it as far as that is possible."""
    later: dict[Subject, dict[Subject, None]] = {}
    for diagram in diagrams:
        names = [(node.automaton, node.variable) for node in diagram.nodes]
        for place in reversed(range(len(names))):
            below = later.setdefault(names[place], {})
            below |= {names[child - 2]: None for child in diagram.nodes[place].children if child > 1}
    try:
        return tuple(reversed(tuple(TopologicalSorter(later).static_order())))
    except CycleError:
        return tuple(later)


def _singles(count: int, effort: Effort) -> list[Indices]:
    """Each index by itself."""
    if count > MAXIMUM_RUNS:
        raise EffortExceededError
    effort.spend(count)
    return [(range(index, index + 1),) for index in range(count)]


def _classes(nodes: Sequence[DecisionNode], count: int, effort: Effort, *, are_ranges: bool) -> list[Indices]:
    """Classes of indices of one place's values; no node distinguishes the values of a class. Ordered by first index."""
    starts = sorted({start for node in nodes for start in node.starts})
    if len(starts) > MAXIMUM_RUNS:
        raise EffortExceededError
    if are_ranges and count <= 2 * len(starts):
        return _singles(count, effort)
    if are_ranges:
        return [(range(start, end),) for start, end in pairwise([*starts, count])]
    effort.spend(len(starts) * len(nodes))
    found: dict[tuple[int, ...], list[range]] = {}
    for start, end in pairwise([*starts, count]):
        signature = tuple(node.children[bisect_right(node.starts, start) - 1] for node in nodes)
        found.setdefault(signature, []).append(range(start, end))
    return [merged(runs) for runs in found.values()]
