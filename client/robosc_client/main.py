"""`robosc-client`: check, synthesize and generate on a server; prints and writes what `robosc` would."""

import argparse
import os
import re
import sys
from collections.abc import Sequence

# gRPC's own log would tell once more, in its words, what we tell; it is read at its import.
os.environ.setdefault("GRPC_VERBOSITY", "NONE")

from robosc import __version__
from robosc.cli.arguments import (
    Parser,
    add_deployment_argument,
    add_engine_argument,
    add_livelock_argument,
    add_model_arguments,
    read_bundle,
)
from robosc.cli.check import report_check
from robosc.cli.generate import add_generate_arguments, generate_options, report_generated
from robosc.cli.main import guarded, parse
from robosc.cli.output import CommandError, ExitCode, ProgressLine, require_other_file
from robosc.cli.synth import add_output_argument, report_synthesis
from robosc.errors import InvalidSupervisorError, LanguageError, UnsupportedModelError
from robosc.model.structure import Deployment
from robosc.source import Bundle
from robosc.supervisor import Made, MadeStatus, decode
from robosc_api.security import add_client_arguments, credentials_of
from robosc_client import Client, ClientError, Generation, ServiceError, Synthesis, SynthesisOptions, SynthesisStatus

_EPILOG = """\
exit status:
  0  done; the model has no errors
  1  the model has errors, or no supervisor exists
  2  wrong use
  3  the server is not there, refused, failed or did not answer before the deadline
"""

_ADDRESS = re.compile(r"(\[[0-9A-Fa-f:.%]+\]|[A-Za-z0-9._-]+):([0-9]{1,5})\Z")


def make_parser() -> Parser:
    """The parser of the whole command line."""
    parser = Parser(
        prog="robosc-client",
        description="Check models, synthesize supervisors and generate packages on a RoboSC server.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"robosc-client {__version__}")
    commands = parser.add_subparsers(title="commands", dest="command", required=True, metavar="COMMAND")

    check = commands.add_parser("check", help="find everything that is wrong with a model")
    _add_common_arguments(check)
    check.add_argument("--strict", action="store_true", help="exit with 1 for warnings too")
    check.set_defaults(run=_check)

    synth = commands.add_parser("synth", help="synthesize a supervisor")
    _add_common_arguments(synth)
    add_output_argument(synth)
    _add_synthesis_arguments(synth)
    synth.set_defaults(run=_synth)

    generate = commands.add_parser("generate", help="generate a package that runs the supervisor")
    _add_common_arguments(generate)
    add_generate_arguments(generate)
    _add_synthesis_arguments(generate)
    generate.set_defaults(run=_generate)
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; returns its exit status."""
    arguments = parse(make_parser(), argv)

    def run() -> int:
        try:
            with Client(arguments.server, credentials_of(arguments)) as client:
                return int(arguments.run(arguments, client))
        except ClientError as error:
            raise CommandError(str(error), ExitCode.SERVICE) from error

    return guarded("robosc-client", run, as_json=arguments.json)


def _add_common_arguments(parser: argparse.ArgumentParser) -> None:
    parser.epilog, parser.formatter_class = _EPILOG, argparse.RawDescriptionHelpFormatter
    add_model_arguments(parser)
    parser.add_argument("--server", type=_address, required=True, metavar="HOST:PORT", help="where the server listens")
    add_client_arguments(parser)
    parser.add_argument(
        "--deadline",
        type=_seconds,
        metavar="SECONDS",
        help="give up after so long (default: as long as the server works on it)",
    )


def _add_synthesis_arguments(parser: argparse.ArgumentParser) -> None:
    add_deployment_argument(parser)
    add_engine_argument(parser)
    add_livelock_argument(parser)


def _address(text: str) -> str:
    match = _ADDRESS.match(text)
    if not match or not 0 < int(match[2]) <= 65535:
        raise argparse.ArgumentTypeError(f"not HOST:PORT: '{text}'")
    return text


def _seconds(text: str) -> float:
    number = float(text)
    if not 0 < number < 1e9:
        raise argparse.ArgumentTypeError("a positive number of seconds is needed")
    return number


# How argparse calls it in "invalid ... value".
_seconds.__name__ = "number"


def _check(arguments: argparse.Namespace, client: Client) -> int:
    bundle = None
    try:
        bundle = read_bundle(arguments)
        diagnostics = client.check(bundle, deadline_s=arguments.deadline)
    except LanguageError as error:
        diagnostics = error.diagnostics
    return report_check(arguments, diagnostics, bundle)


def _synth(arguments: argparse.Namespace, client: Client) -> int:
    require_other_file(arguments.output, arguments.model)
    bundle = read_bundle(arguments)
    line = ProgressLine()
    try:
        synthesis = client.synthesize(
            bundle,
            _options(arguments),
            deadline_s=arguments.deadline,
            on_progress=lambda progress: line.show(f"{progress.stage}: {progress.message}"),
        )
    finally:
        line.clear()
    made = _made(synthesis, synthesis.supervisor)
    return report_synthesis(arguments, made, bundle)


def _generate(arguments: argparse.Namespace, client: Client) -> int:
    options = generate_options(arguments)
    bundle: Bundle = read_bundle(arguments)
    generation = client.generate(bundle, arguments.target, options, _options(arguments), deadline_s=arguments.deadline)
    made = _made(generation, b"")
    return report_generated(arguments, made, generation.files, bundle)


def _options(arguments: argparse.Namespace) -> SynthesisOptions:
    return SynthesisOptions(
        deployment=Deployment(arguments.deployment),
        engine=arguments.engine,
        allow_livelock=arguments.allow_livelock,
    )


def _made(result: Synthesis | Generation, content: bytes) -> Made:
    """What the server made, as `robosc` itself reports it.

    Raises:
        UnsupportedModelError: The model is correct, but cannot be handled.
        ServiceError: The server's supervisor is no valid one.
    """
    if result.status is SynthesisStatus.UNSUPPORTED_MODEL:
        raise UnsupportedModelError(result.reason)
    try:
        supervisor = decode(content) if content else None
    except InvalidSupervisorError as error:
        raise ServiceError(f"the server's supervisor is refused: {error}") from error
    return Made(
        MadeStatus(str(result.status)),
        supervisor,
        result.diagnostics,
        reason=result.reason,
        explanation=result.explanation,
    )


if __name__ == "__main__":
    sys.exit(main())
