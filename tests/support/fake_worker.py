"""A worker of the server whose jobs do what the main file's text says, for tests of everything around the work.

Run as a program in the place of `robosc_server.worker`.
"""

import os
from collections.abc import Callable
from pathlib import Path

from robosc_server.work import (
    CheckJob,
    CheckOutcome,
    GenerateJob,
    GenerateOutcome,
    Job,
    Outcome,
    Refused,
    Report,
    SynthesizeOutcome,
    run_job,
)
from robosc_server.worker import serve


def run(job: Job, on_report: Callable[[Report], None]) -> Outcome:
    """Behave well or badly."""
    bundle = job.synthesis.bundle if isinstance(job, GenerateJob) else job.bundle
    if bundle.main.text.startswith("stuck, see "):
        Path(bundle.main.text.removeprefix("stuck, see ")).write_text(f"{os.getpid()}\n")
        pow(7, 7**12)
    match bundle.main.text:
        case "stuck":
            on_report(Report("pid", str(os.getpid())))
            # One operation in C that keeps the interpreter to itself for hours, as a large diagram would.
            pow(7, 7**12)
        case "die":
            os._exit(7)
        case "noise":
            os.write(1, b"a library that prints\n")
        case "refuse":
            return Refused("there is no such thing")
        case "fault":
            return run_job(None, on_report)  # type: ignore[arg-type]  # a bug, on purpose
        case "mismatch":
            return GenerateOutcome("empty", ())
        case "reports":
            for number in range(100):
                on_report(Report("synthesis", f"step {number}"))
    if isinstance(job, CheckJob):
        return CheckOutcome(())
    return (GenerateOutcome if isinstance(job, GenerateJob) else SynthesizeOutcome)("empty", (), "because")


if __name__ == "__main__":
    serve(run)
