"""Responses of ListTargets and GetVersion, which stay the same while the server runs.

Making them is slow, since it imports targets and searches engines: make them once, before serving.
"""

from robosc._version import __version__
from robosc_api.v1 import synthesis_pb2 as pb
from robosc_server.tasks.requests import RequestLimits
from robosc_server.tasks.task import TaskLimits


def server_limits(
    request: RequestLimits,
    task: TaskLimits,
    *,
    waiting_tasks: int,
    waiting_tasks_per_caller: int,
    retention_seconds: float,
) -> pb.ServerLimits:
    """Return the limits of a server's requests, tasks and results.

    Args:
        request: Limits of a request.
        task: Limits of a task.
        waiting_tasks: Tasks that may wait, of all callers together.
        waiting_tasks_per_caller: Tasks of one caller that may wait.
        retention_seconds: Time that a job is kept after it has ended, in seconds.
    """
    return pb.ServerLimits(
        bundle_bytes=request.bundle_bytes,
        bundle_files=request.bundle_files,
        task_seconds=task.seconds,
        task_cpu_seconds=task.cpu_seconds,
        task_memory_bytes=task.memory_bytes,
        task_nodes=task.nodes,
        result_bytes=task.result_bytes,
        waiting_tasks=waiting_tasks,
        waiting_tasks_per_caller=waiting_tasks_per_caller,
        retention_seconds=retention_seconds,
    )


def version_response(limits: pb.ServerLimits) -> pb.GetVersionResponse:
    """Return the description of this server."""
    from robosc.synthesis.engines import installed_engines

    return pb.GetVersionResponse(version=__version__, engines=installed_engines(), limits=limits)


def targets_response() -> pb.ListTargetsResponse:
    """Return the targets that can be generated, the name that stands for all targets included."""
    from robosc.targets import ALL, available_targets

    descriptions = {info.name: info.description for info in available_targets()}
    descriptions[ALL] = "all targets, each in its own folder"
    return pb.ListTargetsResponse(
        targets=[pb.Target(name=name, description=descriptions[name]) for name in sorted(descriptions)]
    )
