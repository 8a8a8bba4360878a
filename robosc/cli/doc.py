"""`robosc doc`: a page about a robot for people to read."""

import argparse
import sys

from robosc.cli.arguments import add_model_arguments, given_path, read_bundle
from robosc.cli.output import ExitCode, print_diagnostics, print_json, write_bytes
from robosc.json_documents import diagnostics_json


def add_parser(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command."""
    parser = commands.add_parser(
        "doc",
        help="write a page with tables and diagrams of a robot",
        description="Write a Markdown page about a robot: components as state diagrams (Mermaid), communications and "
        "data types as tables, requirements and data of requests as sentences.",
    )
    add_model_arguments(parser)
    parser.add_argument(
        "-o",
        "--output",
        type=given_path,
        metavar="FILE.md",
        help="write the page to this file (default: standard output)",
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Check the model and write its page; 0 with a page, 1 if the model has errors or is a library."""
    from robosc.documentation import page
    from robosc.errors import LanguageError
    from robosc.model.check import check

    bundle, text = None, None
    try:
        bundle = read_bundle(arguments)
        checked = check(bundle)
        diagnostics = checked.diagnostics
        text = page(checked.model_or_raise(), diagnostics)
    except LanguageError as error:
        diagnostics = error.diagnostics
    if text is not None and arguments.output is not None:
        write_bytes(arguments.output, text.encode("utf-8"))
    if arguments.json:
        file = str(arguments.output) if text is not None and arguments.output else None
        print_json({"page": text, "file": file, **diagnostics_json(diagnostics)})
    else:
        print_diagnostics(diagnostics, bundle)
        if text is not None:
            sys.stdout.write(text if arguments.output is None else f"{arguments.output}\n")
    return ExitCode.OK if text is not None else ExitCode.FAILED
