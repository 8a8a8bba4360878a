"""Commands beside serving: `robosc-server health`, `token`, `tokens`, `check-config` and `example-config`."""

import argparse
import json
import sys
from collections.abc import Callable, Sequence
from typing import Any

from robosc.cli.running import Parser, guarded, parse
from robosc_api.security import (
    Scope,
    SecurityError,
    add_token_arguments,
    add_tokens_arguments,
    issue_token,
    run_tokens,
)
from robosc_server.operations.settings import Settings, default_text, format_value
from robosc_server.operations.settings_reference import example_file
from robosc_server.operations.settings_sources import (
    SettingsError,
    add_settings_arguments,
    config_file_of,
    make_parser,
    settings_of,
    source_of,
)

_CHECK_EPILOG = """\
exit status:
  0  the server can start (there may be warnings)
  1  the server cannot start
  2  wrong options or settings
"""


def run_command(words: Sequence[str]) -> int | None:
    """Run a command line that begins with a command.

    Args:
        words: Words after the program's name.

    Returns:
        The exit status; None: the command line begins with no command, so the server is to serve.
    """
    commands: dict[str, Callable[[Sequence[str]], int]] = {
        "health": _health,
        "token": _new_token,
        "tokens": _keep_tokens,
        "check-config": _check_config,
        "example-config": _print_example,
    }
    command = commands.get(words[0]) if words else None
    if command is None:
        return None
    return guarded("robosc-server", lambda: command(words[1:]), as_json="--json" in words)


def make_whole_parser() -> Parser:
    """Return the parser of all command lines, for completion in shells; each command has a parser of its own, too."""
    from robosc_server.operations import health_check

    parser = make_parser()
    commands = parser.add_subparsers(metavar="COMMAND")
    for made in (health_check.make_parser(), _token_parser(), _tokens_parser(), _check_parser(), _example_parser()):
        name = made.prog.rpartition(" ")[2]
        commands.add_parser(name, parents=[made], add_help=False, help=made.description)
    return parser


def _health(argv: Sequence[str]) -> int:
    from robosc_server.operations.health_check import main

    return main(argv)


def _token_parser() -> Parser:
    parser = Parser(prog="robosc-server token", description="Create a token for a caller.", allow_abbrev=False)
    add_token_arguments(parser, (Scope.SYNTHESIZE,), has_quotas=True)
    return parser


def _new_token(argv: Sequence[str]) -> int:
    """Print a new token, and its line for the token file to standard error; returns the exit status."""
    arguments = _token_parser().parse_args(argv)
    try:
        token, line = issue_token(arguments)
    except SecurityError as error:
        sys.stderr.write(f"robosc-server: {error}\n")
        return 2
    sys.stdout.write(token)
    # Print the line only after the token was written.
    sys.stdout.flush()
    if arguments.scope and Scope.SYNTHESIZE not in arguments.scope:
        # A comment, since the output may be appended to the token file.
        sys.stderr.write(
            f"# warning: the token cannot be used with this server: it lacks the scope '{Scope.SYNTHESIZE}'\n"
        )
    sys.stderr.write(line)
    return 0


def _tokens_parser() -> Parser:
    parser = Parser(
        prog="robosc-server tokens",
        description="Keep the token file of a server, which reads it again within a second after a change.",
        allow_abbrev=False,
    )
    add_tokens_arguments(parser, (Scope.SYNTHESIZE,), has_quotas=True)
    return parser


def _keep_tokens(argv: Sequence[str]) -> int:
    """List, add, rotate or revoke tokens of a file; returns the exit status."""
    return run_tokens(parse(_tokens_parser(), argv))


def _example_parser() -> Parser:
    return Parser(
        prog="robosc-server example-config",
        description="Print a settings file that has the description and default of each setting as comments.",
        allow_abbrev=False,
    )


def _print_example(argv: Sequence[str]) -> int:
    """Print a file with every setting; returns the exit status."""
    _example_parser().parse_args(argv)
    sys.stdout.write(example_file())
    return 0


def _check_parser() -> Parser:
    parser = Parser(
        prog="robosc-server check-config",
        description="Check whether a server can start with these settings: address, certificates, tokens, database and "
        "workers. Nothing is started, created or changed.",
        epilog=_CHECK_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.add_argument("--json", action="store_true", help="print one JSON document: ok, settings, findings, problems")
    add_settings_arguments(parser)
    return parser


def _check_config(argv: Sequence[str]) -> int:
    """Print whether a server could start with such settings; returns the exit status."""
    # The database's library takes longer to import than other commands take in all.
    from robosc_server.operations.config_check import CheckGrade, check_settings

    arguments = _check_parser().parse_args(argv)
    try:
        settings = settings_of(arguments)
    except SettingsError as error:
        if not arguments.json:
            return error.report()
        _print_json({"ok": False, "settings": {}, "findings": [], "problems": list(error.problems)})
        return 2
    findings = check_settings(settings)
    is_ok = all(finding.grade is not CheckGrade.ERROR for finding in findings)
    if arguments.json:
        _print_json(
            {
                "ok": is_ok,
                "settings": _settings_document(settings, arguments),
                "findings": [
                    {"part": finding.part, "grade": finding.grade, "message": finding.message} for finding in findings
                ],
                "problems": [],
            }
        )
    else:
        lines = [f"{finding.grade:<8} {finding.part}: {finding.message}\n" for finding in findings]
        sys.stdout.write("".join(lines))
    return 0 if is_ok else 1


def _settings_document(settings: Settings, arguments: argparse.Namespace) -> dict[str, Any]:
    """Return the value of each setting, and where it comes from."""
    document = {}
    config = config_file_of(arguments)
    for name in Settings.model_fields:
        value = getattr(settings, name)
        is_set = name in settings.model_fields_set
        document[name] = {
            "value": _json_value(name, value),
            "source": source_of(name, vars(arguments), config) if is_set else "default",
            "default": default_text(name),
        }
    return document


def _json_value(name: str, value: Any) -> Any:
    if value is None or isinstance(value, bool | int | float):
        return value
    # The URL may hold a password.
    return "set, not shown" if name == "database_url" else format_value(name, value)


def _print_json(document: dict[str, Any]) -> None:
    sys.stdout.write(json.dumps(document, indent=2) + "\n")
