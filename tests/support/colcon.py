"""Real colcon in tests: its environment, made once in the clone, and workspaces that are built and run with it."""

import fcntl
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
ENVIRONMENT = ROOT / ".venv-colcon"
INPUTS = (ROOT / "deploy" / "requirements-colcon.txt", ROOT / "deploy" / "make_colcon_environment.sh")
MAKE_LIMIT_S = 900.0
BUILD_LIMIT_S = 900.0
PROGRAMS = ("g++", "cmake", "bash", "sh")

# A Python with ROS 2 hands variables down to programs that have their own.
_ENTER = 'unset LD_LIBRARY_PATH _ROS_WHEELS_BOOTSTRAP_COMPLETE PYTHONPATH; . "$0/install/setup.bash" && exec "$@"'


@contextmanager
def locked(file: Path) -> Iterator[None]:
    """Let only one process at a time execute a block."""
    with file.open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def colcon_program() -> Path:
    """The program `colcon` of an environment that is made if there is none, or only an outdated one.

    Skips the test where it cannot be had: without a compiler, or without a package index.
    """
    missing = [name for name in PROGRAMS if shutil.which(name) is None]
    if missing:
        pytest.skip(f"colcon builds interfaces only with {' and '.join(missing)}, not installed here")
    with locked(ROOT / ".venv-colcon.lock"):
        if not _is_ready():
            _make()
    return ENVIRONMENT / "colcon"


def _is_ready() -> bool:
    marker = ENVIRONMENT / ".ready"
    return marker.is_file() and all(marker.stat().st_mtime >= file.stat().st_mtime for file in INPUTS)


def _make() -> None:
    made = subprocess.run(
        ["sh", str(INPUTS[1]), str(ENVIRONMENT)],
        env={**os.environ, "BIN": str(Path(sys.executable).parent)},
        capture_output=True,
        text=True,
        timeout=MAKE_LIMIT_S,
        check=False,
    )
    if made.returncode != 0:
        lines = [line for line in made.stderr.splitlines() if line.startswith("ERROR")] or made.stderr.splitlines()
        if "No matching distribution" in made.stderr or "ConnectionError" in made.stderr:
            pytest.skip(f"colcon cannot be installed here: {lines[-1]}")
        raise AssertionError(made.stderr)


class Workspace:
    """A colcon workspace.

    Args:
        folder: Its folder, with packages below `src`.
        variables: Environment of colcon on top of this process's.
    """

    def __init__(self, folder: Path, variables: Mapping[str, str] | None = None) -> None:
        self.folder = folder
        self._variables = {**os.environ, **(variables or {})}
        self._colcon = colcon_program()

    def colcon(self, *arguments: str) -> str:
        """Run colcon, and return its output.

        Raises:
            AssertionError: It failed.
        """
        result = self.run(*arguments)
        assert result.returncode == 0, result.stdout + result.stderr
        return result.stdout

    def run(self, *arguments: str) -> "subprocess.CompletedProcess[str]":
        """Run colcon, whatever comes of it."""
        return subprocess.run(
            [str(self._colcon), *arguments],
            cwd=self.folder,
            env=self._variables,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=BUILD_LIMIT_S,
            check=False,
        )

    def command(self, package: str, executable: str, arguments: Sequence[str] = ()) -> list[str]:
        """Arguments of bash that run an installed program with the workspace sourced."""
        program = self.folder / "install" / package / "lib" / package / executable
        assert program.is_file(), f"colcon installed no {program}"
        return ["-c", _ENTER, str(self.folder), str(program), *arguments]

    def python(self, *arguments: str) -> list[str]:
        """Arguments of bash that run this Python with the workspace sourced."""
        return ["-c", _ENTER, str(self.folder), sys.executable, *arguments]
