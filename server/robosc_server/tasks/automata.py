"""Work on automata (CIF, libFAUDES, Supremica), in a worker: by the functions of the Python API."""

import hashlib
from typing import Any

from robosc.certification import OutcomeStatus, Progress
from robosc.errors import UnsupportedModelError
from robosc.exploration import Graph
from robosc.json_documents import json_text
from robosc.pipeline.exploring import Exploration, explore
from robosc.pipeline.generating import generate
from robosc.pipeline.loading import LoadedAutomata
from robosc.pipeline.results import Generation, SynthesisStatus, VerificationStatus
from robosc.pipeline.synthesis import synthesize
from robosc.pipeline.systems import SystemSupervisor, SystemSynthesis, system_summary_text
from robosc.pipeline.verifying import verify
from robosc.targets import GeneratedFiles, GenerateOptions
from robosc_api.v1 import synthesis_pb2 as pb
from robosc_server.tasks.convert import from_proto, to_proto
from robosc_server.tasks.synthesis_attempt import OnReport
from robosc_server.tasks.task import Report

_VERDICTS = {
    VerificationStatus.PASSED: pb.VERIFICATION_STATUS_PASSED,
    VerificationStatus.FAILED: pb.VERIFICATION_STATUS_FAILED,
    VerificationStatus.NOT_CHECKED: pb.VERIFICATION_STATUS_NOT_CHECKED,
    VerificationStatus.NO_SUPERVISOR: pb.VERIFICATION_STATUS_NO_SUPERVISOR,
    VerificationStatus.UNSUPPORTED_MODEL: pb.VERIFICATION_STATUS_UNSUPPORTED_MODEL,
}


class Automata:
    """Automata of a request, and the results of commands for them.

    Args:
        model: The automata.
        options: Options for making the supervisor.
        maximum_nodes: Nodes of decision diagrams that are allowed, whatever the options say.
        on_report: Callback that receives reports of the progress.
    """

    def __init__(
        self, model: LoadedAutomata, options: pb.SynthesisOptions, maximum_nodes: int, on_report: OnReport
    ) -> None:
        self._model = model
        self._options = from_proto.synthesis_options(options, maximum_nodes)
        self._on_report = on_report

    def synthesis(self, *, is_modular: bool) -> pb.SynthesisResult:
        """Return the supervisor, with all that is reported about it."""
        made = synthesize(self._model, self._options, is_modular=is_modular, on_progress=self._report)
        result = pb.SynthesisResult(**_result_fields(made))
        if made.statistics is not None:
            result.statistics.CopyFrom(to_proto.statistics(made.statistics))
        if made.supervisor is not None:
            try:
                content = made.supervisor.encode()
            except UnsupportedModelError as error:
                # The supervisor is more than a file can hold.
                result.status, result.reason = pb.SYNTHESIS_STATUS_UNSUPPORTED_MODEL, str(error)
                return result
            result.supervisor, result.supervisor_digest = content, hashlib.sha256(content).digest()
            result.summary.CopyFrom(_summary(made.supervisor))
        return result

    def generation(
        self, target: str, choices: GenerateOptions, initial: str | None, *, is_modular: bool
    ) -> tuple[GeneratedFiles | None, dict[str, Any]]:
        """Return the files of a target, or None, and the fields of the result.

        Raises:
            RequestError: `initial` names a part that does not exist.
            UnknownTargetError: There is no such target.
        """
        made = generate(
            self._model,
            target,
            choices,
            self._options,
            initial=initial,
            is_modular=is_modular,
            on_progress=self._report,
        )
        return made.files, _result_fields(made)

    def exploration(self, maximum_states: int) -> tuple[Graph | None, dict[str, Any]]:
        """Return the graph of the controlled system, or None, and the fields of the result."""
        made = explore(self._model, self._options, maximum_states=maximum_states, on_progress=self._report)
        return made.graph, _result_fields(made)

    def verification(
        self, maximum_states: int, *, is_strict: bool, controller: bool, as_is: bool
    ) -> pb.VerificationResult:
        """Return the report about a supervisor that is made, or about automata as they stand."""
        found = verify(
            self._model,
            options=self._options,
            maximum_states=maximum_states,
            is_strict=is_strict,
            controller=controller,
            as_is=as_is,
            on_progress=self._report,
        )
        return pb.VerificationResult(
            status=_VERDICTS[found.status],
            diagnostics=to_proto.findings(found.diagnostics),
            reason=found.reason,
            report=json_text(found.report) if found.report else "",
        )

    def _report(self, progress: Progress) -> None:
        self._on_report(Report(progress.stage, progress.message))


def _result_fields(made: SystemSynthesis | Generation | Exploration) -> dict[str, Any]:
    is_supported = made.status is not SynthesisStatus.UNSUPPORTED_MODEL
    return {
        "status": to_proto.STATUSES[OutcomeStatus(str(made.status))]
        if is_supported
        else pb.SYNTHESIS_STATUS_UNSUPPORTED_MODEL,
        "diagnostics": to_proto.findings(made.diagnostics),
        "reason": made.reason,
        **to_proto.reasons(made.explanation),
    }


def _summary(supervisor: SystemSupervisor) -> pb.Summary:
    controllable = sum(event.is_controllable for event in supervisor.system.events)
    return pb.Summary(
        controllable_events=controllable,
        uncontrollable_events=len(supervisor.system.events) - controllable,
        states=str(supervisor.states),
        added=[
            pb.AddedCondition(event=event, condition=str(condition))
            for event, condition in supervisor.conditions.items()
        ],
        text=system_summary_text(supervisor),
    )
