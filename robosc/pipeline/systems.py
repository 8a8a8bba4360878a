"""The core's second door: supervisors of automata that a program has built, without a RoboSC text."""

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import msgspec

from robosc.automata import System, SystemPlaces, check_system
from robosc.automata.compile import State
from robosc.automata.decision import Decision
from robosc.automata.state import subjects, whole_names
from robosc.certification import Progress
from robosc.conditions.rendering import Formulas
from robosc.errors import InvalidSupervisorError, InvalidSystemError, NodeLimitError, UnsupportedModelError
from robosc.explanation import EmptyExplanation, SystemWords, explain_empty
from robosc.pipeline.conditions import Condition, Conditions, condition_of, conditions_of
from robosc.pipeline.files import given_path, read_bounded, write_whole
from robosc.pipeline.loading import FileName
from robosc.pipeline.options import SynthesisOptions
from robosc.pipeline.results import NoSupervisor, Outcome, SynthesisStatus, Verification, VerificationStatus
from robosc.supervisor import AddedCondition, DecisionDiagram
from robosc.supervisor.codec import MAXIMUM_BYTES, decode_document, encode_document, one_line
from robosc.supervisor.diagram import diagram_domains
from robosc.supervisor.predicates import state_predicate, state_predicates
from robosc.supervisor.structure import FORMAT, FORMAT_VERSION
from robosc.supervisor.validation import validate_added, validate_condition
from robosc.synthesis import Statistics, SynthesisProgress, synthesize
from robosc.synthesis import SynthesisStatus as CoreStatus
from robosc.tables import html_table
from robosc.verification import CheckOutcome, Limits, VerificationReport, verify

_CHECKS = ("safe", "controllable", "nonblocking", "maximally_permissive")
INITIALLY = "the initial state"
"""Name of what a condition is about that is about no event."""


@dataclass(frozen=True, repr=False)
class SystemSupervisor:
    """Supervisor of automata.

    Attributes:
        system: The automata that it supervises.
        added: Decision diagrams that it adds to events; `conditions` has them in words.
        initial: Condition on the initial states in which it lets the system begin; None if in all.
        statistics: Figures of the synthesis.
    """

    system: System
    added: tuple[AddedCondition, ...]
    initial: DecisionDiagram | None
    statistics: Statistics = field(compare=False)

    @cached_property
    def conditions(self) -> Conditions:
        """For each controllable event what it adds, in words."""
        return conditions_of(self.added, self.system, whole_names(self.system))

    @property
    def initial_condition(self) -> Condition | None:
        """Condition on the initial states in words; None where the system may begin in all of them."""
        if self.initial is None:
            return None
        formula = Formulas(diagram_domains(self.system)).formula(self.initial)
        return condition_of(INITIALLY, self.initial, formula, self.system, whole_names(self.system))

    def may_begin(self, state: State) -> bool:
        """Return True if the system may begin in a state, one of its initial ones, in the order of `subjects`."""
        return self._may_begin is None or self._may_begin(state)

    @cached_property
    def _may_begin(self) -> Decision | None:
        return None if self.initial is None else state_predicate(self.system, self.initial)

    @property
    def states(self) -> int:
        """Reachable states of the controlled system."""
        return self.statistics.states

    @classmethod
    def read(cls, file: FileName) -> "SystemSupervisor":
        """Read a supervisor's file (`.rsup`) that `write` has written; it is validated, but not verified.

        Raises:
            FileAccessError: The file cannot be read.
            InvalidSupervisorError: It is no supervisor of automata.
        """
        return decode_system(read_bounded(given_path(file), MAXIMUM_BYTES))

    def write(self, file: FileName) -> Path:
        """Write the supervisor's file (`.rsup`) with the automata, whole or not at all, and return its path.

        Raises:
            FileAccessError: The place cannot be written.
            UnsupportedModelError: The file would become too large, an expression is nested too deeply, or an automaton
                or a variable has a name that is no identifier.
        """
        path = given_path(file)
        write_whole(path, self.encode())
        return path

    def encode(self) -> bytes:
        """Return the content of the supervisor's file; raises UnsupportedModelError as `write`."""
        content = encode_document(_Document(FORMAT, FORMAT_VERSION, self))
        try:
            decode_system(content)
        except InvalidSupervisorError as error:
            raise UnsupportedModelError(f"no file can hold the supervisor of {self.system.name}: {error}") from error
        return content

    def __repr__(self) -> str:
        events = f"{len(self.added)} event{'s' if len(self.added) != 1 else ''}"
        return f"<supervisor of {self.system.name}: {self.states} states, conditions added to {events}>"

    def __str__(self) -> str:
        return f"{self.system.name}: a supervisor exists ({self.states} states)\n{self.conditions}"

    def _repr_html_(self) -> str:
        return html_table(("figure", "value"), [("states", self.states)], caption=repr(self).strip("<>")) + (
            self.conditions._repr_html_()
        )


class _Document(msgspec.Struct, frozen=True):
    """The outermost object of such a supervisor's file."""

    format: str
    version: int
    system_supervisor: SystemSupervisor


_DECODER = msgspec.json.Decoder(_Document, strict=True)


def decode_system(data: bytes) -> SystemSupervisor:
    """The supervisor of automata in a file's bytes, consistent in itself; it is not verified here.

    Raises:
        InvalidSupervisorError: The bytes are no supervisor of automata; says where in one sentence.
    """
    supervisor = decode_document(data, _DECODER).system_supervisor
    try:
        check_system(supervisor.system)
        validate_added(supervisor.added, supervisor.system)
        if supervisor.initial is not None:
            validate_condition(supervisor.initial, diagram_domains(supervisor.system))
    except (InvalidSystemError, InvalidSupervisorError) as error:
        raise InvalidSupervisorError(f"the supervisor file is inconsistent: {one_line(error)}") from None
    figures = supervisor.statistics
    if min(figures.state_bits, figures.iterations, figures.peak_nodes) < 0 or figures.states < 1:
        raise InvalidSupervisorError("the supervisor file is inconsistent: a figure of the synthesis is too small")
    return supervisor


@dataclass(frozen=True, slots=True, repr=False)
class SystemSynthesis(Outcome):
    """Result of a synthesis of automata.

    Attributes:
        status: Outcome of the synthesis.
        reason: Reason why there is no supervisor; empty where there is one.
        supervisor: The supervisor, or None.
        statistics: Figures of the work; None where the automata cannot be handled.
        diagnostics: Always empty: automata have no text that findings could be about.
        explanation: Explanation of why there is no supervisor, or None where there is one.
    """

    status: SynthesisStatus
    reason: str
    supervisor: SystemSupervisor | None
    statistics: Statistics | None
    diagnostics: tuple[()] = ()
    explanation: EmptyExplanation | NoSupervisor | None = None

    def _made(self) -> object:
        return self.supervisor


def synthesize_system(
    system: System,
    options: SynthesisOptions,
    on_progress: Callable[[Progress], None],
    should_stop: Callable[[], bool],
    places: SystemPlaces | None = None,
) -> SystemSynthesis:
    """Synthesize the supervisor of automata; parameters and errors as of `robosc.synthesize`.

    Args:
        system: The automata.
        options: Options for making the supervisor.
        on_progress: Function called with the progress of the work.
        should_stop: Function called again and again; once it returns true, the work ends.
        places: Places of the parts of the automata, for the explanation.
    """
    check_system(system)
    engine = options.engine_options()

    def report(progress: SynthesisProgress) -> None:
        on_progress(Progress("synthesis", str(progress)))

    try:
        found = synthesize(system, engine=engine, should_stop=should_stop, on_progress=report)
    except UnsupportedModelError as error:
        reason = str(error)
        return SystemSynthesis(
            SynthesisStatus.UNSUPPORTED_MODEL, reason, None, None, explanation=NoSupervisor(reason, ())
        )
    if found.status is CoreStatus.EMPTY:
        reason = f"no supervisor exists: {found.reason}"
        explanation: EmptyExplanation | NoSupervisor = NoSupervisor(reason, ())
        # Whatever the limit of nodes, that there is no supervisor is known.
        with suppress(NodeLimitError):
            words = SystemWords(system, places or SystemPlaces())
            explanation = explain_empty(words, engine=engine, should_stop=should_stop, on_progress=report)
        return SystemSynthesis(SynthesisStatus.EMPTY, reason, None, found.statistics, explanation=explanation)
    supervisor = SystemSupervisor(system, found.added, found.initial, found.statistics)
    return SystemSynthesis(SynthesisStatus.SUPERVISOR, "", supervisor, found.statistics)


def verify_system(
    supervisor: SystemSupervisor,
    options: SynthesisOptions,
    limits: Limits,
    on_progress: Callable[[Progress], None],
    should_stop: Callable[[], bool],
    *,
    is_strict: bool,
) -> Verification:
    """Verify independently that a supervisor of automata is right."""
    verified = _verified(supervisor, options, limits, on_progress, should_stop)
    found = verified.verification
    outcomes = {name: getattr(found, name) for name in _CHECKS}
    is_complete = verified.is_complete and not (is_strict and CheckOutcome.NOT_CHECKED in outcomes.values())
    status = (
        VerificationStatus.FAILED
        if found.failures
        else VerificationStatus.PASSED
        if is_complete
        else VerificationStatus.NOT_CHECKED
    )
    report: Mapping[str, Any] = {
        "status": str(status),
        "system": supervisor.system.name,
        "checks": {name: str(outcome) for name, outcome in outcomes.items()},
        "faults": [
            {
                "check": item.property.replace(" ", "_"),
                "message": item.reason,
                "trace": list(item.trace),
                "shortest": item.is_shortest,
                "state": {
                    str(subject): value for subject, value in zip(subjects(supervisor.system), item.state, strict=True)
                },
            }
            for item in found.failures
        ],
        "states": found.states,
        "transitions": found.transitions,
        "method": verified.method,
    }
    lines = [f"{supervisor.system.name}: {status}"]
    lines += [f"  {name.replace('_', ' '):<21} {outcome}" for name, outcome in outcomes.items()]
    lines.append(f"  {'method':<21} {verified.method}")
    lines += [
        f"not {item.property}: {item.message}, after {', '.join(item.trace) or 'nothing'}" for item in found.failures
    ]
    return Verification(status, (), "", report, "\n".join(lines) + "\n")


def _verified(
    supervisor: SystemSupervisor,
    options: SynthesisOptions,
    limits: Limits,
    on_progress: Callable[[Progress], None],
    should_stop: Callable[[], bool],
) -> VerificationReport:
    system, added = supervisor.system, state_predicates(supervisor.system, supervisor.added)

    def report(message: str) -> None:
        on_progress(Progress("verification", message))

    return verify(
        system,
        added,
        limits,
        initial=None if supervisor.initial is None else state_predicate(system, supervisor.initial),
        expected_states=supervisor.states,
        engine=options.engine_options().name,
        should_stop=should_stop,
        on_progress=report,
    )
