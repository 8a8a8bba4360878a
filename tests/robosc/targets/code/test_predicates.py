"""The logic in two predicates is Kleene's, as the slow evaluator has it."""

from itertools import product

import pytest

from robosc.expressions import values
from robosc.targets.code.predicates import Logic, Predicate

LOGIC: Logic[bool] = Logic(
    True,
    False,
    all,
    any,
    lambda a: not a,
    lambda a, b: not a or b,
    lambda operator, a, b: (a == b) is (operator == "="),
)

FORMS = [
    *((value, LOGIC.known(value)) for value in (True, False)),
    # These could be unknown elsewhere.
    *((value, Predicate(value is True, value is False)) for value in (True, False, None)),
]


def _is(predicate: Predicate[bool], value: bool | None) -> bool:
    return (predicate.true, predicate.false) == (value is True, value is False)


@pytest.mark.parametrize(("left", "right"), list(product(FORMS, FORMS)))
def test_operators(left: tuple[bool | None, Predicate[bool]], right: tuple[bool | None, Predicate[bool]]) -> None:
    (a, first), (b, second) = left, right
    assert _is(LOGIC.connected("and", [first, second]), values.and_(a, b))
    assert _is(LOGIC.connected("or", [first, second]), values.or_(a, b))
    assert _is(LOGIC.implication(first, second), values.implies(a, b))
    assert _is(LOGIC.compared("=", first, second), values.equal(a, b))
    assert _is(LOGIC.compared("!=", first, second), values.unequal(a, b))


@pytest.mark.parametrize(("value", "form"), FORMS)
def test_one_condition(value: bool | None, form: Predicate[bool]) -> None:
    assert _is(LOGIC.opposite(form), values.not_(value))
    assert LOGIC.knownness(form) is (value is not None)


def test_a_condition_that_is_known_somewhere() -> None:
    assert _is(LOGIC.where(False, True), None)
    assert LOGIC.where(True, False) == LOGIC.known(False)
