"""Predicates over bits as decision diagrams over locations and variables."""

from collections.abc import Sequence
from typing import Any

from robosc.automata.state import Subject
from robosc.errors import InternalError, UnsupportedModelError
from robosc.supervisor import DecisionDiagram, DecisionNode
from robosc.synthesis.compiled import TOTAL, kernel_of
from robosc.synthesis.encoding import Encoding
from robosc.synthesis.walks import Nodes, walked

MAXIMUM_BRANCHES = 100_000
"""Ranges of one variable's values beyond which a diagram is refused."""

MAXIMUM_TOTAL = 400_000
"""Ranges that all nodes of a diagram together may distinguish."""

FEW_BITS = 5
"""Bits of a place that are few."""

MAXIMUM_KEPT = 100
"""Ranges of a node up to which they are kept: other nodes above it need them again."""

_Runs = tuple[tuple[int, ...], tuple[Any, ...]]
"""First indices of ranges, and the predicate that holds in each of them."""


class _Extractor:
    """Collects the nodes of one diagram.

    Places are tested in the encoding's order. Within a block their bits stand among each other, so a place is taken out
    of a predicate by setting its bits; what the other bits of the block then decide comes after it.
    """

    def __init__(self, encoding: Encoding, nodes: Nodes, maximum: int) -> None:
        self._encoding = encoding
        self._walk = nodes
        self._level, self._split = nodes.level, nodes.split
        self._block_at = {
            level: number for number, block in enumerate(encoding.levels) for _, levels in block for level in levels
        }
        self._maximum = self._left = maximum
        self._nodes: list[DecisionNode] = []
        self._numbers: dict[DecisionNode, int] = {}
        self._constants = {nodes.false: 0, nodes.true: 1}
        # The numbers of nodes by themselves, and of those that come from places of the same block.
        self._done = dict(self._constants)
        self._known: dict[tuple[Any, int], int] = {}
        self._found = nodes.taken_apart

    def diagram(self, predicate: Any) -> DecisionDiagram:
        root = self._walk.node(predicate)
        found = self._done.get(root)
        if found is None:
            found = self._number(root, -1, 0)
        return DecisionDiagram(tuple(self._nodes), found)

    def _number(self, node: Any, block: int, first: int) -> int:
        """Return the number of a node in the diagram, from 2 on; it is no constant.

        Args:
            node: The node.
            block: The block that it comes from.
            first: Number of places of that block that it does not depend on for certain.
        """
        own = self._block_at[self._level(node)]  # type: ignore[index]  # it is no constant
        if own != block or not first:
            found = self._done.get(node)
            if found is None:
                found = self._done[node] = self._new_number(node, own, 0)
            return found
        key = node, first
        found = self._known.get(key)
        if found is None:
            found = self._known[key] = self._new_number(node, own, first)
        return found

    def _new_number(self, node: Any, block: int, first: int) -> int:
        subjects, places = self._encoding.blocks[block], self._encoding.levels[block]
        known = self._done if len(places) == 1 else self._constants
        for number in range(first, len(places)):
            subject, (size, levels) = subjects[number], places[number]
            runs, below = self._ranges(subject, levels, node)
            if len(runs) == 1:
                continue
            self._left -= len(runs)
            if self._left < 0:
                raise _too_many_in_all(subject, self._maximum)
            starts: list[int] = []
            children: list[int] = []
            last = -1
            for start, item in zip(runs, below, strict=True):
                if start >= size:
                    # Codes from here on stand for no value: the predicate is ignored there.
                    break
                child = known.get(item)
                if child is None:
                    child = self._number(item, block, number + 1)
                if child != last:
                    starts.append(start)
                    children.append(child)
                    last = child
            if len(children) == 1:
                return children[0]
            return self._node(subject, tuple(starts), tuple(children))
        raise InternalError("a predicate depends on none of the places that its topmost variable stands for")

    def _node(self, subject: Subject, starts: tuple[int, ...], children: tuple[int, ...]) -> int:
        node = DecisionNode(subject.automaton, subject.variable, starts, children)
        found = self._numbers.get(node)
        if found is None:
            found = self._numbers[node] = len(self._nodes) + 2
            self._nodes.append(node)
        return found

    def _ranges(self, subject: Subject, levels: tuple[int, ...], node: Any) -> tuple[Sequence[int], Sequence[Any]]:
        """Return the cofactor of a predicate for each index of the bits of a place, equal neighbours merged."""
        if len(levels) > FEW_BITS:
            return self._runs(subject, levels, node, 0)
        starts: list[int] = []
        below: list[Any] = []
        self._collect(levels, node, 0, 0, starts, below)
        return starts, below

    def _collect(
        self, levels: tuple[int, ...], node: Any, place: int, start: int, starts: list[int], below: list[Any]
    ) -> None:
        """Add what `_runs` returns, for bits so few that nothing is gained by remembering it."""
        level = self._level(node)
        if level is None or place == len(levels) or level > levels[-1]:
            if not below or below[-1] != node:
                starts.append(start)
                below.append(node)
            return
        at = levels[place]
        if level == at:
            high, low = self._split(node)
        else:
            high, low = (node, node) if level > at else self._walk.split_at(node, at)
        self._collect(levels, low, place + 1, start, starts, below)
        self._collect(levels, high, place + 1, start + (1 << (len(levels) - place - 1)), starts, below)

    def _runs(self, subject: Subject, levels: tuple[int, ...], node: Any, place: int) -> _Runs:
        """Return the cofactor of a predicate for each index of the bits from `place` on, equal neighbours merged."""
        level = self._level(node)
        if level is None or place == len(levels) or level > levels[-1]:
            return (0,), (node,)
        at = levels[place]
        key = node, at
        found = self._found.get(key)
        if found is not None:
            return found
        after = place + 1
        if level > at:
            # The bit does not matter: both halves look alike.
            starts, below = high_starts, high_below = self._runs(subject, levels, node, after)
        else:
            high, low = self._split(node) if level == at else self._walk.split_at(node, at)
            if after == len(levels):
                starts, below, high_starts, high_below = (0,), (low,), (0,), (high,)
            else:
                starts, below = self._runs(subject, levels, low, after)
                high_starts, high_below = self._runs(subject, levels, high, after)
        half = 1 << (len(levels) - place - 1)
        same = 1 if below[-1] == high_below[0] else 0
        found = (*starts, *[half + start for start in high_starts[same:]]), below + high_below[same:]
        if len(found[0]) > MAXIMUM_BRANCHES:
            raise _too_many_branches(subject)
        if len(found[0]) <= MAXIMUM_KEPT:
            self._found[key] = found
        return found


def _too_many_branches(subject: Subject) -> UnsupportedModelError:
    return UnsupportedModelError(
        f"a condition of the supervisor distinguishes more than {MAXIMUM_BRANCHES} ranges of the values of "
        f"'{subject}'; use a smaller range"
    )


def _too_many_in_all(subject: Subject, maximum: int) -> UnsupportedModelError:
    return UnsupportedModelError(
        f"a condition of the supervisor relates the values of '{subject}' to those of other variables in "
        f"more than {maximum} ways; use smaller ranges"
    )


def extract(encoding: Encoding, predicate: Any, maximum: int = MAXIMUM_TOTAL) -> DecisionDiagram:
    """The decision diagram of a state predicate, with numbers that depend on its function and the order alone.

    Args:
        encoding: The variables.
        predicate: The predicate.
        maximum: Ranges that all nodes together may distinguish.

    Raises:
        UnsupportedModelError: The predicate distinguishes more than `MAXIMUM_BRANCHES` ranges of one variable's values,
            or more than `maximum` in all.
    """
    kernel = kernel_of(encoding.manager)
    if kernel is None:
        return walked(encoding.manager, lambda nodes: _Extractor(encoding, nodes, maximum).diagram(predicate))
    # Most predicates are about few places: a number is that of a place in these blocks.
    blocks = encoding.blocks_with(encoding.manager.support(predicate))
    found = kernel.extract(predicate, tuple(encoding.levels[block] for block in blocks), MAXIMUM_BRANCHES, maximum)
    subjects = [subject for block in blocks for subject in encoding.blocks[block]]
    if found.refused:
        subject = subjects[found.number]
        is_total = found.refused == TOTAL
        raise _too_many_in_all(subject, maximum) if is_total else _too_many_branches(subject)
    places = [(subject.automaton, subject.variable) for subject in subjects]
    nodes = [DecisionNode(*places[place], starts, children) for place, starts, children in found.nodes]
    return DecisionDiagram(tuple(nodes), found.number)


def predicate_of(encoding: Encoding, diagram: DecisionDiagram) -> Any:
    """Return the state predicate of a valid decision diagram over the places of an encoding."""
    manager = encoding.manager
    found = [manager.false, manager.true]
    for node in diagram.nodes:
        bits = encoding.subjects[Subject(node.automaton, node.variable)]
        result = found[node.children[-1]]
        for start, child in zip(node.starts[:0:-1], node.children[-2::-1], strict=True):
            result = manager.ite(encoding.at_least(bits, start), result, found[child])
        found.append(result)
    return found[diagram.root]
