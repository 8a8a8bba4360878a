"""Predicates over bits as decision diagrams over locations and variables."""

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

_Run = tuple[int, Any]
"""A first index and the predicate that holds from there on."""


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
            level: number
            for number, block in enumerate(encoding.levels)
            for _, levels in block
            for level in levels
        }
        self._maximum = self._left = maximum
        self._nodes: list[DecisionNode] = []
        self._numbers: dict[DecisionNode, int] = {}
        self._known: dict[tuple[Any, int], int] = {}

    def diagram(self, predicate: Any) -> DecisionDiagram:
        root = self._number(self._walk.node(predicate), 0)
        return DecisionDiagram(tuple(self._nodes), root)

    def _number(self, node: Any, first: int) -> int:
        """Return the number of a predicate in the diagram: 0 false, 1 true, from 2 on its nodes.

        Args:
            node: The predicate.
            first: Number of places of the topmost variable's block that it does not depend on for certain.
        """
        key = node, first
        found = self._known.get(key)
        if found is None:
            level = self._level(node)
            if level is None:
                return int(node == self._walk.true)
            found = self._known[key] = self._new_number(node, self._block_at[level], first)
        return found

    def _new_number(self, node: Any, block: int, first: int) -> int:
        subjects, places = self._encoding.blocks[block], self._encoding.levels[block]
        for number in range(first, len(places)):
            size, levels = places[number]
            runs = self._runs(subjects[number], levels, node, 0)
            if len(runs) == 1:
                continue
            self._left -= len(runs)
            if self._left < 0:
                raise _too_many_in_all(subjects[number], self._maximum)
            starts: list[int] = []
            children: list[int] = []
            for start, below in runs:
                if start >= size:
                    # Codes from here on stand for no value: the predicate is ignored there.
                    break
                level = self._level(below)
                is_same = level is not None and self._block_at[level] == block
                child = self._number(below, number + 1 if is_same else 0)
                if not children or children[-1] != child:
                    starts.append(start)
                    children.append(child)
            if len(children) == 1:
                return children[0]
            return self._node(subjects[number], tuple(starts), tuple(children))
        raise InternalError("a predicate depends on none of the places that its topmost variable stands for")

    def _node(self, subject: Subject, starts: tuple[int, ...], children: tuple[int, ...]) -> int:
        node = DecisionNode(subject.automaton, subject.variable, starts, children)
        if node not in self._numbers:
            self._numbers[node] = len(self._nodes) + 2
            self._nodes.append(node)
        return self._numbers[node]

    def _runs(self, subject: Subject, levels: tuple[int, ...], node: Any, place: int) -> list[_Run]:
        """Return the cofactor of a predicate for each index of the bits from `place` on, equal neighbours merged."""
        level = self._level(node)
        if level is None or place == len(levels) or level > levels[-1]:
            return [(0, node)]
        if level > levels[place]:
            # The bit does not matter: both halves look alike.
            runs = self._runs(subject, levels, node, place + 1)
            upper = tuple(runs)
        else:
            high, low = self._split(node) if level == levels[place] else self._walk.split_at(node, levels[place])
            runs = self._runs(subject, levels, low, place + 1)
            upper = tuple(runs) if low == high else self._runs(subject, levels, high, place + 1)
        half = 1 << (len(levels) - place - 1)
        last = runs[-1][1]
        runs += [(half + start, below) for start, below in upper if start or below != last]
        if len(runs) > MAXIMUM_BRANCHES:
            raise _too_many_branches(subject)
        return runs


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
