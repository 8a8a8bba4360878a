"""Explanations as values: commands print them, services send them, programs read them; `document` makes JSON of them.

A service sends them to its client, so they are frozen values of plain types that msgspec can validate.
"""

from dataclasses import dataclass
from typing import Any

import msgspec

from robosc.expressions import Value
from robosc.source import Location
from robosc.tables import html_text


@dataclass(frozen=True, slots=True)
class Part:
    """A part of the model.

    Attributes:
        kind: `requirement`, `invariant`, `condition`, `range`, `marking`; `component`, `communication`, `state`; for
            automata without a model also `plant`.
        text: Description of the part, in the model's words.
        location: Place of the part.
    """

    kind: str
    text: str
    location: Location | None


@dataclass(frozen=True, slots=True)
class StateValues:
    """One state, as `robosc explore` names it.

    Attributes:
        components: State of every component with a behaviour.
        variables: Value of every synthesis variable, by `Component.variable`.
        communications: Location of every service and action, by name; by `service name` or `action name` if a component
            has the same name.
    """

    components: dict[str, str]
    variables: dict[str, Value]
    communications: dict[str, str]


@dataclass(frozen=True, slots=True)
class Path:
    """A run, and where it ends.

    Attributes:
        events: Its events.
        is_shortest: True if it is known that no run is shorter.
        state: Its last state.
    """

    events: tuple[str, ...]
    is_shortest: bool
    state: StateValues


@dataclass(frozen=True, slots=True)
class Reason:
    """Reason why an event cannot happen in some state.

    Attributes:
        kind: `behaviour`, `range`, `requirement` or `supervisor`.
        message: Reason in one sentence.
        part: The part of the model, or None if the supervisor is the reason.
        way: A shortest run to a state where the reason applies, or None if the state is given.
        trouble: Counterexample that would follow, if the supervisor forbids the event.
    """

    kind: str
    message: str
    part: Part | None
    way: Path | None = None
    trouble: "CounterexampleReport | None" = None


@dataclass(frozen=True, slots=True)
class Stopped:
    """A way of the behaviours alone to some goal, and the place where it is stopped.

    Attributes:
        events: Events of the whole way.
        stopped_at: Place, from 0, of the event that must not happen.
        state: The state before that event.
        reasons: Reasons why it must not happen; none if it is uncontrollable and leads into trouble.
    """

    events: tuple[str, ...]
    stopped_at: int
    state: StateValues
    reasons: tuple[Reason, ...]


@dataclass(frozen=True, slots=True)
class CounterexampleReport:
    """A run into trouble.

    Attributes:
        kind: `bad` if an invariant, a range or a condition is violated at the end; `blocking` if no marked state can be
            reached from there; `nowhere` if there is no run, because there is no initial state.
        way: The run.
        is_forced: True if nothing can prevent it: all of its events are uncontrollable.
        messages: Sentences that say what the trouble is.
        parts: Parts of the model that are violated.
        stopped: Way of the behaviours to a marked state, for a state that blocks; None if they have none, or if the
            search takes too long, which one of the messages then says.
    """

    kind: str
    way: Path
    is_forced: bool
    messages: tuple[str, ...]
    parts: tuple[Part, ...]
    stopped: Stopped | None = None


@dataclass(frozen=True, slots=True)
class Blamed:
    """A part of the model that is to blame.

    Attributes:
        part: The part.
        suffices: True if removing only this part gives a supervisor; None if that is not known.
    """

    part: Part
    suffices: bool | None


@dataclass(frozen=True, slots=True, repr=False)
class EmptyExplanation:
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
        from robosc.explanation.text import empty_text

        return empty_text(self).rstrip()

    def _repr_html_(self) -> str:
        return html_text(str(self))


@dataclass(frozen=True, slots=True)
class EventReport:
    """Report on what restricts an event.

    Attributes:
        event: The event.
        is_controllable: True if the supervisor may disable it.
        status: `free` if it can happen wherever the behaviours allow it; `never` if it can happen nowhere; else
            `restricted`.
        reasons: Reasons that block it, each with a shortest run to a state where the reason applies.
        stopped: Way to a state in which the behaviours would allow it, for an event that can never happen, and the
            reason why the way is stopped.
        unfound: Sentence in place of that way, if the search takes too long; else empty.
    """

    event: str
    is_controllable: bool
    status: str
    reasons: tuple[Reason, ...]
    stopped: Stopped | None = None
    unfound: str = ""


@dataclass(frozen=True, slots=True)
class EventHere:
    """Report on whether an event can happen in one state, and why not."""

    event: str
    is_controllable: bool
    can_happen: bool
    reasons: tuple[Reason, ...]


@dataclass(frozen=True, slots=True)
class StateReport:
    """Report on what can happen in one state.

    Attributes:
        way: A run to it.
        fitting: Number of states of the controlled system that fit the description, as a decimal number.
        events: The requested events.
    """

    way: Path
    fitting: str
    events: tuple[EventHere, ...]


@dataclass(frozen=True, slots=True)
class Remark:
    """A remark on the controlled system for its author.

    Attributes:
        kind: `never-enabled`, `unused-requirement`, `unreachable-state`, `only-uncontrollable` or `deadlock`.
        message: One sentence.
        location: Place in the text, or None if the remark is about no single part.
        way: A shortest run to such a state, if there is one.
        stopped: Way of the behaviours to a state that is not reachable, and the place where it is stopped.
    """

    kind: str
    message: str
    location: Location | None
    way: Path | None = None
    stopped: Stopped | None = None


@dataclass(frozen=True, slots=True, repr=False)
class Explanation:
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
        from robosc.explanation.text import explanation_text

        return explanation_text(self).rstrip()

    def _repr_html_(self) -> str:
        return html_text(str(self))


def document(explanation: Explanation | EmptyExplanation) -> dict[str, Any]:
    """An explanation as JSON values: objects with the names of the attributes."""
    result: dict[str, Any] = msgspec.to_builtins(explanation)
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
