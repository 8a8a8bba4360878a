"""What the service answers, as values."""

from dataclasses import dataclass
from enum import StrEnum

from robosc.errors import Diagnostic
from robosc.explanation import EmptyExplanation
from robosc.targets import GeneratedFiles


class SynthesisStatus(StrEnum):
    """How an attempt to make a supervisor ended."""

    SUPERVISOR = "supervisor"
    EMPTY = "empty"
    """No supervisor exists: a result about the model, not a fault."""
    MODEL_ERRORS = "model errors"
    UNSUPPORTED_MODEL = "unsupported model"


@dataclass(frozen=True, slots=True)
class Progress:
    """Where long work is.

    Attributes:
        stage: `check`, `synthesis` or `verification`.
        message: One short line.
    """

    stage: str
    message: str


@dataclass(frozen=True, slots=True)
class Summary:
    """A supervisor in figures and words.

    Attributes:
        controllable_events: Number of controllable events.
        uncontrollable_events: Number of uncontrollable events.
        states: Reachable states of the controlled system.
        transitions: Transitions between them, or None where they were not counted.
        added: Event and what the supervisor adds to it, for each controllable event.
        text: The summary as `robosc synth` prints it.
    """

    controllable_events: int
    uncontrollable_events: int
    states: int
    transitions: int | None
    added: tuple[tuple[str, str], ...]
    text: str


@dataclass(frozen=True, slots=True)
class Statistics:
    """Figures of one synthesis, the same on any machine.

    Attributes:
        engine: Engine for decision diagrams that was used.
        state_bits: Boolean variables that encode a state.
        iterations: Rounds of the fixed point.
        peak_nodes: Most nodes that a set of states took at the end of a round.
    """

    engine: str
    state_bits: int
    iterations: int
    peak_nodes: int


@dataclass(frozen=True, slots=True)
class Synthesis:
    """How a synthesis ended.

    Attributes:
        status: How it ended.
        diagnostics: Every finding about the model, sorted by place.
        reason: Why there is no supervisor, in one sentence; empty where there is one.
        supervisor: The supervisor's file (`.rsup`); empty where there is none. Untrusted: decode it with
            `robosc.supervisor.decode`, which validates it.
        summary: The supervisor in figures and words, or None where there is none.
        statistics: Figures of the work, or None where there was no synthesis.
        explanation: What is to blame that no supervisor exists, or None where there is nothing to explain.
    """

    status: SynthesisStatus
    diagnostics: tuple[Diagnostic, ...]
    reason: str
    supervisor: bytes
    summary: Summary | None
    statistics: Statistics | None
    explanation: EmptyExplanation | None = None


@dataclass(frozen=True, slots=True)
class Generation:
    """What was generated.

    Attributes:
        status: How the synthesis ended.
        diagnostics: Every finding about the model, sorted by place.
        reason: Why there are no files, in one sentence; empty where there are.
        files: The files, or None where there are none; `robosc.targets.write_files` writes them.
        explanation: What is to blame that no supervisor exists, or None where there is nothing to explain.
    """

    status: SynthesisStatus
    diagnostics: tuple[Diagnostic, ...]
    reason: str
    files: GeneratedFiles | None
    explanation: EmptyExplanation | None = None
