"""The command `submit`, which has a task done as a job."""

import argparse
import sys

from robosc.cli import automata
from robosc.cli.arguments import (
    MAXIMUM_LIMIT,
    SYNTHESIS_STATES,
    add_engine_options,
    add_model_arguments,
    add_verify_limit_argument,
    given_path,
    read_bundle,
)
from robosc.cli.explain_synthesis import add_question_arguments, refuse_modular
from robosc.cli.generate import add_initial_argument, refuse_initial
from robosc.cli.output import CommandError, ExitCode, UsageError, print_json
from robosc.cli.properties import add_arguments as add_property_arguments
from robosc.cli.properties import property_file
from robosc.cli.sign import read_supervisor
from robosc.cli.synth import add_modular_argument
from robosc.cli.verify import add_automata_arguments
from robosc.exploration import DEFAULT_LIMIT
from robosc.model.structure import Deployment
from robosc.pipeline.options import FOREIGN_STATES
from robosc.source import SourceFile
from robosc.targets import ControllerConfigError, GenerateOptions, read_controller_config
from robosc_client import Check, Client, ClientError, Explain, Explore, Format, Generate, Synthesize, Task, Verify
from robosc_client.commands.automata import task_of
from robosc_client.commands.connection import add_connection_arguments, exit_statuses, number_up_to, seconds
from robosc_client.commands.jobs import job_json, watch_job
from robosc_client.commands.tasks import (
    add_synthesis_arguments,
    are_understood,
    run_verify,
    synthesis_options,
    verify_task,
)
from robosc_client.jobs import MAXIMUM_IDEMPOTENCY_KEY, MAXIMUM_LABEL

_SUBMIT = """\
Submit a task as a job and print its id without waiting for the result. The job survives the loss of the connection and
a restart of the server. Use 'watch' to follow it and 'get' to fetch its result.
"""

_SUBMIT_EPILOG = exit_statuses(
    "the server has accepted the job; with --watch: it has succeeded",
    "the model files are not text files; with --watch: the job has failed or was cancelled",
)


def add_parsers(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command."""
    submit = commands.add_parser("submit", help="submit a task as a job, without waiting", description=_SUBMIT)
    _add_tasks(submit)


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
            add_modular_argument(parser)
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
    add_automata_arguments(parser)
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
    if arguments.task == "explain-synthesis":
        refuse_modular(arguments)
    if automata.is_given(arguments):
        return task_of(arguments, _generation(arguments).package if arguments.task == "generate" else None)
    if arguments.task == "verify":
        return _verification(arguments)
    bundle = read_bundle(arguments)
    match arguments.task:
        case "check":
            return Check(bundle)
        case "synth":
            return Synthesize(bundle, synthesis_options(arguments), arguments.modular)
        case "generate":
            refuse_initial(arguments)
            options = synthesis_options(arguments)
            return Generate(bundle, arguments.target, _generation(arguments), options, is_modular=arguments.modular)
        case "explain-synthesis":
            return Explain(
                model=bundle,
                options=synthesis_options(arguments),
                event=arguments.event,
                state=arguments.state,
                after=arguments.after,
                is_modular=arguments.modular,
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
            return watch_job(arguments, client)
        except ClientError as error:
            raise CommandError(
                f"job {found.job.id} was submitted, but watching it failed: {error}", ExitCode.SERVICE
            ) from error
    if arguments.json:
        print_json({"job": job_json(found.job), "existed": found.existed})
    else:
        sys.stdout.write(f"{found.job.id}\n")
    return ExitCode.OK
