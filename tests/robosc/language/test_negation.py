"""The word `not`: what `!` is where no name could stand, and a name wherever it was one."""

import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robosc.errors import Severity
from robosc.formatting import format_text
from robosc.language import parse
from robosc.language.negation import is_negation
from robosc.language.tokens import Kind, tokenize
from robosc.model.check import check
from robosc.model.structure import Model
from robosc.source import Bundle, SourceFile
from support.effort import examples
from support.models import EXAMPLES, bundle_of
from support.random_models import random_bundle

seeds = st.integers(0, 2**32 - 1)
TEXTS = [path.read_text("utf-8") for path in sorted(EXAMPLES.rglob("*.rscd"))]


def tree_of(text: str) -> str:
    """A text's tree without places."""
    parsed = parse(SourceFile("model.rscd", text))
    assert parsed.tree is not None, [str(item) for item in parsed.diagnostics]
    return re.sub(r"Location\([^()]*\)", "", repr(parsed.tree))


def with_words(text: str) -> str:
    """The text with `not` for every `!`."""
    tokens = tokenize(text)
    for token, start in reversed(list(zip(tokens.texts, tokens.starts, strict=True))):
        if token == "!":
            text = f"{text[:start]} not {text[start + 1 :]}"
    return text


def renamed(text: str, old: str, new: str) -> str:
    """The text with another name for everything of one name."""
    tokens = tokenize(text)
    for token, kind, start in reversed(list(zip(*tokens, strict=True))):
        if kind == Kind.NAME and token.removeprefix("^") == old:
            text = f"{text[:start]}{new}{text[start + len(token) :]}"
    return text


@pytest.mark.random
@settings(max_examples=examples(40))
@given(seeds)
def test_the_word_means_what_the_sign_means(seed: int) -> None:
    text = random_bundle(seed).main.text
    assert tree_of(with_words(text)) == tree_of(text)
    assert tree_of(format_text(with_words(text))) == tree_of(text)


def test_in_the_examples_too() -> None:
    changed = [text for text in TEXTS if with_words(text) != text]
    assert changed
    for text in changed:
        assert tree_of(with_words(text)) == tree_of(text)


@pytest.mark.random
@settings(max_examples=examples(40))
@given(seeds, st.data())
def test_whatever_is_called_not_keeps_its_meaning(seed: int, data: st.DataObject) -> None:
    """A model with a name changed to `not` is the model with that name changed to `nought`."""
    bundle = random_bundle(seed)
    texts = [file.text for file in bundle.files]
    names = {
        token.removeprefix("^")
        for text in texts
        for token, kind in zip(*tokenize(text)[:2], strict=True)
        if kind == Kind.NAME
    }
    words = {"always", "never", "then", "else", "in", "constant", "any", "all", "min", "max", "abs", "clamp", "length"}
    words |= {"identifier", "type", "qos", "depth", "max_age", "stamped", "when", "reliable", "best_effort", "sensor"}
    name = data.draw(st.sampled_from(sorted(names - words - {"latched"})))
    assert model_of(bundle, name, "not") == model_of(bundle, name, "nought").replace("nought", "not")


def model_of(bundle: Bundle, old: str, new: str) -> str:
    """The model, or its errors, of a bundle with another name for everything of one name."""
    files = [SourceFile(file.name, renamed(file.text, old, new)) for file in bundle.files]
    checked = check(Bundle(files[0], tuple(files[1:])))
    if checked.model is None:
        return repr([(item.code, item.message) for item in checked.diagnostics if item.severity is Severity.ERROR])
    return repr(checked.model)


def model(text: str) -> Model:
    return check(bundle_of(text)).model_or_raise()


NAMED = """robot R {
    component not {
        outgoing message not with type: boolean
        incoming message go with type: none
        behaviour {
            variable flag: boolean = true
            variable then: boolean
            on response from not do flag := value
            initial marked state on_ { transition if not.flag goto not }
            marked state not { on request to go goto on_ }
        }
    }
    datatype enum Mood from boolean to { value -> not default -> glad }
    constant LOW: Mood = not constant HIGH: Mood = glad
    requirement go needs not.not and not.flag = not.then
    requirement not.then disables go
    requirement go needs if not.flag then not.not else not.then
    requirement go needs LOW = not
    requirement never not not.not and not.then
}"""


def test_components_states_variables_messages_and_values_of_this_name() -> None:
    found = model(NAMED)
    assert repr(found).count("'not'") > 10
    assert repr(model(NAMED.replace("never not not.not", "never !not.not"))) == repr(found)
    assert tree_of(format_text(NAMED)) == tree_of(NAMED)


SWITCH = """robot R {
    component C {
        incoming message go with type: boolean
        behaviour {
            variable not: boolean
            initial marked state s { }
        }
    }
    constant not: boolean = true
    provide go with %s
}"""


@pytest.mark.parametrize(
    ("written", "plain"),
    [
        ("not if C.s", "(not) if C.s"),
        ("not if not", "(^not) if (^not)"),
        ("not if not C.s", "(not) if !C.s"),
        ("not if if C.s then not else C.s", "(not) if (if C.s then (not) else C.s)"),
        ("not if C.s then not else C.s", "!(if C.s then (not) else C.s)"),
        ("not if C.s then C.s else not if C.s", "!(if C.s then C.s else (not)) if C.s"),
        ("not not", "!(not)"),
        ("not ^not", "!(not)"),
        ("not(C.s)", "!C.s"),
        ("not C.s = C.s", "(!C.s) = C.s"),
        ("C.s and not", "C.s and (not)"),
    ],
)
def test_what_follows_decides(written: str, plain: str) -> None:
    assert model(SWITCH % written) == model(SWITCH % plain)
    assert tree_of(format_text(SWITCH % written)) == tree_of(SWITCH % written)


def test_what_follows_a_conditional_without_end_is_read_once() -> None:
    """Its time is that of the text: nothing that decides about one word looks at the same stretch for each."""
    text = "robot R { provide m with " + "not if a and " * 3000 + "b }"
    looked = 0
    texts, kinds, _ = tokenize(text)

    class Counted(list[str]):
        def __getitem__(self, index: object) -> str:  # type: ignore[override]
            nonlocal looked
            looked += 1
            return list.__getitem__(self, index)  # type: ignore[call-overload, no-any-return]

    assert not is_negation(Counted(texts), kinds, texts.index("not"))
    assert looked < 20 * len(texts)
    assert parse(SourceFile("model.rscd", text)).tree is None


def test_the_formatter_keeps_the_word() -> None:
    text = format_text("robot R { requirement m needs   not(a) and not   b and !(not c) }")
    assert "needs not (a) and not b and !(not c)" in text


def test_a_minus_cannot_stand_before_it() -> None:
    (found,) = parse(SourceFile("m", "robot R { requirement m needs -not a }")).diagnostics
    assert found.message == "'-' cannot stand before '!' or 'not'; expected a number"
