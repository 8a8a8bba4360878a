"""Predicates over bits as diagrams over values: reduced, and the same from every engine."""

from itertools import pairwise, product

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robosc.automata import DiscreteVariable
from robosc.automata.compile import compile_expression
from robosc.automata.state import Subject, subject_domain, subjects
from robosc.errors import UnsupportedModelError
from robosc.expressions import Expression, IntegerType, Received, leaves
from robosc.supervisor import DecisionDiagram
from robosc.supervisor.diagram import diagram_domains, evaluate, validate
from robosc.synthesis import compiled
from robosc.synthesis.blocks import Blocks
from robosc.synthesis.diagrams import extract
from robosc.synthesis.encoding import Encoding
from robosc.synthesis.engines import make_manager
from robosc.synthesis.expression_encoder import ExpressionEncoder
from support.effort import examples
from support.random_expressions import SYSTEM, conditions
from support.systems import automaton, operation, read, system

_without_data = conditions.filter(lambda condition: not any(isinstance(leaf, Received) for leaf in leaves(condition)))


def diagram_of(condition: Expression, engine: str) -> DecisionDiagram:
    encoding = Encoding(SYSTEM, make_manager(engine))
    return extract(encoding, ExpressionEncoder(encoding).holds(condition))


@settings(max_examples=examples(40))
@given(condition=_without_data)
def test_diagrams_are_reduced_and_independent_of_the_engine(condition: Expression) -> None:
    pytest.importorskip("dd.cudd", reason="dd's C extension is not installed")
    diagram = diagram_of(condition, "cudd")
    assert diagram == diagram_of(condition, "autoref")
    validate(diagram, diagram_domains(SYSTEM))
    assert len(set(diagram.nodes)) == len(diagram.nodes)
    for node in diagram.nodes:
        assert len(node.children) > 1
        assert all(first != second for first, second in pairwise(node.children))
    # Every node is part of it.
    met = {diagram.root} | {child for node in diagram.nodes for child in node.children}
    assert met >= set(range(2, len(diagram.nodes) + 2))


@settings(max_examples=examples(25))
@given(condition=_without_data)
def test_bits_among_each_other_give_the_same_values(condition: Expression) -> None:
    """All integers in one block: the diagram is reduced, in an order, and true where the condition is."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("robosc.synthesis.encoding.blocks_of", lambda made: Blocks((subjects(made)[::-1],), {}))
        diagram = diagram_of(condition, "autoref")
    domains = diagram_domains(SYSTEM)
    validate(diagram, domains)
    assert len(set(diagram.nodes)) == len(diagram.nodes)
    assert all(first != second for node in diagram.nodes for first, second in pairwise(node.children))
    function = compile_expression(condition, {subject: place for place, subject in enumerate(subjects(SYSTEM))})
    for state in product(*(subject_domain(SYSTEM, subject) for subject in subjects(SYSTEM))):
        values = {(item.automaton, item.variable): value for item, value in zip(subjects(SYSTEM), state, strict=True)}
        indices = {place: domains[place].index(value) for place, value in values.items()}
        assert evaluate(diagram, lambda *place, at=indices: at[place]) == (function(state, {}) is True)


@settings(max_examples=examples(60))
@given(condition=_without_data, together=st.integers(1, 4), maximum=st.integers(1, 60))
def test_the_kernel_takes_diagrams_apart_as_python_does(condition: Expression, together: int, maximum: int) -> None:
    """The same nodes with the same numbers, or the same reason; in blocks of bits that stand among each other, too."""
    pytest.importorskip("dd.cudd", reason="dd's C extension is not installed")
    places = subjects(SYSTEM)
    blocks = tuple(places[first : first + together] for first in range(0, len(places), together))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("robosc.synthesis.encoding.blocks_of", lambda made: Blocks(blocks, {}))
        encoding = Encoding(SYSTEM, make_manager("cudd"))
    predicate = ExpressionEncoder(encoding).holds(condition)
    nodes = len(encoding.manager)
    answers: list[DecisionDiagram | str] = []
    for kernel in (compiled.kernel_of, lambda manager: None):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("robosc.synthesis.diagrams.kernel_of", kernel)
            patch.setattr("robosc.synthesis.diagrams.MAXIMUM_BRANCHES", 12)
            try:
                answers.append(extract(encoding, predicate, maximum))
            except UnsupportedModelError as error:
                answers.append(str(error))
        # Intermediate diagrams are given back.
        assert len(encoding.manager) == nodes
    assert answers[0] == answers[1]


def test_a_diagram_has_a_limit_in_all(engine: str) -> None:
    made = [automaton(n, ["l -e-> l"], variables=[DiscreteVariable("x", IntegerType(0, 99), (0,))]) for n in "AB"]
    encoding = Encoding(system(*made, conditions={"e": operation(read("A.x"), "<", read("B.x"))}), make_manager(engine))
    less = ExpressionEncoder(encoding).holds(operation(read("A.x"), "<", read("B.x")))
    # One hundred ranges of the one, and for all but its last value two of the other.
    assert len(extract(encoding, less, 400).nodes) == 100
    with pytest.raises(UnsupportedModelError, match=r"relates the values of '[AB]\.x' to those of other variables"):
        extract(encoding, less, 250)


def counter(bits: int, engine: str) -> Encoding:
    variable = DiscreteVariable("x", IntegerType(0, 2**bits - 1), (0,))
    return Encoding(system(automaton("A", ["l -e-> l"], variables=[variable])), make_manager(engine))


def test_every_other_value(engine: str) -> None:
    variable = DiscreteVariable("x", IntegerType(0, 9), (0,))
    encoding = Encoding(system(automaton("A", ["l -e-> l"], variables=[variable])), make_manager(engine))
    odd = encoding.manager.var(encoding.subjects[Subject("A", "x")].names[-1])
    diagram = extract(encoding, odd)
    assert [node.starts for node in diagram.nodes] == [tuple(range(10))]
    assert [evaluate(diagram, lambda *_, index=index: index) for index in range(10)] == [False, True] * 5


def test_codes_beyond_the_last_value_leave_no_branch(engine: str) -> None:
    """5 of 8 codes are values: a predicate that differs only among the others is constant."""
    variable = DiscreteVariable("x", IntegerType(0, 4), (0,))
    encoding = Encoding(system(automaton("A", ["l -e-> l"], variables=[variable])), make_manager(engine))
    bits = encoding.subjects[Subject("A", "x")]
    assert extract(encoding, encoding.code(bits, 6)) == DecisionDiagram((), 0)
    assert extract(encoding, ~encoding.code(bits, 7)) == DecisionDiagram((), 1)


def test_too_many_ranges_are_refused_at_once(engine: str) -> None:
    """A condition on the last of 31 bits has 2^31 ranges: no list of these is ever begun."""
    encoding = counter(31, engine)
    odd = encoding.manager.var(encoding.subjects[Subject("A", "x")].names[-1])
    with pytest.raises(UnsupportedModelError, match=r"more than 100000 ranges of the values of 'A\.x'"):
        extract(encoding, odd)
