"""`robosc-bridge replay` and `redact`, and the recording of `run`."""

import argparse
import json
import sys
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robosc_bridge.captures.capture_file import (
    SUFFIX,
    Capture,
    CaptureError,
    LineInfo,
    read_capture,
    write_capture,
)
from robosc_bridge.captures.recorder import LEAST_MIB, USUAL_MIB, Recorder
from robosc_bridge.configuration.structure import Configuration
from robosc_bridge.host import Host

if TYPE_CHECKING:
    from robosc_bridge.captures.players import Item, Summary

OK, PROBLEMS = 0, 1

_MIB = 1 << 20
_EPILOG = "exit status: 0 done; 1 the capture has problems or was broken off; 2 wrong use or files"
_NOT_RECORDED = frozenset({"signing_key"})


def add_recording(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of a recording to `run`."""
    parser.add_argument(
        "--record",
        metavar="FILE",
        type=_capture_name,
        help=f"record the bytes of the devices' lines ({SUFFIX}); one that is there becomes an older part (.1 to .3)",
    )
    parser.add_argument(
        "--record-mib",
        metavar="N",
        type=_mib,
        default=USUAL_MIB,
        help=f"size of all parts of the recording together, in MiB (default: {USUAL_MIB})",
    )


def add_commands(commands: Any) -> None:
    """Add the commands to subparsers of argparse."""
    replayed = commands.add_parser(
        "replay", help="show how the drivers interpret a recording (run --record)", epilog=_EPILOG
    )
    replayed.add_argument("file", metavar="FILE", type=Path, help=f"the recording ({SUFFIX})")
    replayed.add_argument("--line", metavar="NAME", help="this line alone, such as base or scanner")
    replayed.add_argument("--summary", action="store_true", help="figures of each line alone")
    replayed.add_argument("--json", action="store_true", help="for programs: a JSON document on each line")
    replayed.set_defaults(run=_replay)

    redact = commands.add_parser(
        "redact", help="copy a recording without data that identifies its owner, for sharing", epilog=_EPILOG
    )
    redact.add_argument("file", metavar="FILE", type=Path, help=f"the recording ({SUFFIX})")
    redact.add_argument("-o", "--output", metavar="FILE", type=_capture_name, required=True, help="file to write")
    redact.add_argument(
        "--without", metavar="LINE", action="append", default=[], help="leave out a line, such as scanner; repeatable"
    )
    redact.set_defaults(run=_redact)


def make_recorder(arguments: argparse.Namespace, configuration: Configuration, host: Host) -> Recorder | None:
    """Return the recorder of a command line; None: it has none.

    Raises:
        CaptureError: The file is something else.
        OSError: It cannot be written.
    """
    if arguments.record is None:
        return None
    return Recorder(arguments.record, recorded_lines(configuration), host, arguments.record_mib * _MIB)


def recorded_lines(configuration: Configuration) -> Mapping[str, LineInfo]:
    """Return the lines of a robot, by path or address; a LiDAR on the base's line is that line."""
    drive, scanner = configuration.drive, configuration.scanner
    chosen = configuration.robot
    robot, separation_m = (chosen, 0.0) if isinstance(chosen, str) else ("", chosen.wheel_separation_m)
    lines = {}
    if scanner is not None:
        lines[scanner.port] = LineInfo("scanner", scanner.driver, "", _recorded(scanner.options), scanner.port)
    lines[drive.port] = LineInfo("base", drive.driver, robot, _recorded(drive.options), drive.port, separation_m)
    return lines


def _recorded(options: Mapping[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in options.items() if name not in _NOT_RECORDED}


def _capture_name(text: str) -> Path:
    file = Path(text)
    if file.suffix != SUFFIX:
        raise argparse.ArgumentTypeError(f"{text}: a recording is an MCAP file; its name ends with {SUFFIX}")
    return file


def _mib(text: str) -> int:
    if not text.isascii() or not text.isdecimal() or not LEAST_MIB <= int(text) <= 1 << 20:
        raise argparse.ArgumentTypeError(f"{text}: a whole number of MiB, {LEAST_MIB} or more")
    return int(text)


def replay(capture: Capture, summaries: "dict[str, Summary]") -> "Iterator[Item]":
    """Yield what the drivers make of a capture, line by line; the summaries grow with it, by line."""
    # All drivers, which take long to load.
    from robosc_bridge.captures.players import Summary, play

    for name, info in capture.lines.items():
        summary = summaries[name] = Summary(info.driver)
        yield from play(info, [record for record in capture.records if record.line == name], capture.begin_ns, summary)


def _replay(arguments: argparse.Namespace) -> int:
    from robosc_bridge.captures.redaction import metadata_of

    capture = read_capture(arguments.file)
    if arguments.line is not None:
        if arguments.line not in capture.lines:
            raise CaptureError(f"{arguments.file}: no line '{arguments.line}'; it has {', '.join(capture.lines)}")
        capture = Capture({arguments.line: capture.lines[arguments.line]}, capture.records, capture.is_whole)
    summaries: dict[str, Summary] = {}
    write = sys.stdout.write
    if not arguments.json:
        write("".join(f"{line}\n" for line in metadata_of(capture.lines)))
    for item in replay(capture, summaries):
        if not arguments.summary:
            write(json.dumps(asdict(item)) + "\n" if arguments.json else f"{_text(item)}\n")
    if arguments.json:
        lines = {name: asdict(summary) for name, summary in summaries.items()}
        write(json.dumps({"kind": "summary", "is_whole": capture.is_whole, "lines": lines}) + "\n")
    else:
        write("".join(f"{name}: {_figures(summary)}\n" for name, summary in summaries.items()))
        if not capture.is_whole:
            write("the recording was broken off: its last records may be missing\n")
    has_problems = any(summary.problems for summary in summaries.values())
    return PROBLEMS if has_problems or not capture.is_whole else OK


def _text(item: "Item") -> str:
    values = {name: value for name, value in item.values.items() if name != "ranges_m"}
    words = " ".join(f"{name}={json.dumps(value)}" for name, value in values.items())
    return f"{item.time_s:10.3f} {item.line:8} {item.kind:8} {words}"


def _figures(summary: "Summary") -> str:
    figures = asdict(summary)
    problems = figures.pop("problems")
    figures.pop("driver")
    text = ", ".join(f"{name.replace('_', ' ')} {value}" for name, value in figures.items())
    return text + "".join(f"; {count} x {problem}" for problem, count in problems.items())


def _redact(arguments: argparse.Namespace) -> int:
    from robosc_bridge.captures.redaction import redacted

    capture = redacted(read_capture(arguments.file), arguments.without)
    write_capture(arguments.output, capture.lines, capture.records)
    sys.stdout.write(f"{arguments.output}: {len(capture.records)} records of {', '.join(capture.lines)}\n")
    return OK
