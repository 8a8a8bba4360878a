"""Engines of synthesis that tests run on; dd's C extension may be missing."""

from importlib.util import find_spec

import pytest

ENGINES = ("cudd", "oxidd", "autoref")
needs_cudd = pytest.mark.skipif(find_spec("dd.cudd") is None, reason="dd's C extension is not installed")
