"""Things that all parts of one generated C file share, and the reading of expressions in it."""

import re
from collections.abc import Callable
from dataclasses import dataclass, field

from robosc.automata import System
from robosc.errors import InternalError
from robosc.expressions import (
    ArrayPart,
    ArrayType,
    DoubleType,
    Element,
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
from robosc.model.received import Path
from robosc.supervisor import Supervisor
from robosc.targets.c99.expressions import TRUE_CODE, Code, Scope, Sort, code_for, equality, sort_of, value
from robosc.targets.c99.layout import Layout, make_layout
from robosc.targets.paths import path_type


@dataclass
class Unit:
    """One generated C file under way.

    Attributes:
        layout: Names.
        system: The automata, for the domains of decision diagrams.
        functions: Text of each function made for an array, by its head and body without its name.
    """

    layout: Layout
    system: System
    functions: dict[str, tuple[str, str]] = field(default_factory=dict)

    def function(self, purpose: str, template: str) -> str:
        """The name of a function with this text, in which `@` stands for the name; equal ones are written once."""
        if template not in self.functions:
            name = f"{purpose}_{len(self.functions) + 1}"
            self.functions[template] = (name, template.replace("@", name))
        return self.functions[template][0]

    def conversion(self, lvalue: str, type_: Type, notes: str) -> Code:
        """The value of a type that is made of received data; what must be noted goes to `notes`."""
        match type_:
            case IntegerType(low=int(low), high=int(high)):
                return code_for(f"clamped({lvalue}, {low_text(low)}, {low_text(high)}, {notes})", type_, True)
            case IntegerType():
                return code_for(f"whole({lvalue})", type_, True)
            case EnumType(name=name):
                argument = address(lvalue) if self.layout.is_by_pointer(type_) else lvalue
                return code_for(f"{self.layout.converters[name]}({argument}, {notes})", type_)
            case ArrayType():
                return Code(address(lvalue), Sort.TEXT)
            case ObjectType():
                raise InternalError(f"{lvalue} is no single value")
        if sort_of(type_) is Sort.BOOLEAN:
            return code_for(f"boolean_of({lvalue})", type_, True)
        return code_for(lvalue, type_, True)

    def access(self, lvalue: str, type_: Type, path: Path) -> tuple[list[str], str, Type]:
        """Return the conditions for a part of received data to be there, its place and its type."""
        guards = []
        for step in path:
            if isinstance(step, int):
                guards.append(f"{member(lvalue, 'items')} != NULL && {member(lvalue, 'length')} > {step}U")
                lvalue = f"{member(lvalue, 'items')}[{step}]"
            elif isinstance(type_, ObjectType):
                lvalue = member(lvalue, self.layout.properties[type_.name, step])
            type_ = path_type(self.layout.model, type_, (step,))
        return guards, lvalue, type_

    def part(self, lvalue: str, type_: Type, path: Path, notes: str) -> Code:
        """The value of a part of received data; unknown where it is absent."""
        guards, place, inner = self.access(lvalue, type_, path)
        code = self.conversion(place, inner, notes)
        if not guards:
            return code
        absent = "NULL" if isinstance(inner, ArrayType) else code.sort.unknown
        text = f"({' && '.join(guards)}) ? {code.atom} : {absent}"
        return Code(text, code.sort, True, is_atom=False, low=code.low, high=code.high)


def member(lvalue: str, name: str) -> str:
    """A member of a struct."""
    found = re.fullmatch(r"\(\*(\w+)\)", lvalue)
    return f"{found.group(1)}->{name}" if found else f"{lvalue}.{name}"


def address(lvalue: str) -> str:
    """Return the address of something."""
    found = re.fullmatch(r"\(\*(\w+)\)", lvalue)
    return found.group(1) if found else f"&{lvalue}"


def low_text(number: int) -> str:
    """A 32-bit number as C, the least one too."""
    return str(number) if number > -(2**31) else "(-2147483647 - 1)"


def declared(c_type: str, name: str) -> str:
    """A declaration of one name."""
    return f"{c_type}{name}" if c_type.endswith("*") else f"{c_type} {name}"


def pointer_to(raw: str, name: str) -> str:
    """The declaration of a pointer to constant data."""
    return f"{raw}const *{name}" if raw.endswith("*") else f"const {raw} *{name}"


def _no_received(path: Path) -> Code:
    raise InternalError("a condition on the state reads received data")


def _no_type(path: Path) -> Type:
    raise InternalError("a condition on the state reads received data")


@dataclass(frozen=True)
class Reading:
    """Reading of expressions at one place of the generated code.

    Attributes:
        unit: The file.
        base: Text before a member of the state, or None where there is no state.
        received: Code of received data by path; of an array, its address.
        received_type: Type of received data by path.
        elements: Place and type of what the quantifiers around look at, the innermost first.
    """

    unit: Unit
    base: str | None = "s->"
    received: Callable[[Path], Code] = _no_received
    received_type: Callable[[Path], Type] = _no_type
    elements: tuple[tuple[str, Type], ...] = ()

    @property
    def scope(self) -> Scope:
        """The scope of expressions."""
        return Scope(
            variable=self.variable,
            in_state=self.in_state,
            enum_value=lambda enum, name: self.unit.layout.values[enum, name],
            received=self.received,
            element=self._element,
            reduction=self._reduction,
            quantifier=self._quantifier,
        )

    def variable(self, component: str, name: str) -> tuple[str, Type]:
        """Text and type of a variable."""
        attribute, type_ = self.unit.layout.variables[component, name]
        return f"{self.base}{attribute}", type_

    def in_state(self, automaton: str, state: str) -> Code:
        """Return the code that tests whether an automaton is in a location."""
        if automaton not in self.unit.layout.locations:
            return TRUE_CODE  # A message's plant has one location.
        return equality(self.location(automaton), self.unit.layout.location_names[automaton, state], True)

    def location(self, automaton: str) -> str:
        """Text of an automaton's location."""
        return f"{self.base}{self.unit.layout.locations[automaton]}"

    def _element(self, level: int, path: tuple[PathStep, ...]) -> Code:
        lvalue, type_ = self.elements[level]
        return self.unit.part(lvalue, type_, path, "NULL")

    def _array(self, part: ArrayPart) -> tuple[str, ArrayType]:
        """Address and type of an array; the address is NULL where it is absent."""
        match part.array:
            case Received(path=path):
                text, type_ = self.received(path).text, self.received_type(path)
            case Element(level=level, path=path):
                lvalue, outer = self.elements[level]
                text, type_ = (
                    self.unit.part(lvalue, outer, path, "NULL").text,
                    path_type(self.unit.layout.model, outer, path),
                )
        if not isinstance(type_, ArrayType):
            raise InternalError(f"{text} is no array")
        return text, type_

    def _loop(self, part: ArrayPart) -> tuple[str, str]:
        """Return the number of elements that are looked at, and the place of the one with number `k`."""
        if part.low is None or part.high is None:
            return "array->length", "k"
        bounds = f"array->length, {part.low}U"
        return f"part_count({bounds}, {part.high}U)", f"part_index({bounds}, k)"

    def _reduction(self, expression: Reduction) -> Code:
        text, type_ = self._array(expression.part)
        count, index = self._loop(expression.part)
        raw = self.unit.layout.raw(type_)
        nothing = "array == NULL || array->items == NULL"
        if expression.function == "length":
            name = self.unit.function(
                "length",
                f"static int64_t @(const {raw} *array)\n{{\n"
                f"    return ({nothing}) ? INT64_MIN : (int64_t)({count});\n}}",
            )
            return Code(f"{name}({text})", Sort.INTEGER, True, low=0)
        element = self.unit.conversion("array->items[place]", type_.element, "NULL")
        code = code_for("", type_.element, True)
        unknown, sort = code.sort.unknown, code.sort
        skip = "isnan(item)" if isinstance(type_.element, DoubleType) else None
        operator = "<" if expression.function == "min" else ">"
        lines = [
            f"static {sort.c_type} @(const {raw} *array)",
            "{",
            f"    {sort.c_type} found = {unknown};",
            "    bool is_found = false;",
            f"    const size_t count = ({nothing}) ? 0 : {count};",
            "    for (size_t k = 0; k < count; k++) {",
            f"        const size_t place = {index};",
            f"        const {sort.c_type} item = {element.text};",
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
        name = self.unit.function(expression.function + "imum", "\n".join(lines))
        return Code(f"{name}({text})", sort, True, low=code.low, high=code.high)

    def _quantifier(self, expression: Quantifier) -> Code:
        text, type_ = self._array(expression.part)
        count, index = self._loop(expression.part)
        raw = self.unit.layout.raw
        parameters, arguments = [f"const {raw(type_)} *array"], [text]
        found = leaves(expression.condition)
        if any(isinstance(leaf, VariableRead | StateTest) for leaf in found):
            parameters.append("const state_t *s")
            arguments.append("s" if self.base == "s->" else "&old")
        codes: dict[Path, Code] = {}
        for path in dict.fromkeys(leaf.path for leaf in found if isinstance(leaf, Received)):
            outer, name = self.received(path), f"value_{len(codes) + 1}"
            is_array = isinstance(self.received_type(path), ArrayType)
            c_type = f"const {raw(self.received_type(path))} *" if is_array else outer.sort.c_type
            parameters.append(declared(c_type, name))
            arguments.append(outer.text)
            codes[path] = Code(name, outer.sort, outer.may_be_unknown, low=outer.low, high=outer.high)
        elements: list[tuple[str, Type]] = [("(*item)", type_.element)]
        for number, (lvalue, outer_type) in enumerate(self.elements):
            parameters.append(pointer_to(raw(outer_type), f"outer_{number + 1}"))
            arguments.append(address(lvalue))
            elements.append((f"(*outer_{number + 1})", outer_type))
        inner = Reading(self.unit, "s->", codes.__getitem__, self.received_type, tuple(elements))
        condition = value(expression.condition, inner.scope)
        ends = int(expression.word == "any")
        lines = [
            f"static int @({', '.join(parameters)})",
            "{",
            f"    const size_t count = (array == NULL || array->items == NULL) ? 0 : {count};",
            f"    int result = count == 0 ? KLEENE_UNKNOWN : {1 - ends};",
            *(f"    (void){item.rpartition(' ')[2].lstrip('*')};" for item in parameters[1:]),
            "    for (size_t k = 0; k < count; k++) {",
            f"        {pointer_to(raw(type_.element), 'item')} = &array->items[{index}];",
            f"        const int holds = {condition.text};",
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
        return Code(
            f"{self.unit.function(expression.word, chr(10).join(lines))}({', '.join(arguments)})", Sort.BOOLEAN, True
        )


def make_unit(supervisor: Supervisor, prefix: str | None) -> Unit:
    """An empty unit for one supervisor."""
    return Unit(make_layout(supervisor, prefix), supervisor.executable.automata)
