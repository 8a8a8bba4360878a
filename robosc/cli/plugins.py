"""Commands of other packages: installed distributions add them through the entry-point group `robosc.commands`.

The name of an entry point is the name of the command. Its value is a module with `add_parser` and `run`, like the
modules of this package. Entry points are looked up only if no built-in command is called, and a module is loaded only
if its command is called or all commands are listed.
"""

import argparse
from collections.abc import Callable, Collection, Sequence
from types import ModuleType
from typing import TYPE_CHECKING, Any

import msgspec

from robosc.cli.output import UsageError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

ENTRY_POINT_GROUP = "robosc.commands"

_HELP = ("-h", "--help")


class Plugin(msgspec.Struct, frozen=True):
    """A command of another package.

    Attributes:
        name: Name by which it is called.
        module: Its module, or None where that cannot be loaded.
        problem: Reason why not, in one sentence.
    """

    name: str
    module: ModuleType | None
    problem: str = ""

    def add_parser(self, commands: "argparse._SubParsersAction[Any]") -> None:
        """Add the command; one that cannot be loaded takes any arguments and says why."""
        if self.module is not None:
            self.module.add_parser(commands)
            parser = commands.choices.get(self.name)
            if parser is not None:
                parser.set_defaults(run=_naming_missing_package(self.name, self.module.run))
            return
        parser = commands.add_parser(
            self.name, help="not available: " + self.problem.replace("%", "%%"), add_help=False, prefix_chars="\0"
        )
        parser.add_argument("anything", nargs="*")
        parser.set_defaults(run=self._refuse)

    def _refuse(self, arguments: argparse.Namespace) -> int:
        raise UsageError(self.problem)


def wanted_plugins(argv: Sequence[str], built_in: Collection[str]) -> tuple[Plugin, ...]:
    """The commands of other packages that matter for some arguments: all for help, and where no such command exists.

    Args:
        argv: The arguments.
        built_in: Names of the built-in commands, which no package can replace.
    """
    word = argv[0] if argv else _HELP[0]
    is_help = word in _HELP or (len(word) > len("--") and "--help".startswith(word))
    if word in built_in or (word.startswith("-") and not is_help):
        return ()
    from importlib.metadata import entry_points

    found = {item.name: item for item in entry_points(group=ENTRY_POINT_GROUP) if item.name not in built_in}
    chosen = [found[word]] if word in found else [found[name] for name in sorted(found)]
    return tuple(map(_loaded, chosen))


def _loaded(item: "EntryPoint") -> Plugin:
    try:
        module = item.load()
    except ModuleNotFoundError as error:
        return Plugin(item.name, None, _missing(item.name, error))
    except Exception as error:
        # Packages of others must not take the built-in commands with them.
        return Plugin(item.name, None, f"'robosc {item.name}' cannot be loaded: {_one_line(error)}")
    if not (callable(getattr(module, "add_parser", None)) and callable(getattr(module, "run", None))):
        return Plugin(item.name, None, f"'robosc {item.name}' cannot be loaded: {item.value} is not a command")
    return Plugin(item.name, module)


def _naming_missing_package(name: str, run: Callable[[argparse.Namespace], int]) -> Callable[[argparse.Namespace], int]:
    """The command, with a clear message if a package is missing when it runs."""

    def guarded(arguments: argparse.Namespace) -> int:
        try:
            return run(arguments)
        except ModuleNotFoundError as error:
            raise UsageError(_missing(name, error)) from error

    return guarded


def _missing(name: str, error: ModuleNotFoundError) -> str:
    package = (error.name or str(error)).partition(".")[0]
    return f"'robosc {name}' needs the package {package}, which is not installed"


def _one_line(error: Exception) -> str:
    return (" ".join(str(error).split()) or type(error).__name__)[:200]
