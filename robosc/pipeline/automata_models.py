"""Automata as models: loaded from a file (CIF, libFAUDES, Supremica), checked, synthesized and verified."""

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

from robosc.automata import CheckedSystem, System, SystemPlaces, as_controlled
from robosc.errors import Diagnostic, InvalidSupervisorError, Severity, sorted_diagnostics
from robosc.expressions import conjunction
from robosc.json_documents import diagnostics_json
from robosc.pipeline.automata_files import check_automata_file
from robosc.pipeline.findings import Findings
from robosc.pipeline.loading import LoadedAutomata
from robosc.pipeline.options import DEFAULT_OPTIONS, SynthesisOptions
from robosc.pipeline.results import NoSupervisor, SynthesisStatus, Verification, VerificationStatus
from robosc.pipeline.systems import SystemSupervisor, SystemSynthesis, synthesize_system, verify_system

if TYPE_CHECKING:
    from robosc.certification.progress import OnProgress, ShouldStop
    from robosc.verification import Limits

_OF_ROBOTS = ("deployment", "allow_livelock", "verified_states")


def checked_automata(model: LoadedAutomata, options: SynthesisOptions = DEFAULT_OPTIONS) -> CheckedSystem:
    """Return the findings about automata, before a synthesis with these options.

    Raises:
        ValueError: An option is for models of robots alone.
    """
    for name in _OF_ROBOTS:
        if getattr(options, name) != getattr(DEFAULT_OPTIONS, name):
            raise ValueError(f"{name} is for models of robots, and {model.name} holds automata: leave it out")
    return check_automata_file(model)


def begun(system: System, initial: str) -> System:
    """Return automata with fewer initial states: those that a description fits, such as `tank.level = 1`.

    Raises:
        RequestError: The description names something that does not exist.
    """
    from robosc.explanation.requests import SystemQuestionReader

    return replace(system, initial=conjunction(system.initial, SystemQuestionReader(system).state(initial)))


def automata_synthesis(
    model: LoadedAutomata | System,
    options: SynthesisOptions,
    on_progress: "OnProgress",
    should_stop: "ShouldStop",
    *,
    is_modular: bool = False,
    initial: str | None = None,
    as_is: bool = False,
) -> SystemSynthesis:
    """Synthesize the supervisor of automata; parameters and errors as of `robosc.synthesize`.

    With `as_is`, nothing is added: the requirements are taken for a supervisor that was made already.

    Raises:
        ValueError: An option is for models of robots alone.
        RequestError: `initial` names something that does not exist.
    """
    found = CheckedSystem(model, ()) if isinstance(model, System) else checked_automata(model, options)
    diagnostics = Findings(found.diagnostics, None if isinstance(model, System) else model)
    system = found.system
    if system is None:
        explanation = NoSupervisor("", diagnostics)
        return SystemSynthesis(SynthesisStatus.MODEL_ERRORS, "", None, None, diagnostics, explanation)
    if initial is not None:
        system = begun(system, initial)
    if as_is:
        system = as_controlled(system)
    made = synthesize_system(system, options, on_progress, should_stop, found.places, is_modular=is_modular)
    if made.supervisor is not None and not isinstance(model, System):
        forbidden = _forbidden(made.supervisor, found.places)
        diagnostics = Findings(sorted_diagnostics([*diagnostics, *forbidden]), model)
    return replace(made, diagnostics=diagnostics)


def _forbidden(supervisor: SystemSupervisor, places: SystemPlaces) -> Iterator[Diagnostic]:
    """Yield warnings of events that the supervisor always forbids."""
    for item in supervisor.added:
        if not item.condition.root:
            yield Diagnostic(
                Severity.WARNING,
                "never-enabled",
                f"'{item.event}' can never happen: the supervisor forbids it wherever plants and requirements allow it",
                places.events.get(item.event),
                f"Run 'robosc explain-synthesis --event {item.event}' to see why.",
            )


def automata_verification(
    model: LoadedAutomata,
    options: SynthesisOptions,
    limits: "Limits",
    on_progress: "OnProgress",
    should_stop: "ShouldStop",
    *,
    is_strict: bool,
    controller: bool = False,
    as_is: bool = False,
) -> Verification:
    """Synthesize the supervisor of automata, and verify it independently, with `controller` its properties, too.

    With `as_is`, nothing is synthesized: the automata are verified as they stand.
    """
    from robosc.explanation import EmptyExplanation, document

    made = automata_synthesis(model, options, on_progress, should_stop, as_is=as_is)
    if made.status is SynthesisStatus.UNSUPPORTED_MODEL:
        return Verification(VerificationStatus.UNSUPPORTED_MODEL, made.diagnostics, made.reason, {})
    findings = diagnostics_json(made.diagnostics)
    if made.supervisor is None:
        explanation = document(made.explanation) if isinstance(made.explanation, EmptyExplanation) else None
        report = {"status": str(made.status), "reason": made.reason, "explanation": explanation, **findings}
        return Verification(VerificationStatus.NO_SUPERVISOR, made.diagnostics, made.reason, report)
    found = verify_system(
        made.supervisor, options, limits, on_progress, should_stop, is_strict=is_strict, controller=controller
    )
    return replace(found, diagnostics=made.diagnostics, report={**found.report, **findings})


def file_verification(
    model: LoadedAutomata,
    supervisor: SystemSupervisor,
    options: SynthesisOptions,
    limits: "Limits",
    on_progress: "OnProgress",
    should_stop: "ShouldStop",
    *,
    is_strict: bool,
    controller: bool = False,
) -> Verification:
    """Verify a supervisor that was read from a file; its automata must be those of the model.

    Raises:
        InvalidSupervisorError: It is the supervisor of other automata.
    """
    checked = checked_automata(model, options)
    diagnostics = Findings(checked.diagnostics, model)
    findings = diagnostics_json(diagnostics)
    if checked.system is None:
        report = {"status": str(SynthesisStatus.MODEL_ERRORS), "reason": "", "explanation": None, **findings}
        return Verification(VerificationStatus.NO_SUPERVISOR, diagnostics, "", report)
    if supervisor.system != checked.system:
        raise InvalidSupervisorError(f"the supervisor is one of other automata than those of {model.name}")
    found = verify_system(
        supervisor, options, limits, on_progress, should_stop, is_strict=is_strict, controller=controller
    )
    return replace(found, diagnostics=diagnostics, report={**found.report, **findings})
