"""The functions of a supervision layer in C: for requests of the caller, and for replies of the robot."""

from robosc.errors import InternalError
from robosc.expressions.text import expression_text
from robosc.model.received import received_paths
from robosc.model.structure import Communication, CommunicationKind, EventKind
from robosc.targets.code.c.layer import call_head, cancel_head, goal_head, request_head, request_parameters
from robosc.targets.code.c.layout import Layout, groups, request_data
from robosc.targets.code.c.limits import received_function
from robosc.targets.code.c.received import NO_NOTES, Reader
from robosc.targets.code.c.statements import statement_lines, unused
from robosc.targets.code.c.unit import Reading, Unit
from robosc.targets.code.expressions import call, variable
from robosc.targets.code.statements import Assign, Comment, Return, Statement
from robosc.targets.text import indent


def request_functions(unit: Unit) -> list[list[str]]:
    """The functions through which the caller's requests come."""
    layout = unit.layout
    places = {item.name: place for place, item in enumerate(layout.requests)}
    result: list[list[str]] = []
    actions = [item.name for item in layout.of_kind(CommunicationKind.ACTION)]
    for kind in (CommunicationKind.INCOMING_MESSAGE, CommunicationKind.SERVICE, CommunicationKind.ACTION):
        for group in groups(layout.model, kind):
            result += [_match_function(unit, item) for item in group if item.when is not None]
            result += [received_function(unit, item) for item in group if layout.model.limits_for(item.name)]
            result += _recognition(layout, group, places)
            result.append(_request_function(layout, group, places))
            if kind is CommunicationKind.ACTION:
                result.append(_cancel_function(layout, group, actions))
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


def _recognizing(layout: Layout, group: tuple[Communication, ...]) -> str:
    """The function that says which communication of a group a request is."""
    if group[0].kind is CommunicationKind.INCOMING_MESSAGE:
        return layout.function("recognizes", group[0].identifier)
    return layout.function("tells", group[0].name)


def _recognition(layout: Layout, group: tuple[Communication, ...], places: dict[str, int]) -> list[list[str]]:
    """The function that says which communication of a group a request is: the first whose condition is true."""
    parameters = request_parameters(layout, group)
    if not group[0].has_condition:
        return []
    heads = [layout.parameter(type_, name) for name, type_ in parameters.values()]
    sent = f"const {layout.prefix}_sent_t *sent_by_caller"
    by_data = any(item.when is not None for item in group)
    names = [name for name, _ in parameters.values()]
    lines = [
        f"static int {_recognizing(layout, group)}"
        f"({', '.join([f'{layout.prefix}_t *r', *heads, sent, 'int *request'])})",
        "{",
        *(["    bool is_this = false;", "    int why = LET_THROUGH;"] if by_data else []),
        *indent(statement_lines(unused(*([] if by_data else ["r", *names]), "sent_by_caller"))),
    ]
    for item in group:
        if not item.has_condition:
            return [[*lines, f"    *request = {places[item.name]};", "    return LET_THROUGH;", "}"]]
        if item.is_when_default:
            lines += [
                "    if (sent_by_caller->is_default) {",
                f"        *request = {places[item.name]};",
                "        return LET_THROUGH;",
                "    }",
            ]
            continue
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


def _request_function(layout: Layout, group: tuple[Communication, ...], places: dict[str, int]) -> list[str]:
    """The function that takes a request of the caller."""
    first = group[0]
    parameters = request_parameters(layout, group)
    if first.kind is CommunicationKind.INCOMING_MESSAGE:
        topic = layout.topics[first.identifier]
        head, refusal = request_head(layout, first.identifier), f"message_refusal(r, now_us, {topic}, &what)"
        through = f"let_message_through(r, {topic}, {{request}}, why, &what);"
    else:
        is_call = first.kind is CommunicationKind.SERVICE
        head, refusal = (call_head if is_call else goal_head)(layout, group), "request_refusal(r, now_us, &what)"
        through = f"let_{'call' if is_call else 'goal'}_through(r, {{request}}, why, caller_id, &what);"
    lines = [head, "{", f"    int why = {refusal};"]
    request = str(places[first.name])
    if first.has_condition:
        names = [name for name, _ in parameters.values()]
        call = f"{_recognizing(layout, group)}({', '.join(['r', *names, '&what', '&request'])})"
        lines += [f"    int request = {request};", "    if (why == LET_THROUGH) {", f"        why = {call};", "    }"]
        request = "request"
    for item in group:
        data = request_data(item)
        if layout.model.limits_for(item.name) and data is not None:
            read = f"{layout.function('numbers', item.name)}({parameters[layout.raw(data)][0]}, r->numbers);"
            lines += (
                [f"    if (request == {places[item.name]}) {{", f"        {read}", "    }"]
                if request == "request"
                else [f"    {read}"]
            )
    return [*lines, f"    {through.format(request=request)}", "}"]


def _cancel_function(layout: Layout, group: tuple[Communication, ...], actions: list[str]) -> list[str]:
    """The function that takes a cancel of the caller: of the action of the group whose goal it is."""
    first, *others = (actions.index(item.name) for item in group)
    lines = [cancel_head(layout, group[0].name), "{"]
    if not others:
        return [*lines, f"    cancel_for_caller(r, now_us, {first}, caller_id);", "}"]
    lines.append(f"    int action = {first};")
    for place in others:
        lines += [
            f"    if (r->goals[{place}].is_awaited && r->goals[{place}].caller_id == caller_id) {{",
            f"        action = {place};",
            "    }",
        ]
    return [*lines, "    cancel_for_caller(r, now_us, action, caller_id);", "}"]
