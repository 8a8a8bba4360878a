"""Generated code that reads received data into local variables, and makes enums of it."""

from robosc.expressions import ArrayType, EnumType, IntegerType, ObjectType, Type
from robosc.model.received import Path
from robosc.model.structure import EnumDefinition
from robosc.targets.code.c.naming import CNamer
from robosc.targets.code.c.statements import unused
from robosc.targets.code.c.unit import Lvalue, Reading, Unit
from robosc.targets.code.expressions import TRUE_CODE, Code, Sort, call, literal, operation, variable
from robosc.targets.code.received import ReceivedReader
from robosc.targets.code.statements import Assign, Do, If, Let, Return, Statement, when
from robosc.targets.text import indent

NAMES = frozenset({"data", "notes", "s", "old", "skipped", "r"})
"""Names that functions use on their own."""

NO_NOTES = Let(variable("notes"), literal("{false, false}", Sort.TEXT), "notes_t")
"""The declaration of what is noted about received data."""

_DATA, _NULL = variable("data"), literal("NULL", Sort.TEXT)


class Reader(ReceivedReader):
    """Builds declarations that read paths of one received datum.

    Args:
        unit: The file.
        root: Type of the datum.
        notes: Text of the address of what is noted.
    """

    def __init__(self, unit: Unit, root: Type, notes: str) -> None:
        super().__init__(unit.layout.model, root, CNamer(NAMES))
        self._unit, self._notes = unit, notes
        self._is_pointer = unit.layout.is_by_pointer(root)
        self._place = Lvalue("data", self._is_pointer)

    @property
    def scope(self) -> Reading:
        """Writer of conditions on the datum."""
        return Reading(self._unit, received=self.read, root=self._root)

    def default(self) -> list[Statement]:
        """The statements that give a datum in which everything is unknown where none came."""
        if not self._is_pointer:
            return []
        nothing = variable(f"&{unknown_name(self._unit.layout.raw(self._root))}")
        return [when(operation("=", _DATA, _NULL), Assign(_DATA, nothing))]

    def take_used(self) -> list[Statement]:
        """The declarations since the last call, none of which a compiler calls unused."""
        found = self.take()
        return [*found, *unused(*(item.place.word for item in found if isinstance(item, Let)))]

    def _read(self, path: Path, type_: Type) -> Code:
        value = self._unit.part(self._place, self._root, path, self._notes)
        code = value.held_in(self.local(path))
        if not isinstance(type_, ArrayType):
            self._statements.append(Let(code, value))
            return code
        self._statements.append(Let(code, value, f"const {self._unit.layout.raw(type_)} *"))
        if notable := note_function(self._unit, type_):
            self._statements.append(Do(call(notable, code, variable(self._notes))))
        return code

    def _result(self, value: Code) -> Return:
        return Return(value)

    def _undecided(self, enum: EnumDefinition, test: Code) -> If:
        members = (variable(f"notes->{name}") for name in ("is_unknown", "is_enum_unknown"))
        is_noted = operation("and", operation("is given", variable("notes")), operation("not all", test))
        return when(is_noted, *(Assign(member, TRUE_CODE) for member in members))


def unknown_name(raw: str) -> str:
    """The constant of an object type in which everything is unknown."""
    return f"{raw.removesuffix('_t')}_unknown"


def note_function(unit: Unit, type_: ArrayType) -> str | None:
    """The function that notes what is unknown in an array's elements, or None if nothing can be noted."""
    with unit.separate_uses() as uses:
        body = _notes_on(unit, Lvalue("array->items[k]"), type_.element)
    if not body:
        return None
    lines = [
        f"static void @(const {unit.layout.raw(type_)} *array, notes_t *notes)",
        "{",
        "    const size_t count = (array == NULL || array->items == NULL) ? 0 : array->length;",
        "    for (size_t k = 0; k < count; k++) {",
        *indent(body, 2),
        "    }",
        "}",
    ]
    return unit.function("note", "\n".join(lines), uses)


def _notes_on(unit: Unit, lvalue: Lvalue, type_: Type) -> list[str]:
    match type_:
        case IntegerType(low=int(), high=int()) | EnumType():
            return [f"(void){unit.text(unit.conversion(lvalue, type_, 'notes'))};"]
        case ObjectType(name=name):
            return [
                line
                for item in unit.layout.model.object(name).properties
                for line in _notes_on(unit, lvalue.member(unit.layout.properties[name, item.name]), item.type)
            ]
        case ArrayType():
            inner = note_function(unit, type_)
            if not inner:
                return []
            unit.used.add(inner)
            return [f"{inner}({lvalue.address}, notes);"]
        case _:
            return []


def converter_head(unit: Unit, enum: EnumDefinition) -> str:
    """The head of the function that makes an enum out of received data."""
    name, parameter = unit.layout.converters[enum.name], unit.layout.parameter(enum.source, "data")
    return f"static int {name}({parameter}, notes_t *notes)"


def converter(unit: Unit, enum: EnumDefinition) -> list[str]:
    """The function that makes an enum out of received data, as a readable chain of conditions."""
    with unit.separate_uses() as unit.uses[unit.layout.converters[enum.name]]:
        body = [*unused("data", "notes"), *Reader(unit, enum.source, "notes").conversion(enum)]
        return unit.definition(converter_head(unit, enum), body)
