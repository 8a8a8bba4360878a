"""Arguments that several commands share."""

import argparse
from pathlib import Path

from robosc.cli.output import UsageError
from robosc.model.structure import Deployment
from robosc.source import Bundle


def add_model_arguments(parser: argparse.ArgumentParser) -> None:
    """The model, its library folders and `--json`."""
    parser.add_argument("model", type=Path, metavar="MODEL", help="the model's file, e.g. robot.rscd")
    parser.add_argument(
        "-L",
        "--library-path",
        action="append",
        default=[],
        type=Path,
        metavar="DIR",
        help="another folder with libraries (may be repeated; always searched: the model's folder and its ../shared)",
    )
    parser.add_argument(
        "-I",
        "--interface-path",
        action="append",
        default=[],
        type=Path,
        metavar="DIR",
        help="another folder with ROS packages whose .msg, .srv and .action files the model is checked against (may be "
        "repeated; always searched: those of an installed ROS)",
    )
    parser.add_argument("--json", action="store_true", help="print one JSON document for machines")


def add_deployment_argument(parser: argparse.ArgumentParser) -> None:
    """Where the supervisor will stand."""
    parser.add_argument(
        "--deployment",
        choices=[str(deployment) for deployment in Deployment],
        default=str(Deployment.CONTROLLER),
        help="controller: it decides itself; layer: it filters an existing controller (default: controller)",
    )


def add_engine_argument(parser: argparse.ArgumentParser) -> None:
    """The engine for decision diagrams."""
    parser.add_argument(
        "--engine",
        default="auto",
        metavar="NAME",
        help="engine for decision diagrams: cudd, autoref (plain Python), or auto: the fastest installed (the default)",
    )


def add_livelock_argument(parser: argparse.ArgumentParser) -> None:
    """What is thought of silent steps that never end."""
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
    from robosc.language import load_bundle
    from robosc.language.interfaces import interface_folders

    model: Path = arguments.model
    try:
        if model.is_dir():
            raise UsageError(f"{model} is a folder, not a model's file")
        if not model.exists():
            raise UsageError(f"there is no file {model}")
        for what, folders in (("library", arguments.library_path), ("interface", arguments.interface_path)):
            for folder in folders:
                if not folder.is_dir():
                    raise UsageError(f"there is no {what} folder {folder}")
        interface_paths = (*arguments.interface_path, *interface_folders())
        return load_bundle(model, arguments.library_path, interface_paths)
    except OSError as error:
        raise UsageError(f"cannot read {error.filename or model}: {error.strerror or error}") from error
