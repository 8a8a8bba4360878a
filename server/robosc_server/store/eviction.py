"""Fair choice of what to evict: the oldest items of the owner with the most data."""

import heapq
from collections.abc import Callable, Iterable, Iterator, Mapping


def choose_evicted(
    held: Mapping[str, int], oldest: Callable[[str], Iterable[tuple[str, int]]], excess: int, limit: int
) -> tuple[list[str], dict[str, int]]:
    """Choose items to evict one by one: each time the oldest item of the owner with the most data at that moment.

    So no owner can displace the data of others: owners with more data than others are reduced to the same level first
    (max-min fairness; D. Bertsekas and R. Gallager, Data Networks, 2nd edition, 1992, section 6.5.2).

    Args:
        held: Amount that each owner holds.
        oldest: Function that returns the evictable items of an owner, the oldest first, each with the amount that its
            eviction frees.
        excess: Amount by which all owners together exceed their limit.
        limit: Maximum number of evicted items.

    Returns:
        The evicted items, and the remaining amount of each owner.
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
