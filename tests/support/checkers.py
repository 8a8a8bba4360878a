"""Programs that look at the files of deploy/: in an environment of their own, made by `make checkers`."""

import shutil
import subprocess
from pathlib import Path

import pytest

TOP = Path(__file__).parents[2]
_PLACES = (TOP / ".venv-checkers" / "bin", TOP / ".venv-checkers" / "prometheus")


def checked(name: str, *arguments: object, folder: Path = TOP, text: str | None = None) -> str:
    """Return the output of a checker that finds no fault; one that finds any fails the test.

    Args:
        name: Name of the program; where it is not there, the test is skipped.
        *arguments: Arguments of the program.
        folder: Folder in which it is started.
        text: Its standard input.
    """
    program = found(name)
    words = [program, *map(str, arguments)]
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, timeout=120, input=text)
    assert done.returncode == 0, f"{name}:\n{done.stdout}{done.stderr}"
    return done.stdout + done.stderr


def found(name: str) -> str:
    """Return the path of a checker; where it is not there, the test is skipped."""
    program = shutil.which(name, path=":".join(map(str, _PLACES)))
    if program is None:
        pytest.skip(f"there is no {name}: make checkers")
    return program
