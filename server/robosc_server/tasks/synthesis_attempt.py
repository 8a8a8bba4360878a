"""Attempt of a synthesis, and the fields of its result for every outcome."""

from collections.abc import Callable
from types import TracebackType
from typing import Any, Protocol, Self

from robosc.certification import OutcomeStatus, SynthesisOutcome, make_supervisor
from robosc.errors import UnsupportedModelError
from robosc.model.structure import Deployment
from robosc.targets import TargetRefusal
from robosc_api.v1 import synthesis_pb2 as pb
from robosc_server.tasks.convert import from_proto, to_proto
from robosc_server.tasks.task import Report

OnReport = Callable[[Report], None]


class Request(Protocol):
    """A request for something that needs a supervisor."""

    @property
    def bundle(self) -> pb.Bundle:
        """The model and its libraries."""

    @property
    def options(self) -> pb.SynthesisOptions:
        """Options for making the supervisor."""


class SynthesisAttempt:
    """Context of a synthesis, which keeps the error of a model that is not supported.

    Attributes:
        made: Result of making the supervisor; None: the attempt ended before.
        refusal: Refusal by the requested target, or None.
        error: Error that says why the model cannot be handled, or None.
    """

    def __init__(self) -> None:
        self.made: SynthesisOutcome | None = None
        self.refusal: TargetRefusal | None = None
        self.error: UnsupportedModelError | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> bool:
        if isinstance(error, UnsupportedModelError):
            self.error = error
            return True
        return False

    def make(
        self,
        request: Request,
        maximum_nodes: int,
        on_report: OnReport,
        *,
        allow_livelock: bool,
        only_shown: bool = False,
        is_modular: bool = False,
    ) -> SynthesisOutcome:
        """Make the supervisor of a request."""
        options = request.options
        self.made = make_supervisor(
            from_proto.bundle(request.bundle),
            deployment=from_proto.deployment(options) or Deployment.CONTROLLER,
            engine=from_proto.engine(options, maximum_nodes),
            verify_limit=from_proto.verified_states(options),
            allow_livelock=allow_livelock,
            only_shown=only_shown,
            is_modular=is_modular,
            on_progress=lambda step: on_report(Report(step.stage, step.message)),
        )
        return self.made

    def result_fields(self) -> dict[str, Any]:
        """Return the fields that every result has: `status`, `diagnostics`, `reason`, and an explanation if any."""
        made, error = self.made, self.error
        diagnostics = self.refusal.diagnostics if self.refusal else made.diagnostics if made else ()
        if error is not None or made is None:
            status, reason = pb.SYNTHESIS_STATUS_UNSUPPORTED_MODEL, str(error)
            return {"status": status, "diagnostics": to_proto.findings(diagnostics), "reason": reason}
        return {
            "status": to_proto.STATUSES[OutcomeStatus.MODEL_ERRORS if self.refusal else made.status],
            "diagnostics": to_proto.findings(diagnostics),
            "reason": made.reason,
            **to_proto.reasons(made.explanation),
        }
