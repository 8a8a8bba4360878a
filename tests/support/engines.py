"""Engines of synthesis that tests run on; dd's C extension may be missing."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec

import pytest

ENGINES = ("cudd", "oxidd", "autoref")
needs_cudd = pytest.mark.skipif(find_spec("dd.cudd") is None, reason="dd's C extension is not installed")


@contextmanager
def engine_of_verification(name: str) -> Iterator[str]:
    """Name of the engine, with which verification chooses it: OxiDD where there is no CUDD."""
    with pytest.MonkeyPatch.context() as patch:
        if name == "oxidd":
            patch.setitem(sys.modules, "dd.cudd", None)
        yield name
