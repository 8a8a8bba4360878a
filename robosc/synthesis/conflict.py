"""Minimal sets of constraints: a conflict, which makes a problem empty, and a removal, which repairs it.

Source: U. Junker, "QuickXplain: preferred explanations and relaxations for over-constrained problems", AAAI 2004, pp.
167-172 (a minimal conflict by halves: for k of n constraints some 2k log(n/k) + 2k checks). A minimal removal is the
complement of a maximal relaxation, which is also built by halves.

Emptiness must be monotone: a problem that is empty stays empty with more constraints.
"""

from collections.abc import Callable, Sequence

IsEmpty = Callable[[frozenset[int]], bool]
"""Function that returns True if the problem with only these constraints is empty."""


def minimal_conflict(things: Sequence[int], is_empty: IsEmpty) -> tuple[int, ...]:
    """A minimal set of constraints that makes a problem empty; no constraints if it is empty without any.

    Args:
        things: All constraints, which together make the problem empty; earlier ones are preferred for the result.
        is_empty: Function that decides whether a problem is empty.
    """
    if is_empty(frozenset()):
        return ()
    return tuple(sorted(_conflict(is_empty, frozenset(), (), tuple(things)), key=things.index))


def _conflict(
    is_empty: IsEmpty, background: frozenset[int], added: Sequence[int], candidates: tuple[int, ...]
) -> tuple[int, ...]:
    """Return the candidates that make the problem empty, together with the background.

    `added` are the constraints that were added last to the background.
    """
    if added and is_empty(background):
        return ()
    if len(candidates) == 1:
        return candidates
    middle = len(candidates) // 2
    first, second = candidates[:middle], candidates[middle:]
    of_second = _conflict(is_empty, background.union(first), first, second)
    of_first = _conflict(is_empty, background.union(of_second), of_second, first)
    return (*of_first, *of_second)


def minimal_removal(things: Sequence[int], is_empty: IsEmpty) -> tuple[int, ...]:
    """A minimal set of constraints to remove, so that the problem with all others is not empty.

    Args:
        things: All constraints; earlier ones are preferred to stay.
        is_empty: Function that decides whether a problem is empty; false without any constraint.
    """
    kept = _grown(is_empty, frozenset(), tuple(things))
    return tuple(item for item in things if item not in kept)


def _grown(is_empty: IsEmpty, kept: frozenset[int], more: tuple[int, ...]) -> frozenset[int]:
    """Return the constraints that can stay: those that are kept already, and the ones of `more` that fit them."""
    together = kept.union(more)
    if not more or not is_empty(together):
        return together
    if len(more) == 1:
        return kept
    middle = len(more) // 2
    return _grown(is_empty, _grown(is_empty, kept, more[:middle]), more[middle:])
