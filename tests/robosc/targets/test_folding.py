import ast

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robosc.targets.code.python.bundle import WIDTH
from robosc.targets.code.python.folding import folded
from robosc.targets.ros.middleware import _literal

MARK = "  # noqa: E501"

BODY = {True: ["            pass"], False: []}

LONG = {
    "call": "found = function_of_{n}(first_argument, second_argument, third_argument(with_one, with_two), fourth={{'a': (1,)}})",
    "one argument": "found = function_of_a_name_{n}(function_of_another_name(function_of_a_third_name(argument_of_it_{n}, 1)))",
    "tuple of one": "found = (a_function_with_a_name(argument_{n}, another_argument_{n}, and_a_last_argument_of_the_{n}),)",
    "condition": "if first_{n} == 1 and second_function_{n}(1, 2) and (third_{n} or fourth_{n}) and not fifth_{n} and sixth_{n}:",
    "choice": "found = first_function_of_{n}(1) if condition_{n} == 'a long text' else second_function_of_{n}(other_{n}, 2)",
    "generator": "found = tuple(function_{n}(item) for item in all_of_the_items_that_are_there_{n} if item is not None_{n} and 1)",
    "text with brackets": "found = function_{n}('(', \"it's [\", '{{,', first_argument_{n}, second_argument_{n}, third_argument_{n}, '\\'')",
    "signature": "def function_{n}(self, first_argument_of_the_function, second_argument_of_the_function, third_argument):",
    "dictionary": "found = {{'first': {{'name': 'a', 'initial': False, 'of': [1, 2, 3]}}, 'second': {{'name': 'b_{n}', 'of': ()}}}}",
    "subscript": "found[first_key_of_{n}, second_key_of_{n}] = function_of_a_long_name_{n}(first_argument_{n})[1:][0]['key of it']",
}


@pytest.mark.parametrize("line", LONG.values(), ids=LONG)
@pytest.mark.parametrize("size", [1, 9, 30, 150])
def test_long_statements_are_broken_and_mean_the_same(line: str, size: int) -> None:
    text = "\n".join(
        ["class A:", "    def b(self):", f"        {line.format(n='n' * size)}", *BODY[line[-1] == ":"], ""]
    )
    found = folded(text)
    assert ast.dump(ast.parse(found)) == ast.dump(ast.parse(text))
    assert all(len(line) <= WIDTH or line.endswith(MARK) for line in found.splitlines())
    assert (MARK in found) is (size == 150)
    assert folded(found) == found


def test_lines_between_brackets_are_broken_too() -> None:
    entry = (
        "    'key': {'first': 'a text of some length', 'second': 'another text of some length', 'third': [1, 2, 3]},"
    )
    assert folded(f"SHAPES = {{\n{entry}\n}}\n").splitlines() == [
        "SHAPES = {",
        "    'key': {",
        "        'first': 'a text of some length',",
        "        'second': 'another text of some length',",
        "        'third': [1, 2, 3],",
        "    },",
        "}",
    ]


def test_comments_are_broken_between_words() -> None:
    found = folded("def a():\n    # " + "word " * 40 + "\n    return 1  # " + "note " * 30 + "\n")
    assert all(len(line) <= WIDTH for line in found.splitlines())
    assert found.count("word") == 40 and found.count("note") == 30
    assert found.endswith("\n    return 1\n")


def test_docstrings_keep_their_words_and_are_marked_once() -> None:
    long = "x" * 120
    text = f'"""A title.\n\n{long}\n{long}\n"""\n\n\ndef a():\n    """{long}."""\n    return {{}}\n'
    found = folded(text)
    assert ast.dump(ast.parse(found)) == ast.dump(ast.parse(text))
    assert found.count(MARK) == 2 and folded(found) == found


@pytest.mark.parametrize(
    "words",
    [
        r"""a \\"; __import__('os').system('touch {}')""",
        """a '; f(1, "{}", (2, 3))""",
        "a # {}, (b, c), [d]",
        "a \u2028 if b == 'c' and d: {}",
        r"a \"\"\"; f({}, [1, 2])",
    ],
)
@pytest.mark.parametrize(
    "statement", ['"""{}."""', "found = f('''{}.''', [1, 2, 3], (4, 5))", "found = f(f'''{}.''', [1, 2, 3])"]
)
def test_texts_that_look_like_code_stay_texts(words: str, statement: str) -> None:
    text = "def a():\n    " + statement.format(words.format("x" * 120)) + "\n    return {}\n"
    found = folded(text)
    assert ast.dump(ast.parse(found)) == ast.dump(ast.parse(text))
    assert found.count(MARK) == 1 and folded(found) == found


def test_what_fits_stays_as_it_is() -> None:
    text = "a = [1,2]   # as it was\n"
    assert folded(text) == text


NAMES = st.sampled_from(["a", "quite_long_name", "an_even_longer_name_of_the_model" * 2])
LEAVES = NAMES | st.sampled_from(["1", "'a text'", "'it\\'s ('", '"]\'"', "None"])
EXPRESSIONS = st.recursive(
    LEAVES,
    lambda inner: st.one_of(
        st.builds("{}({})".format, NAMES, st.lists(inner, max_size=4).map(", ".join)),
        st.lists(inner, max_size=4).map(lambda items: f"[{', '.join(items)}]"),
        st.lists(inner, max_size=4).map(lambda items: f"({''.join(item + ', ' for item in items)})"),
        st.builds("({} if {} else {})".format, inner, inner, inner),
        st.builds("({} and not {} or {} == {})".format, inner, inner, inner, inner),
        st.builds("[{0} for {1} in {0} if {0}]".format, inner, st.just("item")),
        st.builds("({{{}: {}}})".format, inner, inner),
    ),
    max_leaves=25,
)


@given(
    EXPRESSIONS,
    st.sampled_from(["return {}", "found = {}", "if {}:\n        pass", "found = {0} if {0} else {0}", "{}"]),
)
def test_any_expression_means_the_same(expression: str, statement: str) -> None:
    text = "def a():\n    " + statement.format(expression) + "\n"
    found = folded(text)
    assert ast.dump(ast.parse(found)) == ast.dump(ast.parse(text))
    assert all(len(line) <= WIDTH or line.endswith(MARK) for line in found.splitlines())
    assert folded(found) == found


PIECES = """
@first
class Described:
    '''Words
class of no class:
    x = 1
    '''

    value = {
        "one": 1,
    }  # a comment
    if value:
        other = (
            2
        )
    else:
        other = 3

    @property
    def name(self):
        return "a"


class Empty: pass
try:
    x = 1
except ValueError:
    x = 2
"""


@pytest.mark.parametrize("size", [1, 60, 150, 400])
def test_a_large_module_is_folded_as_a_small_one(size: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Pieces of any size give the same, also with text that looks like the beginning of a statement and is none."""
    methods = [
        f"    def name_{name.replace(' ', '_')}(self):\n        {line.format(n='n')}\n"
        + "\n".join(BODY[line[-1] == ":"])
        for name, line in LONG.items()
    ]
    text = PIECES + "class Long:\n" + "\n".join(methods) + "\n" + PIECES
    whole = folded(text)
    assert whole != text
    monkeypatch.setattr("robosc.targets.code.python.folding._LARGE", 0)
    monkeypatch.setattr("robosc.targets.code.python.folding._PIECE", size)
    assert folded(text) == whole
    assert folded(whole) == whole


def test_a_long_literal_is_the_same_on_several_lines(monkeypatch: pytest.MonkeyPatch) -> None:
    states = [
        {"name": f"state {n}", "initial": not n, "of": [1, {"a": [2] * 40}], "more": {"b": "'\u00e4"}} for n in range(9)
    ]
    value = {"name": "Large", "components": states, "none": []}
    for size in (1, 100, 1000):
        monkeypatch.setattr("robosc.targets.ros.middleware._LONG", size)
        text = _literal(value)
        assert "\n" in text
        assert ast.literal_eval(text) == value
    # The lines are those that one long line is broken into.
    assert folded(f"DEFINITION = {text}\n") == folded(f"DEFINITION = {value!a}\n")
