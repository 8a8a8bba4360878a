"""Content of responses: findings and figures, as messages."""

from collections.abc import Iterable

from robosc.automata import to_automata
from robosc.certification import OutcomeStatus
from robosc.conditions.summary import added_texts, summary_text
from robosc.errors import Diagnostic, RelatedPlace, Severity
from robosc.pipeline.goals import goal_summary
from robosc.source import Location
from robosc.supervisor import Supervisor
from robosc.synthesis import Statistics
from robosc_api.v1 import synthesis_pb2 as pb

_SEVERITIES = {
    Severity.ERROR: pb.SEVERITY_ERROR,
    Severity.WARNING: pb.SEVERITY_WARNING,
    Severity.NOTE: pb.SEVERITY_NOTE,
}

STATUSES = {
    OutcomeStatus.SUPERVISOR: pb.SYNTHESIS_STATUS_SUPERVISOR,
    OutcomeStatus.EMPTY: pb.SYNTHESIS_STATUS_EMPTY,
    OutcomeStatus.MODEL_ERRORS: pb.SYNTHESIS_STATUS_MODEL_ERRORS,
}


def findings(diagnostics: Iterable[Diagnostic]) -> list[pb.Diagnostic]:
    """Return all findings, in their order."""
    return [
        pb.Diagnostic(
            severity=_SEVERITIES[item.severity],
            code=item.code,
            message=item.message,
            location=_location(item.location) if item.location else None,
            mend=item.fix,
            related=map(_related, item.related),
        )
        for item in diagnostics
    ]


def _location(location: Location) -> pb.Location:
    return pb.Location(file=location.file, line=location.line, column=location.column, length=location.length)


def _related(place: RelatedPlace) -> pb.RelatedPlace:
    return pb.RelatedPlace(message=place.message, location=_location(place.location))


def statistics(found: Statistics) -> pb.Statistics:
    """Return the statistics of the work."""
    return pb.Statistics(
        engine=found.engine,
        state_bits=found.state_bits,
        iterations=found.iterations,
        peak_nodes=found.peak_nodes,
    )


def summary(supervisor: Supervisor) -> pb.Summary:
    """Return the summary of a supervisor, in numbers and texts."""
    system = to_automata(supervisor.model, supervisor.deployment)
    controllable = sum(event.is_controllable for event in system.events)
    return pb.Summary(
        controllable_events=controllable,
        uncontrollable_events=len(system.events) - controllable,
        states=supervisor.certificate.states,
        transitions=supervisor.certificate.transitions or "",
        added=[
            pb.AddedCondition(event=event, condition=condition)
            for event, condition in added_texts(supervisor, system).items()
        ],
        text=summary_text(supervisor),
        goals=_goals(supervisor),
    )


def _goals(supervisor: Supervisor) -> pb.Goals | None:
    found = goal_summary(supervisor)
    if found is None:
        return None
    return pb.Goals(aims=found.aims, assumptions=found.assumptions, has_strategy=found.has_strategy, modes=found.modes)
