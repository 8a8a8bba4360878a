"""Failures of tasks that exceed a limit of the server: which limit it is, and what to do about that."""

from robosc_server.tasks.task import Failure, Reason, TaskLimits

MACHINE_OUT_OF_MEMORY = (
    "the machine ran out of memory and killed the task; make the model smaller, try again when the machine has less to "
    "do, or have the operator of the server lower worker_processes"
)


def memory_exceeded(limits: TaskLimits, details: str = "") -> Failure:
    """Return the failure of a task that needs more memory than it may have.

    Args:
        limits: Limits of the task.
        details: Text for the log of the server.
    """
    needs = f"the task needs more memory than the server allows, {limits.memory_bytes} bytes"
    return Failure(Reason.MEMORY_LIMIT, f"{needs}; {_way_out('task_memory_bytes')}", details)


def cpu_time_exceeded(limits: TaskLimits, details: str = "") -> Failure:
    """Return the failure of a task that needs more CPU time than it may have.

    Args:
        limits: Limits of the task.
        details: Text for the log of the server.
    """
    needs = f"the task needs more CPU time than the server allows, {limits.cpu_seconds:g} s"
    return Failure(Reason.CPU_LIMIT, f"{needs}; {_way_out('task_cpu_seconds')}", details)


def time_exceeded(limits: TaskLimits) -> Failure:
    """Return the failure of a task that takes longer than it may.

    Args:
        limits: Limits of the task.
    """
    takes = f"the task takes longer than the server allows, {limits.seconds:g} s"
    return Failure(Reason.TIME_LIMIT, f"{takes}; {_way_out('task_seconds')}")


def result_too_large(limits: TaskLimits) -> Failure:
    """Return the failure of a task whose result has more bytes, or more messages, than are sent.

    Args:
        limits: Limits of the task.
    """
    exceeds = f"the result exceeds the server's limit of {limits.result_bytes} bytes"
    return Failure(
        Reason.RESULT_TOO_LARGE,
        f"{exceeds}; ask for less, such as one target, or have the operator of the server raise result_bytes",
    )


def _way_out(setting: str) -> str:
    return f"make the model smaller, or have the operator of the server raise {setting}"
