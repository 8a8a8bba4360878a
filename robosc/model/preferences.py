"""Preferences among requests, and whether they contradict each other."""

from collections.abc import Sequence
from graphlib import CycleError, TopologicalSorter

import msgspec

from robosc.model.structure import Preference


class Contradiction(msgspec.Struct, frozen=True):
    """Circle of preferences.

    Attributes:
        names: Names of communications, each of which is preferred over the next one, and the last over the first.
        preferences: For each of them the number of the preference that says so, from 0.
    """

    names: tuple[str, ...]
    preferences: tuple[int, ...]


def contradiction(preferences: Sequence[Preference]) -> Contradiction | None:
    """Return a circle of preferences, or None if there is an order of requests that obeys all of them.

    Takes time linear in the number of names that the preferences have.
    """
    # Each preference is a vertex, too, between its two sides: else there were an edge for each pair of names.
    sorter = TopologicalSorter[str | int]()
    for number, item in enumerate(preferences):
        sorter.add(number, *item.preferred)
        for name in item.others:
            sorter.add(name, number)
    try:
        sorter.prepare()
    except CycleError as error:
        circle: list[str | int] = error.args[1][:-1]
        if isinstance(circle[0], int):
            circle = [*circle[1:], circle[0]]
        return Contradiction(
            tuple(item for item in circle if isinstance(item, str)),
            tuple(item for item in circle if isinstance(item, int)),
        )
    return None


__all__ = ["Contradiction", "contradiction"]
