"""The commands `watch`, `get`, `cancel` and `list` for jobs."""

import argparse
import sys
from collections.abc import Callable, Mapping
from datetime import datetime
from enum import StrEnum
from pathlib import Path
from typing import Any

from robosc.cli.arguments import given_path, suggest
from robosc.cli.output import ExitCode, UsageError, print_json
from robosc.model.structure import Deployment
from robosc.pipeline.automata_files import is_automata
from robosc_client import Client, Job, JobState, Synthesis, TaskKind
from robosc_client.commands.connection import SIGNED_SERVICE, add_connection_arguments, exit_statuses, number_up_to
from robosc_client.commands.job_results import (
    is_success,
    print_result,
    report_nothing,
    require_sound,
    result_json,
    sound_automata,
    write_result,
)
from robosc_client.commands.progress_line import ProgressLine
from robosc_client.commands.signature_checks import trusted_keys
from robosc_client.commands.tasks import add_signed_by_argument

_GET = """\
Print the state of a job. With --result, print its result; with -o, write it: a supervisor (with its signature in a
second file), a graph, a report, an explanation or a text to a file, or generated files to a folder.
"""

_EPILOG = exit_statuses("done")


_WATCH_EPILOG = exit_statuses(
    "the job has succeeded, even if its result is that the model has errors",
    "the job has failed or was cancelled",
)

_GET_EPILOG = exit_statuses(
    "the state was printed, also of a failed job; with --result or -o: done, and the model has no errors",
    "with --result or -o: the job has failed or was cancelled; the model has errors, no supervisor exists, a\n"
    "     checked supervisor is wrong, or a property does not hold",
    SIGNED_SERVICE,
)


def add_parsers(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the commands."""
    watch = commands.add_parser("watch", help="follow a job until it has ended")
    watch.set_defaults(run=watch_job)
    get = commands.add_parser("get", help="print the state or the result of a job", description=_GET)
    get.add_argument("-o", "--output", type=given_path, metavar="PATH", help="write the result to this file or folder")
    get.add_argument("--result", action="store_true", help="print the result, not only the state")
    get.add_argument("--force", action="store_true", help="overwrite generated files even if you have changed them")
    add_signed_by_argument(get)
    get.add_argument(
        "--deployment",
        choices=[str(deployment) for deployment in Deployment],
        help="refuse a supervisor made for another deployment (default: any)",
    )
    get.set_defaults(run=_get)
    cancel = commands.add_parser("cancel", help="cancel a job")
    cancel.set_defaults(run=_cancel)
    for parser in (watch, get, cancel):
        parser.add_argument("job", metavar="JOB", help="the job's id")

    listing = commands.add_parser("list", help="list jobs, newest first")
    state = listing.add_argument(
        "--state",
        action="append",
        default=[],
        type=_one_of(JobState, {}),
        metavar="STATE",
        help=f"list only jobs in this state: {', '.join(JobState)} (may be repeated)",
    )
    suggest(state, lambda: JobState)
    kind = listing.add_argument(
        "--kind",
        type=_one_of(TaskKind, {"synth": TaskKind.SYNTHESIZE, "explain-synthesis": TaskKind.EXPLAIN}),
        metavar="KIND",
        help=f"list only jobs of this kind: {', '.join(TaskKind)} (or synth, explain-synthesis)",
    )
    suggest(kind, lambda: TaskKind)
    listing.add_argument(
        "--all", action="store_true", help="list the jobs of all owners (needs a token with the scope admin)"
    )
    listing.add_argument(
        "--most",
        type=number_up_to(1_000_000),
        default=100,
        metavar="N",
        help="list at most N jobs (default: %(default)s)",
    )
    listing.set_defaults(run=_list)
    for parser, epilog in ((watch, _WATCH_EPILOG), (get, _GET_EPILOG), (cancel, _EPILOG), (listing, _EPILOG)):
        parser.add_argument("--json", action="store_true", help="print one JSON document for machines")
        add_connection_arguments(parser, epilog=epilog)


def _one_of[Choice: StrEnum](choices: type[Choice], shorter: Mapping[str, Choice]) -> Callable[[str], Choice]:
    """Return a function that reads one of some values by its name or a shorter one, for a parser."""
    names = {**{str(choice): choice for choice in choices}, **shorter}

    def read(text: str) -> Choice:
        if text not in names:
            raise argparse.ArgumentTypeError(f"{text!r} is not one of {', '.join(names)}")
        return names[text]

    return read


def watch_job(arguments: argparse.Namespace, client: Client) -> int:
    """Follow the job of the arguments until it has ended; returns the exit status."""
    seen: Job | None = None
    with ProgressLine() as line:
        for job in client.watch(arguments.job, deadline_s=arguments.deadline):
            line.show(_line(job), job.progress.stage if job.progress is not None else "")
            if not arguments.json and (seen is None or job.state is not seen.state):
                line.write(_line(job))
            seen = job
    if arguments.json and seen is not None:
        print_json({"job": job_json(seen)})
    return ExitCode.OK if seen is not None and seen.state is JobState.SUCCEEDED else ExitCode.FAILED


def _get(arguments: argparse.Namespace, client: Client) -> int:
    wants_result = arguments.result or arguments.output is not None
    if (arguments.signed_by or arguments.deployment) and not wants_result:
        raise UsageError("--signed-by and --deployment apply to the result of a job: add -o or --result")
    keys = trusted_keys(arguments)
    job = client.get_job(arguments.job, deadline_s=arguments.deadline)
    if not wants_result:
        return _report(arguments, job)
    if job.state in (JobState.FAILED, JobState.CANCELLED):
        return _report_no_result(arguments, job)
    found = client.job_result(arguments.job, kind=job.kind, deadline_s=arguments.deadline)
    if isinstance(found, Synthesis) and found.supervisor and is_automata(Path(job.main_file)):
        written = sound_automata(arguments, found, keys)
    else:
        require_sound(arguments, found, keys)
        written = None
    has_nothing = arguments.output is not None and not write_result(arguments, found, written)
    if arguments.json:
        print_json({"job": job_json(job), "result": result_json(found) if arguments.result or has_nothing else None})
    elif arguments.result:
        print_result(job, found)
    elif has_nothing and not isinstance(found, tuple):
        report_nothing(job, found)
    return ExitCode.OK if is_success(found) else ExitCode.FAILED


def _report_no_result(arguments: argparse.Namespace, job: Job) -> int:
    """Report why a job that has ended has no result."""
    why = "was cancelled" if job.failure is None else f"has failed: {job.failure.message} [{job.failure.reason}]"
    sys.stderr.write(f"robosc-client: job {job.id} {why}\n")
    if arguments.json:
        print_json({"job": job_json(job), "result": None})
    return ExitCode.FAILED


def _cancel(arguments: argparse.Namespace, client: Client) -> int:
    return _report(arguments, client.cancel_job(arguments.job, deadline_s=arguments.deadline))


def _list(arguments: argparse.Namespace, client: Client) -> int:
    found = client.list_jobs(
        states=tuple(arguments.state),
        kind=arguments.kind,
        all_owners=arguments.all,
        page_size=min(arguments.most, 100),
        deadline_s=arguments.deadline,
    )
    jobs = [job for _, job in zip(range(arguments.most), found, strict=False)]
    if arguments.json:
        print_json({"jobs": [job_json(job) for job in jobs]})
    else:
        for job in jobs:
            sys.stdout.write(f"{_line(job)}\n")
    return ExitCode.OK


def _report(arguments: argparse.Namespace, job: Job) -> int:
    if arguments.json:
        print_json({"job": job_json(job)})
    else:
        sys.stdout.write(f"{_line(job)}\n")
    return ExitCode.OK


def _line(job: Job) -> str:
    """Return a job in one line."""
    what = ""
    if job.failure is not None:
        what = f"{job.failure.message} [{job.failure.reason}]"
    elif job.state is JobState.QUEUED and job.waiting_before:
        what = f"{job.waiting_before} before it"
    elif not job.state.has_ended and job.progress is not None:
        what = f"{job.progress.stage}: {job.progress.message}"
    parts = [job.id, f"{job.state:9}", f"{job.kind:10}", job.main_file, job.label, what]
    return "  ".join(part for part in parts if part)


def job_json(job: Job) -> dict[str, Any]:
    """Return a job as JSON values; times in ISO 8601."""

    def time(moment: datetime | None) -> str | None:
        return None if moment is None else moment.isoformat()

    return {
        "id": job.id,
        "state": str(job.state),
        "kind": str(job.kind),
        "main_file": job.main_file,
        "label": job.label,
        "owner": job.owner,
        "revision": job.revision,
        "created": time(job.created),
        "started": time(job.started),
        "ended": time(job.ended),
        "expires": time(job.expires),
        "attempts": job.attempts,
        "progress": job.progress and {"stage": job.progress.stage, "message": job.progress.message},
        "failure": job.failure and {"reason": job.failure.reason, "message": job.failure.message},
        "from_store": job.from_store,
        "waiting_before": job.waiting_before,
    }
