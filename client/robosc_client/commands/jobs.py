"""`submit`, `watch`, `get`, `cancel` and `list`: jobs, which go on without their caller."""

import argparse
import sys
from datetime import datetime
from pathlib import Path
from typing import Any

from robosc.cli.arguments import add_engine_options, add_model_arguments, read_bundle
from robosc.cli.output import CommandError, ExitCode, UsageError, print_diagnostics, print_json, write_bytes
from robosc.cli.properties import add_arguments as add_property_arguments
from robosc.cli.sign import read_supervisor
from robosc.exploration import DEFAULT_LIMIT
from robosc.json_documents import diagnostics_json, json_text
from robosc.model.structure import Deployment
from robosc.source import visible
from robosc.targets import ControllerConfigError, GenerateOptions, read_controller_config, write_files
from robosc_client import (
    Check,
    Client,
    ClientError,
    Exploration,
    Explore,
    Format,
    Formatted,
    Generate,
    Generation,
    Job,
    JobState,
    Synthesis,
    Synthesize,
    Task,
    TaskKind,
    TaskResult,
    Verification,
)
from robosc_client.commands.connection import add_connection_arguments, seconds
from robosc_client.commands.shown import Shown
from robosc_client.commands.tasks import (
    add_synthesis_arguments,
    require_signature,
    synthesis_options,
    verify_task,
    write_signature,
)

_SUBMIT = """\
Have a server do something without waiting for it: the job's id is printed, and the job goes on whatever becomes of this
computer or of the server. 'watch' tells how it gets on, 'get' what it has found.
"""

_GET = """\
Tell where a job is; with -o or --result, what it has found: -o writes a supervisor (with its signature beside it), a
graph, a report or a text to a file, or generated files to a folder.
"""


def add_parsers(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the commands."""
    submit = commands.add_parser("submit", help="have something done as a job, without waiting", description=_SUBMIT)
    _add_tasks(submit)

    watch = commands.add_parser("watch", help="tell how a job gets on, until it has ended")
    watch.set_defaults(run=_watch)
    get = commands.add_parser("get", help="tell where a job is, or what it has found", description=_GET)
    get.add_argument("-o", "--output", type=Path, metavar="PATH", help="write what it has found")
    get.add_argument("--result", action="store_true", help="print what it has found, not only where it is")
    get.add_argument("--force", action="store_true", help="overwrite generated files even where you changed them")
    get.add_argument(
        "--signed-by",
        action="append",
        default=[],
        type=Path,
        metavar="FILE.pub",
        help="the server must have signed the supervisor by a key of this file (may be repeated)",
    )
    get.add_argument(
        "--deployment",
        choices=[str(deployment) for deployment in Deployment],
        help="refuse a supervisor made for another deployment (default: any)",
    )
    get.set_defaults(run=_get)
    cancel = commands.add_parser("cancel", help="end a job")
    cancel.set_defaults(run=_cancel)
    for parser in (watch, get, cancel):
        parser.add_argument("job", metavar="JOB", help="the job's id")

    listing = commands.add_parser("list", help="list jobs, the youngest first")
    listing.add_argument(
        "--state",
        action="append",
        default=[],
        type=JobState,
        choices=list(JobState),
        help="only such (may be repeated)",
    )
    listing.add_argument("--kind", type=TaskKind, choices=list(TaskKind), help="only jobs that do this")
    listing.add_argument("--all", action="store_true", help="those of all owners (for a token with the scope admin)")
    listing.add_argument("--most", type=_number, default=100, metavar="N", help="at most N (default: %(default)s)")
    listing.set_defaults(run=_list)
    for parser in (watch, get, cancel, listing):
        parser.add_argument("--json", action="store_true", help="print one JSON document for machines")
        add_connection_arguments(parser)


def _number(text: str) -> int:
    value = int(text)
    if not 0 < value <= 1_000_000:
        raise ValueError
    return value


_number.__name__ = "number"


def _add_tasks(submit: argparse.ArgumentParser) -> None:
    tasks = submit.add_subparsers(title="what to do", dest="task", required=True, metavar="TASK")
    for name, what in (
        ("check", "find everything that is wrong with a model"),
        ("synth", "synthesize a supervisor"),
        ("generate", "generate a package that runs the supervisor"),
        ("explore", "list the controlled system's states and transitions"),
        ("verify", "check a supervisor file, or verify properties"),
        ("format", "put a text into its canonical layout"),
    ):
        parser = tasks.add_parser(name, help=what)
        if name == "verify":
            _add_verify_arguments(parser)
        add_model_arguments(parser)
        if name in ("synth", "generate", "explore"):
            add_synthesis_arguments(parser)
        if name == "generate":
            parser.add_argument("--target", required=True, metavar="NAME", help="what to generate: see 'targets'")
            parser.add_argument("--package", metavar="NAME", help="name of the generated package")
        if name == "explore":
            parser.add_argument(
                "--limit", type=_number, default=DEFAULT_LIMIT, metavar="N", help="give up beyond N states"
            )
        parser.add_argument("--label", default="", metavar="TEXT", help="what lists call the job")
        parser.add_argument(
            "--idempotency-key", metavar="TEXT", help="the same key again gives the same job (default: a new one)"
        )
        parser.add_argument(
            "--keep", type=seconds, metavar="SECONDS", help="keep the job so long after its end (default: the server's)"
        )
        parser.add_argument(
            "--watch", action="store_true", help="print the id, and wait until it has ended, as 'watch' does"
        )
        parser.set_defaults(run=_submit)
        add_connection_arguments(parser)


def _add_verify_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("supervisor", nargs="?", type=Path, metavar="FILE.rsup", help="the supervisor to check")
    add_property_arguments(parser)
    parser.add_argument(
        "--deployment",
        choices=[str(deployment) for deployment in Deployment],
        help="refuse a supervisor made for another deployment (default: as the file says; without a file: controller)",
    )
    parser.add_argument(
        "--limit", type=_number, metavar="N", help="verify up to N states one by one (default: the server's)"
    )
    parser.add_argument("--strict", action="store_true", help="permissiveness must have been checked, too")
    add_engine_options(parser)


def _generation(arguments: argparse.Namespace) -> GenerateOptions:
    """What is asked of the target: by the arguments, and by the file beside the model."""
    try:
        return read_controller_config(arguments.model.parent).options(arguments.package)
    except ControllerConfigError as error:
        raise UsageError(str(error)) from error


def _task(arguments: argparse.Namespace) -> Task:
    """What is to be done."""
    bundle = read_bundle(arguments)
    match arguments.task:
        case "check":
            return Check(bundle)
        case "synth":
            return Synthesize(bundle, synthesis_options(arguments))
        case "generate":
            return Generate(bundle, arguments.target, _generation(arguments), synthesis_options(arguments))
        case "explore":
            return Explore(bundle, synthesis_options(arguments), arguments.limit)
        case "verify":
            supervisor = b"" if arguments.supervisor is None else read_supervisor(arguments.supervisor)
            if not supervisor and not (arguments.property or arguments.properties):
                raise UsageError("verify needs a supervisor file, or properties (--property PROPERTY)")
            return verify_task(arguments, bundle, supervisor)
        case _:
            return Format(bundle.main)


def _submit(arguments: argparse.Namespace, client: Client) -> int:
    found = client.submit(
        _task(arguments),
        label=arguments.label,
        idempotency_key=arguments.idempotency_key,
        retention_s=arguments.keep,
        deadline_s=arguments.deadline,
    )
    if arguments.watch:
        # Whoever gives up waiting, or is cut off, knows how to ask for the job; the one JSON document comes at the end.
        stream, told = (sys.stderr, f"submitted as {found.job.id}") if arguments.json else (sys.stdout, found.job.id)
        stream.write(f"{told}\n")
        stream.flush()
        arguments.job = found.job.id
        try:
            return _watch(arguments, client)
        except ClientError as error:
            raise CommandError(f"job {found.job.id} was submitted, but: {error}", ExitCode.SERVICE) from error
    if arguments.json:
        print_json({"job": job_json(found.job), "existed": found.existed})
    else:
        sys.stdout.write(f"{found.job.id}\n")
    return ExitCode.OK


def _watch(arguments: argparse.Namespace, client: Client) -> int:
    seen: Job | None = None
    with Shown() as shown:
        for job in client.watch(arguments.job, deadline_s=arguments.deadline):
            shown.show(_line(job))
            if not arguments.json and (seen is None or job.state is not seen.state):
                shown.write(_line(job))
            seen = job
    if arguments.json and seen is not None:
        print_json({"job": job_json(seen)})
    return ExitCode.OK if seen is not None and seen.state is JobState.SUCCEEDED else ExitCode.FAILED


def _get(arguments: argparse.Namespace, client: Client) -> int:
    wants_result = arguments.result or arguments.output is not None
    if (arguments.signed_by or arguments.deployment) and not wants_result:
        raise UsageError("--signed-by and --deployment are about what a job has found: they need -o or --result")
    job = client.get_job(arguments.job, deadline_s=arguments.deadline)
    if not wants_result:
        return _report(arguments, job)
    found = client.job_result(arguments.job, kind=job.kind, deadline_s=arguments.deadline)
    _require_sound(arguments, found)
    if arguments.output is not None:
        _write(arguments, found)
    if arguments.json:
        print_json({"job": job_json(job), "result": result_json(found) if arguments.result else None})
    elif arguments.result:
        _print(found)
    return ExitCode.OK if _is_good(found) else ExitCode.FAILED


def _require_sound(arguments: argparse.Namespace, found: TaskResult) -> None:
    """Do nothing if a supervisor that was found is one, and is as the arguments want it.

    Raises:
        CommandError: No key of the arguments has signed it, or it is no supervisor where one is wanted.
        ServiceError: The supervisor is no valid one, or for another deployment.
    """
    from robosc_client.made import decoded, require_deployment

    supervisor = decoded(found.supervisor) if isinstance(found, Synthesis) and found.supervisor else None
    if supervisor is None or not isinstance(found, Synthesis):
        # Whatever else the server sends, a graph or a report, nobody has signed.
        if arguments.signed_by or arguments.deployment:
            raise CommandError("the job has found no supervisor, and one is asked for", ExitCode.SERVICE)
        return
    if arguments.deployment:
        require_deployment(supervisor, Deployment(arguments.deployment))
    if arguments.signed_by:
        require_signature(arguments, found.supervisor, found.signature)


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
    """A job in one line."""
    what = ""
    if job.failure is not None:
        what = f"{job.failure.message} [{job.failure.reason}]"
    elif job.state is JobState.QUEUED and job.waiting_before:
        what = f"{job.waiting_before} before it"
    elif job.state is JobState.RUNNING and job.progress is not None:
        what = f"{job.progress.stage}: {job.progress.message}"
    parts = [job.id, f"{job.state:9}", f"{job.kind:10}", job.main_file, job.label, what]
    return "  ".join(part for part in parts if part)


def job_json(job: Job) -> dict[str, Any]:
    """A job as JSON values; times in ISO 8601."""

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


def result_json(found: TaskResult) -> dict[str, Any]:
    """What a job has found, as JSON values; what is no text is left to -o."""
    import msgspec

    match found:
        case tuple():
            return diagnostics_json(found)
        case Verification():
            return dict(found.report) or {"status": str(found.status), "reason": found.reason}
        case Formatted():
            return {"text": found.text, **diagnostics_json(found.diagnostics)}
    result = {"status": str(found.status), "reason": found.reason, **diagnostics_json(found.diagnostics)}
    match found:
        case Synthesis():
            result["summary"] = found.summary and found.summary.text
        case Generation():
            result["files"] = list(found.files or ())
        case Exploration():
            result["graph"] = found.graph and msgspec.to_builtins(found.graph)
    return result


def _print(found: TaskResult) -> None:
    if isinstance(found, Formatted) and found.text is not None:
        # To a file or program byte for byte; on a terminal, no text of a server moves the cursor.
        sys.stdout.write(_harmless(found.text) if sys.stdout.isatty() else found.text)
        return
    if isinstance(found, tuple):
        print_diagnostics(found, None)
        return
    if isinstance(found, Synthesis | Generation | Exploration) and not _is_good(found):
        print_diagnostics(found.diagnostics, None)
    print_json(result_json(found))


def _harmless(text: str) -> str:
    """The lines of a text as a terminal may show them."""
    return "\n".join("\t".join(map(visible, line.split("\t"))) for line in text.split("\n"))


def _is_good(found: TaskResult) -> bool:
    match found:
        case tuple():
            return not any(item.severity == "error" for item in found)
        case Verification():
            return found.status == "passed"
        case Formatted():
            return found.text is not None
    return found.status == "supervisor"


def _write(arguments: argparse.Namespace, found: TaskResult) -> None:
    """Write what a job has found.

    Raises:
        UsageError: There is nothing to write, or it cannot be written.
    """
    import msgspec

    match found:
        case Synthesis() if found.supervisor:
            write_signature(arguments.output, found.signature)
            write_bytes(arguments.output, found.supervisor)
        case Generation() if found.files is not None:
            write_files(found.files, arguments.output, arguments.force)
        case Exploration() if found.graph is not None:
            write_bytes(arguments.output, json_text(msgspec.to_builtins(found.graph)).encode("utf-8"))
        case Verification() if found.report:
            write_bytes(arguments.output, json_text(found.report).encode("utf-8"))
        case Formatted() if found.text is not None:
            write_bytes(arguments.output, found.text.encode("utf-8"))
        case _:
            raise UsageError(f"the job has found nothing that could be written to {arguments.output}: see --result")
