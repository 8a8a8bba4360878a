"""One mistake is reported once, in its place, with the word that was meant; what stands behind it is still read."""

import pytest

from robosc.errors import Diagnostic
from robosc.language import parse
from robosc.language.tokens import tokenize
from robosc.source import SourceFile
from support.effort import EFFORT
from support.models import EXAMPLES

ROBOT = """robot R {
    component C {
        incoming message m with type: none
        behaviour {
            initial marked state s { on request to m goto t }
            marked state t { on request to m goto s }
        }
    }
    requirement m needs C.s and C.t
}
"""


def faults(text: str) -> tuple[Diagnostic, ...]:
    return parse(SourceFile("model.rscd", text)).diagnostics


@pytest.mark.parametrize(
    ("sound", "broken", "place", "expected"),
    [
        ("initial marked state s", "initial marked satte s", (5, 28), "Did you mean 'state'?"),
        ("initial marked state s", "initial marked s", (5, 28), "expected 'state'"),
        ("initial marked state s", "intial marked state s", (5, 13), "Did you mean 'initial'?"),
        ("initial marked state s", "initial marked state", (5, 34), "expected a name"),
        ("state s {", "state s", (5, 36), "expected '{'"),
        ("goto t }", "goto t", (6, 13), "this '{' is not closed"),
        ("goto t }", "goto t }}", (6, 13), "expected a communication"),
        ("component C {", "compnent C {", (2, 5), "Did you mean 'component'?"),
        ("component C {", "component C", (3, 9), "expected 'from' or '{'"),
        ("behaviour {", "behavior {", (4, 9), "Did you mean 'behaviour'?"),
        ("behaviour {", "behaviour", (5, 13), "expected '{'"),
        ("needs", "needz", (9, 19), "Did you mean 'needs'?"),
        ("needs", "need", (9, 19), "Did you mean 'needs'?"),
        ("and", "adn", (9, 29), "Did you mean 'and'?"),
        ("C.t\n}", "C.t\n}}", (10, 2), "one '}' too many"),
    ],
)
def test_one_mistake_is_one_error(sound: str, broken: str, place: tuple[int, int], expected: str) -> None:
    assert faults(ROBOT) == ()
    text = ROBOT.replace(sound, broken, 1)
    assert text != ROBOT
    (found,) = faults(text)
    assert found.location is not None
    assert (found.location.line, found.location.column) == place
    assert expected in f"{found.message} {found.fix} {' '.join(item.message for item in found.related)}"


@pytest.mark.parametrize(
    "broken",
    [
        "component C { behaviour { initial marked satte s { on rquest to m goto s } } }",
        "compnent C { incomin message m with type: none }",
        "datatype object { x double }",
        "datatype enum from boolean to { value = a default -> b }",
        "component C { } } component D { incomin message m with type: none }",
    ],
)
def test_what_stands_in_or_behind_a_broken_definition_is_read(broken: str) -> None:
    assert len(faults(f"robot R {{ {broken} }}")) == 2


@pytest.mark.parametrize(
    ("written", "fix"),
    [
        ("interface i ues T from p", "Did you mean 'use'?"),
        ("datatype enum E form boolean to { value -> a default -> b }", "Did you mean 'from'?"),
        ("datatype enum E from boolean to { value -> a default => b }", "Write '->' before it"),
        ("requirement m needs any(value.a: true)", "'any(x in array: condition)'"),
        ("requirement m needs any(value in value.a: true)", "'any(x in array: condition)'"),
        ("component C { behaviour { variable v: integer(0..1) initial state s { transition fi v goto s } } }", "'if'?"),
    ],
)
def test_the_word_that_was_meant(written: str, fix: str) -> None:
    (found,) = faults(f"robot R {{ {written} }}")
    assert fix in found.fix


def damaged(kind: str, text: str) -> list[str]:
    """The texts that a slip of the hand at each token makes of a text."""
    found = []
    tokens = tokenize(text)
    for token, start in zip(tokens.texts, tokens.starts, strict=False):
        before, after = text[:start], text[start + len(token) :]
        match kind:
            case "forgotten" if token:
                found.append(f"{before} {after}")
            case "doubled" if token:
                found.append(f"{before}{token} {token}{after}")
            case "misspelt" if len(token) > 3 and token.isalpha():
                found.append(f"{before}{token[0]}{token[2]}{token[1]}{token[3:]}{after}")
    return found


@pytest.mark.random
@pytest.mark.parametrize("kind", ["forgotten", "doubled", "misspelt"])
def test_a_slip_at_any_token_is_hardly_ever_two_errors(kind: str) -> None:
    texts = [text for path in sorted(EXAMPLES.rglob("*.rscd")) for text in damaged(kind, path.read_text("utf-8"))]
    # Every fourth token, or every one.
    texts = texts[:: 1 if EFFORT else 4]
    counts = [len(faults(text)) for text in texts]
    assert sum(counts) > len(texts) / 3
    assert max(counts) <= 2
    assert sum(count > 1 for count in counts) <= len(texts) / 100
