"""The functions of a supervision layer in C: for requests of the caller, and for replies of the robot."""

from robosc.errors import InternalError
from robosc.expressions.text import expression_text
from robosc.model.received import received_paths
from robosc.model.structure import Communication, CommunicationKind, EventKind
from robosc.targets.code.c.layer import call_head, cancel_head, goal_head, request_head, request_parameters
from robosc.targets.code.c.layout import Layout, possible_messages, recognized_by_data, request_data
from robosc.targets.code.c.received import NO_NOTES, Reader
from robosc.targets.code.c.statements import unused
from robosc.targets.code.c.unit import Reading, Unit
from robosc.targets.code.expressions import call, variable
from robosc.targets.code.statements import Assign, Comment, Return, Statement


def request_functions(unit: Unit) -> list[list[str]]:
    """The functions through which the caller's requests come."""
    layout = unit.layout
    places = {item.name: place for place, item in enumerate(layout.requests)}
    result: list[list[str]] = []
    for identifier in layout.topics:
        result += [_match_function(unit, item) for item in recognized_by_data(layout.model, identifier)]
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
    """The function that decides by the condition `when` whether a message is an incoming message of the model.

    Every part that the condition reads is converted first, even one that does not decide, so that every unknown part
    is noted.
    """
    layout, data = unit.layout, request_data(item)
    if item.when is None:
        raise InternalError(f"{item.name} has no condition")
    parameters = [f"{layout.prefix}_t *r", *([] if data is None else [layout.parameter(data, "data")]), "bool *is_this"]
    body: list[Statement] = [NO_NOTES]
    scope = Reading(unit)
    if data is not None:
        reader = Reader(unit, data, "&notes")
        for path in received_paths(item.when):
            reader.read(path)
        body += [*(reader.default() or unused("data")), *reader.take_used()]
        scope = reader.scope
    name = variable(layout.events[item.event(EventKind.REQUEST)])
    body += [
        Comment(f"when: {expression_text(item.when)}"),
        Assign(variable("*is_this"), scope.truth(item.when)),
        Return(call("judge_notes", variable("r"), name, variable("&notes"))),
    ]
    return unit.definition(f"static int {layout.function('matches', item.name)}({', '.join(parameters)})", body)


def _recognition(layout: Layout, identifier: str, places: dict[str, int]) -> list[list[str]]:
    """The function that says which message of an identifier a message is: the first whose condition is true."""
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
