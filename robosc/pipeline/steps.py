"""Steps of a run: events with the data that they carried, and the states that they led to."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from robosc.certification.supervisor_file import StateInWords
from robosc.pipeline.received_data import NO_DATA


@dataclass(frozen=True, slots=True)
class Step:
    """One event of a run.

    Attributes:
        event: The event.
        data: Data that it carried as the model saw it, by name (`value.front`); None where a part was unknown.
        state: The state that it led to.
        provided: Data that a request sends, by the model's `provide`; None where the middleware's default is sent, or
            where it is unknown.
        skipped: Variables that kept their value, because what they were to take was unknown.
        unknown: Descriptions of what was unknown or moved into its range: parts of the data, what a request sends.
        is_controllable: True if it is one that the controller takes by itself.
        given: Data as it was given.
        reached: Numbers of the goals that have come true with it, from 1 on.
        chosen: Request that the strategy chooses in the state that it led to; None: it waits, or there is none.
        visits: Names of the visits of missions that were made with it, such as `visit 2 of mission rounds`.
        cancelling: Actions whose goal an executor asks with it to be cancelled.
    """

    event: str
    data: Mapping[str, Any] = field(hash=False)
    state: StateInWords = field(hash=False)
    provided: Any = field(default=None, hash=False)
    skipped: tuple[str, ...] = ()
    unknown: tuple[str, ...] = ()
    is_controllable: bool = False
    given: Any = field(default=NO_DATA, hash=False)
    reached: tuple[int, ...] = ()
    chosen: str | None = None
    visits: tuple[str, ...] = ()
    cancelling: tuple[str, ...] = ()

    def __str__(self) -> str:
        return f"{self.event}: {self.state}"


class SteppedRun(Protocol):
    """Run that is led step by step."""

    @property
    def state(self) -> StateInWords:
        """The current state."""

    @property
    def enabled(self) -> tuple[str, ...]:
        """Controllable events that are allowed now."""


def event_text(step: Step) -> str:
    """An event with the data that came with it: `level.response (value = 3)`, of an input variable `level (3)`."""
    if step.event in step.state.parts and list(step.data) == ["value"]:
        return f"{step.event} ({_value_text(step.data['value'])})"
    data = ", ".join(f"{name} = {_value_text(value)}" for name, value in step.data.items())
    return f"{step.event} ({data})" if data else step.event


def changes_text(before: StateInWords, after: StateInWords) -> str:
    """Changes between two states: `Base = driving, Base.charges = 2`."""
    old = before.parts
    return ", ".join(f"{name} = {_value_text(value)}" for name, value in after.parts.items() if old[name] != value)


def _value_text(value: object) -> str:
    if value is None:
        return "unknown"
    return str(value).lower() if isinstance(value, bool) else str(value)
