"""`robosc generate`: a deployable package around the supervisor of a model."""

import argparse
import sys
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from robosc.certification.reasons import reasons_json
from robosc.cli import automata, synth
from robosc.cli.arguments import (
    add_deployment_argument,
    add_engine_options,
    add_livelock_argument,
    add_model_arguments,
    given_path,
    read_bundle,
    suggest,
)
from robosc.cli.output import ExitCode, UsageError, print_json
from robosc.errors import UnsupportedModelError
from robosc.json_documents import diagnostics_json
from robosc.model.structure import Deployment
from robosc.source import Bundle

if TYPE_CHECKING:
    from robosc.targets import GeneratedFiles, GenerateOptions, PackageMetadata

WRITTEN = "the files are written"
NOT_WRITTEN = """\
nothing is written: the model has errors, no supervisor exists, the target cannot do the model, or files were
     changed since they were generated, or are not of RoboSC, and would be overwritten (see --force)"""
"""Meaning of the exit statuses 0 and 1."""

_WITH_TYPED_STATE = ("ros2", "ros2-cpp")
"""Targets whose nodes can publish their state as a typed message."""

_PLACEHOLDER = '<maintainer email="maintainer@example.org">Maintainer</maintainer>'
"""Maintainer in the `package.xml` of a package whose user named none."""

_EPILOG = f"exit status:\n  0  {WRITTEN}\n  1  {NOT_WRITTEN}\n  2  wrong use\n"


class _ListTargets(argparse.Action):
    """`--list-targets`: what can be generated is listed instead, for which nothing else is needed, and no server."""

    def __call__(
        self, parser: argparse.ArgumentParser, namespace: argparse.Namespace, values: Any, option: str | None = None
    ) -> None:
        for action in parser._actions:
            action.required = False
        namespace.run = namespace.run_alone = _list_targets


class _OneTarget(argparse.Action):
    """`--target`: one, or all."""

    def __call__(
        self, parser: argparse.ArgumentParser, namespace: argparse.Namespace, values: Any, option: str | None = None
    ) -> None:
        if getattr(namespace, self.dest) is not None:
            raise argparse.ArgumentError(self, "may be given once; all is for all of them")
        setattr(namespace, self.dest, values)


def _target_names() -> list[str]:
    from robosc.targets import ALL, available_targets

    return [*(target.name for target in available_targets()), ALL]


def _list_targets(arguments: argparse.Namespace) -> int:
    from robosc.targets import ALL, TargetInfo, available_targets

    targets = (*available_targets(), TargetInfo(ALL, "all of them, each in a folder of its own"))
    if arguments.json:
        print_json({"targets": [{"name": target.name, "description": target.description} for target in targets]})
    else:
        sys.stdout.write("".join(f"{target.name:10} {target.description}\n" for target in targets))
    return ExitCode.OK


def add_parser(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command."""
    parser = commands.add_parser(
        "generate",
        help="generate a package that runs the supervisor",
        description="Synthesize the supervisor of a model and write a complete package that runs it. Of automata "
        "(FILE.cif, .gen, .wmod), --target c99 and python write a library, and --target cif the controlled system.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add_model_arguments(parser)
    add_generate_arguments(parser)
    add_deployment_argument(parser)
    add_engine_options(parser)
    add_livelock_argument(parser)
    parser.set_defaults(run=run)


def add_generate_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments for what to generate, and where to."""
    target = parser.add_argument(
        "--target",
        action=_OneTarget,
        required=True,
        metavar="NAME",
        help="target to generate: see --list-targets; all for every one",
    )
    suggest(target, _target_names)
    parser.add_argument("--list-targets", action=_ListTargets, nargs=0, help="list what can be generated")
    parser.add_argument(
        "-o",
        "--output",
        type=given_path,
        metavar="DIR",
        help="folder to write to (default: the target's in outputLocations or output of controller-config.json beside "
        "the model)",
    )
    parser.add_argument(
        "--package",
        metavar="NAME",
        help="name of the generated package, in lower-case letters, digits and underscores (default: made from the "
        "robot's name)",
    )
    parser.add_argument(
        "--maintainer",
        metavar="NAME",
        help="maintainer of a generated ROS package, as 'Jane Doe <jane@example.org>' (default: maintainer of "
        "controller-config.json)",
    )
    parser.add_argument(
        "--license",
        metavar="NAME",
        help="licence of a generated ROS package, such as Apache-2.0 (default: license of controller-config.json; MIT)",
    )
    parser.add_argument(
        "--copyright",
        metavar="TEXT",
        help="copyright of a generated ROS package, as '2026 Jane Doe' (default: copyright of controller-config.json; "
        "the maintainer)",
    )
    parser.add_argument(
        "--package-version",
        metavar="X.Y.Z",
        help="version of a generated ROS package (default: version of controller-config.json; that of RoboSC)",
    )
    parser.add_argument(
        "--state-message",
        choices=("json", "typed", "both"),
        help="form of the state of a generated ROS 2 node (ros2, ros2-cpp): json, a text on the topic state; typed, a "
        "message of the package robosc_msgs (--target ros2-msgs) on ~/state; both (default: stateMessage of "
        "controller-config.json; json). Nodes for ROS 1 have the text only",
    )
    add_initial_argument(parser)
    synth.add_modular_argument(parser)
    parser.add_argument("--force", action="store_true", help="overwrite generated files even where you changed them")


def add_initial_argument(parser: argparse.ArgumentParser) -> None:
    """Add the option for where automata begin."""
    parser.add_argument(
        "--initial",
        metavar="STATE",
        help="state in which automata begin that may begin in several: 'p.x = 1, q = on'",
    )


def run(arguments: argparse.Namespace) -> int:
    """Synthesize, generate and write; 0 if files were written."""
    from robosc.pipeline.generating import generation_of
    from robosc.targets import require_generatable

    require_generatable(arguments.target)
    options = generate_options(arguments)
    if automata.is_given(arguments):
        model, made = automata.generate(arguments, options.package)
        return report_generated(arguments, made, made.files, model)
    refuse_initial(arguments)
    bundle = read_bundle(arguments)
    outcome = synth.make(arguments, bundle, allow_livelock=arguments.allow_livelock, is_modular=arguments.modular)
    generation = generation_of(outcome, arguments.target, options)
    return report_generated(arguments, generation, generation.files, bundle)


def refuse_initial(arguments: argparse.Namespace) -> None:
    """Do nothing unless a robot is to begin elsewhere.

    Raises:
        UsageError: It is.
    """
    if arguments.initial is not None:
        raise UsageError("--initial chooses where automata begin: a robot begins in one state")


def generate_options(arguments: argparse.Namespace) -> "GenerateOptions":
    """Return the options for the target; the folder to write to is set where it is not given.

    Raises:
        UsageError: The package cannot be called so, or cannot have such a maintainer, licence, version or copyright, an
            option is for other targets, the file beside the model cannot be used, or there is no folder to write to.
    """
    from robosc.targets import CONFIG_FILE, ControllerConfigError, StateMessage, read_controller_config
    from robosc.targets.code.naming import require_package_name

    _refuse_options_of_others(arguments)
    try:
        if arguments.package is not None:
            require_package_name(arguments.package)
    except UnsupportedModelError as error:
        raise UsageError(str(error)) from error
    try:
        config = read_controller_config(arguments.model.parent)
    except ControllerConfigError as error:
        raise UsageError(str(error)) from error
    for warning in config.warnings:
        sys.stderr.write(f"warning: {warning}\n")
    if arguments.output is None:
        arguments.output = config.location(arguments.target, Deployment(arguments.deployment))
    if arguments.output is None:
        raise UsageError(f"no folder to write to: -o DIR, or outputLocations.{arguments.target} of {CONFIG_FILE}")
    options = config.options(arguments.package)
    return replace(
        options,
        metadata=_metadata(arguments, options.metadata),
        state_message=StateMessage(arguments.state_message or options.state_message),
    )


def _refuse_options_of_others(arguments: argparse.Namespace) -> None:
    """Refuse options that would do nothing for the target."""
    from robosc.targets import ALL

    target = arguments.target
    about_packages = {
        "--maintainer": arguments.maintainer,
        "--license": arguments.license,
        "--package-version": arguments.package_version,
        "--copyright": arguments.copyright,
    }
    for option, value in about_packages.items():
        if value is not None and target != ALL and not target.startswith("ros"):
            raise UsageError(f"{option} is for ROS packages, and --target {target} makes none: leave it out")
    _choose_distribution(arguments)
    if arguments.state_message not in (None, "json") and target not in (ALL, *_WITH_TYPED_STATE):
        raise UsageError(
            f"--state-message {arguments.state_message} is for --target {' and '.join(_WITH_TYPED_STATE)}: of "
            f"{target}, no node publishes a typed state; leave it out"
        )


def _choose_distribution(arguments: argparse.Namespace) -> None:
    """Refuse a distribution of the other ROS than the target's; one that was only sourced is left aside."""
    from robosc.interfaces import distribution_of
    from robosc.language.interfaces import sourced_distribution

    target = arguments.target
    version = next((number for number in (1, 2) if target.startswith(f"ros{number}")), None)
    found = distribution_of(sourced_distribution() if arguments.distribution is None else arguments.distribution)
    if version is None or found is None or found.version == version:
        return
    if arguments.distribution is not None:
        raise UsageError(
            f"--distribution {found.codename} is of ROS {found.version}, and --target {target} makes a package for ROS "
            f"{version}: leave it out"
        )
    arguments.distribution = ""


def _metadata(arguments: argparse.Namespace, found: "PackageMetadata") -> "PackageMetadata":
    """Return what the command line says of a package, and what the file says where it says nothing."""
    given = {"license": arguments.license, "version": arguments.package_version, "copyright": arguments.copyright}
    try:
        if arguments.maintainer is not None:
            found = found.with_maintainer(arguments.maintainer)
        return replace(found, **{name: text for name, text in given.items() if text is not None})
    except ValueError as error:
        raise UsageError(str(error)) from error


def report_generated(
    arguments: argparse.Namespace, outcome: synth.Outcome, files: "GeneratedFiles | None", bundle: Bundle
) -> ExitCode:
    """Write the files, print the outcome as asked and return the exit status."""
    from robosc.targets import CONFIG_FILE, Written, write_generated

    done = Written(())
    if files is not None:
        done = write_generated(files, arguments.target, arguments.output, force=arguments.force)
    written, left_out, removal = [str(path) for path in done.files], done.left_out, done.removal
    if arguments.json:
        print_json(
            {
                "status": str(outcome.status),
                **reasons_json(outcome),
                "target": arguments.target,
                "folder": str(arguments.output),
                "files": written,
                "left_out": list(left_out),
                "removed": [str(path) for path in removal.removed],
                "kept": [str(path) for path in removal.kept],
                **diagnostics_json(outcome.diagnostics),
            }
        )
    else:
        synth.report_problems(outcome, bundle)
        for path in written:
            sys.stdout.write(f"{path}\n")
        if left_out:
            sys.stderr.write(f"not generated: {', '.join(left_out)}; README.md says why\n")
        for place in removal.removed:
            sys.stderr.write(f"removed, because it was of an earlier model: {place}\n")
        for place in removal.kept:
            sys.stderr.write(f"not removed, because changed since generated; it is of an earlier model: {place}\n")
        if files is not None and any(_PLACEHOLDER in text for text in files.values()):
            sys.stderr.write(
                "note: package.xml has a placeholder for its maintainer: give --maintainer "
                f"'Jane Doe <jane@example.org>', or maintainer in {CONFIG_FILE}\n"
            )
    return ExitCode.OK if files is not None else ExitCode.FAILED
