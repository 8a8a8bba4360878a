"""Minimal sets: which of many things together make a problem empty, and which would have to go.

Sources: U. Junker, "QuickXplain: preferred explanations and relaxations for over-constrained problems", AAAI 2004, pp.
167-172 (a minimal conflict by halves: for k of n things some 2k log(n/k) + 2k questions); the things that have to go
are what a maximal relaxation, grown by halves too, leaves out.

What is asked must be monotone: with more things an empty problem stays empty.
"""

from collections.abc import Callable, Sequence

IsEmpty = Callable[[frozenset[int]], bool]
"""Function that returns True if the problem with these things alone is empty."""


def minimal_conflict(things: Sequence[int], is_empty: IsEmpty) -> tuple[int, ...]:
    """Things that make a problem empty, none of which can be missing; nothing where it is empty without any.

    Args:
        things: All things, which together make it empty; of several such sets, one of early things is found.
        is_empty: The question.
    """
    if is_empty(frozenset()):
        return ()
    return tuple(sorted(_conflict(is_empty, frozenset(), (), tuple(things)), key=things.index))


def _conflict(
    is_empty: IsEmpty, background: frozenset[int], added: Sequence[int], candidates: tuple[int, ...]
) -> tuple[int, ...]:
    """Return those of `candidates` that make the problem empty.

    They do so beside the background to which `added` came last.
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
    """Things without which the problem of all others is not empty, none of which can stay.

    Args:
        things: All things; the earlier ones rather stay than the later ones.
        is_empty: The question; false of nothing at all.
    """
    kept = _grown(is_empty, frozenset(), tuple(things))
    return tuple(item for item in things if item not in kept)


def _grown(is_empty: IsEmpty, kept: frozenset[int], more: tuple[int, ...]) -> frozenset[int]:
    """Return the things that can stay: those kept already, and those of `more` that can stay beside them."""
    together = kept.union(more)
    if not more or not is_empty(together):
        return together
    if len(more) == 1:
        return kept
    middle = len(more) // 2
    return _grown(is_empty, _grown(is_empty, kept, more[:middle]), more[middle:])
