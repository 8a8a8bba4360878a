"""The tutorial, played as a reader plays it: its files are written, its commands typed, their output compared."""

import os
import sys
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

from support.tutorial import Command, Shell, TutorialError, play, read_chapters

pytestmark = pytest.mark.real_time

ROOT = Path(__file__).parents[1]

DOCS = ROOT / "docs"

CHAPTERS = read_chapters((DOCS / "tutorial.md").read_text(encoding="utf-8"))

NEEDS_ROS = "deploy/demo/line_follower.py"


class Reader:
    """Reader that plays chapters in order, each once; a reader of one gets those before it.

    Args:
        shell: Shell in which commands are typed.
    """

    def __init__(self, shell: Shell) -> None:
        self._shell = shell
        self._played = 0
        self._failed: str | None = None

    def play_through(self, number: int) -> None:
        """Play up to and with a chapter; fails in the first chapter that is wrong, and says so in those after it."""
        while self._played <= number:
            assert self._failed is None, f"chapter {self._failed!r} failed before"
            chapter = CHAPTERS[self._played]
            try:
                for step in chapter.steps:
                    if find_spec("rclpy") or not needs_ros(step):
                        play(step, self._shell)
            except (TutorialError, OSError):
                self._failed = chapter.title
                raise
            self._played += 1


def needs_ros(step: object) -> bool:
    """Return True if a step starts ROS 2 nodes."""
    return isinstance(step, Command) and NEEDS_ROS in step.text


def new_shell(folder: Path, start: Path) -> Shell:
    """A shell of a user with an empty home and a plain environment."""
    variables = {name: os.environ[name] for name in ("PATH", "TMPDIR") if name in os.environ}
    return Shell(folder / "home", start, {**variables, "LANG": "C.UTF-8"})


@pytest.fixture(scope="module")
def reader(tmp_path_factory: pytest.TempPathFactory) -> Reader:
    """A reader in a folder that looks like a clone with its environment."""
    folder = tmp_path_factory.mktemp("tutorial")
    clone = folder / "robosc"
    clone.mkdir()
    (clone / ".venv").symlink_to(sys.prefix)
    (clone / "deploy").symlink_to(ROOT / "deploy")
    return Reader(new_shell(folder, clone))


def parameters() -> Iterator[Any]:
    """The chapters' numbers; from the first one on that starts ROS 2 nodes, marked as the other tests that do so."""
    marks: tuple[pytest.MarkDecorator, ...] = ()
    for number, chapter in enumerate(CHAPTERS):
        if any(map(needs_ros, chapter.steps)):
            marks = (pytest.mark.ros2,)
        yield pytest.param(number, id=chapter.title, marks=marks)


@pytest.mark.parametrize("number", list(parameters()))
def test_a_chapter_is_true(number: int, reader: Reader) -> None:
    reader.play_through(number)
    if not find_spec("rclpy") and any(map(needs_ros, CHAPTERS[number].steps)):
        pytest.skip("ROS 2 (rclpy) is not installed")


def test_a_command_that_hangs_is_ended(tmp_path: Path) -> None:
    with pytest.raises(TutorialError, match="did not end within 0 s"):
        new_shell(tmp_path, tmp_path).run("trap 'sleep 0.1; touch ended' TERM; sleep 60 & wait", 0.3)
    assert (tmp_path / "ended").exists()
