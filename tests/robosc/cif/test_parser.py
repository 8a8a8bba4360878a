"""The parser of CIF against its twin, on texts that are sound, damaged and hostile."""

from random import Random

import pytest

from robosc.cif.parser import parse
from robosc.cif.syntax import Binary, Expression, If, Invariant, Name, Root, Unary
from robosc.cif.tokens import tokenize
from robosc.errors import Diagnostic, LanguageError
from robosc.source import SourceFile
from support.cif_language_twin import accepts
from support.cif_texts import EXPRESSIONS, INVALID_EXPRESSIONS, LANGUAGE
from support.effort import examples


def errors(text: str) -> tuple[Diagnostic, ...]:
    """Syntax errors of a text."""
    try:
        parse(SourceFile("m.cif", text))
    except LanguageError as error:
        assert {item.code for item in error.diagnostics} == {"cif-syntax-error"}
        return error.diagnostics
    return ()


def expression(text: str) -> Expression:
    """The tree of an expression."""
    (found,) = parse(SourceFile("m.cif", f"invariant {text};")).body
    assert isinstance(found, Invariant)
    return found.predicate


def shape(tree: Expression) -> str:
    """An expression with all its brackets."""
    match tree:
        case Binary(operator=operator, left=left, right=right):
            return f"({shape(left)} {operator} {shape(right)})"
        case Unary(operator=operator, operand=operand):
            return f"({operator} {shape(operand)})"
        case Name():
            return str(tree)
        case _:
            return str(getattr(tree, "value", type(tree).__name__))


def test_whole_language_is_read() -> None:
    assert errors(LANGUAGE) == ()
    assert accepts(LANGUAGE)


@pytest.mark.parametrize("text", EXPRESSIONS)
def test_expressions(text: str) -> None:
    text = f"invariant {text};"
    assert errors(text) == ()
    assert accepts(text)


@pytest.mark.parametrize("text", INVALID_EXPRESSIONS)
def test_invalid_expressions(text: str) -> None:
    text = f"invariant {text};"
    assert errors(text)
    assert not accepts(text)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("not x = 1", "((not x) = 1)"),
        ("1 <= x <= 5", "((1 <= x) <= 5)"),
        ("a or b and c => d", "((a or (b and c)) => d)"),
        ("1 - 2 - 3", "((1 - 2) - 3)"),
        ("- a * b + c", "(((- a) * b) + c)"),
        ("not a and b", "((not a) and b)"),
        ("a + b < c * d = e", "(((a + b) < (c * d)) = e)"),
    ],
)
def test_precedence(text: str, expected: str) -> None:
    assert shape(expression(text)) == expected


def test_names() -> None:
    found = [expression(text) for text in ("$plant", "a.$final.b", "a.final", ".a.b", "^a")]
    assert [str(name) for name in found] == ["plant", "a.final.b", "a.final", ".a.b", "^a"]
    assert [name.root for name in found if isinstance(name, Name)] == [
        Root.HERE, Root.HERE, Root.HERE, Root.SCOPE, Root.SPECIFICATION,
    ]  # fmt: skip


def test_tokens_are_the_longest() -> None:
    assert tokenize("0..5<=>a:=b..c.d // x\n/* * / **/1.5e3.x").texts[:-3] == [
        "0", "..", "5", "<=>", "a", ":=", "b", "..", "c.d", "1.5e3", ".x",
    ]  # fmt: skip


def test_what_follows_the_colon_decides_between_automaton_and_invariant() -> None:
    body = parse(SourceFile("m.cif", "requirement r: c needs p; requirement q: location: initial; end")).body
    assert [type(item).__name__ for item in body] == ["Invariant", "Component"]
    assert errors("requirement r: invariant p;")


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("plant p:\n  location\n", (3, 1)),
        ("plant p:\n  location a:\n    initial\n    marked;\nend", (4, 5)),
        ("const int N 3;", (1, 13)),
        ("controllable a.b;", (1, 14)),
        ("controllable when;", (1, 14)),
        ("/* never closed", (1, 1)),
        ("plant p: location; end end", (1, 24)),
        ('group g: import "a.cif"; end', (1, 10)),
        ("plant p: location: edge a; controllable b; end", (1, 28)),
        ("invariant #;", (1, 11)),
        ("invariant 99999999999;", (1, 11)),
        ("initial;", (1, 1)),
        ("plant p: controllable a; end", (1, 26)),
    ],
)
def test_place_of_an_error(text: str, place: tuple[int, int]) -> None:
    found = errors(text)
    assert len(found) == 1, found
    assert found[0].location is not None
    assert (found[0].location.line, found[0].location.column) == place, found
    assert found[0].fix


def test_several_errors_are_reported_in_one_run() -> None:
    text = "const int = 3;\nplant p:\n  controllable a 3;\n  location x:\n    edge a goto;\n    initial;\nend\nalg y;\n"
    assert [item.location.line for item in errors(text) if item.location] == [1, 3, 5, 8]


@pytest.mark.random
@pytest.mark.parametrize("seed", range(examples(3)))
def test_damaged_texts_are_refused_by_both_or_neither(seed: int) -> None:
    random = Random(seed)
    whole = tokenize(LANGUAGE).texts[:-3]
    for _ in range(8):
        tokens = list(whole)
        for _ in range(random.randint(1, 2)):
            place = random.randrange(len(tokens))
            match random.randrange(4):
                case 0:
                    del tokens[place]
                case 1:
                    tokens.insert(place, random.choice(whole))
                case 2:
                    tokens[place] = random.choice(whole)
                case _:
                    other = random.randrange(len(tokens))
                    tokens[place], tokens[other] = tokens[other], tokens[place]
        text = " ".join(tokens)
        assert (not errors(text)) == accepts(text), text


@pytest.mark.parametrize(
    "text",
    [
        "invariant " + "(" * 100_000,
        "invariant " + "(" * 3_000 + "1" + ")" * 3_000 + ";",
        "invariant " + "not " * 50_000 + "a;",
        "invariant " + "-" * 50_000 + "1;",
        "invariant " + "1 + " * 50_000 + "1 = 2;",
        "invariant a" + "[0]" * 50_000 + ";",
        "invariant " + "<int>" * 50_000 + "1;",
        "invariant " + "{" * 50_000,
        "group g: " * 20_000,
        "alg " + "list " * 50_000 + "int x;",
        "invariant " + "if a: " * 20_000,
        "invariant if a: 1 " + "elif a: 1 " * 50_000 + "else 2 end;",
        "plant p: location: edge a do " + "if a: " * 20_000,
        "plant p: location: edge a do " + "(" * 20_000,
        "func int f(): " + "while true: " * 20_000,
        "invariant " + "9" * 1_000_000 + ";",
        "invariant 1e999999999 = 1.0;",
        "controllable " + "a" * 100_000 + ";",
        "/*" * 100_000,
        '"' * 10_000,
        "é" * 5_000,
        "\0",
        "@a" * 50_000,
    ],
    ids=lambda text: text[:30],
)
def test_hostile_texts_end_in_an_error(text: str) -> None:
    found = errors(text)
    assert len(found) <= 100
    assert found or "1e9" in text


def test_long_rows_of_logic_are_read() -> None:
    depth, tree = 0, expression(" or ".join(["a"] * 20_000))
    while isinstance(tree, Binary):
        depth, tree = depth + 1, tree.left
    assert depth < 20


def test_branches_keep_their_order() -> None:
    tree = expression("if a, b: 1 elif c: 2 else 3 end = 1")
    assert isinstance(tree, Binary)
    assert isinstance(tree.left, If)
    assert [len(guards) for guards, _ in tree.left.branches] == [2, 1]
