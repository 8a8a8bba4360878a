"""Arguments that several commands share."""

import argparse
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from robosc.cli.output import UsageError
from robosc.cli.running import Parser as Parser  # for those who add commands
from robosc.model.structure import Deployment
from robosc.source import Bundle

if TYPE_CHECKING:
    from robosc.synthesis import EngineOptions
MAXIMUM_LIMIT = 10**9
"""States beyond which no machine could search one by one."""

SYNTHESIS_STATES = 200_000
"""States up to which the result of a synthesis is verified one by one: some seconds."""


def given_path(text: str) -> Path:
    """A file or folder that an argument names.

    Raises:
        argparse.ArgumentTypeError: It is empty, such as a variable that is not set; that is no name of this folder.
    """
    if not text:
        raise argparse.ArgumentTypeError("the name of a file or folder is empty")
    return Path(text)


def add_log_arguments(parser: argparse.ArgumentParser, output_help: str) -> None:
    """Add the event log that a command reads, and the file that it writes."""
    parser.add_argument("log", type=given_path, metavar="LOG", help="the event log, a file of JSON Lines")
    parser.add_argument("-o", "--output", type=given_path, metavar="FILE", help=output_help)


def suggest(action: argparse.Action, values: Callable[[], Iterable[str]]) -> None:
    """Set what a shell suggests for an argument that also takes other values.

    Args:
        action: The argument.
        values: Function that returns the values when the script for the shell is made.
    """
    action.suggestions = values  # type: ignore[attr-defined]


def add_model_arguments(
    parser: argparse.ArgumentParser, json_help: str = "print one JSON document for machines"
) -> None:
    """The model, its library folders and `--json`."""
    parser.add_argument("model", type=given_path, metavar="MODEL", help="the model's file, e.g. robot.rscd")
    parser.add_argument(
        "-L",
        "--library-path",
        action="append",
        default=[],
        type=given_path,
        metavar="DIR",
        help="another folder with libraries (may be repeated; always searched: the model's folder and its ../shared)",
    )
    parser.add_argument(
        "-I",
        "--interface-path",
        action="append",
        default=[],
        type=given_path,
        metavar="DIR",
        help="another folder with ROS packages whose .msg, .srv and .action files the model is checked against (may be "
        "repeated; always searched: an installed ROS, packages around the model, and common ones of RoboSC itself)",
    )
    add_distribution_argument(parser)
    parser.add_argument("--json", action="store_true", help=json_help)


def add_distribution_argument(
    parser: argparse.ArgumentParser, help_: str = "ROS distribution against whose interfaces the model is checked"
) -> None:
    """Add the option for a ROS distribution."""
    from robosc.interfaces import CODENAMES

    parser.add_argument(
        "--distribution",
        choices=CODENAMES,
        metavar="NAME",
        help=f"{help_}: {', '.join(CODENAMES)} (default: the sourced one, else jazzy)",
    )


def add_deployment_argument(parser: argparse.ArgumentParser) -> None:
    """Add the option for the deployment of the supervisor."""
    parser.add_argument(
        "--deployment",
        choices=[str(deployment) for deployment in Deployment],
        default=str(Deployment.CONTROLLER),
        help="controller: it decides itself; layer: it filters an existing controller (default: controller)",
    )


def add_given_supervisor_options(parser: argparse.ArgumentParser, stands: str) -> None:
    """Add options for commands that take a model or its supervisor as `--model`: how a model is synthesized.

    Args:
        parser: Parser of the command.
        stands: Verb of the help text: the supervisor `stands` or `stood` somewhere.
    """
    parser.add_argument(
        "--deployment",
        choices=[str(deployment) for deployment in Deployment],
        help=f"deployment in which the supervisor {stands} (default: as a .rsup file says; for a model: controller)",
    )
    for short, name, what in (("-L", "library", "libraries"), ("-I", "interface", "ROS packages")):
        parser.add_argument(
            short,
            f"--{name}-path",
            action="append",
            default=[],
            type=given_path,
            metavar="DIR",
            help=f"another folder with {what} of the model, as for 'robosc synth' (may be repeated)",
        )
    add_distribution_argument(parser)
    add_engine_options(parser)


def add_engine_argument(parser: argparse.ArgumentParser) -> None:
    """The engine for decision diagrams."""
    engine = parser.add_argument(
        "--engine",
        default="auto",
        metavar="NAME",
        help="engine for decision diagrams: cudd (in C), oxidd (in Rust), autoref (plain Python), or auto: the fastest "
        "installed (the default)",
    )
    suggest(engine, lambda: ("auto", "cudd", "oxidd", "autoref"))


def add_engine_options(parser: argparse.ArgumentParser) -> None:
    """The engine for decision diagrams, and how it works on this machine."""
    add_engine_argument(parser)
    parser.add_argument(
        "--reorder",
        action="store_true",
        help="let the engine change the order of its variables while it works: slower, but an unlucky order may need "
        "it; the result is the same",
    )
    parser.add_argument(
        "--max-nodes",
        type=_positive,
        metavar="N",
        help="give up when decision diagrams grow beyond N nodes (default: no limit)",
    )


def _positive(text: str) -> int:
    try:
        number = int(text)
    except ValueError:
        number = 0
    if number < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number from 1 on")
    return number


def engine_options(arguments: argparse.Namespace) -> "EngineOptions":
    """Return the engine options that `add_engine_options` has read."""
    from robosc.synthesis import EngineOptions

    seconds = getattr(arguments, "condition_seconds", None)
    return EngineOptions(arguments.engine or "auto", arguments.reorder, arguments.max_nodes, seconds)


def add_condition_seconds_argument(parser: argparse.ArgumentParser) -> None:
    """Add the option for the time that conditions may take."""
    parser.add_argument(
        "--condition-seconds",
        type=_seconds,
        metavar="S",
        help="after S seconds shorten no further condition of the supervisor: the condition is still right, and is "
        "mostly shown as the size of its diagram (default: only steps limit this, and every run gives the same)",
    )


def _seconds(text: str) -> float:
    value = float(text)
    if not value >= 0:
        raise ValueError
    return value


_seconds.__name__ = "time"


def add_verify_limit_argument(parser: argparse.ArgumentParser, name: str, default: int) -> None:
    """Add the option for the limit of the independent verifier."""
    parser.add_argument(
        name,
        type=_natural,
        default=default,
        metavar="N",
        help="verify up to N states one by one, and larger systems symbolically with at most 25 N nodes; recompute the "
        "supervisor up to N/4 states of the system without it. Of a strategy, check up to N/100 positions (with "
        "missions N/10) one by one, and more of them symbolically with at most 25 N nodes, or else up to N/10 one by "
        "one. What takes more is 'not checked' (default: %(default)s)",
    )


def _natural(text: str) -> int:
    value = int(text)
    if not 0 <= value <= MAXIMUM_LIMIT:
        raise ValueError
    return value


_natural.__name__ = "number"


def add_livelock_argument(parser: argparse.ArgumentParser) -> None:
    """Add the option that allows silent steps that never end."""
    parser.add_argument(
        "--allow-livelock",
        action="store_true",
        help="make the supervisor even if resets, cancels and tau transitions can go on for ever without anything "
        "else happening: only warn (default: that is an error)",
    )


def read_bundle(arguments: argparse.Namespace) -> Bundle:
    """The model that the arguments name, with its libraries.

    Raises:
        UsageError: The model's file or a library folder is not there or cannot be read.
        LanguageError: A file's content cannot be a model.
    """
    from robosc.pipeline.files import FileAccessError
    from robosc.pipeline.loading import read_model

    try:
        return read_model(
            arguments.model,
            arguments.library_path,
            arguments.interface_path,
            distribution=getattr(arguments, "distribution", None),
        )
    except FileAccessError as error:
        raise UsageError(str(error)) from error
