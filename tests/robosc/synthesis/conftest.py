"""The engine that a test of synthesis runs on: each of them."""

import pytest

from support.engines import needs_cudd


@pytest.fixture(scope="session", params=[pytest.param("cudd", marks=needs_cudd), "autoref"])
def engine(request: pytest.FixtureRequest) -> str:
    """Name of an engine."""
    return str(request.param)
