"""A Promela model of a controlled system, for the model checker spin (G. J. Holzmann, "The SPIN Model Checker", 2003).

One process takes one event after the other. An atomic step chooses an event whose guard is true, its data, and an edge
for every automaton. New values are written together at the end, so that all updates read the old state. The
supervisor's conditions are bits that each step computes for the next one from the decision diagrams, because an
expression cannot share its parts. Auxiliary variables are 0 again at the end of a step, so the states that spin stores
are exactly those of the controlled system.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from robosc.automata.compile import Path, paths_read
from robosc.automata.state import Subject, initial_values, subject_domain, subject_type, subjects
from robosc.automata.structure import Automaton, Edge, Event, EventCondition, InputVariable, System
from robosc.errors import UnsupportedModelError
from robosc.expressions import BooleanType, IntegerType, Type, Value, domain
from robosc.supervisor import AddedCondition, DecisionNode
from robosc.supervisor.diagram import evaluate
from robosc.targets.promela.expressions import TRUE, Datum, Translator, all_of, any_of, index_of, integer_text, negated
from robosc.targets.promela.names import Names


def promela_model(system: System, added: Sequence[AddedCondition]) -> str:
    """Return the text of the model.

    Args:
        system: Plants and event conditions.
        added: Conditions that the supervisor adds.

    Raises:
        UnsupportedModelError: A condition becomes too large, or a controllable event carries data.
    """
    return "\n".join(_Writer(system, added).lines()) + "\n"


@dataclass(frozen=True, slots=True)
class _Choice:
    """A number that the environment chooses.

    Attributes:
        name: Name of what holds it.
        low: The least one.
        high: The greatest one.
    """

    name: str
    low: int
    high: int


class _Writer:
    """Writes one model."""

    def __init__(self, system: System, added: Sequence[AddedCondition]) -> None:
        self._system = system
        self._added = added
        self._names = Names(system)
        self._translator = Translator(system, self._names)
        self._initial = {
            subject: values[0] for subject, values in zip(subjects(system), initial_values(system), strict=True)
        }
        self._next = {subject: self._names.new(f"next_{name}") for subject, name in self._names.places.items()}
        self._allow = {item.event: self._names.new(f"allow_{item.event}") for item in added}
        self._used_next: dict[str, None] = {}
        self._used_data: dict[str, None] = {}

    def lines(self) -> Iterator[str]:
        """The lines of the model."""
        options = [line for event in self._system.events for line in self._option(event)]
        nodes, supervise = self._supervise()
        yield from self._constants()
        yield ""
        yield "/* The state: where each automaton is, and the variables. */"
        yield from self._state()
        if self._added:
            yield "/* Events that the supervisor allows in this state. */"
            initial = {item.event: int(evaluate(item.condition, self._read_initial)) for item in self._added}
            yield from (f"bit {name} = {initial[event]};" for event, name in self._allow.items())
        if self._used_next or self._used_data or nodes:
            yield ""
            yield "/* For the time of one step. */"
            yield from (f"int {name};" for name in (*self._used_data, *self._used_next))
            yield from (f"bit {name};" for name in nodes)
        yield ""
        yield "active proctype controlled_system() {"
        yield "end:"
        yield "  do"
        yield "  :: atomic {"
        yield "       if"
        yield from (f"       {line}" for line in options or [":: false"])
        yield "       fi;"
        yield from (f"       {line}" for line in supervise or ["skip"])
        yield "     }"
        yield "  od"
        yield "}"

    # Declarations

    def _constants(self) -> Iterator[str]:
        for automaton in self._system.automata:
            for place, location in enumerate(automaton.locations):
                name = self._names.locations[automaton.name, location]
                at = self._names.places.get(Subject(automaton.name))
                yield f"#define {name} {'true' if at is None else f'({at} == {place})'}"
        yield ""
        yield from (f"#define {name} {number}" for name, number in self._names.numbers.items())

    def _state(self) -> Iterator[str]:
        for subject, name in self._names.places.items():
            values, initial = subject_domain(self._system, subject), self._initial[subject]
            if subject.variable is None:
                low, high, start = 0, len(values) - 1, values.index(initial)  # type: ignore[arg-type]  # a name
            else:
                low, high = _range(subject_type(self._system, subject))
                start = self._index(subject, initial)
            yield f"{_promela_type(low, high)} {name} = {integer_text(start)};"

    def _index(self, subject: Subject, value: Value) -> int:
        return index_of(value, subject_type(self._system, subject))

    def _read_initial(self, automaton: str, variable: str | None) -> int:
        """The index of a place's initial value in its domain."""
        subject = Subject(automaton, variable)
        values = subject_domain(self._system, subject)
        return values.index(self._initial[subject])  # type: ignore[arg-type]  # a value of the domain

    # Steps

    def _option(self, event: Event) -> Iterator[str]:
        """Yield the lines of what happens at one event, as an option of the selection."""
        participants = [item for item in self._system.automata if event.name in item.alphabet]
        # An event in no alphabet belongs to no plant, so it cannot happen.
        if not participants:
            return
        edges = {item.name: [edge for edge in item.edges if edge.event == event.name] for item in participants}
        choices, data = self._data(event, [edge for found in edges.values() for edge in found])
        translator = Translator(self._system, self._names, data)
        guards = [any_of([self._edge_condition(edge, item) for edge in edges[item.name]]) for item in participants]
        guards += [self._translator.condition(c.condition) for c in self._conditions(event)]
        if event.is_controllable:
            guards += [
                guard for item in participants for edge in edges[item.name] for guard in self._in_range(edge, item)
            ]
        if event.name in self._allow:
            guards.append(self._allow[event.name])
        yield f"/* {event.name} */"
        yield f":: {all_of(guards)} ->"
        for choice in choices:
            # Spin's select takes no negative numbers.
            yield f"     select ({choice.name} : 0 .. {choice.high - choice.low});"
            if choice.low:
                yield f"     {choice.name} = {choice.name} + {integer_text(choice.low)};"
        written: dict[Subject, str] = {}
        for item in participants:
            yield from (f"     {line}" for line in self._selection(event, item, edges[item.name], translator, written))
        yield from (f"     {line}" for line in self._commit(written, choices))

    def _conditions(self, event: Event) -> Iterator[EventCondition]:
        """The event's conditions; those on an uncontrollable one do not keep it from happening."""
        if event.is_controllable:
            yield from (item for item in self._system.conditions if item.event == event.name)

    def _edge_condition(self, edge: Edge, automaton: Automaton) -> str:
        """Return the condition that an edge can be taken."""
        location = self._names.locations[automaton.name, edge.source]
        place = "true" if Subject(automaton.name) not in self._names.places else location
        return all_of([place, self._translator.condition(edge.guard)])

    def _in_range(self, edge: Edge, automaton: Automaton) -> Iterator[str]:
        """Yield the conditions that an edge, if it is taken, keeps every variable that it writes in its range."""
        for update in edge.updates:
            type_ = subject_type(self._system, Subject(automaton.name, update.variable))
            number = self._translator.value(update.expression, type_)
            outside = _outside(number.text, number.low, number.high, type_)
            if outside != "false":
                leaves = all_of([self._edge_condition(edge, automaton), number.known, outside])
                yield negated(leaves)

    def _data(self, event: Event, edges: Sequence[Edge]) -> tuple[list[_Choice], dict[Path, Datum]]:
        """Return the choices of the environment at an event, and the received data that these make."""
        paths = {path for edge in edges for update in edge.updates for path in paths_read(update.expression)}
        inputs = [item for item in self._system.inputs if item.event == event.name and item.path in paths]
        if inputs and event.is_controllable:
            raise UnsupportedModelError(f"the promela target has no data that comes with {event.name}, a request")
        lengths: dict[Path, tuple[str, int]] = {}
        for item in inputs:
            for array, index in _arrays(item):
                name = lengths[array][0] if array in lengths else f"length_{len(lengths)}"
                lengths[array] = (name, max(index + 1, lengths.get(array, ("", 0))[1]))
        data: dict[Path, Datum] = {}
        choices = [_Choice(name, 0, longest) for name, longest in lengths.values()]
        for number, item in enumerate(inputs):
            name = f"data_{number}"
            known = [f"({lengths[array][0]} > {index})" for array, index in _arrays(item)]
            data[item.path] = Datum(name, all_of(known), item.type)
            choices.append(_Choice(name, *_range(item.type)))
        self._used_data |= dict.fromkeys(choice.name for choice in choices)
        return choices, data

    def _selection(
        self,
        event: Event,
        automaton: Automaton,
        edges: Sequence[Edge],
        translator: Translator,
        written: dict[Subject, str],
    ) -> Iterator[str]:
        """An automaton takes one of its edges; what they write is added to `written`."""
        idle: list[str] = []
        options: list[tuple[str, list[str]]] = []
        targets: dict[Subject, str] = {}
        for edge in edges:
            writes = list(self._writes(event, automaton, edge, translator))
            if not writes:
                idle.append(self._edge_condition(edge, automaton))
                continue
            targets |= {subject: self._next[subject] for subject, _ in writes}
            statements = [line for _, lines in writes for line in lines]
            options.append((self._edge_condition(edge, automaton), statements))
        if not options:
            return
        written |= targets
        self._used_next |= dict.fromkeys(targets.values())
        if len(options) == 1 and not idle:
            yield from options[0][1]
            return
        yield from (f"{name} = {self._names.places[subject]};" for subject, name in targets.items())
        yield "if"
        for taken, statements in options:
            yield f":: {taken} ->"
            yield from (f"     {line}" for line in statements)
        if idle:
            yield f":: {any_of(idle)} -> skip"
        yield "fi;"

    def _writes(
        self, event: Event, automaton: Automaton, edge: Edge, translator: Translator
    ) -> Iterator[tuple[Subject, list[str]]]:
        """Yield the changes of an edge: each place with the statements that set its next value."""
        if edge.target != edge.source:
            subject = Subject(automaton.name)
            yield subject, [f"{self._next[subject]} = {automaton.locations.index(edge.target)};"]
        for update in edge.updates:
            subject = Subject(automaton.name, update.variable)
            type_, name = subject_type(self._system, subject), self._next[subject]
            number = translator.value(update.expression, type_)
            text = number.text
            if number.known != TRUE:
                text = f"({number.known} -> {text} : {self._names.places[subject]})"
            lines = [f"{name} = {text};"]
            outside = _outside(name, number.low, number.high, type_)
            if outside != "false" and not event.is_controllable:
                lines.append(f"assert({negated(outside)});")
            yield subject, lines

    def _commit(self, written: Mapping[Subject, str], choices: Sequence[_Choice]) -> Iterator[str]:
        """Put in place what is written, and forget what was only needed for the step."""
        lines = [f"{self._names.places[subject]} = {name};" for subject, name in written.items()]
        lines += [f"{name} = 0;" for name in (*written.values(), *(choice.name for choice in choices))]
        if not lines:
            yield "skip"
            return
        yield "d_step {"
        yield from (f"  {line}" for line in lines)
        yield "}"

    # The supervisor

    def _supervise(self) -> tuple[list[str], list[str]]:
        """Names of the bits for the nodes of all diagrams, and the statements that work out what is allowed."""
        names: list[str] = []
        lines: list[str] = []
        for item in self._added:
            built = ["0", "1"]
            for node in item.condition.nodes:
                name = f"node_{len(names)}"
                names.append(name)
                lines.append(f"  {name} = {self._branches(node, built)};")
                built.append(name)
            lines.append(f"  {self._allow[item.event]} = {built[item.condition.root]};")
        if not lines:
            return [], []
        return names, ["d_step {", *lines, *(f"  {name} = 0;" for name in names), "}"]

    def _branches(self, node: DecisionNode, built: Sequence[str]) -> str:
        """Return the expression of the node that follows a decision, by the index of what it tests."""
        subject = Subject(node.automaton, node.variable)
        name = self._names.places.get(subject, "0")
        low = 0 if node.variable is None else _range(subject_type(self._system, subject))[0]
        text = built[node.children[0]]
        for start, child in zip(node.starts[1:], node.children[1:], strict=True):
            text = f"({name} >= {integer_text(low + start)} -> {built[child]} : {text})"
        return text


def _arrays(item: InputVariable) -> tuple[tuple[Path, int], ...]:
    """The arrays that a received datum may be missing from, with its index in each; what is in none counts as one."""
    if not item.may_be_unknown:
        return ()
    found = tuple((item.path[:place], step) for place, step in enumerate(item.path) if isinstance(step, int))
    return found or ((item.path, 0),)


def _range(type_: Type) -> tuple[int, int]:
    """The least and the greatest number that stands for a value of a type."""
    match type_:
        case IntegerType(low=int(low), high=int(high)):
            return low, high
        case BooleanType():
            return 0, 1
        case _:
            return 0, len(domain(type_)) - 1


def _outside(text: str, low: int, high: int, type_: Type) -> str:
    """Return the condition that a number between two bounds is out of a type's range; `false` where it never is."""
    if not isinstance(type_, IntegerType):
        return "false"
    least, most = _range(type_)
    below = [f"{text} < {integer_text(least)}"] if low < least else []
    above = [f"{text} > {integer_text(most)}"] if high > most else []
    found = [f"({item})" for item in (*below, *above)]
    return any_of(found)


def _promela_type(low: int, high: int) -> str:
    for name, least, most in (("bit", 0, 1), ("byte", 0, 255), ("short", -(2**15), 2**15 - 1)):
        if least <= low and high <= most:
            return name
    return "int"
