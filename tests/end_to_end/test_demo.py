"""The demonstration, run as a user runs it: it passes, and it leaves nothing behind."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

DEMO = Path(__file__).parents[2] / "deploy" / "demo" / "demo.py"
LIMIT_S = 180.0


@pytest.fixture
def demo(tmp_path: Path) -> Iterator[tuple["subprocess.Popen[str]", Path, Path]]:
    """The running demonstration, the folder it may write its temporary files to, and the one for its results."""
    folder, output = tmp_path / "temporary", tmp_path / "out"
    folder.mkdir()
    child = subprocess.Popen(
        [sys.executable, str(DEMO), "--speed", "10", "--output", str(output)],
        env={**os.environ, "TMPDIR": str(folder)},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        yield child, folder, output
    finally:
        child.kill()
        child.wait()


def leftovers(folder: Path) -> list[str]:
    """Files in the folder, and processes that mention it in their command line or environment."""
    found = [str(path) for path in folder.iterdir()]
    for process in Path("/proc").iterdir():
        if process.name.isdigit() and int(process.name) != os.getpid():
            try:
                traces = (process / "cmdline").read_bytes() + (process / "environ").read_bytes()
            except OSError:
                continue
            if str(folder).encode() in traces:
                found.append(f"process {process.name}: {traces[:200]!r}")
    return found


def test_the_demonstration_passes_and_leaves_nothing_but_its_results(
    demo: tuple["subprocess.Popen[str]", Path, Path],
) -> None:
    child, folder, output_folder = demo
    output, errors = child.communicate(timeout=LIMIT_S)
    assert child.returncode == 0, output + errors
    assert "passed: out of the maze without touching a wall" in output
    assert "collisions: 0" in output
    assert "events" in output.splitlines()[1]
    for name in ("trajectory.png", "events.png"):
        assert (output_folder / name).read_bytes().startswith(b"\x89PNG")
    assert {path.name for path in output_folder.iterdir()} >= {"events.jsonl", "motion.jsonl", "narrow_maze.rsup"}
    assert leftovers(folder) == []


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_ctrl_c_or_a_closed_terminal_stops_everything(
    demo: tuple["subprocess.Popen[str]", Path, Path], number: signal.Signals
) -> None:
    child, folder, output_folder = demo
    assert child.stdout is not None
    started = time.monotonic()
    for line in child.stdout:
        if "of the world" in line:
            break
        assert time.monotonic() - started < LIMIT_S
    child.send_signal(number)
    # Who is impatient must not keep it from stopping its processes.
    child.send_signal(number)
    _, errors = child.communicate(timeout=LIMIT_S)
    assert child.returncode == 130, errors
    assert errors == "interrupted; everything is stopped\n"
    assert leftovers(folder) == []
    assert not output_folder.exists()
