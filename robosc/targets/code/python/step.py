"""Generated methods that read the data of an event and take it: move and update, all at once.

All updates of a step read the state before it. The generated code writes attributes one after the other, so an
attribute that is read after it may have been written is first copied to a local variable.
"""

from collections.abc import Iterator, Sequence

from robosc.expressions import ArrayType, DoubleType, Expression, IntegerType, StateTest, Type, VariableRead, leaves
from robosc.model.received import Path, converted_paths, path_text
from robosc.targets.code.expressions import (
    FALSE_CODE,
    TRUE_CODE,
    Code,
    Sort,
    Unknown,
    bounds_of,
    call,
    integer,
    operation,
    place,
    variable,
)
from robosc.targets.code.python.changes import noted_change, noted_write
from robosc.targets.code.python.expressions import Scope, constant
from robosc.targets.code.python.naming import PythonNamer
from robosc.targets.code.python.received import Reader, reader_namer, received_unknown
from robosc.targets.code.python.statements import method
from robosc.targets.code.python.writer import Writer
from robosc.targets.code.statements import Assign, Block, Do, If, Let, Return, Statement, when
from robosc.targets.code.steps import StepWriter

_DATA, _SKIPPED, _FOUND = variable("data"), variable("skipped"), variable("found")


def read_method(writer: Writer, event: str) -> list[str]:
    """The method that converts what came with an uncontrollable event."""
    name, paths = writer.layout.methods["read", event], converted_paths(writer.model, event)
    reader = Reader(writer.layout, _event_type(writer, event), writer.used, is_event=True)
    codes = [reader.read(path) for path in paths]
    # Arrays can be long, so they are not logged.
    shown = [path for path in paths if not isinstance(reader.type_at(path), ArrayType)]
    entries = [operation("entry", constant(path_text(path)), reader.seen(path)) for path in shown]
    values, seen = operation("tuple", operation("list", *codes)), operation("object", operation("list", *entries))
    result = Return(call("Reading", values, seen, *reader.noted))
    return method(name, f"Convert the data of {event}.", [*reader.take(), result], [_DATA])


def receive_method(writer: Writer, identifier: str, batch: tuple[str, ...]) -> list[str]:
    """Return the method that takes all events of a message that came, if nothing of its data is unknown.

    Args:
        writer: The writer, after the step methods of these events.
        identifier: Identifier on which it comes.
        batch: The events, in source order.
    """
    namer = reader_namer()
    read: list[Statement] = []
    words: list[Code] = []
    steps: list[Statement] = []
    for event in batch:
        values: list[Code] = []
        if paths := converted_paths(writer.model, event):
            reader = Reader(writer.layout, _event_type(writer, event), writer.used, namer, is_event=True)
            values = [reader.read(path) for path in paths]
            read += reader.take()
            words += reader.words
        step = call(f"self.{writer.layout.methods['step', event]}", *values)
        if event in writer.skipping:
            skipped = operation("tuple", operation("pair", constant(event), _FOUND))
            steps += [Let(_FOUND, step), when(_FOUND, Assign(_SKIPPED, skipped, "+"))]
        else:
            steps.append(Do(step))
    if writer.skipping.isdisjoint(batch):
        steps.append(Return(constant(())))
    else:
        steps = [Let(_SKIPPED, constant(())), *steps, Return(_SKIPPED)]
    refusal = [when(operation("or", *words), Return(constant(None)))] if words else []
    title = f"Convert what came on {identifier}, and take {', '.join(batch)}."
    return method(writer.layout.methods["receive", identifier], title, [*read, *refusal, *steps], [_DATA])


def _event_type(writer: Writer, event: str) -> Type:
    type_ = writer.layout.executable.events[event].received
    assert type_ is not None  # noqa: S101  # Paths exist only where data comes.
    return type_


def step_method(writer: Writer, event: str, is_alone: bool) -> list[str]:
    """The method that takes an event; it returns the skipped updates, or None if it cannot happen now.

    Args:
        writer: The writer.
        event: The event.
        is_alone: True if a message on the identifier of the event stands for nothing else.
    """
    return _StepWriter(writer, event).method(is_alone)


class _StepWriter(StepWriter):
    """Builds the step method of one event."""

    refused = constant(None)

    def __init__(self, writer: Writer, event: str) -> None:
        self.writer = writer
        self.event = event
        self.paths = converted_paths(writer.model, event)
        self.received: dict[Path, Code] = {}
        self.copies: dict[str, Code] = {}
        root = _event_type(writer, event) if self.paths else None
        values = Scope(writer.used.add, writer.model, self._variable, self._location, self.received.__getitem__, root)
        executable, namer = writer.layout.executable.events[event], PythonNamer(("self", "skipped"))
        super().__init__(executable, writer.scope, values, writer.scope, namer)

    def method(self, is_alone: bool) -> list[str]:
        """The whole method; a message without data that stands for nothing else is handed to it."""
        for path in self.paths:
            name = self._namer.name("_".join(["value", *map(str, path)]))
            type_ = self._values.received_type(path)
            self.received[path] = place(name, type_, received_unknown(type_, path, is_event=True))
        self._copy_what_is_overwritten()
        body = self._components()
        copied = [Let(copy, variable(f"self.{attribute}")) for attribute, copy in self.copies.items()]
        skipped = [Let(_SKIPPED, constant(()))] if self.may_skip else []
        result = Return(_SKIPPED if self.may_skip else constant(()))
        body = [*self._refusals(), *self._plant(), *copied, *skipped, *body, result]
        name, parameters = self.writer.layout.methods["step", self.event], [*self.received.values()]
        if self.may_skip:
            self.writer.skipping.add(self.event)
        elif is_alone and not self.paths:
            self.writer.whole.add(self.event)
            parameters = [variable("data=None")]
        return method(name, f"Take {self.event}.", body, parameters)

    def _copy_what_is_overwritten(self) -> None:
        """Find attributes that are read after a place that may write them; a superset is fine."""
        layout = self.writer.layout
        written: set[str] = set()
        overwritten: dict[str, None] = {}
        for participant in self._executable.participants:
            in_block: set[str] = set()
            for _, transition in participant.branches:
                for update in transition.updates:
                    for attribute in self._reads(update.expression):
                        if attribute in written or attribute in in_block:
                            overwritten[attribute] = None
                    in_block.add(layout.variables[participant.component, update.variable][0])
                if transition.target is not None:
                    in_block.add(layout.locations[participant.component])
            written |= in_block
        for attribute in overwritten:
            self.copies[attribute] = variable(self._namer.name(f"old_{attribute}"))

    def _reads(self, expression: Expression) -> Iterator[str]:
        layout = self.writer.layout
        for leaf in leaves(expression):
            match leaf:
                case VariableRead(component=component, variable=name):
                    yield layout.variables[component, name][0]
                case StateTest(component=component) if component in layout.locations:
                    yield layout.locations[component]

    def _variable(self, component: str, name: str) -> tuple[str, Type]:
        attribute, type_ = self.writer.layout.variables[component, name]
        return self.copies[attribute].word if attribute in self.copies else f"self.{attribute}", type_

    def _location(self, automaton: str) -> str:
        copy = self.copies.get(self.writer.layout.locations.get(automaton, ""))
        return self.writer.scope.location(automaton) if copy is None else copy.word

    def _write(self, place: Code, value: Code, may_stay: bool) -> list[Statement]:
        if may_stay:
            return noted_write(place, value, self.writer.marks)
        return [Assign(place, value), *noted_change(place, self.writer.marks)]

    def _choice(self, branches: Sequence[tuple[Code, Block]], is_whole: bool) -> Block:
        if not is_whole:
            return [If(branches)] if branches else []
        *tested, (_, rest) = branches
        return [If(tested, rest)] if tested else rest

    def _is_at_hand(self, type_: Type, value: Code) -> bool:
        is_local = value in self.copies.values() or value in self.received.values()
        return value.is_known and (is_local or value in (TRUE_CODE, FALSE_CODE))

    def _unless_skipped(self, name: str, type_: Type, held: Code, written: Block) -> Block:
        if held.is_known:
            return written
        self.may_skip = True
        skip = Assign(_SKIPPED, constant((name,)), "+")
        return [If([(operation("is None", held), [skip])], written)]

    def _assigned(self, type_: Type, value: Code) -> Code:
        match type_:
            case DoubleType() if not value.is_known:
                return self._checked("assignable_double", value)
            case DoubleType():
                return call("float", value) if value.sort is Sort.INTEGER else value
            case IntegerType():
                low, high = bounds_of(type_)
                is_within = value.is_within(low, high)
                return value if is_within else self._checked("assignable_integer", value, integer(low), integer(high))
            case _:
                return value

    def _checked(self, function: str, *arguments: Code) -> Code:
        self.writer.used.add(function)
        return call(function, *arguments, unknown=Unknown.VALUE)
