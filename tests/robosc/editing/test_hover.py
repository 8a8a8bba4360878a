"""Names in goals and assumptions: the statement names their uses."""

import pytest

from robosc.editing.hover import holder_of
from robosc.language import parse
from robosc.source import SourceFile

TEXT = """robot R {
    component Door { behaviour { initial marked state open { } } }
    requirement always Door.open
    goal Door.open leads to Door.open
    assume allow always eventually Door.open
}
"""


@pytest.mark.parametrize(
    ("begin", "holder"),
    [
        ("requirement", "requirement (line 3)"),
        ("goal Door", "goal (line 4)"),
        ("to Door", "goal (line 4)"),
        ("assume", "assumption (line 5)"),
        ("eventually", "assumption (line 5)"),
        ("state", "component `Door`"),
        ("robot", ""),
    ],
)
def test_the_holder_of_a_use(begin: str, holder: str) -> None:
    assert holder_of(parse(SourceFile("model.rscd", TEXT)), TEXT.index(begin)) == holder
