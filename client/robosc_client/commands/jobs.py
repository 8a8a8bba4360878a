"""The commands `submit`, `watch`, `get`, `cancel` and `list` for jobs."""

import argparse
import sys
from collections.abc import Callable, Collection, Mapping
from dataclasses import asdict
from datetime import datetime
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robosc.certification.goals import GoalExplanation
from robosc.certification.reasons import reasons_json
from robosc.cli import automata
from robosc.cli.arguments import (
    MAXIMUM_LIMIT,
    SYNTHESIS_STATES,
    add_engine_options,
    add_model_arguments,
    add_verify_limit_argument,
    given_path,
    read_bundle,
    suggest,
)
from robosc.cli.explain_synthesis import add_question_arguments
from robosc.cli.generate import add_initial_argument, refuse_initial
from robosc.cli.output import CommandError, ExitCode, UsageError, print_diagnostics, print_json, write_bytes
from robosc.cli.properties import add_arguments as add_property_arguments
from robosc.cli.properties import property_file
from robosc.cli.sign import read_supervisor
from robosc.cli.synth import add_modular_argument, refuse_modular, report_reasons
from robosc.exploration import DEFAULT_LIMIT
from robosc.json_documents import counts_text, diagnostics_json, json_text
from robosc.model.structure import Deployment
from robosc.pipeline.automata_files import is_automata
from robosc.pipeline.options import FOREIGN_STATES
from robosc.pipeline.results import NoSupervisor
from robosc.source import Bundle, SourceFile, visible
from robosc.targets import ControllerConfigError, GenerateOptions, read_controller_config, write_files
from robosc_client import (
    Check,
    Client,
    ClientError,
    Explain,
    Explained,
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
    Verify,
)
from robosc_client.commands.automata import task_of
from robosc_client.commands.connection import (
    SIGNED_SERVICE,
    add_connection_arguments,
    exit_statuses,
    number_up_to,
    seconds,
)
from robosc_client.commands.progress_line import ProgressLine
from robosc_client.commands.signature_checks import require_signature, trusted_keys
from robosc_client.commands.supervisor_file import write_supervisor
from robosc_client.commands.tasks import (
    add_signed_by_argument,
    add_synthesis_arguments,
    are_understood,
    run_verify,
    synthesis_options,
    verify_task,
)
from robosc_client.jobs import MAXIMUM_IDEMPOTENCY_KEY, MAXIMUM_LABEL

if TYPE_CHECKING:
    from robosc.pipeline.systems import SystemSupervisor
    from robosc.signatures import PublicKey

_SUBMIT = """\
Submit a task as a job and print its id without waiting for the result. The job survives the loss of the connection and
a restart of the server. Use 'watch' to follow it and 'get' to fetch its result.
"""

_GET = """\
Print the state of a job. With --result, print its result; with -o, write it: a supervisor (with its signature in a
second file), a graph, a report, an explanation or a text to a file, or generated files to a folder.
"""

_EPILOG = exit_statuses("done")

_SUBMIT_EPILOG = exit_statuses(
    "the server has accepted the job; with --watch: it has succeeded",
    "the model files are not text files; with --watch: the job has failed or was cancelled",
)

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
    submit = commands.add_parser("submit", help="submit a task as a job, without waiting", description=_SUBMIT)
    _add_tasks(submit)

    watch = commands.add_parser("watch", help="follow a job until it has ended")
    watch.set_defaults(run=_watch)
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
    """Reads one of some values by its name or by a shorter one, for a parser."""
    names = {**{str(choice): choice for choice in choices}, **shorter}

    def read(text: str) -> Choice:
        if text not in names:
            raise argparse.ArgumentTypeError(f"{text!r} is not one of {', '.join(names)}")
        return names[text]

    return read


def _label(text: str) -> str:
    if len(text) > MAXIMUM_LABEL or not text.isprintable():
        raise argparse.ArgumentTypeError(f"a label must have at most {MAXIMUM_LABEL} printable characters")
    return text


def _idempotency_key(text: str) -> str:
    is_printable = all(" " <= character <= "~" for character in text)
    if not 0 < len(text) <= MAXIMUM_IDEMPOTENCY_KEY or not is_printable:
        raise argparse.ArgumentTypeError(
            f"an idempotency key must have 1 to {MAXIMUM_IDEMPOTENCY_KEY} printable ASCII characters"
        )
    return text


def _add_tasks(submit: argparse.ArgumentParser) -> None:
    tasks = submit.add_subparsers(title="tasks", dest="task", required=True, metavar="TASK")
    for name, what in (
        ("check", "find everything that is wrong with a model"),
        ("synth", "synthesize a supervisor"),
        ("generate", "generate a package that runs the supervisor"),
        ("explore", "list the controlled system's states and transitions"),
        ("verify", "check a supervisor file, or verify properties"),
        ("explain-synthesis", "explain what synthesis does to a model"),
        ("format", "put a text into its canonical layout"),
    ):
        parser = tasks.add_parser(name, help=what)
        if name == "verify":
            _add_verify_arguments(parser)
        if name == "format":
            parser.add_argument("file", type=given_path, metavar="FILE", help="a model or library")
            parser.add_argument("--json", action="store_true", help="print one JSON document for machines")
        else:
            add_model_arguments(parser)
        if name in ("synth", "generate", "explore", "explain-synthesis"):
            # A graph contains all enabled events, livelocks included; an explanation says nothing of them.
            add_synthesis_arguments(parser, has_choice=name in ("synth", "generate"))
        if name == "explain-synthesis":
            add_question_arguments(parser)
        if name == "synth":
            add_verify_limit_argument(parser, "--verify-limit", SYNTHESIS_STATES)
            add_modular_argument(parser)
        if name == "generate":
            parser.add_argument("--target", required=True, metavar="NAME", help="target to generate: see 'targets'")
            parser.add_argument("--package", metavar="NAME", help="name of the generated package")
            add_initial_argument(parser)
        if name == "explore":
            _add_limit(parser, DEFAULT_LIMIT, "give up beyond N states")
        parser.add_argument("--label", type=_label, default="", metavar="TEXT", help="name of the job in lists")
        parser.add_argument(
            "--idempotency-key",
            type=_idempotency_key,
            metavar="TEXT",
            help="repeating a submission with the same key returns the same job (default: a new key)",
        )
        parser.add_argument(
            "--keep",
            type=seconds,
            metavar="SECONDS",
            help="time for which the server stores the job after its end (default: the server's setting)",
        )
        parser.add_argument(
            "--watch", action="store_true", help="print the id, and follow the job until it has ended, as 'watch' does"
        )
        parser.set_defaults(run=_submit)
        add_connection_arguments(parser, epilog=_SUBMIT_EPILOG)


def _add_limit(parser: argparse.ArgumentParser, default: int, meaning: str) -> None:
    parser.add_argument(
        "--limit",
        type=number_up_to(MAXIMUM_LIMIT),
        default=default,
        metavar="N",
        help=f"{meaning} (default: %(default)s)",
    )


def _add_verify_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("supervisor", nargs="?", type=given_path, metavar="FILE.rsup", help="the supervisor to check")
    add_property_arguments(parser)
    parser.add_argument(
        "--deployment",
        choices=[str(deployment) for deployment in Deployment],
        help="refuse a supervisor made for another deployment (default: as the file says; without a file: controller)",
    )
    _add_limit(parser, FOREIGN_STATES, "verify up to N states of a supervisor file one by one")
    parser.add_argument("--strict", action="store_true", help="fail if maximal permissiveness could not be checked")
    add_engine_options(parser)
    # A server has no keys to check a file with.
    parser.set_defaults(signed_by=[])


def _generation(arguments: argparse.Namespace) -> GenerateOptions:
    """Return the options that are asked of the target: by the arguments, and by the file beside the model."""
    try:
        return read_controller_config(arguments.model.parent).options(arguments.package)
    except ControllerConfigError as error:
        raise UsageError(str(error)) from error


def _task(arguments: argparse.Namespace) -> Task | None:
    """Return the task to be done; None: it cannot be done, and the reason has been reported."""
    if arguments.task == "format":
        return Format(SourceFile(arguments.file.name, property_file(arguments.file).text))
    if automata.is_given(arguments):
        return task_of(arguments, _generation(arguments).package if arguments.task == "generate" else None)
    if arguments.task == "verify":
        return _verification(arguments)
    bundle = read_bundle(arguments)
    match arguments.task:
        case "check":
            return Check(bundle)
        case "synth":
            refuse_modular(arguments)
            return Synthesize(bundle, synthesis_options(arguments))
        case "generate":
            refuse_initial(arguments)
            return Generate(bundle, arguments.target, _generation(arguments), synthesis_options(arguments))
        case "explain-synthesis":
            return Explain(
                model=bundle,
                options=synthesis_options(arguments),
                event=arguments.event,
                state=arguments.state,
                after=arguments.after,
            )
        case _:
            return Explore(bundle, synthesis_options(arguments), arguments.limit)


def _verification(arguments: argparse.Namespace) -> Verify | None:
    """Return the verification to do, refused as `verify` refuses it; None: errors of a property were reported."""
    found: list[Verify] = []

    def with_file(arguments: argparse.Namespace) -> int:
        found.append(verify_task(arguments, read_bundle(arguments), read_supervisor(arguments.supervisor)))
        return ExitCode.OK

    def of_model(arguments: argparse.Namespace) -> int:
        bundle = read_bundle(arguments)
        if are_understood(arguments, bundle):
            arguments.limit = None
            found.append(verify_task(arguments, bundle, b""))
        return ExitCode.OK

    run_verify(arguments, "robosc-client submit verify", with_file, of_model)
    return found[0] if found else None


def _submit(arguments: argparse.Namespace, client: Client) -> int:
    task = _task(arguments)
    if task is None:
        return ExitCode.USAGE
    found = client.submit(
        task,
        label=arguments.label,
        idempotency_key=arguments.idempotency_key,
        retention_s=arguments.keep,
        deadline_s=arguments.deadline,
    )
    if arguments.watch:
        # Print the id first, so that the job can be found after an interrupt; the JSON document comes at the end.
        stream, line = (sys.stderr, f"submitted as {found.job.id}") if arguments.json else (sys.stdout, found.job.id)
        stream.write(f"{line}\n")
        stream.flush()
        arguments.job = found.job.id
        try:
            return _watch(arguments, client)
        except ClientError as error:
            raise CommandError(
                f"job {found.job.id} was submitted, but watching it failed: {error}", ExitCode.SERVICE
            ) from error
    if arguments.json:
        print_json({"job": job_json(found.job), "existed": found.existed})
    else:
        sys.stdout.write(f"{found.job.id}\n")
    return ExitCode.OK


def _watch(arguments: argparse.Namespace, client: Client) -> int:
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
        written = _sound_automata(arguments, found, keys)
    else:
        _require_sound(arguments, found, keys)
        written = None
    has_nothing = arguments.output is not None and not _write(arguments, found, written)
    if arguments.json:
        print_json({"job": job_json(job), "result": result_json(found) if arguments.result or has_nothing else None})
    elif arguments.result:
        _print(job, found)
    elif has_nothing and not isinstance(found, tuple):
        _report_nothing(job, found)
    return ExitCode.OK if _is_success(found) else ExitCode.FAILED


def _report_no_result(arguments: argparse.Namespace, job: Job) -> int:
    """Report why a job that has ended has no result."""
    why = "was cancelled" if job.failure is None else f"has failed: {job.failure.message} [{job.failure.reason}]"
    sys.stderr.write(f"robosc-client: job {job.id} {why}\n")
    if arguments.json:
        print_json({"job": job_json(job), "result": None})
    return ExitCode.FAILED


def _report_nothing(
    job: Job, found: Synthesis | Generation | Exploration | Verification | Explained | Formatted
) -> None:
    """Report why there is nothing to write, like the corresponding command."""
    if isinstance(found, Verification | Explained | Formatted):
        print_diagnostics(found.diagnostics, None)
        if not isinstance(found, Formatted) and found.reason:
            sys.stderr.write(f"{job.main_file}: {visible(found.reason)}\n")
        return
    from robosc_client.outcomes import outcome_from_response

    made = outcome_from_response(found)
    print_diagnostics(made.diagnostics, None)
    report_reasons(made, Bundle(SourceFile(job.main_file, "")))


def _require_sound(arguments: argparse.Namespace, found: TaskResult, keys: "Collection[PublicKey]") -> None:
    """Do nothing if a supervisor that was found is one, and is as the arguments want it.

    Raises:
        CommandError: None of the keys has signed it, or it is no supervisor where one is wanted.
        ServiceError: The supervisor is no valid one, or for another deployment.
    """
    from robosc_client.outcomes import decoded, require_deployment

    supervisor = decoded(found.supervisor) if isinstance(found, Synthesis) and found.supervisor else None
    if supervisor is None or not isinstance(found, Synthesis):
        # Other results, such as graphs and reports, have no signature.
        if keys or arguments.deployment:
            raise CommandError(
                "the job has no supervisor, but --signed-by or --deployment requires one", ExitCode.SERVICE
            )
        return
    if arguments.deployment:
        require_deployment(supervisor, Deployment(arguments.deployment))
    if keys:
        require_signature(keys, found.supervisor, found.signature)


def _sound_automata(
    arguments: argparse.Namespace, found: Synthesis, keys: "Collection[PublicKey]"
) -> "SystemSupervisor":
    """Return the supervisor of automata that a job has made, as the arguments want it.

    Raises:
        UsageError: An argument means nothing for it.
        CommandError: None of the keys has signed it.
        ServiceError: It is no valid one.
    """
    from robosc_client.outcomes import automata_supervisor_of

    automata.refuse(bool(arguments.deployment), "--deployment: automata are not a node of a robot")
    automata.refuse_output(arguments.output)
    supervisor = automata_supervisor_of(found.supervisor)
    if keys:
        require_signature(keys, found.supervisor, found.signature)
    return supervisor


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


def result_json(found: TaskResult) -> dict[str, Any]:
    """Return the result of a job as JSON values; content that is no text is only written by -o."""
    import msgspec

    from robosc.explanation import document

    match found:
        case tuple():
            return diagnostics_json(found)
        case Verification():
            return dict(found.report) or {"status": str(found.status), "reason": found.reason}
        case Formatted():
            return {"text": found.text, **diagnostics_json(found.diagnostics)}
        case Explained():
            why = found.explanation
            summary: dict[str, Any] = {"status": str(found.status), "reason": found.reason, "explanation": None}
            if isinstance(why, GoalExplanation):
                summary["goals"] = why.document()
            elif not isinstance(why, NoSupervisor):
                summary["explanation"] = document(why)
            return {**summary, **diagnostics_json(found.diagnostics)}
    result = {"status": str(found.status), **reasons_json(found), **diagnostics_json(found.diagnostics)}
    match found:
        case Synthesis():
            result["summary"] = found.summary and found.summary.text
            if found.summary and found.summary.goals:
                result["goals"] = asdict(found.summary.goals)
        case Generation():
            result["files"] = list(found.files or ())
        case Exploration():
            result["graph"] = found.graph and msgspec.to_builtins(found.graph)
    return result


def _print(job: Job, found: TaskResult) -> None:
    if isinstance(found, Formatted) and found.text is not None:
        # Byte for byte to a file or program; without control characters to a terminal.
        sys.stdout.write(_printable(found.text) if sys.stdout.isatty() else found.text)
        return
    if isinstance(found, tuple):
        print_diagnostics(found, None)
        if not found:
            sys.stdout.write(f"{visible(job.main_file)}: {counts_text(found)}\n")
        return
    if isinstance(found, Synthesis | Generation | Exploration) and not _is_success(found):
        print_diagnostics(found.diagnostics, None)
    print_json(result_json(found))


def _printable(text: str) -> str:
    """The lines of a text as a terminal may show them."""
    return "\n".join("\t".join(map(visible, line.split("\t"))) for line in text.split("\n"))


def _is_success(found: TaskResult) -> bool:
    match found:
        case tuple():
            return not any(item.severity == "error" for item in found)
        case Verification():
            return found.status == "passed"
        case Formatted():
            return found.text is not None
    return found.status == "supervisor"


def _write(arguments: argparse.Namespace, found: TaskResult, supervisor: "SystemSupervisor | None") -> bool:
    """Write the result of a job; return False if there is nothing to write.

    Args:
        arguments: Arguments of the command.
        found: The result.
        supervisor: Supervisor of automata in the result, whose controlled system is written; None: there is none.

    Raises:
        UsageError: It cannot be written, or is never anything for a file.
    """
    import msgspec

    match found:
        case tuple():
            raise UsageError("a check has no result file: use --result to print its findings")
        case Synthesis() if supervisor is not None and arguments.output.suffix != automata.SUPERVISOR:
            write_bytes(arguments.output, automata.controlled_system(supervisor, arguments.output.suffix))
        case Synthesis() if found.supervisor:
            write_supervisor(arguments.output, found.supervisor, found.signature)
        case Generation() if found.files is not None:
            write_files(found.files, arguments.output, arguments.force)
        case Exploration() if found.graph is not None:
            write_bytes(arguments.output, json_text(msgspec.to_builtins(found.graph)).encode("utf-8"))
        case Verification() if found.report:
            write_bytes(arguments.output, json_text(found.report).encode("utf-8"))
        case Explained() if not isinstance(found.explanation, NoSupervisor):
            write_bytes(arguments.output, json_text(result_json(found)).encode("utf-8"))
        case Formatted() if found.text is not None:
            write_bytes(arguments.output, found.text.encode("utf-8"))
        case _:
            return False
    return True
