"""States of one component that replace a control node, for `control_node_advice`.

Each leaf is a state. The nodes above it determine where its success and its failure lead, as the enclosing statements
determine the targets of jumps in a compiler (A. V. Aho, M. S. Lam, R. Sethi, J. D. Ullman, Compilers, 2nd ed., 2006,
sec. 6.6). After the whole node, the component begins again.
"""

from collections.abc import Callable, Sequence
from itertools import combinations

from robosc.language.control_nodes import Family, Leaf, Node
from robosc.language.words import spelled

FALLBACKS = frozenset({Family.FALLBACK, Family.REACTIVE_FALLBACK})
"""Families whose children are tried until one succeeds."""

_MOST_STATES = 24
_MOST_TOGETHER = 3
"""Children of a parallel node, of which each set of those that are done is a state."""

_ENDS = -1
"""Target that stands for the state behind all others until their number is known."""
_STAYS = -2
"""Target of a transition that leads nowhere else."""


class TooLargeError(Exception):
    """A node would become more states than anyone would read."""


def states_of(node: Node) -> str:
    """Return the states as text, the first one initial; raises `TooLargeError`."""
    return _Automaton(node).states()


def negation(condition: str) -> str:
    """The negation of a condition."""
    if condition.replace(".", "").replace("_", "").isalnum():
        return f"!{condition}"
    if condition[0] == "!" and condition[1:].replace(".", "").replace("_", "").isalnum():
        return condition[1:]
    return f"!({condition})"


class _Automaton:
    """States of one component: one for each leaf, and for each subset of what is done in parallel.

    Args:
        node: The node, whose end is its begin again.
    """

    def __init__(self, node: Node) -> None:
        self._transitions: list[list[tuple[str, int]]] = []
        self._ends = node.family is Family.RUN_ONCE
        target = _ENDS if self._ends else 0
        self._add(node, target, target)
        if self._ends:
            self._transitions.append([])

    def states(self) -> str:
        """The states as text, the first one initial; marked where a run is complete, or leads nowhere else."""
        marked = self._marked()
        written = []
        for number, transitions in enumerate(self._transitions):
            words = [
                text if target in (number, _STAYS) else f"{text} goto step_{target % len(self._transitions) + 1}"
                for text, target in dict.fromkeys(transitions)
                # A condition that leads nowhere else changes nothing.
                if target != number or not text.startswith("transition")
            ]
            head = "initial " * (number == 0) + "marked " * (number in marked)
            written.append(" ".join([f"{head}state step_{number + 1} {{", *words, "}"]))
        return " ".join(written)

    def _marked(self) -> frozenset[int]:
        """The first state, the one behind all, and those from which none of them is reached."""
        number_of_states = len(self._transitions)
        reaching = {0, number_of_states - 1} if self._ends else {0}
        marked = frozenset(reaching)
        while True:
            more = {
                number
                for number in range(number_of_states)
                if number not in reaching
                and any(
                    target % number_of_states in reaching for _, target in self._transitions[number] if target != _STAYS
                )
            }
            if not more:
                break
            reaching |= more
        return marked | (frozenset(range(number_of_states)) - reaching)

    def _new(self) -> int:
        if len(self._transitions) >= _MOST_STATES:
            raise TooLargeError
        self._transitions.append([])
        return len(self._transitions) - 1

    def _add(self, part: Node | Leaf, success: int, failure: int) -> None:
        """Add the states of a part; where its success and failure lead is known."""
        if isinstance(part, Leaf):
            self._transitions[self._new()] += _steps(part, success, failure)
            return
        begin = len(self._transitions)
        children = part.children
        match part.family:
            case family if family in FALLBACKS:
                self._chain(children, lambda following: (success, following), (success, failure))
            case Family.RECOVERY if len(children) == 2:
                self._chain(children, lambda following: (success, following), (begin, failure))
            case Family.IF_THEN_ELSE if 2 <= len(children) <= 3:
                self._choice(children, success, failure)
            case Family.PARALLEL:
                self._together(children, success, failure)
            case Family.PIPELINE if all(isinstance(child, Leaf) for child in children):
                self._pipeline([child for child in children if isinstance(child, Leaf)], success, failure)
            case Family.ROUND_ROBIN:
                self._chain(children, lambda following: (following, following), (success, success))
            case Family.INVERTER:
                self._in_order(children, failure, success)
            case Family.FORCE_SUCCESS:
                self._in_order(children, success, success)
            case Family.FORCE_FAILURE:
                self._in_order(children, failure, failure)
            case Family.RETRY if (times := _times(part)) is not None:
                once = Node(Family.SEQUENCE, children)
                self._chain((once,) * times, lambda following: (success, following), (success, failure))
            case Family.RETRY:
                self._in_order(children, success, begin)
            case Family.REPEAT if (times := _times(part)) is not None:
                self._in_order(children * times, success, failure)
            case Family.REPEAT | Family.KEEP_RUNNING:
                self._in_order(children, begin, failure)
            case _:
                self._in_order(children, success, failure)

    def _in_order(self, children: Sequence[Node | Leaf], success: int, failure: int) -> None:
        self._chain(children, lambda following: (following, failure), (success, failure))

    def _chain(
        self, children: Sequence[Node | Leaf], targets: Callable[[int], tuple[int, int]], last: tuple[int, int]
    ) -> None:
        """Add children one after the other, where all but the last know the begin of the next."""
        for child in children[:-1]:
            following = len(self._transitions) + _size(child)
            self._add(child, *targets(following))
        if children:
            self._add(children[-1], *last)

    def _choice(self, children: Sequence[Node | Leaf], success: int, failure: int) -> None:
        first = len(self._transitions) + _size(children[0])
        second = first + _size(children[1]) if len(children) > 2 else failure
        self._add(children[0], first, second)
        for child in children[1:]:
            self._add(child, success, failure)

    def _pipeline(self, leaves: Sequence[Leaf], success: int, failure: int) -> None:
        """Add a state for each leaf, in which all those before it may go on."""
        for position, leaf in enumerate(leaves):
            number = self._new()
            following = number + 1 if position + 1 < len(leaves) else success
            for before in leaves[:position]:
                if before != leaf:
                    self._transitions[number] += _steps(before, number, failure)
            self._transitions[number] += _steps(leaf, following, failure)

    def _together(self, children: Sequence[Node | Leaf], success: int, failure: int) -> None:
        """Add a state for each set of leaves that are done."""
        leaves = list(dict.fromkeys(child for child in children if isinstance(child, Leaf)))
        if len(leaves) != len(children) or len(leaves) > _MOST_TOGETHER:
            raise TooLargeError
        begin = len(self._transitions)
        subsets = _subsets(len(leaves))
        for done in subsets:
            number = self._new()
            for index, leaf in enumerate(leaves):
                if index not in done:
                    more = tuple(sorted((*done, index)))
                    following = begin + subsets.index(more) if more in subsets else success
                    self._transitions[number] += _steps(leaf, following, failure)


def _subsets(count: int) -> list[tuple[int, ...]]:
    """Sets of numbers below a count but for all of them, the smaller ones first."""
    return [done for size in range(count) for done in combinations(range(count), size)]


def _size(part: Node | Leaf) -> int:
    """The number of states that a part becomes."""
    if isinstance(part, Leaf):
        return 1
    if part.family is Family.PARALLEL:
        return len(_subsets(min(len(part.children), _MOST_TOGETHER)))
    return sum(map(_size, part.children)) * (_times(part) or 1)


def _times(part: Node) -> int | None:
    """Copies of the states of a node that counts; None: it does not count, or too far to have states for it."""
    if part.family not in (Family.RETRY, Family.REPEAT) or not part.count:
        return None
    size = part.count * sum(map(_size, part.children))
    return part.count if size <= _MOST_STATES // 2 else None


def _steps(leaf: Leaf, success: int, failure: int) -> list[tuple[str, int]]:
    """The transitions of the state of a leaf, with their targets."""
    name = spelled(leaf.text)
    if leaf.is_condition:
        return [(f"transition if {leaf.text}", success), (f"transition if {negation(leaf.text)}", failure)]
    if not leaf.is_answered:
        return [(f"on request to {name}", success)]
    request = [(f"on request to {name}", _STAYS)] if leaf.is_requested else []
    failed = [(f"on error from {name}", failure)] if leaf.can_fail else []
    return [*request, (f"on response from {name}", success), *failed]


__all__ = ["FALLBACKS", "TooLargeError", "negation", "states_of"]
