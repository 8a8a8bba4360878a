"""Predicates over bits as decision diagrams over locations and variables."""

from typing import Any

from robosc.automata.state import Subject
from robosc.errors import UnsupportedModelError
from robosc.supervisor.structure import DecisionDiagram, DecisionNode
from robosc.synthesis.encoding import Bits, Encoding
from robosc.synthesis.nodes import cofactors

MAXIMUM_BRANCHES = 100_000
"""Ranges of one variable's values beyond which a diagram is refused."""

_Run = tuple[int, Any]
"""A first index and the predicate that holds from there on."""


class _Extractor:
    """Collects the nodes of one diagram."""

    def __init__(self, encoding: Encoding) -> None:
        self._encoding = encoding
        self._manager = encoding.manager
        self._constants = {int(self._manager.true): 1, int(self._manager.false): 0}
        self._home = {
            name: (subject, place)
            for subject, bits in encoding.subjects.items()
            for place, name in enumerate(bits.names)
        }
        self._nodes: list[DecisionNode] = []
        self._numbers: dict[DecisionNode, int] = {}
        self._known: dict[int, tuple[Any, int]] = {}

    def diagram(self, predicate: Any) -> DecisionDiagram:
        root = self._number(predicate)
        return DecisionDiagram(tuple(self._nodes), root)

    def _number(self, predicate: Any) -> int:
        """The number of a predicate in the diagram: 0 false, 1 true, from 2 on its nodes."""
        constant = self._constants.get(int(predicate))
        if constant is not None:
            return constant
        found = self._known.get(int(predicate))
        if found is None:
            # The predicate is kept with its number: the engine could otherwise give its node to another one.
            found = self._known[int(predicate)] = (predicate, self._new_number(predicate))
        return found[1]

    def _new_number(self, predicate: Any) -> int:
        subject, _ = self._home[predicate.var]
        bits = self._encoding.subjects[subject]
        starts: list[int] = []
        children: list[int] = []
        for start, below in self._runs(subject, bits, predicate, 0):
            if start >= len(bits.domain):
                # Codes that stand for no value: what a predicate says of them is nobody's business.
                break
            child = self._number(below)
            if not children or children[-1] != child:
                starts.append(start)
                children.append(child)
        if len(children) == 1:
            return children[0]
        return self._node(subject, tuple(starts), tuple(children))

    def _node(self, subject: Subject, starts: tuple[int, ...], children: tuple[int, ...]) -> int:
        node = DecisionNode(subject.automaton, subject.variable, starts, children)
        if node not in self._numbers:
            self._numbers[node] = len(self._nodes) + 2
            self._nodes.append(node)
        return self._numbers[node]

    def _runs(self, subject: Subject, bits: Bits, predicate: Any, place: int) -> list[_Run]:
        """What is left of a predicate for each index of the bits from `place` on, equal neighbours put together."""
        if int(predicate) in self._constants:
            return [(0, predicate)]
        home, tested = self._home[predicate.var]
        if home != subject or tested < place:
            return [(0, predicate)]
        half = 1 << (len(bits.names) - place - 1)
        if tested == place:
            low, high = cofactors(predicate)
            runs, upper = self._runs(subject, bits, low, place + 1), self._runs(subject, bits, high, place + 1)
        else:
            # The bit does not matter: both halves look alike.
            upper = self._runs(subject, bits, predicate, place + 1)
            runs = list(upper)
        for start, below in upper:
            if start or runs[-1][1] != below:
                runs.append((half + start, below))
        if len(runs) > MAXIMUM_BRANCHES:
            raise UnsupportedModelError(
                f"a condition of the supervisor tells apart more than {MAXIMUM_BRANCHES} ranges of the values of "
                f"'{subject}'; use a smaller range"
            )
        return runs


def extract(encoding: Encoding, predicate: Any) -> DecisionDiagram:
    """The decision diagram of a state predicate, with numbers that depend on its function and the order alone.

    Raises:
        UnsupportedModelError: It tells apart more than `MAXIMUM_BRANCHES` ranges of one variable's values.
    """
    return _Extractor(encoding).diagram(predicate)
