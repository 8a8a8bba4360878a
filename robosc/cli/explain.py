"""`robosc explain`: what a diagnostic code means, with an example of it and how to fix it."""

import argparse
import sys

from robosc.cli.arguments import suggest
from robosc.cli.output import ExitCode, UsageError, print_json


def add_parser(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command."""
    parser = commands.add_parser(
        "explain",
        help="explain a diagnostic code",
        description="Explain a code such as unknown-name, which 'robosc check' prints in brackets: what is wrong, "
        "why it matters for the robot, an example, and how to fix it.",
    )
    what = parser.add_mutually_exclusive_group(required=True)
    code = what.add_argument("code", nargs="?", metavar="CODE", help="the code to explain, e.g. unknown-name")
    suggest(code, _codes)
    what.add_argument("--list", action="store_true", help="print every code with its severity and one line")
    what.add_argument("--all", action="store_true", help="print everything about every code as one Markdown document")
    parser.add_argument("--json", action="store_true", help="print one JSON document for machines")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Print the page of a code, the list of codes, or all pages.

    Raises:
        UsageError: There is no such code.
    """
    from robosc.diagnostics import document, pages

    if arguments.list:
        if arguments.json:
            print_json({"codes": [item.head_json() for item in pages()]})
        else:
            sys.stdout.write(_table())
    elif arguments.all:
        if arguments.json:
            print_json({"codes": [item.to_json() for item in pages()]})
        else:
            sys.stdout.write(document())
    else:
        _explain(arguments.code, as_json=arguments.json)
    return ExitCode.OK


def _codes() -> list[str]:
    from robosc.diagnostics import pages

    return [item.code for item in pages()]


def _explain(code: str, *, as_json: bool) -> None:
    from robosc.diagnostics import UnknownCodeError, page

    try:
        found = page(code)
    except UnknownCodeError as error:
        raise UsageError(str(error)) from error
    if as_json:
        print_json(found.to_json())
    else:
        sys.stdout.write(found.markdown)


def _table() -> str:
    from robosc.diagnostics import pages

    found = pages()
    width = max(len(item.code) for item in found)
    rows = (f"{item.code:<{width}}  {item.severity:<7}  {item.summary}" for item in found)
    return "".join(f"{row}\n" for row in rows)
