"""`robosc verify`: verification of a supervisor file against its model, and of properties of its robot."""

import argparse
import sys
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from robosc.cli import automata, properties
from robosc.cli.arguments import (
    add_engine_options,
    add_model_arguments,
    add_verify_limit_argument,
    given_path,
    read_bundle,
)
from robosc.cli.output import ExitCode, ProgressLine, UsageError, print_diagnostics, print_json
from robosc.cli.sign import name_and_deployment, read_supervisor, report_malformed, report_signer, signer_of
from robosc.errors import Diagnostic, InvalidSupervisorError
from robosc.model.structure import Deployment
from robosc.pipeline.options import FOREIGN_STATES
from robosc.signatures import SignatureError
from robosc.source import Bundle

if TYPE_CHECKING:
    pass

_USAGE = """robosc verify [options] FILE.rsup MODEL
       robosc verify [options] [FILE.rsup] MODEL --property PROPERTY
       robosc verify FILE.rsup --signed-by FILE.pub
       robosc verify [options] FILE.cif|FILE.gen|FILE.wmod"""

_DESCRIPTION = """\
With FILE.rsup: check a supervisor file against the texts of its model, believing nothing that the file says of itself:
it must hold the model of the texts, its figures must be right, and the robot under it must be safe, controllable and
nonblocking, and reach its goals. That it forbids no more than it must is checked for systems of moderate size.
With --signed-by: the file must be signed by that key, too; without MODEL, nothing else is checked.
With properties: verify them in the robot under its supervisor, which is synthesized unless a file is given and passes,
with a run that shows why each of them holds or fails.
With automata (FILE.cif, .gen, .wmod): synthesize their supervisor, unless they have one, and verify it by other means
than it was made; with --controller also bounded and finite response, confluence and nonblocking under control. With
--as-is nothing is synthesized.
"""


def add_parser(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command."""
    parser = commands.add_parser(
        "verify",
        help="check a supervisor file against its model; verify properties of the robot under its supervisor",
        description=_DESCRIPTION,
        usage=_USAGE,
        epilog=properties.EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    # Optional to the parser alone, so that another question about a MODEL can do without it.
    parser.add_argument("supervisor", nargs="?", type=given_path, metavar="FILE.rsup", help="the supervisor to check")
    add_model_arguments(parser)
    properties.add_arguments(parser)
    parser.add_argument(
        "--deployment",
        choices=[str(deployment) for deployment in Deployment],
        help="refuse a supervisor made for another deployment (default: as the file says; without a file: controller)",
    )
    add_verify_limit_argument(parser, "--limit", FOREIGN_STATES)
    parser.add_argument("--strict", action="store_true", help="permissiveness must have been checked, too")
    parser.add_argument(
        "--signed-by",
        action="append",
        default=[],
        type=given_path,
        metavar="FILE.pub",
        help="the supervisor file must be signed by a key of this file (may be repeated); without MODEL, that alone is "
        "checked",
    )
    add_automata_arguments(parser)
    parser.add_argument("-q", "--quiet", action="store_true", help="print what is wrong and nothing else")
    add_engine_options(parser)
    parser.set_defaults(run=run)


def add_automata_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments that are for automata alone."""
    parser.add_argument(
        "--controller",
        action="store_true",
        help="of automata: check that code that runs them responds in bounded time (with the bounds), in the same way "
        "whatever the order of controllable events, and gets to marked states",
    )
    parser.add_argument(
        "--as-is",
        action="store_true",
        help="of automata: synthesize nothing, and verify them as they stand, with requirements for their supervisor",
    )


def run(arguments: argparse.Namespace) -> int:
    """Check; 0 if the supervisor passed and every property holds, 1 if not.

    Raises:
        UsageError: A file is not there or cannot be read, or there is nothing to check.
    """
    if automata.is_given(arguments):
        return automata.verify(arguments)
    return run_with(arguments, _verify_supervisor, properties.run)


def run_with(
    arguments: argparse.Namespace,
    verify_supervisor: Callable[[argparse.Namespace], int],
    verify_properties: Callable[[argparse.Namespace], int],
) -> int:
    """Find out what is to be checked, and have it checked.

    Args:
        arguments: Of the command.
        verify_supervisor: Checks a supervisor file, and properties if it passes.
        verify_properties: Checks properties of a model's robot.

    Raises:
        UsageError: As `run`.
    """
    if arguments.controller:
        raise UsageError("--controller is for automata (.cif, .gen, .wmod): of a robot, synth checks its controller")
    if arguments.as_is:
        raise UsageError("--as-is is for automata (.cif, .gen, .wmod): a robot has a supervisor only by synthesis")
    has_properties = bool(arguments.property or arguments.properties)
    if arguments.supervisor is None and arguments.model.suffix == ".rsup":
        if arguments.signed_by and not has_properties:
            return _verify_signature(arguments)
        raise UsageError(f"{arguments.model} is a supervisor file: verify needs its model, too")
    if arguments.supervisor is not None:
        if not has_properties and (arguments.reorder or arguments.max_nodes):
            raise UsageError("--reorder and --max-nodes are for properties: they need --property or --properties")
        return verify_supervisor(arguments)
    if not has_properties:
        raise UsageError(
            "verify needs a supervisor file and its model (robosc verify FILE.rsup MODEL), "
            "or properties (robosc verify MODEL --property PROPERTY)"
        )
    if arguments.strict or arguments.limit != FOREIGN_STATES or arguments.signed_by:
        raise UsageError("--limit, --strict and --signed-by say how to check a supervisor file: they need FILE.rsup")
    arguments.deployment = arguments.deployment or str(Deployment.CONTROLLER)
    return verify_properties(arguments)


def _verify_supervisor(arguments: argparse.Namespace) -> int:
    from robosc.certification.file_report import file_verification_json, has_passed
    from robosc.certification.supervisor_file import verify_supervisor_file
    from robosc.supervisor.codec import decode
    from robosc.synthesis.engines import resolve_engine
    from robosc.verification import Limits

    engine = resolve_engine(arguments.engine)
    content = read_supervisor(arguments.supervisor)
    bundle = read_bundle(arguments)
    try:
        if arguments.signed_by:
            report_signer(arguments, signer_of(arguments.supervisor, content, arguments.signed_by))
        supervisor = decode(content)
    except (InvalidSupervisorError, SignatureError) as error:
        return report_malformed(arguments, error)
    progress = ProgressLine()
    try:
        found = verify_supervisor_file(
            supervisor,
            bundle,
            Limits.of(arguments.limit),
            deployment=None if arguments.deployment is None else Deployment(arguments.deployment),
            engine=engine,
            on_progress=lambda message: progress.show(f"verification: {message}"),
        )
    finally:
        progress.clear()
    is_right = has_passed(found, is_strict=arguments.strict)
    if is_right and (arguments.property or arguments.properties):
        # The user wants only the verdicts for a supervisor that has passed.
        return properties.verify(arguments, supervisor)
    return report_file_verification(
        arguments, file_verification_json(found, supervisor, is_strict=arguments.strict), found.diagnostics, bundle
    )


def report_file_verification(
    arguments: argparse.Namespace,
    document: Mapping[str, Any],
    diagnostics: Sequence[Diagnostic],
    bundle: Bundle,
) -> ExitCode:
    """Print what was found about a supervisor as asked, and return the exit status.

    Args:
        arguments: Arguments of the command.
        document: Document as `file_verification_json` makes it.
        diagnostics: Reasons why the texts hold no model that the supervisor could be for.
        bundle: The texts.
    """
    from robosc.certification.file_report import file_verification_text

    if arguments.json:
        print_json(document)
    else:
        print_diagnostics(diagnostics, bundle)
        if diagnostics or document["method"] is not None or document["faults"]:
            text = file_verification_text(
                document, str(arguments.supervisor), str(arguments.model), is_quiet=arguments.quiet
            )
            sys.stdout.write(text)
        else:
            sys.stderr.write(f"{arguments.model}: a library has no robot that a supervisor could be for\n")
    return ExitCode.OK if document["status"] == "passed" else ExitCode.FAILED


def _verify_signature(arguments: argparse.Namespace) -> int:
    """Verify the signature of a file alone; its model is not looked at."""
    arguments.supervisor = arguments.model
    content = read_supervisor(arguments.supervisor)
    try:
        key = signer_of(arguments.supervisor, content, arguments.signed_by)
        name, deployment = name_and_deployment(content)
        if arguments.deployment not in (None, deployment):
            made_for = f"the deployment {deployment}" if deployment else "automata"
            raise SignatureError(f"made for {made_for}, not {arguments.deployment}")
    except (InvalidSupervisorError, SignatureError) as error:
        return report_malformed(arguments, error)
    if arguments.json:
        print_json({"status": "signed", "model": name, "deployment": deployment, "signed_by": key.fingerprint})
    else:
        report_signer(arguments, key)
    return ExitCode.OK
