"""`robosc convert-log`: an event log as an MCAP file, which Foxglove and the tools of ROS 2 open."""

import argparse
import json
import sys
from pathlib import Path

from robosc.cli.arguments import add_log_arguments, given_path
from robosc.cli.output import ExitCode, UsageError, print_json
from robosc.source import visible

_DESCRIPTION = """\
Convert an event log (JSON Lines, as every node, the bridge and the simulations write it) into an MCAP file, which
Foxglove, ros2 bag and PlotJuggler open: events with their data, requests that a layer held back, every entry in words,
each component's state and each variable whenever it changes, and the robot's pose where there is a record of its
motion. All messages are of types that every ROS 2 has. Needs the extra robosc[mcap].
"""


def add_parser(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command."""
    parser = commands.add_parser(
        "convert-log", help="convert an event log for Foxglove and ros2 bag (MCAP)", description=_DESCRIPTION
    )
    add_log_arguments(parser, "output file, .mcap (default: the log's name with .mcap, beside it)")
    parser.add_argument(
        "--motion",
        type=given_path,
        metavar="FILE",
        help="how the robot moved, as a simulator records it (default: motion.jsonl beside the log, if it is of the "
        "same time)",
    )
    parser.add_argument(
        "--layout",
        type=given_path,
        metavar="FILE",
        help="also write a layout for Foxglove, .json: states, log, events, plots, and where the robot was",
    )
    parser.add_argument("--json", action="store_true", help="print one JSON document for machines")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Convert; 0 if that is done.

    Raises:
        UsageError: The log cannot be read or is none, or the file cannot be written.
    """
    from robosc.event_logs import ConversionError, LogError, MotionOfLogError, convert_log

    log: Path = arguments.log
    if arguments.layout is not None and arguments.layout.suffix.lower() != ".json":
        raise UsageError(f"{arguments.layout}: layouts of Foxglove are .json files")
    output: Path = arguments.output or log.with_suffix(".mcap")
    if log.exists() and output.exists() and output.samefile(log):
        raise UsageError(f"{output} is the log itself: convert to another file")
    try:
        converted = convert_log(log, output, motion=arguments.motion)
    except (ConversionError, LogError, MotionOfLogError) as error:
        raise UsageError(str(error)) from error
    except OSError as error:
        what = f"read {log}" if error.filename == str(log) else f"write {output}"
        raise UsageError(f"cannot {what}: {error.strerror or error}") from error
    layout: Path | None = arguments.layout
    if layout is not None:
        _write_layout(layout, converted.topics)
    if arguments.json:
        print_json(
            {
                "file": str(converted.path),
                "entries": converted.entries,
                "messages": converted.messages,
                "topics": converted.topics,
                "motion": converted.has_motion,
                **({"layout": str(layout)} if layout is not None else {}),
                "notes": list(converted.notes),
            }
        )
    else:
        motion = ", with the robot's motion" if converted.has_motion else ""
        contents = (
            f"{converted.messages} messages on {len(converted.topics)} topics of {converted.entries} entries{motion}"
        )
        sys.stdout.write(visible(f"{converted.path}: {contents}") + "\n")
        if layout is not None:
            sys.stdout.write(visible(f"{layout}: a layout for Foxglove") + "\n")
        sys.stdout.write("".join(f"note: {visible(note)}\n" for note in converted.notes))
    return ExitCode.OK


def _write_layout(path: Path, topics: dict[str, str]) -> None:
    from robosc.event_logs.foxglove import layout_of

    try:
        path.write_text(json.dumps(layout_of(topics), indent=2) + "\n", encoding="utf-8")
    except OSError as error:
        raise UsageError(f"cannot write {path}: {error.strerror or error}") from error
