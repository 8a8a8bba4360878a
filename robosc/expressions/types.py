"""Value types of RoboSC: what a variable, a received datum or an expression can be.

A type is self-contained: an `EnumType` lists its values, so that automata and code generators need no table of
definitions. Object types are only names; the model defines their properties.
"""

from typing import Annotated

import msgspec

MAXIMUM_INTEGER = 2**31 - 1
MINIMUM_INTEGER = -(2**31)

Name = Annotated[str, msgspec.Meta(pattern=r"^[A-Za-z_][A-Za-z_0-9]*\Z", max_length=255)]
"""An identifier of the language."""

ScopedName = Annotated[
    str, msgspec.Meta(pattern=r"^[A-Za-z_][A-Za-z_0-9]*(\.[A-Za-z_][A-Za-z_0-9]*)?\Z", max_length=511)
]
"""A type's name: `Twist` of the robot's own, `Library.Twist` of a library's."""

QualifiedName = Annotated[
    str, msgspec.Meta(pattern=r"^[A-Za-z_][A-Za-z_0-9]*(\.[A-Za-z_][A-Za-z_0-9]*)*\Z", max_length=4095)
]
"""A type's name in automata, where groups may stand in groups: `Factory.Line.Mode`."""

PartName = Annotated[str, msgspec.Meta(max_length=4095)]
"""Name of a part of automata: `Sensor`, `Factory.Line`, or any text; in a model only those of its own are valid."""

Integer32 = Annotated[int, msgspec.Meta(ge=MINIMUM_INTEGER, le=MAXIMUM_INTEGER)]


class BooleanType(msgspec.Struct, frozen=True, gc=False, tag_field="type", tag="boolean"):
    """true or false."""


class IntegerType(msgspec.Struct, frozen=True, gc=False, omit_defaults=True, tag_field="type", tag="integer"):
    """A 32-bit integer; bounded when both `low` and `high` are given (inclusive)."""

    low: Integer32 | None = None
    high: Integer32 | None = None

    @property
    def is_bounded(self) -> bool:
        """True if the type has a range."""
        return self.low is not None and self.high is not None


class DoubleType(msgspec.Struct, frozen=True, gc=False, tag_field="type", tag="double"):
    """An IEEE binary64 number."""


class StringType(msgspec.Struct, frozen=True, gc=False, tag_field="type", tag="string"):
    """A text."""


class NoneType(msgspec.Struct, frozen=True, gc=False, tag_field="type", tag="none"):
    """No data at all."""


class EnumType(msgspec.Struct, frozen=True, gc=False, tag_field="type", tag="enum"):
    """One of finitely many names, in the order of their rules (each name once), the default included."""

    name: QualifiedName
    values: tuple[Name, ...]


class ObjectType(msgspec.Struct, frozen=True, gc=False, tag_field="type", tag="object"):
    """A record; its properties stand in the model's `objects`."""

    name: ScopedName


class ArrayType(msgspec.Struct, frozen=True, gc=False, tag_field="type", tag="array"):
    """A sequence of unknown length."""

    element: "Type"


Type = BooleanType | IntegerType | DoubleType | StringType | NoneType | EnumType | ObjectType | ArrayType

Value = bool | int | float | str
"""A value at run time. An enum value is its name, as a string."""


def is_numeric(type_: Type) -> bool:
    """Return True if arithmetic and order comparisons apply."""
    return isinstance(type_, IntegerType | DoubleType)


def is_finite(type_: Type) -> bool:
    """Return True if a synthesis variable may have this type."""
    match type_:
        case BooleanType() | EnumType():
            return True
        case IntegerType():
            return type_.is_bounded
        case _:
            return False


def domain(type_: Type) -> tuple[Value, ...] | range:
    """Every value of a finite type, in order: false, true; the enum's order; ascending.

    Raises:
        ValueError: The type is not finite.
    """
    match type_:
        case BooleanType():
            return (False, True)
        case EnumType(values=values):
            return values
        case IntegerType(low=int(low), high=int(high)):
            return range(low, high + 1)
        case _:
            raise ValueError(f"{type_text(type_)} has no finite domain")


def default_value(type_: Type, enum_default: str | None = None) -> Value:
    """The value an uninitialised variable starts at."""
    match type_:
        case BooleanType():
            return False
        case IntegerType(low=int(low), high=int(high)):
            return min(max(0, low), high)
        case IntegerType():
            return 0
        case DoubleType():
            return 0.0
        case EnumType(values=values):
            return enum_default if enum_default is not None else values[-1]
        case StringType():
            return ""
        case _:
            raise ValueError(f"a variable cannot have the type {type_text(type_)}")


def type_text(type_: Type) -> str:
    """The type as a user writes it."""
    match type_:
        case IntegerType(low=int(low), high=int(high)):
            return f"integer({low}..{high})"
        case EnumType(name=name) | ObjectType(name=name):
            return name
        case ArrayType(element=element):
            return f"array({type_text(element)})"
        case _:
            return type(type_).__struct_config__.tag  # type: ignore[return-value]  # a tag given as a string
