"""Resolves the types of a model: names to definitions, each once, in the scope of its file."""

from collections.abc import Iterable

from robosc.errors import RelatedPlace
from robosc.expressions import (
    ArrayType,
    BooleanType,
    DoubleType,
    EnumType,
    IntegerType,
    NoneType,
    ObjectType,
    StringType,
    Type,
)
from robosc.language import syntax
from robosc.language.limits import MAXIMUM_NESTING
from robosc.language.words import FOREIGN_TYPES
from robosc.model.findings import Findings, did_you_mean
from robosc.model.structure import ObjectDefinition, Property
from robosc.model.units import Unit, unique
from robosc.source import Location

_BASIC: dict[syntax.BasicTypeName, Type] = {
    syntax.BasicTypeName.STRING: StringType(),
    syntax.BasicTypeName.BOOLEAN: BooleanType(),
    syntax.BasicTypeName.DOUBLE: DoubleType(),
    syntax.BasicTypeName.NONE: NoneType(),
}


_DEFAULTS_ELSEWHERE = frozenset({"else", "otherwise", "other", "others", "_"})


def _misspelt_default(tree: syntax.EnumDefinition) -> syntax.Name | None:
    """The name before `->` of a rule that was meant as the default one."""
    for rule in tree.rules:
        match rule.condition:
            case syntax.Access(root=syntax.Name() as name, steps=()):
                if name.text in _DEFAULTS_ELSEWHERE or did_you_mean(name.text, ("default",)):
                    return name
    return None


class Types:
    """The data types that a model uses, in the order of their first uses.

    Attributes:
        objects: Object definitions by model name.
        object_places: Places where they stand.
        enums: Enum types by model name, with the unit and tree they come from.
        sources: Source type of each enum by model name.
        value_places: Place where each value of an enum is defined, by model name and value.
        property_places: Place where each property of an object is defined, by model name and property.
        property_type_places: Place where its type is written.
    """

    def __init__(self, findings: Findings) -> None:
        self.objects: dict[str, ObjectDefinition] = {}
        self.object_places: dict[str, Location] = {}
        self.enums: dict[str, tuple[EnumType, Unit, syntax.EnumDefinition]] = {}
        self.sources: dict[str, Type] = {}
        self.value_places: dict[tuple[str, str], Location] = {}
        self.property_places: dict[tuple[str, str], Location] = {}
        self.property_type_places: dict[tuple[str, str], Location] = {}
        self._findings = findings
        self._open: list[str] = []
        self._properties: dict[str, dict[str, Type]] = {}
        self._depths: dict[str, int] = {}

    def resolve(self, tree: syntax.Type, unit: Unit, *, in_object: bool = False) -> Type | None:
        """The type that a tree means in a unit, or None after reporting why it means none."""
        match tree:
            case syntax.BasicType(name=syntax.BasicTypeName.INTEGER):
                return self._integer(tree)
            case syntax.BasicType(name=name):
                return _BASIC[name]
            case syntax.ArrayType():
                if not in_object:
                    self._findings.error(
                        "array-not-allowed",
                        "an array can stand only inside an object",
                        tree.location,
                        "Make an object type with the array as a property.",
                    )
                    return None
                return self._array(tree, unit)
            case syntax.NamedType(name=name):
                return self.named(name, unit)

    def _array(self, tree: syntax.ArrayType, unit: Unit) -> Type | None:
        element, depth = tree.element, 1
        while isinstance(element, syntax.ArrayType):
            element, depth = element.element, depth + 1
        found = self.resolve(element, unit, in_object=True)
        for _ in range(depth):
            found = None if found is None else ArrayType(found)
        return found

    def named(self, name: syntax.Name, unit: Unit) -> Type | None:
        """The type that a name means in a unit, or None after reporting an unknown name."""
        definition = unit.types.get(name.text)
        if definition is None:
            meant = FOREIGN_TYPES.get(name.text)
            fix = f"Write '{meant}'." if meant else ""
            words = [*syntax.BasicTypeName]
            self._findings.unknown("data type", name.text, name.location, unit.types, fix, words)
            return None
        self._findings.bindings.bind(name, definition.name.location)
        key = unit.type_name(name.text)
        if key in self._open:
            self._findings.error(
                "type-mismatch",
                f"the type '{name.text}' contains itself",
                name.location,
                "Remove the property or rule source that leads back to it.",
            )
            return None
        if len(self._open) >= MAXIMUM_NESTING:
            self._too_deep(name)
            return None
        if isinstance(definition, syntax.ObjectDefinition):
            if key not in self.objects:
                self._define_object(key, definition, unit)
            return ObjectType(key)
        if key not in self.enums:
            self._define_enum(key, definition, unit)
        return self.enums[key][0] if self.enums[key][0].values else None

    def _integer(self, tree: syntax.BasicType) -> Type | None:
        if tree.low is not None and tree.high is not None and tree.low > tree.high:
            self._findings.error(
                "type-mismatch",
                f"the range {tree.low}..{tree.high} is empty",
                tree.location,
                "Write the smaller bound first.",
            )
            return None
        return IntegerType(tree.low, tree.high)

    def _define_object(self, key: str, tree: syntax.ObjectDefinition, unit: Unit) -> None:
        unique([item.name for item in tree.properties], "duplicate-property", "property", self._findings)
        self._open.append(key)
        properties: dict[str, Property] = {}
        for item in tree.properties:
            self.property_places.setdefault((key, item.name.text), item.name.location)
            self.property_type_places.setdefault((key, item.name.text), item.type.location)
            found = self.resolve(item.type, unit, in_object=True)
            if found is not None:
                properties.setdefault(item.name.text, Property(item.name.text, found))
        self._open.pop()
        self._depths[key] = self._depth(tree, properties.values())
        self.objects[key] = ObjectDefinition(key, tuple(properties.values()))
        self.object_places[key] = tree.name.location

    def _depth(self, tree: syntax.ObjectDefinition, properties: Iterable[Property]) -> int:
        """Return the depth to which an object is nested, arrays counted; after an error 0.

        The 0 keeps the error from being repeated.
        """
        deepest = 0
        for item in properties:
            type_, arrays = item.type, 0
            while isinstance(type_, ArrayType):
                type_, arrays = type_.element, arrays + 1
            inner = self._depths[type_.name] if isinstance(type_, ObjectType) else 0
            deepest = max(deepest, arrays + inner)
        if deepest >= MAXIMUM_NESTING:
            self._too_deep(tree.name)
            return 0
        return deepest + 1

    def _too_deep(self, name: syntax.Name) -> None:
        self._findings.error(
            "nesting-too-deep",
            f"types are nested deeper than {MAXIMUM_NESTING}",
            name.location,
            "Nest the objects less deeply.",
        )

    def _define_enum(self, key: str, tree: syntax.EnumDefinition, unit: Unit) -> None:
        self._open.append(key)
        source = self.resolve(tree.source, unit)
        self._open.pop()
        if isinstance(source, EnumType):
            self._findings.error(
                "enum-default",
                "an enum cannot be made from an enum",
                tree.source.location,
                f"Make it from the type that '{source.name}' is made from.",
            )
        defaults = [rule for rule in tree.rules if rule.condition is None]
        if len(defaults) != 1:
            self._report_defaults(tree, defaults)
        for rule in tree.rules:
            self.value_places.setdefault((key, rule.value.text), rule.value.location)
        values = tuple(dict.fromkeys(rule.value.text for rule in tree.rules))
        unique([rule.value for rule in tree.rules], "duplicate-enum-value", "enum value", self._findings)
        self.enums[key] = (EnumType(key, values), unit, tree)
        self.sources[key] = NoneType() if source is None or isinstance(source, EnumType) else source

    def _report_defaults(self, tree: syntax.EnumDefinition, defaults: list[syntax.EnumRule]) -> None:
        if not defaults and (meant := _misspelt_default(tree)) is not None:
            self._findings.unknown("name", meant.text, meant.location, (), "Write 'default'.", ("default",))
            return
        if not defaults:
            self._findings.error(
                "enum-default",
                f"the enum '{tree.name.text}' has no default rule",
                tree.name.location,
                "Add 'default -> NAME': the value for data that no rule fits.",
            )
            return
        self._findings.error(
            "enum-default",
            f"the enum '{tree.name.text}' has more than one default rule",
            defaults[1].value.location,
            "Keep one default rule.",
            RelatedPlace("the first default stands here", defaults[0].value.location),
        )

    def property_type(self, type_: Type, name: str) -> Type | None:
        """The type of an object's property, or None if there is no such property."""
        if not isinstance(type_, ObjectType):
            return None
        if type_.name not in self._properties:
            self._properties[type_.name] = {item.name: item.type for item in self.objects[type_.name].properties}
        return self._properties[type_.name].get(name)

    def property_names(self, type_: Type) -> tuple[str, ...]:
        """The names of an object's properties."""
        return tuple(item.name for item in self.objects[type_.name].properties) if isinstance(type_, ObjectType) else ()
