"""The grammar of part A, its lexical corners, and what the parser says of broken texts."""

import string

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from robosc.errors import Diagnostic
from robosc.language import parse, syntax
from robosc.source import SourceFile
from support.effort import examples
from support.models import EXAMPLE_NAMES, EXAMPLES


def tree_of(text: str) -> syntax.File:
    parsed = parse(SourceFile("model.rscd", text))
    assert parsed.diagnostics == ()
    assert parsed.tree is not None
    return parsed.tree


def faults(text: str) -> tuple[Diagnostic, ...]:
    parsed = parse(SourceFile("model.rscd", text))
    assert parsed.tree is None
    assert parsed.diagnostics
    return parsed.diagnostics


def expression(text: str) -> syntax.Expression:
    (requirement,) = tree_of(f"robot R {{ requirement r needs {text} }}").items
    assert isinstance(requirement, syntax.Requirement)
    return requirement.expression


def shape(tree: syntax.Expression) -> str:
    """An expression with every pair of parentheses written."""
    match tree:
        case syntax.Literal(value=value):
            return repr(value)
        case syntax.Access(root=root, steps=steps):
            parts = [f".{s.text}" if isinstance(s, syntax.Name) else f"[{_inside(s)}]" for s in steps]
            return ("value" if root is None else root.text) + "".join(parts)
        case syntax.Unary(operator=operator, operand=operand):
            return f"{operator}{shape(operand)}"
        case syntax.Binary(operator=operator, left=left, right=right):
            return f"({shape(left)} {operator} {shape(right)})"
        case syntax.Conditional(condition=condition, then=then, otherwise=otherwise):
            return f"(if {shape(condition)} then {shape(then)} else {shape(otherwise)})"
        case syntax.Call(function=function, arguments=arguments):
            return f"{function.text}({', '.join(map(shape, arguments))})"
        case syntax.Quantifier(word=word, variable=variable, array=array, condition=condition):
            return f"{word.text}({variable.text} in {shape(array)}: {shape(condition)})"


def _inside(step: syntax.Index | syntax.Slice) -> str:
    if isinstance(step, syntax.Slice):
        return f"{shape(step.low)}..{shape(step.high)}"
    return shape(step.value)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("a or b and c", "(a or (b and c))"),
        ("a and b or c", "((a and b) or c)"),
        ("a = b and c", "((a = b) and c)"),
        ("b = y != 0", "(b = (y != 0))"),
        ("a = b = c", "((a = b) = c)"),
        ("a != b < c", "(a != (b < c))"),
        ("a < b + c * d", "(a < (b + (c * d)))"),
        ("a - b - c", "((a - b) - c)"),
        ("a / b * c", "((a / b) * c)"),
        ("a * !b", "(a * !b)"),
        ("!-a", "!-a"),
        ("--a", "--a"),
        ("-a + b", "(-a + b)"),
        ("!a and b", "(!a and b)"),
        ("!(a and b)", "!(a and b)"),
        ("(a or b) and c", "((a or b) and c)"),
        ("a => b", "(a => b)"),
        ("!a => !b", "(!a => !b)"),
        ("(a => b) or c", "((a => b) or c)"),
        ("a>=b", "(a >= b)"),
        ("a=!b", "(a = !b)"),
        ("a!=b", "(a != b)"),
        ("a<-b", "(a < -b)"),
        ("order and android", "(order and android)"),
        ("value.list[3].x", "value.list[3].x"),
        ("3.25", "3.25"),
        ("0.05", "0.05"),
        (r"'it\'s'", '"it\'s"'),
        (r'"a\"b\\c\n"', "'a\"b\\\\c\\n'"),
        ("^state", "state"),
        ("type and identifier", "(type and identifier)"),
        ("a // or b\n and c", "(a and c)"),
        ("a /* or b */ and c", "(a and c)"),
        ("if a then b else c or d", "(if a then b else (c or d))"),
        ("1 + if a then b else c * 2", "(1 + (if a then b else (c * 2)))"),
        ("if then then then else else", "(if then then then else else)"),
        ("if a then if b then c else d else e", "(if a then (if b then c else d) else e)"),
        ("min(a, max(b, -1)) + abs(c)", "(min(a, max(b, -1)) + abs(c))"),
        ("min(value.r[350..10]) < LIMIT", "(min(value.r[350..10]) < LIMIT)"),
        ("any(x in value.r[A..B + 1]: x > 1 or y)", "any(x in value.r[A..(B + 1)]: ((x > 1) or y))"),
        ("any(x, y)", "any(x, y)"),
        ("double(a) / integer(b)", "(double(a) / integer(b))"),
        ("f()", "f()"),
        ("any", "any"),
        ("min.max = clamp", "(min.max = clamp)"),
    ],
)
def test_expressions(text: str, expected: str) -> None:
    assert shape(expression(text)) == expected


NAMES = ("alpha", "beta", "gamma.delta", "value", "1", "2.5", "true")
OPERATORS = (*(operator for operator in "or and = != > >= < <= + - * /".split()),)
LEVELS = {"or": 1, "and": 2, "=": 3, "!=": 4, ">": 5, ">=": 5, "<": 5, "<=": 5, "+": 6, "-": 6, "*": 7, "/": 7}


def printed(tree: str | tuple[str, object, object] | tuple[str, object], level: int = 0) -> str:
    """A tree with as few parentheses as A.3 allows: the parser must find the same tree again."""
    if isinstance(tree, str):
        return tree
    if len(tree) == 2:
        operator, operand = tree
        mine = 8 if operator == "!" else 9
        text = f"{operator}{printed(operand, mine)}"  # type: ignore[arg-type]
        return text if mine >= level else f"({text})"
    operator, left, right = tree
    mine = LEVELS[operator]
    text = f"{printed(left, mine)} {operator} {printed(right, mine + 1)}"  # type: ignore[arg-type]
    return text if mine >= level else f"({text})"


def full(tree: object) -> str:
    if isinstance(tree, str):
        return {"true": "True"}.get(tree, tree)
    assert isinstance(tree, tuple)
    if len(tree) == 2:
        return f"{tree[0]}{full(tree[1])}"
    return f"({full(tree[1])} {tree[0]} {full(tree[2])})"


trees = st.recursive(
    st.sampled_from(NAMES),
    lambda inner: st.one_of(
        st.tuples(st.sampled_from(OPERATORS), inner, inner), st.tuples(st.sampled_from(["!", "-"]), inner)
    ),
    max_leaves=10,
)


@settings(max_examples=examples(60))
@given(trees)
def test_precedence_and_association_of_random_trees(tree: object) -> None:
    assert shape(expression(printed(tree))) == full(tree)  # type: ignore[arg-type]


def test_a_long_chain_needs_no_deep_recursion() -> None:
    text = " or ".join(f"a{n}" for n in range(3000))
    assert shape(expression(text)).count(" or ") == 2999


@pytest.mark.parametrize(
    ("text", "code", "column"),
    [
        ("a => b => c", "ambiguous-implication", 3),
        ("a => b or c", "ambiguous-implication", 3),
        ("a = b => c", "ambiguous-implication", 7),
        ("-!a", "syntax-error", 2),
        ("1 .5", "syntax-error", 3),
        ("2147483648", "integer-too-large", 1),
        ("9" * 5000, "integer-too-large", 1),
        ("é", "syntax-error", 1),
        ("state", "syntax-error", 1),
        ("a ->b", "syntax-error", 3),
        ("(a or (b and c)", "syntax-error", 1),
        ("a or b) and c", "syntax-error", 7),
        ("a or ()", "syntax-error", 7),
        ("a or !", "syntax-error", 8),
    ],
)
def test_broken_expressions(text: str, code: str, column: int) -> None:
    prefix = "robot R { requirement r needs "
    (found,) = faults(prefix + text + " }")
    assert (found.code, found.location and found.location.column) == (code, len(prefix) + column)


def test_every_parenthesis_without_a_partner_is_found() -> None:
    found = faults("robot R { requirement r needs (a or b requirement r needs a) and c }")
    assert [item.message for item in found] == ["this '(' is never closed", "this ')' closes nothing"]


@pytest.mark.parametrize("opening", ["(", "!(", "-(", "a = (", "a => ("])
def test_parentheses_up_to_the_limit_need_no_recursion(opening: str) -> None:
    depth = 190
    assert shape(expression(opening * depth + "b" + ")" * depth)).count("b") == 1


def test_arrays_of_arrays_up_to_the_limit() -> None:
    (found,) = tree_of("library L { datatype object O { x: " + "array(" * 190 + "double" + ")" * 190 + " } }").items
    assert isinstance(found, syntax.ObjectDefinition)
    type_, depth = found.properties[0].type, 0
    while isinstance(type_, syntax.ArrayType):
        type_, depth = type_.element, depth + 1
    assert depth == 190
    assert (type_.location.column, type_.location.length) == (36 + 190 * 6, 6)


@pytest.mark.parametrize(
    ("text", "column", "words"),
    [("array(array(double)", 1, "never closed"), ("array(double))", 14, "closes nothing"), ("double)", 7, "closes")],
)
def test_parentheses_of_arrays_are_matched(text: str, column: int, words: str) -> None:
    prefix = "library L { datatype object O { x: "
    (found,) = faults(f"{prefix}{text} }} }}")
    assert (found.code, found.location and found.location.column) == ("syntax-error", len(prefix) + column)
    assert words in found.message


@pytest.mark.parametrize(
    ("text", "fix"),
    [
        ("robot R { requirement r needs a && b }", "Write 'and' for '&&'."),
        ("robot R { requirement r needs a || b }", "Write 'or' for '||'."),
        ("robot R { requirement r needs a == b }", "Write '=' once: it compares."),
        ("robot R { requirement r needs Not a }", "Write 'not' instead of 'Not'."),
        ("robot R { component Caméra { } }", "Names are made of the letters A to Z, digits and '_' only."),
        ("robot R { component C { } ; }", "Remove the ';': nothing ends with one."),
        ("robot R { requirement r needs state = a }", "If 'state' is meant as a name, write '^state'."),
        ("robot R { component C { incomming message m with type: none } }", "Did you mean 'incoming'?"),
    ],
)
def test_common_slips_are_fixed(text: str, fix: str) -> None:
    (found,) = faults(text)
    assert found.fix == fix


def test_both_readings_of_a_mixed_implication_are_shown() -> None:
    (found,) = faults("robot R { requirement r needs a => b or c }")
    assert "'(a => b) or c'" in found.message
    assert "'a => (b or c)'" in found.message


def test_an_arrow_needs_no_blank() -> None:
    (enum,) = tree_of("library L { datatype enum E from double to { value>0.7-> safe default->unsafe } }").items
    assert isinstance(enum, syntax.EnumDefinition)
    assert [rule.value.text for rule in enum.rules] == ["safe", "unsafe"]


def test_free_words_and_blanks_before_colons() -> None:
    tree = tree_of(
        "robot type { component identifier { incoming message depth with identifier : 'x', type : none "
        "action always with request : none, response:none, feedback :none } requirement always needs identifier.x }"
    )
    assert tree.name.text == "type"
    component = tree.items[0]
    assert isinstance(component, syntax.Component)
    assert [item.name.text for item in component.items if not isinstance(item, syntax.Behaviour)] == ["depth", "always"]


def test_places_count_characters_and_cover_names() -> None:
    tree = tree_of("// é\nrobot R {\n\tcomponent Camera { }\n}")
    assert tree.items[0].name.location.line == 3  # type: ignore[union-attr]
    assert tree.items[0].name.location.column == 12  # type: ignore[union-attr]
    assert tree.items[0].name.location.length == 6  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("text", "code", "line", "column", "words"),
    [
        ("", "empty-file", 1, 1, "empty"),
        (" \n ", "empty-file", 1, 1, "empty"),
        ("robot", "syntax-error", 1, 6, "expected a name"),
        ("robot R {\n /* open", "unclosed-comment", 2, 2, "never closed"),
        ('robot R { component C { incoming message m with identifier: "x', "unclosed-string", 1, 61, "never closed"),
        ("robot R { \0 }", "invalid-character", 1, 11, "NUL"),
        ("robot R {\n // \0\n }", "invalid-character", 2, 5, "NUL"),
        (
            'robot R { component C { incoming message m with identifier: "\0", type: none } }',
            "invalid-character",
            1,
            62,
            "NUL",
        ),
        ("robot R { provide m with " + "{a:" * 300, "nesting-too-deep", 1, 623, "200"),
        ("robot R { " + "x" * 100000, "syntax-error", 1, 11, "x..."),
        ("robot R { requirement r needs " + "(" * 300, "nesting-too-deep", 1, 230, "200"),
        ("robot R { requirement r needs " + "!" * 300 + "a }", "nesting-too-deep", 1, 31, "200"),
        ("robot R { requirement r needs " + "-" * 100000 + "a }", "nesting-too-deep", 1, 31, "200"),
        ("robot R { requirement r needs a" + "+a" * 300 + " }", "nesting-too-deep", 1, 31, "200"),
        ("robot R { component C { message m with type: none } }", "syntax-error", 1, 25, "a communication"),
        ("library L { requirements r needs a }", "syntax-error", 1, 13, "a definition"),
        ("robot R { } robot S { }", "syntax-error", 1, 13, "end of the file"),
        ("robot R { component state { } }", "syntax-error", 1, 21, "a name"),
    ],
)
def test_broken_texts(text: str, code: str, line: int, column: int, words: str) -> None:
    (found,) = faults(text)
    assert found.location is not None
    assert (found.code, found.location.line, found.location.column) == (code, line, column)
    assert words in found.message


def test_a_reserved_word_as_a_name_is_explained() -> None:
    (found,) = faults("robot R { component state { } }")
    assert found.fix == "If 'state' is meant as a name, write '^state'."


EXAMPLE_TEXTS = [(EXAMPLES / f"{name}.rscd").read_text(encoding="utf-8") for name in EXAMPLE_NAMES]


@pytest.mark.timeout(60)
@pytest.mark.parametrize("piece", ["/*", '"\\', "'\\", "(", "{", "a ", "robot ", "//\n", "!"])
def test_a_long_hostile_text_takes_no_time_worth_mentioning(piece: str) -> None:
    faults(piece * 300_000)


@pytest.mark.timeout(60)
@pytest.mark.parametrize(
    "piece",
    [
        "goal ",
        "assume allow ",
        "goal once not ",
        "goal once - ",
        "once - ",
        "goal x leads to ",
        "goal always eventually x ",
        "mission x { ",
        "mission x while not ",
        "visit x then ",
        "visit x on x ",
        "visit x on response ",
        "x on y from anywhere visit ",
        "prefer { x ",
        "prefer x over not ",
        "not mission x ",
    ],
)
def test_nor_does_a_long_row_of_words_of_goals(piece: str) -> None:
    faults("robot R { " + piece * 100_000)
    faults("robot R { goal " + piece * 100_000)


@pytest.mark.parametrize("end", ["", "\n", "\n\n"])
def test_the_end_of_a_file_is_found_with_and_without_a_line_end(end: str) -> None:
    (found,) = faults("robot R {" + end)
    assert found.message.startswith("the end of the file does not fit here")
    assert found.location is not None
    assert (found.location.line, found.location.column) == ((1, 10) if not end else (1 + len(end), 1))


@settings(max_examples=examples(60))
@given(st.text(alphabet=string.printable + "é\0→", max_size=200))
@example('"')
@example("/*")
def test_garbage_never_raises(text: str) -> None:
    parse(SourceFile("model.rscd", text))
    parse(SourceFile("model.rscd", f"robot R {{ {text}"))


@settings(max_examples=examples(40))
@given(st.sampled_from(EXAMPLE_TEXTS), st.data())
def test_mutated_models_never_raise(text: str, data: st.DataObject) -> None:
    begin = data.draw(st.integers(0, len(text)))
    end = data.draw(st.integers(begin, min(len(text), begin + 40)))
    inserted = data.draw(
        st.sampled_from(["", "{", "}", "(", '"', "/*", "-", "->", "state", "value", "99999999999", "\0"])
    )
    parsed = parse(SourceFile("model.rscd", text[:begin] + inserted + text[end:]))
    assert (parsed.tree is None) == bool(parsed.diagnostics)


@pytest.mark.parametrize(
    "text",
    [
        "robot R { component C { } ' component D { }\n component E { } }",
        'robot R { component C { }\n component E { "\n } requirement x needs "\n } \' }',
        "robot R { component C { } \0 component E { } }",
        "robot R { component C { } component E { } /* component D { }",
        "'\n robot R { component C { } component E { } }",
        "robot { component C { } component E { } }",
        "robot robot { component C { } component E { } }",
    ],
)
def test_what_hides_the_rest_is_one_error_and_what_is_sound_is_known(text: str) -> None:
    parsed = parse(SourceFile("model.rscd", text))
    assert parsed.tree is None and len(parsed.diagnostics) == 1
    assert parsed.sound is not None
    assert [item.name.text for item in parsed.sound.items if isinstance(item, syntax.Component)] == ["C", "E"]


@pytest.mark.timeout(60)
@pytest.mark.parametrize("piece", ["'\\\n", "\\'\n", "/*'\n", '"x\n', "'\"\n", "robot "])
def test_what_is_never_closed_is_looked_at_once(piece: str) -> None:
    assert parse(SourceFile("model.rscd", piece * 300_001)).tree is None
