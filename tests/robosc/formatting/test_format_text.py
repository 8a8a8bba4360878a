"""The canonical layout: nothing but the layout changes, and it depends on nothing but the text's words."""

import re
from collections.abc import Iterator
from pathlib import Path
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robosc.errors import InternalError, LanguageError
from robosc.formatting import format_text, formatter
from robosc.formatting.layout import WIDTH
from robosc.language import parse
from robosc.language.tokens import COMMENT, Kind, tokenize
from robosc.source import SourceFile
from support.corpus import CORPUS
from support.effort import examples
from support.grammar_texts import grammar_tokens, joined
from support.models import EXAMPLES
from support.random_models import models, relaid

HERE = Path(__file__).parent
BEFORE, AFTER = ((HERE / name).read_bytes().decode("utf-8") for name in ("before.rscd", "after.rscd"))

seeds = st.integers(0, 2**32 - 1)


def is_sound(text: str) -> bool:
    return parse(SourceFile("model.rscd", text)).tree is not None


def text_of(path: Path) -> str:
    """A file's text; empty if it is none."""
    try:
        return path.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError:
        return ""


FILES = {
    path.name: text
    for path in sorted([*EXAMPLES.rglob("*.rscd"), *CORPUS.rglob("*.rscd")])
    if is_sound(text := text_of(path))
}


# Texts that must stay


def tree_without_places(text: str) -> str:
    tree = parse(SourceFile("model.rscd", text)).tree
    assert tree is not None
    return re.sub(r"Location\(file='model.rscd', line=\d+, column=\d+, length=\d+\)", "", repr(tree))


def words(text: str) -> tuple[list[str], list[int]]:
    texts, kinds, _ = tokenize(text)
    return texts, kinds


def spans(text: str) -> Iterator[tuple[int, int]]:
    """Yield the begin and end of each comment."""
    end = 0
    tokens = tokenize(text)
    for token, start in zip(tokens.texts, tokens.starts, strict=True):
        for match in COMMENT.finditer(text, end, start):
            yield match.span()
        end = start + len(token)


def comments(text: str) -> list[str]:
    """The comments, blanks at their line ends aside."""
    return [re.sub(r"[ \t\r]+(?=\n|$)", "", text[begin:end]) for begin, end in spans(text)]


def roles(text: str) -> list[str]:
    """For each comment whether it stands on lines of its own, at the end of a line, or inside (and before what)."""
    masked = text
    places = list(spans(text))
    for begin, end in places:
        masked = masked[:begin] + " " * (end - begin) + masked[end:]
    found = []
    for begin, end in places:
        before = masked[masked.rfind("\n", 0, begin) + 1 : begin].strip()
        behind = masked[end:].partition("\n")[0].strip()
        if behind:
            found.append(
                {")": "closing", "]": "closing", "}": "closing", ",": "moved", "{": "moved"}.get(behind[0], "inside")
            )
        else:
            found.append("trailing" if before else "own")
    return found


POSSIBLE_ROLES = {
    "own": ("own",),
    # A comma or brace stands behind the token before it, so before the comments between them.
    "moved": ("moved", "inside", "closing", "trailing", "own"),
    "trailing": ("trailing", "own"),
    "inside": ("inside",),
    # The line of a closing bracket has nothing else on it.
    "closing": ("closing", "trailing", "own"),
}


def assert_only_the_layout_changes(text: str) -> str:
    result = format_text(text)
    assert words(result) == words(text)
    assert comments(result) == comments(text)
    assert tree_without_places(result) == tree_without_places(text)
    assert format_text(result) == result
    for before, after in zip(roles(text), roles(result), strict=True):
        assert after in POSSIBLE_ROLES[before]
    assert_tidy(result)
    return result


def assert_tidy(text: str) -> None:
    """No trailing blanks, no tabs, no needless blank lines: outside of texts in quotes and of comments."""
    masked = re.sub(r"\r", "", text)
    masked = re.sub(rf"{COMMENT.pattern}|\"(?:[^\"\\]|\\[\s\S])*\"|'(?:[^'\\]|\\[\s\S])*'", "#", masked)
    assert masked.endswith("\n") and not masked.endswith("\n\n") and not masked.startswith("\n")
    assert not re.search(r"[ \t]\n|\t|\n\n\n|\{(  #)?\n\n|\n\n *\}", masked)
    assert all(len(line) - len(line.lstrip(" ")) in range(0, 81, 4) for line in masked.split("\n"))


@pytest.mark.parametrize("name", FILES)
def test_files_keep_all_but_their_layout(name: str) -> None:
    assert_only_the_layout_changes(FILES[name])


@given(models(goals=True))
@settings(max_examples=examples(40))
def test_random_models_keep_all_but_their_layout(bundle: object) -> None:
    for file in bundle.files:  # type: ignore[attr-defined]
        assert_only_the_layout_changes(file.text)


@given(seeds, st.integers(10, 300))
@settings(max_examples=examples(60))
def test_random_texts_of_the_grammar_keep_all_but_their_layout(seed: int, size: int) -> None:
    random = Random(seed)
    text = joined(grammar_tokens(random, size), random)
    if is_sound(text):
        assert_only_the_layout_changes(text)


@given(st.sampled_from(sorted(FILES)), seeds)
@settings(max_examples=examples(60))
def test_comments_anywhere_keep_their_place(name: str, seed: int) -> None:
    assert_only_the_layout_changes(relaid(FILES[name], Random(seed)))


# Differences that must not matter


def with_other_blanks(text: str, random: Random) -> str:
    """The text with other blanks and line breaks, where there is no comment and no blank line."""
    texts, kinds, starts = tokenize(text)
    result, end = "", 0
    for token, kind, start in zip(texts, kinds, starts, strict=True):
        between = text[end:start]
        if between.strip() or between.count("\n") > 1:
            result += between
        elif kind != Kind.END and end:
            result += random.choice((" ", " ", "\n", "  ", "\t\n "))
        result += token
        end = start + len(token)
        if kind == Kind.END:
            return result
    raise AssertionError("a text ends")


@given(st.sampled_from(sorted(FILES)), seeds)
@settings(max_examples=examples(50))
def test_blanks_and_line_breaks_do_not_matter(name: str, seed: int) -> None:
    text = re.sub(r"\r", "", FILES[name])
    other = with_other_blanks(text, Random(seed))
    assert words(other) == words(text)
    assert format_text(other) == format_text(text)


@given(models(), seeds)
@settings(max_examples=examples(20))
def test_blanks_and_line_breaks_of_random_models_do_not_matter(bundle: object, seed: int) -> None:
    text = bundle.files[0].text.replace("\r", "")  # type: ignore[attr-defined]
    assert format_text(with_other_blanks(text, Random(seed))) == format_text(text)


# The style


def test_the_golden_pair() -> None:
    assert_only_the_layout_changes(BEFORE)
    assert format_text(BEFORE) == AFTER


@pytest.mark.parametrize("name", ["line_follower.rscd", "line_follower_layer.rscd"])
def test_the_project_writes_what_format_writes(name: str) -> None:
    text = (EXAMPLES / "line_follower" / name).read_text(encoding="utf-8")
    assert format_text(text) == text


def formatted_item(item: str) -> str:
    """An item of a robot as it is formatted, without the robot and its indentation."""
    lines = format_text(f"robot R {{\n{item}\n}}\n").split("\n")[1:-2]
    return "\n".join(line.removeprefix("    ") for line in lines)


LONG = "Component.remaining"
NAMED = "remaining_requests_of_it"


@pytest.mark.parametrize(
    ("item", "expected"),
    [
        ("requirement   x needs(a)", "requirement x needs (a)"),
        ("requirement{a,b}needs  - - c<!d", "requirement { a, b } needs --c < !d"),
        ("requirement { } needs a", "requirement { } needs a"),
        ("requirement x needs then(1)and then>else", "requirement x needs then(1) and then > else"),
        ("requirement always(a)", "requirement always (a)"),
        ("requirement always-a<b", "requirement always -a < b"),
        ("goal   always\neventually(a)", "goal always eventually (a)"),
        ("goal once-a<b", "goal once -a < b"),
        ("goal once-a<b leads   to!c", "goal once - a < b leads to !c"),
        ("goal once(a)", "goal once (a)"),
        ("goal once leads to once", "goal once leads to once"),
        ("assume\nallow(a)leads to b", "assume allow (a) leads to b"),
        ("assume allow leads to-1<b", "assume allow leads to -1 < b"),
        ("assume always  eventually not a", "assume always eventually not a"),
        (
            f"goal {LONG} and {LONG} and {LONG} or {LONG} leads to {LONG} and {LONG} and {LONG}",
            f"goal {LONG} and {LONG} and {LONG} or {LONG}\n    leads to {LONG} and {LONG} and {LONG}",
        ),
        (
            f"goal ({LONG} and {LONG} and {LONG} and {LONG} and {LONG} and {LONG}) leads to {LONG}",
            f"goal (\n    {LONG}\n" + f"    and {LONG}\n" * 5 + f") leads to {LONG}",
        ),
        (
            f"goal once {LONG} and {LONG} and {LONG} and {LONG} and {LONG} and {LONG}",
            f"goal once {LONG}\n" + "\n".join([f"    and {LONG}"] * 5),
        ),
        ("mission m{visit(a)then-b<c}", "mission m {\n    visit (a) then -b < c\n}"),
        (
            "mission m while(a)and not b{visit if a then b else c then then on!a from anywhere visit b then c}",
            "mission m while (a) and not b {\n    visit if a then b else c then then\n"
            "    on !a from anywhere visit b then c\n}",
        ),
        (
            f"mission m while {LONG} and {LONG} or {LONG} and {LONG} and {LONG} {{ visit {LONG} then {LONG}"
            f" then not ({LONG} and {LONG} and {LONG} and {LONG} and {LONG}) on {LONG} and {LONG} from anywhere visit"
            f" {LONG} then {LONG} then {LONG} }}",
            f"mission m\n    while {LONG} and {LONG}\n        or {LONG} and {LONG} and {LONG} {{\n"
            f"    visit {LONG}\n        then {LONG}\n        then not (\n            {LONG}\n"
            + f"            and {LONG}\n"
            * 4
            + f"        )\n    on {LONG} and {LONG} from anywhere\n        visit {LONG}\n        then {LONG}\n"
            f"        then {LONG}\n}}",
        ),
        (
            "mission m { // one\n visit a // two\n then b // three\n // four\n }",
            "mission m {  // one\n    visit a  // two\n        then b  // three\n    // four\n}",
        ),
        ("prefer a over{b,c}", "prefer a over { b, c }"),
        ("prefer{a}over b", "prefer { a } over b"),
        (
            f"prefer {{ {NAMED}, {NAMED}, {NAMED} }} over {{ {NAMED}, {NAMED} }}",
            f"prefer {{ {NAMED}, {NAMED}, {NAMED} }}\n    over {{ {NAMED}, {NAMED} }}",
        ),
        (
            f"prefer a over {{ {', '.join([NAMED] * 6)} }}",
            "prefer a\n    over {\n" + f"        {NAMED},\n" * 5 + f"        {NAMED}\n    }}",
        ),
        ("requirement always-a<b disables c", "requirement always - a < b disables c"),
        (
            "requirement x needs if(a)then(b)else(c)and any(y in a . b [ 1 .. 2 ] . c :y)",
            "requirement x needs if (a) then (b) else (c) and any(y in a.b[1..2].c: y)",
        ),
        (
            "requirement x needs f( )and integer(2.5)=a[ - 1 ..- b]",
            "requirement x needs f() and integer(2.5) = a[-1..-b]",
        ),
        ("constant A:integer( - 3 .. -1 )=-2", "constant A: integer(-3..-1) = -2"),
        (
            "datatype object O{a:array(array(double))b:^string}",
            "datatype object O { a: array(array(double)) b: ^string }",
        ),
        ("datatype object O{}", "datatype object O { }"),
        (
            "datatype enum E from array(none)to{default->a}",
            "datatype enum E from array(none) to {\n    default -> a\n}",
        ),
        (
            "component C{incoming message m with depth:-1,type:none}",
            "component C {\n    incoming message m with depth: -1, type: none\n}",
        ),
        ("provide x with{a:{},b:{c:-1}}if d", "provide x with { a: { }, b: { c: -1 } } if d"),
    ],
)
def test_one_line(item: str, expected: str) -> None:
    assert formatted_item(item) == expected


def test_what_is_exactly_as_wide_as_a_line_stays_on_it() -> None:
    start = "requirement x needs a and "
    fits = "b" * (WIDTH - 4 - len(start))
    assert formatted_item(start + fits) == start + fits
    assert formatted_item(f"{start}{fits}b") == f"requirement x needs a\n    and {fits}b"


def test_a_list_that_is_exactly_as_wide_as_a_line_stays_on_it() -> None:
    start = "service x with request: none, response: "
    name = "b" * (WIDTH - 8 - len(start))
    assert formatted_item(f"component C {{ {start}{name} }}") == f"component C {{\n    {start}{name}\n}}"
    assert formatted_item(f"component C {{ {start}{name}b }}") == (
        f"component C {{\n    service x with\n        request: none,\n        response: {name}b\n}}"
    )


def test_what_cannot_be_broken_off_counts() -> None:
    name = "b" * (WIDTH - 8 - len("a: f(c, )"))
    entry = f"a: f(c, {name})"
    assert formatted_item(f"provide x with {{ {entry} }}") == f"provide x with {{\n    {entry}\n}}"
    # The comma makes it too wide.
    assert formatted_item(f"provide x with {{ {entry}, d: 1 }}") == (
        f"provide x with {{\n    a: f(\n        c,\n        {name}\n    ),\n    d: 1\n}}"
    )


def test_the_blank_before_a_clause_counts() -> None:
    start = "provide x with { a: 1 } if "
    name = "b" * (WIDTH - 4 - len(start))
    assert formatted_item(start + name) == start + name
    assert formatted_item(f"{start}{name}b") == f"provide x with {{ a: 1 }}\n    if {name}b"


def test_a_clause_behind_a_comment_is_broken_too_if_it_is_too_wide() -> None:
    name = "b" * 70
    assert formatted_item(f"provide x with a // c\nif {name} and {name}") == (
        f"provide x with a  // c\n    if {name}\n        and {name}"
    )


def test_a_bracket_around_one_word_is_not_broken() -> None:
    name = "b" * 150
    assert formatted_item(f"requirement x needs a[{name}]") == f"requirement x needs a[{name}]"


def test_a_line_goes_on_behind_a_text_of_several_lines() -> None:
    text = f"provide x with '{'a' * 90}\n{'b' * 40}' if f(c, {'d' * 60})"
    assert format_text(f"robot R {{ {text} }}") == f"robot R {{\n    {text}\n}}\n"


def test_what_ends_a_statement_goes_behind_a_lone_bracket_only() -> None:
    inner = " and ".join(["b" * 30] * 4)
    broken = inner.replace(" and", "\n        and")
    assert formatted_item(f"requirement (a) and ({inner}) disables x") == (
        f"requirement (a)\n    and (\n        {broken}\n    )\n    disables x"
    )


def test_a_comment_at_the_end_of_a_line_does_not_count() -> None:
    text = "requirement x needs a and " + "b" * 90
    assert formatted_item(f"{text} // {'c' * 50}") == f"{text}  // {'c' * 50}"


def test_parentheses_and_chains_break_from_the_outside() -> None:
    text = (
        f"requirement x needs {LONG} = 1 and ({LONG} = 2 and {LONG} = 3 or {LONG} + {LONG} = 4 and {LONG} = 5 * {LONG} "
        f"and {LONG} = {LONG} or {LONG})"
    )
    assert formatted_item(text) == (
        f"requirement x needs {LONG} = 1\n"
        "    and (\n"
        f"        {LONG} = 2 and {LONG} = 3\n"
        f"        or {LONG} + {LONG} = 4\n"
        f"            and {LONG} = 5 * {LONG}\n"
        f"            and {LONG} = {LONG}\n"
        f"        or {LONG}\n"
        "    )"
    )


def test_a_condition_in_one_pair_of_parentheses_closes_under_its_beginning() -> None:
    inner = " or ".join([LONG] * 6)
    assert formatted_item(f"requirement ({inner}) disables x") == (
        "requirement (\n    " + inner.replace(" or", "\n    or") + "\n) disables x"
    )


def test_indentation_ends_somewhere() -> None:
    depth = 100
    value = "{ a: " * depth + "1" + " }" * depth
    result = formatted_item(f"provide x with {value}")
    assert max(len(line) for line in result.split("\n")) <= WIDTH
    assert words(result) == words(f"provide x with {value}")


# Comments and blank lines


@pytest.mark.parametrize(
    ("item", "expected"),
    [
        ("// a\n\n\n\nrequirement x needs a", "// a\n\nrequirement x needs a"),
        ("requirement x needs a // b\n\n// c", "requirement x needs a  // b\n\n// c"),
        ("requirement x needs a // b\n// c", "requirement x needs a  // b\n// c"),
        ("requirement x needs a /* b */ // c", "requirement x needs a  /* b */ // c"),
        ("/* a */ requirement/* b */x needs a", "/* a */ requirement /* b */ x needs a"),
        ("requirement x needs a /* b */ requirement y needs a", "requirement x needs a\n/* b */ requirement y needs a"),
        ("requirement x // a\nneeds b", "requirement x  // a\n    needs b"),
        ("requirement x needs a\n// b\nand c", "requirement x needs a\n    // b\n    and c"),
        ("component C // a\n// b\n{ }", "component C {  // a\n    // b\n}"),
        ("component C // a\n{\n// b\n}", "component C {  // a\n    // b\n}"),
        ("component C // a\n{\n\n// b\n}", "component C {  // a\n    // b\n}"),
        ("provide x with { a: 1 // b\n\n,\nc: 2 }", "provide x with {\n    a: 1,  // b\n    c: 2\n}"),
        (
            "provide x with { a: 1 // b\n,\n// c\nd: 2 }",
            "provide x with {\n    a: 1,  // b\n    // c\n    d: 2\n}",
        ),
        (
            "provide x with { a: 1 // b\n/* c */,\nd: 2 }",
            "provide x with {\n    a: 1,  // b\n    /* c */ d: 2\n}",
        ),
        ("component C { /* a */ }", "component C { /* a */ }"),
        ("component C {\n/* a */ }", "component C { /* a */ }"),
        ("component C {\n\n// a\n\n}", "component C {\n    // a\n}"),
        ("provide x with { a: 1 // b\n, c: 2 }", "provide x with {\n    a: 1,  // b\n    c: 2\n}"),
        ("provide x with { a: 1 /* b */, c: 2 /* d */ }", "provide x with { a: 1 /* b */, c: 2 /* d */ }"),
        ("requirement x needs (/* a */ a/* b */ )", "requirement x needs (/* a */ a /* b */)"),
        ("provide x with { a: 1,\n\nc: 2 }", "provide x with {\n    a: 1,\n\n    c: 2\n}"),
        ("provide x with {\n\na: 1\n\n}", "provide x with { a: 1 }"),
        ("requirement x needs (a\n\nor b)", "requirement x needs (a or b)"),
        ("/* a\n * b  \n */\nrequirement x needs a", "/* a\n * b\n */\nrequirement x needs a"),
    ],
)
def test_comments_and_blank_lines(item: str, expected: str) -> None:
    # Inner lines of a comment have no indentation.
    expected_text = "robot R {\n" + "\n".join(
        line if not line or line.startswith(" *") else f"    {line}" for line in expected.split("\n")
    )
    assert assert_only_the_layout_changes(f"robot R {{\n{item}\n}}\n") == f"{expected_text}\n}}\n"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("\n\n// a\n\nrobot R { }\n\n// b\n\n", "// a\n\nrobot R { }\n\n// b\n"),
        ("robot R { } // a", "robot R { }  // a\n"),
        ("robot R { }", "robot R { }\n"),
        ("robot R {\r\n}\n", "robot R { }\r\n"),
        ("robot R {\n}\r\n", "robot R { }\n"),
        ("/* a\r\n b */\nrobot R {\n}\n", "/* a\r\n b */\r\nrobot R { }\r\n"),
        ("robot R { provide x with 'a\r\nb'\n}\n", "robot R {\n    provide x with 'a\r\nb'\n}\n"),
        ("robot R { provide x with 'a\nb'\r\n}\n", "robot R {\r\n    provide x with 'a\nb'\r\n}\r\n"),
    ],
)
def test_line_ends_and_the_ends_of_the_text(text: str, expected: str) -> None:
    assert format_text(text) == expected
    assert format_text(expected) == expected


# Limits


@pytest.mark.parametrize(
    "value",
    [
        "(" * 195 + "a and b" + ")" * 195,
        "f(" * 195 + "a" + ")" * 195,
        "if a then b else " * 195 + "c",
        "f(a[" * 97 + "0" + "])" * 97,
        "{ a: " * 195 + "1" + "}" * 195,
        "!" * 195 + "a",
    ],
)
def test_deep_nesting(value: str) -> None:
    assert_only_the_layout_changes(f"robot R {{ provide x with {value} }}")
    assert_only_the_layout_changes(f"robot R {{ provide x with {value.replace(' ', ' /* c */ ')} // d\n }}")


def test_text_with_errors_is_refused_with_all_of_them() -> None:
    with pytest.raises(LanguageError) as caught:
        format_text("robot R {\n  component {}\n  requirement needs a\n}\n", "model.rscd")
    assert [str(item.location) for item in caught.value.diagnostics] == ["model.rscd:2:13", "model.rscd:3:15"]


def test_a_layout_that_would_change_the_text_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(formatter, "lay_out", lambda *_: "robot S { }\n")
    with pytest.raises(InternalError):
        format_text("robot R { }")
