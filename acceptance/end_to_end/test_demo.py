"""The demonstration, run as a user runs it: it passes, and it leaves nothing behind."""

import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from support.demonstration import Demonstration, demonstration

pytestmark = pytest.mark.real_time

LIMIT_S = 180.0


@pytest.fixture
def output_folder(tmp_path: Path) -> Path:
    """Folder for the results of the demonstration, which makes it itself."""
    return tmp_path / "out"


@pytest.fixture
def demo(tmp_path: Path, output_folder: Path) -> Iterator[Demonstration]:
    words = ("--speed", "10", "--output", str(output_folder))
    with demonstration("demo.py", *words, folder=tmp_path / "temporary", limit_s=LIMIT_S) as found:
        yield found


def test_the_demonstration_passes_and_leaves_nothing_but_its_results(demo: Demonstration, output_folder: Path) -> None:
    output = demo.passes()
    assert "passed: out of the maze without touching a wall" in output
    assert "collisions: 0" in output
    assert "events" in output.splitlines()[1]
    for name in ("trajectory.png", "events.png"):
        assert (output_folder / name).read_bytes().startswith(b"\x89PNG")
    assert {path.name for path in output_folder.iterdir()} >= {"events.jsonl", "motion.jsonl", "narrow_maze.rsup"}


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_ctrl_c_or_a_closed_terminal_stops_everything(
    demo: Demonstration, output_folder: Path, number: signal.Signals
) -> None:
    demo.until("of the world")
    # Impatient users must not keep it from stopping its processes.
    demo.is_interrupted_by(number, number)
    assert not output_folder.exists()
