"""What takes long to build, once for all workers of a run."""

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from support.colcon import locked


def shared(factory: pytest.TempPathFactory, name: str, build: Callable[[Path], object]) -> Path:
    """A folder that all workers of a run share; whoever comes first builds in it, the others wait for it.

    Args:
        factory: That of the run.
        name: For the folder.
        build: Is given the folder, which is empty.
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
