"""Statements are printed in both languages, and list what they read."""

from random import Random

from robosc.expressions import BooleanType, IntegerType
from robosc.targets.code.c import statements as c99
from robosc.targets.code.expressions import TRUE_CODE, Code, Sort, call, integer, operation, place, variable, words_of
from robosc.targets.code.python import statements as python
from robosc.targets.code.python.expressions import code_text
from robosc.targets.code.statements import Assign, Block, Comment, Do, If, Let, Return, Statement, codes, when

A, B = (place(name, BooleanType()) for name in "ab")
N, M = (place(name, IntegerType(0, 9)) for name in "nm")
BLOCK: Block = [
    Comment("Count."),
    Let(M, operation("+", N, integer(1), sort=Sort.INTEGER)),
    If([(A, [Assign(N, M)]), (operation("=", M, integer(3)), [Do(call("f", M))])], [Assign(N, integer(2), "+")]),
    when(B, Return(operation("not", A))),
    Return(TRUE_CODE),
]


def test_python() -> None:
    assert python.statement_lines(BLOCK) == [
        "# Count.",
        "m = n + 1",
        "if a:",
        "    n = m",
        "elif m == 3:",
        "    f(m)",
        "else:",
        "    n += 2",
        "if b:",
        "    return not a",
        "return True",
    ]


def test_c() -> None:
    assert c99.statement_lines(BLOCK) == [
        "/* Count. */",
        "const int64_t m = n + 1;",
        "if (a) {",
        "    n = m;",
        "} else if (m == 3) {",
        "    f(m);",
        "} else {",
        "    n += 2;",
        "}",
        "if (b) {",
        "    return !a;",
        "}",
        "return true;",
    ]


def test_declarations_of_c_are_constant_unless_they_have_a_type_of_their_own() -> None:
    assert c99.statement_lines([Let(variable("old"), variable("*s"), "const state_t"), *c99.unused("s")]) == [
        "const state_t old = *s;",
        "(void)s;",
    ]


def test_what_statements_read_write_and_call() -> None:
    assert words_of(codes(BLOCK)) == {"a", "b", "f", "m", "n"}
    assert words_of(codes([If([(A, [Return(B)])], [Assign(N, M)])])) == {"a", "b", "m", "n"}
    old = Code(N.kind, "old.n", (variable("old"),))
    assert words_of([operation("+", old, integer(1))]) == {"old", "old.n"}


def _random_block(dice: Random, depth: int) -> list[Statement]:
    found: list[Statement] = []
    for _ in range(dice.randrange(1, 4)):
        target, value = dice.choice((N, M)), dice.choice((N, M, integer(dice.randrange(4))))
        found.append(Assign(target, value, dice.choice(("", "+"))))
        if depth:
            tests = [dice.choice((A, B, operation("<", N, M))) for _ in range(dice.randrange(1, 3))]
            branches = [(test, _random_block(dice, depth - 1)) for test in tests]
            found.append(If(branches, _random_block(dice, depth - 1) if dice.random() < 0.5 else ()))
    return found


def _execute(block: Block, names: dict[str, int]) -> None:
    for item in block:
        match item:
            case Assign(target, value, operator):
                before = names[target.word] if operator else 0
                names[target.word] = before + eval(code_text(value), {}, names)
            case If(branches, otherwise):
                chosen = (body for test, body in branches if eval(code_text(test), {}, names))
                _execute(next(chosen, otherwise), names)


def test_printed_python_does_what_the_statements_say() -> None:
    dice = Random(0)
    for _ in range(300):
        block = _random_block(dice, 2)
        names = {"a": dice.randrange(2), "b": dice.randrange(2), "n": dice.randrange(4), "m": dice.randrange(4)}
        executed, run = dict(names), dict(names)
        _execute(block, executed)
        exec("\n".join(python.statement_lines(block)), {}, run)
        assert run == executed
