"""Content of responses: findings and figures, as messages."""

from collections.abc import Iterable
from typing import Any

from robosc.automata import to_automata
from robosc.certification import OutcomeStatus
from robosc.certification.goals import GoalExplanation, NearestPlace
from robosc.conditions.summary import added_texts, summary_text
from robosc.errors import Diagnostic, RelatedPlace, Severity
from robosc.explanation import EmptyExplanation, Explanation, to_text
from robosc.explanation.parts import Part
from robosc.expressions import Value
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
            accepted=item.accepted or "",
        )
        for item in diagnostics
    ]


def reasons(explanation: object) -> dict[str, Any]:
    """Return the fields `explanation` and `goals` of a result; empty where there is no explanation of either kind."""
    match explanation:
        case GoalExplanation():
            return {"goals": goal_explanation(explanation)}
        case EmptyExplanation() | Explanation():
            return {"explanation": to_text(explanation)}
    return {}


def goal_explanation(found: GoalExplanation) -> pb.GoalExplanation:
    """Return the explanation of why goals cannot be reached, without the counter-strategy."""
    return pb.GoalExplanation(
        goals=map(_part, found.goals),
        is_hopeless=found.is_hopeless,
        blamed=map(_part, found.blamed),
        is_minimal=found.is_minimal,
        helpful=found.helpful,
        nearest=None if found.nearest is None else _nearest(found.nearest),
        has_counter_strategy=found.has_counter_strategy,
    )


def _part(part: Part) -> pb.ModelPart:
    return pb.ModelPart(
        kind=part.kind, text=part.text, location=_location(part.location) if part.location is not None else None
    )


def _nearest(found: NearestPlace) -> pb.NearestState:
    return pb.NearestState(
        goal=found.goal,
        is_reached=found.is_reached,
        has_others=found.has_others,
        events=found.events,
        state=[_value(name, value) for name, value in found.state.items()],
        missing=found.missing,
    )


def _value(name: str, value: Value) -> pb.PartValue:
    match value:
        case bool():
            return pb.PartValue(name=name, truth=value)
        case int():
            return pb.PartValue(name=name, integer=value)
        case float():
            return pb.PartValue(name=name, number=value)
    return pb.PartValue(name=name, text=value)


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
        race=[
            pb.Strategy(order=item.order, search=item.search, nodes=item.nodes, won=item.won, given_up=item.given_up)
            for item in found.race
        ],
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
