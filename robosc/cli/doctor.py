"""`robosc doctor`: what this machine has for RoboSC, what is missing, and how to get it."""

import argparse
import sys
from typing import TYPE_CHECKING

from robosc._version import __version__
from robosc.cli.output import ExitCode, UsageError, print_json
from robosc.source import visible

if TYPE_CHECKING:
    from robosc.doctor import Finding

_PURPOSES = ("synth", "ros2", "ros1", "bridge", "server", "view")

_EPILOG = """\
purposes:
  synth   check, synthesize, verify and generate (always examined)
  ros2    build and run generated ROS 2 packages
  ros1    build and run generated ROS 1 packages
  bridge  run a supervisor on motors and LiDAR over serial lines
  server  serve syntheses
  view    show a robot in a web page

exit status:
  0  everything is there that the purposes need; notes may be left
  1  something is missing, or the server of --server does not serve
  2  wrong use
"""


def add_parser(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command."""
    parser = commands.add_parser(
        "doctor",
        help="report what this machine has for RoboSC, and what is missing",
        description="Examine this machine: Python, packages, ROS, compilers, serial ports and who may use them, a "
        "browser. Everything that is missing comes with a way to get it. Nothing is changed, and no line is opened.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "--for",
        dest="purposes",
        action="append",
        choices=_PURPOSES,
        default=[],
        help="examine what this purpose needs (may be repeated; default: check everything; only synth is required)",
    )
    parser.add_argument("--server", metavar="HOST[:PORT]", help="examine whether this synthesis server can be used")
    parser.add_argument("--json", action="store_true", help="print one JSON document for machines")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Print the findings; 0 if nothing that is needed is missing.

    Raises:
        UsageError: The server's address is none.
    """
    from robosc.doctor import Machine, Purpose, examine, is_ready

    server = arguments.server
    if server is not None and (not server or server.startswith("-") or not server.isprintable() or " " in server):
        raise UsageError(f"--server: neither HOST nor HOST:PORT: '{server}'")
    found = examine(Machine(), tuple(map(Purpose, arguments.purposes)), server)
    if arguments.json:
        findings = [
            {
                "part": item.part,
                "grade": str(item.grade),
                "message": item.message,
                **({"fix": item.fix} if item.fix else {}),
            }
            for item in found
        ]
        document = {"robosc": __version__, "purposes": arguments.purposes or ["synth"]}
        print_json({**document, "ok": is_ready(found), "findings": findings})
    else:
        sys.stdout.write("".join(map(_line, found)))
    return ExitCode.OK if is_ready(found) else ExitCode.FAILED


def _line(finding: "Finding") -> str:
    line = f"{finding.grade:8} {finding.part}: {visible(finding.message)}\n"
    return line + (f"         fix: {visible(finding.fix)}\n" if finding.fix else "")
