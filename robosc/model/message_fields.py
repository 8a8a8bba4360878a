"""Comparison of the model's types with the fields of a middleware type, as a generated node compares them at its start.

`robosc.targets.ros.runtime.messages` has the comparison of Python nodes, and `robosc/targets/cpp/runtime/values.hpp`
that of C++ nodes, which their compilers make.
"""

from collections.abc import Iterable
from enum import StrEnum

import msgspec
from msgspec.structs import replace

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
    type_text,
)
from robosc.interfaces import TIMES, Field, Part
from robosc.interfaces.catalogue import Catalogue
from robosc.language.words import spelled
from robosc.model.types import Types
from robosc.source import Location

_MAXIMUM_SHOWN = 6
"""Fields that one finding lists."""

MAXIMUM_FAULTS = 100
"""Differences of one type that are reported; more are reported once these are fixed."""

_INTEGERS = frozenset(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64))
_PYTHON_FIELDS: dict[type[Type], frozenset[str]] = {
    BooleanType: frozenset({"bool"}),
    StringType: frozenset({"string", "wstring"}),
    DoubleType: frozenset({"float32", "float64"}),
    IntegerType: _INTEGERS | {"char"},
}
_TYPE_NAMES = {
    "boolean": frozenset({"bool"}),
    "string": frozenset({"string", "wstring"}),
    "double": frozenset({"float32", "float64"}),
}
"""Fields of primitive types that are no whole numbers, by the type in the model."""


class Language(StrEnum):
    """Language of a generated node."""

    PYTHON = "Python"
    CPP = "C++"


class Fault(msgspec.Struct, frozen=True):
    """A difference that keeps a node from starting.

    Attributes:
        code: Code of the finding.
        message: Description of what is wrong, without a hint.
        hint: Hint about what might be meant; may be empty.
        location: Place in the model.
        fix: Sentence on how to fix it.
        related: Other places that explain it.
        name: Name that nothing has; empty if the fault is another one. The hint and the fix are for where no known name
            is near.
        known: Known names.
        needless: Object type and name of a property that nothing reads or fills, if the fault is that it stands for
            no field.
    """

    code: str
    message: str
    hint: str
    location: Location
    fix: str
    related: tuple[RelatedPlace, ...] = ()
    name: str = ""
    known: tuple[str, ...] = ()
    needless: tuple[str, str] | None = None


class Message(msgspec.Struct, frozen=True):
    """A part of an interface.

    Attributes:
        name: Name of the interface in words.
        part: Its fields.
    """

    name: str
    part: Part


class Comparison(msgspec.Struct, frozen=True):
    """Differences between a type and a message.

    Attributes:
        faults: The first of them, at most `MAXIMUM_FAULTS`.
        unknown: Messages whose definition is not known, each with a place where it matters.
    """

    faults: list[Fault] = msgspec.field(default_factory=list)
    unknown: dict[str, Location] = msgspec.field(default_factory=dict)

    def add(self, *faults: Fault) -> None:
        """Add faults, as far as there may be more."""
        self.faults.extend(faults[: MAXIMUM_FAULTS - len(self.faults)])

    def include(self, other: "Comparison") -> None:
        """Add all that another comparison has found."""
        self.add(*other.faults)
        self.unknown.update(other.unknown)


class FieldChecker:
    """Checker of data types against messages; each pair is checked once.

    Args:
        catalogue: The interfaces.
        language: Language of the node.
        types: Types of the model.
    """

    def __init__(self, catalogue: Catalogue, language: Language, types: Types) -> None:
        self.catalogue = catalogue
        self._language = language
        self._types = types
        # The message is kept, so that its identity stays its own.
        self._known: dict[tuple[str, int, frozenset[str]], tuple[Part, Comparison]] = {}
        self._used = frozenset[str]()

    def compare(self, type_: Type, message: Message, location: Location, used: frozenset[str]) -> Comparison:
        """Compare data of a type with the message as which it crosses.

        Args:
            type_: Type of the data.
            message: The message.
            location: Place where the type is written.
            used: Names of the properties that are read or filled.
        """
        self._used = used
        basic = self._source(type_)
        if isinstance(basic, ObjectType):
            return self._object(basic, message, location)
        found = Comparison()
        if not isinstance(basic, NoneType):
            field = basic_field(message.part)
            if field is None:
                found.add(_ambiguous(type_text(basic), message, location))
            else:
                self._field(field, basic, message.name, (location, location), found)
        return found

    def _source(self, type_: Type) -> Type:
        return self._types.sources[type_.name] if isinstance(type_, EnumType) else type_

    def _object(self, type_: ObjectType, message: Message, used: Location) -> Comparison:
        key = (type_.name, id(message.part), self._used)
        if key not in self._known:
            found = Comparison()
            for item in self._types.objects[type_.name].properties:
                place = self._types.property_places[type_.name, item.name]
                field = message.part.fields.get(item.name)
                if field is None:
                    fault = _unknown_field(item.name, message, place, used)
                    is_used = item.name in self._used
                    found.add(fault if is_used else replace(fault, needless=(type_.name, item.name)))
                else:
                    written = self._types.property_type_places[type_.name, item.name]
                    self._field(field, item.type, message.name, (written, used), found)
            self._known[key] = (message.part, found)
        return self._known[key][1]

    def _field(
        self, field: Field, type_: Type, owner: str, places: tuple[Location, Location], found: Comparison
    ) -> None:
        """Compare a property with the field that it stands for.

        Args:
            field: The field.
            type_: Type of the property.
            owner: The message, in words.
            places: Place of the type, and place from which it crosses.
            found: Comparison to which differences are added.
        """
        source = self._source(type_)
        is_array = isinstance(source, ArrayType)
        inner = self._source(source.element) if isinstance(source, ArrayType) else source
        if isinstance(source, NoneType) or (is_array and field.array is not None and isinstance(inner, NoneType)):
            return
        if (
            is_array is (field.array is None)
            or isinstance(inner, ArrayType)
            or isinstance(inner, ObjectType) is not field.is_message
        ):
            found.add(self._misfit(field, source, owner, *places))
        elif isinstance(inner, ObjectType):
            self._nested(field, inner, places[0], found)
        elif not self._fits(field.type, inner):
            found.add(self._misfit(field, source, owner, *places))

    def _nested(self, field: Field, type_: ObjectType, place: Location, found: Comparison) -> None:
        part = self.catalogue.message(field.type)
        if part is None:
            found.unknown.setdefault(field.type, place)
            return
        package, _, name = self.catalogue.resolved(field.type).partition("/")
        message = Message(self.catalogue.described("msg", package, name) if name else field.type, part)
        if field.type in TIMES and self._language is Language.CPP and self.catalogue.distribution.version == 1:
            # The classes of roscpp call them otherwise than those of rospy.
            fields = {name.removesuffix("s"): inner for name, inner in part.fields.items()}
            message = Message(message.name, Part(fields, {}))
        found.include(self._object(type_, message, place))

    def _fits(self, field_type: str, type_: Type) -> bool:
        is_ros1 = self.catalogue.distribution.version == 1
        if field_type in _PYTHON_FIELDS[type(type_)]:
            return self._language is Language.PYTHON or field_type != "wstring"
        if isinstance(type_, IntegerType) and field_type == "byte":
            return is_ros1 or self._language is Language.CPP
        if self._language is Language.PYTHON:
            return False
        # A bool of ROS 1 is stored in a byte in C++, and a byte is a number.
        if isinstance(type_, IntegerType):
            return is_ros1 and field_type == "bool"
        return isinstance(type_, BooleanType) and field_type in {"uint8", *(() if is_ros1 else ("byte", "char"))}

    def _misfit(self, field: Field, type_: Type, owner: str, place: Location, used: Location) -> Fault:
        wanted = self._required_type(field)
        return Fault(
            "field-type-mismatch",
            f"the field '{field.name}' of {owner} is {field.type_text}, not {type_text(type_)}",
            "",
            place,
            f"Write '{wanted}'." if wanted else self._advice(field),
            _used_here(place, used),
        )

    def _required_type(self, field: Field) -> str:
        """The type in the model that a field needs; empty where it is none, or an object."""
        found = model_type(field)
        is_byte = field.type == "byte" and not self._fits("byte", IntegerType())
        return "" if is_byte else found

    def _advice(self, field: Field) -> str:
        if not field.is_message:
            return "Remove the property: no type of the model is read from such a field."
        fields = self.catalogue.message(field.type)
        names = "" if fields is None else f", such as {_listed(fields.fields)}"
        kind = "an array of an object type" if field.array else "an object type"
        return f"Make {kind} with the fields of {field.type} that are meant{names}."


def model_type(field: Field) -> str:
    """The type in the model that stands for a field of a primitive type; empty for a message."""
    if field.is_message:
        return ""
    element = next((str(name) for name, fields in _TYPE_NAMES.items() if field.type in fields), "integer")
    return f"array({element})" if field.array else element


def fields_of_objects(
    type_: Type, part: Part, catalogue: Catalogue, types: Types, found: dict[str, dict[str, Field]]
) -> None:
    """Collect the fields that properties of object types can stand for; each type is looked at once.

    Args:
        type_: Type of data.
        part: Message that the data comes as.
        catalogue: The interfaces.
        types: Types of the model.
        found: Filled with the fields by model name of the object type and name of the field.
    """
    source = types.sources[type_.name] if isinstance(type_, EnumType) else type_
    source = source.element if isinstance(source, ArrayType) else source
    if not isinstance(source, ObjectType) or source.name in found:
        return
    found[source.name] = part.fields
    for item in types.objects[source.name].properties:
        field = part.fields.get(item.name)
        nested = None if field is None else catalogue.message(field.type)
        if nested is not None:
            fields_of_objects(item.type, nested, catalogue, types, found)


def basic_field(part: Part) -> Field | None:
    """The field that stands for a basic type: `data`, else the only one; None where there is none, or doubt."""
    if "data" in part.fields:
        return part.fields["data"]
    return next(iter(part.fields.values())) if len(part.fields) == 1 else None


def _used_here(place: Location, used: Location) -> tuple[RelatedPlace, ...]:
    return () if place == used else (RelatedPlace("it crosses the middleware from here", used),)


def _listed(names: Iterable[str]) -> str:
    found = list(names)
    return ", ".join(found[:_MAXIMUM_SHOWN]) + (", ..." if len(found) > _MAXIMUM_SHOWN else "")


def _ambiguous(basic: str, message: Message, location: Location) -> Fault:
    has = f"the fields {_listed(message.part.fields)}" if message.part.fields else "no field"
    return Fault(
        "ambiguous-field",
        f"{basic} could be any part of {message.name}, which has {has}",
        "",
        location,
        "Make an object type with the field that is meant as its property.",
    )


def _unknown_field(name: str, message: Message, place: Location, used: Location) -> Fault:
    fields, constants = message.part.fields, message.part.constants
    text = f"{message.name} has no field '{name}'"
    related = _used_here(place, used)
    if name in constants:
        hint = f"; it is a constant, {constants[name]}"
        return Fault("unknown-field", text, hint, place, "Remove the property, and write the value instead.", related)
    hint = f"; it has {_listed(fields)}" if fields else "; it has none"
    fix = "Remove the property, or give it the name of a field."
    if len(fields) == 1:
        fix = f"Write '{spelled(next(iter(fields)))}', or remove the property."
    return Fault("unknown-field", text, hint, place, fix, related, name, tuple(fields))
