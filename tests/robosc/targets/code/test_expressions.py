"""Typed expressions are printed with the parentheses that they need."""

from random import Random

import pytest

from robosc.expressions import BooleanType, IntegerType
from robosc.targets.code.c.expressions import C
from robosc.targets.code.expressions import Code, Kind, Sort, Unknown, call, integer, literal, operation, place
from robosc.targets.code.python.expressions import PYTHON, code_text

A, B, D = (place(name, BooleanType()) for name in "abd")
N = place("n", IntegerType(0, 9))


@pytest.mark.parametrize(
    ("code", "python", "c"),
    [
        (operation("and", operation("or", A, B), D), "(a or b) and d", "(a || b) && d"),
        (operation("or", operation("and", A, B), D), "a and b or d", "(a && b) || d"),
        (operation("not", operation("=", N, integer(3))), "not n == 3", "!(n == 3)"),
        (operation("-", N, operation("-", N, integer(1))), "n - (n - 1)", "n - (n - 1)"),
        (operation("-", operation("-", N, integer(1)), N), "n - 1 - n", "(n - 1) - n"),
        (operation("*", operation("+", N, integer(1)), integer(-2)), "(n + 1) * -2", "(n + 1) * (-2)"),
        (operation("if", operation("<", N, integer(2)), N, integer(2)), "(n if n < 2 else 2)", "(n < 2) ? n : 2"),
        (operation("is true", call("f", operation("or", A, B))), "f(a or b) is True", "f(a || b) == 1"),
    ],
)
def test_both_languages(code: Code, python: str, c: str) -> None:
    assert (PYTHON.text(code), C.text(code)) == (python, c)


def _random_code(dice: Random, depth: int) -> Code:
    if depth == 0:
        return dice.choice((A, B, N, integer(dice.randrange(-3, 4))))
    operator = dice.choice(("and", "or", "not", "negate", "+", "-", "*", "=", "<", ">=", "if", "between"))
    count = {"and": 3, "or": 3, "not": 1, "negate": 1, "if": 3, "between": 3}.get(operator, 2)
    return operation(operator, *(_random_code(dice, dice.randrange(depth)) for _ in range(count)))


def _bracketed(code: Code) -> str:
    """The text with parentheses around every operand."""
    if code.kind is not Kind.OPERATION:
        return f"({code.word})"
    shape, operands = PYTHON.shapes[code.word], [_bracketed(item) for item in code.operands]
    return f"({shape.text.join(operands) if code.word in ('and', 'or') else shape.text.format(*operands)})"


def test_python_means_the_same_with_fewer_parentheses() -> None:
    dice = Random(0)
    for _ in range(3000):
        code = _random_code(dice, 4)
        names = {"a": dice.random() < 0.5, "b": dice.random() < 0.5, "n": dice.randrange(10)}
        assert eval(code_text(code), {}, names) == eval(_bracketed(code), {}, names), code_text(code)


def test_what_an_expression_reads_and_calls() -> None:
    code = operation("and", A, operation("<", call("f", N), literal("7", Sort.INTEGER, 7)))
    assert {piece.word for piece in code.pieces() if piece.kind in (Kind.PLACE, Kind.CALL)} == {"a", "f", "n"}


def test_a_value_keeps_what_is_known_about_it_in_a_local_variable() -> None:
    code = call("f", N).typed(IntegerType(2, 5), Unknown.NAN)
    held = code.held_in("x")
    assert (held.word, held.sort, held.unknown, held.low, held.high) == ("x", Sort.INTEGER, Unknown.NAN, 2, 5)
    assert not held.is_within(0, 9)
    assert N.is_within(0, 9) and not N.is_within(0, 8)
