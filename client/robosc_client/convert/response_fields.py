"""Conversion of parts of responses to checked values."""

from collections.abc import Callable, Mapping, Sequence

from robosc.certification.goals import GoalExplanation, NearestPlace
from robosc.errors import Diagnostic, RelatedPlace, Severity
from robosc.explanation import EmptyExplanation, Explanation, from_text, whole_from_text
from robosc.explanation.parts import Part
from robosc.expressions import Value
from robosc.pipeline.findings import Findings
from robosc.source import Bundle, Location, visible
from robosc.targets import TargetInfo
from robosc_api.v1 import synthesis_pb2 as pb
from robosc_client.errors import malformed
from robosc_client.results import (
    GoalSummary,
    Progress,
    ServerInfo,
    ServerLimits,
    Statistics,
    Strategy,
    Summary,
    SynthesisStatus,
    VerificationStatus,
)

MAXIMUM_SHOWN = 1000
"""Maximum number of characters of a progress line."""

_MAXIMUM_ITEMS = 100_000
"""Maximum number of findings, their places, and events of one response; small messages could contain millions."""

_MAXIMUM_TARGETS = 1000

_MAXIMUM_DIGITS = 4000

_SEVERITIES = {
    pb.SEVERITY_ERROR: Severity.ERROR,
    pb.SEVERITY_WARNING: Severity.WARNING,
    pb.SEVERITY_NOTE: Severity.NOTE,
}
_STATUSES = {
    pb.SYNTHESIS_STATUS_SUPERVISOR: SynthesisStatus.SUPERVISOR,
    pb.SYNTHESIS_STATUS_EMPTY: SynthesisStatus.EMPTY,
    pb.SYNTHESIS_STATUS_MODEL_ERRORS: SynthesisStatus.MODEL_ERRORS,
    pb.SYNTHESIS_STATUS_UNSUPPORTED_MODEL: SynthesisStatus.UNSUPPORTED_MODEL,
}
_VERDICTS = {
    pb.VERIFICATION_STATUS_PASSED: VerificationStatus.PASSED,
    pb.VERIFICATION_STATUS_FAILED: VerificationStatus.FAILED,
    pb.VERIFICATION_STATUS_NOT_CHECKED: VerificationStatus.NOT_CHECKED,
    pb.VERIFICATION_STATUS_PROPERTY_ERRORS: VerificationStatus.PROPERTY_ERRORS,
    pb.VERIFICATION_STATUS_NO_SUPERVISOR: VerificationStatus.NO_SUPERVISOR,
    pb.VERIFICATION_STATUS_UNSUPPORTED_MODEL: VerificationStatus.UNSUPPORTED_MODEL,
}
_EXPLAINED = {
    pb.EXPLANATION_STATUS_SUPERVISOR: SynthesisStatus.SUPERVISOR,
    pb.EXPLANATION_STATUS_EMPTY: SynthesisStatus.EMPTY,
    pb.EXPLANATION_STATUS_MODEL_ERRORS: SynthesisStatus.MODEL_ERRORS,
    pb.EXPLANATION_STATUS_UNSUPPORTED_MODEL: SynthesisStatus.UNSUPPORTED_MODEL,
    pb.EXPLANATION_STATUS_NOT_THERE: None,
}


def require_at_most(most: int, count: int, what: str) -> None:
    """Do nothing if a number of items is within its limit; checked before the items are converted.

    Raises:
        ServiceError: There are too many.
    """
    if count > most:
        raise malformed(f"it has more than {most} {what}")


def diagnostics_of(
    messages: Sequence[pb.Diagnostic], bundle: Bundle | None = None, accepted: Sequence[pb.Diagnostic] = ()
) -> Findings:
    """Return findings as the core's values.

    Args:
        messages: The findings.
        bundle: Texts that they are about, or None if those are not at hand.
        accepted: The findings that the texts accept.

    Raises:
        ServiceError: A severity is unknown, or there are too many.
    """
    for found in (messages, accepted):
        require_at_most(_MAXIMUM_ITEMS, len(found), "findings")
        require_at_most(_MAXIMUM_ITEMS, sum(len(message.related) for message in found), "places")
    return Findings(map(_diagnostic, messages), bundle, map(_diagnostic, accepted))


def progress_of(message: pb.Progress) -> Progress:
    """Return the progress of work: two short texts that are harmless on a terminal."""
    return Progress(visible(message.stage[:MAXIMUM_SHOWN]), visible(message.message[:MAXIMUM_SHOWN]))


def status_of(number: pb.SynthesisStatus) -> SynthesisStatus:
    """Return the status with which a synthesis ended.

    Raises:
        ServiceError: The number is unknown.
    """
    return _known(_STATUSES, number, "status")


def verification_status_of(number: pb.VerificationStatus) -> VerificationStatus:
    """Return the status that a verification found; raises as `status_of`."""
    return _known(_VERDICTS, number, "status")


def explanation_status_of(number: pb.ExplanationStatus) -> SynthesisStatus | None:
    """Return the status of a synthesis that was to be explained; None: a part named in the request does not exist.

    Raises:
        ServiceError: The number is unknown.
    """
    return _known(_EXPLAINED, number, "status")


def _known[Number: int, Meaning](meanings: Mapping[Number, Meaning], number: Number, what: str) -> Meaning:
    if number not in meanings:
        raise malformed(f"unknown {what} {number}")
    return meanings[number]


def whole_explanation_of(text: str) -> Explanation:
    """Return the explanation of what synthesis did.

    Raises:
        ServiceError: The text is no such document.
    """
    return _read(whole_from_text, text)


def explanation_of(text: str) -> EmptyExplanation | None:
    """Return the explanation of a missing supervisor, or None if there is none.

    Raises:
        ServiceError: The text is no such document.
    """
    return _read(from_text, text) if text else None


def _read[Document](reader: Callable[[str], Document], text: str) -> Document:
    try:
        return reader(text)
    except ValueError as error:
        raise malformed(str(error)) from error


def reasons_of(
    status: SynthesisStatus, message: pb.SynthesisResult | pb.GenerationResult | pb.ExplorationResult
) -> EmptyExplanation | GoalExplanation | None:
    """Return the explanation of why there is no supervisor, or None if there is none.

    Raises:
        ServiceError: It is invalid, or does not belong to the status.
    """
    if not message.HasField("goals"):
        return explanation_of(message.explanation)
    if status is not SynthesisStatus.MODEL_ERRORS or message.explanation:
        raise malformed("its status contradicts its explanation")
    return goal_explanation_of(message.goals)


def goal_explanation_of(message: pb.GoalExplanation) -> GoalExplanation:
    """Return the explanation of why goals cannot be reached.

    Raises:
        ServiceError: It explains nothing, or has too many parts.
    """
    nearest = message.nearest
    for items in (message.goals, message.blamed, message.helpful, nearest.events, nearest.state, nearest.missing):
        require_at_most(_MAXIMUM_ITEMS, len(items), "parts of an explanation")
    if not message.goals:
        raise malformed("an explanation has no goals")
    return GoalExplanation(
        goals=tuple(map(_part, message.goals)),
        is_hopeless=message.is_hopeless,
        blamed=tuple(map(_part, message.blamed)),
        is_minimal=message.is_minimal,
        helpful=tuple(message.helpful),
        nearest=_nearest(nearest) if message.HasField("nearest") else None,
        has_counter_strategy=message.has_counter_strategy,
    )


def _nearest(message: pb.NearestState) -> NearestPlace:
    if not (message.is_reached or message.missing):
        raise malformed("an explanation does not say what is not allowed")
    return NearestPlace(
        message.goal,
        message.is_reached,
        message.has_others,
        tuple(message.events),
        {item.name: _value(item) for item in message.state},
        tuple(message.missing),
    )


def _value(message: pb.PartValue) -> Value:
    kind = message.WhichOneof("value")
    if kind is None:
        raise malformed("a part of a state has no value")
    value: Value = getattr(message, kind)
    return value


def _part(message: pb.ModelPart) -> Part:
    return Part(message.kind, message.text, _location(message.location) if message.HasField("location") else None)


def summary_of(message: pb.Summary) -> Summary:
    """Return the summary of a supervisor, in numbers and texts.

    Raises:
        ServiceError: A count is invalid, or there are too many events.
    """
    require_at_most(_MAXIMUM_ITEMS, len(message.added), "events")
    return Summary(
        controllable_events=message.controllable_events,
        uncontrollable_events=message.uncontrollable_events,
        states=_count(message.states),
        transitions=_count(message.transitions) if message.transitions else None,
        added=tuple((item.event, item.condition) for item in message.added),
        text=message.text,
        goals=_goals_of(message.goals) if message.HasField("goals") else None,
    )


def _goals_of(message: pb.Goals) -> GoalSummary:
    for items in (message.aims, message.assumptions):
        require_at_most(_MAXIMUM_ITEMS, len(items), "goals")
    return GoalSummary(tuple(message.aims), tuple(message.assumptions), message.has_strategy, message.modes)


def statistics_of(message: pb.Statistics) -> Statistics:
    """Return the statistics of a synthesis."""
    race = tuple(Strategy(item.order, item.search, item.nodes, item.won, item.given_up) for item in message.race)
    return Statistics(message.engine, message.state_bits, message.iterations, message.peak_nodes, race)


def targets_of(message: pb.ListTargetsResponse) -> tuple[TargetInfo, ...]:
    """Return the targets that can be generated; raises ServiceError for too many."""
    require_at_most(_MAXIMUM_TARGETS, len(message.targets), "targets")
    return tuple(TargetInfo(item.name, item.description) for item in message.targets)


def server_info_of(message: pb.GetVersionResponse) -> ServerInfo:
    """Return the description of a server; raises ServiceError for too many engines."""
    require_at_most(_MAXIMUM_TARGETS, len(message.engines), "engines")
    limits = message.limits
    return ServerInfo(
        version=message.version,
        engines=tuple(message.engines),
        limits=ServerLimits(
            bundle_bytes=limits.bundle_bytes,
            bundle_files=limits.bundle_files,
            task_seconds=limits.task_seconds,
            task_cpu_seconds=limits.task_cpu_seconds,
            task_memory_bytes=limits.task_memory_bytes,
            task_nodes=limits.task_nodes,
            result_bytes=limits.result_bytes,
            waiting_tasks=limits.waiting_tasks,
            waiting_tasks_per_caller=limits.waiting_tasks_per_caller,
            retention_seconds=limits.retention_seconds,
        ),
    )


def _location(message: pb.Location) -> Location:
    return Location(message.file, message.line, message.column, message.length)


def _diagnostic(message: pb.Diagnostic) -> Diagnostic:
    return Diagnostic(
        severity=_known(_SEVERITIES, message.severity, "severity"),
        code=message.code,
        message=message.message,
        location=_location(message.location) if message.HasField("location") else None,
        fix=message.mend,
        related=tuple(RelatedPlace(place.message, _location(place.location)) for place in message.related),
        accepted=message.accepted or None,
    )


def _count(text: str) -> int:
    if not (text.isascii() and text.isdigit() and len(text) <= _MAXIMUM_DIGITS):
        raise malformed("a count is not a decimal number")
    return int(text)
