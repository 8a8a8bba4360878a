"""Diagnostics (findings about a user's model) and the tree of exceptions.

    RoboscError
    |-- LanguageError            the model has errors; carries every Diagnostic
    |-- UnsupportedModelError    a correct model outside what a stage or target handles
    |-- InvalidSupervisorError   a supervisor file that cannot be trusted or read
    |-- NodeLimitError           decision diagrams exceeded the limit of nodes
    |-- UnknownNameError         a name that nothing has; a KeyError
    |-- SynthesisCancelled       the caller asked long work to stop
    `-- InternalError            a fault of RoboSC itself; asks for a report

A user's mistake is a `Diagnostic` value. A stage collects all of them, sorted by place, and raises
one `LanguageError` (or returns them, where a result with warnings exists).
"""

from collections.abc import Iterable
from enum import StrEnum

import msgspec

from robosc.source import Bundle, Location, visible


class Severity(StrEnum):
    """Severity of a finding; only errors make a model unusable."""

    ERROR = "error"
    WARNING = "warning"
    NOTE = "note"


class RelatedPlace(msgspec.Struct, frozen=True):
    """Another place that explains a finding, such as a first definition."""

    message: str
    location: Location


class Diagnostic(msgspec.Struct, frozen=True):
    """One finding about a model.

    Attributes:
        severity: Error, warning or note.
        code: Stable, documented code such as `unknown-name`.
        message: Description of what is wrong, one sentence without a full stop.
        location: Place in the text, or None where no text is at hand (a missing file).
        fix: One sentence on how to fix it.
        related: Other places that explain the finding.
        accepted: Reason for which the text accepts the finding; None where it does not.
    """

    severity: Severity
    code: str
    message: str
    location: Location | None
    fix: str
    related: tuple[RelatedPlace, ...] = ()
    accepted: str | None = None

    def __str__(self) -> str:
        place = f"{self.location}: " if self.location else ""
        accepted = "" if self.accepted is None else f" (accepted: {self.accepted})"
        return visible(f"{place}{self.severity}: {self.message} [{self.code}]{accepted}")

    def render(self, bundle: Bundle | None = None) -> str:
        """The finding for a terminal: text, source line, caret, how to fix it, related places."""
        lines = [str(self), *_excerpt(self.location, bundle), visible(f"  = fix: {self.fix}")]
        for place in self.related:
            lines.append(visible(f"{place.location}: note: {place.message}"))
            lines.extend(_excerpt(place.location, bundle))
        return "\n".join(lines)

    def to_json(self) -> dict[str, object]:
        """The finding as plain JSON values."""
        return {
            "severity": str(self.severity),
            "code": self.code,
            "message": self.message,
            "fix": self.fix,
            **_place_to_json(self.location),
            "related": [{"message": place.message, **_place_to_json(place.location)} for place in self.related],
            **({} if self.accepted is None else {"accepted": self.accepted}),
        }


def _place_to_json(location: Location | None) -> dict[str, object]:
    if location is None:
        return {"file": None, "line": None, "column": None, "length": None}
    return {
        "file": location.file,
        "line": location.line,
        "column": location.column,
        "length": location.length,
    }


_MAXIMUM_EXCERPT = 200


def _excerpt(location: Location | None, bundle: Bundle | None) -> list[str]:
    """The source line of `location` and a caret line under it; nothing where the text is not at hand."""
    file = bundle.file(location.file) if bundle and location else None
    if file is None or location is None:
        return []
    text = file.line(location.line)
    # A tab keeps its width above and below, so the caret stays under its token; a very long line is cut around it.
    start = max(0, location.column - 1 - _MAXIMUM_EXCERPT // 2) if len(text) > _MAXIMUM_EXCERPT else 0
    shown = text[start : start + _MAXIMUM_EXCERPT]
    before = "".join("\t" if char == "\t" else " " for char in text[start : location.column - 1])
    width = max(1, min(location.length, len(shown) - len(before)))
    printable = "".join(char if char.isprintable() or char == "\t" else "?" for char in shown)
    return [f"  | {printable}", f"  | {before}{'^' * width}"]


def sorted_diagnostics(diagnostics: Iterable[Diagnostic]) -> tuple[Diagnostic, ...]:
    """Diagnostics by file and place, without doubles; those without a place come first."""

    def key(diagnostic: Diagnostic) -> tuple[str, int, int, str, str]:
        location = diagnostic.location or Location("", 0, 0)
        return (location.file, location.line, location.column, diagnostic.code, diagnostic.message)

    return tuple(sorted(dict.fromkeys(diagnostics), key=key))


class RoboscError(Exception):
    """Root of every error that RoboSC raises on purpose."""


class LanguageError(RoboscError):
    """The model has errors.

    Attributes:
        diagnostics: Every finding, sorted by place; at least one is an error.
    """

    def __init__(self, diagnostics: Iterable[Diagnostic]) -> None:
        self.diagnostics = sorted_diagnostics(diagnostics)
        super().__init__("\n".join(str(diagnostic) for diagnostic in self.diagnostics))


class UnsupportedModelError(RoboscError):
    """A correct model that lies outside what a stage or a target handles."""


class InvalidSupervisorError(RoboscError):
    """A supervisor file that is malformed, of an unknown version, or inconsistent."""


class UnknownNameError(RoboscError, KeyError):
    """A name that nothing has; the message names the nearest one that there is."""

    def __str__(self) -> str:
        # A KeyError would show its message as a Python literal.
        return Exception.__str__(self)


class InvalidExpressionError(RoboscError):
    """A resolved expression that names what is not there, or whose types do not fit."""


class InvalidSystemError(RoboscError):
    """Automata that do not fit together: see `robosc.automata.check_system`."""


class NodeLimitError(RoboscError):
    """The decision diagrams exceeded the limit of nodes."""


class SynthesisCancelled(RoboscError):
    """The caller asked long work to stop."""


class InternalError(RoboscError):
    """A fault of RoboSC itself."""

    def __init__(self, message: str) -> None:
        super().__init__(f"internal error, please report it: {message}")
