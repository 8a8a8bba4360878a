"""Exploration of everything that a robot may do under its supervisor."""

from dataclasses import dataclass

from robosc.certification import Progress, SynthesisOutcome
from robosc.errors import UnsupportedModelError
from robosc.explanation import EmptyExplanation
from robosc.exploration import DEFAULT_LIMIT, Graph
from robosc.exploration import explore as explore_system
from robosc.pipeline.findings import Findings
from robosc.pipeline.loading import ModelLike, loaded
from robosc.pipeline.options import DEFAULT_OPTIONS, SynthesisOptions
from robosc.pipeline.results import NoSupervisor, Outcome, SynthesisStatus
from robosc.pipeline.supervisors import Supervisor
from robosc.pipeline.synthesis import OnProgress, ShouldStop, findings_of, ignored, make, never, status_of, why_not
from robosc.supervisor import Supervisor as CoreSupervisor
from robosc.supervisor.predicates import state_predicates


@dataclass(frozen=True, slots=True, repr=False)
class Exploration(Outcome):
    """Result of an exploration.

    Attributes:
        status: Outcome of the synthesis.
        diagnostics: Every finding about the model, sorted by place.
        reason: Reason why there is no graph, in one sentence; empty where there is one.
        graph: The graph, or None.
        explanation: Explanation of why there is no supervisor; None where there is one.
    """

    status: SynthesisStatus
    diagnostics: Findings
    reason: str
    graph: Graph | None
    explanation: EmptyExplanation | NoSupervisor | None = None

    def _made(self) -> object:
        return self.graph


def explore(
    model: ModelLike | CoreSupervisor,
    options: SynthesisOptions = DEFAULT_OPTIONS,
    *,
    maximum_states: int | None = None,
    on_progress: OnProgress = ignored,
    should_stop: ShouldStop = never,
) -> Exploration:
    """Return the graph of everything that a robot may do under its supervisor.

    Args:
        model: The model, as `load` returns it, the path of one, or a supervisor that was made.
        options: Options for making the supervisor of a model; silent steps that never end are allowed.
        maximum_states: States beyond which it is given up; None: 100,000.
        on_progress: Function called with the progress of the work.
        should_stop: Function called again and again; once it returns true, the work ends.

    Raises:
        FileAccessError: The file is not there or cannot be read.
        LanguageError: A file is too large or not UTF-8.
        NodeLimitError: Decision diagrams became larger than the options allow.
        UnknownEngineError: There is no such engine.
        SynthesisCancelled: `should_stop` became true.
        ValueError: `maximum_states` is less than 1.
    """
    limit = DEFAULT_LIMIT if maximum_states is None else maximum_states
    if limit < 1:
        raise ValueError(f"maximum_states is {limit}, and must be at least 1")
    if isinstance(model, CoreSupervisor):
        known = model.diagnostics if isinstance(model, Supervisor) else None
        return _explored(model, limit, known or Findings(), on_progress, should_stop)
    bundle = loaded(model)
    # The graph is of everything allowed, whatever an executor would choose.
    attempt = make(bundle, options, on_progress, should_stop, allow_livelock=True)
    diagnostics = findings_of(attempt, bundle)
    if isinstance(attempt, SynthesisOutcome) and attempt.supervisor is not None:
        return _explored(attempt.supervisor, limit, diagnostics, on_progress, should_stop)
    status, reason = status_of(attempt)
    return Exploration(status, diagnostics, reason, None, why_not(attempt, diagnostics))


def _explored(
    supervisor: CoreSupervisor, limit: int, diagnostics: Findings, on_progress: OnProgress, should_stop: ShouldStop
) -> Exploration:
    on_progress(Progress("exploration", f"{supervisor.certificate.states} states"))
    try:
        graph = graph_of(supervisor, limit=limit, should_stop=should_stop)
    except UnsupportedModelError as error:
        reason = str(error)
        explanation = NoSupervisor(reason, diagnostics)
        return Exploration(SynthesisStatus.UNSUPPORTED_MODEL, diagnostics, reason, None, explanation)
    return Exploration(SynthesisStatus.SUPERVISOR, diagnostics, "", graph)


def graph_of(supervisor: CoreSupervisor, *, limit: int = DEFAULT_LIMIT, should_stop: ShouldStop = never) -> Graph:
    """Return the graph of the system that a supervisor controls.

    Raises:
        UnsupportedModelError: There are more than `limit` states.
        SynthesisCancelled: `should_stop` became true.
    """
    system = supervisor.executable.automata
    added = state_predicates(system, supervisor.added)
    return explore_system(system, added, supervisor.model, limit=limit, should_stop=should_stop)
