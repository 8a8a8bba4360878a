"""`robosc new`: the files of a new robot."""

import argparse
import contextlib
import shlex
import sys
from collections.abc import Mapping
from pathlib import Path

from robosc.cli.arguments import add_distribution_argument, given_path
from robosc.cli.output import ExitCode, UsageError, print_json


def add_parser(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command."""
    parser = commands.add_parser(
        "new",
        help="begin a new robot with a model that explains itself",
        description="Write a small complete robot to begin with: a commented model, a library and a README. "
        "Nothing that is there is overwritten: all files are written, or none.",
    )
    parser.add_argument("robot", metavar="ROBOT", help="name of the robot, e.g. LineFollower")
    parser.add_argument(
        "--folder",
        type=given_path,
        metavar="DIR",
        help="folder to write to, made if it is not there (default: one named after the robot, e.g. line_follower)",
    )
    parser.add_argument(
        "--stamped",
        action=argparse.BooleanOptionalAction,
        help="send velocities as geometry_msgs/TwistStamped, or as Twist (default: as the distribution's robots take "
        "them: stamped from ROS 2 Kilted on; a TurtleBot3 on Jazzy takes TwistStamped, too)",
    )
    add_distribution_argument(parser, "ROS distribution of the robot, which decides how velocities are sent")
    parser.add_argument("--json", action="store_true", help="print one JSON document for machines")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Write the files; 0 if they were written."""
    from robosc.starter import InvalidNameError, make_starter

    try:
        starter = make_starter(arguments.robot, is_stamped=_is_stamped(arguments))
    except InvalidNameError as error:
        raise UsageError(str(error)) from error
    folder: Path = arguments.folder if arguments.folder is not None else Path(starter.stem)
    written = write_new(starter.files, folder)
    commands = _next_commands(folder / starter.model, folder)
    if arguments.json:
        print_json({"robot": starter.robot, "folder": str(folder), "files": written, "next": commands})
    else:
        sys.stdout.write("".join(f"{path}\n" for path in written))
        sys.stdout.write("\nNext:\n" + "".join(f"  {command}\n" for command in commands))
    return ExitCode.OK


def _is_stamped(arguments: argparse.Namespace) -> bool:
    from robosc.interfaces import distribution_of
    from robosc.language.interfaces import sourced_distribution

    if arguments.stamped is not None:
        return bool(arguments.stamped)
    distribution = distribution_of(arguments.distribution or sourced_distribution())
    return distribution is not None and distribution.has_stamped_velocities


def _next_commands(model: Path, folder: Path) -> list[str]:
    """Return the next commands for the model, as lines for a shell."""
    quoted = shlex.quote(_argument(model))
    output = shlex.quote(_argument(folder / "out"))
    return [
        f"robosc check {quoted}",
        f"robosc synth {quoted}",
        f"robosc doc {quoted}",
        f"robosc generate {quoted} --target ros2 -o {output}",
    ]


def _argument(path: Path) -> str:
    """A path that no command takes for an option."""
    return f"./{path}" if str(path).startswith("-") else str(path)


def write_new(files: Mapping[str, str], folder: Path) -> list[str]:
    """Write files that must not be there yet into a folder, all of them or none.

    Returns:
        The path of every file.

    Raises:
        UsageError: A file is there already, or the folder cannot be written; nothing is left behind.
    """
    made: list[Path] = []
    try:
        # A link that leads nowhere is there too.
        there = [name for name in files if (folder / name).exists() or (folder / name).is_symlink()]
        if there:
            raise UsageError(f"{folder} already has {', '.join(there)}; nothing was written")
        _make_folders(folder, made)
        for name, text in files.items():
            _create(folder / name, text, made)
    except BaseException as error:
        _remove(made)
        if isinstance(error, OSError):
            place = error.filename or folder
            raise UsageError(f"cannot write {place}: {error.strerror or error}; nothing was written") from error
        raise
    return [str(folder / name) for name in files]


def _make_folders(folder: Path, made: list[Path]) -> None:
    """Make a folder and those above it, adding to `made` what was not there."""
    missing = [place for place in (folder, *folder.parents) if not place.exists()]
    for place in reversed(missing):
        place.mkdir()
        made.append(place)


def _create(path: Path, text: str, made: list[Path]) -> None:
    """Create a file, unless another program has made it in the meantime."""
    with path.open("x", encoding="utf-8", newline="\n") as file:
        made.append(path)
        file.write(text)


def _remove(made: list[Path]) -> None:
    """Undo what was made, last first; a folder with files of others stays."""
    for path in reversed(made):
        with contextlib.suppress(OSError):
            path.rmdir() if path.is_dir() else path.unlink()
