"""The kernel's functions for predicates, on the diagrams of CUDD inside dd."""

from collections.abc import Callable, Sequence
from types import ModuleType
from typing import Any, NamedTuple

from robosc.synthesis.connection import connected
from robosc.synthesis.engines import Manager, is_compiled
from robosc.synthesis.layout import NODE_OFFSET, address_of

TOTAL = 2
"""Reason for which a predicate is not taken apart: more ranges in all than there may be."""


class Extracted(NamedTuple):
    """A predicate as nodes over places, or the place at which it has too many ranges.

    Attributes:
        refused: 0, or the reason why there are no nodes.
        nodes: For each node the number of its place, its starts and its children.
        number: Number of the root, or of the place.
    """

    refused: int
    nodes: list[tuple[int, tuple[int, ...], tuple[int, ...]]]
    number: int


def kernel_of(manager: Manager) -> "Kernel | None":
    """Return the kernel for a manager, or None where only Python can work with it."""
    module = connected()[0] if is_compiled(manager) else None
    return None if module is None else Kernel(module, manager)


class Kernel:
    """The kernel at work on one manager.

    Args:
        module: The module in C.
        manager: A manager of dd.cudd.
    """

    def __init__(self, module: ModuleType, manager: Manager) -> None:
        self._module = module
        self._manager = manager

    @staticmethod
    def address(predicate: Any) -> int:
        """Return the address of a predicate's node; 0 for None. It stays that while the predicate is there."""
        return 0 if predicate is None else address_of(predicate)

    def predicate(self, address: int) -> Any:
        """Return the predicate of a node."""
        return self._manager._add_int(address + NODE_OFFSET)  # type: ignore[attr-defined]

    def restrict(self, predicate: Any, care: Any) -> Any:
        """Return what `nodes.restrict` does."""
        return self._returned(self._module.restrict(self._manager, self.address(predicate), self.address(care)))

    def implies(self, predicate: Any, other: Any) -> bool:
        """Return what `nodes.implies` does."""
        return bool(self._module.implies(self._manager, self.address(predicate), self.address(other)))

    def without(self, predicate: Any, cubes: Sequence[Any]) -> Any:
        """Return what `nodes.without` does."""
        return self._returned(self._module.without(self._manager, self.address(predicate), self._addresses(cubes)))

    def separated(self, one: Any, other: Any, cubes: Sequence[Any]) -> tuple[Any, Any]:
        """Return what `nodes.separated` does."""
        addresses = self._addresses(cubes)
        first, second = self._module.separated(self._manager, self.address(one), self.address(other), addresses)
        return self._returned(first), self._returned(second)

    def _addresses(self, predicates: Sequence[Any]) -> tuple[int, ...]:
        return tuple(map(self.address, predicates))

    def extract(
        self, predicate: Any, blocks: tuple[tuple[tuple[int, tuple[int, ...]], ...], ...], branches: int, maximum: int
    ) -> Extracted:
        """Return what `diagrams.extract` does, as far as a number of branches and of ranges go.

        Args:
            predicate: The predicate.
            blocks: Blocks of places: for each place how many values it can hold, and the levels of its bits.
            branches: Ranges of one place's values that a node may distinguish.
            maximum: Ranges that all nodes together may distinguish.
        """
        found = self._module.extract(self._manager, self.address(predicate), blocks, branches, maximum)
        return Extracted(*found)

    def closure(
        self,
        states: Any,
        within: Any,
        groups: tuple[Any, ...],
        until: Any,
        pause: Callable[[int, int], None],
        report: Callable[[int, int], None],
    ) -> Any:
        """Return a set of states closed under some steps.

        Args:
            states: The states to begin with.
            within: Predicate that added states satisfy.
            groups: Steps as `saturation` has them for the kernel.
            until: States once all of which are found the rest is not; or None.
            pause: Called again and again with the number of steps since the last call, and that of the nodes which one
                of them made; what it raises ends the work.
            report: Called with the number of the round and the address of the states that are found then.
        """
        begin, inside, enough = self.address(states), self.address(within), self.address(until)
        return self._returned(self._module.closure(self._manager, begin, inside, groups, enough, pause, report))

    def _returned(self, address: int) -> Any:
        found = self.predicate(address)
        self._module.release(self._manager, address)
        return found
