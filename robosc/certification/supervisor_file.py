"""Verification of an untrusted supervisor file against its model.

Nothing in the file is trusted. Its model is compared with the model that is read again from the texts, its added
conditions are verified on the model from the texts, and its certificate is compared with the result of that
verification. A digest in a file proves nothing, because a person who changes the file can change the digest, too: a
different digest is reported, but does not change the verdict.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import prod

from robosc._version import __version__
from robosc.automata import ExecutableSystem, Semantics, System
from robosc.automata.compile import State
from robosc.automata.goal_memory import Aim, AimKind
from robosc.automata.plants import communication_plant_name
from robosc.automata.state import subjects
from robosc.certification.certify import with_modules
from robosc.certification.differences import model_differences
from robosc.certification.strategies import verify_strategy
from robosc.controller_properties import Controller, check_controller
from robosc.errors import Diagnostic, sorted_diagnostics
from robosc.expressions import Value
from robosc.expressions.text import automaton_text, variable_text
from robosc.model.check import check
from robosc.model.layers import layer_findings
from robosc.model.structure import CommunicationKind, Deployment, Model
from robosc.source import Bundle
from robosc.supervisor import Certificate, ControllerProperties, Supervisor
from robosc.supervisor.predicates import state_predicates
from robosc.verification import CheckOutcome, Limits, Verification, VerificationReport, verify

PROPERTIES = ("safe", "controllable", "nonblocking", "maximally_permissive")
"""The four properties, as certificates call them."""

GOALS = "goals"
"""The check of a strategy, as certificates call it."""


@dataclass(frozen=True, slots=True)
class StateInWords:
    """A state in the words of the model, in source order.

    Attributes:
        components: The state of each component with a behaviour; of automata without a model, the location of each.
        variables: The value of each synthesis variable, by `Component.variable`.
        communications: Location of each service and action; of one that is named like a component, by `service name`
            or `action name`.
    """

    components: dict[str, str]
    variables: dict[str, Value]
    communications: dict[str, str]

    @property
    def parts(self) -> dict[str, Value]:
        """Every part by its name."""
        return {**self.components, **self.variables, **self.communications}

    def __str__(self) -> str:
        return self.text()

    def text(self) -> str:
        """Return the state in one line."""
        return ", ".join(
            f"{name} = {str(value).lower() if isinstance(value, bool) else value}" for name, value in self.parts.items()
        )


@dataclass(frozen=True, slots=True)
class Fault:
    """Fault of a supervisor.

    Attributes:
        check: `deployment`, `model`, `certificate`, or the property that does not hold.
        message: The fault, in words.
        trace: Events of a run into the failure, or None where none belongs to it.
        is_shortest: True if there is certainly no shorter run.
        state: The state that it leads to, or None where none belongs to it.
    """

    check: str
    message: str
    trace: tuple[str, ...] | None = None
    is_shortest: bool = True
    state: StateInWords | None = None


@dataclass(frozen=True, slots=True)
class FileVerification:
    """The outcome of the verification of a supervisor file.

    Attributes:
        diagnostics: Reasons why the texts hold no model that the supervisor could be for; empty where they do.
        faults: Faults of the supervisor; a right one has none.
        notes: Remarks that are worth knowing, but decide nothing.
        report: The verifier's, or None where the supervisor is for another model or deployment.
        goals: Outcome of the check of its strategy, or None where it has none.
        method: Description of what was done, in one line; empty where there is no report.
    """

    diagnostics: tuple[Diagnostic, ...]
    faults: tuple[Fault, ...]
    notes: tuple[str, ...]
    report: VerificationReport | None
    goals: CheckOutcome | None = None
    method: str = ""

    def outcomes(self) -> dict[str, CheckOutcome]:
        """Return the outcome of each check, in order."""
        faulty = {fault.check for fault in self.faults}
        found = {
            name: CheckOutcome.FAILED if name in faulty else CheckOutcome.PASSED for name in ("deployment", "model")
        }
        if self.report is None:
            found |= dict.fromkeys(("certificate", *PROPERTIES), CheckOutcome.NOT_CHECKED)
        else:
            found["certificate"] = CheckOutcome.FAILED if "certificate" in faulty else CheckOutcome.PASSED
            found |= {name: getattr(self.report.verification, name) for name in PROPERTIES}
        return found if self.goals is None else found | {GOALS: self.goals}

    @property
    def has_passed(self) -> bool:
        """True if it is safe, controllable and nonblocking for certain, reaches its goals, and nothing is wrong."""
        if self.faults or self.report is None or self.goals is CheckOutcome.NOT_CHECKED:
            return False
        return self.report.is_complete

    def unchecked(self) -> tuple[str, ...]:
        """Return the names of the checks that were not made."""
        return tuple(name for name, outcome in self.outcomes().items() if outcome is CheckOutcome.NOT_CHECKED)


def verify_supervisor_file(
    supervisor: Supervisor,
    bundle: Bundle | None,
    limits: Limits,
    *,
    deployment: Deployment | None = None,
    engine: str = "auto",
    should_stop: Callable[[], bool] = lambda: False,
    on_progress: Callable[[str], None] = lambda message: None,
) -> FileVerification:
    """Check a supervisor against the texts of its model.

    Args:
        supervisor: Supervisor as `decode` read it.
        bundle: The texts; None: the model that the supervisor holds, which has nothing to be compared with.
        limits: Limits of the check.
        deployment: Intended deployment, or None to take the supervisor's word for that.
        engine: Engine of a symbolic search.
        should_stop: Function called now and then; once it returns true, the work ends.
        on_progress: Function called now and then with the progress of the work, in one short line.

    Raises:
        SynthesisCancelled: `should_stop` became true.
        UnsupportedModelError: The texts' model is nested too deeply, or outside what synthesis handles.
    """
    model = supervisor.model
    if bundle is not None:
        checked = check(bundle)
        if checked.model is None or checked.places is None:
            return FileVerification(checked.diagnostics, (), (), None)
        model = checked.model
        if (deployment or supervisor.deployment) is Deployment.LAYER:
            ambiguous = layer_findings(model, checked.places)
            if ambiguous:
                return FileVerification(sorted_diagnostics((*checked.diagnostics, *ambiguous)), (), (), None)
    faults = [Fault("model", text) for text in model_differences(supervisor.model, model)]
    has_actions = any(item.kind is CommunicationKind.ACTION for item in model.communications)
    if deployment not in (None, supervisor.deployment) and has_actions:
        faults.append(Fault("deployment", f"it was made for the deployment {supervisor.deployment}, not {deployment}"))
    notes = tuple(_notes(supervisor.certificate, bundle))
    # Until its strategy is checked.
    goals = None if supervisor.strategy is None else CheckOutcome.NOT_CHECKED
    if faults:
        return FileVerification((), tuple(faults), notes, None, goals)
    executable = ExecutableSystem(model, supervisor.deployment)
    system = executable.automata
    semantics = Semantics(system)

    added = state_predicates(system, supervisor.added)

    def verified_with(expected_states: int) -> VerificationReport:
        return verify(
            system,
            added,
            limits,
            expected_states=expected_states,
            engine=engine,
            semantics=semantics,
            should_stop=should_stop,
            on_progress=on_progress,
        )

    # The stated number of states decides only which search is tried first: a false figure must not prevent it.
    stated = int(supervisor.certificate.states) or prod(int(item.states) for item in supervisor.modules)
    report = verified_with(stated)
    if stated > limits.states and not report.is_complete:
        report = verified_with(0)
    if len(supervisor.modules) > 1:
        # The modules that the file names decide only what can be shown.
        modules = [item.automata for item in supervisor.modules]
        report = with_modules(report, system, added, modules, limits, should_stop=should_stop)
    found = report.verification
    faults += [
        Fault("certificate", text)
        for text in _false_claims(supervisor.certificate, found, has_modules=bool(supervisor.modules))
    ]
    controller = Controller(executable, supervisor.added, semantics)
    claimed = supervisor.certificate.controller
    if claimed is not None:
        properties = check_controller(
            executable,
            supervisor.added,
            is_nonblocking=found.nonblocking is CheckOutcome.PASSED,
            states=found.states or stated,
            controller=controller,
            should_stop=should_stop,
        ).certified()
        faults += [Fault("certificate", text) for text in _false_properties(claimed, properties)]
    method = report.method
    if supervisor.strategy is not None:
        under = verify_strategy(
            executable,
            supervisor.added,
            supervisor.strategy,
            limits,
            engine=engine,
            controller=controller,
            should_stop=should_stop,
            on_progress=on_progress,
        )
        goals, method = under.outcome, f"{method}; {under.method}"
        if under.missed is not None:
            if supervisor.certificate.goals == "passed":
                faults.append(Fault("certificate", "it says 'goals: passed', which is false"))
            state = state_in_words(system, model, under.missed.state)
            number = under.missed.goal
            missed = _missed(None if number is None else executable.obligations.aims[number])
            faults.append(Fault(GOALS, missed, under.missed.trace, is_shortest=False, state=state))
    faults += [
        Fault(
            item.property.replace(" ", "_"),
            item.reason,
            item.trace,
            item.is_shortest,
            state_in_words(system, model, item.state),
        )
        for item in found.failures
    ]
    remarks = (*notes, *_beliefs(supervisor.certificate, found, goals))
    return FileVerification((), tuple(faults), remarks, report, goals, method)


def _missed(aim: Aim | None) -> str:
    if aim is None:
        return "the strategy chooses a request that is not enabled, or silent steps do not end under it"
    what = f"{aim.name} may never come true again" if aim.kind is AimKind.GOAL else f"{aim.name} may never be reached"
    return f"under the strategy {what} although every assumption does"


def _notes(certificate: Certificate, bundle: Bundle | None) -> list[str]:
    """Return notes on differences that decide nothing."""
    notes = []
    if bundle is not None and certificate.bundle_sha256 != bundle.digest:
        notes.append(
            "the certificate's digest is of other texts than these; only the models that the texts mean are compared"
        )
    if certificate.engine_version != __version__:
        notes.append(f"it was made by RoboSC {certificate.engine_version}; this is {__version__}")
    return notes


def _false_claims(certificate: Certificate, found: Verification, *, has_modules: bool) -> list[str]:
    """Return the false claims of a certificate."""
    claims = []
    # The states of modules that share something may not have been counted.
    states = None if has_modules and certificate.states == "0" else certificate.states
    for what, stated, counted in (
        ("states", states, found.states),
        ("transitions", certificate.transitions, found.transitions),
    ):
        if stated is not None and counted is not None and int(stated) != counted:
            claims.append(f"it states {stated} {what}, there are {counted}")
    for name in PROPERTIES:
        if getattr(certificate, name) == "passed" and getattr(found, name) is CheckOutcome.FAILED:
            claims.append(f"it says '{name.replace('_', ' ')}: passed', which is false")
    return claims


def _false_properties(stated: ControllerProperties, found: ControllerProperties) -> list[str]:
    """Return the false claims of a certificate about the controller."""
    return [
        f"it says '{name.replace('_', ' ')} of the controller: passed', which is false"
        for name in ("finite_response", "confluence", "nonblocking", "cancels")
        if getattr(stated, name) == "passed" and getattr(found, name) == "failed"
    ]


def _beliefs(certificate: Certificate, found: Verification, goals: CheckOutcome | None) -> list[str]:
    """Return the claims of a certificate that were not checked here."""
    claimed = [
        name.replace("_", " ")
        for name in PROPERTIES
        if getattr(certificate, name) == "passed" and getattr(found, name) is CheckOutcome.NOT_CHECKED
    ]
    if certificate.goals == "passed" and goals is CheckOutcome.NOT_CHECKED:
        claimed.append(GOALS)
    return [f"the certificate says 'passed' for what was not checked here: {', '.join(claimed)}"] if claimed else []


def state_in_words(system: System, model: Model | None, state: State) -> StateInWords:
    """A state of automata in the words of their model; without one, the location of each automaton is reported."""
    values = {(item.automaton, item.variable): value for item, value in zip(subjects(system), state, strict=True)}
    variables = {variable_text(owner, name): value for (owner, name), value in values.items() if name is not None}
    if model is None:
        locations = {owner: str(value) for (owner, name), value in values.items() if name is None}
        # An input variable's automaton has one location: its value is all that there is.
        return StateInWords({owner: item for owner, item in locations.items() if owner not in variables}, variables, {})
    components = {item.name for item in model.components}
    plants = [
        communication_plant_name(item)
        for item in model.communications
        if item.kind in (CommunicationKind.SERVICE, CommunicationKind.ACTION)
    ]
    return StateInWords(
        components={item.name: str(values[item.name, None]) for item in model.components if item.behaviour},
        variables=variables,
        communications={automaton_text(plant, components): str(values[plant, None]) for plant in plants},
    )
