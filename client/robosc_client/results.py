"""Results of the service as values, shared with the core where they have the same meaning."""

from dataclasses import dataclass

import msgspec

from robosc.certification import Progress
from robosc.certification.goals import GoalExplanation
from robosc.errors import Diagnostic
from robosc.explanation import EmptyExplanation
from robosc.expressions import Value
from robosc.pipeline.results import (
    Explained,
    Generation,
    GoalSummary,
    Outcome,
    Summary,
    SynthesisStatus,
    Verification,
    VerificationStatus,
)


@dataclass(frozen=True, slots=True)
class Strategy:
    """A strategy of a synthesis, as far as it had come when the race for the result was over.

    Attributes:
        order: Variable order, in words.
        search: Direction of the search for good states, in words.
        nodes: Number of nodes of decision diagrams that it had worked on.
        won: Number of systems for which it came to its end first: several where a model is synthesized part by part.
        given_up: Number of systems for which it would have taken more nodes than there may be.
    """

    order: str
    search: str
    nodes: int
    won: int
    given_up: int


@dataclass(frozen=True, slots=True)
class Statistics:
    """Figures of one synthesis, the same on any machine.

    Attributes:
        engine: Engine for decision diagrams that was used.
        state_bits: Number of Boolean variables that encode a state.
        iterations: Number of iterations of the fixed point.
        peak_nodes: Largest number of nodes of a set of states at the end of an iteration.
        race: Strategies that raced for the result; empty from servers that do not say so.
    """

    engine: str
    state_bits: int
    iterations: int
    peak_nodes: int
    race: tuple[Strategy, ...] = ()


@dataclass(frozen=True, slots=True, repr=False)
class Synthesis(Outcome):
    """Result of a synthesis.

    Attributes:
        status: Outcome of the synthesis.
        diagnostics: Every finding about the model, sorted by place.
        reason: Reason why there is no supervisor, in one sentence; empty where there is one.
        supervisor: The supervisor's file (`.rsup`) as the server sent it, with its digest checked; empty if there is no
            supervisor. Untrusted: decode it with `robosc.supervisor.decode`, which validates it, or read that of
            automata with `robosc.SystemSupervisor.read`.
        summary: Summary of the supervisor in numbers and texts, or None if there is no supervisor.
        statistics: Figures of the work, or None where there was no synthesis.
        explanation: Explanation of why no supervisor exists or goals cannot be reached, or None where there is nothing
            to explain.
        signature: Content of the file's signature (`.rsup.sig`), as the server made it; empty where it signs nothing.
            Untrusted: `robosc.signatures.signer` returns whose it is.
    """

    status: SynthesisStatus
    diagnostics: tuple[Diagnostic, ...]
    reason: str
    supervisor: bytes
    summary: Summary | None
    statistics: Statistics | None
    explanation: EmptyExplanation | GoalExplanation | None = None
    signature: bytes = b""

    def _product(self) -> object:
        return self.summary


class StateValues(msgspec.Struct, frozen=True, gc=False):
    """One state of the robot, or of automata, under their supervisor.

    Attributes:
        components: State of every component with a behaviour, by its name; of automata the location of each.
        variables: Value of every synthesis variable, by `Component.variable`.
        communications: Location of every service and action, by its name.
        enabled: Events that can happen here, sorted by name.
    """

    components: dict[str, str]
    variables: dict[str, Value]
    communications: dict[str, str]
    enabled: tuple[str, ...]


class StateGraph(msgspec.Struct, frozen=True, omit_defaults=True):
    """States and events of the robot, or of automata, under their supervisor.

    Attributes:
        initial: Number of the initial state; of several, the first.
        states: The states; a state's number is its place.
        transitions: State, event, state.
        initial_states: Numbers of the initial states of automata that have several; else none.
    """

    initial: int
    states: tuple[StateValues, ...]
    transitions: tuple[tuple[int, str, int], ...]
    initial_states: tuple[int, ...] = ()

    def __repr__(self) -> str:
        return f"<graph: {len(self.states)} states, {len(self.transitions)} transitions>"


@dataclass(frozen=True, slots=True, repr=False)
class Exploration(Outcome):
    """Result of an exploration.

    Attributes:
        status: Outcome of the synthesis.
        diagnostics: Every finding about the model, sorted by place.
        reason: Reason why there is no graph, in one sentence; empty where there is one.
        graph: The graph, or None.
        explanation: Explanation of why no supervisor exists or goals cannot be reached, or None where there is nothing
            to explain.
    """

    status: SynthesisStatus
    diagnostics: tuple[Diagnostic, ...]
    reason: str
    graph: StateGraph | None
    explanation: EmptyExplanation | GoalExplanation | None = None

    def _product(self) -> object:
        return self.graph


@dataclass(frozen=True, slots=True)
class Formatted:
    """A text in its canonical layout.

    Attributes:
        text: The text, which differs from the given one only in its layout; None: the given one has syntax errors.
        diagnostics: The syntax errors.
    """

    text: str | None
    diagnostics: tuple[Diagnostic, ...]


@dataclass(frozen=True, slots=True)
class ServerLimits:
    """Limits of a server's requests, tasks and results.

    Attributes:
        bundle_bytes: Maximum size of all names and texts of a bundle.
        bundle_files: Maximum number of files of a bundle.
        task_seconds: Maximum wall-clock time of one task, in seconds.
        task_cpu_seconds: Maximum CPU time of one task, in seconds.
        task_memory_bytes: Maximum memory of one task, in bytes.
        task_nodes: Maximum number of decision diagram nodes of one task.
        result_bytes: Maximum size of one result, in bytes.
        waiting_tasks: Maximum number of waiting tasks of all callers.
        waiting_tasks_per_caller: Maximum number of waiting tasks of one caller.
        retention_seconds: Time for which a job and its result are stored after its end, in seconds.
    """

    bundle_bytes: int
    bundle_files: int
    task_seconds: float
    task_cpu_seconds: float
    task_memory_bytes: int
    task_nodes: int
    result_bytes: int
    waiting_tasks: int
    waiting_tasks_per_caller: int
    retention_seconds: float


@dataclass(frozen=True, slots=True)
class ServerInfo:
    """Information about a server.

    Attributes:
        version: Version of RoboSC.
        engines: Engines for decision diagrams, the fastest first.
        limits: Limits of the server.
    """

    version: str
    engines: tuple[str, ...]
    limits: ServerLimits


type TaskResult = tuple[Diagnostic, ...] | Synthesis | Generation | Exploration | Verification | Explained | Formatted
"""What a task's job gives: the findings for a check, else what the method of the client returns."""

__all__ = [
    "Explained",
    "Exploration",
    "Formatted",
    "Generation",
    "GoalSummary",
    "Progress",
    "ServerInfo",
    "ServerLimits",
    "StateGraph",
    "StateValues",
    "Statistics",
    "Strategy",
    "Summary",
    "Synthesis",
    "SynthesisStatus",
    "TaskResult",
    "Verification",
    "VerificationStatus",
]
