"""Short condition that the supervisor adds to an event, out of those that are equal in every state that matters.

A state matters if the controlled system can reach it, the plant enables the event there and the requirements allow it.
Candidates that are equal in these states are found in five ways: by restricting; by leaving out places of the state
(those that are left after restricting, or all places if that gives no readable result); as relations between variables;
and as sums of products for the wanted states and for the unwanted ones. The candidate with the shortest formula is
kept, or the one with the smallest diagram if none has a formula. The supervisor holds the kept candidate itself, so its
formula is correct in all states.

Source: O. Coudert and J. C. Madre, "A unified framework for the formal verification of sequential circuits", IEEE
ICCAD 1990, pp. 126-129 (restrict).
"""

from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from functools import cached_property
from time import monotonic
from typing import Any

from robosc.automata.state import Subject
from robosc.conditions.cover import Words, cover
from robosc.conditions.formula import OPERANDS, STEPS
from robosc.conditions.literals import length, operands
from robosc.conditions.multivalued import MAXIMUM_SUBJECTS, Effort, EffortExceededError, space_of
from robosc.conditions.relations import Relations, comparable
from robosc.conditions.rendering import SHORT, TOTAL_STEPS, Formulas
from robosc.errors import UnsupportedModelError
from robosc.expressions import TRUE
from robosc.supervisor import DecisionDiagram
from robosc.supervisor.diagram import Subject as Place
from robosc.supervisor.diagram import diagram_domains
from robosc.synthesis.diagrams import extract
from robosc.synthesis.encoding import Encoding
from robosc.synthesis.nodes import implies, restrict, separated, support_among, without

MAXIMUM_NODES = 20_000
"""Nodes of what matters up to which more than restricting is tried."""

MAXIMUM_VAIN = 3
"""Conditions in a row that restricting made larger, after which it is not tried where that many nodes matter: what is
entangled in one condition of a system mostly is so in the next one, and each takes long."""

MAXIMUM_KEPT_NODES = 1_000
"""Nodes of it that may be left over the places that a restricted condition tests."""

MAXIMUM_EFFORT = 3_000_000
"""Nodes of it over all places that conditions test, counted once for each of these, from which places are left out one
by one: a third of a second with the faster engine."""

MAXIMUM_RANGES = 10_000
"""Ranges of values that the diagram of such a set of states may distinguish: bits of several places may take far fewer
nodes than their values do."""


_Length = tuple[bool, tuple[int, bool, int], int]
"""Flag that there is no formula, the length of the formula, and the number of nodes of the diagram."""

_SHORT: _Length = (False, (2, False, 0), 0)
"""Longer than a condition than which none is shorter."""

_READABLE: _Length = (False, (SHORT + 1, False, 0), 0)
"""Longer than a condition that reads well."""


class Simplifier:
    """Simplifies the conditions of one supervisor.

    Args:
        encoding: The variables.
        seconds: Seconds, from now on, after which conditions are taken as they are; None for no limit but that of
            steps.
    """

    def __init__(self, encoding: Encoding, seconds: float | None = None) -> None:
        self._encoding = encoding
        self._manager = encoding.manager
        self._domains = diagram_domains(encoding.system)
        self._home = {name: subject for subject, bits in encoding.subjects.items() for name in bits.names}
        self._ranks: dict[Place, int] = {subject: rank for rank, subject in enumerate(self._domains)}
        # Places without a bit have one value, and no predicate depends on them.
        self._cubes = {
            subject: encoding.all_of(map(self._manager.var, bits.names))
            for subject, bits in encoding.subjects.items()
            if bits.names
        }
        self._variables = encoding.all_of(map(self._manager.var, reversed(encoding.state_names)))
        self._formulas = Formulas(self._domains)
        self._separating: dict[tuple[Any, Any], tuple[DecisionDiagram, ...]] = {}
        self._vain = 0
        self._end = None if seconds is None else monotonic() + seconds
        self._more, self._left = Effort(TOTAL_STEPS), MAXIMUM_EFFORT

    def condition(self, wanted: Any, care: Any) -> DecisionDiagram | None:
        """A short condition that is `wanted` wherever `care` is true; None where it could be true everywhere.

        Args:
            wanted: A predicate over states.
            care: The states that matter, each with valid codes only.

        Raises:
            UnsupportedModelError: Each condition distinguishes too many ranges of one variable's values.
        """
        if implies(self._manager, care, wanted):
            return None
        if implies(self._manager, care, ~wanted):
            return extract(self._encoding, self._manager.false)
        if self._is_over():
            with suppress(UnsupportedModelError):
                return extract(self._encoding, self._plain(wanted))
        is_large = care.dag_size > MAXIMUM_NODES
        simple = self._plain(wanted) if is_large and self._vain == MAXIMUM_VAIN else self._restricted(wanted, care)
        places = self._places(simple)
        first = self._extracted(simple, wanted, care) if is_large or len(places) == 1 else None
        if first is not None and (is_large or self._length(first) < _SHORT):
            return first
        found: dict[DecisionDiagram, _Length] = {}
        limit = OPERANDS
        for diagram in self._others(places, wanted, care):
            if self._is_over():
                break
            if diagram in found:
                continue
            found[diagram] = self._length(diagram, limit)
            if not found[diagram][0]:
                limit = min(limit, found[diagram][1][0])
        if all(length[0] for length in found.values()) or len(places) <= limit:
            # The restricted form needs a test of each of its places, and is mostly the longest: soon given up.
            first = self._extracted(simple, wanted, care)
            found = {first: self._length(first, limit), **found}
        best = min(found, key=lambda diagram: found[diagram])
        if found[best] <= _READABLE:
            return best
        with self._formulas.within(self._more):
            for diagram in self._wider(wanted, care):
                if self._is_over():
                    break
                if diagram not in found:
                    found[diagram] = self._length(diagram, SHORT)
        return min(found, key=lambda diagram: found[diagram])

    def _plain(self, wanted: Any) -> Any:
        """A condition as it is, where the codes stand for values."""
        return wanted & self._encoding.valid_states()

    def _restricted(self, wanted: Any, care: Any) -> Any:
        """Return the smaller of a condition as it is and of one that was restricted to the states that matter."""
        found = restrict(self._manager, wanted, care)
        # A condition as it is has a node for each of these variables; it is true somewhere.
        least = (
            len(self._restraining - self._manager.support(wanted)) if found.dag_size <= len(self._restraining) else 0
        )
        is_larger = found.dag_size > least and found.dag_size > self._plain(wanted).dag_size
        self._vain = self._vain + 1 if is_larger else 0
        return self._plain(wanted) if is_larger else found

    @cached_property
    def _restraining(self) -> set[str]:
        """The variables that decide about which codes stand for values."""
        return self._manager.support(self._encoding.valid_states())

    def _extracted(self, simple: Any, wanted: Any, care: Any) -> DecisionDiagram:
        """Return the diagram of a restricted condition, or of what is wanted over the places that decide about it.

        Restricting keeps relations to places of which others tell all that matters. Of several places of a thousand
        values each these are too many for a diagram.
        """
        try:
            return extract(self._encoding, simple)
        except UnsupportedModelError:
            tested = self._places(simple)
            positive, _ = self._needed(tested, *self._over(tested, wanted, care))
            return extract(self._encoding, positive)

    def _is_over(self) -> bool:
        return self._end is not None and monotonic() >= self._end

    def _length(self, diagram: DecisionDiagram, limit: int = OPERANDS) -> _Length:
        """Return the length of a condition's formula; one without a formula is longer than any with."""
        nodes = len(diagram.nodes)
        formula = None
        # Unless places are tested again, or compared with each other, no formula has more nodes than operands.
        if nodes <= limit or limit == OPERANDS or comparable(_subjects([diagram]), self._domains):
            formula = self._formulas.formula(diagram, limit=limit)
        return formula is None, length(TRUE if formula is None else formula), nodes

    def _others(self, tested: set[Subject], wanted: Any, care: Any) -> Iterator[DecisionDiagram]:
        """Other conditions over some places that are as wanted in the states that matter."""
        if len(tested) > MAXIMUM_SUBJECTS:
            return
        # The two sets stay disjoint: a condition over the remaining places distinguishes them.
        positive, negative = self._over(tested, wanted, care)
        if max(positive.dag_size, negative.dag_size) <= MAXIMUM_KEPT_NODES:
            yield from self._conditions_between(*self._needed(tested, positive, negative))

    def _wider(self, wanted: Any, care: Any) -> Iterator[DecisionDiagram]:
        """Other conditions over few places, chosen from all places that a condition tests.

        Places may depend on each other, such as those of a token that is in one of them. Restricting may then leave out
        a place whose one test replaces the tests of many others.
        """
        places = self._places(wanted)
        positive, negative = self._over(places, wanted, care)
        effort = 2 * len(places) * (positive.dag_size + negative.dag_size)
        if len(places) > MAXIMUM_SUBJECTS or effort > self._left:
            return
        self._left -= effort
        for is_reversed in (False, True):
            states = self._needed(places, positive, negative, is_reversed=is_reversed)
            if len(self._places(*states)) <= SHORT:
                yield from self._conditions_between(*states)

    def _places(self, *predicates: Any) -> set[Subject]:
        """The places that predicates depend on."""
        names = self._encoding.state_names
        return {self._home[name] for item in predicates for name in support_among(self._manager, names, item)}

    def _over(self, places: set[Subject], wanted: Any, care: Any) -> tuple[Any, Any]:
        """The values that some places have in the states that matter, where a condition is true and where not."""
        away = [without(self._manager, self._variables, [self._cubes[subject] for subject in places])]
        if self._places(wanted) <= places:
            near = without(self._manager, care, away)
            return near & wanted, near & ~wanted
        return without(self._manager, care & wanted, away), without(self._manager, care & ~wanted, away)

    def _conditions_between(self, positive: Any, negative: Any) -> Sequence[DecisionDiagram]:
        """Conditions that are true in the positive states and false in the negative ones."""
        # Many events of one system need the same conditions.
        key = positive, negative
        if key not in self._separating:
            self._separating[key] = tuple(self._new_conditions(positive, negative))
        return self._separating[key]

    def _new_conditions(self, positive: Any, negative: Any) -> Iterator[DecisionDiagram]:
        try:
            diagrams = [extract(self._encoding, states, MAXIMUM_RANGES) for states in (positive, negative)]
        except UnsupportedModelError:
            return
        for diagram in self._related(diagrams):
            yield diagram
            found = self._formulas.formula(diagram)
            if found is not None and operands(found) <= len(_subjects(diagrams)):
                # Each place is needed.
                return
        yield from self._sums(diagrams)

    def _needed(
        self, tested: Iterable[Subject], positive: Any, negative: Any, *, is_reversed: bool = False
    ) -> tuple[Any, Any]:
        """Both sets of states without the places that are not needed to distinguish them; larger places go first.

        Args:
            tested: Places that may go.
            positive: Some states.
            negative: Other states.
            is_reversed: True if among places of one size the first ones in the model's text go first. Among places
                that distinguish the same states, other ones are then left.
        """
        direction = 1 if is_reversed else -1

        def cost(subject: Subject) -> tuple[int, int]:
            rank = self._ranks[subject.automaton, subject.variable]
            return -len(self._encoding.subjects[subject].domain), direction * rank

        cubes = [self._cubes[subject] for subject in sorted(tested, key=cost)]
        return separated(self._manager, positive, negative, cubes)

    def _related(self, diagrams: Sequence[DecisionDiagram]) -> Iterator[DecisionDiagram]:
        """The states that relations between variables and a short sum of products describe together."""
        compared = comparable(_subjects(diagrams), self._domains)
        if not compared:
            return
        try:
            space = space_of(diagrams, self._domains, self._formulas.effort.part(STEPS), apart=compared)
            relations = Relations(space, Words(space, self._formulas.vocabulary), self._domains)
            sets = [space.of(diagram) for diagram in diagrams]
            places = relations.comparable(range(len(space.subjects)))
            pairs = [(sets[0], sets[1]), (sets[1], sets[0])]
            pairs = [pair for pair in pairs if relations.are_enough(*pair, places)] or pairs
        except EffortExceededError:
            return
        for wanted, forbidden in pairs:
            try:
                with space.within(self._formulas.effort.part(STEPS)):
                    for description in relations.descriptions(wanted, forbidden, places):
                        states = relations.states(description)
                        yield space.diagram(states if wanted == sets[0] else space.without(1, states))
            except EffortExceededError:
                continue

    def _sums(self, diagrams: Sequence[DecisionDiagram]) -> Iterator[DecisionDiagram]:
        """The states that a short sum of products covers: one for the positive states, one for the negative."""
        try:
            space = space_of(diagrams, self._domains, self._formulas.effort.part(STEPS))
            words = Words(space, self._formulas.vocabulary)
            sets = [space.of(diagram) for diagram in diagrams]
            # A diagram with fewer ways to true mostly has the shorter sum.
            pairs = sorted((sets, sets[::-1]), key=lambda pair: space.paths(pair[0]))
        except EffortExceededError:
            return
        for wanted, forbidden in pairs:
            try:
                with space.within(self._formulas.effort.part(STEPS)):
                    cubes = cover(space, words, wanted, forbidden)
                    found = space.sum_of(cubes)
                    yield space.diagram(found if wanted == sets[0] else space.without(1, found))
            except EffortExceededError:
                continue
            if len(cubes) == 1:
                # The other sum would say the same the other way round.
                return


def _subjects(diagrams: Iterable[DecisionDiagram]) -> set[Place]:
    """The places that diagrams test."""
    return {(node.automaton, node.variable) for diagram in diagrams for node in diagram.nodes}
