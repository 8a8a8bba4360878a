"""The line follower on ROS 2, run as the tutorial runs it: it passes, and it leaves nothing behind."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip("rclpy", reason="it needs ROS 2 (the ros2 extra)")

DEMO = Path(__file__).parents[2] / "deploy" / "demo" / "line_follower.py"
LIMIT_S = 120.0

pytestmark = pytest.mark.ros2


@pytest.fixture
def demo(tmp_path: Path) -> Iterator[tuple["subprocess.Popen[str]", Path]]:
    """The running demonstration and the folder it may write its temporary files to."""
    child = subprocess.Popen(
        [sys.executable, str(DEMO)],
        env={**os.environ, "TMPDIR": str(tmp_path)},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        yield child, tmp_path
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


def test_it_passes_and_leaves_nothing(demo: tuple["subprocess.Popen[str]", Path]) -> None:
    child, folder = demo
    output, errors = child.communicate(timeout=LIMIT_S)
    assert child.returncode == 0, output + errors
    assert "passed: it moved only with a line" in output
    assert "move.request" in output
    for cause in ("line lost", "obstacle", "stop button"):
        assert f"{cause}: at rest after" in output
    assert leftovers(folder) == []


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGHUP])
def test_ctrl_c_or_a_closed_terminal_stops_everything(
    demo: tuple["subprocess.Popen[str]", Path], number: signal.Signals
) -> None:
    child, folder = demo
    assert child.stdout is not None
    started = time.monotonic()
    for line in child.stdout:
        if "are running" in line:
            break
        assert time.monotonic() - started < LIMIT_S
    child.send_signal(number)
    _, errors = child.communicate(timeout=LIMIT_S)
    assert child.returncode == 130, errors
    assert errors == "interrupted; everything is stopped\n"
    assert leftovers(folder) == []
