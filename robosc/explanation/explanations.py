"""Explanations: what commands print, services send and programs read; `document` makes JSON values of them.

Their texts are for a terminal: a thought a line, places as `file:line:column`.
"""

from collections.abc import Iterator
from typing import Any

import msgspec

from robosc.explanation.notation import events_text, value_text
from robosc.explanation.parts import (
    Blamed,
    CounterexampleReport,
    EventHere,
    EventReport,
    Part,
    Path,
    Reason,
    Remark,
    StateReport,
    StateValues,
    Stopped,
)
from robosc.source import visible
from robosc.tables import html_text

MAXIMUM_VALUES = 30
"""Values of a state that are shown."""


class EmptyExplanation(msgspec.Struct, frozen=True):
    """Explanation why there is no supervisor.

    Attributes:
        trouble: A run into trouble.
        blamed: Parts of the model that alone, without any other requirement, range or marking, leave no supervisor.
        is_minimal: True if it is known that each of them is needed for that.
        removal: A minimal set of parts without which there is a supervisor; empty if it is not known, or very large.
        left_out: Number of blamed parts that are not listed.
        is_of_automata: True if it is about automata that are no model's: their plants are no behaviours.
    """

    trouble: CounterexampleReport
    blamed: tuple[Blamed, ...]
    is_minimal: bool
    removal: tuple[Part, ...]
    left_out: int = 0
    is_of_automata: bool = False

    def __repr__(self) -> str:
        return f"<no supervisor: {len(self.blamed) + self.left_out} parts of the model are to blame>"

    def __str__(self) -> str:
        return empty_text(self).rstrip()

    def _repr_html_(self) -> str:
        return html_text(str(self))


class Explanation(msgspec.Struct, frozen=True):
    """Explanation of what synthesis did to a model.

    Attributes:
        empty: Explanation why there is no supervisor, or None if there is one.
        events: Reports on the requested event, or on every controllable event; empty if a state was requested.
        state: Report on what can happen in the requested state.
        remarks: Warnings, if neither an event nor a state was requested.
        is_of_automata: True if it is about automata that are no model's: their plants are no behaviours.
    """

    empty: EmptyExplanation | None = None
    events: tuple[EventReport, ...] = ()
    state: StateReport | None = None
    remarks: tuple[Remark, ...] = ()
    is_of_automata: bool = False

    def __repr__(self) -> str:
        if self.empty is not None:
            return repr(self.empty)
        if self.state is not None:
            return f"<explanation of one state: {len(self.state.events)} events>"
        return f"<explanation: {len(self.events)} events, {len(self.remarks)} remarks>"

    def __str__(self) -> str:
        return explanation_text(self).rstrip()

    def _repr_html_(self) -> str:
        return html_text(str(self))


def document(explanation: Explanation | EmptyExplanation) -> dict[str, Any]:
    """An explanation as JSON values: objects with the names of the attributes."""
    # Not `to_builtins`, which leaves tuples as they are: a report that was sent has lists.
    result: dict[str, Any] = msgspec.json.decode(msgspec.json.encode(explanation))
    return result


def to_text(explanation: Explanation | EmptyExplanation) -> str:
    """An explanation as one JSON text, for `whole_from_text`, or for `from_text` if there is no supervisor."""
    return msgspec.json.encode(explanation).decode()


def from_text(text: str) -> EmptyExplanation:
    """The explanation, why there is no supervisor, from a text; it is validated.

    Raises:
        ValueError: It holds none.
    """
    return _from_text(text, EmptyExplanation)


def whole_from_text(text: str) -> Explanation:
    """The explanation of what synthesis did, from a text; it is validated.

    Raises:
        ValueError: It holds none.
    """
    return _from_text(text, Explanation)


def _from_text[Kind](text: str, kind: type[Kind]) -> Kind:
    try:
        return msgspec.json.decode(text, type=kind)
    except (msgspec.MsgspecError, RecursionError) as error:
        raise ValueError(f"no explanation: {error}") from error


def explanation_text(explanation: Explanation) -> str:
    """Return the text on what synthesis did to a model or to automata."""
    return _joined(_Text(is_of_automata=explanation.is_of_automata).explained(explanation))


def empty_text(explanation: EmptyExplanation) -> str:
    """Return the text on why there is no supervisor."""
    return _joined(_Text(is_of_automata=explanation.is_of_automata).empty(explanation))


def _joined(lines: Iterator[str]) -> str:
    return "".join(f"{visible(line)}\n" for line in lines)


class _Text:
    """Lines about one explanation.

    Args:
        is_of_automata: True if it is about automata that are no model's.
    """

    def __init__(self, *, is_of_automata: bool) -> None:
        self._plants = "plants" if is_of_automata else "behaviours"
        # Automata may have several.
        self._initial = "an initial state" if is_of_automata else "the initial state"
        self._free_way = f"the {self._plants} would have the way"
        self._statuses = {
            "free": f"free: it can happen wherever the {self._plants} let it",
            "restricted": "restricted",
            "never": "can never happen",
        }

    def explained(self, item: Explanation) -> Iterator[str]:
        """Yield the lines about what synthesis did."""
        if item.empty is not None:
            yield from self.empty(item.empty)
        if item.state is not None:
            yield from self._state_report(item.state)
        for event in item.events:
            yield from self._event(event)
        for remark in item.remarks:
            yield from self._remark(remark)

    # No supervisor

    def empty(self, item: EmptyExplanation) -> Iterator[str]:
        """Yield the lines about why there is no supervisor."""
        yield "trouble:"
        if item.trouble.kind == "nowhere":
            yield from _indented(iter(item.trouble.messages))
            return
        yield from _indented(self._trouble(item.trouble, f"from {self._initial}", f"in {self._initial} already"))
        if not item.blamed:
            return
        if not item.is_minimal:
            yield "to blame is something among these (the search for the least of them was given up):"
        elif len(item.blamed) == 1:
            yield "to blame: this alone leaves no supervisor"
        else:
            yield "to blame: these together leave no supervisor, and each of them is needed for that"
        for blamed in item.blamed:
            yield f"  {_part(blamed.part)}"
        if item.left_out:
            yield f"  and {item.left_out} more"
        if item.is_minimal and all(blamed.suffices for blamed in item.blamed):
            yield f"there is a supervisor without {'it' if len(item.blamed) == 1 else 'any one of them'}"
        elif item.removal:
            yield "there is a supervisor without:"
            for part in item.removal:
                yield f"  {_part(part)}"

    def _trouble(self, item: CounterexampleReport, start: str, here: str) -> Iterator[str]:
        """Yield the lines about a run into trouble.

        Args:
            item: The trouble.
            start: Place where a run begins, in words.
            here: The place where there is no run, in words.
        """
        if not item.way.events:
            yield f"{here}:"
        elif item.is_forced:
            yield f"{start} {events_text(item.way.events)} can follow, and nothing can prevent it"
        else:
            yield f"{start} every way on to a marked state is closed by trouble such as after {_run(item.way)}"
        yield f"  there: {_state(item.way.state)}"
        for message in item.messages:
            yield f"  {message}"
        if item.stopped is not None:
            yield from _indented(self._stopped(item.stopped, self._free_way))

    def _stopped(self, item: Stopped, what: str) -> Iterator[str]:
        event = item.events[item.stopped_at]
        if len(item.events) == 1:
            yield f"{what} {event}, but it must not happen:"
        else:
            before = f" after {events_text(item.events[: item.stopped_at])}" if item.stopped_at else ""
            yield f"{what} {events_text(item.events)}, but {event} must not happen{before}:"
        for reason in item.reasons:
            yield from _indented(self._reason(reason))
        if not item.reasons:
            yield "  it leads into trouble"

    def _reason(self, item: Reason) -> Iterator[str]:
        place = f" ({item.part.location})" if item.part is not None and item.part.location is not None else ""
        when = ""
        if item.way is not None:
            when = f"; for instance after {_run(item.way)}" if item.way.events else f"; for instance in {self._initial}"
        yield f"{item.message}{place}{when}"
        if item.trouble is not None:
            yield from _indented(self._trouble(item.trouble, "then", "it leads into trouble at once"))

    # Reports about a supervisor

    def _event(self, item: EventReport) -> Iterator[str]:
        kind = "" if item.is_controllable else " (uncontrollable)"
        where = f", in the module of {', '.join(item.module)} alone" if item.module else ""
        yield f"{item.event}{kind}{where}: {self._statuses[item.status]}"
        for reason in item.reasons:
            yield from _indented(self._reason(reason))
        if item.unfound:
            yield f"  {item.unfound}"
        if item.stopped is not None:
            yield from _indented(self._stopped(item.stopped, self._free_way))

    def _state_report(self, item: StateReport) -> Iterator[str]:
        where = f"after {_run(item.way)}" if item.way.events else f"in {self._initial}"
        more = "" if item.fitting == "1" else f" (one of {item.fitting} states that fit)"
        yield f"{where}{more}:"
        yield f"  {_state(item.way.state)}"
        for event in item.events:
            yield from self._here(event)

    def _here(self, item: EventHere) -> Iterator[str]:
        kind = "" if item.is_controllable else " (uncontrollable)"
        yield f"{item.event}{kind}: {'can happen' if item.can_happen else 'cannot happen'}"
        for reason in item.reasons:
            yield from _indented(self._reason(reason))

    def _remark(self, item: Remark) -> Iterator[str]:
        place = "" if item.location is None else f"{item.location}: "
        yield f"{place}warning: {item.message} [{item.kind}]"
        if item.way is not None:
            yield f"  {_state(item.way.state)}"
        if item.stopped is not None:
            yield from _indented(self._stopped(item.stopped, self._free_way))


def _part(part: Part) -> str:
    return part.text if part.location is None else f"{part.location}: {part.text}"


def _run(way: Path) -> str:
    return events_text(way.events) + ("" if way.is_shortest else " (perhaps not the shortest way)")


def _state(state: StateValues) -> str:
    parts = [f"{name} is {value}" for name, value in (*state.components.items(), *state.communications.items())]
    parts += [f"{name} = {value_text(value)}" for name, value in state.variables.items()]
    return ", ".join(parts[:MAXIMUM_VALUES]) + (", ..." if len(parts) > MAXIMUM_VALUES else "")


def _indented(lines: Iterator[str]) -> Iterator[str]:
    return (f"  {line}" for line in lines)
