"""Generated functions that compute the data of a request, and the types of this data."""

from dataclasses import dataclass, field

from robosc.expressions import BooleanType, DoubleType, EnumType, IntegerType, ObjectType, Type
from robosc.model.structure import Communication, ObjectValue, ProvidedValue
from robosc.targets.code.c.naming import CNamer
from robosc.targets.code.c.statements import unused
from robosc.targets.code.c.text import declared
from robosc.targets.code.c.unit import Reading, Unit, plain_type
from robosc.targets.code.expressions import FALSE_CODE, TRUE_CODE, Code, operation, variable
from robosc.targets.code.provide import first_provided
from robosc.targets.code.statements import Assign, Block, Let, Return, when
from robosc.targets.text import indent

_GIVEN = Return(TRUE_CODE)


@dataclass
class Field:
    """Parts of one datum that provide statements give.

    Attributes:
        type: Its declared type.
        parts: Member and field of each property that is given.
        value: Member of the value of a single datum.
        flag: Member that says whether it is given.
    """

    type: Type
    parts: dict[str, tuple[str, "Field"]] = field(default_factory=dict)
    value: str = "value"
    flag: str = "has_value"


def request_field(unit: Unit, item: Communication) -> Field | None:
    """All that the provide statements and limits of a communication give, or None for nothing."""
    if item.request is None:
        return None
    root = Field(item.request)
    for statement in unit.layout.model.provides_for(item.name):
        _extend(unit, root, statement.value)
    is_given = any(not isinstance(s.value, ObjectValue) for s in unit.layout.model.provides_for(item.name))
    for limit in unit.layout.model.limits_for(item.name):
        for bound in limit.bounds:
            _extend_to(unit, root, bound.path)
        is_given = True
    return root if root.parts or is_given else None


def _extend(unit: Unit, found: Field, provided: ProvidedValue) -> None:
    if isinstance(provided, ObjectValue):
        for name, inner in provided.properties:
            part = _part(unit, found, name)
            if part is not None:
                _extend(unit, part, inner)


def _extend_to(unit: Unit, found: Field, path: tuple[str, ...]) -> None:
    part: Field | None = found
    for name in path:
        part = None if part is None else _part(unit, part, name)


def _part(unit: Unit, found: Field, name: str) -> Field | None:
    """The field of a property, which from now on is given; None where the datum has no properties."""
    if not isinstance(found.type, ObjectType):
        return None
    if name not in found.parts:
        types = {part.name: part.type for part in unit.layout.model.object(found.type.name).properties}
        taken = [word for member, part in found.parts.values() for word in (member, part.flag)]
        namer = CNamer(frozenset(taken))
        member = namer.member(name)
        found.parts[name] = (member, Field(types[name], value=member, flag=namer.name(f"has_{member}")))
    return found.parts[name][1]


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
    name, statements = unit.layout.function("provides", item.name), unit.layout.model.provides_for(item.name)
    head = f"static bool {name}(const state_t *s, {unit.layout.prefix}_request_t *request)"
    root, place = request_field(unit, item), f"request->data.{unit.layout.request_members[item.name]}"
    chosen = first_provided(statements, Reading(unit), lambda value: _result(unit, root, value, place), _GIVEN)
    return unit.definition(head, [*unused("s", "request"), *chosen])


def _result(unit: Unit, root: Field | None, provided: ProvidedValue, place: str) -> Block:
    """Statements that store the data; where a part may be unknown, all parts are tested before."""
    held: list[Let] = []
    stores: list[Assign] = []
    if root is not None:
        _store(unit, root, provided, place, held, stores)
    tests = [operation(f"unknown {item.value.sort.value}", item.place) for item in held]
    refusal = [when(operation("or", *tests), Return(FALSE_CODE))] if tests else []
    return [*held, *refusal, *stores, _GIVEN]


def _store(
    unit: Unit, found: Field, provided: ProvidedValue, place: str, held: list[Let], stores: list[Assign]
) -> None:
    if isinstance(provided, ObjectValue):
        for name, inner in provided.properties:
            member, part = found.parts[name]
            _store(unit, part, inner, f"{place}.{member}" if isinstance(part.type, ObjectType) else place, held, stores)
        return
    code = Reading(unit).value(provided)
    if isinstance(found.type, DoubleType):
        code = Reading(unit).as_double(code)
    if not code.is_known:
        held.append(Let(code.held_in(f"data_{len(held) + 1}"), code))
        code = held[-1].place
    stores.append(Assign(variable(f"{place}.{found.flag}"), TRUE_CODE))
    stores.append(Assign(variable(f"{place}.{found.value}"), _stored(unit, found.type, code)))


def _stored(unit: Unit, type_: Type, code: Code) -> Code:
    match type_:
        case BooleanType():
            return operation("truth", code)
        case IntegerType():
            return operation("int32_t", code)
        case EnumType(name=name):
            values = ", ".join(f'"{item}"' for item in unit.layout.model.enum(name).values)
            return operation("item", variable(f"((const char *const[]){{{values}}})"), code)
        case _:
            return code


def default_function(unit: Unit, item: Communication) -> list[str]:
    """The function that says whether a request's data is all default."""
    name, root = unit.layout.function("is_default", item.name), request_field(unit, item)
    place = f"request->data.{unit.layout.request_members[item.name]}"
    tests = [] if root is None else _non_default(root, place)
    body = [*unused("request"), *(when(variable(test), Return(FALSE_CODE)) for test in tests), _GIVEN]
    return unit.definition(f"static bool {name}(const {unit.layout.prefix}_request_t *request)", body)


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
