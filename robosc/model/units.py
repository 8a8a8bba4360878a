"""Files as units of definitions, and where each component of a robot comes from."""

from collections.abc import Collection, Iterator
from itertools import count

import msgspec

from robosc.errors import RelatedPlace
from robosc.language import Parsed, parse, syntax
from robosc.language.bundle import declared_libraries
from robosc.model.findings import Findings
from robosc.source import Bundle, Location, SourceFile

_MAXIMUM_SHOWN = 6
"""Imports of a cycle that are reported."""


class Unit(msgspec.Struct, frozen=True, eq=False):
    """A robot or a library; compared by identity.

    Attributes:
        tree: Its syntax tree.
        components: Components by name.
        types: Data types by name.
        interfaces: Interfaces by name.
        constants: Constants by name.
    """

    tree: syntax.File
    components: dict[str, syntax.Component]
    types: dict[str, syntax.ObjectDefinition | syntax.EnumDefinition]
    interfaces: dict[str, syntax.Interface]
    constants: dict[str, syntax.Constant]

    def type_name(self, name: str) -> str:
        """A type's name in the model: a library's types carry its name before their own."""
        return f"{self.tree.name.text}.{name}" if self.tree.is_library else name


class Part(msgspec.Struct, frozen=True):
    """A component of the robot.

    Attributes:
        name: The name that the robot knows it by.
        unit: The file that defines it.
        tree: Its definition there.
        place: Place where the robot names it.
    """

    name: str
    unit: Unit
    tree: syntax.Component
    place: Location

    @property
    def is_imported(self) -> bool:
        """True if it comes from a library."""
        return self.place is not self.tree.name.location


def make_unit(tree: syntax.File, findings: Findings) -> Unit:
    """A unit of a tree; reports definitions that share a name."""
    components = [item for item in tree.items if isinstance(item, syntax.Component)]
    types = [item for item in tree.items if isinstance(item, syntax.ObjectDefinition | syntax.EnumDefinition)]
    interfaces = [item for item in tree.items if isinstance(item, syntax.Interface)]
    unique([item.name for item in components], "duplicate-component", "component", findings)
    unique([item.name for item in types], "duplicate-data-type", "data type", findings)
    constants = [item for item in tree.items if isinstance(item, syntax.Constant)]
    unique([item.name for item in interfaces], "duplicate-interface", "interface", findings)
    unique([item.name for item in constants], "duplicate-constant", "constant", findings)
    return Unit(
        tree=tree,
        components={item.name.text: item for item in reversed(components)},
        types={item.name.text: item for item in reversed(types)},
        interfaces={item.name.text: item for item in reversed(interfaces)},
        constants={item.name.text: item for item in reversed(constants)},
    )


def unique(names: list[syntax.Name], code: str, what: str, findings: Findings) -> None:
    """Report every name that was given before, ignoring case."""
    first: dict[str, syntax.Name] = {}
    taken = {name.text.casefold() for name in names}
    for name in names:
        earlier = first.setdefault(name.text.casefold(), name)
        if earlier is not name:
            several = "properties" if what == "property" else f"{what}s"
            same = "" if earlier.text == name.text else f" (it differs from '{earlier.text}' only in case)"
            findings.error(
                code,
                f"the {what} '{name.text}' is defined twice{same}",
                name.location,
                f"Rename or remove one of the two {several}: write '{_free_name(name.text, taken)}', for instance.",
                RelatedPlace(f"'{earlier.text}' is defined here first", earlier.location),
            )


def _free_name(name: str, taken: Collection[str]) -> str:
    """A name like one that is taken."""
    return next(found for number in count(2) if (found := f"{name}_{number}").casefold() not in taken)


class Libraries:
    """The libraries of a bundle, parsed on first use."""

    def __init__(self, bundle: Bundle, main: Unit, findings: Findings) -> None:
        self._bundle = bundle
        self._findings = findings
        self._units: dict[str, Unit] = {main.tree.name.text: main} if main.tree.is_library else {}
        self._broken = set[str]()
        self._parsed: dict[str, Parsed] = {}
        self._origins: dict[tuple[Unit, str], tuple[Unit, str]] = {}
        self._declaring: dict[str, list[SourceFile]] = {}
        for file in bundle.libraries:
            for library in declared_libraries(file.text):
                self._declaring.setdefault(library, []).append(file)

    @property
    def units(self) -> tuple[Unit, ...]:
        """The libraries that were used and found."""
        return tuple(self._units.values())

    def unit(self, name: syntax.Name) -> Unit | None:
        """The library called `name`, or None after reporting why there is none."""
        if name.text not in self._units and name.text not in self._broken:
            found = self._find(name)
            if found is not None:
                self._units[name.text] = found
        return self._units.get(name.text)

    def origin(self, unit: Unit, component: str) -> tuple[Unit, str] | None:
        """The file that defines a component which `unit` has or imports, and its name there.

        None where the chain of imports does not end, or leads to a library that nothing has been imported from.
        """
        seen = set[tuple[Unit, str]]()
        here: Unit | None = unit
        while here is not None and (here, component) not in seen and component in here.components:
            found = self._origins.get((here, component))
            seen.add((here, component))
            source = here.components[component].imported
            if source is None or found is not None:
                found = found or (here, component)
                # Libraries are never given up again, so what is found once stays true; one that is missing may come.
                self._origins.update(dict.fromkeys(seen, found))
                return found
            here, component = self._units.get(source.library.text), source.component.text
        return None

    def chain(self, component: syntax.Component) -> Iterator[tuple[Unit, str]]:
        """The libraries on the way from an import to the definition, each with the component's name there."""
        seen = set[tuple[Unit, str]]()
        here = component
        while here.imported is not None:
            unit = self._units.get(here.imported.library.text)
            name = here.imported.component.text
            if unit is None or name not in unit.components or (unit, name) in seen:
                return
            seen.add((unit, name))
            yield unit, name
            here = unit.components[name]

    def tiers_of(self, unit: Unit) -> tuple[tuple[Unit, ...], tuple[Unit, ...]]:
        """The libraries that a file imports from, and those that they in turn have the components from."""
        nearest: dict[Unit, None] = {}
        further: dict[Unit, None] = {}
        for component in unit.components.values():
            for place, (library, _) in enumerate(self.chain(component)):
                (further if place else nearest)[library] = None
        direct = tuple(library for library in nearest if library is not unit)
        return direct, tuple(library for library in further if library is not unit and library not in nearest)

    def all_of(self, unit: Unit) -> tuple[Unit, ...]:
        """Every library that the imported components of a file come from or through."""
        direct, further = self.tiers_of(unit)
        return (*direct, *further)

    def _find(self, name: syntax.Name) -> Unit | None:
        found: dict[str, syntax.File] = {}
        partly: dict[str, syntax.File] = {}
        # An error in a library that nothing imports does not matter, so only requested libraries are parsed.
        for file in self._declaring.get(name.text, ()):
            if file.name not in self._parsed:
                self._parsed[file.name] = parsed = parse(file)
                if parsed.tree is None:
                    self._findings.file_is_broken(file, parsed.diagnostics)
            parsed = self._parsed[file.name]
            tree = parsed.sound
            if tree is not None and tree.is_library and tree.name.text == name.text:
                (partly if parsed.tree is None else found)[file.name] = tree
            elif parsed.tree is None:
                self._broken.add(name.text)
        if len({file.text for file in self._declaring.get(name.text, ()) if file.name in found}) > 1:
            self._broken.add(name.text)
            self._findings.error(
                "ambiguous-library",
                f"the library '{name.text}' is defined by {' and '.join(sorted(found))}",
                name.location,
                "Remove or rename one of the files, or do not search its folder.",
            )
            return None
        # The sound parts of a broken one are better known than nothing: its errors are reported.
        for tree in (*found.values(), *partly.values()):
            return make_unit(tree, self._findings)
        if name.text not in self._broken:
            self._unknown(name)
        return None

    def _unknown(self, name: syntax.Name) -> None:
        looked = ", ".join(self._bundle.searched) or "the files that came with the model"
        fix = f"Put the library into one of the folders looked at ({looked}) or name its folder with -L."
        self._findings.unknown("library", name.text, name.location, self._declaring, fix)


def parts_of(unit: Unit, libraries: Libraries, findings: Findings) -> tuple[Part, ...]:
    """The components of a robot, imports followed, in source order."""
    parts: list[Part] = []
    imported: dict[tuple[Unit, str], Part] = {}
    for item in unit.tree.items:
        if not isinstance(item, syntax.Component):
            continue
        source = _follow(unit, item, libraries, findings)
        if source is None:
            continue
        part = Part(item.name.text, source[0], source[1], item.name.location)
        key = (part.unit, part.tree.name.text)
        if part.is_imported and key in imported:
            findings.error(
                "duplicate-communication",
                f"the component '{part.tree.name.text}' of '{part.unit.tree.name.text}' is imported twice",
                part.place,
                "Import it once: all its communications would exist twice.",
                RelatedPlace("it is imported here first", imported[key].place),
            )
            continue
        imported[key] = part
        parts.append(part)
    return tuple(parts)


def _cycle_text(followed: list[tuple[Unit, str]], again: tuple[Unit, str]) -> str:
    """The imports that lead back to where they began; of a long way its begin."""
    cycle = followed[followed.index(again) :]
    names = [f"'{name}' of '{unit.tree.name.text}'" for unit, name in (*cycle, again)]
    if len(names) > _MAXIMUM_SHOWN:
        names = [*names[: _MAXIMUM_SHOWN - 1], "...", names[-1]]
    return " from ".join(names)


def _follow(
    unit: Unit, component: syntax.Component, libraries: Libraries, findings: Findings
) -> tuple[Unit, syntax.Component] | None:
    """The unit and definition that a chain of imports ends at, or None after reporting why it does not."""
    wanted_name = component.name.text
    seen: dict[tuple[Unit, str], None] = {}
    while component.imported is not None:
        if (unit, component.name.text) in seen:
            chain = _cycle_text(list(seen), (unit, component.name.text))
            findings.error(
                "import-cycle",
                f"the import of '{wanted_name}' never ends: {chain}",
                component.imported.component.location,
                "Define the component in one of the libraries.",
            )
            return None
        seen[unit, component.name.text] = None
        library = libraries.unit(component.imported.library)
        if library is None:
            return None
        findings.bindings.bind(component.imported.library, library.tree.name.location)
        wanted = component.imported.component
        if wanted.text not in library.components:
            # The contents of a broken library are unknown.
            if not findings.is_broken(library.tree.name.location.file):
                what = f"component of library '{library.tree.name.text}'"
                findings.unknown(what, wanted.text, wanted.location, library.components)
            return None
        findings.bindings.bind(wanted, library.components[wanted.text].name.location)
        unit, component = library, library.components[wanted.text]
    return unit, component
