"""Common parts of one generated C file, and the reading of expressions in it."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

from robosc.automata import System
from robosc.errors import InternalError
from robosc.expressions import (
    ArrayPart,
    ArrayType,
    BooleanType,
    DoubleType,
    EnumType,
    IntegerType,
    ObjectType,
    PathStep,
    Quantifier,
    Received,
    Reduction,
    StateTest,
    Type,
    VariableRead,
    leaves,
)
from robosc.model.received import Path, path_type
from robosc.model.structure import Model
from robosc.supervisor import Supervisor
from robosc.targets.code.c.expressions import CWriter, c_type, code_text, number_code, unknown_as, unknown_text
from robosc.targets.code.c.layout import Layout, make_layout
from robosc.targets.code.c.statements import statement_lines, unused
from robosc.targets.code.c.text import declared, pointer_to
from robosc.targets.code.expression_writer import read_nothing
from robosc.targets.code.expressions import (
    FALSE_CODE,
    TRUE_CODE,
    Code,
    Kind,
    Sort,
    Unknown,
    call,
    literal,
    operation,
    place,
    sort_of,
    variable,
    words_of,
)
from robosc.targets.code.statements import Block, codes
from robosc.targets.text import indent


@dataclass(frozen=True, slots=True)
class Lvalue:
    """A place that holds received data.

    Attributes:
        name: Its name, or that of a pointer to it.
        is_pointed_to: True if it is a pointer's.
    """

    name: str
    is_pointed_to: bool = False

    def __str__(self) -> str:
        return f"(*{self.name})" if self.is_pointed_to else self.name

    def member(self, name: str) -> "Lvalue":
        """A member of a struct."""
        return Lvalue(f"{self.name}{'->' if self.is_pointed_to else '.'}{name}")

    @property
    def address(self) -> str:
        """Text of its address."""
        return self.name if self.is_pointed_to else f"&{self.name}"


@dataclass
class Unit:
    """One generated C file under way.

    Attributes:
        layout: Names.
        system: The automata, for the domains of decision diagrams.
        functions: Name and text of each function made for an array, by its head and body without its name.
        uses: Places and functions that each function of these, of enums and of diagrams uses, by its name.
        used: Those that all other code reads and calls.
    """

    layout: Layout
    system: System
    functions: dict[str, tuple[str, str]] = field(default_factory=dict)
    uses: dict[str, set[str]] = field(default_factory=dict)
    used: set[str] = field(default_factory=set)

    def text(self, code: Code) -> str:
        """The text of an expression; what it uses is noted."""
        self.used |= words_of([code])
        return code_text(code)

    def definition(self, head: str, block: Block) -> list[str]:
        """The function with a head and statements; what they use is noted."""
        self.used |= words_of(codes(block))
        return [head, "{", *indent(statement_lines(block)), "}"]

    @contextmanager
    def separate_uses(self) -> Iterator[set[str]]:
        """Note what is used inside apart from what all other code uses."""
        outside, self.used = self.used, set()
        try:
            yield self.used
        finally:
            self.used = outside

    def function(self, purpose: str, template: str, uses: set[str]) -> str:
        """The name of a function with this text, in which `@` stands for the name; equal ones are written once."""
        if template not in self.functions:
            name = f"{purpose}_{len(self.functions) + 1}"
            self.functions[template] = (name, template.replace("@", name))
            self.uses[name] = uses
        return self.functions[template][0]

    def conversion(self, lvalue: Lvalue, type_: Type, notes: str, *, is_element: bool = True) -> Code:
        """The value of a type that is made of received data.

        Args:
            lvalue: Place of the data.
            type_: The type.
            notes: Text of the address that what must be noted goes to.
            is_element: True for a part of an array's element, which may be unknown whatever its type is.
        """
        read, noted = variable(str(lvalue)), variable(notes)
        match type_:
            case IntegerType(low=int(low), high=int(high)):
                bounds = number_code(low), number_code(high)
                if not is_element:
                    return call("moved", read, *bounds, noted).typed(type_)
                code = call("clamped", read, *bounds, noted)
            case IntegerType():
                code = call("whole", read)
            case EnumType(name=name):
                argument = variable(lvalue.address) if self.layout.is_by_pointer(type_) else read
                return call(self.layout.converters[name], argument, noted).typed(type_)
            case ArrayType():
                return place(lvalue.address, type_)
            case ObjectType():
                raise InternalError(f"{lvalue} is not a single value")
            case BooleanType() if is_element:
                code = call("boolean_of", read)
            case BooleanType():
                return read.typed(type_)
            case _:
                code = read
        return code.typed(type_, unknown_as(sort_of(type_)))

    def access(self, lvalue: Lvalue, type_: Type, path: Path) -> tuple[list[Code], Lvalue, Type]:
        """Return the conditions for a part of received data to be there, its place and its type."""
        guards = []
        for step in path:
            if isinstance(step, int):
                read = (Code(Kind.PLACE, str(lvalue.member(name))) for name in ("items", "length"))
                guards.append(operation("has element", *read, literal(f"{step}U", Sort.INTEGER)))
                lvalue = Lvalue(f"{lvalue.member('items')}[{step}]")
            elif isinstance(type_, ObjectType):
                lvalue = lvalue.member(self.layout.properties[type_.name, step])
            type_ = path_type(self.layout.model, type_, (step,))
        return guards, lvalue, type_

    def part(self, lvalue: Lvalue, type_: Type, path: Path, notes: str) -> Code:
        """The value of a part of received data; unknown where it is absent."""
        guards, found, inner = self.access(lvalue, type_, path)
        code = self.conversion(found, inner, notes, is_element=bool(guards))
        if not guards:
            return code
        is_there = guards[0] if len(guards) == 1 else operation("and", *guards)
        absent = literal(unknown_text(code.sort), code.sort)
        return operation("if there", is_there, code, absent).typed(inner, unknown_as(code.sort))


def plain_type(type_: Type) -> str:
    """The C type of a value that is no enum, array or object."""
    match type_:
        case BooleanType():
            return "bool"
        case IntegerType():
            return "int32_t"
        case DoubleType():
            return "double"
        case _:
            return "const char *"


@dataclass(frozen=True)
class Reading(CWriter):
    """Writer of expressions at one place of the generated code.

    Attributes:
        unit: The file.
        base: Place of the state.
        received: Code of received data by path; of an array, its address.
        root: Type of the received data, or None where there is none.
        elements: Place and type of what the quantifiers around look at, the innermost first.
    """

    unit: Unit
    base: Lvalue = Lvalue("s", True)
    received: Callable[[Path], Code] = read_nothing
    root: Type | None = None
    elements: tuple[tuple[Lvalue, Type], ...] = ()

    @property
    def model(self) -> Model:
        """The model."""
        return self.unit.layout.model

    def variable_place(self, component: str, variable: str) -> Code:
        """The place of a variable."""
        attribute, type_ = self.unit.layout.variables[component, variable]
        return self._member(attribute).typed(type_)

    def location_place(self, automaton: str) -> Code:
        """The place of an automaton's location."""
        return self._member(self.unit.layout.locations[automaton])

    def location_code(self, automaton: str, location: str) -> Code:
        """The code of a location."""
        return literal(self.unit.layout.location_names[automaton, location], Sort.ENUM)

    def _member(self, name: str) -> Code:
        return Code(Kind.PLACE, str(self.base.member(name)), (variable(self.base.name),))

    def _enum_code(self, enum: str, value: str) -> Code:
        return literal(self.unit.layout.values[enum, value], Sort.ENUM)

    def state_code(self, automaton: str, state: str, is_in: bool = True) -> Code:
        """Return the code that tests whether an automaton is in a location, or is not."""
        if automaton not in self.unit.layout.locations:
            return TRUE_CODE if is_in else FALSE_CODE  # A message's plant has one location.
        return super().state_code(automaton, state, is_in)

    def _element_code(self, level: int, path: tuple[PathStep, ...]) -> Code:
        lvalue, type_ = self.elements[level]
        return self.unit.part(lvalue, type_, path, "NULL")

    def _loop(self, part: ArrayPart) -> tuple[str, str, set[str]]:
        """The number of elements that are looked at, the place of the one with number `k`, and what these call."""
        if part.low is None or part.high is None:
            return "array->length", "k", set()
        bounds = f"array->length, {part.low}U"
        return f"part_count({bounds}, {part.high}U)", f"part_index({bounds}, k)", {"part_count", "part_index"}

    def _reduction_code(self, expression: Reduction) -> Code:
        array, type_ = self._array(expression.part)
        count, index, uses = self._loop(expression.part)
        raw = self.unit.layout.raw(type_)
        nothing = "array == NULL || array->items == NULL"
        if expression.function == "length":
            name = self.unit.function(
                "length",
                f"static int64_t @(const {raw} *array)\n{{\n"
                f"    return ({nothing}) ? INT64_MIN : (int64_t)({count});\n}}",
                uses,
            )
            return replace(call(name, array, sort=Sort.INTEGER, unknown=Unknown.VALUE), low=0)
        with self.unit.separate_uses() as used:
            element = self.unit.text(self.unit.conversion(Lvalue("array->items[place]"), type_.element, "NULL"))
        sort = sort_of(type_.element)
        unknown, held = unknown_text(sort), c_type(sort)
        skip = "isnan(item)" if isinstance(type_.element, DoubleType) else None
        operator = "<" if expression.function == "min" else ">"
        lines = [
            f"static {held} @(const {raw} *array)",
            "{",
            f"    {held} found = {unknown};",
            "    bool is_found = false;",
            f"    const size_t count = ({nothing}) ? 0 : {count};",
            "    for (size_t k = 0; k < count; k++) {",
            f"        const size_t place = {index};",
            f"        const {held} item = {element};",
        ]
        if skip is None:
            lines += [f"        if (item == {unknown}) {{", f"            return {unknown};", "        }"]
            test = f"!is_found || item {operator} found"
        else:
            test = f"!{skip} && (!is_found || item {operator} found)"
        lines += [
            f"        if ({test}) {{",
            "            found = item;",
            "            is_found = true;",
            "        }",
            "    }",
            "    return found;",
            "}",
        ]
        name = self.unit.function(expression.function + "imum", "\n".join(lines), uses | used)
        return call(name, array).typed(type_.element, unknown_as(sort))

    def _quantifier_code(self, expression: Quantifier) -> Code:
        array, type_ = self._array(expression.part)
        count, index, uses = self._loop(expression.part)
        raw = self.unit.layout.raw
        parameters, arguments = {"array": f"const {raw(type_)} *array"}, [array]
        found = leaves(expression.condition)
        if any(isinstance(leaf, VariableRead | StateTest) for leaf in found):
            parameters["s"] = "const state_t *s"
            arguments.append(Code(Kind.PLACE, self.base.address, (variable(self.base.name),)))
        codes: dict[Path, Code] = {}
        for path in dict.fromkeys(leaf.path for leaf in found if isinstance(leaf, Received)):
            outer, name = self.received(path), f"value_{len(codes) + 1}"
            is_array = isinstance(self.received_type(path), ArrayType)
            held = f"const {raw(self.received_type(path))} *" if is_array else c_type(outer.sort)
            parameters[name] = declared(held, name)
            arguments.append(outer)
            codes[path] = outer.held_in(name)
        elements: list[tuple[Lvalue, Type]] = [(Lvalue("item", True), type_.element)]
        for number, (lvalue, outer_type) in enumerate(self.elements):
            name = f"outer_{number + 1}"
            parameters[name] = pointer_to(raw(outer_type), name)
            arguments.append(variable(lvalue.address))
            elements.append((Lvalue(name, True), outer_type))
        inner = Reading(self.unit, received=codes.__getitem__, root=self.root, elements=tuple(elements))
        with self.unit.separate_uses() as used:
            condition = self.unit.text(inner.value(expression.condition))
        ends = int(expression.word == "any")
        lines = [
            f"static int @({', '.join(parameters.values())})",
            "{",
            f"    const size_t count = (array == NULL || array->items == NULL) ? 0 : {count};",
            f"    int result = count == 0 ? KLEENE_UNKNOWN : {1 - ends};",
            *indent(statement_lines(unused(*[*parameters][1:]))),
            "    for (size_t k = 0; k < count; k++) {",
            f"        {pointer_to(self.unit.layout.raw_element(type_.element), 'item')} = &array->items[{index}];",
            f"        const int holds = {condition};",
            "        (void)item;",
            f"        if (holds == {ends}) {{",
            f"            return {ends};",
            "        }",
            "        if (holds < 0) {",
            "            result = KLEENE_UNKNOWN;",
            "        }",
            "    }",
            "    return result;",
            "}",
        ]
        name = self.unit.function(expression.word, "\n".join(lines), uses | used)
        return call(name, *arguments, unknown=Unknown.VALUE)


def make_unit(supervisor: Supervisor, prefix: str | None) -> Unit:
    """An empty unit for one supervisor."""
    executable = supervisor.executable
    system = executable.automata if supervisor.strategy is None else executable.remembering_automata
    return Unit(make_layout(supervisor, prefix), system)
