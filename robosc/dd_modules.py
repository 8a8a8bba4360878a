"""The engines of dd, loaded without the package that they only draw with.

dd imports networkx if it is installed, to offer its graphs. This import takes three times as long as the rest of dd,
and RoboSC uses no such graph. dd works without networkx.
"""

import importlib
import sys
import threading
from importlib.machinery import PathFinder
from importlib.util import find_spec
from types import ModuleType

_DRAWS = "networkx"
_LOCK = threading.Lock()


def load_dd(name: str) -> ModuleType:
    """A module of dd, such as `autoref`.

    A program that wants dd's graphs as well imports networkx before.

    Raises:
        ImportError: It is not there, as `cudd` where dd was built without it.
    """
    whole = f"dd.{name}"
    with _LOCK:
        if _DRAWS in sys.modules:
            return importlib.import_module(whole)
        # None makes Python take the module for missing (https://docs.python.org/3/reference/import.html#the-module-cache).
        sys.modules[_DRAWS] = None  # type: ignore[assignment]
        try:
            return importlib.import_module(whole)
        finally:
            del sys.modules[_DRAWS]


def has_cudd() -> bool:
    """Return True if dd has its engine in C; nothing is loaded to find out."""
    package = find_spec("dd")
    return package is not None and PathFinder.find_spec("dd.cudd", package.submodule_search_locations) is not None
