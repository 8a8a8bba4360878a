"""Names in goals, assumptions, missions and preferences: the statement names their uses."""

import pytest

from robosc.editing.definitions import definitions
from robosc.editing.hover import holder_of, hover_text
from robosc.editing.outline import outline, parts
from robosc.language import parse
from robosc.model.check import inspect
from robosc.source import Bundle, SourceFile

TEXT = """robot R {
    component Door { behaviour { initial marked state open { } } }
    requirement always Door.open
    goal Door.open leads to Door.open
    assume allow always eventually Door.open
    mission rounds while Door.open {
        visit Door.open
        on Door.open from anywhere visit Door.open
    }
    prefer a over b
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
        ("while Door", "mission `rounds`"),
        ("on Door", "mission `rounds`"),
        ("anywhere", "mission `rounds`"),
        ("over b", "preference (line 10)"),
        ("state", "component `Door`"),
        ("robot", ""),
    ],
)
def test_the_holder_of_a_use(begin: str, holder: str) -> None:
    assert holder_of(parse(SourceFile("model.rscd", TEXT)), TEXT.index(begin)) == holder


def test_a_mission_is_a_part_of_the_outline() -> None:
    whole = outline(parse(SourceFile("model.rscd", TEXT)), TEXT)
    assert whole is not None
    (mission,) = [part for part in parts(whole) if part.definition.kind == "mission"]
    assert mission.definition.name == "rounds"
    assert TEXT[mission.begin : mission.end].split() == TEXT[TEXT.index("mission") : TEXT.index("prefer")].split()


def test_nothing_uses_a_mission_and_nothing_is_said_of_it() -> None:
    file = SourceFile("model.rscd", TEXT)
    (tree, *_) = inspect(Bundle(file)).units
    (mission,) = [item for item in definitions(tree.tree) if item.kind == "mission"]
    shown = hover_text(mission, inspect(Bundle(file)), "mission rounds { ... }", (), {})
    assert shown == "```robosc\nmission rounds { ... }\n```\n\nmission"
