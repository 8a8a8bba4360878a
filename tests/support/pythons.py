"""Other Pythons than that of the tests: found by starting them, wherever they were installed."""

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

START_LIMIT_S = 60.0

# A Python with ROS 2 hands some down; others would make a program of an environment another one.
_OWN = ("LD_LIBRARY_PATH", "_ROS_WHEELS_BOOTSTRAP_COMPLETE", "PYTHONPATH", "PYTHONHOME", "PYENV_VERSION")


def variables() -> dict[str, str]:
    """Environment of another Python: that of the tests without what is only for theirs."""
    return {name: value for name, value in os.environ.items() if name not in _OWN}


def python_of(minor: int) -> Path:
    """A Python 3 of a minor version that starts here; skips the test where there is none."""
    found = _find(minor)
    if found is None:
        pytest.skip(f"no Python 3.{minor} starts here: looked on PATH, at pyenv and at uv")
    return found


@cache
def _find(minor: int) -> Path | None:
    if sys.version_info[:2] == (3, minor):
        return Path(sys.executable)
    return next((path for path in _candidates(minor) if _is_python(path, minor)), None)


def _candidates(minor: int) -> Iterator[Path]:
    """Programs that may be the wanted one; a shim of pyenv is no Python yet."""
    name = f"python3.{minor}"
    if (on_path := shutil.which(name)) is not None:
        yield Path(on_path)
    pyenv = os.environ.get("PYENV_ROOT") or _output(["pyenv", "root"])
    if pyenv:
        yield from sorted(Path(pyenv).glob(f"versions/3.{minor}.*/bin/{name}"), reverse=True)
    if by_uv := _output(["uv", "python", "find", "--no-python-downloads", f"3.{minor}"]):
        yield Path(by_uv)


def _is_python(program: Path, minor: int) -> bool:
    return _output([str(program), "-ISc", "import sys; print(*sys.version_info[:2])"]) == f"3 {minor}"


def _output(command: list[str]) -> str:
    """Return what a program prints; empty if it fails or does not exist."""
    try:
        done = subprocess.run(
            command, env=variables(), capture_output=True, text=True, timeout=START_LIMIT_S, check=False
        )
    except OSError:
        return ""
    return done.stdout.strip() if done.returncode == 0 else ""
