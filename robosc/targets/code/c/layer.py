"""Declarations, with comments, of the functions of a supervision layer that take the caller's requests."""

from robosc.expressions import Type
from robosc.model.structure import CommunicationKind
from robosc.targets.code.c.layout import Layout, recognized_by_data, request_data
from robosc.targets.code.c.text import comment

_SENT = "{prefix}_sent_t what"


def request_parameters(layout: Layout, identifier: str) -> dict[str, tuple[str, Type]]:
    """Parameter and type, by C type, of the data that distinguishes the messages on an identifier."""
    types: dict[str, Type] = {}
    for item in recognized_by_data(layout.model, identifier):
        data = request_data(item)
        if data is not None:
            types.setdefault(layout.raw(data), data)
    return {
        raw: ("data" if len(types) == 1 else f"data_{number}", type_)
        for number, (raw, type_) in enumerate(types.items(), 1)
    }


def request_head(layout: Layout, identifier: str) -> str:
    """The head of the function that takes a message of the caller."""
    data = [layout.parameter(type_, name) for name, type_ in request_parameters(layout, identifier).values()]
    return _head(layout, "request", identifier, [*data, _SENT.format(prefix=layout.prefix)])


def call_head(layout: Layout, service: str) -> str:
    """The head of the function that takes a service call of the caller."""
    return _head(layout, "call", service, ["uint32_t caller_id", _SENT.format(prefix=layout.prefix)])


def goal_head(layout: Layout, action: str) -> str:
    """The head of the function that takes a goal of the caller."""
    return _head(layout, "goal", action, ["uint32_t caller_id", _SENT.format(prefix=layout.prefix)])


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
        data = request_parameters(layout, identifier)
        known = " Its data says which of them; what is not known of it is unknown." if data else ""
        words = f"The caller sends a message on {identifier}: {names}.{known}"
        found.append((words, request_head(layout, identifier)))
    for item in layout.of_kind(CommunicationKind.SERVICE):
        words = f"The caller calls the service {item.name}: exactly one `answer` or `answer_default` follows."
        found.append((words, call_head(layout, item.name)))
    for item in layout.of_kind(CommunicationKind.ACTION):
        words = f"The caller sends a goal of the action {item.name}: it is rejected, or accepted and ended once."
        found.append((words, goal_head(layout, item.name)))
        words = f"The caller cancels its goal of the action {item.name}: that is always forwarded."
        found.append((words, cancel_head(layout, item.name)))
    return found


def request_declarations(layout: Layout) -> list[str]:
    """The declarations of those functions."""
    return [line for words, head in request_heads(layout) for line in (*comment(words), f"{head};", "")]
