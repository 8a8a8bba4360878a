"""Predicates over states as shared decision diagrams: what a supervisor adds, in the words of the automata."""

from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import msgspec

from robosc.automata.compile import State
from robosc.expressions import Value


def index_in(values: Sequence[Value]) -> Callable[[Value], int]:
    """Return a function that gives the index of a value in a domain, at once.

    A range of integers may be wide and is not listed.
    """
    if isinstance(values, range):
        return lambda value: values.index(value)  # type: ignore[arg-type]  # a whole number, by its type
    return {value: index for index, value in enumerate(values)}.__getitem__


class Test(msgspec.Struct, frozen=True):
    """Node: the branch that each value takes.

    Attributes:
        place: The place of a state tuple that is tested.
        starts: Ascending indices into the place's domain, the first 0: the beginning of each branch.
        children: Target of each branch: 0 false, 1 true, n + 2 the node of that number.
    """

    place: int
    starts: tuple[int, ...]
    children: tuple[int, ...]

    def child(self, index: int) -> int:
        """Return the target of the branch that the value of an index takes."""
        return self.children[bisect_right(self.starts, index) - 1]


@dataclass(frozen=True, slots=True)
class Decision:
    """A predicate over state tuples: call it with a state.

    Attributes:
        nodes: The nodes, children before parents.
        root: 0 false, 1 true, n + 2 for node n.
        indices: For each place the function from a value to its index in the domain.
    """

    nodes: tuple[Test, ...]
    root: int
    indices: tuple[Callable[[Value], int], ...] = field(repr=False)

    def __call__(self, state: State) -> bool:
        """Return True if the decision is true in a state."""
        number = self.root
        while number > 1:
            node = self.nodes[number - 2]
            number = node.child(self.indices[node.place](state[node.place]))
        return number == 1

    def tested(self, state: State) -> tuple[int, ...]:
        """The places that it looks at in a state, in order."""
        number, found = self.root, list[int]()
        while number > 1:
            node = self.nodes[number - 2]
            found.append(node.place)
            number = node.child(self.indices[node.place](state[node.place]))
        return tuple(found)

    def places(self) -> frozenset[int]:
        """The places of a state that it may look at."""
        seen, stack = set[int](), [self.root]
        while stack:
            number = stack.pop()
            if number > 1 and number not in seen:
                seen.add(number)
                stack.extend(self.nodes[number - 2].children)
        return frozenset(self.nodes[number - 2].place for number in seen)
