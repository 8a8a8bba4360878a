"""JSON documents with damage that may just fit."""

import copy
from collections.abc import Iterator
from random import Random
from typing import Any


def change_value(document: Any, chance: Random) -> None:
    """Put another value into a place of a document: mostly one that stands elsewhere in it."""
    slots = list(_slots(document))
    holder, key = chance.choice(slots)
    holder[key] = copy.deepcopy(_other_value(chance, slots, holder[key]))


def _other_value(chance: Random, slots: list[tuple[Any, Any]], old: Any) -> Any:
    """A value of a kind that may just fit."""
    if chance.random() < 0.7:
        same_kind = [value for holder, key in slots if type(value := holder[key]) is type(old)]
        return chance.choice(same_kind)
    return chance.choice([None, True, False, 0, 1, -1, 2**31, 2**70, 0.5, 1e308, "", "x", "Base", "a.b", [], {}, [[]]])


def _slots(value: Any) -> Iterator[tuple[Any, Any]]:
    """Every place of a JSON value, as container and key."""
    for key, inner in list(value.items()) if isinstance(value, dict) else list(enumerate(value)):
        yield value, key
        if isinstance(inner, dict | list):
            yield from _slots(inner)
