"""Generated functions that take an event: move and update, all at once.

All updates of a step read a copy of the state before it; a compiler keeps only the needed part.
"""

from collections.abc import Sequence

from robosc.expressions import ArrayType, BooleanType, DoubleType, EnumType, IntegerType, Type
from robosc.model.received import Path, converted_paths
from robosc.model.structure import is_tau
from robosc.targets.code.c.alike import Family
from robosc.targets.code.c.expressions import c_type, number_code
from robosc.targets.code.c.layout import event_data, width
from robosc.targets.code.c.naming import CNamer
from robosc.targets.code.c.readers import Readers
from robosc.targets.code.c.received import NAMES, NO_NOTES, Reader
from robosc.targets.code.c.statements import unused
from robosc.targets.code.c.text import declared
from robosc.targets.code.c.unit import Lvalue, Reading, Unit
from robosc.targets.code.expressions import (
    FALSE_CODE,
    TRUE_CODE,
    Code,
    Sort,
    bounds_of,
    call,
    literal,
    operation,
    variable,
    words_of,
)
from robosc.targets.code.statements import Assign, Block, Do, If, Let, Return, Statement, codes, when
from robosc.targets.code.steps import StepWriter

_STATE, _OLD = variable("s"), variable("old")
_SKIPPED, _NOTHING = variable("skipped"), literal("0", Sort.INTEGER)


class Stepper(StepWriter):
    """Writes what one event does.

    Args:
        unit: The file.
        event: The event.
        readers: Table of the events that read each place of the state.
    """

    refused = literal("REFUSED", Sort.INTEGER)

    def __init__(self, unit: Unit, event: str, readers: Readers) -> None:
        self.unit = unit
        self.readers = readers
        self.event = event
        self.data = None if is_tau(event) else event_data(unit.layout.model, event)
        self.paths = converted_paths(unit.layout.model, event) if self.data is not None else ()
        self._received: dict[Path, Code] = {}
        before = Reading(unit, Lvalue(_OLD.word), self._received.__getitem__, self.data)
        super().__init__(unit.layout.executable.events[event], before, before, Reading(unit), CNamer(NAMES))

    def step_function(self) -> list[str]:
        """The function that takes the event: how many updates were skipped, or REFUSED."""
        parameters = [f"{self.unit.layout.prefix}_t *r", *(self._parameter(path) for path in self.paths)]
        body: list[Statement] = [*self._refusals(), *self._plant(), *self._components()]
        start: list[Statement] = []
        words = words_of(codes(body))
        if _STATE.word in words:
            start.append(Let(_STATE, variable("&r->state"), "state_t *const"))
        if _OLD.word in words:
            start.append(Let(_OLD, variable("r->state"), "const state_t"))
        if self.may_skip:
            start.append(Let(_SKIPPED, _NOTHING, "int"))
        start += unused("r", *(code.word for code in self._received.values()))
        head = f"static int {self.unit.layout.function('takes', self.event)}({', '.join(parameters)})"
        return self.unit.definition(head, [*start, *body, Return(_SKIPPED if self.may_skip else _NOTHING)])

    def happen_function(self, steps: Family) -> list[str]:
        """The function that converts what came with an event of the environment and takes it."""
        layout, name = self.unit.layout, self.unit.layout.events[self.event]
        parameters = [f"{layout.prefix}_t *r"]
        arguments = [variable("r")]
        body = unused("may_keep")
        if self.data is not None:
            parameters.append(layout.parameter(self.data, "data"))
            body += unused("data")
            if self.paths:
                reader = Reader(self.unit, self.data, "&notes")
                arguments += [reader.read(path) for path in self.paths]
                counted = variable(f"notes.is_unknown && !notes_count(r, {name}, &notes, may_keep)")
                body += [NO_NOTES, *reader.default(), *reader.take(), when(counted, Return(FALSE_CODE))]
        function, row = steps.call(self.event, layout.function("takes", self.event))
        taken = call(function, *arguments, *map(variable, row))
        body += [Do(call("happened", variable("r"), variable(name), taken)), Return(TRUE_CODE)]
        head = f"static bool {layout.function('happens', self.event)}({', '.join([*parameters, 'bool may_keep'])})"
        return self.unit.definition(head, body)

    def _parameter(self, path: Path) -> str:
        """The parameter of the step function that takes the value of a path."""
        assert self.data is not None  # noqa: S101  # Paths exist only where data comes.
        # The declared code of the reader has the same bounds: it is made of the same path.
        code = Reader(self.unit, self.data, "NULL").read(path)
        code = self._received[path] = code.held_in(self._namer.name("_".join(["value", *map(str, path)])))
        type_ = self._values.received_type(path)
        is_array = isinstance(type_, ArrayType)
        return declared(f"const {self.unit.layout.raw(type_)} *" if is_array else c_type(code.sort), code.word)

    def _write(self, place: Code, value: Code, may_stay: bool) -> list[Statement]:
        changed = Do(self.readers.noted(place.word))
        if not may_stay:
            return [Assign(place, value), changed]
        # The new one of equal numbers counts, too, such as -0.0 after 0.0.
        return [when(_differs(place, value), changed), Assign(place, value)]

    def _choice(self, branches: Sequence[tuple[Code, Block]], is_whole: bool) -> Block:
        # They all look at the state before, so that none of them needs an else.
        return [item for test, body in branches for item in (body if test == TRUE_CODE else [If([(test, body)])])]

    def _assigned(self, type_: Type, value: Code) -> Code:
        return self._values.as_double(value) if isinstance(type_, DoubleType) else value

    def _stored(self, type_: Type, value: Code) -> Code:
        match type_:
            case IntegerType():
                return operation("int32_t", value)
            case EnumType(values=values):
                return operation(width(len(values)), value)
            case BooleanType() if not value.is_known:
                return operation("is set", value)
            case _:
                return value

    def _is_at_hand(self, type_: Type, value: Code) -> bool:
        is_simple = value.is_literal or value in self._received.values()
        is_in_range = value.is_within(*bounds_of(type_)) if isinstance(type_, IntegerType) else value.is_known
        return is_simple and is_in_range

    def _unless_skipped(self, name: str, type_: Type, held: Code, written: Block) -> Block:
        if held.is_within(*bounds_of(type_)) if isinstance(type_, IntegerType) else held.is_known:
            return written
        self.may_skip = True
        return [If([(_fits(type_, held), written)], [Do(operation("increment", _SKIPPED))])]


def _differs(place: Code, value: Code) -> Code:
    """Return the code that tests whether a place holds something else than a value."""
    if value in (TRUE_CODE, FALSE_CODE):
        return operation("not", place) if value == TRUE_CODE else place
    if value.sort is Sort.TEXT:
        return operation("!=", call("strcmp", place, value), _NOTHING)
    return operation("!=", place, value)


def _fits(type_: Type, held: Code) -> Code:
    """Return the code that tests whether the value of an update may be assigned."""
    if isinstance(type_, IntegerType):
        low, high = bounds_of(type_)
        return operation("between", number_code(low), held, number_code(high))
    if held.sort is Sort.DOUBLE:
        return call("isfinite", held)
    return operation("is given", held) if held.sort is Sort.TEXT else operation(">=", held, _NOTHING)
