"""A target's refusal of a model: some warnings of the check are errors for a target."""

from collections.abc import Sequence
from dataclasses import dataclass

from msgspec.structs import replace

from robosc.errors import Diagnostic, Severity
from robosc.targets.registry import errors_for


@dataclass(frozen=True, slots=True)
class TargetRefusal:
    """A target's refusal of a model that synthesis can do.

    Attributes:
        target: Name of the target.
        diagnostics: Every finding about the model; those that the target cannot do are errors.
    """

    target: str
    diagnostics: tuple[Diagnostic, ...]


def apply_target_errors(diagnostics: Sequence[Diagnostic], target: str) -> TargetRefusal | None:
    """Return the refusal of a target for which some findings about a model are errors, or None if none is.

    Raises:
        UnknownTargetError: There is no such target.
    """
    codes = errors_for(target)
    if not any(item.code in codes for item in diagnostics):
        return None
    return TargetRefusal(
        target,
        tuple(replace(item, severity=Severity.ERROR) if item.code in codes else item for item in diagnostics),
    )
