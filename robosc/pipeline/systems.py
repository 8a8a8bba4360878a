"""Supervisors of automata that a program has built, without a RoboSC text."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import msgspec

from robosc.automata import System, SystemPlaces, check_system, composed
from robosc.automata.compile import State
from robosc.automata.decision import Decision
from robosc.automata.state import subjects, whole_names
from robosc.certification import Progress
from robosc.conditions.rendering import Formulas
from robosc.errors import InvalidSupervisorError, InvalidSystemError, NodeLimitError, UnsupportedModelError
from robosc.expressions.text import cif_text
from robosc.pipeline.conditions import Condition, Conditions, condition_of, conditions_of
from robosc.pipeline.files import FileName, SupervisorFile, given_path, read_bounded
from robosc.pipeline.findings import Findings
from robosc.pipeline.options import SynthesisOptions
from robosc.pipeline.results import NoSupervisor, Outcome, SynthesisStatus, Verification, VerificationStatus
from robosc.source import visible
from robosc.supervisor import AddedCondition, DecisionDiagram
from robosc.supervisor.codec import MAXIMUM_BYTES, decode_document, encode_document, one_line
from robosc.supervisor.diagram import diagram_domains
from robosc.supervisor.predicates import state_predicate, state_predicates
from robosc.supervisor.structure import FORMAT, FORMAT_VERSION
from robosc.supervisor.validation import validate_added, validate_condition
from robosc.synthesis import EngineOptions, Statistics, SynthesisProgress, synthesize
from robosc.synthesis import SynthesisStatus as CoreStatus
from robosc.tables import html_table

if TYPE_CHECKING:
    from robosc.explanation import EmptyExplanation, SystemWords
    from robosc.verification import Limits, VerificationReport

_MISCOUNT = "states"
"""Name of the check that fails if a supervisor states a wrong number of states."""

_CONTROLLER_CHECKS = ("bounded_response", "finite_response", "confluence", "nonblocking_under_control")
_LACK = {name: f"no {name.replace('_', ' ')}" for name in _CONTROLLER_CHECKS[:3]}
_CHECKS = ("safe", "controllable", "nonblocking", "maximally_permissive")
MAXIMUM_NAMES = 20
"""Maximum number of automata that are named for a module without a supervisor."""

INITIALLY = "the initial state"
"""Name in place of an event, for the condition on initial states."""


@dataclass(frozen=True, slots=True)
class SupervisedModule:
    """A module of a modular synthesis of automata: it is safe, controllable and nonblocking by itself.

    Attributes:
        automata: Names of its automata.
        states: Reachable states under the module's own supervisor.
        group: Number of its group: modules of different groups share nothing, and modules of one group do not block
            each other.
    """

    automata: tuple[str, ...]
    states: int
    group: int


@dataclass(frozen=True, repr=False)
class SystemSupervisor(SupervisorFile):
    """Supervisor of automata.

    Attributes:
        system: The automata that it supervises.
        added: Decision diagrams that it adds to events; `conditions` has them in words.
        initial: Condition on the initial states that it allows; None if it allows all.
        statistics: Figures of the synthesis; for a modular one the sums or maxima over the modules.
        modules: Modules of a modular synthesis; else none.
    """

    system: System
    added: tuple[AddedCondition, ...]
    initial: DecisionDiagram | None
    statistics: Statistics = field(compare=False)
    modules: tuple[SupervisedModule, ...] = field(default=(), compare=False)

    @cached_property
    def conditions(self) -> Conditions:
        """Conditions that it adds to each controllable event, in words."""
        return conditions_of(self.added, self.system, whole_names(self.system), is_cif=True)

    @property
    def initial_condition(self) -> Condition | None:
        """Condition on the initial states in words; None if all of them are allowed."""
        if self.initial is None:
            return None
        formula = Formulas(diagram_domains(self.system)).formula(self.initial)
        return condition_of(INITIALLY, self.initial, formula, self.system, whole_names(self.system), is_cif=True)

    def may_begin(self, state: State) -> bool:
        """Return True if it allows an initial state, given by its values in the order of `subjects`."""
        return self._may_begin is None or self._may_begin(state)

    @cached_property
    def _may_begin(self) -> Decision | None:
        return None if self.initial is None else state_predicate(self.system, self.initial)

    @property
    def states(self) -> int:
        """Reachable states of the controlled system; 0 if modules share something: these states are not counted."""
        return self.statistics.states

    @property
    def _size(self) -> str:
        sizes = [f"{self.states} states"] if self.states else []
        modules = f"{len(self.modules)} module{'s' if len(self.modules) != 1 else ''}"
        return ", ".join([*sizes, *([modules] if self.modules else [])])

    @classmethod
    def read(cls, file: FileName) -> "SystemSupervisor":
        """Read a supervisor's file (`.rsup`) that `write` has written; it is validated, but not verified.

        Raises:
            FileAccessError: The file cannot be read.
            InvalidSupervisorError: The file holds no supervisor of automata.
        """
        return decode_system(read_bounded(given_path(file), MAXIMUM_BYTES))

    def encode(self) -> bytes:
        """Return the content of the supervisor's file, with the automata; raises UnsupportedModelError as `write`."""
        content = encode_document(_Document(FORMAT, FORMAT_VERSION, self))
        try:
            decode_system(content)
        except InvalidSupervisorError as error:
            raise UnsupportedModelError(f"no file can hold the supervisor of {self.system.name}: {error}") from error
        return content

    def __repr__(self) -> str:
        events = f"{len(self.added)} event{'s' if len(self.added) != 1 else ''}"
        return f"<supervisor of {self.system.name}: {self._size}, conditions added to {events}>"

    def __str__(self) -> str:
        if self.system.is_controlled:
            return f"{self.system.name}: the supervisor is in the model ({self._size}), and nothing is added to it"
        return (
            f"{self.system.name}: a supervisor exists ({self._size})\n{self.conditions}{''.join(self._module_lines())}"
        )

    def _module_lines(self) -> Iterator[str]:
        """Lines about the modules."""
        for number, module in enumerate(self.modules, start=1):
            yield f"\nmodule {number}, {module.states} states: {visible(', '.join(module.automata))}"
        for group in sorted({module.group for module in self.modules}):
            members = [str(number) for number, module in enumerate(self.modules, start=1) if module.group == group]
            if len(members) > 1:
                yield f"\nnonblocking together, as found on abstractions: modules {', '.join(members)}"

    def _repr_html_(self) -> str:
        rows = [("states", self.states)] if self.states else []
        rows += [(f"states of module {number}", item.states) for number, item in enumerate(self.modules, start=1)]
        return html_table(("figure", "value"), rows, caption=repr(self).strip("<>")) + (self.conditions._repr_html_())


class _Document(msgspec.Struct, frozen=True):
    """The outermost object of such a supervisor's file."""

    format: str
    version: int
    system_supervisor: SystemSupervisor


_DECODER = msgspec.json.Decoder(_Document, strict=True)


def decode_system(data: bytes) -> SystemSupervisor:
    """The supervisor of automata in a file's bytes; it is checked for consistency, but not verified.

    Raises:
        InvalidSupervisorError: The bytes are no supervisor of automata; the message names the place.
    """
    supervisor = decode_document(data, _DECODER).system_supervisor
    try:
        check_system(supervisor.system)
        validate_added(supervisor.added, supervisor.system)
        if supervisor.initial is not None:
            validate_condition(supervisor.initial, diagram_domains(supervisor.system))
    except (InvalidSystemError, InvalidSupervisorError) as error:
        raise InvalidSupervisorError(f"the supervisor file is inconsistent: {one_line(error)}") from None
    names = {automaton.name for automaton in supervisor.system.automata}
    if any(min(item.states, item.group) < 1 or not names.issuperset(item.automata) for item in supervisor.modules):
        raise InvalidSupervisorError(
            "the supervisor file is inconsistent: a module names an automaton that it does not have"
        )
    figures = supervisor.statistics
    if min(figures.state_bits, figures.iterations, figures.peak_nodes) < 0 or figures.states < (not supervisor.modules):
        raise InvalidSupervisorError("the supervisor file is inconsistent: a figure of the synthesis is too small")
    return supervisor


@dataclass(frozen=True, slots=True, repr=False)
class SystemSynthesis(Outcome):
    """Result of a synthesis of automata.

    Attributes:
        status: Outcome of the synthesis.
        reason: Reason why there is no supervisor; empty if there is one.
        supervisor: The supervisor, or None.
        statistics: Figures of the work; None if the automata are not supported.
        diagnostics: Every finding about the file of the automata, sorted by place; empty if there is no file.
        explanation: Explanation of why there is no supervisor, or None if there is one.
    """

    status: SynthesisStatus
    reason: str
    supervisor: SystemSupervisor | None
    statistics: Statistics | None
    diagnostics: Findings = field(default_factory=Findings)
    explanation: "EmptyExplanation | NoSupervisor | None" = None

    def _product(self) -> object:
        return self.supervisor


def synthesize_system(
    system: System,
    options: SynthesisOptions,
    on_progress: Callable[[Progress], None],
    should_stop: Callable[[], bool],
    places: SystemPlaces | None = None,
    *,
    is_modular: bool = False,
) -> SystemSynthesis:
    """Synthesize the supervisor of automata; parameters and errors as of `robosc.synthesize`.

    To a controlled system nothing is added: its states are counted.

    Args:
        system: The automata.
        options: Options for making the supervisor.
        on_progress: Function called with the progress of the work.
        should_stop: Function called again and again; once it returns true, the work ends.
        places: Places of the parts of the automata, for the explanation.
        is_modular: True for a modular synthesis.
    """
    check_system(system)
    if is_modular and system.is_controlled:
        return _unsupported(f"{system.name} has its supervisor already, so there is nothing to synthesize in modules")
    if is_modular:
        return _synthesized_in_modules(system, options, on_progress, should_stop, places or SystemPlaces())
    engine = options.engine_options()

    def report(progress: SynthesisProgress) -> None:
        on_progress(Progress("synthesis", str(progress)))

    try:
        found = synthesize(composed(system), engine=engine, should_stop=should_stop, on_progress=report)
    except UnsupportedModelError as error:
        return _unsupported(str(error))
    if found.status is CoreStatus.EMPTY:
        from robosc.explanation import SystemWords

        words = SystemWords(system, places or SystemPlaces())
        reason = found.reason if system.is_controlled else f"no supervisor exists: {found.reason}"
        return _empty(words, reason, found.statistics, engine, on_progress, should_stop)
    supervisor = SystemSupervisor(system, found.added, found.initial, found.statistics)
    return SystemSynthesis(SynthesisStatus.SUPERVISOR, "", supervisor, found.statistics)


def _synthesized_in_modules(
    system: System,
    options: SynthesisOptions,
    on_progress: Callable[[Progress], None],
    should_stop: Callable[[], bool],
    places: SystemPlaces,
) -> SystemSynthesis:
    from robosc.modular.synthesize import synthesize_modular

    engine = options.engine_options()
    try:
        found = synthesize_modular(
            system,
            engine=engine,
            should_stop=should_stop,
            on_progress=lambda message: on_progress(Progress("synthesis", message)),
        )
    except UnsupportedModelError as error:
        return _unsupported(str(error))
    if found.unsolved is not None:
        names = ", ".join(found.unsolved.automata[:MAXIMUM_NAMES]) + ", ..." * (
            len(found.unsolved.automata) > MAXIMUM_NAMES
        )
        from robosc.explanation import SystemWords

        reason = f"no supervisor exists: {names}: {found.unsolved.result.reason}"
        words = SystemWords(*found.partition.problem_of(found.unsolved.module, places))
        return _empty(words, reason, found.unsolved.result.statistics, engine, on_progress, should_stop)
    statistics, group_of = found.statistics, found.group_of
    modules = tuple(
        SupervisedModule(item.automata, item.result.statistics.states, group_of[place])
        for place, item in enumerate(found.modules)
    )
    supervisor = SystemSupervisor(system, found.added, found.initial, statistics, modules)
    return SystemSynthesis(SynthesisStatus.SUPERVISOR, "", supervisor, statistics)


def _unsupported(reason: str) -> SystemSynthesis:
    explanation = NoSupervisor(reason, ())
    return SystemSynthesis(SynthesisStatus.UNSUPPORTED_MODEL, reason, None, None, explanation=explanation)


def _empty(
    words: "SystemWords",
    reason: str,
    statistics: Statistics,
    engine: EngineOptions,
    on_progress: Callable[[Progress], None],
    should_stop: Callable[[], bool],
) -> SystemSynthesis:
    from robosc.explanation import explain_empty

    explanation: EmptyExplanation | NoSupervisor = NoSupervisor(reason, ())
    # The verdict, no supervisor, holds whatever the limit of nodes.
    with suppress(NodeLimitError):
        explanation = explain_empty(
            words,
            engine=engine,
            should_stop=should_stop,
            on_progress=lambda step: on_progress(Progress("synthesis", str(step))),
        )
    return SystemSynthesis(SynthesisStatus.EMPTY, reason, None, statistics, explanation=explanation)


def verify_system(
    supervisor: SystemSupervisor,
    options: SynthesisOptions,
    limits: "Limits",
    on_progress: Callable[[Progress], None],
    should_stop: Callable[[], bool],
    *,
    is_strict: bool,
    controller: bool = False,
) -> Verification:
    """Verify a supervisor of automata independently of its synthesis; with `controller`, its properties, too."""
    from robosc.verification import CheckOutcome

    verified = _verified(supervisor, options, limits, on_progress, should_stop)
    found = verified.verification
    outcomes = {name: getattr(found, name) for name in _CHECKS}
    is_complete = verified.is_complete and not (is_strict and CheckOutcome.NOT_CHECKED in outcomes.values())
    # The figure in a file is not believed either; that of a wrong supervisor says nothing more.
    stated, counted = supervisor.states, found.states
    is_miscounted = stated > 0 and counted not in (None, stated) and not found.failures
    miscount = f"it states {stated}, and there are {counted}" if is_miscounted else ""
    properties = _controller_report(supervisor, limits, on_progress, should_stop) if controller else {}
    results = {*properties.get("checks", {}).values()}
    status = (
        VerificationStatus.FAILED
        if found.failures or miscount or "failed" in results
        else VerificationStatus.PASSED
        if is_complete and "not checked" not in results
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
        ]
        + [{"check": _MISCOUNT, "message": miscount, "trace": [], "shortest": True, "state": {}}] * bool(miscount),
        "states": found.states,
        "transitions": found.transitions,
        "method": verified.method,
        **({"controller": properties} if controller else {}),
    }
    return Verification(status, (), "", report, system_verification_text(report))


def _controller_report(
    supervisor: SystemSupervisor,
    limits: "Limits",
    on_progress: Callable[[Progress], None],
    should_stop: Callable[[], bool],
) -> dict[str, Any]:
    """Return the report about the controller properties, as JSON values."""
    from robosc.controller_properties import check_automata

    on_progress(Progress("verification", "controller properties"))
    found = check_automata(
        composed(supervisor.system),
        state_predicates(supervisor.system, supervisor.added),
        limit=limits.states,
        initial=supervisor.may_begin,
        should_stop=should_stop,
    )
    if found is None:
        return {"checks": dict.fromkeys(_CONTROLLER_CHECKS, "not checked"), "limit": limits.states, "faults": []}
    faults: list[dict[str, Any]] = []
    for kind in ("uncontrollable", "controllable"):
        response = getattr(found, kind)
        if response.bound is None:
            words = f"{kind} events can follow each other for ever: {', '.join(response.events)}"
            names = ["bounded_response", *(["finite_response"] if kind == "controllable" else [])]
            faults += [
                {"check": name, "message": words, "trace": list(response.trace), "cycle": list(response.events)}
                for name in names
            ]
    if found.disagreement is not None:
        orders = [list(order) for order in found.disagreement.orders]
        shown = " and ".join(f"'{', '.join(order) or 'nothing'}'" for order in orders)
        words = f"controllable events can happen in orders that never meet again, {shown}"
        trace = list(found.disagreement.trace)
        faults.append({"check": "confluence", "message": words, "trace": trace, "orders": orders})
    if found.blocking is not None:
        words = "no marked state without a possible controllable event is reached if controllable events come first"
        faults.append({"check": "nonblocking_under_control", "message": words, "trace": list(found.blocking)})
    return {
        "checks": {name: "passed" if holds else "failed" for name, holds in found.checks.items()},
        "uncontrollables_bound": found.uncontrollable.bound,
        "controllables_bound": found.controllable.bound,
        "faults": faults,
    }


def system_summary_text(supervisor: SystemSupervisor) -> str:
    """Return the summary of a supervisor of automata, as `robosc synth` prints it."""
    initial = supervisor.initial_condition
    stated = str(supervisor) if initial is None else f"{supervisor}\nit begins only where {initial}"
    # Names of plain automata may be anything.
    return "".join(f"{visible(line)}\n" for line in stated.split("\n"))


def system_verification_text(report: Mapping[str, Any]) -> str:
    """Return the report on the verification of a supervisor of automata, as text."""
    lines = [f"{report['system']}: {report['status']}"]
    lines += [f"  {name.replace('_', ' '):<21} {outcome}" for name, outcome in report["checks"].items()]
    lines.append(f"  {'method':<21} {report['method']}")
    properties = report.get("controller", {"checks": {}, "faults": []})
    for name, outcome in properties["checks"].items():
        more = ""
        if name == "bounded_response" and outcome == "passed":
            more = (
                f": at most {properties['uncontrollables_bound']} uncontrollable and "
                f"{properties['controllables_bound']} controllable events in a row"
            )
        if outcome == "not checked":
            more = f": more than {properties['limit']} states, or very many transitions"
        lines.append(f"  {name.replace('_', ' '):<25} {outcome}{more}")
    for item in (*report["faults"], *properties["faults"]):
        if item["check"] == _MISCOUNT:
            lines.append(f"wrong states: {item['message']}")
        else:
            after = ", ".join(item["trace"]) or "nothing"
            lack = _LACK.get(item["check"], f"not {item['check'].replace('_', ' ')}")
            lines.append(f"{lack}: {item['message']}, after {after}")
    return "".join(f"{visible(line)}\n" for line in lines)


def _verified(
    supervisor: SystemSupervisor,
    options: SynthesisOptions,
    limits: "Limits",
    on_progress: Callable[[Progress], None],
    should_stop: Callable[[], bool],
) -> "VerificationReport":
    from robosc.verification import verify

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
        text=cif_text,
        should_stop=should_stop,
        on_progress=report,
    )
