"""Verification of properties of the robot under its supervisor, and of supervisor files."""

from collections.abc import Callable, Sequence
from typing import overload

from robosc.automata import System
from robosc.certification import Progress, SynthesisOutcome
from robosc.certification.file_report import file_verification_json, file_verification_text, has_passed, malformed_json
from robosc.certification.progress import OnProgress, ShouldStop, ignored, never
from robosc.certification.reasons import reasons_json
from robosc.certification.supervisor_file import verify_supervisor_file
from robosc.errors import InvalidSupervisorError, LanguageError, UnsupportedModelError
from robosc.json_documents import diagnostics_json
from robosc.model.check import check
from robosc.model.structure import Model
from robosc.model_checking import (
    Property,
    Verdict,
    properties_of,
    property_errors_json,
    verdict_text,
    verdicts_json,
    verify_properties,
)
from robosc.pipeline.automata_models import automata_verification
from robosc.pipeline.files import FileName
from robosc.pipeline.findings import Findings
from robosc.pipeline.loading import LoadedAutomata, LoadedModel, ModelLike, loaded, property_file
from robosc.pipeline.options import DEFAULT_OPTIONS, FOREIGN_STATES, SynthesisOptions
from robosc.pipeline.results import Verification, VerificationStatus
from robosc.pipeline.supervisors import SupervisorLike, supervisor_of
from robosc.pipeline.synthesis import Unsupported, findings_of, make, status_of
from robosc.pipeline.systems import SystemSupervisor, verify_system
from robosc.source import Bundle, SourceFile
from robosc.supervisor import Supervisor as CoreSupervisor
from robosc.synthesis import EngineOptions, SynthesisProgress
from robosc.synthesis.engines import resolve_engine
from robosc.verification import Limits

type Properties = str | Sequence[str]
"""One property, or several."""


@overload
def verify(
    model: SystemSupervisor,
    *,
    options: SynthesisOptions | None = None,
    maximum_states: int | None = None,
    is_strict: bool = False,
    controller: bool = False,
    on_progress: OnProgress = ignored,
    should_stop: ShouldStop = never,
) -> Verification: ...


@overload
def verify(
    model: ModelLike | CoreSupervisor,
    properties: Properties = (),
    *,
    property_files: Sequence[FileName | SourceFile] = (),
    supervisor: SupervisorLike | None = None,
    options: SynthesisOptions | None = None,
    maximum_states: int | None = None,
    is_strict: bool = False,
    controller: bool = False,
    as_is: bool = False,
    on_progress: OnProgress = ignored,
    should_stop: ShouldStop = never,
) -> Verification: ...


def verify(
    model: ModelLike | CoreSupervisor | SystemSupervisor,
    properties: Properties = (),
    *,
    property_files: Sequence[FileName | SourceFile] = (),
    supervisor: SupervisorLike | None = None,
    options: SynthesisOptions | None = None,
    maximum_states: int | None = None,
    is_strict: bool = False,
    controller: bool = False,
    as_is: bool = False,
    on_progress: OnProgress = ignored,
    should_stop: ShouldStop = never,
) -> Verification:
    """Verify properties of the robot under its supervisor, or check a supervisor against its model.

    With `supervisor`, this supervisor is checked first, without trust in its certificate; properties are verified only
    if it passes. Without `supervisor`, it is made from the model, or `model` is a supervisor; without properties it is
    checked against its model. A supervisor of automata, made from them or given, is checked against the automata.

    Args:
        model: The model, as `load` returns it, the path of its file, or a supervisor from `synthesize`.
        properties: A property such as `AG EF Navigator.ready`, or several.
        property_files: Files with a property on each line.
        supervisor: The supervisor to check: the value, the path of its file or the file's bytes.
        options: Options for making the supervisor, and the deployment that a given one must have; None: its own.
        maximum_states: States up to which a given supervisor is searched state by state; None: 1,000,000.
        is_strict: True if a given supervisor passes only if permissiveness was checked, too.
        controller: True if automata, or their supervisor, are also checked for bounded and finite response, confluence
            and nonblocking under control.
        as_is: True if nothing is synthesized for automata: they are checked as they stand, with requirements for their
            supervisor.
        on_progress: Function called with the progress of the work.
        should_stop: Function called again and again; once it returns true, the work ends.

    Raises:
        TypeError: Arguments do not fit together.
        ValueError: The files hold no property, or `maximum_states` is negative.
        FileAccessError: A file does not exist or cannot be read.
        LanguageError: A file is too large or not UTF-8.
        NodeLimitError: Decision diagrams became larger than the options allow.
        UnknownEngineError: There is no such engine.
        SynthesisCancelled: `should_stop` became true.
    """
    texts = [properties] if isinstance(properties, str) else list(properties)
    claims = _Claims(texts, [property_file(file) for file in property_files])
    chosen = options or DEFAULT_OPTIONS
    states = FOREIGN_STATES if maximum_states is None else maximum_states
    if states < 0:
        raise ValueError(f"maximum_states is {states}, and must not be negative")
    limits = Limits.of(states)
    if isinstance(model, SystemSupervisor):
        if claims or supervisor is not None or as_is:
            raise TypeError(
                "a supervisor of automata is verified by itself: properties, supervisor= and as_is= need a model"
            )
        return verify_system(
            model, chosen, limits, on_progress, should_stop, is_strict=is_strict, controller=controller
        )
    try:
        bundle = None if isinstance(model, CoreSupervisor) else loaded(model)
        if isinstance(bundle, LoadedAutomata):
            if claims or supervisor is not None:
                raise TypeError("automata are verified by themselves: properties and supervisor= need a robot's model")
            return automata_verification(
                bundle, chosen, limits, on_progress, should_stop, is_strict=is_strict, controller=controller,
                as_is=as_is,
            )  # fmt: skip
        if controller:
            raise TypeError("controller= is for automata: synthesize checks the controller of a robot")
        if as_is:
            raise TypeError("as_is= is for automata: a robot has a supervisor only if one is synthesized")
        if supervisor is not None:
            if bundle is None:
                raise TypeError("supervisor= is checked against a model: give the model as the first argument")
            check = _SupervisorCheck(bundle, supervisor, options, limits, is_strict)
            return _checked(check, claims, on_progress, should_stop)
        if isinstance(model, CoreSupervisor):
            made: Verification | CoreSupervisor = model
        else:
            made = _synthesized(bundle or loaded(model), claims, chosen, on_progress, should_stop)
        if isinstance(made, Verification):
            return made
        if claims:
            return claims.verified(made, chosen.engine_options(), on_progress, should_stop)
        return _checked(_SupervisorCheck(None, made, options, limits, is_strict), claims, on_progress, should_stop)
    except UnsupportedModelError as error:
        return Verification(VerificationStatus.UNSUPPORTED_MODEL, (), str(error), {})


class _SupervisorCheck:
    """A supervisor to check, with options; without a model, it is checked against the model in its file."""

    def __init__(
        self,
        model: LoadedModel | None,
        supervisor: SupervisorLike,
        options: SynthesisOptions | None,
        limits: Limits,
        is_strict: bool,
    ) -> None:
        self.model = model
        self.supervisor = supervisor
        self.options = options or DEFAULT_OPTIONS
        self.deployment = None if options is None else options.deployment
        self.limits = limits
        self.is_strict = is_strict


class _Claims:
    """Properties as texts: one each, and one on each line."""

    def __init__(self, texts: Sequence[str], listings: Sequence[SourceFile]) -> None:
        self.texts = [SourceFile(f"property {number}", text) for number, text in enumerate(texts, start=1)]
        self.listings = listings

    def __bool__(self) -> bool:
        return bool(self.texts or self.listings)

    def of(self, model: Model) -> tuple[Property, ...]:
        """The properties of a robot.

        Raises:
            LanguageError: The properties have errors.
            ValueError: There is no property.
        """
        found = properties_of(model, self.texts, self.listings)
        if not found:
            raise ValueError(f"there is no property in {' and '.join(file.name for file in self.listings)}")
        return found

    def errors(self, model: Model) -> Verification | None:
        """The result if a property cannot be understood, or None."""
        try:
            self.of(model)
        except LanguageError as error:
            first, *others = [*self.texts, *self.listings]
            diagnostics = Findings(error.diagnostics, Bundle(first, tuple(others)))
            report = property_errors_json(error.diagnostics)
            return Verification(VerificationStatus.PROPERTY_ERRORS, diagnostics, "", report)
        return None

    def verified(
        self, supervisor: CoreSupervisor, engine: EngineOptions, on_progress: OnProgress, should_stop: ShouldStop
    ) -> Verification:
        """The verdicts in the system that a supervisor controls."""
        errors = self.errors(supervisor.model)
        if errors is not None:
            return errors

        def report(progress: SynthesisProgress) -> None:
            on_progress(Progress("verification", str(progress)))

        verdicts, system = verdicts_of(
            supervisor, self.of(supervisor.model), engine, on_progress=report, should_stop=should_stop
        )
        holds = all(verdict.holds for verdict in verdicts)
        return Verification(
            VerificationStatus.PASSED if holds else VerificationStatus.FAILED,
            (),
            "",
            verdicts_json(verdicts, system, supervisor.model),
            "".join(verdict_text(verdict, system, supervisor.model) for verdict in verdicts),
        )


def verdicts_of(
    supervisor: CoreSupervisor,
    properties: Sequence[Property],
    engine: EngineOptions,
    *,
    on_progress: Callable[[SynthesisProgress], None] = lambda progress: None,
    should_stop: ShouldStop = never,
) -> tuple[tuple[Verdict, ...], System]:
    """Return the verdicts on properties of the system that a supervisor controls, and its automata.

    Raises:
        NodeLimitError, UnknownEngineError, SynthesisCancelled, UnsupportedModelError: As `verify_properties`.
    """
    system = supervisor.executable.automata
    verdicts = verify_properties(
        system, supervisor.added, properties, engine=engine, on_progress=on_progress, should_stop=should_stop
    )
    return verdicts, system


def _checked(
    given: _SupervisorCheck, claims: _Claims, on_progress: OnProgress, should_stop: ShouldStop
) -> Verification:
    """Check the given supervisor; verify properties of its robot if it passes."""
    engine = resolve_engine(given.options.engine)
    try:
        supervisor = supervisor_of(given.supervisor)
    except InvalidSupervisorError as error:
        return Verification(VerificationStatus.FAILED, (), str(error), malformed_json(error))
    found = verify_supervisor_file(
        supervisor,
        given.model,
        given.limits,
        deployment=given.deployment,
        engine=engine,
        should_stop=should_stop,
        on_progress=lambda message: on_progress(Progress("verification", message)),
    )
    if has_passed(found, is_strict=given.is_strict) and claims:
        return claims.verified(supervisor, given.options.engine_options(), on_progress, should_stop)
    report = file_verification_json(found, supervisor, is_strict=given.is_strict)
    is_library = not (found.diagnostics or found.report or found.faults)
    return Verification(
        VerificationStatus(str(report["status"])),
        Findings(found.diagnostics, given.model),
        "a library has no robot that a supervisor could be for" if is_library else "",
        report,
        file_verification_text(report, supervisor.model.name, *([] if given.model is None else [given.model.name])),
    )


def _synthesized(
    model: LoadedModel, claims: _Claims, options: SynthesisOptions, on_progress: OnProgress, should_stop: ShouldStop
) -> Verification | CoreSupervisor:
    """Return the supervisor of a model, or the result if a property has errors or there is no supervisor."""
    # Errors of properties are reported before the synthesis, which may take long.
    robot = check(model).model
    errors = claims.errors(robot) if robot is not None and claims else None
    if errors is not None:
        return errors
    attempt = make(model, options, on_progress, should_stop, allow_livelock=True, only_shown=True)
    if isinstance(attempt, Unsupported):
        raise UnsupportedModelError(attempt.reason)
    if attempt.supervisor is not None:
        return attempt.supervisor
    return _without(attempt, model)


def _without(outcome: SynthesisOutcome, model: LoadedModel) -> Verification:
    status, reason = status_of(outcome)
    report = {"status": str(status), **reasons_json(outcome), **diagnostics_json(outcome.diagnostics)}
    return Verification(VerificationStatus.NO_SUPERVISOR, findings_of(outcome, model), reason, report)
