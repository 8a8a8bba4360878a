"""The command `robosc-lsp`: the language server on standard input and output."""

import argparse
import logging
import sys
from pathlib import Path
from typing import NoReturn

from robosc import __version__
from robosc.cli.starting import start

_MISSING = "the language server needs pygls: pip install 'robosc[lsp]'"


_MOST_SECONDS = 1e6


def parser() -> argparse.ArgumentParser:
    """The command line."""
    found = argparse.ArgumentParser(
        prog="robosc-lsp",
        description="The language server of RoboSC for editors: it uses the Language Server Protocol 3.17 on standard "
        "input and output.",
    )
    found.add_argument("--version", action="version", version=f"robosc-lsp {__version__}")
    found.add_argument("--stdio", action="store_true", help="use standard input and output (always enabled)")
    found.add_argument(
        "-L",
        "--library-path",
        type=Path,
        action="append",
        default=[],
        metavar="DIR",
        help="additional folder with libraries, if it exists (may be repeated)",
    )
    found.add_argument(
        "-I",
        "--interface-path",
        type=Path,
        action="append",
        default=[],
        metavar="DIR",
        help="additional folder with ROS packages, if it exists (may be repeated)",
    )
    found.add_argument(
        "--synthesis-seconds",
        type=_seconds,
        default=60.0,
        metavar="S",
        help="time limit of background synthesis in seconds; 0 disables it (default: 60)",
    )
    found.add_argument("--check", action="store_true", help="check whether the server can start, and exit")
    found.add_argument("--log-file", type=Path, metavar="FILE", help="write a log to this file")
    return found


def _seconds(text: str) -> float:
    try:
        seconds = float(text)
    except ValueError:
        seconds = -1.0
    if not 0 <= seconds < _MOST_SECONDS:
        raise argparse.ArgumentTypeError(f"'{text}' is not a number of seconds from 0 to {_MOST_SECONDS:g}")
    return seconds


def entry() -> NoReturn:
    """Run the command and leave with its exit status."""
    start("robosc-lsp", lambda: main)


def main() -> int:
    """Serve one editor until it exits; return 0, or 1 if the server cannot run."""
    command_line = parser()
    arguments = command_line.parse_args()
    if arguments.log_file is not None:
        try:
            logging.basicConfig(filename=arguments.log_file, level=logging.INFO)
        except OSError as error:
            command_line.error(f"argument --log-file: '{arguments.log_file}': {error.strerror}")
    try:
        from robosc_lsp.server import make_server
    except ModuleNotFoundError as error:
        if error.name not in ("pygls", "lsprotocol"):
            raise
        sys.stderr.write(f"robosc-lsp: {_MISSING}\n")
        return 1
    if arguments.check:
        sys.stdout.write(f"robosc-lsp {__version__} can be started\n")
        return 0
    make_server(arguments.library_path, arguments.interface_path, arguments.synthesis_seconds).start_io()
    return 0


if __name__ == "__main__":
    entry()
