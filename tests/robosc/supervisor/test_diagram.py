"""Decision diagrams: evaluation and validation."""

from itertools import product
from typing import Any

import pytest
from hypothesis import given, settings

from robosc.automata.state import Subject, subjects
from robosc.expressions import Expression, Received, leaves
from robosc.expressions.evaluate import evaluate as evaluate_expression
from robosc.supervisor import DecisionDiagram, DecisionNode
from robosc.supervisor.diagram import diagram_domains, evaluate, validate
from robosc.synthesis.diagrams import extract
from robosc.synthesis.encoding import Encoding
from robosc.synthesis.engines import make_manager
from robosc.synthesis.expression_encoder import ExpressionEncoder
from support.effort import examples
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


@settings(max_examples=examples(40))
@given(conditions.filter(lambda condition: not any(isinstance(leaf, Received) for leaf in leaves(condition))))
def test_a_diagram_means_the_predicate(condition: Expression) -> None:
    encoding = Encoding(SYSTEM, make_manager("autoref"))
    predicate = ExpressionEncoder(encoding).holds(condition) & encoding.valid_states()
    diagram = extract(encoding, predicate)
    del predicate
    validate(diagram, DOMAINS)
    for state in STATES:
        expected = plain(condition, state) is True
        assert truth(diagram, state) == expected


def node(variable: str | None, starts: tuple[int, ...], children: tuple[int, ...]) -> DecisionNode:
    return DecisionNode("A", variable, starts, children)


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
        ([node("flag", (0, 1), (0, 1))], 3, "the root is not a node"),
    ],
)
def test_broken_diagrams_are_refused(nodes: list[DecisionNode], root: int, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        validate(DecisionDiagram(tuple(nodes), root), DOMAINS)


def test_a_place_is_tested_once_and_in_one_order() -> None:
    """A file could otherwise make a path that is as long as the file, for every state."""
    domains = diagram_domains(SYSTEM)
    flag = DecisionNode("A", "flag", (0, 1), (0, 1))
    again = DecisionDiagram((flag, DecisionNode("A", "flag", (0, 1), (2, 1))), 3)
    with pytest.raises(ValueError, match=r"'A\.flag' is tested before and after something else, or twice"):
        validate(again, domains)
    small = DecisionNode("A", "small", (0, 1), (2, 1))
    validate(DecisionDiagram((flag, small), 3), domains)
    crossed = (flag, small, DecisionNode("A", "small", (0, 1), (0, 1)), DecisionNode("A", "flag", (0, 1), (4, 0)))
    with pytest.raises(ValueError, match="is tested before and after something else"):
        validate(DecisionDiagram((*crossed, DecisionNode("A", None, (0, 1), (3, 5))), 6), domains)
