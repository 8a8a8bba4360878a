"""The page about playing with a model, played as a reader plays it; and the commands that it should name."""

import re
from pathlib import Path

from robosc.cli.simulation_shell import HELP
from robosc.pipeline.walking import WalkFindingKind
from support.tutorial import play_page

PAGE = (Path(__file__).parents[1] / "docs" / "playing.md").read_text(encoding="utf-8")


def test_the_page_is_true(tmp_path: Path) -> None:
    assert play_page(PAGE, tmp_path) > 4


def test_every_command_and_finding_is_told() -> None:
    for line in HELP.splitlines():
        for command in re.findall(r"(?:^|, )([a-zA-Z-]+)", line.partition("  ")[0]):
            assert f"`{command}" in PAGE, command
    for kind in WalkFindingKind:
        assert f"`{kind}`" in PAGE
