"""Reasons why there is no supervisor, as JSON values."""

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from robosc.certification.goals import GoalExplanation
    from robosc.explanation import EmptyExplanation


class Reasons(Protocol):
    """Object that knows why there is no supervisor."""

    @property
    def reason(self) -> str:
        """Reason why there is no supervisor, in one sentence; empty if there is one."""

    @property
    def explanation(self) -> "EmptyExplanation | GoalExplanation | None":
        """Explanation of what is to blame if no supervisor exists, or goals cannot be reached."""


def reasons_json(outcome: Reasons) -> dict[str, object]:
    """Return the reason why there is no supervisor, as JSON values."""
    from robosc.explanation import EmptyExplanation, document

    why = outcome.explanation
    if why is None or isinstance(why, EmptyExplanation):
        return {"reason": outcome.reason, "explanation": None if why is None else document(why)}
    return {"reason": outcome.reason, "explanation": None, "goals": why.document()}
