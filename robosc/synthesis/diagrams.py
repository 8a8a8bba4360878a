"""Predicates over bits as decision diagrams over locations and variables."""

from typing import Any

from robosc.automata.state import Subject
from robosc.errors import InternalError, UnsupportedModelError
from robosc.supervisor import DecisionDiagram, DecisionNode
from robosc.synthesis.compiled import TOTAL, kernel_of
from robosc.synthesis.encoding import Bits, Encoding
from robosc.synthesis.nodes import cofactors, is_constant

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

    def __init__(self, encoding: Encoding, maximum: int) -> None:
        self._encoding = encoding
        self._manager = encoding.manager
        self._level = {name: level for level, name in enumerate(encoding.order)}
        self._home = {
            name: (block, number)
            for block in encoding.blocks
            for number, subject in enumerate(block)
            for name in encoding.subjects[subject].names
        }
        self._maximum = self._left = maximum
        self._nodes: list[DecisionNode] = []
        self._numbers: dict[DecisionNode, int] = {}
        self._known: dict[tuple[int, int], tuple[Any, int]] = {}

    def diagram(self, predicate: Any) -> DecisionDiagram:
        root = self._number(predicate, 0)
        return DecisionDiagram(tuple(self._nodes), root)

    def _number(self, predicate: Any, first: int) -> int:
        """Return the number of a predicate in the diagram: 0 false, 1 true, from 2 on its nodes.

        Args:
            predicate: The predicate.
            first: Number of places of the topmost variable's block that it does not depend on for certain.
        """
        if is_constant(self._manager, predicate):
            return int(predicate == self._manager.true)
        key = int(predicate), first
        found = self._known.get(key)
        if found is None:
            # The predicate is kept with its number: the engine could otherwise give its node to another one.
            found = self._known[key] = (predicate, self._new_number(predicate, first))
        return found[1]

    def _new_number(self, predicate: Any, first: int) -> int:
        block = self._home[predicate.var][0]
        for number in range(first, len(block)):
            subject = block[number]
            bits = self._encoding.subjects[subject]
            starts: list[int] = []
            children: list[int] = []
            runs = self._runs(subject, bits, predicate, 0)
            if len(runs) == 1:
                continue
            self._left -= len(runs)
            if self._left < 0:
                raise _too_many_in_all(subject, self._maximum)
            for start, below in runs:
                if start >= len(bits.domain):
                    # Codes from here on stand for no value: the predicate is ignored there.
                    break
                child = self._child(below, block, number + 1)
                if not children or children[-1] != child:
                    starts.append(start)
                    children.append(child)
            if len(children) == 1:
                return children[0]
            return self._node(subject, tuple(starts), tuple(children))
        raise InternalError("a predicate depends on none of the places that its topmost variable stands for")

    def _child(self, below: Any, block: tuple[Subject, ...], first: int) -> int:
        is_same = not is_constant(self._manager, below) and self._home[below.var][0] is block
        return self._number(below, first if is_same else 0)

    def _node(self, subject: Subject, starts: tuple[int, ...], children: tuple[int, ...]) -> int:
        node = DecisionNode(subject.automaton, subject.variable, starts, children)
        if node not in self._numbers:
            self._numbers[node] = len(self._nodes) + 2
            self._nodes.append(node)
        return self._numbers[node]

    def _runs(self, subject: Subject, bits: Bits, predicate: Any, place: int) -> list[_Run]:
        """Return the cofactor of a predicate for each index of the bits from `place` on, equal neighbours merged."""
        if place == len(bits.names) or self._is_below(predicate, bits.names[-1]):
            return [(0, predicate)]
        half = 1 << (len(bits.names) - place - 1)
        low, high = self._split(predicate, bits.names[place])
        runs = self._runs(subject, bits, low, place + 1)
        if low == high:
            # The bit does not matter: both halves look alike.
            upper, runs = runs, list(runs)
        else:
            upper = self._runs(subject, bits, high, place + 1)
        for start, below in upper:
            if start or runs[-1][1] != below:
                runs.append((half + start, below))
        if len(runs) > MAXIMUM_BRANCHES:
            raise _too_many_branches(subject)
        return runs

    def _is_below(self, predicate: Any, name: str) -> bool:
        """Return True if a predicate depends only on variables below a given one."""
        return is_constant(self._manager, predicate) or self._level[predicate.var] > self._level[name]

    def _split(self, predicate: Any, name: str) -> tuple[Any, Any]:
        """A predicate where a variable is false, and where it is true."""
        if predicate.var == name:
            return cofactors(predicate)
        if self._level[predicate.var] > self._level[name]:
            return predicate, predicate
        return self._manager.let({name: False}, predicate), self._manager.let({name: True}, predicate)


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
        return _Extractor(encoding, maximum).diagram(predicate)
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
