"""The functions of a supervision layer in C: what the caller asks for, and what comes back from the robot."""

from robosc.errors import InternalError
from robosc.expressions.text import expression_text
from robosc.model.received import received_paths
from robosc.model.structure import Communication, CommunicationKind, EventKind
from robosc.targets.c99.header import reply_head
from robosc.targets.c99.layer import call_head, cancel_head, goal_head, request_head, request_parameters
from robosc.targets.c99.layout import Layout, event_data, possible_messages, request_data, told_apart
from robosc.targets.c99.received import Reader
from robosc.targets.c99.step import unknown_name
from robosc.targets.c99.text import comment
from robosc.targets.c99.unit import Lvalue, Reading, Unit
from robosc.targets.code.text import indent

_LOOK = "look_at_clock(r, now_us);"


def happen_call(layout: Layout, event: str) -> str:
    """The statement that lets an event of the environment happen with the data that came."""
    data = ["data"] if event_data(layout.model, event) is not None else []
    return f"(void){layout.function('happens', event)}({', '.join(['r', *data, 'false'])});"


def request_functions(unit: Unit) -> list[list[str]]:
    """The functions through which the caller's requests come."""
    layout = unit.layout
    places = {item.name: place for place, item in enumerate(layout.requests)}
    result: list[list[str]] = []
    for identifier in layout.topics:
        result += [_match_function(unit, item) for item in told_apart(layout.model, identifier)]
        result += _recognition(layout, identifier, places)
        result.append(_request_function(layout, identifier, places))
    for item in layout.of_kind(CommunicationKind.SERVICE):
        call = f"let_call_through(r, now_us, {places[item.name]}, caller_id, &what);"
        result.append([call_head(layout, item.name), "{", f"    {call}", "}"])
    for place, item in enumerate(layout.of_kind(CommunicationKind.ACTION)):
        call = f"let_goal_through(r, now_us, {places[item.name]}, caller_id, &what);"
        result.append([goal_head(layout, item.name), "{", f"    {call}", "}"])
        cancel = f"cancel_for_caller(r, now_us, {place}, caller_id);"
        result.append([cancel_head(layout, item.name), "{", f"    {cancel}", "}"])
    return result


def _match_function(unit: Unit, item: Communication) -> list[str]:
    """The function that tells by its condition whether a message is an incoming message of the model.

    Every part that the condition reads is converted first, whether it decides or not: what is unknown is noted.
    """
    layout, data = unit.layout, request_data(item)
    if item.when is None:
        raise InternalError(f"{item.name} has no condition")
    parameters = [f"{layout.prefix}_t *r", *([] if data is None else [layout.parameter(data, "data")]), "bool *is_this"]
    lines = ["notes_t notes = {false, false};"]
    reading = Reading(unit, None)
    if data is not None:
        is_pointer = layout.is_by_pointer(data)
        reader = Reader(unit, data, Lvalue("data", is_pointer), "&notes")
        for path in received_paths(item.when):
            reader.read(path)
        if is_pointer:
            lines += ["if (data == NULL) {", f"    data = &{unknown_name(layout.raw(data))};", "}"]
        else:
            lines.append("(void)data;")
        lines += reader.take_lines()
        lines += [f"(void){name};" for name in reader.names]
        reading = Reading(unit, None, reader.read, data)
    return [
        f"static int {layout.function('matches', item.name)}({', '.join(parameters)})",
        "{",
        *indent(lines),
        *indent(comment(f"when: {expression_text(item.when)}")),
        f"    *is_this = {unit.text(reading.truth(item.when))};",
        f"    return judge_notes(r, {layout.events[item.event(EventKind.REQUEST)]}, &notes);",
        "}",
    ]


def _recognition(layout: Layout, identifier: str, places: dict[str, int]) -> list[list[str]]:
    """The function that tells which message of an identifier a message is: the first whose condition is true."""
    parameters = request_parameters(layout, identifier)
    sharing = possible_messages(layout.model, identifier)
    if sharing[0].when is None:
        return []
    heads = [layout.parameter(type_, name) for name, type_ in parameters.values()]
    lines = [
        f"static int {layout.function('recognizes', identifier)}"
        f"({', '.join([f'{layout.prefix}_t *r', *heads, 'int *request'])})",
        "{",
        "    bool is_this = false;",
        "    int why = LET_THROUGH;",
    ]
    for item in sharing:
        if item.when is None:
            return [[*lines, f"    *request = {places[item.name]};", "    return LET_THROUGH;", "}"]]
        data = request_data(item)
        arguments = ["r", *([] if data is None else [parameters[layout.raw(data)][0]]), "&is_this"]
        lines += [
            f"    why = {layout.function('matches', item.name)}({', '.join(arguments)});",
            "    if (why != LET_THROUGH || is_this) {",
            f"        *request = {places[item.name]};",
            "        return why;",
            "    }",
        ]
    return [[*lines, f"    return (int){layout.upper}_REFUSAL_NOT_KNOWN;", "}"]]


def _request_function(layout: Layout, identifier: str, places: dict[str, int]) -> list[str]:
    topic = layout.topics[identifier]
    first = possible_messages(layout.model, identifier)[0]
    lines = [request_head(layout, identifier), "{", f"    int why = message_refusal(r, now_us, {topic}, &what);"]
    request = str(places[first.name])
    if first.when is not None:
        request = "request"
        names = [name for name, _ in request_parameters(layout, identifier).values()]
        call = f"{layout.function('recognizes', identifier)}({', '.join(['r', *names, '&request'])})"
        lines += ["    int request = 0;", "    if (why == LET_THROUGH) {", f"        why = {call};", "    }"]
    return [*lines, f"    let_message_through(r, {topic}, {request}, why, &what);", "}"]


def reply_functions(layout: Layout) -> list[list[str]]:
    """The functions through which answers of the robot come; they are handed on to the caller."""
    result = []
    for place, item in enumerate(layout.of_kind(CommunicationKind.SERVICE)):
        event = item.event(EventKind.RESPONSE)
        body = [
            "bool is_well = true;",
            "bool is_awaited = false;",
            _LOOK,
            f"is_awaited = r->calls[{place}].is_awaited && r->calls[{place}].id == id;",
            f"if (close_call(r, {place}, id)) {{",
            f"    {happen_call(layout, event)}",
            "    is_well = end_batch(r);",
            "}",
            f"answer_caller(r, {place}, is_awaited, message);",
            "guard(r, is_well);",
            "finish(r);",
        ]
        result.append([reply_head(layout, event), "{", *indent(body), "}"])
    for place, item in enumerate(layout.of_kind(CommunicationKind.ACTION)):
        for kind in (EventKind.FEEDBACK, EventKind.RESPONSE):
            event = item.event(kind)
            ends = f"end_for_caller(r, {place}, {layout.upper}_END_SUCCEEDED, message);"
            is_end = kind is EventKind.RESPONSE
            body = [
                "bool is_well = true;",
                _LOOK,
                f"if (has_goal(r, {place}, id)) {{",
                *([f"    close_goal(r, {place});"] if is_end else []),
                f"    if (r->goals[{place}].is_running) {{",
                f"        {happen_call(layout, event)}",
                "        is_well = end_batch(r);",
                "    } else {",
                f"        unexpected(r, (int){layout.events[event]});",
                "    }",
                f"    {ends if is_end else f'pass_feedback(r, {place}, message);'}",
                "}",
                "guard(r, is_well);",
                "finish(r);",
            ]
            result.append([reply_head(layout, event), "{", *indent(body), "}"])
    return result
