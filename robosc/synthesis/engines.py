"""Engines for binary decision diagrams, found by name.

dd offers one interface over CUDD (C) and over plain Python, and `robosc.oxidd_diagrams` the same over OxiDD (Rust).
`Manager` declares the part that synthesis uses. Operations in which they differ (counting, restricting, complemented
edges) are not used, but implemented on the nodes.
"""

import importlib
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Protocol

from robosc.dd_modules import load_dd
from robosc.errors import NodeLimitError, RoboscError
from robosc.oxidd_diagrams import DDMemoryError, OxiddManager
from robosc.synthesis.connection import left_aside

ENTRY_POINTS = "robosc.bdd_engines"

_CUDD_BASE_BYTES = 32 * 2**20
"""Memory that CUDD takes beside nodes, in bytes: caches and tables at the beginning."""

_CUDD_NODE_BYTES = 64
"""A node, its place in the unique table and its share of the cache."""

_OXIDD_BASE_NODES = 2**18
"""Nodes that an operation of OxiDD may make whatever the limit is."""

_SLACK = 4
"""Factor over the limit that one operation may take for what it needs on its way."""

_NEARLY = 0.9
"""Share of the memory that CUDD may have: at this much, that limit stopped it, and not the machine."""

_CACHE_SLOTS = 2**14
"""Results of operations that CUDD remembers at the beginning; it takes more as they pay. Its own choice of 2^18 takes
longer to set up than a supervisor of a dozen states."""


_MEMORY_ESTIMATE_BYTES = 2**24
_LOOSE_SLOTS = 6_710_886
"""CUDD fills a row for dead nodes, of a size that goes by the memory that it expects to use: with dd's own estimate of
1 GiB 8 MiB of it, longer than a small synthesis takes. How fast its tables grow is set as for that estimate; how large,
by the limits of a synthesis alone."""


class Manager(Protocol):
    """A store of shared nodes over ordered Boolean variables.

    A node has `var`, `level`, `negated`, `low`, `high`, `dag_size` (nodes below it, itself and the constants included),
    a number (`int`), and the operators `&`, `|`, `~`, `==`.
    """

    true: Any
    false: Any

    def __len__(self) -> int:
        """Return the number of nodes, of all predicates together."""

    def declare(self, *names: str) -> Any:
        """Add variables below those there are."""

    def var(self, name: str) -> Any:
        """The predicate that a variable is true."""

    def ite(self, test: Any, then: Any, otherwise: Any) -> Any:
        """Return the predicate that is `then` where `test` is true, and `otherwise` elsewhere."""

    def let(self, definitions: Mapping[str, Any], node: Any) -> Any:
        """Substitute variables at once: all by truth values, all by names, or all by predicates."""

    def cube(self, values: Mapping[str, bool]) -> Any:
        """Return the predicate that some variables have some values."""

    def support(self, node: Any) -> set[str]:
        """Return the variables that a predicate depends on."""

    def exist(self, names: Iterable[str], node: Any) -> Any:
        """Return the predicate that is true where some value of the variables makes a predicate true."""


@dataclass(frozen=True, slots=True)
class EngineOptions:
    """Options for making decision diagrams.

    Attributes:
        name: Name of the engine; `auto` is the fastest installed.
        is_reordering: True if the engine may change the order of variables during the fixed points (sifting;
            R. Rudell, "Dynamic variable ordering for ordered binary decision diagrams", ICCAD 1993, pp. 42-47). The
            static order is mostly better and takes no time; what comes out is the same.
        maximum_nodes: Nodes of all predicates together beyond which work is given up; None for no limit.
        condition_seconds: Seconds after which conditions that are left are not made shorter; None for no limit but that
            of steps, with which the same comes out every time.
    """

    name: str = "auto"
    is_reordering: bool = False
    maximum_nodes: int | None = None
    condition_seconds: float | None = None


def engine_options(engine: str | EngineOptions) -> EngineOptions:
    """The options of an engine that may be given by its name alone."""
    return EngineOptions(engine) if isinstance(engine, str) else engine


class UnknownEngineError(RoboscError, LookupError):
    """An engine that is not known or not installed."""


_FACTORIES: dict[str, Callable[[], Manager]] = {}

_READY: dict[str, Manager] = {}


def _make_cudd() -> Manager:
    manager = load_dd("cudd").BDD(initial_cache_size=_CACHE_SLOTS, memory_estimate=_MEMORY_ESTIMATE_BYTES)
    # The order is chosen from the model; reordering would make results depend on sizes met on the way.
    manager.configure(reordering=False, loose_up_to=_LOOSE_SLOTS)
    return manager  # type: ignore[no-any-return]  # dd has no types


def _make_autoref() -> Manager:
    manager = load_dd("autoref").BDD()
    manager.configure(reordering=False)
    return manager  # type: ignore[no-any-return]


def _make_oxidd() -> Manager:
    return OxiddManager()


def register(name: str, factory: Callable[[], Manager]) -> None:
    """Add or replace an engine."""
    _FACTORIES[name] = factory


def engine_names() -> tuple[str, ...]:
    """Every engine that is known."""
    from importlib.metadata import entry_points

    return tuple(sorted({*_FACTORIES, *(point.name for point in entry_points(group=ENTRY_POINTS))}))


def installed_engines() -> tuple[str, ...]:
    """Every engine that can be used, the fastest first; those of other packages follow by name."""
    own = ["oxidd", "autoref"]
    if _has_cudd():
        own.insert(1 if left_aside() else 0, "cudd")
    return (*own, *(name for name in engine_names() if name not in ("cudd", *own)))


def resolve_engine(name: str) -> str:
    """The engine that a name stands for: `auto` is CUDD where the kernel works with it, and OxiDD elsewhere.

    With the kernel CUDD mostly takes a little less time than OxiDD, and without it twice as much.

    Raises:
        UnknownEngineError: There is no such engine, or it is not installed.
    """
    if name == "auto":
        return "oxidd" if left_aside() else "cudd"
    # The engines of other packages are looked up only for an unknown name: that reads the lists of all installed
    # packages.
    if name not in _FACTORIES and name not in engine_names():
        raise UnknownEngineError(f"unknown engine '{name}'; there are auto, {', '.join(engine_names())}")
    if name == "cudd" and not _has_cudd():
        raise UnknownEngineError("the engine 'cudd' needs dd's C extension, which is not installed; use 'oxidd'")
    return name


def make_manager(name: str) -> Manager:
    """A fresh manager of a resolved engine.

    Raises:
        UnknownEngineError: Another package offers the engine but cannot be imported.
    """
    if name in _READY:
        return _READY.pop(name)
    if name in _FACTORIES:
        return _FACTORIES[name]()
    from importlib.metadata import entry_points

    point = next(iter(entry_points(group=ENTRY_POINTS, name=name)))
    try:
        factory: Callable[[], Manager] = point.load()
    except (ImportError, AttributeError) as error:
        raise UnknownEngineError(f"the engine '{name}' cannot be loaded from {point.value}: {error}") from error
    return factory()


def keep_ready(name: str) -> None:
    """Have the next manager of a resolved engine made already.

    For processes that are copied to do one thing each: to set CUDD up takes as long as a supervisor of a dozen states.

    Raises:
        UnknownEngineError: As `make_manager`.
    """
    if name not in _READY:
        _READY[name] = make_manager(name)


def node_count_of(manager: Manager) -> int:
    """Nodes that are in use; what an engine keeps without use is thrown away first if it can be."""
    collect = getattr(manager, "collect_garbage", None)
    if collect is not None:
        collect()
    return len(manager)


@contextmanager
def limited(manager: Manager, maximum_nodes: int | None) -> Iterator[None]:
    """Let no single operation of CUDD and OxiDD grow far beyond a number of nodes.

    The plain engine loses count of its nodes when an operation is broken off, so it is only asked between operations.

    Raises:
        NodeLimitError: An operation would have grown too far.
        MemoryError: The engine was refused memory before that. Mostly CUDD ends the process then, by `exit(1)`.
    """
    allowed_bytes = _allow(manager, maximum_nodes)
    has_failed = False
    try:
        yield
    except DDMemoryError:
        has_failed = True
    except ValueError as error:
        has_failed = _is_of_cudd(error, allowed_bytes)
        if not has_failed:
            raise
    # Outside of the handler: the error would keep the frames, and they the nodes of a manager that is to end.
    if has_failed:
        raise _failure(manager, maximum_nodes, allowed_bytes)


def within_limit[T](manager: Manager, maximum_nodes: int | None, work: Callable[[], T]) -> T:
    """Return the result of some work that `limited` limits.

    After an error that ends the work, nothing keeps its predicates: context managers of contextlib keep the frames of
    an error in a cycle.

    Raises:
        NodeLimitError: An operation would have grown too far.
        MemoryError: The engine was refused memory before that.
    """
    allowed_bytes = _allow(manager, maximum_nodes)
    try:
        return work()
    except DDMemoryError:
        pass
    except ValueError as error:
        if not _is_of_cudd(error, allowed_bytes):
            raise
    raise _failure(manager, maximum_nodes, allowed_bytes)


def _allow(manager: Manager, maximum_nodes: int | None) -> int | None:
    """Set and return the bytes that CUDD may have for a number of nodes; None for no limit, and for other engines."""
    if maximum_nodes is not None and isinstance(manager, OxiddManager):
        manager.limit(_OXIDD_BASE_NODES + _SLACK * maximum_nodes)
    if maximum_nodes is None or not is_compiled(manager):
        return None
    allowed_bytes = _CUDD_BASE_BYTES + _SLACK * _CUDD_NODE_BYTES * maximum_nodes
    manager.configure(max_memory=allowed_bytes)  # type: ignore[attr-defined]
    return allowed_bytes


def _is_of_cudd(error: ValueError, allowed_bytes: int | None) -> bool:
    """Return True if CUDD, whose memory is limited, has given an operation up; it has no error of its own for this."""
    return allowed_bytes is not None and "NULL" in str(error)


def _failure(manager: Manager, maximum_nodes: int | None, allowed_bytes: int | None) -> NodeLimitError | MemoryError:
    """Return the error for a failed operation: dd does not report CUDD's error code."""
    if isinstance(manager, OxiddManager):
        return node_limit_error(maximum_nodes or 0)
    # The tables of the failed operation are already free again.
    if _memory_of(manager) < _NEARLY * (allowed_bytes or 0):
        return MemoryError("the decision diagrams were refused memory")
    return node_limit_error(maximum_nodes or 0)


def _memory_of(manager: Any) -> float:
    """Bytes that CUDD has."""
    with warnings.catch_warnings():
        # That it counted in other units once is of no interest.
        warnings.simplefilter("ignore", UserWarning)
        return float(manager.statistics()["mem"])


def node_check(managers: Sequence[Manager], maximum_nodes: int | None) -> Callable[[], None]:
    """Return a check that raises NodeLimitError once some managers together have more nodes in use than they may."""

    def check() -> None:
        for manager in managers:
            if isinstance(manager, OxiddManager):
                manager.tend()
        if (
            maximum_nodes is not None
            and sum(map(len, managers)) > maximum_nodes
            and sum(map(node_count_of, managers)) > maximum_nodes
        ):
            raise node_limit_error(maximum_nodes)

    return check


def node_limit_error(maximum_nodes: int) -> NodeLimitError:
    """Return the error for diagrams that have become too large."""
    return NodeLimitError(f"BDD node limit {maximum_nodes} exceeded; raise it with --max-nodes")


def is_compiled(manager: Manager) -> bool:
    """Return True if an engine is CUDD, beside which every node that Python looks at is expensive."""
    return "cudd" in type(manager).__module__


def is_reordering(manager: Manager) -> bool:
    """Return True if an engine may change its order by itself now."""
    configure = getattr(manager, "configure", None)
    return bool(configure and configure().get("reordering"))


@contextmanager
def reordering(manager: Manager, order: Sequence[str], *, is_wanted: bool = True) -> Iterator[None]:
    """Let an engine change the order of variables meanwhile, if that is wanted; then restore the given order.

    Args:
        manager: A manager.
        order: Its variables, topmost first.
        is_wanted: True if anything is to be done at all.

    Raises:
        UnknownEngineError: The engine cannot do that.
    """
    if not is_wanted:
        yield
        return
    module = importlib.import_module(type(manager).__module__)
    if not hasattr(module, "reorder") or not hasattr(manager, "configure"):
        raise UnknownEngineError("this engine cannot change the order of variables")
    manager.configure(reordering=True)
    yield
    manager.configure(reordering=False)
    module.reorder(manager, {name: level for level, name in enumerate(order)})


def _has_cudd() -> bool:
    try:
        load_dd("cudd")
    except ImportError:
        return False
    return True


register("cudd", _make_cudd)
register("oxidd", _make_oxidd)
register("autoref", _make_autoref)
