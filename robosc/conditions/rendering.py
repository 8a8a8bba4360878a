"""The supervisor's conditions in the model's words: a short formula, else the decision diagram node by node.

The diagram is written as numbered lines, from the top down. Each line is an `if ... then ... else` of the language, in
which `[n]` stands for line n. Each line is written only once, so the text is never larger than the diagram.
"""

import re
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager

import msgspec

from robosc.conditions.formula import OPERANDS, formula_in
from robosc.conditions.literals import Indices, Membership, Vocabulary, merged, operands
from robosc.conditions.multivalued import Effort
from robosc.expressions import Expression
from robosc.expressions.text import expression_text
from robosc.supervisor import DecisionDiagram, DecisionNode
from robosc.supervisor.diagram import Domains

SHORT = 12
"""Operands up to which a formula is always preferred to its diagram; a longer one only if the diagram has as many."""

TOTAL_STEPS = 500_000
"""Steps that the search for the formulas of one supervisor may take: about two seconds."""

Target = bool | int
"""Target of a case: the outcome, or the number of a line."""


class Line(msgspec.Struct, frozen=True):
    """One node of a diagram.

    Attributes:
        number: Its number: the root is 1, and lines lead to later ones.
        cases: Tests of one place, each with its target if it is true.
        otherwise: Target if none is.
        is_cif: True if its text is in CIF's notation.
    """

    number: int
    cases: tuple[tuple[Membership, Target], ...]
    otherwise: Target
    is_cif: bool = False

    def __str__(self) -> str:
        if [target for _, target in self.cases] == [True] and self.otherwise is False:
            return f"[{self.number}] {_negated(self.cases[0][0].text)}"
        if self.is_cif:
            cases = "".join(
                f"{'elif' if place else 'if'} {test.text}: {_target(target)} "
                for place, (test, target) in enumerate(self.cases)
            )
            return f"[{self.number}] {cases}else {_target(self.otherwise)} end"
        cases = "".join(f"if {_negated(test.text)} then {_target(target)} else " for test, target in self.cases)
        return f"[{self.number}] {cases}{_target(self.otherwise)}"

    def json(self) -> dict[str, object]:
        """The line as JSON values."""
        cases = [{"if": _negated(test.text), "then": target} for test, target in self.cases]
        return {"node": self.number, "cases": cases, "else": self.otherwise}

    @property
    def operands(self) -> int:
        """The tests that it writes down."""
        return sum(test.size[0] for test, _ in self.cases)


def _target(target: Target) -> str:
    return str(target).lower() if isinstance(target, bool) else f"[{target}]"


class Formulas:
    """The formulas of one supervisor's diagrams, found with a bounded effort for all of them together.

    Args:
        domains: Values that the places of the state can hold.

    Attributes:
        domains: The same.
        vocabulary: Vocabulary that puts their tests into words.
        effort: Effort that the search may still take.
    """

    def __init__(self, domains: Domains) -> None:
        self.domains = domains
        self.vocabulary = Vocabulary(domains)
        self.effort = Effort(TOTAL_STEPS)
        # Formulas, each with the number of operands that was allowed in its search.
        self._known: dict[DecisionDiagram, tuple[int, Expression | None]] = {}

    @contextmanager
    def within(self, effort: Effort) -> Iterator[None]:
        """Search with another effort."""
        before, self.effort = self.effort, effort
        try:
            yield
        finally:
            self.effort = before

    def formula(self, diagram: DecisionDiagram, *, limit: int = OPERANDS) -> Expression | None:
        """A formula that reads better than its diagram, or None where none of at most `limit` operands was found."""
        most, found = self._known.get(diagram, (-1, None))
        if found is None and most < limit:
            found = formula_in(self.vocabulary, diagram, limit=limit, effort=self.effort)
            if found is not None and self._is_longer(found, diagram):
                found = None
            self._known[diagram] = limit, found
        return found if found is not None and operands(found) <= limit else None

    def _is_longer(self, formula: Expression, diagram: DecisionDiagram) -> bool:
        """Return True if a formula that is not short takes more tests than its diagram, written line by line."""
        most = operands(formula)
        # Every line has at least one test: very many lines need not be built to be counted.
        if most <= SHORT or len(_order(*_branches(diagram, self.domains), diagram.root)) >= most:
            return False
        return most > sum(line.operands for line in diagram_lines(diagram, self.vocabulary))


def in_words(condition: Expression, components: Collection[str]) -> str:
    """A condition of a supervisor, as a user would write it, with `not` for the language's `!`.

    Args:
        condition: The condition.
        components: Names of all components.
    """
    return _negated(expression_text(condition, components))


def _negated(text: str) -> str:
    # Neither a name nor a number has an exclamation mark in it.
    return re.sub("!(?!=)", "not ", text)


def size_in_words(diagram: DecisionDiagram) -> str:
    """Return the size of a diagram, in words."""
    count = len(diagram.nodes)
    return f"a decision diagram of {count} node{'s' if count != 1 else ''}"


def diagram_lines(diagram: DecisionDiagram, vocabulary: Vocabulary) -> tuple[Line, ...]:
    """Return a diagram node by node, the root first; a node that decides nothing is left out for what it leads to.

    Args:
        diagram: The diagram.
        vocabulary: Vocabulary that puts its tests into words.
    """
    branches, leads_to = _branches(diagram, vocabulary.domains)
    order = _order(branches, leads_to, diagram.root)
    numbers = {number: place for place, number in enumerate(order, start=1)}
    return tuple(
        _line(diagram.nodes[number - 2], branches[number], numbers, numbers[number], vocabulary) for number in order
    )


Branches = dict[int, Indices]
"""For each child of a node the indices that lead to it."""


def _branches(diagram: DecisionDiagram, domains: Domains) -> tuple[list[Branches], list[int]]:
    """For each number its branches, and the number that it comes to where nodes decide nothing."""
    found: list[Branches] = [{}, {}]
    leads_to = [0, 1]
    for number, node in enumerate(diagram.nodes, start=2):
        runs: dict[int, list[range]] = {}
        ends = (*node.starts[1:], len(domains[node.automaton, node.variable]))
        for start, end, child in zip(node.starts, ends, node.children, strict=True):
            runs.setdefault(leads_to[child], []).append(range(start, end))
        found.append({child: merged(parts) for child, parts in runs.items()})
        leads_to.append(number if len(runs) > 1 else next(iter(runs)))
    return found, leads_to


def _order(branches: list[Branches], leads_to: list[int], root: int) -> list[int]:
    """The numbers of the nodes in the text, in its order."""
    needed = {leads_to[root]}
    for number in reversed(range(2, len(leads_to))):
        if number in needed:
            needed.update(branches[number])
    # Children stand before their parents in a diagram, and after them in the text.
    return sorted((number for number in needed if number > 1), reverse=True)


def _line(
    node: DecisionNode,
    branches: Branches,
    numbers: Mapping[int, int],
    number: int,
    vocabulary: Vocabulary,
) -> Line:
    subject = (node.automaton, node.variable)
    tests = [(vocabulary.test(subject, where), child) for child, where in branches.items()]
    # The longest test goes without saying; where all is decided, what it takes to be true is written.
    is_decided = all(child < 2 for child in branches)
    *cases, (_, last) = sorted(tests, key=lambda case: (-case[1] if is_decided else 0, case[0].size))
    targets = tuple((test, _reached(child, numbers)) for test, child in cases)
    return Line(number, targets, _reached(last, numbers), vocabulary.is_cif)


def _reached(child: int, numbers: Mapping[int, int]) -> Target:
    return bool(child) if child < 2 else numbers[child]
