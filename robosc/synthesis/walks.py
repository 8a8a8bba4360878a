"""Nodes of decision diagrams as walks over them see them: one interface, in the form that each engine is fastest with.

Where a walk goes from node to node, the calls in between take most of the time. The nodes of a walk are those of the
engine itself, and no question is asked meanwhile whether to stop: an engine may move its nodes then.
"""

from collections.abc import Callable
from operator import attrgetter, or_
from typing import Any, Protocol

from robosc.oxidd_diagrams import BCDDFunction, BooleanOperator, OxiddManager, Predicate
from robosc.synthesis.engines import Manager


class Nodes(Protocol):
    """Nodes of one manager.

    Attributes:
        restricted: Results for nodes restricted to others.
        taken_apart: Results for nodes by the values of a place of the state: see `diagrams`.
    """

    true: Any
    false: Any
    restricted: dict[tuple[Any, Any], Any]
    taken_apart: dict[tuple[Any, int], tuple[tuple[int, ...], tuple[Any, ...]]]

    def node(self, predicate: Any, /) -> Any:
        """Return the node of a predicate."""

    def predicate(self, node: Any, /) -> Any:
        """Return the predicate of a node."""

    def level(self, node: Any, /) -> int | None:
        """Return the level of a node, or None for a constant."""

    def split(self, node: Any, /) -> Any:
        """Return what is below a node that is no constant: where its variable is true, and where it is false."""

    def split_at(self, node: Any, level: int, /) -> tuple[Any, Any]:
        """Return what is left of a node where the variable of a level, not above it, is true, and where it is false."""

    def either(self, one: Any, other: Any, /) -> Any:
        """Return the node that is true where one of two is."""

    def joined(self, level: int, high: Any, low: Any, /) -> Any:
        """Return the node that tests the variable of a level, above two nodes."""


class OxiddNodes:
    """Functions of OxiDD without what makes predicates of them.

    Args:
        manager: The manager.
    """

    node = staticmethod(attrgetter("function"))
    level = staticmethod(BCDDFunction.node_level)
    split = staticmethod(BCDDFunction.cofactors)
    either = staticmethod(or_)

    def __init__(self, manager: OxiddManager) -> None:
        self._manager = manager
        self.true = manager.true.function
        self.false = manager.false.function
        # The conditions of one system are alike in part.
        self.restricted = manager.kept("restricted")
        self.taken_apart = manager.kept("taken apart")
        self._variables = manager.by_level()

    def split_at(self, node: Any, level: int) -> tuple[Any, Any]:
        """Return what is left of a node where the variable of a level is true, and where it is false."""
        variable = self._variables[level]
        high = node.apply_exists(BooleanOperator.AND, variable, variable)
        return high, node.apply_exists(BooleanOperator.AND, ~variable, variable)

    def joined(self, level: int, high: Any, low: Any) -> Any:
        """Return the node that tests the variable of a level, above two nodes."""
        return self._variables[level].ite(high, low)

    def predicate(self, node: Any) -> Predicate:
        """Return the predicate of a node."""
        return Predicate(self._manager, node)


class DdNodes:
    """Predicates of dd.

    Args:
        manager: The manager.
    """

    either = staticmethod(or_)

    def __init__(self, manager: Manager) -> None:
        self._manager = manager
        self.true = manager.true
        self.false = manager.false
        self.restricted: dict[tuple[Any, Any], Any] = {}
        self.taken_apart: dict[tuple[Any, int], tuple[tuple[int, ...], tuple[Any, ...]]] = {}
        self._names: dict[int, str] = {}

    @staticmethod
    def node(predicate: Any) -> Any:
        """Return the node of a predicate."""
        return predicate

    def level(self, node: Any) -> int | None:
        """Return the level of a node, or None for a constant."""
        if node.var is None:
            return None
        level: int = node.level
        self._names[level] = node.var
        return level

    @staticmethod
    def split(node: Any) -> tuple[Any, Any]:
        """Return what is below a node: a complemented edge complements both."""
        return (~node.high, ~node.low) if node.negated else (node.high, node.low)

    def split_at(self, node: Any, level: int) -> tuple[Any, Any]:
        """Return what is left of a node where the variable of a level is true, and where it is false."""
        name = self._manager.var_at_level(level)  # type: ignore[attr-defined]  # every manager of dd has it
        return self._manager.let({name: True}, node), self._manager.let({name: False}, node)

    def joined(self, level: int, high: Any, low: Any) -> Any:
        """Return the node that tests the variable of a level, above two nodes."""
        return self._manager.ite(self._manager.var(self._names[level]), high, low)

    @staticmethod
    def predicate(node: Any) -> Any:
        """Return the predicate of a node."""
        return node


def walked[T](manager: Manager, walk: Callable[[Nodes], T]) -> T:
    """Return the result of a walk over nodes of a manager."""
    if not isinstance(manager, OxiddManager):
        return walk(DdNodes(manager))
    return manager.attempt(lambda: walk(OxiddNodes(manager)))
