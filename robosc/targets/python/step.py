"""Generated methods that read the data of an event and take it: move and update, all at once.

All updates of a step read the state before it. The generated code writes attributes one after the
other, so whatever is read after it may have been written is first copied to a local variable.
"""

from collections.abc import Iterator, Sequence

from robosc.expressions import (
    ArrayType,
    DoubleType,
    Expression,
    IntegerType,
    PathStep,
    StateTest,
    Type,
    VariableRead,
    leaves,
)
from robosc.expressions.text import expression_text
from robosc.model.received import Path, converted_paths
from robosc.model.structure import Update, Variable
from robosc.targets.code.expressions import (
    FALSE_CODE,
    TRUE_CODE,
    Code,
    Kind,
    Sort,
    Unknown,
    bounds_of,
    call,
    integer,
    literal,
    place,
)
from robosc.targets.code.steps import Branch, StepWriter
from robosc.targets.code.text import indent
from robosc.targets.paths import path_text, path_type
from robosc.targets.python.changes import noted_change, noted_write
from robosc.targets.python.expressions import Scope, code_text
from robosc.targets.python.naming import PythonNamer
from robosc.targets.python.received import Reader, reader_namer, received_unknown
from robosc.targets.python.text import comment, docstring
from robosc.targets.python.writer import Writer


def read_method(writer: Writer, event: str) -> list[str]:
    """The method that converts what came with an uncontrollable event."""
    paths = converted_paths(writer.model, event)
    head = [f"def {writer.layout.methods['read', event]}(self, data):"]
    if not paths:
        return [*head, f"    {docstring(f'{event}: nothing of its data is converted.')}", "    return NO_DATA"]
    reader = Reader(writer.layout, _event_type(writer, event), writer.used)
    codes = [reader.read(path) for path in paths]
    entries = ", ".join(f"{path_text(path)!r}: {reader.seen(path)}" for path in paths if not _is_array(reader, path))
    values = "".join(f"{code.word}, " for code in codes).strip()
    return [
        *head,
        f"    {docstring(f'Convert the data of {event}.')}",
        *indent(reader.take_lines()),
        f"    return Reading(({values}), {{{entries}}}, {reader.all_words}, {reader.all_flags})",
    ]


def receive_method(writer: Writer, identifier: str, batch: tuple[str, ...]) -> list[str]:
    """Return the method that takes all events of a message that came, if nothing of its data is unknown.

    Args:
        writer: The writer, after the step methods of these events.
        identifier: Identifier on which it comes.
        batch: The events, in source order.
    """
    namer = reader_namer()
    statements: list[str] = []
    words: list[str] = []
    steps: list[str] = []
    for event in batch:
        paths = converted_paths(writer.model, event)
        values = ""
        if paths:
            reader = Reader(writer.layout, _event_type(writer, event), writer.used, namer=namer)
            values = ", ".join(reader.read(path).word for path in paths)
            statements += reader.take_lines()
            words += reader.words
        step = f"self.{writer.layout.methods['step', event]}({values})"
        if event in writer.skipping:
            steps += [f"found = {step}", "if found:", f"    skipped += (({event!r}, found),)"]
        else:
            steps.append(step)
    if writer.skipping.isdisjoint(batch):
        steps.append("return ()")
    else:
        steps = ["skipped = ()", *steps, "return skipped"]
    title = f"Convert what came on {identifier}, and take {', '.join(batch)}."
    refusal = [f"if {' or '.join(words)}:", "    return None"] if words else []
    return [
        f"def {writer.layout.methods['receive', identifier]}(self, data):",
        f"    {docstring(title)}",
        *indent([*statements, *refusal, *steps]),
    ]


def _is_array(reader: Reader, path: Path) -> bool:
    """Return True if a path leads to an array: those can be long, so they are not logged."""
    return isinstance(reader.type_at(path), ArrayType)


def _event_type(writer: Writer, event: str) -> Type:
    type_ = writer.layout.executable.events[event].received
    assert type_ is not None  # noqa: S101  # There are paths only where data comes.
    return type_


def step_method(writer: Writer, event: str) -> list[str]:
    """The method that takes an event; it returns the skipped updates, or None if it cannot happen now."""
    step = _StepWriter(writer, event)
    lines = step.method()
    if step.may_skip:
        writer.skipping.add(event)
    return lines


class _StepWriter(StepWriter):
    """Writes the step method of one event."""

    def __init__(self, writer: Writer, event: str) -> None:
        super().__init__(writer.layout.executable.events[event], writer.scope)
        self.writer = writer
        self.event = event
        self.namer = PythonNamer(("self", "skipped"))
        self.paths = converted_paths(writer.model, event)
        self.received: dict[Path, Code] = {}
        self.copies: dict[str, str] = {}
        self.may_skip = False
        root = _event_type(writer, event) if self.paths else None
        self.scope = Scope(writer.used.add, writer.model, self._variable, self._location, self._received, root)

    def method(self) -> list[str]:
        """The whole method."""
        self._name_received()
        self._copy_what_is_overwritten()
        body = self._components()
        parameters = "".join(f", {code.word}" for code in self.received.values())
        lines = [f"def {self.writer.layout.methods['step', self.event]}(self{parameters}):"]
        lines.append(f"    {docstring(f'Take {self.event}.')}")
        lines += indent([*self._refusals(), *self._plant(), *self._copied()])
        if self.may_skip:
            lines.append("    skipped = ()")
        return [*lines, *indent(body), f"    return {'skipped' if self.may_skip else '()'}"]

    def _name_received(self) -> None:
        if not self.paths:
            return
        root = _event_type(self.writer, self.event)
        for path in self.paths:
            name = self.namer.name("_".join(["value", *map(str, path)]))
            type_ = path_type(self.writer.model, root, path)
            self.received[path] = place(name, type_, received_unknown(type_, path))

    def _refuse_outside(self, automaton: str, locations: tuple[str, ...]) -> list[str]:
        test = f"!= {locations[0]!r}" if len(locations) == 1 else f"not in {locations!r}"
        return [f"if {self.writer.scope.location(automaton)} {test}:", "    return None"]

    def _refuse_unless(self, words: str, condition: Code) -> list[str]:
        return [*comment(words), f"if {code_text(self.scope.negated(condition))}:", "    return None"]

    def _move(self, automaton: str, sources: tuple[str, ...], target: str) -> list[str]:
        location = self.writer.scope.location(automaton)
        if target in sources:
            return noted_write(location, literal(repr(target), Sort.ENUM), self.writer.stale)
        return [f"{location} = {target!r}", *noted_change(location, self.writer.stale)]

    def _copy_what_is_overwritten(self) -> None:
        """Find attributes that are read after a place that may write them; a superset is fine."""
        written: set[str] = set()
        overwritten: dict[str, None] = {}
        for participant in self._executable.participants:
            component = participant.component
            location = self.writer.scope.location(component)
            in_block: set[str] = set()
            for _, transition in participant.branches:
                for update in transition.updates:
                    for text in self._reads(update.expression):
                        if text in written or text in in_block:
                            overwritten[text] = None
                    in_block.add(self.writer.scope.variable(component, update.variable)[0])
                if transition.target is not None:
                    in_block.add(location)
            written |= in_block
        for text in overwritten:
            self.copies[text] = self.namer.name(f"old_{text.removeprefix('self.')}")

    def _reads(self, expression: Expression) -> Iterator[str]:
        for leaf in leaves(expression):
            match leaf:
                case VariableRead(component=component, variable=variable):
                    yield self.writer.scope.variable(component, variable)[0]
                case StateTest(component=component):
                    yield self.writer.scope.location(component)

    def _copied(self) -> list[str]:
        return [f"{copy} = {text}" for text, copy in self.copies.items()]

    def _variable(self, component: str, variable: str) -> tuple[str, Type]:
        text, type_ = self.writer.scope.variable(component, variable)
        return self.copies.get(text, text), type_

    def _location(self, automaton: str) -> str:
        text = self.writer.scope.location(automaton)
        return self.copies.get(text, text)

    def _received(self, path: tuple[PathStep, ...]) -> Code:
        return self.received[path]

    def _choice(self, component: str, branches: Sequence[Branch], states: int) -> list[str]:
        lines: list[str] = []
        location = self.writer.scope.location(component)
        tested = 0
        for inside, body in branches:
            if len(inside) == states:
                lines += body
            elif tested + len(inside) == states:
                lines += ["else:", *indent(body)]
            else:
                test = f"== {inside[0]!r}" if len(inside) == 1 else f"in {inside!r}"
                lines += [f"{'elif' if tested else 'if'} {location} {test}:", *indent(body)]
                tested += len(inside)
        return lines

    def _update(self, component: str, variable: Variable, update: Update) -> list[str]:
        attribute, _ = self.writer.scope.variable(component, variable.name)
        code = self._assigned(variable.type, self.scope.value(update.expression))
        lines = comment(f"{component}: do {variable.name} := {expression_text(update.expression)}")
        if not (code.is_known and self._is_at_hand(code)):
            new = code.held_in(self.namer.name(f"new_{variable.name}"))
            lines.append(f"{new.word} = {code_text(code)}")
            code = new
        written = noted_write(attribute, code, self.writer.stale)
        if code.is_known:
            return [*lines, *written]
        self.may_skip = True
        skipped = f"{component}.{variable.name}"
        return [*lines, f"if {code.word} is None:", f"    skipped += ({skipped!r},)", "else:", *indent(written)]

    def _is_at_hand(self, code: Code) -> bool:
        """Return True if a value is a local variable or a truth value."""
        is_local = code.word in self.copies.values() or code in self.received.values()
        return code in (TRUE_CODE, FALSE_CODE) or (code.kind is Kind.PLACE and is_local)

    def _assigned(self, type_: Type, code: Code) -> Code:
        """The value that a variable takes; the update is skipped where it is None."""
        match type_:
            case DoubleType() if not code.is_known:
                return self._checked("assignable_double", code)
            case DoubleType():
                return call("float", code) if code.sort is Sort.INTEGER else code
            case IntegerType():
                low, high = bounds_of(type_)
                is_within = code.is_within(low, high)
                return code if is_within else self._checked("assignable_integer", code, integer(low), integer(high))
            case _:
                return code

    def _checked(self, function: str, *arguments: Code) -> Code:
        self.writer.used.add(function)
        return call(function, *arguments, unknown=Unknown.VALUE)
