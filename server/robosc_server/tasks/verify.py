"""Verification of a given supervisor, and of properties of the robot under its supervisor."""

from collections.abc import Callable, Mapping
from typing import Any

from robosc.automata import to_automata
from robosc.certification.file_report import file_verification_json, has_passed, malformed_json
from robosc.certification.reasons import reasons_json
from robosc.certification.supervisor_file import FileVerification, verify_supervisor_file
from robosc.errors import InvalidSupervisorError, LanguageError, UnsupportedModelError
from robosc.json_documents import diagnostics_json, json_text
from robosc.model.check import check
from robosc.model.structure import Model
from robosc.model_checking import Property, properties_of, property_errors_json, verdicts_json, verify_properties
from robosc.source import SourceFile
from robosc.supervisor import Supervisor, decode
from robosc.synthesis.engines import resolve_engine
from robosc.verification import Limits
from robosc_api.v1 import synthesis_pb2 as pb
from robosc_server.tasks.convert import from_proto, to_proto
from robosc_server.tasks.synthesis_attempt import OnReport, SynthesisAttempt
from robosc_server.tasks.task import Report

DEFAULT_STATES = 1_000_000
"""States up to which a given supervisor is searched one by one, unless the request says otherwise."""

_OUTCOMES = {
    "passed": pb.VERIFICATION_STATUS_PASSED,
    "failed": pb.VERIFICATION_STATUS_FAILED,
    "not checked": pb.VERIFICATION_STATUS_NOT_CHECKED,
}


class NoPropertyError(Exception):
    """Texts that hold no property; one sentence for the caller."""


def verification(request: pb.VerifyRequest, maximum_nodes: int, on_report: OnReport) -> pb.VerificationResult:
    """Return the result of a verification request.

    Args:
        request: An accepted request.
        maximum_nodes: Nodes of decision diagrams that are allowed, whatever the request says.
        on_report: Callback that receives reports of the progress.

    Raises:
        NoPropertyError: The texts have no property.
        UnknownEngineError: There is no such engine.
        NodeLimitError: Decision diagrams became too large.
    """
    try:
        if request.supervisor:
            return _verify_given(request, maximum_nodes, on_report)
        return _verify_synthesized(request, maximum_nodes, on_report)
    except UnsupportedModelError as error:
        return pb.VerificationResult(status=pb.VERIFICATION_STATUS_UNSUPPORTED_MODEL, reason=str(error))


def _verify_given(request: pb.VerifyRequest, maximum_nodes: int, on_report: OnReport) -> pb.VerificationResult:
    """Verify the given supervisor; if it is right, verify the given properties of its robot, too."""
    engine = resolve_engine(from_proto.engine_name(request.options))
    try:
        supervisor = decode(request.supervisor)
    except InvalidSupervisorError as error:
        return _result(pb.VERIFICATION_STATUS_FAILED, malformed_json(error), reason=str(error))
    found = verify_supervisor_file(
        supervisor,
        from_proto.bundle(request.bundle),
        Limits.of(request.maximum_states or DEFAULT_STATES),
        deployment=from_proto.deployment(request.options),
        engine=engine,
        on_progress=_on_step(on_report),
    )
    if has_passed(found, is_strict=request.strict) and (request.properties or request.property_files):
        return _verdicts(request, supervisor, maximum_nodes, on_report)
    document = file_verification_json(found, supervisor, is_strict=request.strict)
    status = _OUTCOMES[str(document["status"])]
    return _result(status, document, reason=_no_robot(found), diagnostics=found.diagnostics)


def _no_robot(found: FileVerification) -> str:
    """Return the reason why nothing was verified although there is no finding; empty otherwise."""
    if found.diagnostics or found.report or found.faults:
        return ""
    return "a library has no robot that a supervisor could be for"


def _verify_synthesized(request: pb.VerifyRequest, maximum_nodes: int, on_report: OnReport) -> pb.VerificationResult:
    """Synthesize a supervisor and verify properties of the robot under it."""
    # Errors of properties are reported before the synthesis, which may take long.
    model = check(from_proto.bundle(request.bundle)).model
    errors = None if model is None else _property_errors(request, model)
    if errors is not None:
        return errors
    made = SynthesisAttempt().make(request, maximum_nodes, on_report, allow_livelock=True, only_shown=True)
    if made.supervisor is not None:
        return _verdicts(request, made.supervisor, maximum_nodes, on_report)
    document = {"status": str(made.status), **reasons_json(made), **diagnostics_json(made.diagnostics)}
    return _result(pb.VERIFICATION_STATUS_NO_SUPERVISOR, document, reason=made.reason, diagnostics=made.diagnostics)


def _property_errors(request: pb.VerifyRequest, model: Model) -> pb.VerificationResult | None:
    """Return the errors of the properties, or None."""
    try:
        _properties(request, model)
    except LanguageError as error:
        document = property_errors_json(error.diagnostics)
        return _result(pb.VERIFICATION_STATUS_PROPERTY_ERRORS, document, diagnostics=error.diagnostics)
    return None


def _properties(request: pb.VerifyRequest, model: Model) -> tuple[Property, ...]:
    """Return the properties of a request.

    Raises:
        LanguageError: They have errors.
        NoPropertyError: There is none.
    """
    texts = [SourceFile(f"property {number}", text) for number, text in enumerate(request.properties, start=1)]
    listings = [from_proto.source_file(file) for file in request.property_files]
    properties = properties_of(model, texts, listings)
    if not properties:
        raise NoPropertyError(f"there is no property in {' and '.join(file.name for file in listings)}")
    return properties


def _verdicts(
    request: pb.VerifyRequest, supervisor: Supervisor, maximum_nodes: int, on_report: OnReport
) -> pb.VerificationResult:
    errors = _property_errors(request, supervisor.model)
    if errors is not None:
        return errors
    system = to_automata(supervisor.model, supervisor.deployment)
    verdicts = verify_properties(
        system,
        supervisor.added,
        _properties(request, supervisor.model),
        engine=from_proto.engine(request.options, maximum_nodes),
        on_progress=_on_step(on_report),
    )
    holds = all(verdict.holds for verdict in verdicts)
    status = pb.VERIFICATION_STATUS_PASSED if holds else pb.VERIFICATION_STATUS_FAILED
    return _result(status, verdicts_json(verdicts, system, supervisor.model))


def _on_step(on_report: OnReport) -> Callable[[object], None]:
    return lambda step: on_report(Report("verification", str(step)))


def _result(
    status: Any, document: Mapping[str, object], *, reason: str = "", diagnostics: tuple[Any, ...] = ()
) -> pb.VerificationResult:
    return pb.VerificationResult(
        status=status, report=json_text(document), reason=reason, diagnostics=to_proto.findings(diagnostics)
    )
