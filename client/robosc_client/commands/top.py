"""The command `top`, which shows the present load of a service, again and again."""

import argparse
import json
import sys
import time
from collections.abc import Iterable
from dataclasses import dataclass
from datetime import datetime
from typing import TYPE_CHECKING, Any

from robosc.cli.output import ExitCode
from robosc_client import Client, Job, JobState, ServiceLoad
from robosc_client.commands.connection import add_connection_arguments, exit_statuses, number_up_to, seconds
from robosc_client.commands.jobs import job_json

if TYPE_CHECKING:
    from rich.console import Group

_DESCRIPTION = """\
Show what a service does now: how many tasks its workers can do and are doing, which callers wait and for how long, and
the jobs that have not ended. Without --all, only your own jobs. Ctrl-C ends it.
"""

_INTERVAL_S = 2.0
_MOST = 20
_MOST_JOBS = 1000
_MAXIMUM_TEXT = 40

_MINUTE_S, _HOUR_S, _DAY_S = 60, 3600, 86400


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
    add_connection_arguments(parser, epilog=exit_statuses("it was shown once (--once)"))
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

    with Live(console=Console(markup=False, highlight=False), screen=True, auto_refresh=False) as live:
        while True:
            live.update(_drawn(_look(arguments, client)), refresh=True)
            time.sleep(arguments.interval)


def _print(arguments: argparse.Namespace, client: Client) -> int:
    """Print one look, or one after the other."""
    while True:
        look = _look(arguments, client)
        if arguments.json:
            sys.stdout.write(json.dumps(_document(look)) + "\n")
        else:
            _write(look)
        sys.stdout.flush()
        if arguments.once:
            return ExitCode.OK
        time.sleep(arguments.interval)


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


def _age_s(now: datetime, since: datetime | None) -> float | None:
    """Return the seconds since a moment, by the server's clock; the clocks of several servers may differ a little."""
    return None if since is None else round(max(0.0, (now - since).total_seconds()), 3)


def _headline(look: _Look) -> str:
    load = look.load
    ended = sum(caller.ended_jobs for caller in load.callers)
    return (
        f"{load.time:%H:%M:%S} UTC  servers {load.servers}  workers {load.workers}, busy {load.running_tasks}  "
        f"waiting {load.waiting_tasks}  ended in the last minute {ended}"
    )


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


_CALLER_COLUMNS = ("CALLER", "QUEUED", "RUNNING", "TASKS WAITING", "TASKS RUNNING", "ENDED/MIN", "WAITS FOR")
_JOB_COLUMNS = ("JOB", "STATE", "AGE", "BEFORE", "KIND", "CALLER", "MODEL", "DOING")

_NAMES = frozenset({"JOB", "CALLER", "MODEL", "DOING"})
"""Columns that are cut off where a terminal is narrow."""


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
            "" if job.progress is None else f"{job.progress.stage}: {job.progress.message}"[:_MAXIMUM_TEXT],
        )
        for job in (*look.running, *look.queued)
    ]


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


def _more(look: _Look) -> str:
    return f"and {look.more} more jobs: see --most\n" if look.more else ""


def _write(look: _Look) -> None:
    """Write a look as plain text."""
    sys.stdout.write(f"{_headline(look)}\n")
    for columns, rows in ((_CALLER_COLUMNS, _caller_rows(look)), (_JOB_COLUMNS, _job_rows(look))):
        if rows:
            sys.stdout.write("\n" + "".join(f"{line}\n" for line in _lines(columns, rows)))
    sys.stdout.write(_more(look))


def _lines(columns: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> list[str]:
    table = [columns, *rows]
    widths = [max(len(row[place]) for row in table) for place in range(len(columns))]
    return ["  ".join(f"{text:{width}}" for text, width in zip(row, widths, strict=True)).rstrip() for row in table]


def _drawn(look: _Look) -> "Group":
    """Return a look for a terminal; what does not fit is cut off."""
    from rich.console import Group
    from rich.table import Table
    from rich.text import Text

    parts: list[Text | Table] = [Text(_headline(look), style="bold", no_wrap=True, overflow="ellipsis"), Text("")]
    for columns, rows in ((_CALLER_COLUMNS, _caller_rows(look)), (_JOB_COLUMNS, _job_rows(look))):
        if rows:
            table = Table(box=None, pad_edge=False, header_style="bold")
            for place, name in enumerate(columns):
                # Numbers are shown whole; names make room for them.
                width = None if name in _NAMES else max(len(row[place]) for row in (columns, *rows))
                table.add_column(name, min_width=width, no_wrap=True, overflow="ellipsis")
            for row in rows:
                table.add_row(*map(Text, row))
            parts += [table, Text("")]
    parts.append(Text(_more(look).rstrip()))
    return Group(*parts)
