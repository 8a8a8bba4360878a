"""The generated `model.hpp`: tables of one robot, its data as JSON, and conversions between data and messages."""

import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

from robosc.automata.executable import CALLED_KINDS
from robosc.automata.plants import PLANT_LOCATIONS, communication_plant_name
from robosc.expressions import (
    ArrayType,
    BooleanType,
    DoubleType,
    EnumType,
    IntegerType,
    NoneType,
    ObjectType,
    StringType,
    Type,
)
from robosc.model.structure import Communication, CommunicationKind, EventKind
from robosc.targets.code.c.header import batch, batch_parameters
from robosc.targets.code.c.layer import request_parameters
from robosc.targets.code.c.layout import Layout, event_data, groups, request_data, sharing
from robosc.targets.code.c.provide import Field, request_field
from robosc.targets.code.c.text import comment, string_literal
from robosc.targets.code.c.unit import Unit
from robosc.targets.cpp.naming import require_field_name
from robosc.targets.ros.state_topic import state_topic
from robosc.targets.text import indent

_LITERAL = 100
"""Characters of one piece of a long literal."""

_PURPOSES = {
    CommunicationKind.INCOMING_MESSAGE: "request",
    CommunicationKind.SERVICE: "call",
    CommunicationKind.ACTION: "goal",
}
_KINDS = {BooleanType: "boolean", IntegerType: "integer", DoubleType: "double", StringType: "string"}


@dataclass
class Writer:
    """Writes the header of one robot.

    Attributes:
        unit: The C file that it belongs to.
        package: Name of the package.
    """

    unit: Unit
    package: str
    _types: dict[str, int] = field(default_factory=dict)
    _functions: list[str] = field(default_factory=list)

    @property
    def layout(self) -> Layout:
        """Names in C."""
        return self.unit.layout

    def text(self) -> str:
        """The header without what stands at the top of every file."""
        layout = self.layout
        tables = self._tables()
        states = [*self._visit_state(), *self._visit_communications(), *self._put_taken()]
        requests = [] if layout.is_layer else self._put_request()
        received = [line for number, identifier in enumerate(received_topics(layout)) for line in
                    self._receive(number, identifier)]  # fmt: skip
        answers = [line for item in layout.requests for event in answers_of(item) for line in self._take(event)]
        asked = self._asked() if layout.is_layer else [line for item in layout.requests for line in self._fill(item)]
        body = [*tables, *states, *requests, *self._functions, *received, *answers, *asked]
        head = [*_INCLUDES.splitlines(), "", f"namespace {self.package} {{", "", *_TOP.splitlines(), ""]
        return "\n".join([*head, *body, "}  // namespace model", "", f"}}  // namespace {self.package}"]) + "\n"

    # Tables.

    def _tables(self) -> list[str]:
        layout, model = self.layout, self.layout.model
        topic_of = {identifier: number for number, identifier in enumerate(received_topics(layout))}
        sensors = layout.of_kind(CommunicationKind.OUTGOING_MESSAGE)
        definition = json.dumps(state_topic(model).definition)
        pieces = [definition[place : place + _LITERAL] for place in range(0, len(definition), _LITERAL)]
        sent = list(layout.topics)
        return [
            f"inline constexpr const char* PACKAGE = {string_literal(self.package)};",
            f"inline constexpr const char* ROBOT = {string_literal(model.name)};",
            "",
            *_array("const char* const IDENTIFIERS", (string_literal(i.identifier) for i in model.communications)),
            *_array(
                "const bool IS_CONTROLLABLE",
                ("true" if event.is_issued else "false" for event in layout.executable.events.values()),
            ),
            *comment("The event of each communication's request."),
            *_array("const int REQUEST_EVENTS", (self._request_event(item) for item in model.communications)),
            *comment("Of each outgoing message the number of its topic among those that are received."),
            *_array("const int SENSOR_TOPICS", (str(topic_of[item.identifier]) for item in sensors)),
            *comment("Parts of the model that parameters may name."),
            *self._nameables("REQUESTS", [(item, self._number(item)) for item in layout.requests]),
            *self._nameables("SENSORS", [(item, self._number(item)) for item in sensors]),
            *self._nameables(
                "SENT",
                [
                    (item, str(sent.index(item.identifier)))
                    for item in layout.of_kind(CommunicationKind.INCOMING_MESSAGE)
                ],
            ),
            *comment("Description of the model on /state."),
            "inline constexpr const char* DEFINITION =",
            *(f"    {string_literal(piece)}" for piece in pieces[:-1]),
            f"    {string_literal(pieces[-1])};",
            "",
        ]

    def _number(self, item: Communication) -> str:
        return str(list(self.layout.communications).index(item.name))

    def _request_event(self, item: Communication) -> str:
        if item.kind is CommunicationKind.OUTGOING_MESSAGE:
            return "-1"
        return self.layout.events[item.event(EventKind.REQUEST)]

    def _nameables(self, name: str, items: list[tuple[Communication, str]]) -> list[str]:
        rows = [f"{{{string_literal(i.name)}, {string_literal(i.identifier)}, {number}}}," for i, number in items]
        return [f"inline const std::vector<Nameable> {name} = {{", *indent(rows), "};", ""]

    # State.

    def _visit_state(self) -> list[str]:
        layout = self.layout
        lines: list[str] = []
        for component, behaviour in layout.executable.behaviours:
            states = [state.name for state in behaviour.states]
            lines += _visited_text("component", component, states, f"state.{layout.locations[component]}")
            for variable in behaviour.variables:
                member, type_ = layout.variables[component, variable.name]
                if isinstance(type_, EnumType):
                    lines += _visited_text("variable", variable.name, type_.values, f"state.{member}")
                else:
                    lines.append(f"visitor.variable({string_literal(variable.name)}, state.{member});")
        return _function(
            f"template <class Visitor>\nvoid visit_state([[maybe_unused]] const {layout.prefix}_state_t& state, "
            "[[maybe_unused]] Visitor& visitor)",
            lines,
            comment("Pass a visitor the state of each component, and after it the value of each of its variables."),
        )

    def _visit_communications(self) -> list[str]:
        layout = self.layout
        lines: list[str] = []
        for item in layout.model.communications:
            if item.kind in CALLED_KINDS:
                place = f"state.{layout.locations[communication_plant_name(item)]}"
                lines += _visited_text("communication", item.name, PLANT_LOCATIONS[item.kind], place)
        return _function(
            f"template <class Visitor>\nvoid visit_communications("
            f"[[maybe_unused]] const {layout.prefix}_state_t& state, [[maybe_unused]] Visitor& visitor)",
            lines,
            comment("Pass a visitor the location of each service and action."),
        )

    def _put_taken(self) -> list[str]:
        layout = self.layout
        places = {name: [state.name for state in behaviour.states] for name, behaviour in layout.executable.behaviours}
        cases: list[str] = []
        for event, parts in state_topic(layout.model).transitions.items():
            if event not in layout.events:
                continue
            cases.append(f"case {layout.events[event]}:")
            for component, by_state in parts:
                numbers = ", ".join(str(by_state.get(state, -1)) for state in places[component])
                cases += [
                    "    {",
                    f"        static const int numbers[] = {{{numbers}}};",
                    f"        put_transition(out, numbers[before.{layout.locations[component]}]);",
                    "    }",
                ]
            cases.append("    break;")
        return _function(
            "inline void put_taken([[maybe_unused]] std::vector<int>& out, int event, "
            f"[[maybe_unused]] const {layout.prefix}_state_t& before)",
            ["switch (event) {", *cases, "default:", "    break;", "}"],
            comment("The numbers of the transitions that an event takes."),
        )

    # Requests.

    def _put_request(self) -> list[str]:
        cases: list[str] = []
        for item in self.layout.requests:
            found = request_field(self.unit, item)
            if found is not None:
                place = f"request.data.{self.layout.request_members[item.name]}"
                cases += [f"case {self.layout.communications[item.name]}:", "    {"]
                cases += [*indent(self._put_field(found, place), 2), "    }", "    break;"]
        return _function(
            f"inline void put_request(std::string& out, const {self.layout.prefix}_request_t& request)",
            ["switch (request.communication) {", *cases, "default:", '    out += "null";', "    break;", "}"],
            comment("The data of a request as JSON."),
        )

    def _put_field(self, found: Field, place: str) -> list[str]:
        if isinstance(found.type, ObjectType):
            is_given = _is_given(found, place)
            put = self._put_parts(found, place)
            return (
                put
                if is_given is None
                else [f"if ({is_given}) {{", *indent(put), "} else {", '    out += "null";', "}"]
            )
        return [f"if ({place}.{found.flag}) {{", f"    put_json(out, {place}.{found.value});", "} else {",
                '    out += "null";', "}"]  # fmt: skip

    def _put_parts(self, found: Field, place: str) -> list[str]:
        lines = ['out += "{";', '[[maybe_unused]] const char* between = "";']
        for name, (member, part) in found.parts.items():
            key = json.dumps(name) + ":"
            put = [f"out += std::string(between) + {string_literal(key)};", 'between = ",";']
            inner = f"{place}.{member}" if isinstance(part.type, ObjectType) else place
            if isinstance(part.type, ObjectType):
                put += ["{", *indent(self._put_parts(part, inner)), "}"]
            else:
                put.append(f"put_json(out, {place}.{member});")
            is_given = _is_given(part, inner)
            # An object may be given without a part of it.
            lines += put if is_given is None else [f"if ({is_given}) {{", *indent(put), "}"]
        return [*lines, 'out += "}";']

    def _fill(self, item: Communication) -> list[str]:
        found = request_field(self.unit, item)
        declared = item.request or NoneType()
        place = f"request.data.{self.layout.request_members[item.name]}"
        lines = self._checks(declared, "message", ())
        if found is not None:
            lines += self._assignments(found, place, ())
        return _function(
            f"template <class M>\nvoid {fill_name(self.layout, item)}("
            f"[[maybe_unused]] const {self.layout.prefix}_request_t& request, [[maybe_unused]] M& message)",
            lines,
            comment(f"The message of the request of {item.name}."),
        )

    def _checks(self, type_: Type, place: str, path: tuple[str, ...]) -> list[str]:
        """Return the checks that the message has every field that the model declares, of a fitting type."""
        if isinstance(type_, NoneType):
            return []
        if not path and not isinstance(type_, ObjectType):
            place = "basic_field(message)"
        match type_:
            case ObjectType(name=name):
                lines = []
                for part in self.layout.model.object(name).properties:
                    require_field_name(part.name)
                    lines += self._checks(part.type, f"{place}.{part.name}", (*path, part.name))
                return lines
            case ArrayType():
                return [f"(void){place}.size();"]
            case _:
                return [f"require_{_KINDS[type(type_)]}({place});"]

    def _assignments(self, found: Field, place: str, path: tuple[str, ...]) -> list[str]:
        if isinstance(found.type, ObjectType):
            lines = []
            for name, (member, part) in found.parts.items():
                if isinstance(part.type, ObjectType):
                    lines += self._assignments(part, f"{place}.{member}", (*path, name))
                else:
                    lines += self._assignment(part, place, member, (*path, name))
            return lines
        return self._assignment(found, place, found.value, path)

    def _assignment(self, found: Field, place: str, member: str, path: tuple[str, ...]) -> list[str]:
        target = ".".join(("message", *path)) if path else "basic_field(message)"
        where = string_literal(".".join(path) or "data")
        kind = _KINDS[type(found.type)]
        return [
            f"if ({place}.{found.flag}) {{",
            f"    assign_{kind}({target}, {place}.{member}, {where});",
            "}",
        ]

    # Requests of the caller, before a layer.

    def _asked(self) -> list[str]:
        kinds = (CommunicationKind.INCOMING_MESSAGE, *CALLED_KINDS)
        return [line for kind in kinds for group in groups(self.layout.model, kind) for line in self._ask(group)]

    def _ask(self, group: tuple[Communication, ...]) -> list[str]:
        """The function that takes what the caller sends on an identifier, and for an action the one for a cancel."""
        layout, first = self.layout, group[0]
        purpose = _PURPOSES[first.kind]
        is_message = first.kind is CommunicationKind.INCOMING_MESSAGE
        subject = first.identifier if is_message else first.name
        caller = "" if is_message else ", caller"
        name = ask_name(layout, first)
        lines = [line for item in group for line in self._checks(item.request or NoneType(), "message", ())]
        # The copy takes the numbers that limits move.
        lines = [*dict.fromkeys(lines), "[[maybe_unused]] Arena arena;", "M sent = message;", "what.message = &sent;"]
        parameters = request_parameters(layout, group)
        for parameter, type_ in parameters.values():
            lines += self._datum(type_, parameter)
        for item in group:
            data = request_data(item)
            if data is not None and layout.raw(data) in parameters:
                lines += self._note(item.event(EventKind.REQUEST), data, parameters[layout.raw(data)][0])
        arguments = "".join(self._argument(type_, parameter) for parameter, type_ in parameters.values())
        lines.append(f"{layout.function(purpose, subject)}(robot, now{caller}{arguments}, what);")
        found = _function(
            f"template <class M>\nvoid {name}({layout.prefix}_t* robot, std::uint64_t now, "
            f"{'' if is_message else 'std::uint32_t caller, '}const M& message, {layout.prefix}_sent_t what, "
            "[[maybe_unused]] Notes& notes)",
            lines,
            comment(f"The caller asks for {', '.join(item.name for item in group)}."),
        )
        if first.kind is CommunicationKind.ACTION:
            found += _function(
                f"inline void cancel_{name}({layout.prefix}_t* robot, std::uint64_t now, std::uint32_t caller)",
                [f"{layout.function('cancel', subject)}(robot, now, caller);"],
                comment(f"The caller cancels a goal of {', '.join(item.name for item in group)}."),
            )
        return found

    # Received.

    def _type_number(self, type_: Type) -> int:
        """The number of the functions for an object or an array; they are written on first use."""
        layout = self.layout
        key = layout.raw(type_)
        if key in self._types:
            return self._types[key]
        reads, puts = self._object(type_) if isinstance(type_, ObjectType) else self._array_parts(type_)
        number = self._types[key] = len(self._types) + 1
        self._functions += _function(
            f"inline void put_received_{number}(std::string& out, [[maybe_unused]] const {key}& data)", puts, []
        )
        self._functions += _function(
            f"template <class M>\nvoid read_{number}([[maybe_unused]] const M& message, [[maybe_unused]] {key}& data, "
            "[[maybe_unused]] Arena& arena)",
            reads,
            [],
        )
        return number

    def _object(self, type_: ObjectType) -> tuple[list[str], list[str]]:
        reads, puts = [], ['out += "{";']
        for part in self.layout.model.object(type_.name).properties:
            if isinstance(part.type, NoneType):
                continue
            require_field_name(part.name)
            member = self.layout.properties[type_.name, part.name]
            inner = self.layout.source(part.type)
            reads.append(self._read(inner, f"message.{part.name}", f"data.{member}"))
            key = ("," if len(puts) > 1 else "") + json.dumps(part.name) + ":"
            puts += [f"out += {string_literal(key)};", self._put(inner, f"data.{member}")]
        return reads, [*puts, 'out += "}";']

    def _array_parts(self, type_: Type) -> tuple[list[str], list[str]]:
        if not isinstance(type_, ArrayType):
            raise TypeError(type_)
        element = self.layout.source(type_.element)
        raw = self.layout.raw_element(type_.element)
        reads = [
            f"auto* const items = arena.take<{raw}>(message.size());",
            "for (std::size_t k = 0; k < message.size(); k++) {",
            "    const auto& item = message[k];",
            f"    {self._read(element, 'item', 'items[k]')}",
            "}",
            "data.items = items;",
            "data.length = message.size();",
        ]
        puts = [
            'out += "[";',
            "for (std::size_t k = 0; k < data.length; k++) {",
            '    out += k > 0 ? "," : "";',
            f"    {self._put(element, 'data.items[k]')}",
            "}",
            'out += "]";',
        ]
        return reads, puts

    def _read(self, type_: Type, place: str, target: str) -> str:
        if isinstance(type_, ObjectType | ArrayType):
            return f"read_{self._type_number(type_)}({place}, {target}, arena);"
        return f"read_{_KINDS[type(type_)]}({place}, {target});"

    def _put(self, type_: Type, place: str) -> str:
        if isinstance(type_, ObjectType | ArrayType):
            return f"put_received_{self._type_number(type_)}(out, {place});"
        return f"put_json(out, {place});"

    def _datum(self, type_: Type, name: str) -> list[str]:
        """Statements that declare a local datum and read it from `message`."""
        source = self.layout.source(type_)
        place = "message" if isinstance(source, ObjectType) else "basic_field(message)"
        return [f"{self.layout.raw(source)} {name}{{}};", self._read(source, place, name)]

    def _note(self, event: str, type_: Type, name: str) -> list[str]:
        return [
            "if (notes.is_active) {",
            "    std::string out;",
            f"    {self._put(self.layout.source(type_), name)}",
            f"    notes.note({self.layout.events[event]}, std::move(out));",
            "}",
        ]

    def _argument(self, type_: Type, name: str) -> str:
        return f", &{name}" if self.layout.is_by_pointer(type_) else f", {name}"

    def _receive(self, number: int, identifier: str) -> list[str]:
        layout = self.layout
        lines = ["[[maybe_unused]] Arena arena;"]
        names = batch_parameters(layout, identifier)
        arguments: dict[str, str] = {}
        notes: list[str] = []
        for item in batch(layout, identifier):
            event = item.event(EventKind.RESPONSE)
            type_ = event_data(layout.model, event)
            if type_ is None:
                continue
            raw = layout.raw(type_)
            if raw not in arguments:
                arguments[raw] = self._argument(type_, names[raw])
                lines += self._datum(type_, names[raw])
            notes += self._note(event, type_, names[raw])
        whole = ", whole" if layout.is_layer else ""
        call = f"{layout.function('receive', identifier)}(robot, now{''.join(arguments.values())}{whole});"
        return _function(
            f"template <class M>\nvoid receive_{number}({layout.prefix}_t* robot, std::uint64_t now, "
            "[[maybe_unused]] const M& message, [[maybe_unused]] Notes& notes"
            f"{', const void* whole' if layout.is_layer else ''})",
            [*lines, *notes, call],
            comment(f"A message came on {identifier}."),
        )

    def _take(self, event: str) -> list[str]:
        layout = self.layout
        name, _, kind = event.rpartition(".")
        is_action = layout.model.communication(name).kind is CommunicationKind.ACTION
        purpose = "feedback" if kind == "feedback" else "succeeded" if is_action else "reply"
        type_ = event_data(layout.model, event)
        lines = ["[[maybe_unused]] Arena arena;"]
        argument = ""
        if type_ is not None:
            lines += [*self._datum(type_, "data"), *self._note(event, type_, "data")]
            argument = self._argument(type_, "data")
        whole = ", &message" if layout.is_layer else ""
        lines.append(f"{layout.function(purpose, name)}(robot, now, id{argument}{whole});")
        return _function(
            f"template <class M>\nvoid {take_name(layout, event)}({layout.prefix}_t* robot, std::uint64_t now, "
            "std::uint32_t id, [[maybe_unused]] const M& message, [[maybe_unused]] Notes& notes)",
            lines,
            comment(f"Take what came: {event}."),
        )


def received_topics(layout: Layout) -> tuple[str, ...]:
    """Identifiers of outgoing messages, in source order: their numbers in the generated code."""
    return tuple(layout.received_topics)


def answers_of(item: Communication) -> Iterator[str]:
    """The events by which a service or action answers with data."""
    if item.kind is CommunicationKind.ACTION:
        yield item.event(EventKind.FEEDBACK)
    if item.kind in (CommunicationKind.ACTION, CommunicationKind.SERVICE):
        yield item.event(EventKind.RESPONSE)


def fill_name(layout: Layout, item: Communication) -> str:
    """The function that fills the message of a request."""
    return f"fill_{list(layout.communications).index(item.name)}"


def ask_name(layout: Layout, item: Communication) -> str:
    """The function that takes what the caller of a layer sends: one for all on its identifier."""
    return f"ask_{list(layout.communications).index(first_of(layout, item).name)}"


def first_of(layout: Layout, item: Communication) -> Communication:
    """The first communication of its kind with its identifier."""
    return sharing(layout.model, item.kind, item.identifier)[0]


def take_name(layout: Layout, event: str) -> str:
    """The function that takes an answer."""
    return f"take_{list(layout.events).index(event)}"


def _is_given(found: Field, place: str) -> str | None:
    """Return the condition under which a request's datum has a part; None if none of it can be given."""
    if not isinstance(found.type, ObjectType):
        return f"{place}.{found.flag}"
    inner = (
        (part, f"{place}.{member}" if isinstance(part.type, ObjectType) else place)
        for member, part in found.parts.values()
    )
    tests = [test for part, where in inner if (test := _is_given(part, where)) is not None]
    return " || ".join(tests) or None


def _array(head: str, items: Iterable[str]) -> list[str]:
    rows = [f"{item}," for item in items] or ["{},"]
    return [f"inline {head}[] = {{", *indent(rows), "};", ""]


def _visited_text(what: str, name: str, texts: Iterable[str], place: str) -> list[str]:
    """Statements that pass a visitor the text whose number a place holds."""
    listed = ", ".join(map(string_literal, texts))
    return [
        "{",
        f"    static const char* const texts[] = {{{listed}}};",
        f"    visitor.{what}({string_literal(name)}, texts[{place}]);",
        "}",
    ]


def _function(head: str, body: list[str], words: list[str]) -> list[str]:
    return [*words, *head.splitlines(), "{", *indent(body), "}", ""]


_INCLUDES = """\
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "engine.h"
#include "runtime/json.hpp"
#include "runtime/notes.hpp"
#include "runtime/parameters.hpp"
#include "runtime/values.hpp"
"""

_TOP = """\
namespace model {

inline void put_transition(std::vector<int>& taken, int number)
{
    if (number >= 0) {
        taken.push_back(number);
    }
}
"""
