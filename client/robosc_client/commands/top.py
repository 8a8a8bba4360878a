"""The command `top`, which shows the present load of a service, again and again."""

import argparse
import json
import sys
import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import TYPE_CHECKING, Any

from robosc.cli.output import ExitCode
from robosc.source import visible
from robosc_client import (
    Client,
    ClientError,
    DeadlineError,
    Job,
    JobState,
    ServerBusyError,
    ServerUnavailableError,
    ServiceLoad,
)
from robosc_client.commands.connection import add_connection_arguments, exit_statuses, number_up_to, seconds
from robosc_client.commands.jobs import job_json

if TYPE_CHECKING:
    from rich.text import Text

_DESCRIPTION = """\
Show what a service does now: how many tasks its workers can do and are doing, which callers wait and for how long, and
the jobs that have not ended. Without --all, only your own jobs. Ctrl-C ends it. If the service does not answer in
between, this is said and tried again.
"""

_INTERVAL_S = 2.0
_DEADLINE_S = 5.0
"""Time limit of each call: what is shown must not grow old without a word."""

_MOST = 20
_MOST_JOBS = 1000
_MAXIMUM_TEXT = 40
_MAXIMUM_DOING = 100

_MINUTE_S, _HOUR_S, _DAY_S = 60, 3600, 86400

_PASSING = (ServerUnavailableError, DeadlineError, ServerBusyError)
"""Failures that may pass: a server is started again, a network comes back."""


def add_parsers(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command."""
    parser = commands.add_parser("top", help="show what a service does now", description=_DESCRIPTION)
    parser.add_argument(
        "--all", action="store_true", help="show the jobs of all callers (needs a token with the scope admin)"
    )
    parser.add_argument("--once", action="store_true", help="print it once, and end")
    parser.add_argument(
        "--interval",
        type=seconds,
        default=_INTERVAL_S,
        metavar="SECONDS",
        help="time between two looks (default: %(default)g)",
    )
    parser.add_argument(
        "--most",
        type=number_up_to(_MOST_JOBS),
        default=_MOST,
        metavar="N",
        help="show at most N jobs that run and N that wait (default: %(default)s)",
    )
    parser.add_argument("--json", action="store_true", help="print one line of JSON for each look, for machines")
    add_connection_arguments(parser, deadline_s=_DEADLINE_S, epilog=exit_statuses("it was shown once (--once)"))
    parser.set_defaults(run=_top)


@dataclass(frozen=True, slots=True)
class _Look:
    """State of a service at one moment.

    Attributes:
        load: Load of the service.
        running: Jobs that workers are busy with, those that have run longest first.
        queued: Jobs that wait, those that have waited longest first.
        more: Number of unfinished jobs that are not among them.
    """

    load: ServiceLoad
    running: tuple[Job, ...]
    queued: tuple[Job, ...]
    more: int


def _top(arguments: argparse.Namespace, client: Client) -> int:
    try:
        return _show(arguments, client)
    except KeyboardInterrupt:
        # Its usual end: no document of an error follows the lines.
        return ExitCode.INTERRUPTED


def _show(arguments: argparse.Namespace, client: Client) -> int:
    if arguments.json or arguments.once or not sys.stdout.isatty():
        return _print(arguments, client)
    from rich.console import Console
    from rich.live import Live

    console = Console(markup=False, highlight=False)
    with Live(console=console, screen=True, auto_refresh=False) as live:
        for look, failure in _looks(arguments, client):
            live.update(_drawn(look, failure, console.width, console.height), refresh=True)
    raise AssertionError("unreachable: only an interrupt or an error ends it")


def _print(arguments: argparse.Namespace, client: Client) -> int:
    """Print one look, or one after the other."""
    is_first = True
    try:
        for look, failure in _looks(arguments, client):
            if arguments.json:
                sys.stdout.write(json.dumps(_document(look) if failure is None else _failure_document(failure)) + "\n")
            else:
                sys.stdout.write(("" if is_first else "\n") + _text(look, failure))
            sys.stdout.flush()
            is_first = False
    except ClientError as error:
        if is_first or not arguments.json:
            raise
        # A line as the others are, since it follows them.
        sys.stdout.write(json.dumps(_failure_document(error)) + "\n")
        sys.stderr.write(f"robosc-client: {visible(str(error))}\n")
        return ExitCode.SERVICE
    return ExitCode.OK


def _looks(arguments: argparse.Namespace, client: Client) -> Iterator[tuple[_Look, ClientError | None]]:
    """Look once, or again and again; yield what was seen last, and the failure of the last attempt to look, if any.

    A failure of the first attempt is raised, since a wrong address does not become right.
    """
    look = _look(arguments, client)
    yield look, None
    while not arguments.once:
        time.sleep(arguments.interval)
        failure = None
        try:
            look = _look(arguments, client)
        except _PASSING as error:
            failure = error
        yield look, failure


def _look(arguments: argparse.Namespace, client: Client) -> _Look:
    load = client.get_load(all_callers=arguments.all, deadline_s=arguments.deadline)
    running = _jobs(arguments, client, JobState.RUNNING)
    queued = _jobs(arguments, client, JobState.QUEUED)
    unfinished = sum(caller.queued_jobs + caller.running_jobs for caller in load.callers)
    running.sort(key=lambda job: (job.started or job.created, job.id))
    queued.sort(key=lambda job: (job.created, job.id))
    shown = tuple(running[: arguments.most]), tuple(queued[: arguments.most])
    return _Look(load, *shown, max(0, unfinished - sum(map(len, shown))))


def _jobs(arguments: argparse.Namespace, client: Client, state: JobState) -> list[Job]:
    """Return all jobs in a state, since a list begins with the youngest, and the oldest ones are wanted."""
    found = client.list_jobs(
        states=(state,), all_owners=arguments.all, page_size=_MOST_JOBS, deadline_s=arguments.deadline
    )
    return list(found)


def _document(look: _Look) -> dict[str, Any]:
    """Return a look as JSON values; times in ISO 8601."""
    load = look.load
    return {
        "time": load.time.isoformat(),
        "servers": load.servers,
        "workers": load.workers,
        "running_tasks": load.running_tasks,
        "waiting_tasks": load.waiting_tasks,
        "ended_jobs_per_minute": sum(caller.ended_jobs for caller in load.callers),
        "callers": [
            {
                "caller": caller.caller,
                "waiting_tasks": caller.waiting_tasks,
                "running_tasks": caller.running_tasks,
                "queued_jobs": caller.queued_jobs,
                "running_jobs": caller.running_jobs,
                "ended_jobs_per_minute": caller.ended_jobs,
                "waiting_s": _age_s(load.time, caller.first_queued),
            }
            for caller in load.callers
        ],
        "running": [{**job_json(job), "age_s": _age_s(load.time, job.started)} for job in look.running],
        "queued": [{**job_json(job), "age_s": _age_s(load.time, job.created)} for job in look.queued],
        "more_jobs": look.more,
    }


def _failure_document(failure: ClientError) -> dict[str, Any]:
    return {"error": {"status": int(ExitCode.SERVICE), "message": str(failure)}}


def _age_s(now: datetime, since: datetime | None) -> float | None:
    """Return the seconds since a moment, by the server's clock; the clocks of several servers may differ a little."""
    return None if since is None else round(max(0.0, (now - since).total_seconds()), 3)


def _headline(look: _Look) -> str:
    load = look.load
    ended = sum(caller.ended_jobs for caller in load.callers)
    return (
        f"{load.time:%H:%M:%S} UTC  servers {load.servers}  workers {load.workers}, busy {load.running_tasks}  "
        f"waiting {load.waiting_tasks}  ended/min {ended}"
    )


def _no_answer(look: _Look, failure: ClientError) -> str:
    return f"NO ANSWER since {look.load.time:%H:%M:%S} UTC, trying again: {visible(str(failure))}"


def _caller_rows(look: _Look) -> list[tuple[str, ...]]:
    return [
        (
            caller.caller[:_MAXIMUM_TEXT],
            str(caller.queued_jobs),
            str(caller.running_jobs),
            str(caller.waiting_tasks),
            str(caller.running_tasks),
            str(caller.ended_jobs),
            _age(look.load.time, caller.first_queued),
        )
        for caller in look.load.callers
    ]


_CALLER_COLUMNS = ("CALLER", "QUEUED", "RUNNING", "TASKS WAITING", "TASKS RUNNING", "ENDED/MIN", "LONGEST WAIT")
_JOB_COLUMNS = ("JOB", "STATE", "AGE", "BEFORE", "KIND", "CALLER", "MODEL", "DOING")

_SHORTENED = {"CALLER": 8, "MODEL": 8, "DOING": 16, "JOB": 8}
"""Columns that are cut off where a terminal is narrow, and the width that each keeps; the first are widened first."""

_DROPPED = ("KIND", "TASKS RUNNING", "TASKS WAITING", "ENDED/MIN", "BEFORE", "MODEL", "DOING", "AGE", "QUEUED")
"""Columns that a narrow terminal does without, the first of them first."""


def _job_rows(look: _Look) -> list[tuple[str, ...]]:
    now = look.load.time
    return [
        (
            job.id,
            str(job.state),
            _age(now, job.started if job.state is JobState.RUNNING else job.created),
            str(job.waiting_before) if job.state is JobState.QUEUED and job.waiting_before else "",
            str(job.kind),
            job.owner[:_MAXIMUM_TEXT],
            (job.label or job.main_file)[:_MAXIMUM_TEXT],
            _doing(look, job),
        )
        for job in (*look.running, *look.queued)
    ]


def _doing(look: _Look, job: Job) -> str:
    """Return what a job does or waits for."""
    if job.progress is not None:
        return f"{job.progress.stage}: {job.progress.message}"[:_MAXIMUM_DOING]
    if job.state is not JobState.QUEUED:
        return ""
    return "waits for a worker" if look.load.workers else "waits for workers: there are none"


def _age(now: datetime, since: datetime | None) -> str:
    """Return the time since a moment in two units at most."""
    age_s = _age_s(now, since)
    if age_s is None:
        return ""
    whole = int(age_s)
    if whole < _MINUTE_S:
        return f"{age_s:.1f} s"
    for large, small, names in ((_DAY_S, _HOUR_S, "d h"), (_HOUR_S, _MINUTE_S, "h min"), (_MINUTE_S, 1, "min s")):
        if whole >= large:
            first, second = names.split()
            return f"{whole // large} {first} {whole % large // small} {second}"
    raise AssertionError("unreachable: it is at least a minute")


def _tables(look: _Look) -> Iterator[tuple[tuple[str, ...], list[tuple[str, ...]]]]:
    """The columns and rows of callers and of jobs."""
    yield _CALLER_COLUMNS, _caller_rows(look)
    yield _JOB_COLUMNS, _job_rows(look)


def _text(look: _Look, failure: ClientError | None) -> str:
    """A look, or that there is no newer one, as plain text."""
    if failure is not None:
        return f"{_no_answer(look, failure)}\n"
    parts = [f"{_headline(look)}\n"]
    for columns, rows in _tables(look):
        if rows:
            parts.append("\n" + "".join(f"{line}\n" for line in _lines(columns, rows)))
    if look.more:
        parts.append(f"and {look.more} more jobs: see --most\n")
    return "".join(parts)


def _lines(columns: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> list[str]:
    table = [columns, *rows]
    widths = [max(len(row[place]) for row in table) for place in range(len(columns))]
    return ["  ".join(f"{text:{width}}" for text, width in zip(row, widths, strict=True)).rstrip() for row in table]


def _drawn(look: _Look, failure: ClientError | None, width: int, height: int) -> "Text":
    """A look for a terminal, which fits into it.

    Args:
        look: The last look.
        failure: Failure to look again; None: the look is new.
        width: Columns of the terminal.
        height: Lines of the terminal.
    """
    from rich.text import Text

    callers, jobs = _tables(look)
    # The headline, the last line, and for each table an empty line and the names of its columns.
    room = max(2, height - 2 - 2 * sum(1 for _, rows in (callers, jobs) if rows))
    most_callers = max(1, room // 2, room - len(jobs[1]))
    most_jobs = max(1, room - min(most_callers, len(callers[1])))
    style = "bold" if failure is None else "bold reverse"
    drawn = Text(no_wrap=True, overflow="ellipsis")
    drawn.append(_headline(look) if failure is None else _no_answer(look, failure), style)
    for (columns, rows), most in ((callers, most_callers), (jobs, most_jobs)):
        if rows:
            heading, *lines = _fitted(columns, rows[:most], width)
            drawn.append("\n\n").append(heading, "bold").append("".join(f"\n{line}" for line in lines))
    more_callers = max(0, len(callers[1]) - most_callers)
    more_jobs = look.more + max(0, len(jobs[1]) - most_jobs)
    left = [f"{count} more {name}" for count, name in ((more_callers, "callers"), (more_jobs, "jobs")) if count]
    return drawn.append(f"\nand {' and '.join(left)}" if left else "")


def _fitted(columns: Sequence[str], rows: Sequence[Sequence[str]], width: int) -> list[str]:
    """The lines of a table on a terminal, of so many columns as fit, and cut off where that makes room for others."""
    from rich.cells import cell_len

    table = [columns, *rows]
    whole = {name: max(cell_len(row[place]) for row in table) for place, name in enumerate(columns)}
    least = {name: min(size, _SHORTENED.get(name, size)) for name, size in whole.items()}
    for name in _DROPPED:
        if sum(least.values()) + 2 * (len(least) - 1) > width:
            least.pop(name, None)
    left = width - sum(least.values()) - 2 * (len(least) - 1)
    for name in _SHORTENED:
        if name in least:
            more = max(0, min(left, whole[name] - least[name]))
            least[name] += more
            left -= more
    places = [(place, least[name]) for place, name in enumerate(columns) if name in least]
    return ["  ".join(_cell(row[place], size) for place, size in places).rstrip() for row in table]


def _cell(text: str, size: int) -> str:
    """A text that takes so many columns of a terminal; an ellipsis stands for what is cut off."""
    from rich.cells import cell_len, set_cell_size

    return set_cell_size(text, size) if cell_len(text) <= size else set_cell_size(text, size - 1) + "…"
