"""Conversion of responses to the values of the core, so that client and `robosc` print and write the same."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal

import msgspec
from msgspec import UNSET, UnsetType

from robosc.automata import to_automata
from robosc.automata.semantics import Semantics
from robosc.automata.state import Subject, subject_domain, subjects
from robosc.automata.structure import System
from robosc.certification import OutcomeStatus, SynthesisOutcome
from robosc.certification.goals import GoalExplanation
from robosc.errors import InvalidSupervisorError, LanguageError, UnsupportedModelError
from robosc.explanation import EmptyExplanation
from robosc.exploration import Graph, GraphState, graph_columns, marks
from robosc.expressions import Value
from robosc.json_documents import json_text
from robosc.model.check import check
from robosc.model.structure import Deployment, Model
from robosc.model_checking import Property, Verdict, properties_of
from robosc.model_checking.outcome import EvidenceRun, Remainder, RunKind
from robosc.pipeline.automata_files import check_automata_file
from robosc.pipeline.exploring import Exploration as AutomataExploration
from robosc.pipeline.findings import Findings
from robosc.pipeline.loading import LoadedAutomata
from robosc.pipeline.systems import SystemSupervisor, SystemSynthesis, decode_system
from robosc.source import Bundle, SourceFile, visible
from robosc.supervisor import Supervisor, decode
from robosc_client.convert.response_fields import explanation_of
from robosc_client.errors import ServiceError, malformed
from robosc_client.results import (
    Exploration,
    Generation,
    StateGraph,
    StateValues,
    Synthesis,
    SynthesisStatus,
    Verification,
    VerificationStatus,
)


def outcome_from_response(result: Synthesis | Generation | Exploration, content: bytes = b"") -> SynthesisOutcome:
    """Return the outcome of a synthesis on the server.

    Args:
        result: Result of a synthesis.
        content: The supervisor's file; empty: there is no supervisor.

    Raises:
        UnsupportedModelError: The model is correct, but cannot be handled.
        ServiceError: The server's supervisor is invalid.
    """
    if result.status is SynthesisStatus.UNSUPPORTED_MODEL:
        raise UnsupportedModelError(result.reason)
    found = result.diagnostics
    return SynthesisOutcome(
        OutcomeStatus(str(result.status)),
        decoded(content) if content else None,
        found,
        reason=visible(result.reason),
        explanation=result.explanation,
        accepted=found.accepted if isinstance(found, Findings) else (),
    )


def decoded(content: bytes) -> Supervisor:
    """Return the supervisor in a file that a server has made.

    Raises:
        ServiceError: It is not valid.
    """
    return _decoded(content, decode)


def automata_synthesis_of(found: Synthesis, model: LoadedAutomata) -> SystemSynthesis:
    """Return the synthesis of automata that the server made.

    Raises:
        ServiceError: The supervisor is invalid, or belongs to other automata.
    """
    supervisor = automata_supervisor_of(found.supervisor) if found.supervisor else None
    if supervisor is not None and supervisor.system != check_automata_file(model).system:
        raise ServiceError("the server's supervisor is refused: it was made of other automata")
    diagnostics, reason = Findings(found.diagnostics, model), visible(found.reason)
    statistics = None if supervisor is None else supervisor.statistics
    return SystemSynthesis(found.status, reason, supervisor, statistics, diagnostics, _of_automata(found))


def automata_supervisor_of(content: bytes) -> SystemSupervisor:
    """Return the supervisor of automata in a file that a server has made.

    Raises:
        ServiceError: It is not valid.
    """
    return _decoded(content, decode_system)


def _decoded[S](content: bytes, decoder: Callable[[bytes], S]) -> S:
    try:
        return decoder(content)
    except InvalidSupervisorError as error:
        raise ServiceError(f"the server's supervisor is refused: {error}") from error


def automata_exploration_of(found: Exploration, model: LoadedAutomata) -> AutomataExploration:
    """Return the exploration of automata that the server made.

    Raises:
        ServiceError: The graph is of other automata.
    """
    graph = None
    if found.graph is not None:
        system = check_automata_file(model).system
        if system is None:
            raise malformed("it has a result for a model that has errors")
        graph = _automata_graph(found.graph, system)
    diagnostics = Findings(found.diagnostics, model)
    return AutomataExploration(found.status, diagnostics, visible(found.reason), graph, _of_automata(found))


def _of_automata(found: Synthesis | Exploration) -> EmptyExplanation | None:
    """Return the explanation of why there is no supervisor of automata.

    Raises:
        ServiceError: It explains goals, which automata do not have.
    """
    if isinstance(found.explanation, GoalExplanation):
        raise malformed("the explanation is of a model in another language")
    return found.explanation


def _automata_graph(found: StateGraph, system: System) -> Graph:
    semantics, places = Semantics(system), subjects(system)
    domains = [subject_domain(system, subject) for subject in places]
    names = {event.name for event in system.events}

    def graph_state(given: StateValues) -> GraphState:
        read: dict[Subject | str, Value] = {}
        read.update(given.variables.items())
        read.update((Subject(name), place) for name, place in given.components.items())
        try:
            state = tuple(read[subject if subject.variable is None else str(subject)] for subject in places)
        except KeyError as error:
            raise malformed("the graph belongs to other automata") from error
        is_whole = len(read) == len(places) and not given.communications and names.issuperset(given.enabled)
        if not is_whole or not all(value in domain for value, domain in zip(state, domains, strict=True)):
            raise malformed("the graph belongs to other automata")
        values = dict(zip(places, state, strict=True))
        return GraphState(
            components={name.automaton: str(value) for name, value in values.items() if name.variable is None},
            variables={str(name): value for name, value in values.items() if name.variable is not None},
            communications={},
            enabled=given.enabled,
            is_marked=semantics.is_marked(state),
        )

    if not names.issuperset(event for _, event, _ in found.transitions):
        raise malformed("the graph belongs to other automata")
    return Graph(
        system.name,
        found.initial_states or (found.initial,),
        graph_columns(system, None),
        tuple(map(graph_state, found.states)),
        found.transitions,
    )


class _AutomataFault(msgspec.Struct):
    """A fault in a report about a supervisor of automata."""

    check: str
    message: str
    trace: list[str]


class _AutomataReport(msgspec.Struct):
    """A report about a supervisor of automata."""

    status: Literal["passed", "failed", "not checked"]
    system: str
    checks: dict[str, Literal["passed", "failed", "not checked"]]
    faults: list[_AutomataFault]
    method: str


class _NoReport(msgspec.Struct):
    """A report that there is not a supervisor of automata to verify."""

    status: Literal["empty", "model errors"]
    explanation: dict[str, Any] | None


def require_automata_report(found: Verification) -> Verification:
    """Return a verification of automata, with a reason that is harmless on a terminal, if its report is valid.

    Raises:
        ServiceError: The report is invalid.
    """
    if found.status is VerificationStatus.UNSUPPORTED_MODEL:
        return found
    is_none = found.status is VerificationStatus.NO_SUPERVISOR
    try:
        if is_none:
            blame = msgspec.convert(found.report, type=_NoReport).explanation
            explanation_of("" if blame is None else json_text(blame))
        elif msgspec.convert(found.report, type=_AutomataReport).status != str(found.status):
            raise malformed("its status contradicts its report")
    except msgspec.ValidationError as error:
        raise malformed(f"the report is invalid: {error}") from error
    return replace(found, reason=visible(found.reason))


def require_made_for(supervisor: Supervisor, bundle: Bundle, deployment: Deployment) -> None:
    """Do nothing if a supervisor was made of these texts, for this deployment.

    A signature proves the origin of a supervisor, not its purpose: supervisors of other robots are signed as well.

    Raises:
        ServiceError: It was made of other texts, or for another deployment.
    """
    if supervisor.certificate.bundle_sha256 != bundle.digest:
        raise ServiceError("the server's supervisor is refused: it was made from other files")
    require_deployment(supervisor, deployment)


def require_deployment(supervisor: Supervisor, deployment: Deployment) -> None:
    """Do nothing if a supervisor was made for this deployment.

    Raises:
        ServiceError: It was made for another deployment.
    """
    if {supervisor.certificate.deployment, supervisor.deployment} != {deployment}:
        raise ServiceError(f"the server's supervisor is refused: it was made for another deployment than {deployment}")


def graph_of(found: StateGraph, bundle: Bundle, deployment: Deployment) -> Graph:
    """Return the server's graph of a model's robot.

    Raises:
        ServiceError: It is a graph of another robot.
    """
    model = _model(bundle)
    system = to_automata(model, deployment)
    columns, is_marked = graph_columns(system, model), marks(system, model)
    states = tuple(
        GraphState(
            components=_printable(state.components),
            variables={visible(name): _printable_value(value) for name, value in state.variables.items()},
            communications=_printable(state.communications),
            enabled=tuple(map(visible, state.enabled)),
            is_marked=is_marked(state.components, state.communications),
        )
        for state in found.states
    )
    if any(len((*item.components, *item.variables, *item.communications)) != len(columns) for item in states):
        raise malformed("the graph belongs to another robot")
    transitions = tuple((source, visible(event), target) for source, event, target in found.transitions)
    return Graph(model.name, (found.initial,), columns, states, transitions)


def _printable(items: Mapping[str, str]) -> dict[str, str]:
    return {visible(name): visible(text) for name, text in items.items()}


def _printable_value(value: Value) -> Value:
    return visible(value) if isinstance(value, str) else value


class _State(msgspec.Struct, forbid_unknown_fields=True):
    """A state in a report."""

    components: dict[str, str]
    variables: dict[str, Value]
    communications: dict[str, str]


class _Fault(msgspec.Struct):
    """A fault in a report."""

    check: str
    message: str
    # Absent without a trace, and never null.
    trace: list[str] | UnsetType = UNSET
    shortest: bool | UnsetType = UNSET
    state: _State | UnsetType = UNSET


class _Recheck(msgspec.Struct):
    """A report about a supervisor that was given."""

    status: Literal["passed", "failed", "not checked"]
    model: str
    deployment: str
    checks: dict[str, Literal["passed", "failed", "not checked"]]
    faults: list[_Fault]
    remarks: list[str]
    states: int | None
    transitions: int | None
    method: str | None
    diagnostics: list[dict[str, Any]]


def require_recheck(report: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return a report about a given supervisor, if it is valid.

    Raises:
        ServiceError: The report is invalid.
    """
    try:
        document = msgspec.convert(report, type=_Recheck)
    except msgspec.ValidationError as error:
        raise malformed(f"the report is invalid: {error}") from error
    if any(
        len({part is UNSET for part in (fault.trace, fault.shortest, fault.state)}) > 1 for fault in document.faults
    ):
        raise malformed("the report is invalid: a fault has no trace")
    return report


def verdicts_of(
    report: Mapping[str, Any],
    bundle: Bundle,
    deployment: Deployment,
    texts: Sequence[SourceFile],
    listings: Sequence[SourceFile],
) -> tuple[tuple[Verdict, ...], System, Model]:
    """Return the server's verdicts about properties, and the properties.

    Args:
        report: Report of the server.
        bundle: The model and its libraries.
        deployment: Deployment of the supervisor.
        texts: Properties, one each.
        listings: Files of properties.

    Raises:
        ServiceError: The verdicts are about other properties, or another robot.
    """
    model = _model(bundle)
    system = to_automata(model, deployment)
    properties = properties_of(model, texts, listings)
    try:
        entries = report["properties"]
        if len(entries) != len(properties):
            raise malformed("it has verdicts of other properties")
        verdicts = tuple(_verdict(*pair, system, model) for pair in zip(entries, properties, strict=True))
    except (LookupError, TypeError, ValueError, AttributeError, LanguageError) as error:
        raise malformed(f"a verdict is invalid: {error}") from error
    return verdicts, system, model


def _verdict(entry: Any, claim: Property, system: System, model: Model) -> Verdict:
    if entry["property"] != claim.text or (entry["name"] or "") != claim.name or not isinstance(entry["holds"], bool):
        raise malformed("it has a verdict of another property")
    run = entry["run"]
    return Verdict(claim, entry["holds"], None if run is None else _run(run, system, model))


def _run(entry: Any, system: System, model: Model) -> EvidenceRun:
    found = EvidenceRun(
        kind=RunKind(entry["kind"]),
        states=tuple(_state(state, system, model) for state in entry["states"]),
        events=tuple(event if event is None else visible(event) for event in entry["events"]),
        loop=entry["loop"],
        left=tuple(
            Remainder(int(item["state"]), _formula(item["property"], model), bool(item["holds"]))
            for item in entry["left"]
        ),
    )
    is_whole = len(found.states) == len(found.events) + 1
    if not is_whole or (found.loop is not None and found.loop not in range(len(found.states))):
        raise malformed("a run is inconsistent")
    return found


def _state(entry: Any, system: System, model: Model) -> tuple[Value, ...]:
    components = {component.name for component in model.components}

    def value(subject: Subject) -> Value:
        kind, _, name = subject.automaton.partition(" ")
        if subject.variable is not None:
            found = entry["variables"][str(subject)]
        elif subject.automaton in components:
            found = entry["components"][subject.automaton]
        elif kind in ("service", "action"):
            found = entry["communications"][name]
        else:
            # The plants of messages have a single location.
            (found,) = subject_domain(system, subject)
        if not isinstance(found, bool | int | float | str):
            raise malformed("a value in a run is invalid")
        return visible(found) if isinstance(found, str) else found

    return tuple(map(value, subjects(system)))


def _formula(text: Any, model: Model) -> Any:
    (found,) = properties_of(model, [SourceFile("answer", str(text))], [])
    return found.formula


def _model(bundle: Bundle) -> Model:
    """Return the model of texts for which the server has found one.

    Raises:
        ServiceError: There is none.
    """
    model = check(bundle).model
    if model is None:
        raise malformed("it has a result for a model that has errors")
    return model
