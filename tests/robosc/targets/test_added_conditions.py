"""Tests of added conditions in generated Python: in words as a comment, as a formula or as methods sharing nodes."""

import ast
import io
import tokenize
from pathlib import Path

import pytest

from robosc.certification import make_supervisor
from robosc.targets import generate
from robosc.targets.code.python.text import comment
from support.models import bundle_of

GOLDEN = Path(__file__).parents[1] / "supervisor" / "golden"


def controller(name: str) -> str:
    """The generated code that knows what is allowed."""
    supervisor = make_supervisor(bundle_of((GOLDEN / f"{name}.rscd").read_text(encoding="utf-8"))).supervisor
    assert supervisor is not None
    files = generate(supervisor, "python")
    (text,) = (text for text in files.values() if "added by the supervisor" in text)
    ast.parse(text)
    return text


@pytest.mark.parametrize(
    ("model", "line"),
    [
        ("safe_distance", "# added by the supervisor: LidarSensor.safe_distance and not EmergencyStop.stopped"),
        ("budget", "and self.Drive__n + self.Arm__load + self.Lamp__level <= 4"),
    ],
)
def test_a_condition_is_a_formula_with_its_words_and_no_diagram(model: str, line: str) -> None:
    text = controller(model)
    assert f"{line}\n" in text
    assert "_node_" not in text


def test_a_diagram_becomes_methods_that_share_nodes() -> None:
    text = controller("parity")
    assert "# added by the supervisor: a decision diagram of 11 nodes\n" in text
    assert text.count("def _node_") == 11


@pytest.mark.parametrize(
    "text", ["a\nimport os", "a\r\nb", 'a"""\nb', "a\x0cb", "a\u2028b", "a\\", "x " * 200 + "\nb = 1"]
)
def test_no_text_gets_out_of_a_comment(text: str) -> None:
    lines = "".join(f"{line}\n" for line in comment(f"added by the supervisor: {text}"))
    kinds = {token.type for token in tokenize.generate_tokens(io.StringIO(lines).readline)}
    assert kinds <= {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.ENDMARKER}
