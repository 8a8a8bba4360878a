"""The commands `check`, `synth`, `generate`, `explore`, `verify`, `explain-synthesis` and `format` on a server.

They print and write the same as the commands of `robosc`.
"""

import argparse
import sys
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

from robosc.certification.reasons import reasons_json
from robosc.cli import automata, properties, synth
from robosc.cli import check as check_here
from robosc.cli import explain_synthesis as explain_here
from robosc.cli import explore as explore_here
from robosc.cli import format as format_here
from robosc.cli import verify as verify_here
from robosc.cli.arguments import (
    SYNTHESIS_STATES,
    add_deployment_argument,
    add_engine_options,
    add_livelock_argument,
    add_model_arguments,
    add_verify_limit_argument,
    given_path,
    read_bundle,
)
from robosc.cli.generate import (
    NOT_WRITTEN,
    WRITTEN,
    add_generate_arguments,
    generate_options,
    refuse_initial,
    report_generated,
)
from robosc.cli.output import (
    ExitCode,
    UsageError,
    print_diagnostics,
    print_json,
    require_other_file,
)
from robosc.cli.sign import read_supervisor, report_malformed, report_signer, signer_of
from robosc.cli.synth import add_output_argument, report_written
from robosc.errors import InvalidSupervisorError, LanguageError, UnsupportedModelError
from robosc.json_documents import diagnostics_json
from robosc.model.structure import Deployment
from robosc.source import Bundle, SourceFile, visible
from robosc_client import Client, Explained, SynthesisOptions, Verification, VerificationStatus, Verify
from robosc_client.commands.automata import Server
from robosc_client.commands.connection import (
    SERVICE,
    SIGNED_SERVICE,
    add_connection_arguments,
    checked_number,
    exit_statuses,
)
from robosc_client.commands.progress_line import ProgressLine
from robosc_client.commands.signature_checks import require_signature, trusted_keys
from robosc_client.commands.supervisor_file import write_supervisor
from robosc_client.errors import malformed

if TYPE_CHECKING:
    from robosc.certification import SynthesisOutcome

type Commands = "argparse._SubParsersAction[argparse.ArgumentParser]"


def add_parsers(commands: Commands) -> None:
    """Add the commands."""
    make = commands.add_parser("synth", help="synthesize a supervisor")
    add_model_arguments(make)
    add_output_argument(make)
    add_synthesis_arguments(make)
    add_verify_limit_argument(make, "--verify-limit", SYNTHESIS_STATES)
    synth.add_modular_argument(make)
    add_signed_by_argument(make)
    make.set_defaults(run=_synth)

    generate = commands.add_parser("generate", help="generate a package that runs the supervisor")
    add_model_arguments(generate)
    add_generate_arguments(generate)
    add_synthesis_arguments(generate)
    generate.set_defaults(run=_generate)

    for module, run in (
        (check_here, _check),
        (explore_here, _explore),
        (verify_here, _verify),
        (explain_here, _explain_synthesis),
        (format_here, _format),
    ):
        module.add_parser(commands)
        name = module.__name__.rpartition(".")[2].replace("_", "-")
        commands.choices[name].set_defaults(run=run)
    usage = commands.choices["verify"].usage or ""
    commands.choices["verify"].usage = usage.replace("robosc verify", "robosc-client verify")
    for name in ("check", "synth", "generate", "explore", "verify", "explain-synthesis", "format"):
        add_connection_arguments(commands.choices[name])
    commands.choices["verify"].epilog = f"{properties.EPILOG}  3  {SERVICE}\n  130  Ctrl-C\n"
    generate.epilog = exit_statuses(WRITTEN, NOT_WRITTEN)
    make.epilog = exit_statuses("done", "the model has errors, or no supervisor exists", SIGNED_SERVICE)


def add_synthesis_arguments(parser: argparse.ArgumentParser, *, has_choice: bool = True) -> None:
    """Add the arguments for the synthesis of a supervisor.

    Args:
        parser: Parser of the command.
        has_choice: True if livelocks can be refused.
    """
    add_deployment_argument(parser)
    add_engine_options(parser)
    if has_choice:
        add_livelock_argument(parser)


def add_signed_by_argument(parser: argparse.ArgumentParser) -> None:
    """Add the argument for the keys of which one must have signed the supervisor."""
    parser.add_argument(
        "--signed-by",
        action="append",
        default=[],
        type=given_path,
        metavar="FILE.pub",
        help="accept only a supervisor that a key of this file has signed (may be repeated)",
    )


def synthesis_options(arguments: argparse.Namespace) -> SynthesisOptions:
    """Return the options that `add_synthesis_arguments` has read."""
    return SynthesisOptions(
        deployment=Deployment(arguments.deployment),
        engine=arguments.engine or "auto",
        allow_livelock=getattr(arguments, "allow_livelock", True),
        allow_reordering=arguments.reorder,
        maximum_nodes=checked_number(arguments.max_nodes, "--max-nodes"),
        verified_states=getattr(arguments, "verify_limit", None),
    )


def _property_texts(arguments: argparse.Namespace) -> tuple[list[SourceFile], list[SourceFile]]:
    """Return the properties that the arguments name: texts with one property each, and files.

    Raises:
        UsageError: A file cannot be read.
        LanguageError: A file is no text.
    """
    texts = [SourceFile(f"property {number}", text) for number, text in enumerate(arguments.property, start=1)]
    return texts, [properties.property_file(path) for path in arguments.properties]


def verify_task(arguments: argparse.Namespace, bundle: Bundle, supervisor: bytes) -> Verify:
    """Return the task that the arguments of `verify` ask for."""
    texts, listings = _property_texts(arguments)
    return Verify(
        model=bundle,
        supervisor=supervisor,
        deployment=None if arguments.deployment is None else Deployment(arguments.deployment),
        properties=tuple(file.text for file in texts),
        property_files=tuple(listings),
        engine=arguments.engine,
        allow_reordering=arguments.reorder,
        maximum_nodes=checked_number(arguments.max_nodes, "--max-nodes"),
        maximum_states=arguments.limit,
        is_strict=arguments.strict,
    )


def _check(arguments: argparse.Namespace, client: Client) -> int:
    from robosc_client.outcomes import outcome_from_response

    check_here.require_synthesis(arguments)
    if automata.is_given(arguments):
        return automata.check(arguments, Server(client, arguments.deadline))

    def make(bundle: Bundle) -> "SynthesisOutcome":
        options = replace(synthesis_options(arguments), allow_livelock=False)
        with ProgressLine() as line:
            found = client.synthesize(bundle, options, deadline_s=arguments.deadline, on_progress=line.report)
        return outcome_from_response(found)

    return check_here.run_with(arguments, lambda bundle: client.check(bundle, deadline_s=arguments.deadline), make)


def _synth(arguments: argparse.Namespace, client: Client) -> int:
    from robosc_client.outcomes import outcome_from_response, require_made_for

    if arguments.output is not None and not arguments.output.name:
        raise UsageError("-o needs a file path")
    if automata.is_given(arguments):
        return automata.synth(arguments, Server(client, arguments.deadline, trusted_keys(arguments)))
    require_other_file(arguments.output, arguments.model)
    keys = trusted_keys(arguments)
    bundle = read_bundle(arguments)
    options = synthesis_options(arguments)
    with ProgressLine() as line:
        found = client.synthesize(
            bundle, options, is_modular=arguments.modular, deadline_s=arguments.deadline, on_progress=line.report
        )
    made = outcome_from_response(found, found.supervisor)
    if made.supervisor is not None:
        require_made_for(made.supervisor, bundle, options.deployment)
        if keys:
            require_signature(keys, found.supervisor, found.signature)
        if arguments.output is not None:
            write_supervisor(arguments.output, found.supervisor, found.signature)
    return report_written(arguments, made, bundle)


def _generate(arguments: argparse.Namespace, client: Client) -> int:
    from robosc_client.outcomes import outcome_from_response

    generation = generate_options(arguments)
    if automata.is_given(arguments):
        model, made = automata.generate(arguments, generation.package, Server(client, arguments.deadline))
        return report_generated(arguments, made, made.files, model)
    refuse_initial(arguments)
    bundle = read_bundle(arguments)
    with ProgressLine() as line:
        found = client.generate(
            bundle,
            arguments.target,
            generation,
            synthesis_options(arguments),
            is_modular=arguments.modular,
            deadline_s=arguments.deadline,
            on_progress=line.report,
        )
    return report_generated(arguments, outcome_from_response(found), found.files, bundle)


def _explore(arguments: argparse.Namespace, client: Client) -> int:
    from robosc.exploration import graph_dot, graph_json, graph_text
    from robosc_client.outcomes import graph_of, outcome_from_response

    if automata.is_given(arguments):
        return automata.explore(arguments, Server(client, arguments.deadline))
    bundle = read_bundle(arguments)
    options, limit = synthesis_options(arguments), checked_number(arguments.limit, "--limit")
    with ProgressLine() as line:
        found = client.explore(
            bundle,
            options,
            maximum_states=limit,
            deadline_s=arguments.deadline,
            on_progress=line.report,
        )
    made = outcome_from_response(found)
    if found.graph is None:
        if arguments.json:
            print_json({"status": str(made.status), **reasons_json(made), **diagnostics_json(made.diagnostics)})
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
    if automata.is_given(arguments):
        return automata.verify(arguments, Server(client, arguments.deadline))
    return run_verify(
        arguments,
        "robosc-client verify",
        lambda arguments: _verify_supervisor(arguments, client),
        lambda arguments: _verify_properties(arguments, client),
    )


def run_verify(
    arguments: argparse.Namespace,
    command: str,
    verify_supervisor: Callable[[argparse.Namespace], int],
    verify_properties: Callable[[argparse.Namespace], int],
) -> int:
    """Run `robosc.cli.verify.run_with` for a command of this program.

    Raises:
        UsageError: As in `run_with`; the message names this command.
    """
    try:
        return verify_here.run_with(arguments, verify_supervisor, verify_properties)
    except UsageError as error:
        raise UsageError(str(error).replace("robosc verify", command)) from error


def _verify_supervisor(arguments: argparse.Namespace, client: Client) -> int:
    from robosc.signatures import SignatureError
    from robosc.supervisor.codec import decode
    from robosc_client.outcomes import require_recheck

    if arguments.limit < 1:
        raise UsageError("--limit must be at least 1 for a server")
    content = read_supervisor(arguments.supervisor)
    bundle = read_bundle(arguments)
    try:
        if arguments.signed_by:
            report_signer(arguments, signer_of(arguments.supervisor, content, arguments.signed_by))
        supervisor = decode(content)
    except (InvalidSupervisorError, SignatureError) as error:
        return report_malformed(arguments, error)
    found = _verified(arguments, client, verify_task(arguments, bundle, content))
    if "properties" in found.report or found.status is VerificationStatus.PROPERTY_ERRORS:
        return _report_verdicts(arguments, found, bundle, supervisor.deployment)
    return verify_here.report_file_verification(arguments, require_recheck(found.report), found.diagnostics, bundle)


def _verify_properties(arguments: argparse.Namespace, client: Client) -> int:
    bundle = read_bundle(arguments)
    if not are_understood(arguments, bundle):
        return ExitCode.USAGE
    arguments.limit = None
    found = _verified(arguments, client, verify_task(arguments, bundle, b""))
    return _report_verdicts(arguments, found, bundle, Deployment(arguments.deployment))


def are_understood(arguments: argparse.Namespace, bundle: Bundle) -> bool:
    """Return True if the properties have no errors; errors are reported before the server is called."""
    from robosc.model.check import check

    model = check(bundle).model
    return model is None or properties.read_properties(arguments, model) is not None


def _verified(arguments: argparse.Namespace, client: Client, task: Verify) -> Verification:
    """Return the server's answer.

    Raises:
        UnsupportedModelError: The model is correct, but cannot be handled.
    """
    with ProgressLine() as line:
        found = client.verify(task, deadline_s=arguments.deadline, on_progress=line.report)
    if found.status is VerificationStatus.UNSUPPORTED_MODEL:
        raise UnsupportedModelError(found.reason)
    return found


def _report_verdicts(
    arguments: argparse.Namespace, found: Verification, bundle: Bundle, deployment: Deployment
) -> ExitCode:
    from robosc_client.outcomes import verdicts_of

    if found.status in (VerificationStatus.PROPERTY_ERRORS, VerificationStatus.NO_SUPERVISOR):
        texts, listings = _property_texts(arguments)
        is_about_model = found.status is VerificationStatus.NO_SUPERVISOR
        files = [*texts, *listings]
        if arguments.json:
            print_json(found.report)
        else:
            print_diagnostics(found.diagnostics, bundle if is_about_model else Bundle(files[0], tuple(files[1:])))
            if found.reason:
                sys.stderr.write(f"{bundle.main.name}: {visible(found.reason)}\n")
        return ExitCode.FAILED if is_about_model else ExitCode.USAGE
    verdicts, system, model = verdicts_of(found.report, bundle, deployment, *_property_texts(arguments))
    status = properties.report_verdicts(arguments, verdicts, system, model)
    if (status is ExitCode.OK) != (found.status is VerificationStatus.PASSED):
        raise malformed("its status contradicts its verdicts")
    return status


def _explain_synthesis(arguments: argparse.Namespace, client: Client) -> int:
    explain_here.refuse_modular(arguments)
    if automata.is_given(arguments):
        return automata.explain_synthesis(arguments, Server(client, arguments.deadline))

    def explain(bundle: Bundle) -> Explained:
        with ProgressLine() as line:
            return client.explain(
                bundle,
                synthesis_options(arguments),
                event=arguments.event,
                state=arguments.state,
                after=arguments.after,
                is_modular=arguments.modular,
                deadline_s=arguments.deadline,
                on_progress=line.report,
            )

    return explain_here.run_with(arguments, explain)


def _format(arguments: argparse.Namespace, client: Client) -> int:
    return format_here.run_with(arguments, formatter(arguments, client))


def formatter(arguments: argparse.Namespace, client: Client) -> Callable[[str, str], str]:
    """Return a function that formats a named text on the server; it raises LanguageError for syntax errors."""

    def format_text(text: str, name: str) -> str:
        found = client.format(SourceFile(name, text), deadline_s=arguments.deadline)
        if found.text is None:
            raise LanguageError(found.diagnostics)
        return found.text

    return format_text
