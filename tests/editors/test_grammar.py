"""The grammar that colours models in VS Code: what was looked at stays, and our own parser is its opponent."""

import json
import re
import subprocess
from collections.abc import Iterator, Sequence
from random import Random

import msgspec
import pytest

from robosc.language import syntax
from robosc.language.parser import parse
from robosc.language.tokens import Kind, Places, tokenize
from robosc.language.words import RESERVED_WORDS
from robosc.source import SourceFile
from support.effort import seeds
from support.grammar_texts import damaged_text, damaged_tokens, grammar_tokens, joined
from support.models import EXAMPLES
from support.node import EXTENSION_FOLDER, node_tool
from support.random_models import random_bundle

LIMIT_S = 240
SEEDS = 80
GRAMMAR = EXTENSION_FOLDER / "grammar"
SOURCES = sorted(GRAMMAR.glob("*.rscd"))
MODELS = (*sorted(EXAMPLES.rglob("*.rscd")), *(file for file in SOURCES if not file.stem.startswith("broken")))

WORD_OF_THE_LANGUAGE = re.compile(r"keyword\.|storage\.|constant\.language|variable\.language|support\.")
FUNCTION = re.compile(r"support\.function")
NAME = re.compile(r"variable\.other|entity\.name")
NUMBER = re.compile(r"constant\.numeric")
STRING = re.compile(r"string\.")
COMMENT = re.compile(r"comment\.")
ITEMS = ("goal", "assume", "limit", "mission", "prefer")
FUNCTIONS = frozenset({"abs", "all", "any", "clamp", "length", "max", "min"})

RobotScopes = list[list[str]]
"""Scopes of each character of a text, in its order."""


def coloured(texts: Sequence[str]) -> list[RobotScopes]:
    """Return the scopes that the grammar finds in texts, by one process of Node for all of them."""
    node_tool("vscode-tmgrammar-snap", EXTENSION_FOLDER)
    ran = subprocess.run(
        ["node", GRAMMAR / "tokens.mjs"], input=json.dumps(texts), capture_output=True, text=True, timeout=LIMIT_S
    )
    assert ran.returncode == 0, ran.stderr
    return [_by_character(text, lines) for text, lines in zip(texts, json.loads(ran.stdout), strict=True)]


def _by_character(text: str, lines: list[list[tuple[int, int, list[str]]]]) -> RobotScopes:
    found: RobotScopes = []
    for line, tokens in zip(text.split("\n"), lines, strict=True):
        # Columns are counted in UTF-16 there.
        units: RobotScopes = [[] for _ in range(len(line.encode("utf-16-le", "surrogatepass")) // 2 + 1)]
        for begin, end, scopes in tokens:
            units[begin:end] = [scopes] * (min(end, len(units)) - begin)
        place = 0
        for character in line:
            found.append(units[place])
            place += 2 if ord(character) > 0xFFFF else 1
        found.append([])
    return found


def has(scopes: list[str], what: re.Pattern[str]) -> bool:
    return any(what.match(scope) for scope in scopes)


def check_tokens(text: str, found: RobotScopes) -> None:
    """Hold the colours of any text, a broken one too, up to its tokens."""
    behind = 0
    for word, kind, start in zip(*tokenize(text), strict=True):
        for place in range(behind, start):
            if not text[place].isspace():
                assert has(found[place], COMMENT), (text[:place], text[place])
                assert not has(found[place], WORD_OF_THE_LANGUAGE)
        behind = start + len(word)
        inside = [found[place] for place in range(start, behind) if text[place] != "\n"]
        if kind == Kind.OTHER:
            # A comment or text that is never closed goes on to the end.
            never_closed = COMMENT if word.startswith("/*") else STRING if word[0] in "\"'" else None
            assert never_closed is None or all(has(scopes, never_closed) for scopes in inside), word
            continue
        for scopes in inside:
            context = (text[max(start - 80, 0) : behind], scopes)
            assert not has(scopes, COMMENT), context
            assert has(scopes, STRING) == (kind == Kind.STRING), context
            assert has(scopes, NUMBER) == (kind == Kind.NUMBER), context
            if kind == Kind.WORD:
                assert has(scopes, WORD_OF_THE_LANGUAGE) and not has(scopes, NAME), context
            elif word.startswith("^") and kind == Kind.NAME:
                assert has(scopes, NAME) and not has(scopes, WORD_OF_THE_LANGUAGE), context


def check_names(text: str, found: RobotScopes) -> None:
    """Hold the colours of a text without errors up to what its words are for our parser."""
    file = SourceFile("model.rscd", text)
    tree = parse(file).tree
    assert tree is not None, text
    names, functions, words = (set[tuple[int, int]]() for _ in range(3))
    for node in nodes(tree):
        match node:
            case syntax.Name(location=place):
                names.add((place.line, place.column))
            case syntax.Call(function=word) if word.text in FUNCTIONS:
                functions.add((word.location.line, word.location.column))
            case syntax.Quantifier(word=word):
                functions.add((word.location.line, word.location.column))
            case syntax.Option(key="qos" | "when", value=syntax.Name() as word):
                words.add((word.location.line, word.location.column))
    places = Places(file)
    texts, kinds, starts = tokenize(text)
    for index, (token, kind, start) in enumerate(zip(texts, kinds, starts, strict=True)):
        if kind != Kind.NAME or is_unseen(text, texts, starts, index):
            continue
        place = places.location(start, start + 1)
        at, scopes = (place.line, place.column), found[start]
        context = (text[max(start - 80, 0) : start], token, scopes)
        if at in functions:
            assert has(scopes, FUNCTION), context
        elif at in names - words:
            assert has(scopes, NAME) and not has(scopes, WORD_OF_THE_LANGUAGE), context
        else:
            assert has(scopes, WORD_OF_THE_LANGUAGE) and not has(scopes, NAME), context


def nodes(tree: object) -> Iterator[object]:
    """All parts of a tree, each before its own parts."""
    stack = [tree]
    while stack:
        node = stack.pop()
        yield node
        match node:
            case msgspec.Struct():
                stack += [getattr(node, name) for name in node.__struct_fields__]
            case tuple():
                stack += node


def is_unseen(text: str, texts: Sequence[str], starts: Sequence[int], index: int) -> bool:
    """Return True if the key to a word's meaning stands too far behind it: such a grammar sees one line at a time."""
    is_split = "\n" in text[starts[index] : starts[index + 1]]
    if texts[index] in ("always", "never") and texts[index - 1] == "requirement":
        return is_split or texts[index + 1] == "-"
    if texts[index] in ("allow", "always", "once") and texts[index - 1] in ("goal", "assume", "allow"):
        is_far = texts[index + 1] == "leads" and "\n" in text[starts[index] : starts[index + 2]]
        return is_split or is_far or texts[index + 1] == "-"
    if (texts[index - 1], texts[index]) in (("always", "eventually"), ("allow", "leads"), ("once", "leads")):
        return is_unseen(text, texts, starts, index - 1)
    if texts[index - 2 : index] == ["always", "eventually"] and is_unseen(text, texts, starts, index - 2):
        # Behind such a name no operand is seen.
        return True
    if texts[index] == "not":
        following = texts[index + 1]
        last = index + {"constant": 3, "integer": 2, "double": 2, "leads": 2, **dict.fromkeys(ITEMS, 5)}.get(
            following, 1
        )
        return following == "if" or "\n" in text[starts[index] : starts[min(last, len(starts) - 1)]]
    if texts[index - 1] == "limit" and is_unseen(text, texts, starts, index - 1):
        return True
    if texts[index] == "limit":
        return "\n" in text[starts[index] : starts[min(index + 2, len(starts) - 1)]]
    if texts[index - 1 : index + 1] == ["from", "anywhere"]:
        return is_split or "\n" in text[starts[index - 1] : starts[index]]
    if texts[index - 1] == "not" and texts[index] in (*FUNCTIONS, *ITEMS) and is_unseen(text, texts, starts, index - 1):
        return True
    return is_split and texts[index] in FUNCTIONS and texts[index + 1] == "("


def test_nothing_has_changed() -> None:
    tool = node_tool("vscode-tmgrammar-snap", EXTENSION_FOLDER)
    files = [str(file.relative_to(EXTENSION_FOLDER)) for file in SOURCES]
    assert len(files) > 5
    # A source without its snapshot would get one.
    assert all((EXTENSION_FOLDER / f"{file}.snap").exists() for file in files)
    ran = subprocess.run(["node", tool, *files], cwd=EXTENSION_FOLDER, capture_output=True, text=True, timeout=LIMIT_S)
    assert ran.returncode == 0, ran.stdout + ran.stderr


def test_models_are_seen_as_our_parser_sees_them() -> None:
    texts = [file.read_text() for file in MODELS]
    for text, found in zip(texts, coloured(texts), strict=True):
        check_tokens(text, found)
        check_names(text, found)


@pytest.mark.random
@pytest.mark.parametrize("part_b", [False, True])
def test_so_are_random_models(part_b: bool) -> None:
    texts = [file.text for seed in seeds(SEEDS) for file in random_bundle(seed, part_b=part_b, goals=part_b).files]
    for text, found in zip(texts, coloured(texts), strict=True):
        check_tokens(text, found)
        check_names(text, found)


@pytest.mark.random
def test_so_are_texts_with_words_of_the_language_as_names() -> None:
    texts: list[str] = []
    for seed in seeds(4 * SEEDS):
        random = Random(seed)
        texts.append(joined(grammar_tokens(random, 100), random))
    read = 0
    for text, found in zip(texts, coloured(texts), strict=True):
        check_tokens(text, found)
        # Some are not sound: a walk over the grammar knows nothing of what is refused beyond it.
        if parse(SourceFile("model.rscd", text)).tree is not None:
            read += 1
            check_names(text, found)
    assert read > len(texts) / 2


@pytest.mark.random
def test_tokens_of_broken_texts_are_seen_too() -> None:
    texts: list[str] = []
    for seed in seeds(2 * SEEDS):
        random = Random(seed)
        tokens = grammar_tokens(random, 60)
        for _ in range(random.randint(0, 3)):
            tokens = damaged_tokens(tokens, random) if len(tokens) > 1 else tokens
        text = joined(tokens, random)
        texts.append(damaged_text(text, random) if text and random.random() < 0.5 else text)
    texts += [file.read_text() for file in SOURCES]
    for text, found in zip(texts, coloured(texts), strict=True):
        check_tokens(text, found)


def test_every_list_of_reserved_words_is_ours() -> None:
    text = (EXTENSION_FOLDER / "syntaxes" / "robosc.tmLanguage.json").read_text()
    lists = re.findall(r"\(\?!\(\?:([a-z|]+)\)", text)
    assert len(lists) > 20
    assert {frozenset(words.split("|")) for words in lists} == {RESERVED_WORDS}


CONFIGURATION = json.loads((EXTENSION_FOLDER / "language-configuration.json").read_text())


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("robot R {", True),
        ("    state on_ { // as {this}, isn't it", True),
        ("    provide m with { x: 'it\\'s }', y: 6 / 2, /* } */", True),
        ("} state s { /* a comment", True),
        ("state s { }", False),
        ("// robot R {", False),
        ("x = '{'", False),
        ("/* { */ a", False),
        ("'{' {" + " / 'a' {}" * 2000, False),
    ],
)
def test_the_line_behind_an_open_brace_is_indented(line: str, expected: bool) -> None:
    pattern = CONFIGURATION["indentationRules"]["increaseIndentPattern"]
    assert (re.search(pattern, line) is not None) == expected


def test_a_word_of_the_editor_is_a_name_of_the_language() -> None:
    text = (GRAMMAR / "names.rscd").read_text()
    texts, kinds, _ = tokenize(re.sub(r"//.*|/\*[\s\S]*?\*/|\"[^\"]*\"", "", text))
    expected = [word for word, kind in zip(texts, kinds, strict=True) if kind in (Kind.NAME, Kind.WORD)]
    assert re.findall(CONFIGURATION["wordPattern"], " ".join(texts)) == expected
