"""Real rclpy of other Pythons and of another distribution than the tests': environments, made once in the clone."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from support.colcon import ROOT, locked
from support.pythons import python_of, variables

LOCK = ROOT / "deploy" / "requirements-rclpy.txt"
KILTED = ROOT / "deploy" / "requirements-kilted.txt"
MAKE_LIMIT_S = 900.0


def rclpy_command(minor: int) -> list[str]:
    """Words that begin a command of Python 3 of a minor version, with the rclpy of Jazzy.

    Skips the test where there is no such Python, or no package index.
    """
    return _command(f".venv-rclpy-3.{minor}", python_of(minor), LOCK)


DISTRIBUTIONS = ("jazzy", "kilted")
"""Distributions whose rclpy a package index has."""


def distribution_command(distribution: str) -> list[str]:
    """Words that begin a command of the Python of the tests with the rclpy of a distribution.

    Skips the test where there is no package index.
    """
    if distribution == "jazzy":
        return [sys.executable]
    return _command(".venv-rclpy-kilted", Path(sys.executable), KILTED)


def _command(name: str, python: Path, lock: Path) -> list[str]:
    folder = ROOT / name
    with locked(ROOT / ".venv-rclpy.lock"):
        marker = folder / ".ready"
        if not marker.is_file() or marker.stat().st_mtime < lock.stat().st_mtime:
            _make(python, folder, lock)
    env = shutil.which("env")
    assert env is not None
    # The Python of the tests hands down where its own libraries are, and that they need not be looked for.
    removed = ["LD_LIBRARY_PATH", "_ROS_WHEELS_BOOTSTRAP_COMPLETE"]
    if lock == KILTED:
        # It warns of the name that Jazzy has for this variable.
        removed.append("FASTRTPS_DEFAULT_PROFILES_FILE")
    return [env, *(word for name in removed for word in ("-u", name)), str(folder / "bin" / "python")]


def _make(python: Path, folder: Path, lock: Path) -> None:
    uv = str(Path(sys.executable).with_name("uv"))
    install = ["sh", str(ROOT / "deploy" / "install_lock.sh"), uv, str(folder / "bin" / "python"), str(lock)]
    for command in ([uv, "venv", "--quiet", "--clear", "--python", str(python), str(folder)], install):
        made = subprocess.run(
            command, env=variables(), capture_output=True, text=True, timeout=MAKE_LIMIT_S, check=False
        )
        if made.returncode != 0:
            if any(words in made.stderr for words in ("No matching distribution", "error sending request")):
                pytest.skip(f"rclpy cannot be installed here: {made.stderr.splitlines()[-1]}")
            raise AssertionError(made.stderr)
    (folder / ".ready").touch()
