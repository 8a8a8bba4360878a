"""Exploration of all states that a robot, or automata, can reach under their supervisor."""

from dataclasses import dataclass
from pathlib import Path

from robosc.automata import System, composed
from robosc.certification import Progress, SynthesisOutcome
from robosc.certification.goals import GoalExplanation
from robosc.certification.progress import OnProgress, ShouldStop, ignored, never
from robosc.errors import UnsupportedModelError
from robosc.explanation import EmptyExplanation
from robosc.exploration import DEFAULT_LIMIT, Graph
from robosc.exploration import explore as explore_system
from robosc.graphviz import FORMATS, drawn
from robosc.json_documents import json_text
from robosc.pipeline.automata_models import automata_synthesis
from robosc.pipeline.files import FileAccessError, FileName, given_path, write_whole
from robosc.pipeline.findings import Findings
from robosc.pipeline.loading import LoadedAutomata, ModelLike, loaded
from robosc.pipeline.options import DEFAULT_OPTIONS, SynthesisOptions
from robosc.pipeline.results import NoSupervisor, NothingGeneratedError, Outcome, SynthesisStatus
from robosc.pipeline.supervisors import Supervisor
from robosc.pipeline.synthesis import findings_of, make, status_of, why_not
from robosc.pipeline.systems import SystemSupervisor
from robosc.supervisor import Supervisor as CoreSupervisor
from robosc.supervisor.predicates import state_predicates


@dataclass(frozen=True, slots=True, repr=False)
class Exploration(Outcome):
    """Result of an exploration.

    Attributes:
        status: Outcome of the synthesis.
        diagnostics: Every finding about the model, sorted by place.
        reason: Reason why there is no graph, in one sentence; empty if there is one.
        graph: The graph, or None.
        explanation: Explanation of why there is no supervisor; None if there is one.
    """

    status: SynthesisStatus
    diagnostics: Findings
    reason: str
    graph: Graph | None
    explanation: EmptyExplanation | GoalExplanation | NoSupervisor | None = None

    def write(self, file: FileName) -> Path:
        """Write the graph, whole or not at all, and return the file's path.

        The ending of its name is the format: `.json` as `robosc explore --json` prints it, `.txt` for the table, `.dot`
        and `.gv` for Graphviz, `.svg`, `.png` and `.pdf` for the picture that Graphviz draws.

        Raises:
            NothingGeneratedError: There is no graph.
            FileAccessError: The file cannot be written, or its name has another ending.
            DrawingUnavailableError: Graphviz, which draws the picture, is not installed or failed.
        """
        if self.graph is None:
            raise NothingGeneratedError(f"there is no graph to write: {self.reason or self.status}")
        path = given_path(file)
        write_whole(path, _content(self.graph, path))
        return path

    def _product(self) -> object:
        return self.graph

    def _repr_svg_(self) -> str | None:
        return None if self.graph is None else self.graph._repr_svg_()


def _content(graph: Graph, path: Path) -> bytes:
    """The graph in the format of the ending of a file's name."""
    match path.suffix.removeprefix("."):
        case "json":
            return json_text(graph.to_json()).encode()
        case "txt":
            return str(graph).encode()
        case "dot" | "gv":
            return graph.dot.encode()
        case format_ if format_ in FORMATS:
            return drawn(graph.dot, format_)
    ends = ", ".join(f".{item}" for item in ("json", "txt", "dot", "gv", *FORMATS))
    raise FileAccessError(f"{path}: the name of a written graph ends in one of {ends}")


def explore(
    model: ModelLike | CoreSupervisor | System | SystemSupervisor,
    options: SynthesisOptions = DEFAULT_OPTIONS,
    *,
    maximum_states: int | None = None,
    on_progress: OnProgress = ignored,
    should_stop: ShouldStop = never,
) -> Exploration:
    """Return the graph of all states that a robot, or automata, can reach under their supervisor.

    Args:
        model: The model, as `load` returns it, the path of its file, a `robosc.automata.System`, or the supervisor of
            either.
        options: Options for making the supervisor; silent steps that never end are allowed.
        maximum_states: Maximum number of states of the graph; None: 100,000.
        on_progress: Function called with the progress of the work.
        should_stop: Function called again and again; once it returns true, the work ends.

    Raises:
        FileAccessError: The file does not exist or cannot be read.
        LanguageError: A file is too large or not UTF-8.
        InvalidSystemError: The automata do not fit together.
        NodeLimitError: Decision diagrams became larger than the options allow.
        UnknownEngineError: There is no such engine.
        SynthesisCancelled: `should_stop` became true.
        ValueError: `maximum_states` is less than 1; or an option is for models of robots, and the file holds automata.
    """
    limit = DEFAULT_LIMIT if maximum_states is None else maximum_states
    if limit < 1:
        raise ValueError(f"maximum_states is {limit}, and must be at least 1")
    if isinstance(model, CoreSupervisor):
        known = model.diagnostics if isinstance(model, Supervisor) else None
        return _explored(model, limit, known or Findings(), on_progress, should_stop)
    if isinstance(model, SystemSupervisor):
        return _explored(model, limit, Findings(), on_progress, should_stop)
    bundle = model if isinstance(model, System) else loaded(model)
    if isinstance(bundle, System | LoadedAutomata):
        made = automata_synthesis(bundle, options, on_progress, should_stop)
        if made.supervisor is None:
            return Exploration(made.status, made.diagnostics, made.reason, None, made.explanation)
        return _explored(made.supervisor, limit, made.diagnostics, on_progress, should_stop)
    # The graph is of everything allowed, whatever an executor would choose.
    attempt = make(bundle, options, on_progress, should_stop, allow_livelock=True, only_shown=True)
    diagnostics = findings_of(attempt, bundle)
    if isinstance(attempt, SynthesisOutcome) and attempt.supervisor is not None:
        return _explored(attempt.supervisor, limit, diagnostics, on_progress, should_stop)
    status, reason = status_of(attempt)
    return Exploration(status, diagnostics, reason, None, why_not(attempt, diagnostics))


def _explored(
    supervisor: CoreSupervisor | SystemSupervisor,
    limit: int,
    diagnostics: Findings,
    on_progress: OnProgress,
    should_stop: ShouldStop,
) -> Exploration:
    states = supervisor.states if isinstance(supervisor, SystemSupervisor) else supervisor.certificate.states
    on_progress(Progress("exploration", "states not counted" if states in (0, "0") else f"{states} states"))
    try:
        graph = graph_of(supervisor, limit=limit, should_stop=should_stop)
    except UnsupportedModelError as error:
        reason = str(error)
        explanation = NoSupervisor(reason, diagnostics)
        return Exploration(SynthesisStatus.UNSUPPORTED_MODEL, diagnostics, reason, None, explanation)
    return Exploration(SynthesisStatus.SUPERVISOR, diagnostics, "", graph)


def graph_of(
    supervisor: CoreSupervisor | SystemSupervisor, *, limit: int = DEFAULT_LIMIT, should_stop: ShouldStop = never
) -> Graph:
    """Return the graph of the system that a supervisor controls.

    Raises:
        UnsupportedModelError: There are more than `limit` states.
        SynthesisCancelled: `should_stop` became true.
    """
    if isinstance(supervisor, SystemSupervisor):
        system = supervisor.system
        return explore_system(
            composed(system),
            state_predicates(system, supervisor.added),
            None,
            initial=supervisor.may_begin,
            limit=limit,
            should_stop=should_stop,
        )
    system = supervisor.executable.automata
    added = state_predicates(system, supervisor.added)
    return explore_system(system, added, supervisor.model, limit=limit, should_stop=should_stop)
