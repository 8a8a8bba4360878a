"""Names of a bundle: what stands at a place, where that is defined, and who else names it."""

import re
from bisect import bisect_right
from collections.abc import Iterable, Iterator
from functools import cached_property

from robosc.editing.definitions import Definition, definitions
from robosc.language.tokens import Kind, tokenize_broken
from robosc.model.check import Inspected
from robosc.source import Location, SourceFile


class Names:
    """The names of a robot or library and of the libraries that it imports from.

    Args:
        inspected: Knowledge of the bundle.
    """

    def __init__(self, inspected: Inspected) -> None:
        self._uses = inspected.checked.bindings.uses
        self._trees = [unit.tree for unit in inspected.units]

    @cached_property
    def definitions(self) -> dict[Location, Definition]:
        """Every definition by its place, the main file's first; a robot or library without a name is none."""
        return {item.location: item for tree in self._trees for item in definitions(tree) if item.name}

    @cached_property
    def _by_line(self) -> dict[tuple[str, int], list[Location]]:
        found: dict[tuple[str, int], list[Location]] = {}
        for place in (*self.definitions, *self._uses):
            found.setdefault((place.file, place.line), []).append(place)
        return found

    @cached_property
    def _by_definition(self) -> dict[Location, list[Location]]:
        found: dict[Location, list[Location]] = {}
        for use, definition in self._uses.items():
            found.setdefault(definition, []).append(use)
        return found

    def at(self, file: str, line: int, column: int) -> tuple[Location, Definition] | None:
        """The name that covers or touches a place, and what it means; None: there is no name that means something.

        Args:
            file: Name of the file.
            line: Line, from 1.
            column: Column in characters, from 1; behind the last character counts, too.
        """
        touched = [
            place
            for place in self._by_line.get((file, line), ())
            if place.column <= column <= place.column + place.length
        ]
        # The name that begins here is meant, not the one that ends here.
        for place in sorted(touched, key=lambda place: -place.column):
            found = self.definitions.get(self._uses.get(place, place))
            if found is not None:
                return place, found
        return None

    def uses(self, definition: Definition) -> list[Location]:
        """Every place that names a definition, sorted; its own is none of them."""
        return sorted(self._by_definition.get(definition.location, ()))

    def occurrences(self, file: str) -> Iterator[tuple[Location, Definition]]:
        """Every name of a file that means something, sorted."""
        places = {place for places in self._lines_of(file) for place in places}
        for place in sorted(places):
            found = self.definitions.get(self._uses.get(place, place))
            if found is not None:
                yield place, found

    def pattern(self) -> list[int]:
        """Return which names of the bundle mean the same.

        The result holds the place of what each name means among all places, in their order. A change that only gives
        a name another spelling leaves it as it is.
        """
        places = sorted({*self.definitions, *self._uses})
        number = {place: index for index, place in enumerate(places)}
        return [number.get(self._uses.get(place, place), -1) for place in places]

    def not_understood(self, file: SourceFile, name: str) -> list[Location]:
        """Return the places in a file of the bundle where a name has no meaning, because of errors.

        Args:
            file: The file.
            name: The name, without the mark that keeps it from being a word of the language.
        """
        known = {(place.line, place.column) for places in self._lines_of(file.name) for place in places}
        line_begins = [0, *(match.end() for match in re.finditer("\n", file.text))]
        word = re.compile(rf"\b{re.escape(name)}\b")
        found = []
        for text, kind, start in zip(*tokenize_broken(file.text), strict=True):
            if kind == Kind.OTHER or (kind == Kind.STRING and "\n" in text):
                # A quote or the begin of a comment that is there by mistake hides names.
                offsets = [start + match.start() for match in word.finditer(text)]
            else:
                offsets = [start] if kind == Kind.NAME and text.removeprefix("^") == name else []
            for offset in offsets:
                line = bisect_right(line_begins, offset)
                column = offset - line_begins[line - 1] + 1
                if (line, column) not in known:
                    found.append(Location(file.name, line, column, len(name)))
        return found

    def _lines_of(self, file: str) -> Iterable[list[Location]]:
        return (places for (name, _), places in self._by_line.items() if name == file)
