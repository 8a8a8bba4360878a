"""Questions about a controlled system, and their answers, as plain values."""

from enum import StrEnum

import msgspec

from robosc.automata.structure import EventCondition


class Cause(StrEnum):
    """Cause why an event can never happen: the first of these that explains it."""

    PLANT = "plant"
    """The plants by themselves never enable it, or taking it would always leave a variable's range."""
    REQUIREMENT = "requirement"
    """Under the event conditions the plants never get to where it is enabled and its own conditions are true."""
    INVARIANT = "invariant"
    """Synthesis keeps from it, and would not if there were no invariants."""
    SUPERVISOR = "supervisor"
    """Synthesis keeps from it: it is uncontrollable, blocks, or leads to where a variable can leave its range."""


class NeverEnabled(msgspec.Struct, frozen=True):
    """An event that can never happen.

    Attributes:
        event: The event.
        cause: Cause why it cannot.
        is_reached: True if it is allowed, but for its cause, in some state that is reached: of a requirement, under
            the event conditions, where the plants enable it; of an invariant or the supervisor, in the controlled
            system, where the plants enable it and its own conditions are true.
        invariants: Places in `System.invariants` of those that it would break at once.
    """

    event: str
    cause: Cause
    is_reached: bool
    invariants: tuple[int, ...] = ()


class Restriction(msgspec.Struct, frozen=True):
    """Event conditions and invariants that stand or fall together, such as all those of one written requirement.

    Attributes:
        conditions: Places in `System.conditions`.
        invariants: Places in `System.invariants`.
        watched: Further event conditions that show that the restriction is used: the plants enable the event, and the
            condition is not true.
    """

    conditions: tuple[int, ...] = ()
    invariants: tuple[int, ...] = ()
    watched: tuple[EventCondition, ...] = ()


class Questions(msgspec.Struct, frozen=True):
    """Questions about the controlled system.

    Attributes:
        events: Events to check: can they ever happen?
        restrictions: Restrictions to check: do they ever restrict?
        rivals: Groups of events of which no two should be possible together.
        locations: Automata with one of their locations to check: is it ever reached?
        prompted: Events to check: can they happen again and again without a prompt?
        prompts: The events that are prompts.
        changing: Those of the events to check that only count where they change the state.
        silent: Events that are taken before all others, as an executor does.
    """

    events: tuple[str, ...] = ()
    restrictions: tuple[Restriction, ...] = ()
    rivals: tuple[tuple[str, ...], ...] = ()
    locations: tuple[tuple[str, str], ...] = ()
    prompted: tuple[str, ...] = ()
    prompts: frozenset[str] = frozenset()
    changing: frozenset[str] = frozenset()
    silent: tuple[str, ...] = ()


class EnabledTogether(msgspec.Struct, frozen=True):
    """Two rivals that can both happen in one state.

    Attributes:
        first: The rival that stands earlier in its group.
        second: The other one.
        trace: Events of a shortest run from the initial state to such a state.
    """

    first: str
    second: str
    trace: tuple[str, ...]


class Unprompted(msgspec.Struct, frozen=True):
    """An event that can happen again and again without a prompt.

    Attributes:
        event: The event.
        trace: Events of a shortest run to a state from which it can.
        loop: The event, and those that follow until it can happen again, none of them a prompt.
    """

    event: str
    trace: tuple[str, ...]
    loop: tuple[str, ...]


class Answers(msgspec.Struct, frozen=True):
    """Answers that were found; each part in the order of its questions.

    Attributes:
        never: Events that can never happen.
        unused: Places in `Questions.restrictions` of those that never restrict.
        together: Rivals that are possible together, by group, then by the second, then by the first.
        unreached: Automata with a location in which they never are.
        unprompted: Events that need no prompt to happen again and again, without those of an earlier loop.
    """

    never: tuple[NeverEnabled, ...] = ()
    unused: tuple[int, ...] = ()
    together: tuple[EnabledTogether, ...] = ()
    unreached: tuple[tuple[str, str], ...] = ()
    unprompted: tuple[Unprompted, ...] = ()
