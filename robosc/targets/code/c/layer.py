"""Declarations, with comments, of the functions of a supervision layer that take the caller's requests."""

from robosc.expressions import Type
from robosc.model.structure import Communication, CommunicationKind
from robosc.targets.code.c.layout import Layout, groups, read_by_layer, request_data, sharing
from robosc.targets.code.c.text import comment

_KNOWN = " Its data says which of them, and has the numbers that limits move; what is not known of it is unknown."
_SENT = "{prefix}_sent_t what"


def request_parameters(layout: Layout, group: tuple[Communication, ...]) -> dict[str, tuple[str, Type]]:
    """Parameter and type, by C type, of the data that a layer looks at in the requests of a group."""
    types: dict[str, Type] = {}
    for item in read_by_layer(layout.model, group):
        data = request_data(item)
        if data is not None:
            types.setdefault(layout.raw(data), data)
    return {
        raw: ("data" if len(types) == 1 else f"data_{number}", type_)
        for number, (raw, type_) in enumerate(types.items(), 1)
    }


def request_head(layout: Layout, identifier: str) -> str:
    """The head of the function that takes a message of the caller."""
    data = _data(layout, sharing(layout.model, CommunicationKind.INCOMING_MESSAGE, identifier))
    return _head(layout, "request", identifier, [*data, _SENT.format(prefix=layout.prefix)])


def call_head(layout: Layout, group: tuple[Communication, ...]) -> str:
    """The head of the function that takes a service call of the caller."""
    parameters = ["uint32_t caller_id", *_data(layout, group), _SENT.format(prefix=layout.prefix)]
    return _head(layout, "call", group[0].name, parameters)


def goal_head(layout: Layout, group: tuple[Communication, ...]) -> str:
    """The head of the function that takes a goal of the caller."""
    parameters = ["uint32_t caller_id", *_data(layout, group), _SENT.format(prefix=layout.prefix)]
    return _head(layout, "goal", group[0].name, parameters)


def _data(layout: Layout, group: tuple[Communication, ...]) -> list[str]:
    return [layout.parameter(type_, name) for name, type_ in request_parameters(layout, group).values()]


def cancel_head(layout: Layout, action: str) -> str:
    """The head of the function that takes a cancel of the caller."""
    return _head(layout, "cancel", action, ["uint32_t caller_id"])


def _head(layout: Layout, purpose: str, name: str, parameters: list[str]) -> str:
    start = [f"{layout.prefix}_t *r", "uint64_t now_us"]
    return f"void {layout.function(purpose, name)}({', '.join([*start, *parameters])})"


def request_heads(layout: Layout) -> list[tuple[str, str]]:
    """Every function that takes something of the caller, with words that say what."""
    found = []
    for identifier in layout.topics:
        incoming = layout.of_kind(CommunicationKind.INCOMING_MESSAGE)
        names = ", ".join(item.name for item in incoming if item.identifier == identifier)
        data = request_parameters(layout, sharing(layout.model, CommunicationKind.INCOMING_MESSAGE, identifier))
        known = _KNOWN if data else ""
        words = f"The caller sends a message on {identifier}: {names}.{known}"
        found.append((words, request_head(layout, identifier)))
    for group in groups(layout.model, CommunicationKind.SERVICE):
        known = _KNOWN if request_parameters(layout, group) else ""
        words = (
            f"The caller calls the service {_names(group)}: exactly one `answer` or `answer_default` follows.{known}"
        )
        found.append((words, call_head(layout, group)))
    for group in groups(layout.model, CommunicationKind.ACTION):
        known = _KNOWN if request_parameters(layout, group) else ""
        words = (
            f"The caller sends a goal of the action {_names(group)}: it is rejected, or accepted and ended once.{known}"
        )
        found.append((words, goal_head(layout, group)))
        words = f"The caller cancels its goal of the action {_names(group)}: that is always forwarded."
        found.append((words, cancel_head(layout, group[0].name)))
    return found


def _names(group: tuple[Communication, ...]) -> str:
    return " or ".join(item.name for item in group)


def request_declarations(layout: Layout) -> list[str]:
    """The declarations of those functions."""
    return [line for words, head in request_heads(layout) for line in (*comment(words), f"{head};", "")]
