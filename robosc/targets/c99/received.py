"""Generated code that reads received data into local variables, and makes enums of it."""

from dataclasses import dataclass, field

from robosc.expressions import (
    ArrayType,
    EnumType,
    IntegerType,
    ObjectType,
    Type,
)
from robosc.expressions.text import expression_text
from robosc.model.received import Path
from robosc.model.structure import EnumDefinition
from robosc.targets.c99.expressions import c_type
from robosc.targets.c99.naming import CNamer
from robosc.targets.c99.text import comment
from robosc.targets.c99.unit import Lvalue, Reading, Unit, declared
from robosc.targets.code.expression_writer import may_compute
from robosc.targets.code.expressions import TRUE_CODE, Code
from robosc.targets.code.text import indent
from robosc.targets.paths import path_type


@dataclass
class Reader:
    """Writer of declarations that read paths of one received datum; each path is read once.

    Attributes:
        unit: The file.
        root: Type of the datum.
        lvalue: Place of the datum.
        notes: Text of the address of what is noted.
    """

    unit: Unit
    root: Type
    lvalue: Lvalue
    notes: str
    names: dict[str, None] = field(default_factory=dict)
    _lines: list[str] = field(default_factory=list)
    _codes: dict[Path, Code] = field(default_factory=dict)
    _namer: CNamer = field(default_factory=lambda: CNamer(frozenset({"data", "notes", "s", "old", "skipped", "r"})))

    def read(self, path: Path) -> Code:
        """The code of a path."""
        if path not in self._codes:
            self._codes[path] = self._read(path)
        return self._codes[path]

    def type_at(self, path: Path) -> Type:
        """The type of a path."""
        return path_type(self.unit.layout.model, self.root, path)

    def take_lines(self) -> list[str]:
        """The declarations since the last call."""
        lines, self._lines = self._lines, []
        return lines

    def _read(self, path: Path) -> Code:
        code, type_ = self.unit.part(self.lvalue, self.root, path, self.notes), self.type_at(path)
        name = self._namer.name("_".join(["value", *map(str, path)]))
        self.names[name] = None
        is_array = isinstance(type_, ArrayType)
        held = f"const {self.unit.layout.raw(type_)} *" if is_array else c_type(code.sort)
        # The text itself is constant already; of everything else the local variable is.
        constant = "" if is_array or held.endswith("*") else "const "
        self._lines.append(f"{constant}{declared(held, name)} = {self.unit.text(code)};")
        if is_array:
            notable = note_function(self.unit, type_)
            if notable:
                self.unit.used.add(notable)
                self._lines.append(f"{notable}({name}, {self.notes});")
        return code.held_in(name)


def note_function(unit: Unit, type_: Type) -> str | None:
    """The function that notes what is unknown in an array's elements, or None if nothing can be noted."""
    if not isinstance(type_, ArrayType):
        return None
    with unit.uses_apart() as uses:
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
    with unit.uses_apart() as unit.uses[unit.layout.converters[enum.name]]:
        return [converter_head(unit, enum), "{", *indent(_conversion(unit, enum)), "}"]


def _conversion(unit: Unit, enum: EnumDefinition) -> list[str]:
    lvalue = Lvalue("data", unit.layout.is_by_pointer(enum.source))
    reader = Reader(unit, enum.source, lvalue, "notes")
    reading = Reading(unit, None, reader.read, enum.source)
    values = unit.layout.values
    body = ["(void)data;", "(void)notes;"]
    all_false = TRUE_CODE
    for rule in enum.rules:
        fires = reading.truth(rule.condition)
        all_false = reading.both(all_false, reading.falsity(rule.condition))
        # What only a later rule needs is not read before that rule's turn.
        body += _declared_and_used(reader)
        body += comment(f"{expression_text(rule.condition)} -> {rule.value}")
        body += [f"if ({unit.text(fires)}) {{", f"    return {values[enum.name, rule.value]};", "}"]
    body += comment(f"default -> {enum.default}")
    if may_compute(rule.condition for rule in enum.rules):
        body += [
            f"if (notes != NULL && !({unit.text(all_false)})) {{",
            "    notes->is_unknown = true;",
            "    notes->is_enum_unknown = true;",
            "}",
        ]
    return [*body, f"return {values[enum.name, enum.default]};"]


def _declared_and_used(reader: Reader) -> list[str]:
    """The declarations, none of which a compiler may call unused."""
    lines = reader.take_lines()
    names, reader.names = list(reader.names), {}
    return [*lines, *(f"(void){name};" for name in names)]
