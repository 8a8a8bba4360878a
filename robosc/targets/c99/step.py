"""Generated functions that take an event: move and update, all at once.

All updates of a step read the state before it: a copy, of which a compiler keeps what is needed.
"""

from collections.abc import Sequence

from robosc.expressions import (
    MAXIMUM_INTEGER,
    MINIMUM_INTEGER,
    ArrayType,
    BooleanType,
    DoubleType,
    EnumType,
    IntegerType,
    Type,
)
from robosc.expressions.text import expression_text
from robosc.model.received import Path, converted_paths
from robosc.model.structure import Update, Variable, is_tau
from robosc.targets.c99.expressions import ATOM, c_type, low_text
from robosc.targets.c99.layout import event_data, width
from robosc.targets.c99.naming import CNamer
from robosc.targets.c99.received import Reader
from robosc.targets.c99.text import comment
from robosc.targets.c99.unit import Lvalue, Reading, Unit, declared
from robosc.targets.code.expressions import Code, Sort
from robosc.targets.code.steps import Branch, StepWriter
from robosc.targets.code.text import indent


class Stepper(StepWriter):
    """Writes what one event does.

    Args:
        unit: The file.
        event: The event.
    """

    def __init__(self, unit: Unit, event: str) -> None:
        self.unit = unit
        self.event = event
        self.data = None if is_tau(event) else event_data(unit.layout.model, event)
        self.paths = converted_paths(unit.layout.model, event) if self.data is not None else ()
        self._namer = CNamer(frozenset({"data", "notes", "s", "old", "skipped", "r"}))
        self._received: dict[Path, Code] = {}
        self._may_skip = False
        self._reading = Reading(unit, "old.", self._read, self.data)
        super().__init__(unit.layout.executable.events[event], self._reading)

    @property
    def parameters(self) -> list[str]:
        """Parameters of the step function after the state: one value for each path."""
        self._name_received()
        return [
            f"const {self.unit.layout.raw(self._reading.received_type(path))} *{code.word}"
            if isinstance(self._reading.received_type(path), ArrayType)
            else declared(c_type(code.sort), code.word)
            for path, code in self._received.items()
        ]

    def step_function(self) -> list[str]:
        """The function that takes the event: how many updates were skipped, or REFUSED."""
        parameters = self.parameters
        with self.unit.uses_apart() as used:
            body = [*self._refusals(), *self._plant(), *self._components()]
        self.unit.used |= used
        reads_old = any(word == "&old" or word.startswith("old.") for word in used)
        head = ", ".join(["state_t *s", *parameters])
        unused = [code.word for code in self._received.values()]
        return [
            f"static int {self.unit.layout.function('takes', self.event)}({head})",
            "{",
            *(["    const state_t old = *s;"] if reads_old else []),
            *(["    int skipped = 0;"] if self._may_skip else []),
            "    (void)s;",
            *(f"    (void){name};" for name in unused),
            *indent(body),
            f"    return {'skipped' if self._may_skip else '0'};",
            "}",
        ]

    def happen_function(self) -> list[str]:
        """The function that converts what came with an event of the environment and takes it."""
        layout = self.unit.layout
        parameter = [] if self.data is None else [layout.parameter(self.data, "data")]
        head = ", ".join([f"{layout.prefix}_t *r", *parameter, "bool may_keep"])
        lines = [f"static bool {layout.function('happens', self.event)}({head})", "{", "    (void)may_keep;"]
        arguments = ["&r->state"]
        if self.data is not None:
            lines.append("    (void)data;")
            if self.paths:
                is_pointer = layout.is_by_pointer(self.data)
                reader = Reader(self.unit, self.data, Lvalue("data", is_pointer), "&notes")
                arguments += [reader.read(path).word for path in self.paths]
                lines.append("    notes_t notes = {false, false};")
                if is_pointer:
                    lines += indent(["if (data == NULL) {", f"    data = &{unknown_name(layout.raw(self.data))};", "}"])
                lines += indent(reader.take_lines())
                enumerator = layout.events[self.event]
                lines += indent(
                    [
                        f"if (notes.is_unknown && !notes_count(r, {enumerator}, &notes, may_keep)) {{",
                        "    return false;",
                        "}",
                    ]
                )
        function = layout.function("takes", self.event)
        return [
            *lines,
            f"    happened(r, {layout.events[self.event]}, {function}({', '.join(arguments)}));",
            "    return true;",
            "}",
        ]

    def _name_received(self) -> None:
        for path in self.paths:
            if path not in self._received:
                name = self._namer.name("_".join(["value", *map(str, path)]))
                # The declared code of the reader has the same bounds: it is made of the same path.
                code = Reader(self.unit, self._root, Lvalue("data", True), "NULL").read(path)
                self._received[path] = code.held_in(name)

    @property
    def _root(self) -> Type:
        assert self.data is not None  # noqa: S101  # There are paths only where data comes.
        return self.data

    def _read(self, path: Path) -> Code:
        return self._received[path]

    def _refuse_outside(self, automaton: str, locations: tuple[str, ...]) -> list[str]:
        return self._reading.unless(self._reading.in_one_of(automaton, locations), "return REFUSED;")

    def _refuse_unless(self, words: str, condition: Code) -> list[str]:
        return [*comment(words), *self._reading.unless(condition, "return REFUSED;")]

    def _move(self, automaton: str, sources: tuple[str, ...], target: str) -> list[str]:
        layout = self.unit.layout
        return [f"s->{layout.locations[automaton]} = {layout.location_names[automaton, target]};"]

    def _choice(self, component: str, branches: Sequence[Branch], states: int) -> list[str]:
        lines: list[str] = []
        for inside, body in branches:
            if len(inside) == states:
                lines += body
            else:
                test = self._reading.in_one_of(component, inside)
                lines += [f"if ({self.unit.text(test)}) {{", *indent(body), "}"]
        return lines

    def _update(self, component: str, variable: Variable, update: Update) -> list[str]:
        place = f"s->{self.unit.layout.variables[component, variable.name][0]}"
        code = self._reading.value(update.expression)
        words = comment(f"{component}: do {variable.name} := {expression_text(update.expression)}")
        if isinstance(variable.type, DoubleType):
            code = self._reading.as_double(code)
        fits = self._fits(variable.type, code)
        cast = stored_cast(variable.type)
        if fits is None:
            return [*words, f"{place} = {cast}{self.unit.text(code, ATOM if cast else 0)};"]
        self._may_skip = True
        new = self._namer.name(f"new_{variable.name}")
        return [
            *words,
            self.unit.local(code, new),
            f"if ({fits.replace('@', new)}) {{",
            f"    {place} = {cast}{f'({new} != 0)' if isinstance(variable.type, BooleanType) else new};",
            "} else {",
            "    skipped++;",
            "}",
        ]

    @staticmethod
    def _fits(type_: Type, code: Code) -> str | None:
        """The test of a value `@` that may be skipped, or None for one that never is."""
        if isinstance(type_, IntegerType):
            low = MINIMUM_INTEGER if type_.low is None else type_.low
            high = MAXIMUM_INTEGER if type_.high is None else type_.high
            if code.is_within(low, high):
                return None
            return f"@ >= {low_text(low)} && @ <= {low_text(high)}"
        if code.is_known:
            return None
        if code.sort is Sort.DOUBLE:
            return "isfinite(@)"
        return "@ != NULL" if code.sort is Sort.TEXT else "@ >= 0"


def stored_cast(type_: Type) -> str:
    """The conversion to the member that holds a variable."""
    match type_:
        case IntegerType():
            return "(int32_t)"
        case EnumType(values=values):
            return f"({width(len(values))})"
        case _:
            return ""


def unknown_name(raw: str) -> str:
    """The constant of an object type in which everything is unknown."""
    return f"{raw.removesuffix('_t')}_unknown"
