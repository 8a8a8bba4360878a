"""Moves as pairs, of a state in which a move begins and of the stable state in which it ends, on decision diagrams.

Where states are looked at again and again, one operation on pairs takes the place of one for each event of a message
and each silent step after it.

Source: J. R. Burch, E. M. Clarke and D. E. Long, "Symbolic model checking with partitioned transition relations", VLSI
1991, pp. 49-58.
"""

from collections.abc import Mapping
from typing import Any

from robosc.synthesis.engines import Manager
from robosc.synthesis.nodes import met, renamed

MAXIMUM_NODES = 5_000
"""Nodes of the pairs that one diagram holds."""


class Pairs:
    """Moves as pairs; the states in which they end are in next-state variables.

    Args:
        manager: The manager.
        names: The variables that moves change, with their next-state variables.
    """

    def __init__(self, manager: Manager, names: Mapping[str, str]) -> None:
        self._manager = manager
        self._names = tuple(names)
        self._next_names = tuple(names.values())
        self._back = {new: old for old, new in names.items()}
        self._parts: list[Any] = []

    def __bool__(self) -> bool:
        """Return True if there are any."""
        return bool(self._parts)

    def add(self, pairs: Any) -> bool:
        """Add the pairs of some moves, unless their diagram is too large; return True if it is not."""
        if pairs.dag_size > MAXIMUM_NODES:
            return False
        if self._parts:
            both = self._parts[-1] | pairs
            if both.dag_size <= MAXIMUM_NODES:
                self._parts[-1] = both
                return True
        self._parts.append(pairs)
        return True

    def join(self, other: "Pairs") -> None:
        """Add the pairs of others."""
        for part in other._parts:
            self.add(part)

    def into(self, ends: Any) -> Any:
        """Return the states in which moves begin that can end in some stable states.

        Args:
            ends: The stable states, in next-state variables.
        """
        found = self._manager.false
        for part in self._parts:
            found = found | met(self._manager, self._next_names, part, ends)
        return found

    def ends(self, states: Any) -> Any:
        """Return the stable states in which moves can end that begin in some states."""
        found = self._manager.false
        for part in self._parts:
            found = found | met(self._manager, self._names, part, states)
        return renamed(self._manager, self._back, found)
