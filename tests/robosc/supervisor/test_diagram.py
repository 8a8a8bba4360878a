"""Decision diagrams: evaluation, validation, and formulas that mean the same."""

from itertools import product
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robosc.automata.state import Subject, subjects
from robosc.expressions import Expression, Received, leaves
from robosc.expressions.evaluate import evaluate as evaluate_expression
from robosc.expressions.text import expression_text
from robosc.supervisor.diagram import diagram_domains, evaluate, to_expression, validate
from robosc.supervisor.structure import DecisionDiagram, DecisionNode
from robosc.synthesis.diagrams import extract
from robosc.synthesis.encoding import Encoding
from robosc.synthesis.engines import make_manager
from robosc.synthesis.symbolic import Symbols
from support.random_expressions import SYSTEM, conditions

DOMAINS = diagram_domains(SYSTEM)
PLACES = subjects(SYSTEM)
STATES = list(product(*(DOMAINS[subject.automaton, subject.variable] for subject in PLACES)))


def truth(diagram: DecisionDiagram, state: tuple[Any, ...]) -> bool:
    values = dict(zip(PLACES, state, strict=True))

    def read(automaton: str, variable: str | None) -> int:
        return DOMAINS[automaton, variable].index(values[Subject(automaton, variable)])

    return evaluate(diagram, read)


def plain(expression: Expression, state: tuple[Any, ...]) -> Any:
    values = dict(zip(PLACES, state, strict=True))
    return evaluate_expression(expression, lambda a, v: values[Subject(a, v)], lambda a: str(values[Subject(a)]))


@settings(max_examples=60, deadline=None)
@given(conditions.filter(lambda condition: not any(isinstance(leaf, Received) for leaf in leaves(condition))))
def test_a_diagram_and_its_formula_mean_the_predicate(condition: Expression) -> None:
    encoding = Encoding(SYSTEM, make_manager("autoref"))
    predicate = Symbols(encoding).holds(condition) & encoding.valid_states()
    diagram = extract(encoding, predicate)
    del predicate
    validate(diagram, DOMAINS)
    formula = to_expression(diagram, DOMAINS, limit=1000)
    assert formula is not None
    for state in STATES:
        expected = plain(condition, state) is True
        assert truth(diagram, state) == expected
        assert plain(formula, state) is expected


def node(variable: str | None, starts: tuple[int, ...], children: tuple[int, ...]) -> DecisionNode:
    return DecisionNode("A", variable, starts, children)


@pytest.mark.parametrize(
    ("nodes", "text"),
    [
        ([node("flag", (0, 1), (0, 1))], "A.flag"),
        ([node("flag", (0, 1), (1, 0))], "!A.flag"),
        ([node(None, (0, 1), (1, 0))], "A.on"),
        ([node(None, (0, 1), (0, 1))], "!A.on"),
        ([node("colour", (0, 1, 2), (0, 1, 0))], "A.colour = green"),
        ([node("colour", (0, 1, 2), (1, 0, 1))], "A.colour != green"),
        ([node("small", (0, 2), (1, 0))], "A.small <= -1"),
        ([node("small", (0, 2), (0, 1))], "A.small >= 0"),
        ([node("small", (0, 2, 4), (0, 1, 0))], "A.small >= 0 and A.small <= 1"),
        ([node("small", (0, 2, 3), (0, 1, 0))], "A.small = 0"),
        ([node("flag", (0, 1), (0, 1)), node(None, (0, 1), (2, 0))], "A.on and A.flag"),
        ([node("flag", (0, 1), (0, 1)), node(None, (0, 1), (1, 2))], "A.on or A.flag"),
        ([node("flag", (0, 1), (0, 1)), node(None, (0, 1, 2), (2, 0, 1))], "A.on and A.flag or A.broken"),
    ],
)
def test_small_diagrams_read_like_the_model(nodes: list[DecisionNode], text: str) -> None:
    diagram = DecisionDiagram(tuple(nodes), len(nodes) + 1)
    formula = to_expression(diagram, DOMAINS, limit=20)
    assert formula is not None
    assert expression_text(formula) == text


@given(st.integers(1, 30))
def test_a_formula_is_never_built_beyond_the_limit(limit: int) -> None:
    """Parity: each level doubles the formula but adds two nodes; 100 levels would never fit into memory."""
    nodes = [node("flag", (0, 1), (0, 1)), node("flag", (0, 1), (1, 0))]
    for level in range(100):
        even, odd = 2 + 2 * level, 3 + 2 * level
        nodes += [node(None, (0, 1), (even, odd)), node(None, (0, 1), (odd, even))]
    diagram = DecisionDiagram(tuple(nodes), len(nodes) + 1)
    validate(diagram, DOMAINS)
    assert to_expression(diagram, DOMAINS, limit=limit) is None


@pytest.mark.parametrize(
    ("nodes", "root", "words"),
    [
        ([node("ghost", (0, 1), (0, 1))], 2, "'A.ghost'"),
        ([DecisionNode("B", None, (0, 1), (0, 1))], 2, "'B'"),
        ([node("flag", (), ())], 2, "one child for each start"),
        ([node("flag", (1,), (0,))], 2, "first start must be 0"),
        ([node("flag", (0, 1), (0,))], 2, "one child for each start"),
        ([node("small", (0, 2, 2), (0, 1, 0))], 2, "ascend"),
        ([node("flag", (0, 2), (0, 1))], 2, "outside its domain of 2"),
        ([node("flag", (0, 1), (0, 2))], 2, "does not stand before it"),
        ([node("flag", (0, 1), (0, 1))], 3, "the root is no node"),
    ],
)
def test_broken_diagrams_are_refused(nodes: list[DecisionNode], root: int, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        validate(DecisionDiagram(tuple(nodes), root), DOMAINS)
