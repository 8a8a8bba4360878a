"""Expressions as predicates, against their evaluation for every state and all data."""

from itertools import product
from typing import Any

import pytest
from hypothesis import given, settings

from robosc.automata.state import Subject, subject_domain, subjects
from robosc.errors import UnsupportedModelError
from robosc.expressions import Binary, Constant, Expression, VariableRead
from robosc.expressions.evaluate import evaluate
from robosc.synthesis.encoding import Encoding
from robosc.synthesis.engines import make_manager
from robosc.synthesis.expression_encoder import ExpressionEncoder, Number, Partition, Truth
from support.effort import examples
from support.random_expressions import SYSTEM, conditions, numbers

PLACES = subjects(SYSTEM)
LIST, SEEN = SYSTEM.inputs


class Valuations:
    """An encoding of the system of the expressions, with every valuation and its assignment of bits."""

    def __init__(self, engine: str) -> None:
        self.encoding = Encoding(SYSTEM, make_manager(engine))
        self.inputs = self.encoding.inputs_of("e")
        self.encoder = ExpressionEncoder(self.encoding, self.inputs)
        domains = [subject_domain(SYSTEM, subject) for subject in PLACES]
        self.all = [
            (state, element, seen)
            for state in product(*domains)
            for element in (None, 0, 1, 2)
            for seen in (False, True)
        ]

    def assignment(self, state: tuple[Any, ...], element: int | None, seen: bool) -> dict[str, bool]:
        found: dict[str, bool] = {}
        for subject, value in zip(PLACES, state, strict=True):
            bits = self.encoding.subjects[subject]
            found |= self._bits(bits, bits.domain.index(value))
        bits = self.inputs[LIST.path]
        assert bits.known
        found |= {**self._bits(bits, element or 0), bits.known: element is not None}
        return found | self._bits(self.inputs[SEEN.path], int(seen))

    @staticmethod
    def _bits(bits: Any, index: int) -> dict[str, bool]:
        return {name: bool((index >> place) & 1) for place, name in enumerate(reversed(bits.names))}

    def holds(self, predicate: Any, assignment: dict[str, bool]) -> bool:
        result = self.encoding.manager.let(assignment, predicate)
        assert result in (self.encoding.manager.true, self.encoding.manager.false)
        return bool(result == self.encoding.manager.true)


def plain(expression: Expression, state: tuple[Any, ...], element: int | None, seen: bool) -> Any:
    values = dict(zip(PLACES, state, strict=True))
    data = {LIST.path: element, SEEN.path: seen}
    return evaluate(
        expression,
        lambda automaton, variable: values[Subject(automaton, variable)],
        lambda automaton: values[Subject(automaton)],
        lambda path: data[path],
    )


@pytest.fixture(scope="module", params=["cudd", "oxidd", "autoref"])
def valuations(request: pytest.FixtureRequest) -> Valuations:
    if request.param == "cudd":
        pytest.importorskip("dd.cudd", reason="dd's C extension is not installed")
    return Valuations(request.param)


@settings(max_examples=examples(60))
@given(condition=conditions)
def test_conditions(valuations: Valuations, condition: Expression) -> None:
    translated = valuations.encoder.translate(condition)
    assert isinstance(translated, Truth)
    for valuation in valuations.all[:: 1 + len(valuations.all) // 150]:
        assignment = valuations.assignment(*valuation)
        value = plain(condition, *valuation)
        assert valuations.holds(translated.true, assignment) == (value is True), valuation
        assert valuations.holds(translated.false, assignment) == (value is False), valuation


@settings(max_examples=examples(60))
@given(number=numbers)
def test_numbers(valuations: Valuations, number: Expression) -> None:
    translated = valuations.encoder.translate(number)
    for valuation in valuations.all[:: 1 + len(valuations.all) // 100]:
        assignment = valuations.assignment(*valuation)
        value = plain(number, *valuation)
        if isinstance(translated, Partition):
            cases = [case for case, predicate in translated.cases if valuations.holds(predicate, assignment)]
            assert cases == ([] if value is None else [value])
            continue
        assert isinstance(translated, Number)
        assert valuations.holds(translated.known, assignment) == (value is not None)
        if value is not None:
            bits = [valuations.holds(bit, assignment) for bit in translated.vector.bits]
            unsigned = sum(bit << place for place, bit in enumerate(bits))
            assert unsigned - (bits[-1] << len(bits)) == value
            assert translated.vector.low <= value <= translated.vector.high


def test_too_many_doubles_are_refused(valuations: Valuations, monkeypatch: pytest.MonkeyPatch) -> None:
    half, third = (Binary("/", VariableRead("A", name), Constant(n)) for name, n in (("wide", 2), ("small", 3)))
    condition = Binary("<", Binary("+", half, third), Constant(1.5))
    valuations.encoder.holds(condition)
    monkeypatch.setattr("robosc.synthesis.expression_encoder.MAXIMUM_PARTITION", 10)
    with pytest.raises(UnsupportedModelError, match="more than 10 combinations"):
        valuations.encoder.holds(condition)
