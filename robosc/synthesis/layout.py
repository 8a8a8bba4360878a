"""The layout of dd's objects and of CUDD's nodes, as the kernel takes them for granted: those of dd 0.6 and CUDD 3.0.

Another build of dd may lay them out otherwise, and what the kernel then took for an address could end the process. So a
small diagram is looked at first: by reading memory that may not be there, and, once that is as expected, by the kernel.
"""

import sys
from types import ModuleType
from typing import Any

NODE_OFFSET = 2
"""The number of a predicate in dd is the address of its node and this; 0 and 1 are its constants."""

_SIZES = (56, 64)
"""Bytes of a manager and of a predicate of dd.cudd."""

_ONE = 32
"""Place of the constant true in CUDD's manager, in bytes, and of CUDD's own node before it."""

_WORD = 8


def address_of(predicate: Any) -> int:
    """Return the address of a predicate's node, whose last bit says that the node is negated."""
    return int(predicate) - NODE_OFFSET


def layout_problem(kernel: ModuleType, cudd: ModuleType) -> str:
    """Return what is other than the kernel takes for granted; empty if nothing.

    Args:
        kernel: The kernel, connected with the CUDD inside dd.
        cudd: The module dd.cudd.
    """
    if (cudd.BDD.__basicsize__, cudd.Function.__basicsize__) != _SIZES:
        return "the objects of this dd have another size"
    # A manager as small as can be: all of this takes 0.2 ms.
    bdd = cudd.BDD(initial_cache_size=2, memory_estimate=2**20)
    bdd.configure(reordering=False)
    bdd.declare("a", "b")
    try:
        return _problem(kernel, bdd)
    except (AttributeError, TypeError) as error:
        return f"this dd has another interface: {error}"
    except OSError as error:
        return f"the layout of this dd could not be looked at: {error}"


def _problem(kernel: ModuleType, bdd: Any) -> str:
    true, false, a, b = bdd.true, bdd.false, bdd.var("a"), bdd.var("b")
    known = kernel.bytes_at(kernel.manager(bdd), _ONE + _WORD)
    one = known and int.from_bytes(known[_ONE:], sys.byteorder)
    if one != address_of(true) or one ^ 1 != address_of(false):
        return "this dd keeps CUDD's manager elsewhere"
    # From here on the kernel may work with this manager: CUDD itself says what is in the nodes.
    both = a & ~b
    for predicate in (true, false, a, b, ~a, both, ~both):
        if kernel.look(bdd, address_of(predicate)) != _as_dd_says(predicate):
            return "the nodes of this dd are laid out otherwise"
        if bdd._add_int(address_of(predicate) + NODE_OFFSET) != predicate:
            return "this dd numbers its predicates otherwise"
    before = a.ref
    found = kernel.without(bdd, address_of(both), (address_of(b),))
    counted = a.ref
    kernel.release(bdd, found)
    if (found, counted, a.ref) != (address_of(a), before + 1, before):
        return "this dd counts references otherwise"
    return ""


def _as_dd_says(predicate: Any) -> tuple[int, int, int]:
    """Return a node's level and the addresses of its cofactors, low before high; those of dd are not negated."""
    if predicate.var is None:
        return -1, 0, 0
    return predicate.level, *(address_of(child) ^ predicate.negated for child in (predicate.low, predicate.high))
