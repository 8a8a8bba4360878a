"""Typed client of the RoboSC service, for threads (`Client`) and for asyncio (`AsyncClient`).

The names are imported on first use: the command must handle Ctrl-C before gRPC is loaded.
"""

from typing import TYPE_CHECKING

from robosc.named_on_use import named_on_use

if TYPE_CHECKING:
    from robosc_client.aio import AsyncClient
    from robosc_client.client import Client
    from robosc_client.errors import (
        ClientError,
        CredentialsError,
        DeadlineError,
        JobError,
        NotThereError,
        RequestRefusedError,
        ServerBusyError,
        ServerUnavailableError,
        ServiceError,
    )
    from robosc_client.jobs import CallerLoad, Job, JobFailure, JobState, ServiceLoad, Submission, TaskKind
    from robosc_client.results import (
        Explained,
        Exploration,
        Formatted,
        Generation,
        GoalSummary,
        Progress,
        ServerInfo,
        ServerLimits,
        StateGraph,
        StateValues,
        Statistics,
        Summary,
        Synthesis,
        SynthesisStatus,
        TaskResult,
        Verification,
        VerificationStatus,
    )
    from robosc_client.retry import NO_RETRIES, RetryPolicy
    from robosc_client.tasks import (
        Check,
        Explain,
        Explore,
        Format,
        Generate,
        SynthesisOptions,
        Synthesize,
        Task,
        Verify,
    )

_HOMES = {
    "AsyncClient": "aio",
    "CallerLoad": "jobs",
    "Check": "tasks",
    "Client": "client",
    "ClientError": "errors",
    "CredentialsError": "errors",
    "DeadlineError": "errors",
    "Explain": "tasks",
    "Explained": "results",
    "Exploration": "results",
    "Explore": "tasks",
    "Format": "tasks",
    "Formatted": "results",
    "Generate": "tasks",
    "Generation": "results",
    "GoalSummary": "results",
    "Job": "jobs",
    "JobError": "errors",
    "JobFailure": "jobs",
    "JobState": "jobs",
    "NO_RETRIES": "retry",
    "NotThereError": "errors",
    "Progress": "results",
    "RequestRefusedError": "errors",
    "RetryPolicy": "retry",
    "ServerBusyError": "errors",
    "ServerInfo": "results",
    "ServerLimits": "results",
    "ServerUnavailableError": "errors",
    "ServiceError": "errors",
    "ServiceLoad": "jobs",
    "StateGraph": "results",
    "StateValues": "results",
    "Statistics": "results",
    "Submission": "jobs",
    "Summary": "results",
    "Synthesis": "results",
    "SynthesisOptions": "tasks",
    "SynthesisStatus": "results",
    "Synthesize": "tasks",
    "Task": "tasks",
    "TaskKind": "jobs",
    "TaskResult": "results",
    "Verification": "results",
    "VerificationStatus": "results",
    "Verify": "tasks",
}

__all__ = [
    "NO_RETRIES",
    "AsyncClient",
    "CallerLoad",
    "Check",
    "Client",
    "ClientError",
    "CredentialsError",
    "DeadlineError",
    "Explain",
    "Explained",
    "Exploration",
    "Explore",
    "Format",
    "Formatted",
    "Generate",
    "Generation",
    "GoalSummary",
    "Job",
    "JobError",
    "JobFailure",
    "JobState",
    "NotThereError",
    "Progress",
    "RequestRefusedError",
    "RetryPolicy",
    "ServerBusyError",
    "ServerInfo",
    "ServerLimits",
    "ServerUnavailableError",
    "ServiceError",
    "ServiceLoad",
    "StateGraph",
    "StateValues",
    "Statistics",
    "Submission",
    "Summary",
    "Synthesis",
    "SynthesisOptions",
    "SynthesisStatus",
    "Synthesize",
    "Task",
    "TaskKind",
    "TaskResult",
    "Verification",
    "VerificationStatus",
    "Verify",
]


if not TYPE_CHECKING:
    # A type checker knows the names from above, and is to find every other one wrong.
    __getattr__ = named_on_use(__name__, _HOMES)
