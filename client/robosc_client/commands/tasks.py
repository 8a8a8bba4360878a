"""`check`, `synth`, `generate`, `explore`, `verify` and `format`, done on a server.

What they print and write is what those of `robosc` print and write.
"""

import argparse
import sys
from collections.abc import Callable
from pathlib import Path

from robosc.cli import explore as explore_here
from robosc.cli import format as format_here
from robosc.cli import properties, synth
from robosc.cli import verify as verify_here
from robosc.cli.arguments import (
    add_deployment_argument,
    add_engine_options,
    add_livelock_argument,
    add_model_arguments,
    read_bundle,
)
from robosc.cli.check import report_check
from robosc.cli.generate import add_generate_arguments, generate_options, report_generated
from robosc.cli.output import (
    CommandError,
    ExitCode,
    UsageError,
    print_diagnostics,
    print_json,
    require_other_file,
    write_bytes,
)
from robosc.cli.sign import read_supervisor, signer_of
from robosc.cli.synth import add_output_argument, report_synthesis
from robosc.errors import InvalidSupervisorError, LanguageError, UnsupportedModelError
from robosc.model.structure import Deployment
from robosc.source import Bundle, SourceFile, visible
from robosc_client import Client, SynthesisOptions, Verification, VerificationStatus, Verify
from robosc_client.commands.connection import add_connection_arguments
from robosc_client.commands.shown import Shown
from robosc_client.errors import malformed

type Commands = "argparse._SubParsersAction[argparse.ArgumentParser]"


def add_parsers(commands: Commands) -> None:
    """Add the commands."""
    check = commands.add_parser("check", help="find everything that is wrong with a model")
    add_model_arguments(check)
    check.add_argument("--strict", action="store_true", help="exit with 1 for warnings too")
    check.set_defaults(run=_check)

    make = commands.add_parser("synth", help="synthesize a supervisor")
    add_model_arguments(make)
    add_output_argument(make)
    add_synthesis_arguments(make)
    make.add_argument(
        "--signed-by",
        action="append",
        default=[],
        type=Path,
        metavar="FILE.pub",
        help="the server must have signed the supervisor by a key of this file (may be repeated)",
    )
    make.set_defaults(run=_synth)

    generate = commands.add_parser("generate", help="generate a package that runs the supervisor")
    add_model_arguments(generate)
    add_generate_arguments(generate)
    add_synthesis_arguments(generate)
    generate.set_defaults(run=_generate)

    for module, run in ((explore_here, _explore), (verify_here, _verify), (format_here, _format)):
        module.add_parser(commands)
        name = module.__name__.rpartition(".")[2]
        commands.choices[name].set_defaults(run=run)
    usage = commands.choices["verify"].usage or ""
    commands.choices["verify"].usage = usage.replace("robosc verify", "robosc-client verify")
    for name in ("check", "synth", "generate", "explore", "verify", "format"):
        add_connection_arguments(commands.choices[name])
    commands.choices["verify"].epilog = f"{properties.EPILOG}  3  the server is not there, refused or failed\n"


def add_synthesis_arguments(parser: argparse.ArgumentParser) -> None:
    """How a supervisor is made."""
    add_deployment_argument(parser)
    add_engine_options(parser)
    add_livelock_argument(parser)


def synthesis_options(arguments: argparse.Namespace) -> SynthesisOptions:
    """What `add_synthesis_arguments` has read."""
    return SynthesisOptions(
        deployment=Deployment(arguments.deployment),
        engine=arguments.engine,
        allow_livelock=getattr(arguments, "allow_livelock", True),
        allow_reordering=arguments.reorder,
        maximum_nodes=arguments.max_nodes,
    )


def property_texts(arguments: argparse.Namespace) -> tuple[list[SourceFile], list[SourceFile]]:
    """The properties that the arguments name: texts with one each, and files.

    Raises:
        UsageError: A file cannot be read.
        LanguageError: A file is no text.
    """
    texts = [SourceFile(f"property {number}", text) for number, text in enumerate(arguments.property, start=1)]
    return texts, [properties.property_file(path) for path in arguments.properties]


def verify_task(arguments: argparse.Namespace, bundle: Bundle, supervisor: bytes) -> Verify:
    """What the arguments of `verify` ask for."""
    texts, listings = property_texts(arguments)
    return Verify(
        bundle=bundle,
        supervisor=supervisor,
        deployment=None if arguments.deployment is None else Deployment(arguments.deployment),
        properties=tuple(file.text for file in texts),
        property_files=tuple(listings),
        engine=arguments.engine,
        allow_reordering=arguments.reorder,
        maximum_nodes=arguments.max_nodes,
        # A request has no word for 0, which would be the server's own limit.
        maximum_states=None if arguments.limit is None else max(arguments.limit, 1),
        is_strict=arguments.strict,
    )


def _check(arguments: argparse.Namespace, client: Client) -> int:
    bundle = None
    try:
        bundle = read_bundle(arguments)
        diagnostics = client.check(bundle, deadline_s=arguments.deadline)
    except LanguageError as error:
        diagnostics = error.diagnostics
    return report_check(arguments, diagnostics, bundle)


def _synth(arguments: argparse.Namespace, client: Client) -> int:
    from robosc_client.made import made_of, require_made_for

    require_other_file(arguments.output, arguments.model)
    bundle = read_bundle(arguments)
    options = synthesis_options(arguments)
    with Shown() as shown:
        found = client.synthesize(bundle, options, deadline_s=arguments.deadline, on_progress=shown.tell)
    made = made_of(found, found.supervisor)
    if made.supervisor is not None:
        require_made_for(made.supervisor, bundle, options.deployment)
        if arguments.signed_by:
            require_signature(arguments, found.supervisor, found.signature)
        if arguments.output is not None:
            write_signature(arguments.output, found.signature)
    return report_synthesis(arguments, made, bundle)


def require_signature(arguments: argparse.Namespace, supervisor: bytes, signature: bytes) -> None:
    """Do nothing if a key that `--signed-by` names has signed a supervisor's file.

    Raises:
        CommandError: None has.
        UsageError: A file cannot be read.
        SignatureError: A file holds no key.
    """
    from robosc.signatures import MAXIMUM_KEY_BYTES, PublicKey, SignatureError, read_public_keys, signer

    keys: list[PublicKey] = []
    for path in arguments.signed_by:
        try:
            with path.open("rb") as stream:
                text = stream.read(MAXIMUM_KEY_BYTES + 1).decode("utf-8", "replace")
        except OSError as error:
            raise UsageError(f"cannot read {path}: {error.strerror or error}") from error
        keys += read_public_keys(text, str(path))
    if not signature:
        raise CommandError("the server has not signed the supervisor", ExitCode.SERVICE)
    try:
        signer(supervisor, signature, keys)
    except SignatureError as error:
        raise CommandError(f"the server's supervisor: {error}", ExitCode.SERVICE) from error


def write_signature(output: Path, signature: bytes) -> None:
    """Write the signature beside a supervisor's file.

    Args:
        output: The supervisor's file.
        signature: The signature; empty: there is none, and none stays there.

    Raises:
        UsageError: A file cannot be written.
    """
    from robosc.signatures import signature_file

    place = signature_file(output)
    if signature:
        write_bytes(place, signature)
    else:
        # One that is there is of an earlier supervisor, and would not fit.
        try:
            place.unlink(missing_ok=True)
        except OSError as error:
            raise UsageError(f"cannot remove {place}: {error.strerror or error}") from error


def _generate(arguments: argparse.Namespace, client: Client) -> int:
    from robosc_client.made import made_of

    generation = generate_options(arguments)
    bundle = read_bundle(arguments)
    with Shown() as shown:
        found = client.generate(
            bundle,
            arguments.target,
            generation,
            synthesis_options(arguments),
            deadline_s=arguments.deadline,
            on_progress=shown.tell,
        )
    return report_generated(arguments, made_of(found), found.files, bundle)


def _explore(arguments: argparse.Namespace, client: Client) -> int:
    from robosc.exploration import graph_dot, graph_json, graph_text
    from robosc.json_documents import diagnostics_json
    from robosc_client.made import graph_of, made_of

    bundle = read_bundle(arguments)
    options = synthesis_options(arguments)
    with Shown() as shown:
        found = client.explore(
            bundle,
            options,
            maximum_states=arguments.limit,
            deadline_s=arguments.deadline,
            on_progress=shown.tell,
        )
    made = made_of(found)
    if found.graph is None:
        if arguments.json:
            print_json({"status": str(made.status), **synth.reasons_json(made), **diagnostics_json(made.diagnostics)})
        else:
            synth.report_problems(made, bundle)
        return ExitCode.FAILED
    graph = graph_of(found.graph, bundle, options.deployment)
    if arguments.json:
        print_json(graph_json(graph))
    else:
        sys.stdout.write(graph_dot(graph) if arguments.dot else graph_text(graph))
    return ExitCode.OK


def _verify(arguments: argparse.Namespace, client: Client) -> int:
    return verify_here.run_with(
        arguments,
        lambda arguments: _verify_supervisor(arguments, client),
        lambda arguments: _verify_properties(arguments, client),
    )


def _verify_supervisor(arguments: argparse.Namespace, client: Client) -> int:
    from robosc.signatures import SignatureError
    from robosc.supervisor.codec import decode
    from robosc_client.made import require_recheck

    content = read_supervisor(arguments.supervisor)
    bundle = read_bundle(arguments)
    try:
        if arguments.signed_by:
            verify_here.tell_signer(arguments, signer_of(arguments.supervisor, content, arguments.signed_by))
        supervisor = decode(content)
    except (InvalidSupervisorError, SignatureError) as error:
        return verify_here.report_malformed(arguments, error)
    found = _verified(arguments, client, verify_task(arguments, bundle, content))
    if "properties" in found.report or found.status is VerificationStatus.PROPERTY_ERRORS:
        return _report_verdicts(arguments, found, bundle, supervisor.deployment)
    return verify_here.report_recheck(arguments, require_recheck(found.report), found.diagnostics, bundle)


def _verify_properties(arguments: argparse.Namespace, client: Client) -> int:
    from robosc.model import check

    bundle = read_bundle(arguments)
    # What is wrong with a property is told before the server is asked.
    model = check(bundle).model
    if model is not None and properties.read_properties(arguments, model) is None:
        return ExitCode.USAGE
    arguments.limit = None
    found = _verified(arguments, client, verify_task(arguments, bundle, b""))
    return _report_verdicts(arguments, found, bundle, Deployment(arguments.deployment))


def _verified(arguments: argparse.Namespace, client: Client, task: Verify) -> Verification:
    """The server's answer.

    Raises:
        UnsupportedModelError: The model is correct, but cannot be handled.
    """
    with Shown() as shown:
        found = client.verify(task, deadline_s=arguments.deadline, on_progress=shown.tell)
    if found.status is VerificationStatus.UNSUPPORTED_MODEL:
        raise UnsupportedModelError(found.reason)
    return found


def _report_verdicts(
    arguments: argparse.Namespace, found: Verification, bundle: Bundle, deployment: Deployment
) -> ExitCode:
    from robosc_client.made import verdicts_of

    if found.status in (VerificationStatus.PROPERTY_ERRORS, VerificationStatus.NO_SUPERVISOR):
        texts, listings = property_texts(arguments)
        is_about_model = found.status is VerificationStatus.NO_SUPERVISOR
        files = [*texts, *listings]
        if arguments.json:
            print_json(found.report)
        else:
            print_diagnostics(found.diagnostics, bundle if is_about_model else Bundle(files[0], tuple(files[1:])))
            if found.reason:
                sys.stderr.write(f"{bundle.main.name}: {visible(found.reason)}\n")
        return ExitCode.FAILED if is_about_model else ExitCode.USAGE
    verdicts, system, model = verdicts_of(found.report, bundle, deployment, *property_texts(arguments))
    status = properties.report_verdicts(arguments, verdicts, system, model)
    if (status is ExitCode.OK) != (found.status is VerificationStatus.PASSED):
        raise malformed("its status and its verdicts do not fit")
    return status


def _format(arguments: argparse.Namespace, client: Client) -> int:
    return format_here.run_with(arguments, formatter(arguments, client))


def formatter(arguments: argparse.Namespace, client: Client) -> Callable[[str, str], str]:
    """Formats a text of a name on the server; raises LanguageError for syntax errors."""

    def format_text(text: str, name: str) -> str:
        found = client.format(SourceFile(name, text), deadline_s=arguments.deadline)
        if found.text is None:
            raise LanguageError(found.diagnostics)
        return found.text

    return format_text
