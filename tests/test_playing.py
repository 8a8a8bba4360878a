"""The page about playing with a model, played as a reader plays it; and the commands that it should name."""

import os
import re
import sys
from pathlib import Path

from robosc.cli.simulation_shell import HELP
from robosc.pipeline.walking import TroubleKind
from support.tutorial import Shell, play, read_chapters

PAGE = (Path(__file__).parents[1] / "docs" / "playing.md").read_text(encoding="utf-8")


def test_the_page_is_true(tmp_path: Path) -> None:
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ.get('PATH', '')}"
    folder = tmp_path / "robots"
    folder.mkdir()
    inherited = {name: os.environ[name] for name in ("PYTHONPATH", "TMPDIR") if name in os.environ}
    shell = Shell(tmp_path / "home", folder, {**inherited, "PATH": path, "LANG": "C.UTF-8"})
    steps = [step for chapter in read_chapters(PAGE) for step in chapter.steps]
    assert len(steps) > 4
    for step in steps:
        play(step, shell)


def test_every_command_and_trouble_is_told() -> None:
    for line in HELP.splitlines():
        for command in re.findall(r"(?:^|, )([a-zA-Z-]+)", line.partition("  ")[0]):
            assert f"`{command}" in PAGE, command
    for kind in TroubleKind:
        assert f"`{kind}`" in PAGE
