"""Generated functions that compute the data of a request, and the types that it is handed over in."""

from dataclasses import dataclass, field

from robosc.expressions import (
    BooleanType,
    DoubleType,
    EnumType,
    IntegerType,
    ObjectType,
    Type,
)
from robosc.model.structure import Communication, ObjectValue, ProvidedValue
from robosc.targets.c99.expressions import ATOM
from robosc.targets.c99.naming import CNamer
from robosc.targets.c99.text import comment
from robosc.targets.c99.unit import Reading, Unit, declared, plain_type
from robosc.targets.code.expressions import TRUE_CODE, Sort
from robosc.targets.code.text import indent
from robosc.targets.model_text import provide_text


@dataclass
class Field:
    """Parts of one datum that provide statements give.

    Attributes:
        type: Its declared type.
        parts: Member and field of each property that is given.
        value: Member of the value of a single datum.
        flag: Member that tells whether it is given.
    """

    type: Type
    parts: dict[str, tuple[str, "Field"]] = field(default_factory=dict)
    value: str = "value"
    flag: str = "has_value"


def request_field(unit: Unit, item: Communication) -> Field | None:
    """All that the provide statements of a communication give, or None for nothing."""
    if item.request is None:
        return None
    root = Field(item.request)
    for statement in unit.layout.model.provides_for(item.name):
        _extend(unit, root, statement.value)
    is_given = any(not isinstance(s.value, ObjectValue) for s in unit.layout.model.provides_for(item.name))
    return root if root.parts or is_given else None


def _extend(unit: Unit, found: Field, provided: ProvidedValue) -> None:
    if not isinstance(provided, ObjectValue) or not isinstance(found.type, ObjectType):
        return
    types = {part.name: part.type for part in unit.layout.model.object(found.type.name).properties}
    for name, inner in provided.properties:
        if name not in found.parts:
            taken = [word for member, part in found.parts.values() for word in (member, part.flag)]
            namer = CNamer(frozenset(taken))
            member = namer.member(name)
            found.parts[name] = (member, Field(types[name], value=member, flag=namer.name(f"has_{member}")))
        _extend(unit, found.parts[name][1], inner)


def request_struct(found: Field) -> list[str]:
    """The members of the struct that carries a request's data."""
    if not isinstance(found.type, ObjectType):
        return [f"bool {found.flag};", f"{declared(plain_type(found.type), found.value)};"]
    lines = []
    for name, (member, part) in found.parts.items():
        if isinstance(part.type, ObjectType):
            inner = request_struct(part)
            if not inner:
                inner = ["char nothing;"]
            lines += ["struct {", *indent(inner), f"}} {member}; /* {name} */"]
        else:
            lines += [f"bool {part.flag};", f"{declared(plain_type(part.type), member)}; /* {name} */"]
    return lines


def provide_function(unit: Unit, item: Communication) -> list[str]:
    """The function that gives a request's data, of the first statement whose condition is true; false if unknown."""
    reading = Reading(unit)
    name, prefix = unit.layout.function("provides", item.name), unit.layout.prefix
    head = f"static bool {name}(const state_t *s, {prefix}_request_t *request)"
    lines = [head, "{", "    (void)s;", "    (void)request;"]
    root = request_field(unit, item)
    for statement in unit.layout.model.provides_for(item.name):
        condition = TRUE_CODE if statement.condition is None else reading.truth(statement.condition)
        lines += indent(comment(provide_text(statement)))
        result = _result(unit, item, root, statement.value)
        if condition == TRUE_CODE:
            return [*lines, *indent(result), "}"]
        lines += [f"    if ({unit.text(condition)}) {{", *indent(result, 2), "    }"]
    return [*lines, "    return true;", "}"]


def _result(unit: Unit, item: Communication, root: Field | None, provided: ProvidedValue) -> list[str]:
    """Statements that store the data; where a part may be unknown, all parts are tested before."""
    tests: list[str] = []
    stores: list[str] = []
    lines: list[str] = []
    if root is not None:
        _store(unit, root, provided, f"request->data.{unit.layout.request_members[item.name]}", (lines, tests, stores))
    if tests:
        lines += [f"if ({' || '.join(tests)}) {{", "    return false;", "}"]
    return [*lines, *stores, "return true;"]


def _store(
    unit: Unit, found: Field, provided: ProvidedValue, place: str, into: tuple[list[str], list[str], list[str]]
) -> None:
    lines, tests, stores = into
    if isinstance(provided, ObjectValue):
        for name, inner in provided.properties:
            member, part = found.parts[name]
            if isinstance(part.type, ObjectType):
                _store(unit, part, inner, f"{place}.{member}", into)
            else:
                _store(unit, part, inner, place, into)
        return
    reading = Reading(unit)
    code = reading.value(provided)
    if isinstance(found.type, DoubleType):
        code = reading.as_double(code)
    text = unit.text(code)
    if not code.is_known:
        text = f"data_{len(tests) + 1}"
        lines.append(unit.local(code, text))
        tests.append(
            {
                Sort.DOUBLE: f"!isfinite({text})",
                Sort.TEXT: f"{text} == NULL",
                Sort.INTEGER: f"{text} == INT64_MIN",
            }.get(code.sort, f"{text} < 0")
        )
    stores.append(f"{place}.{found.flag} = true;")
    stores.append(
        f"{place}.{found.value} = {_stored(unit, found.type, text, unit.text(code, ATOM) if code.is_known else text)};"
    )


def _stored(unit: Unit, type_: Type, text: str, atom: str) -> str:
    match type_:
        case BooleanType():
            return f"({text}) != 0"
        case IntegerType():
            return f"(int32_t){atom}"
        case EnumType(name=name):
            values = ", ".join(f'"{item}"' for item in unit.layout.model.enum(name).values)
            return f"((const char *const[]){{{values}}})[{text}]"
        case _:
            return text


def default_function(unit: Unit, item: Communication) -> list[str]:
    """The function that tells whether a request's data is all default."""
    prefix = unit.layout.prefix
    lines = [
        f"static bool {unit.layout.function('is_default', item.name)}(const {prefix}_request_t *request)",
        "{",
        "    (void)request;",
    ]
    root = request_field(unit, item)
    if root is not None:
        for test in _non_default(root, f"request->data.{unit.layout.request_members[item.name]}"):
            lines += indent([f"if ({test}) {{", "    return false;", "}"])
    return [*lines, "    return true;", "}"]


def _non_default(found: Field, place: str) -> list[str]:
    if not isinstance(found.type, ObjectType):
        return [_differs(found, place, found.value)]
    tests = []
    for member, part in found.parts.values():
        tests += (
            _non_default(part, f"{place}.{member}")
            if isinstance(part.type, ObjectType)
            else [_differs(part, place, member)]
        )
    return tests


def _differs(found: Field, place: str, member: str) -> str:
    test = {"bool": "", "int32_t": " != 0", "double": " != 0.0"}.get(plain_type(found.type), "[0] != '\\0'")
    return f"{place}.{found.flag} && {place}.{member}{test}"
