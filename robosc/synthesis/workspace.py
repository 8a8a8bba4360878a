"""Basis of all work on predicates: an engine, a system encoded in it, and the monitor of the waiting caller."""

from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager

import msgspec

from robosc.automata.state import Subject
from robosc.automata.structure import System
from robosc.expressions import Expression
from robosc.oxidd_diagrams import OxiddManager
from robosc.synthesis.encoding import Encoding
from robosc.synthesis.engines import (
    EngineOptions,
    Manager,
    engine_options,
    limited,
    make_manager,
    node_check,
    reordering,
    resolve_engine,
    within_limit,
)
from robosc.synthesis.monitor import ProgressMonitor
from robosc.synthesis.order import Blocks
from robosc.synthesis.result import Order, SynthesisProgress


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


class Workspaces:
    """Workspaces of one work, whose nodes are counted together.

    Args:
        engine: Name of the engine for decision diagrams, or more about it.
        should_stop: Asked again and again; once true, the work ends.
        on_progress: Called with the progress of the work.

    Attributes:
        options: The engine's options.
        monitor: Monitor of the waiting caller.

    Raises:
        UnknownEngineError: There is no such engine.
    """

    def __init__(
        self,
        engine: str | EngineOptions,
        should_stop: Callable[[], bool],
        on_progress: Callable[[SynthesisProgress], None],
    ) -> None:
        self.options = engine_options(engine)
        self._engine = resolve_engine(self.options.name)
        self._managers: list[Manager] = []
        self.monitor = ProgressMonitor(should_stop, on_progress, node_check(self._managers, self.options.maximum_nodes))

    def opened(
        self,
        system: System,
        monitor: ProgressMonitor,
        conditions: Iterable[Expression] = (),
        followed: Collection[Subject] = (),
        order: tuple[Order, Blocks] | None = None,
    ) -> Workspace:
        """A workspace for a system, whose nodes count until it is closed.

        Args:
            system: The system.
            monitor: Monitor of the work there.
            conditions: Conditions on the system's states that the work is about, besides its own.
            followed: Places that get next-state variables, besides those that images need.
            order: Order of its places; None for the best.
        """
        manager = make_manager(self._engine)
        if isinstance(manager, OxiddManager):
            manager.pause = lambda: monitor.check_stop(0)
        encoding = Encoding(system, manager, monitor.check_stop, conditions, followed, order)
        self._managers.append(manager)
        return Workspace(self._engine, encoding, monitor, self.options.is_reordering, self.options.condition_seconds)

    def limited[T](self, place: Workspace, work: Callable[[], T]) -> T:
        """Return the result of some work in a workspace, no operation of which may take far too many nodes."""
        return within_limit(place.encoding.manager, self.options.maximum_nodes, work)

    def keep(self, place: Workspace) -> None:
        """Count the nodes of one workspace alone: nobody needs the others."""
        self._managers[:] = [place.encoding.manager]

    def close(self, place: Workspace) -> None:
        """Count the nodes of a workspace no more: nobody needs it."""
        self._managers[:] = [manager for manager in self._managers if manager is not place.encoding.manager]


@contextmanager
def workspace(
    system: System,
    engine: str | EngineOptions,
    should_stop: Callable[[], bool],
    on_progress: Callable[[SynthesisProgress], None],
    conditions: Iterable[Expression] = (),
    followed: Collection[Subject] = (),
) -> Iterator[Workspace]:
    """A workspace of its own for a system: the arguments are those of `Workspaces` and `opened`.

    Raises:
        NodeLimitError: Diagrams became larger than the options allow.
        SynthesisCancelled: `should_stop` became true.
        UnknownEngineError: There is no such engine.
    """
    all_ = Workspaces(engine, should_stop, on_progress)
    place = all_.opened(system, all_.monitor, conditions, followed)
    with limited(place.encoding.manager, all_.options.maximum_nodes):
        yield place
