"""Folders that take long to build, made once for all workers of a run."""

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from support.colcon import locked


def shared(factory: pytest.TempPathFactory, name: str, build: Callable[[Path], object]) -> Path:
    """Return a folder that all workers of a run share; the first one builds in it, the others wait for it.

    Args:
        factory: Factory of the run.
        name: Name for the folder.
        build: Function that is given the folder, which is empty.
    """
    own = factory.getbasetemp()
    base = own.parent if "PYTEST_XDIST_WORKER" in os.environ else own
    folder, built = base / name, base / f"{name}.built"
    with locked(base / f"{name}.lock"):
        if not built.exists():
            folder.mkdir()
            build(folder)
            built.touch()
    return folder
