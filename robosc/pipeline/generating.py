"""Generation of files that run a supervisor."""

from dataclasses import replace

from robosc.automata import System
from robosc.certification import OutcomeStatus, Progress, SynthesisOutcome
from robosc.certification.progress import OnProgress, ShouldStop, ignored, never
from robosc.errors import UnsupportedModelError
from robosc.explanation import EmptyExplanation
from robosc.pipeline.automata_models import automata_synthesis
from robosc.pipeline.findings import Findings
from robosc.pipeline.loading import LoadedAutomata, ModelLike, loaded
from robosc.pipeline.options import DEFAULT_OPTIONS, SynthesisOptions
from robosc.pipeline.results import Generation, SynthesisStatus
from robosc.pipeline.supervisors import Supervisor
from robosc.pipeline.synthesis import Unsupported, findings_of, make, status_of
from robosc.pipeline.systems import SystemSupervisor
from robosc.supervisor import Supervisor as CoreSupervisor
from robosc.targets import GenerateOptions, TargetRefusal, generate_automata, generate_or_refuse, require_generatable

DEFAULT_GENERATION = GenerateOptions()
UNKNOWN_FINDINGS = (
    "the findings about the model of this supervisor are not known, and some are errors for a target: generate from "
    "the model, or from the supervisor that robosc.synthesize returned"
)


def generate(
    model: ModelLike | CoreSupervisor | System | SystemSupervisor,
    target: str,
    generation: GenerateOptions = DEFAULT_GENERATION,
    options: SynthesisOptions = DEFAULT_OPTIONS,
    *,
    initial: str | None = None,
    is_modular: bool = False,
    on_progress: OnProgress = ignored,
    should_stop: ShouldStop = never,
) -> Generation:
    """Generate the files of a target around a supervisor; from a model, the supervisor is made first.

    Nothing is written before `write` of the result.

    Args:
        model: A supervisor that `synthesize` has made, a model as `load` returns it, or the path of a model; for the
            targets c99, cif and python also automata or their supervisor. A supervisor that was read from a file is
            refused, because some findings about its model are errors for a target.
        target: Name of the target, or `all`.
        generation: Choices about the files.
        options: Options for making the supervisor of a model.
        initial: Description of the initial state of automata that have several, such as `tank.level = 1`.
        is_modular: True for a synthesis in modules, as of `synthesize`.
        on_progress: Function called with the progress of the work.
        should_stop: Function called again and again; once it returns true, the work ends.

    Raises:
        UnknownTargetError: There is no such target.
        TypeError: `initial` is given for a model of a robot or for a supervisor.
        ValueError: An option is for models of robots, and the file holds automata.
        RequestError: `initial` names something that does not exist.
        FileAccessError: The file does not exist or cannot be read.
        LanguageError: A file is too large or not UTF-8.
        InvalidSystemError: The automata do not fit together.
        NodeLimitError: Decision diagrams became larger than the options allow.
        UnknownEngineError: There is no such engine.
        SynthesisCancelled: `should_stop` became true.
    """
    require_generatable(target)
    if isinstance(model, CoreSupervisor):
        diagnostics = model.diagnostics if isinstance(model, Supervisor) else None
        if diagnostics is None:
            return Generation(SynthesisStatus.UNSUPPORTED_MODEL, (), UNKNOWN_FINDINGS, None, target=target)
        return _generation(
            SynthesisOutcome(OutcomeStatus.SUPERVISOR, model, diagnostics), target, generation, on_progress
        )
    if isinstance(model, SystemSupervisor):
        if initial is not None:
            raise TypeError("initial= chooses before the synthesis where automata begin: give the automata")
        return _of_automata(model, Findings(), target, generation, on_progress)
    bundle = model if isinstance(model, System) else loaded(model)
    if isinstance(bundle, System | LoadedAutomata):
        made = automata_synthesis(bundle, options, on_progress, should_stop, is_modular=is_modular, initial=initial)
        if made.supervisor is None:
            explanation = made.explanation if isinstance(made.explanation, EmptyExplanation) else None
            return Generation(made.status, made.diagnostics, made.reason, None, explanation, target)
        return _of_automata(made.supervisor, made.diagnostics, target, generation, on_progress)
    if initial is not None:
        raise TypeError("initial= chooses where automata begin: a robot begins in one state")
    attempt = make(
        bundle, options, on_progress, should_stop, allow_livelock=options.allow_livelock, is_modular=is_modular
    )
    if isinstance(attempt, Unsupported):
        status, reason = status_of(attempt)
        return Generation(status, findings_of(attempt, bundle), reason, None, target=target)
    found = _generation(attempt, target, generation, on_progress)
    return replace(found, diagnostics=Findings(found.diagnostics, bundle))


def _of_automata(
    supervisor: SystemSupervisor,
    diagnostics: Findings,
    target: str,
    options: GenerateOptions,
    on_progress: OnProgress,
) -> Generation:
    on_progress(Progress("generation", target))
    try:
        files = generate_automata(supervisor, target, options)
    except UnsupportedModelError as error:
        return Generation(SynthesisStatus.UNSUPPORTED_MODEL, diagnostics, str(error), None, target=target)
    return Generation(SynthesisStatus.SUPERVISOR, diagnostics, "", files, target=target)


def generation_of(outcome: SynthesisOutcome, target: str, options: GenerateOptions) -> Generation:
    """Return the files of a target, or of all of them, for the outcome of a synthesis.

    Raises:
        UnknownTargetError: There is no such target.
        UnsupportedModelError: The model is outside what the target handles.
    """
    status, diagnostics = SynthesisStatus(str(outcome.status)), outcome.diagnostics
    files = generate_or_refuse(outcome.supervisor, diagnostics, target, options)
    if isinstance(files, TargetRefusal):
        status, diagnostics, files = SynthesisStatus.MODEL_ERRORS, files.diagnostics, None
    return Generation(status, diagnostics, outcome.reason, files, outcome.explanation, target)


def _generation(
    outcome: SynthesisOutcome, target: str, options: GenerateOptions, on_progress: OnProgress
) -> Generation:
    on_progress(Progress("generation", target))
    try:
        return generation_of(outcome, target, options)
    except UnsupportedModelError as error:
        return Generation(SynthesisStatus.UNSUPPORTED_MODEL, outcome.diagnostics, str(error), None, target=target)
