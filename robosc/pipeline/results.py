"""Results of tasks as values: the same ones from this machine and from a server."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING, Any

from robosc.errors import Diagnostic, RoboscError
from robosc.pipeline.files import FileName, given_path
from robosc.pipeline.findings import Findings
from robosc.source import visible
from robosc.tables import html_table, html_text

if TYPE_CHECKING:
    from robosc.certification.goals import GoalExplanation
    from robosc.explanation import EmptyExplanation, Explanation
    from robosc.targets import GeneratedFiles, Written


class SynthesisStatus(StrEnum):
    """Outcome of an attempt to make a supervisor."""

    SUPERVISOR = "supervisor"
    EMPTY = "empty"
    """No supervisor exists: a result about the model, not a fault."""
    MODEL_ERRORS = "model errors"
    UNSUPPORTED_MODEL = "unsupported model"


class VerificationStatus(StrEnum):
    """Outcome of a verification."""

    PASSED = "passed"
    FAILED = "failed"
    NOT_CHECKED = "not checked"
    """No check failed, but not all checks were made."""
    PROPERTY_ERRORS = "property errors"
    """A property cannot be understood; the diagnostics say why."""
    NO_SUPERVISOR = "no supervisor"
    """The model has errors, or no supervisor exists."""
    UNSUPPORTED_MODEL = "unsupported model"


class NothingGeneratedError(RoboscError):
    """The target has no files to write; the message says why."""


@dataclass(frozen=True, slots=True)
class GoalSummary:
    """Goals of a robot, and the strategy that reaches them.

    Attributes:
        aims: Everything that the robot aims at, in the words of the model and in the order of the strategy.
        assumptions: Everything that it assumes of its surroundings, in the words of the model.
        has_strategy: True if there is a strategy that reaches the goals; a supervision layer has none.
        modes: Number of modes of the strategy, one for each aim.
    """

    aims: tuple[str, ...]
    assumptions: tuple[str, ...]
    has_strategy: bool
    modes: int


@dataclass(frozen=True, slots=True)
class Summary:
    """A supervisor in figures and words.

    Attributes:
        controllable_events: Number of controllable events.
        uncontrollable_events: Number of uncontrollable events.
        states: Reachable states of the controlled system.
        transitions: Transitions between them, or None if they were not counted.
        added: Each controllable event with the condition that the supervisor adds.
        text: The summary as `robosc synth` prints it.
        goals: Goals of the robot, or None if it has none.
    """

    controllable_events: int
    uncontrollable_events: int
    states: int
    transitions: int | None
    added: tuple[tuple[str, str], ...]
    text: str
    goals: GoalSummary | None = None

    def __str__(self) -> str:
        return self.text.rstrip()


@dataclass(frozen=True, slots=True, repr=False)
class NoSupervisor:
    """Explanation of why there is no supervisor for a model that has errors or is not supported.

    Attributes:
        reason: Reason in one sentence; empty if the errors are the reason.
        diagnostics: Every finding about the model.
    """

    reason: str
    diagnostics: tuple[Diagnostic, ...]

    def __repr__(self) -> str:
        return f"<no supervisor: {self.reason or repr(Findings(self.diagnostics)).strip('<>')}>"

    def __str__(self) -> str:
        found = [str(self.diagnostics)] if isinstance(self.diagnostics, Findings) and self.diagnostics else []
        return "\n".join([*found, *([visible(self.reason)] if self.reason else [])])

    def _repr_html_(self) -> str:
        return html_text(str(self))


class Outcome:
    """Display of a task's result: its status, the findings and the reason; a subclass adds its product."""

    __slots__ = ()

    status: StrEnum
    diagnostics: tuple[Diagnostic, ...]
    reason: str

    def _product(self) -> object:
        """The product of the task, or None."""
        return None

    def _why(self) -> "EmptyExplanation | GoalExplanation | None":
        """An explanation, in addition to the reason, of why there is no product; None if there is none."""
        explanation: EmptyExplanation | GoalExplanation | NoSupervisor | None = getattr(self, "explanation", None)
        return None if isinstance(explanation, NoSupervisor) else explanation

    def __repr__(self) -> str:
        made = self._product()
        words = [str(self.status)] if made is None else [repr(made)]
        if made is None and self.reason:
            words.append(self.reason)
        if self.diagnostics:
            words.append(repr(Findings(self.diagnostics)).strip("<>"))
        return visible(f"<{type(self).__name__}: {'; '.join(words)}>")

    def __str__(self) -> str:
        parts: list[object] = [Findings(self.diagnostics) if type(self.diagnostics) is tuple else self.diagnostics]
        if not self.diagnostics:
            parts = []
        if self.reason:
            parts.append(visible(self.reason))
        made = self._product()
        parts += [item for item in (self._why() if made is None else made,) if item is not None]
        return "\n".join(str(part).rstrip() for part in parts) or str(self.status)

    def _repr_html_(self) -> str:
        parts = [Findings(self.diagnostics)._repr_html_()] if self.diagnostics else []
        made = self._product()
        shown = self._why() if made is None else made
        if made is None:
            parts.append(html_text(f"{self.status}: {self.reason}" if self.reason else str(self.status)))
        if shown is not None:
            show = getattr(shown, "_repr_html_", None)
            parts.append(html_text(str(shown)) if show is None else show())
        return "".join(parts)


@dataclass(frozen=True, slots=True, repr=False)
class Generation(Outcome):
    """Result of a generation.

    Attributes:
        status: Outcome of the synthesis.
        diagnostics: Every finding about the model, sorted by place.
        reason: Reason why there are no files, in one sentence; empty if there are files.
        files: The files, or None.
        explanation: Explanation of why no supervisor exists or goals cannot be reached, or None.
        target: The requested target; empty if it is not known.
    """

    status: SynthesisStatus
    diagnostics: tuple[Diagnostic, ...]
    reason: str
    files: "GeneratedFiles | None"
    explanation: "EmptyExplanation | GoalExplanation | None" = None
    target: str = ""

    def write(self, folder: FileName, *, force: bool = False) -> "Written":
        """Write the files into a folder, as `robosc generate` does.

        Args:
            folder: The folder; it is created if it does not exist.
            force: True if files that a user has changed are replaced, too.

        Raises:
            NothingGeneratedError: There are no files.
            OverwriteError: Writing would overwrite a user's changes, or the folder cannot be written.
        """
        if self.files is None:
            raise NothingGeneratedError(f"nothing was generated: {self.reason or self.status}")
        from robosc.targets import write_generated

        return write_generated(self.files, self.target, given_path(folder), force=force)

    def _product(self) -> object:
        return self.files


@dataclass(frozen=True, slots=True, repr=False)
class Explained(Outcome):
    """Result of an explanation.

    Attributes:
        status: Outcome of the synthesis.
        diagnostics: Every finding about the model, sorted by place.
        reason: Reason why there is no supervisor to explain, in one sentence; empty if its effects, or a missing
            supervisor, are explained.
        explanation: The explanation; a `GoalExplanation` if goals cannot be reached, a `NoSupervisor` if the model has
            other errors or is not supported.
    """

    status: SynthesisStatus
    diagnostics: Findings
    reason: str
    explanation: "Explanation | GoalExplanation | NoSupervisor"

    def _product(self) -> object:
        return None if isinstance(self.explanation, NoSupervisor) else self.explanation


@dataclass(frozen=True, slots=True, repr=False)
class Verification(Outcome):
    """Result of a verification.

    Attributes:
        status: Outcome of the verification.
        diagnostics: Every finding about the model or the properties, sorted by place.
        reason: Reason why there is no verdict, in one sentence; empty if there is one.
        report: Output of `robosc verify --json`, as values.
        text: Output of `robosc verify` for people; empty if only the report is known.
    """

    status: VerificationStatus
    diagnostics: tuple[Diagnostic, ...]
    reason: str
    report: Mapping[str, Any] = field(hash=False)
    text: str = field(default="", compare=False)

    @property
    def passed(self) -> bool:
        """True if every property holds and every check passed."""
        return self.status is VerificationStatus.PASSED

    @property
    def holds(self) -> tuple[bool, ...]:
        """The verdict on each property, in their order; empty if no properties were verified."""
        return tuple(bool(item["holds"]) for item in self.report.get("properties", ()))

    def __repr__(self) -> str:
        held = f": {sum(self.holds)} of {len(self.holds)} properties hold" if self.holds else ""
        return visible(f"<Verification: {self.status}{held}{f'; {self.reason}' if self.reason else ''}>")

    def _product(self) -> object:
        if self.text:
            return self.text
        if self.holds:
            return "\n".join(
                f"{'holds' if item['holds'] else 'FAILS'}  {item['property']}" for item in self.report["properties"]
            )
        if "checks" not in self.report:
            return None
        from robosc.certification.file_report import file_verification_text

        return file_verification_text(self.report)

    def _repr_html_(self) -> str:
        if not self.holds:
            return html_text(str(self))
        rows = [
            ("holds" if item["holds"] else "FAILS", item["name"] or "", item["property"], _run(item["run"]))
            for item in self.report["properties"]
        ]
        return html_table(("verdict", "name", "property", "run"), rows)


def _run(run: Mapping[str, Any] | None) -> str:
    if run is None:
        return ""
    return f"{run['kind']}: {', '.join(event or '(nothing can happen any more)' for event in run['events'])}"
