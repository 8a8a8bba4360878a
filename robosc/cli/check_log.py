"""`robosc check-log`: whether everything in an event log could have happened under the supervisor."""

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from robosc.cli.arguments import add_given_supervisor_options, given_path
from robosc.cli.output import ExitCode, UsageError, print_json
from robosc.cli.supervisor_argument import supervisor_of_arguments
from robosc.model.structure import Deployment
from robosc.source import visible

if TYPE_CHECKING:
    from robosc.event_logs import LogCheck, LoggedRun
    from robosc.supervisor import Supervisor

_SHOWN = 20

_DESCRIPTION = """\
Check an event log (JSON Lines, as every node, the bridge and the simulations write it) against the supervisor: the
events are replayed from the initial state on the automata. Every request must have been allowed in the state in which
it happened and carry what the model provides, every other event possible, every logged state the one that the events
lead to; what a supervision layer held back must have been forbidden.
"""

_EPILOG = """\
exit status:
  0  nothing is wrong
  1  something in the log could not have happened, it contains no events, or there is no supervisor
  2  wrong use; a file that cannot be read or is no event log
"""


def add_parser(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command."""
    parser = commands.add_parser(
        "check-log",
        help="check an event log against the supervisor",
        description=_DESCRIPTION,
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("log", type=given_path, metavar="LOG", help="the event log, a file of JSON Lines")
    parser.add_argument(
        "--model",
        required=True,
        type=given_path,
        metavar="FILE",
        help="the model (.rscd), which is synthesized, or its supervisor (.rsup), which is believed: 'robosc verify' "
        "checks it",
    )
    add_given_supervisor_options(parser, "stood")
    parser.add_argument("--json", action="store_true", help="print one JSON document for machines")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Check; 0 if nothing is wrong, 1 if something is.

    Raises:
        UsageError: A file cannot be read, or is no event log.
        InvalidSupervisorError: The supervisor's file is malformed.
    """
    from robosc.event_logs import LogError, check_log, read_log

    log: Path = arguments.log
    try:
        run_ = read_log(log)
    except OSError as error:
        raise UsageError(f"cannot read {log}: {error.strerror or error}") from error
    except LogError as error:
        raise UsageError(str(error)) from error
    supervisor = supervisor_of_arguments(arguments, is_json=arguments.json)
    if supervisor is None:
        return ExitCode.FAILED
    deployment = None if arguments.deployment is None else Deployment(arguments.deployment)
    found = check_log(run_, supervisor, deployment)
    if arguments.json:
        print_json(_document(found, run_, supervisor))
    else:
        _print(log, found, supervisor)
    return ExitCode.OK if found.has_passed else ExitCode.FAILED


def _document(found: "LogCheck", run_: "LoggedRun", supervisor: "Supervisor") -> dict[str, object]:
    return {
        "status": "passed" if found.has_passed else "failed",
        "model": supervisor.model.name,
        "events": found.events,
        "requests": found.requests,
        "blocked": found.blocked,
        "unjudged": found.unjudged,
        "restarts": found.restarts,
        "dropped": run_.dropped,
        "notes": list(found.notes),
        "violation_count": found.violation_count,
        "violations": [{"line": item.line, "time": item.time_s, "message": item.sentence} for item in found.violations],
    }


def _print(log: Path, found: "LogCheck", supervisor: "Supervisor") -> None:
    lines = [f"{log}:{item.line}: {item.sentence}" for item in found.violations[:_SHOWN]]
    if found.violation_count > len(lines):
        lines.append(f"and {found.violation_count - len(lines)} more (--json lists the first 1000)")
    counts = [f"{found.events} events, {found.requests} of them requests"]
    if found.blocked:
        unjudged = f" ({found.unjudged} for a reason that no state shows)" if found.unjudged else ""
        counts.append(f"{found.blocked} requests held back{unjudged}")
    if found.restarts:
        counts.append(f"{found.restarts} restarts")
    failed = f"failed: {found.violation_count} violations" if found.violation_count else "not checked"
    word = "passed" if found.has_passed else failed
    lines.append(f"{log}: {word} against the supervisor of {supervisor.model.name}: {', '.join(counts)}")
    lines += [f"note: {note}" for note in found.notes]
    sys.stdout.write("".join(f"{visible(line)}\n" for line in lines))
