"""Explanation of what synthesis does to a model, in a worker: by the function of the Python API, for any language."""

from typing import Any

from robosc.certification import Progress
from robosc.explanation import RequestError
from robosc.pipeline.explaining import explain
from robosc.pipeline.results import SynthesisStatus
from robosc_api.v1 import synthesis_pb2 as pb
from robosc_server.tasks.convert import from_proto, to_proto
from robosc_server.tasks.synthesis_attempt import OnReport
from robosc_server.tasks.task import Report

_STATUSES: dict[SynthesisStatus, Any] = {
    SynthesisStatus.SUPERVISOR: pb.EXPLANATION_STATUS_SUPERVISOR,
    SynthesisStatus.EMPTY: pb.EXPLANATION_STATUS_EMPTY,
    SynthesisStatus.MODEL_ERRORS: pb.EXPLANATION_STATUS_MODEL_ERRORS,
    SynthesisStatus.UNSUPPORTED_MODEL: pb.EXPLANATION_STATUS_UNSUPPORTED_MODEL,
}


def explanation(request: pb.ExplainRequest, maximum_nodes: int, on_report: OnReport) -> pb.ExplanationResult:
    """Return the result of a request for an explanation.

    Args:
        request: An accepted request.
        maximum_nodes: Nodes of decision diagrams that are allowed, whatever the request says.
        on_report: Callback that receives reports of the progress.

    Raises:
        UnknownEngineError: There is no such engine.
        NodeLimitError: Decision diagrams became too large.
    """

    def report(progress: Progress) -> None:
        on_report(Report(progress.stage, progress.message))

    try:
        found = explain(
            from_proto.bundle(request.bundle),
            from_proto.synthesis_options(request.options, maximum_nodes),
            event=request.event if request.HasField("event") else None,
            state=request.state if request.HasField("state") else None,
            after=request.after if request.HasField("after") else None,
            is_modular=request.modular,
            on_progress=report,
        )
    except RequestError as error:
        # A result rather than a failure: its sentence names parts of the model, which are for the caller alone.
        return pb.ExplanationResult(status=pb.EXPLANATION_STATUS_NOT_THERE, reason=str(error))
    return pb.ExplanationResult(
        status=_STATUSES[found.status],
        diagnostics=to_proto.findings(found.diagnostics),
        reason=found.reason,
        **to_proto.reasons(found.explanation),
    )
