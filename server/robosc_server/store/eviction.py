"""Choice of who gives something back first: whoever holds most."""

import heapq
from collections.abc import Callable, Iterable, Iterator, Mapping


def choose_evicted(
    held: Mapping[str, int], oldest: Callable[[str], Iterable[tuple[str, int]]], excess: int, limit: int
) -> tuple[list[str], dict[str, int]]:
    """Choose the things that go, one by one: each time the oldest of the owner who holds most at that moment.

    So nobody can push out what others have by holding much: all who hold more than the others come down to the same
    level first (max-min fairness; D. Bertsekas and R. Gallager, Data Networks, 2nd edition, 1992, section 6.5.2).

    Args:
        held: Amount that each owner holds.
        oldest: Function that returns the things of an owner that may go, the oldest first, each with the amount that
            its owner holds less then.
        excess: Amount that is too much, of all together.
        limit: Things that may go at once.

    Returns:
        The things that go, and the amount that each owner holds then.
    """
    left = dict(held)
    heap = [(-amount, owner) for owner, amount in left.items()]
    heapq.heapify(heap)
    things: dict[str, Iterator[tuple[str, int]]] = {}
    chosen: list[str] = []
    while heap and excess > 0 and len(chosen) < limit:
        _, owner = heap[0]
        if owner not in things:
            things[owner] = iter(oldest(owner))
        thing = next(things[owner], None)
        if thing is None:
            heapq.heappop(heap)
            continue
        name, freed = thing
        chosen.append(name)
        excess -= freed
        left[owner] -= freed
        heapq.heapreplace(heap, (-left[owner], owner))
    return chosen, left
