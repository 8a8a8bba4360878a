"""Edges of CIF's automata, and the values that channels carry from one edge to another.

Over a channel one automaton sends and one receives, at the same time; others may take part without either. The value
that is received is that of the edge that sends: a choice between all such edges, by their locations and guards. Of
several automata that send, the others stay as they are. So in every state at most one of them may be able to.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import combinations, product
from math import prod

import msgspec

from robosc.automata import Assignment, Automaton, Edge
from robosc.cif import syntax
from robosc.cif.scopes import Entity, Scope, Scopes, allows
from robosc.cif.terms import Term, broken, flat, logic
from robosc.cif.types import CifType, fits, is_equal
from robosc.cif.typing import NAMELESS, Typing
from robosc.cif.updates import Updates
from robosc.cif.usage import Usage
from robosc.expressions import FALSE, Binary, Expression, StateTest, Value, VariableRead, conjunction, domain, leaves
from robosc.expressions.evaluate import evaluate

MAXIMUM_STATES = 20_000
"""Combinations of values that are tried to find out whether two edges can send at once."""


def event_of(scopes: Scopes, name: syntax.Name, scope: Scope) -> Entity | None:
    """The event that a name means; None if it means none, which has been reported."""
    found = scopes.resolve(name, scope)
    if found is None:
        return None
    if isinstance(found, Entity) and isinstance(found.declaration, syntax.Event):
        return found
    scopes.wrong_kind(name, found, "an event")
    return None


def data_type(typing: Typing, name: syntax.Name, event: Entity, scope: Scope) -> CifType | None:
    """The type of an event's data, as the name of it says; None if it has none."""
    parameter, around = typing.scopes.parameter(name, scope)
    assert isinstance(event.declaration, syntax.Event)  # noqa: S101 - the entity of an event
    data = event.declaration.data if parameter is None else parameter.type
    return None if data is None else typing.type(data, around or event.scope)


def place_name(place: syntax.LocationDeclaration) -> str:
    """Name of a location in the automata."""
    return NAMELESS if place.name is None else place.name.text


class _End(msgspec.Struct, frozen=True):
    """An edge that sends over a channel, or receives."""

    scope: Scope
    place: syntax.LocationDeclaration
    edge: syntax.Edge
    event: syntax.EdgeEvent

    def condition(self, typing: Typing) -> Term:
        """The term that is true where the edge is enabled."""
        here = typing.location(self.scope, self.place)
        return logic("and", here, typing.conjunction(self.edge.guards, self.scope))

    def value(self, typing: Typing, type_: CifType) -> Term:
        """The value that it sends, of the channel's type."""
        assert self.event.value is not None  # noqa: S101 - asked of channels with data
        return typing.sent(self.event.value, self.scope, type_)


class Channels(msgspec.Struct):
    """Channels, with what sends over them and what receives from them.

    Attributes:
        ends: Edges that send (`!`) or receive (`?`), of each channel.
    """

    ends: dict[Entity, dict[str, list[_End]]] = msgspec.field(default_factory=dict)
    values: dict[Entity, Term] = msgspec.field(default_factory=dict)

    def gather(self, usage: Usage) -> None:
        """Find all ends of all channels."""
        for scope in usage.scopes.scopes():
            places = [item for item in scope.body if isinstance(item, syntax.LocationDeclaration)]
            edges = [(place, edge) for place in places for edge in place.edges if scope.is_real]
            for place, edge, event in ((*pair, event) for pair in edges for event in pair[1].events):
                entity = event_of(usage.scopes, event.name, scope) if event.use and event.name else None
                if entity is not None:
                    ends = self.ends.setdefault(entity, {"!": [], "?": []})
                    ends[event.use].append(_End(scope, place, edge, event))

    def sends(self, event: Entity) -> list[_End]:
        """The edges that send a value over a channel."""
        return [end for end in self.ends.get(event, {"!": []})["!"] if end.event.value is not None]

    def received(self, typing: Typing, event: Entity, type_: CifType) -> Term:
        """The value that is received from a channel."""
        sends = self.sends(event)
        if type_.kind == "void" or not sends:
            return broken(type_)
        if event not in self.values:
            conditions = [end.condition(typing) for end in sends[:-1]]
            self.values[event] = typing.first(conditions, [end.value(typing, type_) for end in sends], type_)
        return self.values[event]

    def settle(self, usage: Usage, automata: list[Automaton]) -> list[Entity]:
        """The channels of which nobody has one end; of the others, let one of several automata send, and one receive.

        What synthesis does not take is reported: who takes part, and what is sent, must follow from the state.
        """
        used = {event for automaton in automata for event in automaton.alphabet}
        found = []
        for event in _events(usage.scopes):
            assert isinstance(event.declaration, syntax.Event)  # noqa: S101 - one of the events
            if event.declaration.data is None:
                continue
            ends = self.ends.get(event, {"!": [], "?": []})
            self._check_ends(usage, event, ends)
            if event.name in used and not (ends["!"] and ends["?"]):
                found.append(event)
            # Expressions of what has errors are none that could be tried.
            if not usage.typing.findings.has_errors:
                self._check_choices(usage, event, ends, automata)
            for items in ends.values() if not usage.typing.findings.has_errors else ():
                _let_wait(usage.typing, event.name, items, automata)
        return found

    def _check_ends(self, usage: Usage, event: Entity, ends: Mapping[str, list[_End]]) -> None:
        for end in (*ends["!"], *ends["?"]):
            if end.scope.role != "plant":
                usage.unsupported(end.scope, f"'{end.scope.path}' is no plant, and has an end of a channel",
                                  end.event.at, "Let plants alone send and receive.")  # fmt: skip
        for end in ends["?"]:
            if any(other.scope is end.scope for other in ends["!"]):
                usage.error("cif-structure", f"'{end.scope.path}' sends over '{event.name}' and receives from it",
                            end.event.at, "Let another automaton do either.")  # fmt: skip

    def _check_choices(
        self, usage: Usage, event: Entity, ends: Mapping[str, list[_End]], automata: Sequence[Automaton]
    ) -> None:
        """Report that it depends on more than the state who takes part, or what is sent."""
        assert isinstance(event.declaration, syntax.Event)  # noqa: S101 - one of the events
        data, typing = event.declaration.data, usage.typing
        type_ = CifType("void") if data is None else typing.type(data, event.scope)
        values = {}
        for end in self.sends(event):
            values[id(end)] = [part.core for part in flat(end.value(typing, type_))]
        for one, other in (pair for items in ends.values() for pair in combinations(items, 2)):
            conditions = [end.condition(typing) for end in (one, other)]
            is_same = one.scope is other.scope and values.get(id(one)) == values.get(id(other))
            if is_same or not all(term.is_usable for term in conditions):
                continue
            if may_hold(conjunction(*(term.core for term in conditions)), automata):
                what = "automaton" if one.scope is not other.scope else "value"
                usage.error("cif-unsupported", f"more than one {what} may take part in '{event.name}' at once",
                            other.event.at, "Let the guards of the edges exclude each other.")  # fmt: skip


def _let_wait(typing: Typing, event: str, ends: list[_End], automata: list[Automaton]) -> None:
    """Let each of several automata of one end of a channel stay as it is while another one takes part."""
    scopes = list(dict.fromkeys(end.scope for end in ends))
    for scope in scopes if len(scopes) > 1 else ():
        others = [end.condition(typing).core for end in ends if end.scope is not scope]
        guard = others[0]
        for other in others[1:]:
            guard = Binary("or", guard, other)
        place = next(place for place, automaton in enumerate(automata) if automaton.name == scope.path)
        waits = tuple(Edge(location, event, location, guard) for location in automata[place].locations)
        automata[place] = replace(automata[place], edges=(*automata[place].edges, *waits))


def _events(scopes: Scopes) -> Iterator[Entity]:
    for scope in scopes.scopes():
        if scope.is_real:
            for item in scope.entries.values():
                if isinstance(item, Entity) and isinstance(item.declaration, syntax.Event) and item.scope is scope:
                    yield item


def may_hold(condition: Expression, automata: Sequence[Automaton]) -> bool:
    """Return False if a condition is false in every state, as far as all states can be tried."""
    if condition == FALSE:
        return False
    by_name = {automaton.name: automaton for automaton in automata}
    columns: dict[tuple[str, str | None], list[Value]] = {}
    for leaf in leaves(condition):
        if isinstance(leaf, VariableRead):
            types = {variable.name: variable.type for variable in by_name[leaf.component].variables}
            columns[leaf.component, leaf.variable] = list(domain(types[leaf.variable]))
        elif isinstance(leaf, StateTest):
            columns[leaf.component, None] = list(by_name[leaf.component].locations)
    if prod(map(len, columns.values())) > MAXIMUM_STATES:
        return True
    return any(_holds(condition, dict(zip(columns, row, strict=True))) for row in product(*columns.values()))


def _holds(condition: Expression, state: Mapping[tuple[str, str | None], Value]) -> bool:
    return evaluate(condition, lambda a, v: state[a, v], lambda a: str(state[a, None])) is True


class Edges:
    """Reader of the edges of an automaton.

    Args:
        usage: User of expressions.
        scope: The automaton.
        channels: Senders and receivers of channels.

    Attributes:
        channels: Names of the channels of which the automaton is an end.
        events: Names of the other events.
    """

    def __init__(self, usage: Usage, scope: Scope, channels: Channels) -> None:
        self.channels: set[str] = set()
        self.events: set[str] = set()
        self._usage, self._scope, self._channels = usage, scope, channels

    def read(self, item: syntax.Edge, place: syntax.LocationDeclaration) -> list[Edge]:
        """The edges of an edge: one for each of its events."""
        usage, scope, typing = self._usage, self._scope, self._usage.typing
        at = item.guards[0].at if item.guards else item.at
        guard = usage.used_by(scope.role, typing.conjunction(item.guards, scope), scope, at)
        uses = [self._use(event) for event in item.events]
        self._check_receives(item.events, uses)
        target = self._target(item, place)
        if not item.events:
            self._updates(item, is_used=True)
            usage.unsupported(scope, "this edge has no event, which means 'tau'", item.at, "Give it an event.")
        found = []
        for event, (entity, type_) in zip(item.events, uses, strict=True):
            if event.use == "?" and entity is not None and type_ is not None:
                typing.received = self._channels.received(typing, entity, type_)
            # A value that is never sent is never received, and there is none.
            is_used = event.use != "?" or entity is None or typing.received is None or (
                typing.received.type.kind == "void" or bool(self._channels.sends(entity))
            )  # fmt: skip
            updates = self._updates(item, is_used=is_used)
            typing.received = None
            if event.name is None:
                usage.unsupported(scope, "this edge has the event 'tau'", event.at, "Give it an event of its own.")
            elif entity is not None:
                found.append(Edge(place_name(place), entity.name, target, guard, updates))
                (self.channels if event.use else self.events).add(entity.name)
        return found

    def _updates(self, item: syntax.Edge, *, is_used: bool) -> tuple[Assignment, ...]:
        usage, scope = self._usage, self._scope
        assigned = Updates(usage.typing).assigned(item.updates, scope)
        return tuple(
            Assignment(name, usage.used_by(scope.role, new.term, scope, new.at))
            for name, new in assigned.items()
            if is_used
        )

    def _use(self, event: syntax.EdgeEvent) -> tuple[Entity | None, CifType | None]:
        """The event of an edge, and the type of its data; what is sent or received is checked."""
        usage, scope, typing = self._usage, self._scope, self._usage.typing
        entity = None if event.name is None else event_of(usage.scopes, event.name, scope)
        if event.name is None or entity is None:
            return None, None
        parameter, _ = usage.scopes.parameter(event.name, scope)
        type_ = data_type(typing, event.name, entity, scope)
        if parameter is not None and not allows(parameter, event.use or "~"):
            usage.error("cif-arguments", f"the flags of the parameter '{event.name}' do not allow this use", event.at,
                        f"Add the flag '{event.use or '~'}' to it.")  # fmt: skip
        if event.use and type_ is None:
            typing.mismatch(f"'{event.name}' is no channel", event.at, "Write the event without '!' or '?'.")
        sent = None if event.value is None else typing.term(event.value, scope, type_)
        if event.use == "!" and type_ is not None and (sent is None) != (type_.kind == "void"):
            count = "no value" if sent is None else "a value"
            typing.mismatch(f"'{event.name}' is a channel of {type_}, and is sent {count}", event.at)
        elif sent is not None and type_ is not None and event.value is not None and not fits(sent.type, type_):
            typing.mismatch(f"{sent.type} does not fit {type_}", event.value.at)
        elif sent is not None and event.value is not None:
            for part in flat(sent):
                usage.used_by(scope.role, part, scope, event.value.at)
        return entity, type_

    def _check_receives(
        self, events: tuple[syntax.EdgeEvent, ...], uses: list[tuple[Entity | None, CifType | None]]
    ) -> None:
        """Report that an edge receives no value, or one of another type, with one of its events."""
        types = [type_ for event, (_, type_) in zip(events, uses, strict=True) if event.use == "?"]
        for event in events:
            if types and event.use != "?":
                self._usage.error("cif-structure", "this edge receives a value, and has an event that does not",
                                  event.at, "Give that event an edge of its own.")  # fmt: skip
        for type_ in types[1:]:
            if type_ is not None and types[0] is not None and not is_equal(type_, types[0]):
                message = f"this edge receives values of the types {types[0]} and {type_}"
                self._usage.typing.mismatch(message, events[0].at)

    def _target(self, item: syntax.Edge, place: syntax.LocationDeclaration) -> str:
        if item.target is None:
            return place_name(place)
        scope = self._scope
        entry = None if item.target.text in scope.parameters else scope.entries.get(item.target.text)
        if not isinstance(entry, Entity) or not isinstance(entry.declaration, syntax.LocationDeclaration):
            message = f"'{item.target.text}' is not a location of this automaton"
            self._usage.error("cif-unknown-name", message, item.target.at, "Write the name of one of its locations.")
        return item.target.text
