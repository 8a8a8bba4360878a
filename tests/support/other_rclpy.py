"""Real rclpy under other Pythons than that of the tests: environments that are made once in the clone."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from support.colcon import ROOT, locked
from support.pythons import python_of, variables

LOCK = ROOT / "deploy" / "requirements-rclpy.txt"
MAKE_LIMIT_S = 900.0


def rclpy_command(minor: int) -> list[str]:
    """Words that begin a command of Python 3 of a minor version, with the rclpy of Jazzy.

    Skips the test where there is no such Python, or no package index.
    """
    python = python_of(minor)
    folder = ROOT / f".venv-rclpy-3.{minor}"
    with locked(ROOT / ".venv-rclpy.lock"):
        marker = folder / ".ready"
        if not marker.is_file() or marker.stat().st_mtime < LOCK.stat().st_mtime:
            _make(python, folder)
    env = shutil.which("env")
    assert env is not None
    # The Python of the tests hands down where its own libraries are, and that they need not be looked for.
    return [env, "-u", "LD_LIBRARY_PATH", "-u", "_ROS_WHEELS_BOOTSTRAP_COMPLETE", str(folder / "bin" / "python")]


def _make(python: Path, folder: Path) -> None:
    uv = str(Path(sys.executable).with_name("uv"))
    install = ["sh", str(ROOT / "deploy" / "install_lock.sh"), uv, str(folder / "bin" / "python"), str(LOCK)]
    for command in ([uv, "venv", "--quiet", "--clear", "--python", str(python), str(folder)], install):
        made = subprocess.run(
            command, env=variables(), capture_output=True, text=True, timeout=MAKE_LIMIT_S, check=False
        )
        if made.returncode != 0:
            if any(words in made.stderr for words in ("No matching distribution", "error sending request")):
                pytest.skip(f"rclpy cannot be installed here: {made.stderr.splitlines()[-1]}")
            raise AssertionError(made.stderr)
    (folder / ".ready").touch()
