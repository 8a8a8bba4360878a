"""The engine that a test of synthesis runs on, each of them; and what makes the kernel."""

import importlib.util
from pathlib import Path
from types import ModuleType

import pytest

from support.engines import needs_cudd


@pytest.fixture(scope="session", params=[pytest.param("cudd", marks=needs_cudd), "oxidd", "autoref"])
def engine(request: pytest.FixtureRequest) -> str:
    """Name of an engine."""
    return str(request.param)


@pytest.fixture(scope="session")
def build() -> ModuleType:
    """The hook that makes the kernel, which is no part of the package."""
    path = Path(__file__).parents[3] / "deploy" / "build_kernel.py"
    spec = importlib.util.spec_from_file_location("build_kernel", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
