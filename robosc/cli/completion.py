"""`robosc completion`: scripts by which bash, zsh and fish complete the product's commands.

shtab makes a script of a program's argument parser, so that a shell starts no Python when the Tab key is pressed. The
values of an argument are its choices, its suggestions (`robosc.cli.arguments.suggest`) or files, by its placeholder.
"""

import argparse
import os
import sys
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from robosc.cli.output import ExitCode, UsageError, write_bytes

ENTRY_POINT_GROUP = "robosc.programs"
"""Programs beside `robosc`: the entry point's name is the program's, its value a function that makes its parser."""

SHELLS = ("bash", "zsh", "fish")

_FILES = {
    "MODEL": ("*.rscd",),
    "files": ("*.rscd",),
    "--config": ("*.yaml", "*.yml", "*.toml"),
    "--model": ("*.rscd", "*.rsup"),
    "LOG": ("*.jsonl",),
    "supervisor": ("*.rsup", "*.rscd"),
}
"""Patterns of files, by the option, the name or the placeholder of an argument."""

_EPILOG = """\
With --install, the scripts are written to where the shell looks for those of the user; do it again after an update of
RoboSC. For one shell only:

  eval "$(robosc completion bash)"
  eval "$(robosc completion zsh)"       # after compinit
  robosc completion fish | source
"""


def add_parser(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command."""
    parser = commands.add_parser(
        "completion",
        help="complete commands in bash, zsh and fish with the Tab key",
        description="Print the script by which a shell completes robosc, robosc-client, robosc-bridge, robosc-server "
        "and robosc-lsp: commands, options, files, targets, diagnostic codes and names.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("shell", choices=SHELLS, help="the shell")
    parser.add_argument(
        "--install", action="store_true", help="write the scripts to the user's folder for them, and print their paths"
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Print or install the scripts.

    Raises:
        UsageError: They cannot be written.
    """
    scripts = make_scripts(arguments.shell)
    if not arguments.install:
        sys.stdout.write("\n".join(scripts.values()))
        return ExitCode.OK
    folder = script_folder(arguments.shell, os.environ)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(f"cannot write {folder}: {error.strerror or error}") from error
    for program, script in scripts.items():
        path = folder / _file_name(arguments.shell, program)
        write_bytes(path, script.encode())
        sys.stdout.write(f"{path}\n")
    sys.stderr.write(_next_step(arguments.shell, folder))
    return ExitCode.OK


def script_folder(shell: str, environment: Mapping[str, str]) -> Path:
    """Return the folder in which a shell looks for the scripts of a user, or can be configured to look.

    Args:
        shell: One of `SHELLS`.
        environment: Variables of the environment.
    """
    home = Path(environment.get("HOME") or Path.home())
    data = Path(environment.get("XDG_DATA_HOME") or home / ".local" / "share")
    if shell == "bash":
        return Path(environment.get("BASH_COMPLETION_USER_DIR") or data / "bash-completion") / "completions"
    if shell == "zsh":
        return data / "zsh" / "site-functions"
    return Path(environment.get("XDG_CONFIG_HOME") or home / ".config") / "fish" / "completions"


def _file_name(shell: str, program: str) -> str:
    return {"bash": program, "zsh": f"_{program}", "fish": f"{program}.fish"}[shell]


def _next_step(shell: str, folder: Path) -> str:
    if shell == "bash":
        return "They are used in new shells, where the package bash-completion is installed and loaded.\n"
    if shell == "zsh":
        return f"Put this before compinit in ~/.zshrc, if it is not there yet:\n  fpath=({folder} $fpath)\n"
    return "They are used in all shells from now on.\n"


def make_scripts(shell: str) -> dict[str, str]:
    """Return the script of each installed program, by its name.

    A program whose packages are not installed is left out, and named on standard error.

    Args:
        shell: One of `SHELLS`.
    """
    import shtab

    scripts = {}
    for program, parser in _parsers():
        _prepare(parser, shtab)
        text: str = shtab.complete(parser, shell)
        scripts[program] = text.rstrip("\n") + "\n"
    return scripts


def _parsers() -> Iterable[tuple[str, argparse.ArgumentParser]]:
    """The programs with their parsers, `robosc` first."""
    from importlib.metadata import entry_points

    from robosc.cli.main import make_whole_parser

    yield "robosc", make_whole_parser()
    for item in sorted(entry_points(group=ENTRY_POINT_GROUP), key=lambda item: item.name):
        try:
            yield item.name, item.load()()
        except ModuleNotFoundError as error:
            package = (error.name or str(error)).partition(".")[0]
            sys.stderr.write(f"{item.name} is left out: the package {package} is not installed\n")


def _prepare(parser: argparse.ArgumentParser, shtab: Any) -> None:
    """Set for shtab the possible values of the arguments of a parser and of its commands."""
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for command in dict.fromkeys(action.choices.values()):
                _prepare(command, shtab)
        elif action.choices is None and action.nargs != 0:
            _prepare_value(action, shtab)


def _prepare_value(action: Any, shtab: Any) -> None:
    known = getattr(action, "suggestions", None)
    placeholder = action.metavar[0] if isinstance(action.metavar, tuple) else action.metavar or ""
    if known is not None:
        # Listing the values may need an extra that is not installed: then none is offered.
        with suppress(ModuleNotFoundError):
            action.choices = tuple(known())
    elif "|" in placeholder and placeholder.islower():
        action.choices = placeholder.split("|")
    else:
        kind = _kind((*action.option_strings, action.dest), placeholder, shtab)
        if kind is not None:
            action.complete = kind


def _kind(names: Sequence[str], placeholder: str, shtab: Any) -> Any:
    """The kind of file that an argument names; None: it names none."""
    for word in (*names, placeholder):
        if word in _FILES:
            return _matching(shtab, *_FILES[word])
    words = placeholder.split("|")
    if "FILE" in words or "PATH" in words:
        return shtab.FILE
    if placeholder.startswith("FILE."):
        return _matching(shtab, "*" + placeholder.removeprefix("FILE"))
    return shtab.DIRECTORY if placeholder in ("DIR", "FOLDER") else None


def _matching(shtab: Any, *patterns: str) -> Any:
    # zsh takes a pattern that is one group for qualifiers of a pattern: those of shtab match nothing there.
    return {**shtab.glob(*patterns), "zsh": f"_files -g '{' '.join(patterns)}'"}
