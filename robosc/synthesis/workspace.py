"""Basis of all work on predicates: an engine, a system encoded in it, and the monitor of the waiting caller."""

from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager

import msgspec

from robosc.automata.state import Subject
from robosc.automata.structure import System
from robosc.expressions import Expression
from robosc.synthesis.encoding import Encoding
from robosc.synthesis.engines import (
    EngineOptions,
    engine_options,
    limited,
    make_manager,
    node_check,
    reordering,
    resolve_engine,
)
from robosc.synthesis.monitor import ProgressMonitor
from robosc.synthesis.result import SynthesisProgress


class Workspace(msgspec.Struct, frozen=True):
    """An encoded system.

    Attributes:
        engine: Name of the engine that was resolved.
        encoding: The variables.
        monitor: Monitor of the waiting caller; it also counts nodes where they are limited.
        is_reordering: True if the engine may change its order.
        condition_seconds: Seconds that conditions may be made shorter for; None for no limit.
    """

    engine: str
    encoding: Encoding
    monitor: ProgressMonitor
    is_reordering: bool
    condition_seconds: float | None

    def reordering(self) -> AbstractContextManager[None]:
        """Let the engine change its order meanwhile, if it may."""
        return reordering(self.encoding.manager, self.encoding.order, is_wanted=self.is_reordering)


@contextmanager
def workspace(
    system: System,
    engine: str | EngineOptions,
    should_stop: Callable[[], bool],
    on_progress: Callable[[SynthesisProgress], None],
    conditions: Iterable[Expression] = (),
    followed: Collection[Subject] = (),
) -> Iterator[Workspace]:
    """A workspace of its own for a system.

    Args:
        system: The system.
        engine: Name of the engine for decision diagrams, or more about it.
        should_stop: Asked again and again; once true, the work ends.
        on_progress: Called with the progress of the work.
        conditions: Conditions on the system's states that the work is about, besides its own.
        followed: Places that get next-state variables, besides those that images need.

    Raises:
        NodeLimitError: Diagrams became larger than the options allow.
        SynthesisCancelled: `should_stop` became true.
        UnknownEngineError: There is no such engine.
    """
    options = engine_options(engine)
    name = resolve_engine(options.name)
    manager = make_manager(name)
    monitor = ProgressMonitor(should_stop, on_progress, node_check(manager, options.maximum_nodes))
    with limited(manager, options.maximum_nodes):
        encoding = Encoding(system, manager, monitor.check_stop, conditions, followed)
        yield Workspace(name, encoding, monitor, options.is_reordering, options.condition_seconds)
