"""Engines for binary decision diagrams, found by name.

dd offers one interface over CUDD (C) and over plain Python. `Manager` writes down what synthesis uses of it;
what the two do differently (counting, restricting, complemented edges) is not used but done on the nodes.
"""

import importlib
from collections.abc import Callable, Iterable, Mapping
from importlib.metadata import entry_points
from typing import Any, Protocol

from robosc.errors import RoboscError

ENTRY_POINTS = "robosc.bdd_engines"

_CACHE_SLOTS = 2**14
"""Results of operations that CUDD remembers at the beginning; it takes more as they pay. Its own choice of 2^18 takes
longer to set up than a supervisor of a dozen states."""


class Manager(Protocol):
    """A store of shared nodes over ordered Boolean variables.

    A node has `var`, `level`, `negated`, `low`, `high`, `dag_size` (nodes below it, itself and the constants included),
    a number (`int`), and the operators `&`, `|`, `~`, `==`.
    """

    true: Any
    false: Any

    def declare(self, *names: str) -> Any:
        """Add variables below those there are."""

    def var(self, name: str) -> Any:
        """The predicate that a variable is true."""

    def ite(self, test: Any, then: Any, otherwise: Any) -> Any:
        """If-then-else."""

    def let(self, definitions: Mapping[str, Any], node: Any) -> Any:
        """Substitute variables at once: all by truth values, all by names, or all by predicates."""

    def exist(self, names: Iterable[str], node: Any) -> Any:
        """Where some value of the variables makes a predicate true."""


class UnknownEngineError(RoboscError, LookupError):
    """An engine that is not known or not installed."""


_FACTORIES: dict[str, Callable[[], Manager]] = {}


def _make_cudd() -> Manager:
    manager = importlib.import_module("dd.cudd").BDD(initial_cache_size=_CACHE_SLOTS)
    # The order is chosen from the model; reordering would make results depend on sizes met on the way.
    manager.configure(reordering=False)
    return manager  # type: ignore[no-any-return]  # dd has no types


def _make_autoref() -> Manager:
    manager = importlib.import_module("dd.autoref").BDD()
    manager.configure(reordering=False)
    return manager  # type: ignore[no-any-return]


def register(name: str, factory: Callable[[], Manager]) -> None:
    """Add or replace an engine."""
    _FACTORIES[name] = factory


def engine_names() -> tuple[str, ...]:
    """Every engine that is known."""
    return tuple(sorted({*_FACTORIES, *(point.name for point in entry_points(group=ENTRY_POINTS))}))


def resolve_engine(name: str) -> str:
    """The engine that a name stands for: `auto` is CUDD where its extension is installed.

    Raises:
        UnknownEngineError: There is no such engine, or it is not installed.
    """
    if name == "auto":
        return "cudd" if _has_cudd() else "autoref"
    # What other packages offer is looked up only if it is asked for: that reads the lists of all that is installed.
    if name not in _FACTORIES and name not in engine_names():
        raise UnknownEngineError(f"unknown engine '{name}'; there are auto, {', '.join(engine_names())}")
    if name == "cudd" and not _has_cudd():
        raise UnknownEngineError("the engine 'cudd' needs dd's C extension, which is not installed; use 'autoref'")
    return name


def make_manager(name: str) -> Manager:
    """A fresh manager of a resolved engine.

    Raises:
        UnknownEngineError: Another package offers the engine but cannot be imported.
    """
    if name in _FACTORIES:
        return _FACTORIES[name]()
    point = next(iter(entry_points(group=ENTRY_POINTS, name=name)))
    try:
        factory: Callable[[], Manager] = point.load()
    except (ImportError, AttributeError) as error:
        raise UnknownEngineError(f"the engine '{name}' cannot be loaded from {point.value}: {error}") from error
    return factory()


def _has_cudd() -> bool:
    try:
        importlib.import_module("dd.cudd")
    except ImportError:
        return False
    return True


register("cudd", _make_cudd)
register("autoref", _make_autoref)
