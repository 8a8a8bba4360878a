"""`robosc generate`: a deployable package around the supervisor of a model."""

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from robosc.cli import synth
from robosc.cli.arguments import (
    add_deployment_argument,
    add_engine_options,
    add_livelock_argument,
    add_model_arguments,
    read_bundle,
)
from robosc.cli.output import ExitCode, diagnostics_json, print_json
from robosc.source import Bundle

if TYPE_CHECKING:
    from robosc.supervisor import Made
    from robosc.targets import GeneratedFiles


class _ListTargets(argparse.Action):
    """`--list-targets`: print what can be generated and leave, without a model."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object, **__: object) -> None:
        from robosc.targets import available_targets

        for target in available_targets():
            sys.stdout.write(f"{target.name:10} {target.description}\n")
        parser.exit()


def add_parser(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command."""
    parser = commands.add_parser(
        "generate",
        help="generate a package that runs the supervisor",
        description="Synthesize the supervisor of a model and write a complete package that runs it.",
    )
    add_model_arguments(parser)
    add_generate_arguments(parser)
    add_deployment_argument(parser)
    add_engine_options(parser)
    add_livelock_argument(parser)
    parser.set_defaults(run=run)


def add_generate_arguments(parser: argparse.ArgumentParser) -> None:
    """What to generate, and where to."""
    parser.add_argument(
        "--target",
        required=True,
        metavar="NAME",
        help="what to generate: see --list-targets; in c99 the policy random draws another sequence than in Python",
    )
    parser.add_argument("--list-targets", action=_ListTargets, nargs=0, help="list what can be generated")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="DIR", help="folder to write to")
    parser.add_argument("--force", action="store_true", help="overwrite generated files even where you changed them")


def run(arguments: argparse.Namespace) -> int:
    """Synthesize, generate and write; 0 if files were written."""
    from robosc.targets import generate, judged_for, require_target

    require_target(arguments.target)
    bundle = read_bundle(arguments)
    made = judged_for(synth.make(arguments, bundle, allow_livelock=arguments.allow_livelock), arguments.target)
    files = generate(made.supervisor, arguments.target) if made.supervisor else None
    return report_generated(arguments, made, files, bundle)


def report_generated(
    arguments: argparse.Namespace, made: "Made", files: "GeneratedFiles | None", bundle: Bundle
) -> ExitCode:
    """Write the files, print the outcome as asked and return the exit status."""
    from robosc.targets import write_files

    written: list[str] = []
    if files is not None:
        written = [str(path) for path in write_files(files, arguments.output, force=arguments.force)]
    if arguments.json:
        print_json(
            {
                "status": str(made.status),
                **synth.reasons_json(made),
                "target": arguments.target,
                "folder": str(arguments.output),
                "files": written,
                **diagnostics_json(made.diagnostics),
            }
        )
    else:
        synth.report_problems(made, bundle)
        for path in written:
            sys.stdout.write(f"{path}\n")
    return ExitCode.OK if files is not None else ExitCode.FAILED
