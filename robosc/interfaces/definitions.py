"""Reader of ROS interface definitions: the texts of `.msg`, `.srv` and `.action` files, of ROS 1 and of ROS 2.

The formats are those of genmsg (ROS 1) and rosidl_adapter (ROS 2). They differ only in bounds and default values.
"""

import re
from functools import lru_cache

import msgspec

PRIMITIVES = frozenset(
    "bool byte char float32 float64 int8 uint8 int16 uint16 int32 uint32 int64 uint64 string wstring".split()
)
"""Types that are values of one number, truth value or text."""

TIMES = frozenset({"time", "duration"})
"""Types that ROS 1 has beside them; ROS 2 reads them as messages of builtin_interfaces."""

INTERFACE_KINDS = ("msg", "srv", "action")
"""Kinds of interfaces; folders and endings of their files."""

_TYPE = re.compile(
    r"(?P<text>w?string)(?:<=(?P<bound>[0-9]{1,9}))?(?P<text_array>\[.*\])?\Z"
    r"|(?P<name>[A-Za-z][A-Za-z0-9_]*(?:/[A-Za-z][A-Za-z0-9_]*)?)(?P<array>\[.*\])?\Z"
)
_ARRAY = re.compile(r"\[(?P<bounded><=)?(?P<length>[0-9]{1,9})?\]\Z")
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*\Z")
_CONSTANT = re.compile(r"(?P<type>\S+)\s+(?P<name>[A-Za-z][A-Za-z0-9_]*)\s*=(?P<value>.*)\Z")


class MalformedDefinitionError(ValueError):
    """A text that is no interface definition."""


class Array(msgspec.Struct, frozen=True, gc=False):
    """Number of elements of an array field.

    Attributes:
        length: The number, or the greatest one; None: any number.
        is_bounded: True if there may be fewer elements than `length`.
    """

    length: int | None = None
    is_bounded: bool = False


class Field(msgspec.Struct, frozen=True, gc=False):
    """A field of a message.

    Attributes:
        name: Its name.
        type: Type of the field, or of its elements: a primitive, `time`, `duration` or `package/Type`.
        bound: Greatest number of bytes of a text; None: any number.
        array: Number of its elements if it is an array, else None.
    """

    name: str
    type: str
    bound: int | None = None
    array: Array | None = None

    @property
    def is_message(self) -> bool:
        """True if the type is not primitive."""
        return self.type not in PRIMITIVES

    @property
    def type_text(self) -> str:
        """The type as definitions spell it."""
        text = self.type if self.bound is None else f"{self.type}<={self.bound}"
        if self.array is None:
            return text
        length = "" if self.array.length is None else str(self.array.length)
        return f"{text}[{'<=' if self.array.is_bounded else ''}{length}]"


class Part(msgspec.Struct, frozen=True, gc=False):
    """A message, or the request, response, goal, result or feedback of a service or an action.

    Attributes:
        fields: Fields by name, in order.
        constants: Values of constants by name, as they are written.
    """

    fields: dict[str, Field]
    constants: dict[str, str]


@lru_cache(maxsize=1024)
def parse_definition(text: str, package: str) -> tuple[Part, ...]:
    """Return the parts of a definition: one of a message, two of a service, three of an action.

    Args:
        text: The definition.
        package: Package that it belongs to: types without a package are of this one.

    Raises:
        MalformedDefinitionError: It is no definition.
    """
    parts = [Part({}, {})]
    for line in text.splitlines():
        if line.strip() and set(line.strip()) == {"-"} and len(line.strip()) >= 3:
            parts.append(Part({}, {}))
        else:
            _read(line, package, parts[-1])
    return tuple(parts)


def _read(line: str, package: str, part: Part) -> None:
    """Add what a line defines to a part."""
    constant = _CONSTANT.match(line.strip())
    if constant is not None and "#" not in constant["type"]:
        value = constant["value"].strip()
        # A text goes to the end of its line in ROS 1.
        is_text = constant["type"].startswith("string")
        part.constants[constant["name"]] = value if is_text else value.partition("#")[0].strip()
        return
    words = line.partition("#")[0].split(maxsplit=2)
    if not words:
        return
    if len(words) < 2 or not _NAME.match(words[1]):
        raise MalformedDefinitionError(line)
    part.fields[words[1]] = _field(words[1], words[0], package)


def _field(name: str, text: str, package: str) -> Field:
    match = _TYPE.match(text)
    if match is None:
        raise MalformedDefinitionError(text)
    brackets = match["array"] or match["text_array"]
    array = None
    if brackets:
        length = _ARRAY.match(brackets)
        if length is None or (length["bounded"] and not length["length"]):
            raise MalformedDefinitionError(text)
        array = Array(int(length["length"]) if length["length"] else None, bool(length["bounded"]))
    if match["text"]:
        return Field(name, match["text"], int(match["bound"]) if match["bound"] else None, array)
    type_ = match["name"]
    if type_ not in PRIMITIVES | TIMES and "/" not in type_:
        type_ = f"{package}/{type_}"
    return Field(name, type_, None, array)


def nested_types(parts: tuple[Part, ...]) -> frozenset[str]:
    """The messages that the fields of a definition have as their type, as `package/Type`."""
    return frozenset(field.type for part in parts for field in part.fields.values() if "/" in field.type)


def ros_version_of(parts: tuple[Part, ...], package: str) -> int | None:
    """Return 1 or 2 if the text of a definition fits only that version of ROS, else None.

    Args:
        parts: Parts of the definition.
        package: Its package, which has no message `Header` of its own.
    """
    fields = [field for part in parts for field in part.fields.values()]
    types = {field.type for field in fields}
    if types & TIMES or f"{package}/Header" in types:
        return 1
    has_bounds = any(field.bound is not None or (field.array and field.array.is_bounded) for field in fields)
    return 2 if has_bounds or any(type_.startswith("builtin_interfaces/") for type_ in types) else None
