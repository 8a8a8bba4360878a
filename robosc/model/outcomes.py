"""Outcomes of communications, for advice where one is written instead of a value."""

import msgspec

from robosc.expressions import BooleanType, Type
from robosc.language.phrases import OUTCOMES

DATA_ELSEWHERE = frozenset("msg message data payload result response feedback event answer reply received it".split())
"""Words of other languages for received data."""


class Outcome(msgspec.Struct, frozen=True):
    """Outcome of a communication.

    Attributes:
        is_requested: True if the robot requests it.
        has_data: True if data comes with its response.
        component: Its component.
        kept: Variables that its data is put into as it is, with their types.
        states: States that its events lead to, by the kind of the event, with the initial state of that component.
        free: A boolean variable of its component, or empty.
    """

    is_requested: bool
    has_data: bool
    component: str
    kept: dict[str, Type | None] = msgspec.field(default_factory=dict)
    states: dict[str, tuple[str, str]] = msgspec.field(default_factory=dict)
    free: str = ""

    def value(self, steps: tuple[str, ...], wanted: Type | None) -> str:
        """Return what can be read instead of the communication with some steps behind it; empty where nothing can."""
        event = OUTCOMES.get(steps[0].casefold()) if steps else None
        if event is not None and (self.is_requested or event == "response"):
            return self.states.get(event, ("", ""))[0]
        if steps and self.is_requested:
            return ""
        for name, type_ in self.kept.items():
            if not isinstance(wanted, BooleanType) or isinstance(type_, BooleanType):
                return name
        leading = [state for event in ("response", "request") if (state := self.states.get(event))]
        return next((state for state, initial in leading if state != initial or not self.is_requested), "")


__all__ = ["DATA_ELSEWHERE", "Outcome"]
