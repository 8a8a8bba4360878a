"""Tests of updates that can leave a variable's range, where conditions say more than types; against enumeration."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robosc.expressions.evaluate import evaluate
from support.effort import examples
from support.models import checked

LOW, HIGH = 0, 5
"""The range of the variables; what is received has another one."""
RECEIVED_LOW, RECEIVED_HIGH = -2, 7

MODEL = f"""robot R {{
    constant TOP: integer = {HIGH}
    component C {{
        outgoing message m with type: integer({RECEIVED_LOW}..{RECEIVED_HIGH})
        incoming message p with type: none
        behaviour {{
            variable n: integer({LOW}..{HIGH})
            variable k: integer({LOW}..{HIGH})
            variable lit: boolean
            initial marked state s {{ on response from m do n := {{update}}, k := value * 0 }}
        }}
    }}
    requirement p needs C.n = 0 and C.k = 0 and C.lit
}}"""


def warns(update: str) -> bool:
    """Return True if there is a warning about the update."""
    found = checked(MODEL.replace("{update}", update))
    assert {item.code for item in found.diagnostics} <= {"may-leave-range"}, found.diagnostics
    return bool(found.diagnostics)


def leaves_range(update: str) -> bool:
    """Return True if some values really take the variable out of its range."""
    model = checked(MODEL.replace("{update}", update)).model_or_raise()
    behaviour = model.components[0].behaviour
    assert behaviour is not None
    expression = behaviour.transitions[0].updates[0].expression
    values = [
        evaluate(expression, lambda _, name: {"n": n, "k": k, "lit": lit}[name], lambda _: "s", lambda _: received)  # noqa: B023
        for n in range(LOW, HIGH + 1)
        for k in range(LOW, HIGH + 1)
        for lit in (False, True)
        for received in range(RECEIVED_LOW, RECEIVED_HIGH + 1)
    ]
    return any(value is not None and not LOW <= value <= HIGH for value in values)


@pytest.mark.parametrize(
    ("update", "leaves"),
    [
        ("if n = 5 then 0 else n + 1", False),
        ("if n = 4 then 0 else n + 1", True),
        ("if n != 5 then n + 1 else 0", False),
        ("if C.n != TOP then n + 1 else 0", False),
        ("if n < TOP then n + 1 else n", False),
        ("if n < TOP - 1 then n + 2 else n", False),
        ("if n < TOP then n + 2 else n", True),
        ("if 5 > n then n + 1 else n", False),
        ("if n <= 5 then n + 1 else n", True),
        ("if n > 0 then n - 1 else 5", False),
        ("if n >= 1 then n - 1 else 5", False),
        ("if n < 4.5 then n + 1 else n", False),
        ("if n = 4.5 then n + 9 else n", False),
        ("if n > 4.5 then n - 5 else n + 1", False),
        ("if !(n = 5) then n + 1 else 0", False),
        ("if lit and n < 5 then n + 1 else n", False),
        ("if lit or n < 5 then n + 1 else n", True),
        ("if lit or n = 5 then 0 else n + 1", False),
        ("if n = 1 or n = 4 then n + 1 else n", False),
        ("if n != 5 and n != 4 then n + 2 else 0", False),
        ("if n != 4 and n != 5 then n + 2 else 0", False),
        ("if k < 5 then n + 1 else n", True),
        ("if k < 5 then k + 1 else n", False),
        ("if value >= 0 and value <= 5 then value else n", False),
        ("if value >= 0 then value else n", True),
        ("if n > 5 then n + 1 else n", False),
        ("if n < 9 then n else n + 1", False),
        ("if n = 5 then 0 else if n = 0 then 3 else n + 1", False),
        ("if n < 5 then (if n > 0 then n - 1 else n + 1) else 0", False),
        ("(if n < 5 then n + 1 else 0) + (if n = 5 then 1 else 0)", True),
        ("if n = 5 then 0 else (if lit then n + 1 else n) + 1", True),
    ],
)
def test_what_conditions_say_counts(update: str, leaves: bool) -> None:
    assert warns(update) is leaves
    assert leaves_range(update) <= leaves


def test_what_a_condition_says_counts_in_its_branches_only() -> None:
    assert not warns("if n < 5 then n + 1 else 0")
    assert warns("(if n < 5 then n else 0) + n")
    assert warns("(if n < 5 then n + 1 else 0) * 0 + n + 1")


def test_the_condition_of_a_provide_statement_counts() -> None:
    text = """robot R {{ component C {{
        incoming message p with type: integer(0..5)
        outgoing message m with type: none
        behaviour {{ variable n: integer(0..6) on response from m do n := 0 initial marked state s {{ }} }} }}
        provide p with C.n {condition} }}"""
    found = {
        condition: [item.code for item in checked(text.format(condition=condition)).diagnostics]
        for condition in ("", "if C.n < 6", "if C.n != 6", "if C.n > 0")
    }
    assert found == {"": ["may-leave-range"], "if C.n < 6": [], "if C.n != 6": [], "if C.n > 0": ["may-leave-range"]}


_READ = st.sampled_from(["n", "k", "value"])
_CONSTANT = st.integers(-3, 8).map(str) | st.sampled_from(["TOP", "TOP - 1", "2.5", "-0.5"])
_OPERATOR = st.sampled_from(["=", "!=", "<", "<=", ">", ">="])
_COMPARISON = st.builds(
    lambda a, o, b, way: f"({a} {o} {b})" if way else f"({b} {o} {a})", _READ, _OPERATOR, _CONSTANT, st.booleans()
)
_CONDITION = st.recursive(
    _COMPARISON | st.just("lit") | st.just("(n < k)"),
    lambda inner: (
        st.builds(lambda a, o, b: f"({a} {o} {b})", inner, st.sampled_from(["and", "or", "=>"]), inner)
        | inner.map(lambda a: f"(!{a})")
    ),
    max_leaves=5,
)
_UPDATE = st.recursive(
    _READ | st.integers(0, 5).map(str),
    lambda inner: (
        st.builds(lambda a, o, k: f"({a} {o} {k})", inner, st.sampled_from("+-"), st.integers(0, 2))
        | st.builds(lambda c, a, b: f"(if {c} then {a} else {b})", _CONDITION, inner, inner)
    ),
    max_leaves=6,
)


@settings(max_examples=examples(60))
@given(update=_UPDATE)
def test_no_update_that_can_leave_the_range_goes_without_a_warning(update: str) -> None:
    if leaves_range(update):
        assert warns(update)


def _n_compares(operator: str, constant: int) -> str:
    return f"n {operator} {constant}"


@settings(max_examples=examples(60))
@given(
    conditions=st.lists(st.builds(_n_compares, _OPERATOR, st.integers(-1, 6)), min_size=1, max_size=3),
    then=st.integers(-6, 6),
    otherwise=st.integers(-6, 6),
)
def test_of_one_variable_compared_with_constants_the_warning_is_exact(
    conditions: list[str], then: int, otherwise: int
) -> None:
    update = f"if {' and '.join(f'({item})' for item in conditions)} then n + {then} else n + {otherwise}"
    assert warns(update) is leaves_range(update)
