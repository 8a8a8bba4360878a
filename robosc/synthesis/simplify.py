"""What the supervisor adds to an event: of the conditions that do the same in every state that matters, a short one.

A condition matters where the controlled system can be, the plant enables the event and the requirements allow it. Among
those that agree there, candidates are found in four ways: by restricting, by leaving out places of the state, and as
sums of products for what is wanted and for what is not. The one with the shortest formula is kept, and without any the
one with the smallest diagram. What is kept is what the supervisor holds, so its formula is right in all states.

Source: O. Coudert and J. C. Madre, "A unified framework for the formal verification of sequential circuits", IEEE
ICCAD 1990, pp. 126-129 (restrict).
"""

from collections.abc import Iterable, Iterator
from typing import Any

from robosc.automata.state import Subject
from robosc.errors import UnsupportedModelError
from robosc.supervisor.cover import Words, cover
from robosc.supervisor.diagram import diagram_domains
from robosc.supervisor.formula import STEPS
from robosc.supervisor.literals import Size, size
from robosc.supervisor.multivalued import GaveUp, Space
from robosc.supervisor.structure import DecisionDiagram
from robosc.supervisor.words import Formulas
from robosc.synthesis.diagrams import extract
from robosc.synthesis.encoding import Encoding
from robosc.synthesis.nodes import node_count, restrict, support

MAXIMUM_NODES = 20_000
"""Nodes of what matters up to which more than restricting is tried."""

MAXIMUM_KEPT_NODES = 1_000
"""Nodes of it that may be left over the places that a restricted condition tests."""

MAXIMUM_RANGES = 10_000
"""Ranges of values that the diagram of such a set of states may tell apart: bits of several places may take far fewer
nodes than their values do."""

MAXIMUM_SUBJECTS = 40
"""Places that a restricted condition may test: with more, no formula would be short."""


class Simplifier:
    """Simplifies the conditions of one supervisor.

    Args:
        encoding: The variables.
    """

    def __init__(self, encoding: Encoding) -> None:
        self._encoding = encoding
        self._manager = encoding.manager
        self._domains = diagram_domains(encoding.system)
        self._home = {name: subject for subject, bits in encoding.subjects.items() for name in bits.names}
        self._formulas = Formulas(self._domains)

    def condition(self, wanted: Any, care: Any) -> DecisionDiagram | None:
        """A short condition that is `wanted` wherever `care` is true; None where it could be true everywhere.

        Args:
            wanted: A predicate over states.
            care: The states that matter, each with valid codes only.

        Raises:
            UnsupportedModelError: Each tells apart too many ranges of one variable's values.
        """
        positive, negative = care & wanted, care & ~wanted
        if negative == self._manager.false:
            return None
        if positive == self._manager.false:
            return extract(self._encoding, self._manager.false)
        plain = wanted & self._encoding.valid_states()
        simple = restrict(self._manager, wanted, care)
        if node_count(self._manager, simple) > node_count(self._manager, plain):
            simple = plain
        first = extract(self._encoding, simple)
        is_short = self._length(first) < (False, (2, 0), 0)
        others = [] if is_short or care.dag_size > MAXIMUM_NODES else self._others(simple, positive, negative)
        return min(dict.fromkeys((first, *others)), key=self._length)

    def _length(self, diagram: DecisionDiagram) -> tuple[bool, Size, int]:
        """How long a condition's formula is; one without a formula is longer than any with."""
        found = self._formulas.formula(diagram)
        return found is None, (0, 0) if found is None else size(found), len(diagram.nodes)

    def _others(self, simple: Any, positive: Any, negative: Any) -> Iterator[DecisionDiagram]:
        """Other conditions that are true in the positive states and false in the negative ones."""
        tested = {self._home[name] for name in support(self._manager, simple)}
        if len(tested) > MAXIMUM_SUBJECTS:
            return
        # Both stay apart: a condition over the places that are left tells them from each other.
        away = [name for name in self._encoding.state_names if self._home[name] not in tested]
        positive, negative = self._away(away, positive), self._away(away, negative)
        yield from self._sums(*self._needed(tested, positive, negative))

    def _away(self, names: Iterable[str], states: Any) -> Any:
        """The values that the other places have in states, whatever some have."""
        return self._manager.exist(names, states) if names else states

    def _needed(self, tested: Iterable[Subject], positive: Any, negative: Any) -> tuple[Any, Any]:
        """The states without every place that is not needed to tell them from each other, larger ones first."""
        if self._is_large(positive) or self._is_large(negative):
            return positive, negative
        ranks = {subject: rank for rank, subject in enumerate(self._domains)}

        def cost(subject: Subject) -> tuple[int, int]:
            return -len(self._encoding.subjects[subject].domain), -ranks[subject.automaton, subject.variable]

        for subject in sorted(tested, key=cost):
            names = self._encoding.subjects[subject].names
            fewer = self._away(names, positive), self._away(names, negative)
            if fewer[0] & fewer[1] == self._manager.false:
                positive, negative = fewer
        return positive, negative

    def _is_large(self, states: Any) -> bool:
        return bool(states.dag_size > MAXIMUM_KEPT_NODES)

    def _sums(self, positive: Any, negative: Any) -> Iterator[DecisionDiagram]:
        """The states that a short sum of products covers: one for the positive states, one for the negative."""
        if self._is_large(positive) or self._is_large(negative):
            return
        try:
            diagrams = [extract(self._encoding, states, MAXIMUM_RANGES) for states in (positive, negative)]
            space = Space(diagrams, self._domains, self._formulas.effort.part(STEPS))
            words = Words(space, self._domains)
            sets = [space.of(diagram) for diagram in diagrams]
            # What has fewer ways to true mostly has the shorter sum.
            pairs = sorted((sets, sets[::-1]), key=lambda pair: space.paths(pair[0]))
        except (GaveUp, UnsupportedModelError):
            return
        for wanted, forbidden in pairs:
            try:
                with space.within(self._formulas.effort.part(STEPS)):
                    cubes = cover(space, words, wanted, forbidden)
                    found = space.sum_of(cubes)
                    yield space.diagram(found if wanted == sets[0] else space.without(1, found))
            except GaveUp:
                continue
            if len(cubes) == 1:
                # The other sum would say the same the other way round.
                return
