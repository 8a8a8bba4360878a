"""Events whose permission reads a part of the state, as the table of a C file: so they alone are asked anew."""

from collections.abc import Mapping, Sequence

from robosc.targets.code.c.layout import width
from robosc.targets.code.expressions import Code, Sort, call, integer, literal, variable

_FEW = 8


class Readers:
    """Table of the events that are asked anew after a place of the state has changed.

    Each entry is the number of events, and then the events' own numbers; equal entries are written once. Where a place
    is read by many, more than an eighth of all events, all of them are asked anew: so the table remains small in a
    model in which everything depends on everything.

    A small robot needs no table: there the readers are the bits of a number.

    Args:
        is_small: True for the code of a small robot.
        read: For each event that is asked, in the order of their numbers, what its permission reads and calls.
        uses: For each function, what it reads and calls.
    """

    def __init__(self, is_small: bool, read: Sequence[set[str]], uses: Mapping[str, set[str]]) -> None:
        self._is_small = is_small
        self._count = len(read)
        self._readers: dict[str, list[int]] = {}
        for number, words in enumerate(read):
            for word in _with_called(words, uses):
                self._readers.setdefault(word, []).append(number)
        self._places: dict[tuple[int, ...], int] = {}
        self._names: dict[int, list[str]] = {}
        self._length = 0

    def noted(self, place: str) -> Code:
        """The call that notes another value of a place."""
        found = tuple(self._readers.get(place, ()))
        if self._is_small:
            bits = sum(1 << number for number in found)
            return call("changed", variable("r"), literal(f"UINT32_C({bits:#x})", Sort.INTEGER))
        if len(found) > max(_FEW, self._count // 8):
            return call("all_changed", variable("r"))
        if found not in self._places:
            self._places[found] = self._length
            self._length += 1 + len(found)
        names = self._names.setdefault(self._places[found], [])
        if place not in names:
            names.append(place)
        return call("changed", variable("r"), integer(self._places[found]))

    def lines(self) -> list[str]:
        """The table; nothing where nothing is ever asked, or nothing ever changes."""
        if not self._count or not self._places:
            return []
        rows = []
        for found, place in self._places.items():
            names = [name.removeprefix("s->") for name in self._names[place]]
            words = ", ".join(names[:3]) + (f" and {len(names) - 3} more" if len(names) > 3 else "")
            rows.append(f"    {', '.join(map(str, (len(found), *found)))}, /* {place}: {words} */")
        return [
            "/* Readers of parts of the state: how many there are, then the numbers of the silent steps and requests,",
            "   in this order, that may be allowed now or no longer where such a part has changed. */",
            f"static const {width(self._count + 1)} READERS[] = {{",
            *rows,
            "};",
        ]


def _with_called(words: set[str], uses: Mapping[str, set[str]]) -> set[str]:
    """Some words, with all that those of them which are functions read and call."""
    found: set[str] = set()
    to_do = [*words]
    while to_do:
        word = to_do.pop()
        if word not in found:
            found.add(word)
            to_do += uses.get(word, ())
    return found
