"""Linear forms against the plain meaning of expressions, at single states of wide ranges."""

from collections.abc import Mapping
from random import Random
from typing import Any

import pytest
from hypothesis import given, reject, settings
from hypothesis import strategies as st

from robosc.automata import DiscreteVariable, InputVariable, System
from robosc.automata.compile import compile_expression
from robosc.automata.state import Subject
from robosc.expressions import Binary, Call, Conditional, Constant, Expression, IntegerType, Received, Unary, Value
from robosc.verification.symbolic import expressions
from robosc.verification.symbolic.expressions import Expressions
from robosc.verification.symbolic.linear import Form, Linear
from robosc.verification.symbolic.relations import Relations
from robosc.verification.symbolic.variables import Digits, Variables
from robosc.verification.symbolic.work import TooMuchWorkError, Work
from support.effort import examples
from support.systems import automaton, edge, operation, read, received, system

RANGES = {"x": (0, 1_000_000), "y": (-70_000, 90_000), "z": (2**31 - 1_000_000, 2**31 - 1), "t": (-3, 4)}
DATUM = (-500_000, 2_000_000)
COMPARISONS = ("=", "!=", "<", "<=", ">", ">=")


def variables_of(made: System, limit: int = 200_000) -> Variables:
    """Variables whose expressions may take some work: an unlucky expression is left out."""
    return Variables(made, "auto", Work(limit, lambda: False, lambda message: None))


def wide(update: Expression, condition: Expression | None = None) -> System:
    """One automaton with wide integers, whose event brings one more, which may be unknown."""
    return system(
        automaton(
            "A",
            [edge("l -u_got-> l", x=update), "l -go-> l"],
            variables=[DiscreteVariable(name, IntegerType(*bounds), (bounds[0],)) for name, bounds in RANGES.items()],
        ),
        conditions=None if condition is None else {"go": condition},
        inputs=[InputVariable("u_got", ("d",), IntegerType(*DATUM), may_be_unknown=True)],
    )


class Dice:
    """Draws expressions and values from a seed."""

    def __init__(self, seed: int) -> None:
        self.random = Random(seed)

    def integer(self, depth: int) -> Expression:
        """An integer of wide variables, as linear as the forms show."""
        if depth == 0 or self.random.random() < 0.15:
            leaves: list[Expression] = [*(read(f"A.{name}") for name in RANGES), Received(("d",)), self.number()]
            return self.random.choice(leaves)
        one, other = self.integer(depth - 1), self.integer(depth - 1)
        shapes: list[Expression] = [
            Binary("+", one, other),
            Binary("-", one, other),
            Binary("*", one, Constant(self.random.choice((-3, 0, 1, 2, 5, 1000)))),
            Binary("*", Constant(self.random.choice((-2, 7))), other),
            Binary("div", one, Constant(self.random.choice((-4, -1, 0, 1, 2, 3, 7)))),
            Binary("mod", one, Constant(self.random.choice((-4, -1, 0, 1, 2, 3, 7)))),
            Unary("-", one),
            Call("abs", (one,)),
            Call("integer", (one,)),
            Call("min", (one, other)),
            Call("max", (one, other)),
            Call("clamp", (one, self.number(), other)),
            Conditional(self.condition(0), one, other),
        ]
        return self.random.choice(shapes)

    def number(self) -> Constant:
        """A constant, often one at which something changes."""
        bounds = [bound + step for low, high in (*RANGES.values(), DATUM) for bound in (low, high) for step in (0, -1)]
        return Constant(self.random.choice([*bounds, 0, 1, self.random.randint(-100_000, 1_000_000)]))

    def condition(self, depth: int) -> Expression:
        """A comparison of two integers."""
        return operation(self.integer(depth), self.random.choice(COMPARISONS), self.integer(depth))  # type: ignore[arg-type]

    def values(self) -> tuple[dict[str, int], int | None]:
        """A state and a datum: often extreme ones, and often such that two are near each other."""
        near = self.random.randint(-70_000, 90_000)

        def one(low: int, high: int) -> int:
            chosen = self.random.choice((low, high, low + 1, self.random.randint(low, high), near, near + 1, 0))
            return min(max(chosen, low), high)

        datum = None if self.random.random() < 0.1 else one(*DATUM)
        return {name: one(*bounds) for name, bounds in RANGES.items()}, datum


def bits(digits: Digits, value: Value | None) -> dict[str, bool]:
    """Return the bits with which some digits hold a value."""
    index = 0 if value is None else digits.values.index(value)
    held = {name: bool(index >> rank & 1) for rank, name in enumerate(reversed(digits.names))}
    return held if digits.known is None else held | {digits.known: value is not None}


def is_true(variables: Variables, predicate: Any, held: Mapping[str, bool]) -> bool:
    return bool(variables.manager.let(dict(held), predicate) == variables.manager.true)


def holding(variables: Variables, state: Mapping[str, int], datum: int | None) -> dict[str, bool]:
    held = bits(variables.data["u_got", ("d",)], datum)
    for name, value in state.items():
        held |= bits(variables.places[variables.place_of[Subject("A", name)]], value)
    return held


def meaning(variables: Variables, expression: Expression, state: Mapping[str, int], datum: int | None) -> Value | None:
    whole: list[Value] = ["l"] * len(variables.places)
    for name, value in state.items():
        whole[variables.place_of[Subject("A", name)]] = value
    return compile_expression(expression, variables.place_of)(tuple(whole), {("d",): datum})


@pytest.fixture(autouse=True)
def no_tables(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fail where values are gone through one by one."""
    monkeypatch.setattr(expressions, "FEW_VALUATIONS", 0)
    monkeypatch.setattr(expressions, "MAXIMUM_VALUATIONS", 0)


@settings(max_examples=examples(50))
@given(st.integers(0, 2**32))
def test_comparisons_are_true_false_and_unknown_where_they_are(seed: int) -> None:
    dice = Dice(seed)
    condition = dice.condition(1)
    variables = variables_of(wide(received("d"), condition))
    try:
        truth = Expressions(variables, "u_got").truth(condition)
    except TooMuchWorkError:
        reject()
    for _ in range(25):
        state, datum = dice.values()
        held, expected = holding(variables, state, datum), meaning(variables, condition, state, datum)
        assert is_true(variables, truth.true, held) == (expected is True), (condition, state, datum)
        assert is_true(variables, truth.false, held) == (expected is False), (condition, state, datum)


@settings(max_examples=examples(50))
@given(st.integers(0, 2**32))
def test_updates_write_what_they_should_or_leave_the_range(seed: int) -> None:
    dice = Dice(seed)
    update = dice.integer(2)
    made = wide(update)
    variables = variables_of(made)
    (step,) = [item for item in made.automata[0].edges if item.updates]
    try:
        beyond, result = Relations(variables, {})._update(
            made.automata[0], step.updates[0], Expressions(variables, "u_got")
        )
    except TooMuchWorkError:
        reject()
    place = variables.places[variables.place_of[Subject("A", "x")]]
    for _ in range(15):
        state, datum = dice.values()
        held, expected = holding(variables, state, datum), meaning(variables, update, state, datum)
        leaves = expected is not None and expected not in place.values
        assert is_true(variables, beyond, held) == leaves, (update, state, datum)
        written = variables.manager.let(held, result)
        kept = state["x"] if expected is None else expected
        nothing = variables.manager.false
        assert written == (nothing if leaves else variables.has_value(place.after(), kept)), (update, state, datum)


@pytest.mark.parametrize(("first", "second"), [(3, 7), (-2, 4), (5, -3)])
def test_quotients_are_divided_again(first: int, second: int) -> None:
    """A form with a divisor of its own keeps what is lost of it."""
    dice = Dice(1)
    quotient = operation(operation(read("A.x"), "+", received("d")), "div", first)
    for again in (operation(quotient, "div", second), operation(quotient, "mod", second)):
        condition = operation(again, ">", 1)
        variables = variables_of(wide(received("d"), condition), 10**7)
        truth = Expressions(variables, "u_got").truth(condition)
        for _ in range(40):
            state, datum = dice.values()
            expected, held = meaning(variables, condition, state, datum), holding(variables, state, datum)
            assert is_true(variables, truth.true, held) == (expected is True), (condition, state, datum)


def test_a_sum_of_bits_and_a_bound_take_few_nodes() -> None:
    """Three integers of twenty bits: what has to be remembered at each weight is a carry."""
    made = wide(received("d"), operation(operation(read("A.x"), "+", read("A.y")), "<=", received("d")))
    variables = variables_of(made)
    truth = Expressions(variables, "u_got").truth(operation(operation(read("A.x"), "+", read("A.y")), "<", read("A.z")))
    assert truth.true.dag_size < 600


def test_forms_are_exact() -> None:
    """Fractions stay fractions until they are whole."""
    made = wide(received("d"))
    linear = Linear(variables_of(made))
    form = linear.form(variables_of(made).places[variables_of(made).place_of[Subject("A", "t")]])
    assert form.constant == -3
    third = form.divided(3)
    assert third.times(3).divisor == 3
    assert linear.compared("=", third.times(3), form) == linear._manager.true
    assert linear.compared("<", third, Form((), 0)) == linear.compared("<", form, Form((), 0))
