"""`robosc plot`: states, events and variables in an event log over time, as a picture or a page."""

import argparse
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from robosc.cli.arguments import add_log_arguments, given_path
from robosc.cli.output import ExitCode, UsageError, print_json
from robosc.source import visible

if TYPE_CHECKING:
    from robosc.event_logs import LoggedRun
    from robosc.motion_record import Motion

_DESCRIPTION = """\
Draw an event log (JSON Lines, as every node, the bridge and the simulations write it): time to the right, a band for
the states of each component, one row for each event, controllable events as orange triangles, uncontrollable ones as
blue dots, requests that a layer held back as crosses, faults, stops and restarts as lines. Where thousands of events
stand side by side, marks that would cover a mark of the same event are left out, and the plot says how many.
"""


def add_parser(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command."""
    parser = commands.add_parser(
        "plot", help="draw an event log: states, events, variables over time", description=_DESCRIPTION
    )
    add_log_arguments(
        parser,
        "output file: .png or .svg for a picture, .html for a page that can be zoomed and needs no network "
        "(default: the log's name with .png, beside it)",
    )
    parser.add_argument(
        "--from", dest="begin_s", type=_seconds, metavar="S", help="begin S seconds after the log begins"
    )
    parser.add_argument("--to", dest="end_s", type=_seconds, metavar="S", help="end S seconds after the log begins")
    parser.add_argument(
        "--event",
        action="append",
        default=[],
        metavar="NAME",
        help="show this event only (may be repeated); * stands for anything, as in '*.request'",
    )
    parser.add_argument(
        "--changes",
        action="store_true",
        help="leave out events that say nothing new: they carry what they carried before, and change no state",
    )
    parser.add_argument(
        "--variable",
        action="append",
        default=[],
        metavar="NAME",
        help="show this variable, too (may be repeated): a number as a curve, all else as a band; * stands for "
        "anything, as in 'LidarSensor.*'",
    )
    parser.add_argument("--no-bands", dest="has_bands", action="store_false", help="leave out the states of components")
    parser.add_argument(
        "--clock",
        choices=("log", "robot"),
        default="log",
        help="time axis, also of --from and --to: log (the computer's clock) or robot (the simulated clock, which may "
        "be faster) (default: %(default)s)",
    )
    parser.add_argument(
        "--motion",
        type=given_path,
        metavar="FILE",
        help="with --clock robot: how the robot moved, as a simulator records it (default: motion.jsonl beside the "
        "log)",
    )
    parser.add_argument("--title", default=None, help="title above the plot (default: the log's name)")
    parser.add_argument("--json", action="store_true", help="print one JSON document for machines")
    parser.set_defaults(run=run)


def _seconds(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise ValueError
    return value


_seconds.__name__ = "number of seconds"


def run(arguments: argparse.Namespace) -> int:
    """Draw; 0 if that is done.

    Raises:
        UsageError: The log cannot be read or is none, or there is nothing in it as asked.
    """
    from robosc.event_logs import LogError, MotionOfLogError, PlotError, draw_sequence, read_log

    if arguments.motion is not None and arguments.clock != "robot":
        raise UsageError("--motion goes with --clock robot")
    log: Path = arguments.log
    output: Path = arguments.output or log.with_suffix(".png")
    try:
        run_ = read_log(log)
    except (LogError, OSError) as error:
        raise UsageError(_reason(log, error)) from error
    if output.exists() and output.samefile(log):
        raise UsageError(f"{output} is the log itself: draw to another file")
    title = log.stem if arguments.title is None else arguments.title
    try:
        drawn = draw_sequence(
            run_,
            output,
            begin_s=arguments.begin_s,
            end_s=arguments.end_s,
            events=arguments.event,
            only_changes=arguments.changes,
            title=title[:200],
            has_bands=arguments.has_bands,
            variables=arguments.variable,
            motion=_motion(arguments, run_) if arguments.clock == "robot" else None,
        )
    except (PlotError, MotionOfLogError) as error:
        raise UsageError(str(error)) from error
    except OSError as error:
        raise UsageError(f"cannot write {output}: {error.strerror or error}") from error
    if arguments.json:
        print_json(
            {
                "file": str(drawn.path),
                "events": drawn.events,
                "marks": drawn.marks,
                "blocked": drawn.blocked,
                "bands": list(drawn.bands),
                "curves": list(drawn.curves),
                "rows": list(drawn.rows),
                "begin_s": round(drawn.begin_s, 6),
                "end_s": round(drawn.end_s, 6),
                "notes": list(drawn.notes),
            }
        )
    else:
        span = f"{drawn.begin_s:.3f} s to {drawn.end_s:.3f} s"
        sys.stdout.write(visible(f"{drawn.path}: {drawn.events} events of {len(drawn.rows)} kinds, {span}") + "\n")
        sys.stdout.write("".join(f"note: {visible(note)}\n" for note in drawn.notes))
    return ExitCode.OK


def _motion(arguments: argparse.Namespace, run: "LoggedRun") -> "Motion":
    """Return the record of motion that gives the robot's time.

    Raises:
        MotionOfLogError: The one that was given cannot be used.
        UsageError: There is none.
    """
    from robosc.event_logs.motions import motion_of_log

    times_s = [entry.time_s for entry in run.entries] or [0.0]
    found = motion_of_log(arguments.log, arguments.motion, min(times_s), max(times_s))
    if found is None:
        raise UsageError(
            "--clock robot needs a record of the robot's motion: --motion FILE, or motion.jsonl beside the log and of "
            "the same time"
        )
    return found


def _reason(log: Path, error: Exception) -> str:
    return f"cannot read {log}: {error.strerror or error}" if isinstance(error, OSError) else str(error)
