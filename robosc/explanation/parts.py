"""Parts of explanations as values: runs, states, reasons and reports.

They travel from a service to its client, so they are frozen values of plain types that msgspec can validate.
"""

import msgspec

from robosc.expressions import Value
from robosc.source import Location


class Part(msgspec.Struct, frozen=True):
    """A part of the model.

    Attributes:
        kind: `requirement`, `invariant`, `condition`, `range`, `marking`; `component`, `communication`, `state`; of
            automata that are no model's also `plant`.
        text: Description of the part, in the model's words.
        location: Place of the part.
    """

    kind: str
    text: str
    location: Location | None


class StateValues(msgspec.Struct, frozen=True):
    """One state, as `robosc explore` names it.

    Attributes:
        components: State of every component with a behaviour.
        variables: Value of every synthesis variable, by `Component.variable`.
        communications: Location of every service and action; of one that is called like a component, by
            `service name` or `action name`.
    """

    components: dict[str, str]
    variables: dict[str, Value]
    communications: dict[str, str]


class Path(msgspec.Struct, frozen=True):
    """A run, and where it ends.

    Attributes:
        events: Its events.
        is_shortest: True if it is known that no run is shorter.
        state: Its last state.
    """

    events: tuple[str, ...]
    is_shortest: bool
    state: StateValues


class Reason(msgspec.Struct, frozen=True):
    """Reason why an event cannot happen in some state.

    Attributes:
        kind: `behaviour`, `range`, `requirement` or `supervisor`.
        message: Reason in one sentence.
        part: The part of the model, or None where it is the supervisor.
        way: A shortest run to a state where it is so, or None where the state is given.
        trouble: Counterexample that would follow, where the supervisor forbids it.
    """

    kind: str
    message: str
    part: Part | None
    way: Path | None = None
    trouble: "CounterexampleReport | None" = None


class Stopped(msgspec.Struct, frozen=True):
    """A way to some goal by the behaviours alone, and where it is stopped.

    Attributes:
        events: Events of the whole way.
        stopped_at: Place of the event, from 0, that must not happen.
        state: The state before that event.
        reasons: Reasons why it must not happen; none where it is uncontrollable and leads into trouble.
    """

    events: tuple[str, ...]
    stopped_at: int
    state: StateValues
    reasons: tuple[Reason, ...]


class CounterexampleReport(msgspec.Struct, frozen=True):
    """A run into trouble.

    Attributes:
        kind: `bad`, where an invariant, a range or a condition is broken at the end; `blocking`, where no marked state
            can be reached from there; `nowhere`, where no run begins, since there is no initial state.
        way: The run.
        is_forced: True if nothing can prevent it: all of its events are uncontrollable.
        messages: Sentences that say what the trouble is.
        parts: Parts of the model that are broken.
        stopped: Way that the behaviours would have to a marked state, for a state that blocks; None where they have
            none, or finding one takes too long, which is then one of the messages.
    """

    kind: str
    way: Path
    is_forced: bool
    messages: tuple[str, ...]
    parts: tuple[Part, ...]
    stopped: Stopped | None = None


class Blamed(msgspec.Struct, frozen=True):
    """A part of the model that is to blame.

    Attributes:
        part: The part.
        suffices: True if there is a supervisor without this part alone; None where that was not found out.
    """

    part: Part
    suffices: bool | None


class EventReport(msgspec.Struct, frozen=True):
    """Report on what restricts an event.

    Attributes:
        event: The event.
        is_controllable: True if the supervisor may disable it.
        status: `free`, where it can happen wherever the behaviours let it; `restricted`; `never`, where it can happen
            nowhere.
        reasons: Reasons that keep it from happening, each with a shortest run to a state where it does.
        stopped: Way to where the behaviours would let it happen, for an event that they never let happen, and why
            that is stopped.
        unfound: Sentence in place of that way, where finding one takes too long; else empty.
        module: Components of the module that is reported on alone, in a modular synthesis; else none.
    """

    event: str
    is_controllable: bool
    status: str
    reasons: tuple[Reason, ...]
    stopped: Stopped | None = None
    unfound: str = ""
    module: tuple[str, ...] = ()


class EventHere(msgspec.Struct, frozen=True):
    """Report on whether an event can happen in one state, and why not."""

    event: str
    is_controllable: bool
    can_happen: bool
    reasons: tuple[Reason, ...]


class StateReport(msgspec.Struct, frozen=True):
    """Report on what can happen in one state.

    Attributes:
        way: A run to it.
        fitting: Number of states of the controlled system that fit what was asked, as a decimal number.
        events: The events asked for.
    """

    way: Path
    fitting: str
    events: tuple[EventHere, ...]


class Remark(msgspec.Struct, frozen=True):
    """A remark on the controlled system for its author.

    Attributes:
        kind: `never-enabled`, `unused-requirement`, `unreachable-state`, `only-uncontrollable` or `deadlock`.
        message: One sentence.
        location: Place in the text, or None where it is about no single part.
        way: A shortest run to such a state, where there is one.
        stopped: Way that the behaviours would have to a state that is not reachable, and where it is stopped.
    """

    kind: str
    message: str
    location: Location | None
    way: Path | None = None
    stopped: Stopped | None = None
