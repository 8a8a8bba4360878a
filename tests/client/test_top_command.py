"""`top` against a server that answers what a test has written."""

import json
import os
import pty
import re
import subprocess
import sys
import threading
from typing import Any

import grpc
import pytest

from robosc_api.v1 import jobs_pb2
from robosc_client.main import main
from support.answers import job, load
from support.client_commands import Run, interrupted
from support.scripted_service import Refusal, scripted
from support.waiting import PATIENCE_S, wait_until

_NOW_S = 1_700_000_100
"""Time of the answers."""


def caller(name: str, first_s: int | None = None, **numbers: Any) -> Any:
    found = jobs_pb2.CallerLoad(caller=name, **numbers)
    if first_s is not None:
        found.first_queued_time.seconds = first_s
    return found


def running(number: int, started_s: int, **fields: Any) -> Any:
    found = job(id=f"run-{number}", **fields)
    found.start_time.seconds = started_s
    return found


def queued(number: int, created_s: int, **fields: Any) -> Any:
    found = job(1, jobs_pb2.JOB_STATE_QUEUED, id=f"wait-{number}", **fields)
    found.create_time.seconds = created_s
    return found


LOAD = load(
    caller("ann", _NOW_S - 4000, waiting_tasks=2, running_tasks=1, queued_jobs=2, running_jobs=1, ended_jobs=7),
    caller("bob\x1b[31m", ended_jobs=5),
)
RUNNING = running(1, _NOW_S - 75, owner="ann", label="nightly")
RUNNING.progress.stage, RUNNING.progress.message = "synthesis", "round 3"
# A list of jobs begins with the youngest.
QUEUED = [queued(2, _NOW_S - 2, owner="ann", waiting_before=1), queued(1, _NOW_S - 4000, owner="ann")]


LISTED = [
    [jobs_pb2.ListJobsResponse(jobs=[RUNNING])],
    [jobs_pb2.ListJobsResponse(jobs=QUEUED)],
]


def test_one_look_as_text(run: Run) -> None:
    with scripted(GetLoad=[[LOAD]], ListJobs=LISTED) as (address, script):
        status, out, err = run("top", "--once", "--server", address)
    assert (status, err) == (0, "")
    head, blank, columns, ann, bob, _, names, *jobs = out.splitlines()
    assert head == "22:15:00 UTC  servers 3  workers 4, busy 1  waiting 2  ended/min 12"
    assert blank == ""
    assert columns.split()[:3] == ["CALLER", "QUEUED", "RUNNING"]
    assert ann.split() == ["ann", "2", "1", "2", "1", "7", "1", "h", "6", "min"]
    assert bob.split() == ["bob\\x1b[31m", "0", "0", "0", "0", "5"]
    assert names.split() == ["JOB", "STATE", "AGE", "BEFORE", "KIND", "CALLER", "MODEL", "DOING"]
    assert [line.split() for line in jobs] == [
        "run-1 running 1 min 15 s synthesize ann nightly synthesis: round 3".split(),
        "wait-1 queued 1 h 6 min synthesize ann robot.rscd waits for a worker".split(),
        "wait-2 queued 2.0 s 1 synthesize ann robot.rscd waits for a worker".split(),
    ]
    states = [list(request.states) for request in script.of("ListJobs")]
    assert states == [[jobs_pb2.JOB_STATE_RUNNING], [jobs_pb2.JOB_STATE_QUEUED]]
    assert not any(request.all_owners for request in script.of("ListJobs"))
    assert not script.of("GetLoad")[0].all_callers


def test_one_look_as_json_of_all_callers(run: Run) -> None:
    with scripted(GetLoad=[[LOAD]], ListJobs=LISTED) as (address, script):
        status, out, _ = run("top", "--once", "--json", "--all", "--most", "1", "--server", address)
    assert (status, out.count("\n")) == (0, 1)
    found = json.loads(out)
    assert (found["workers"], found["running_tasks"], found["waiting_tasks"], found["servers"]) == (4, 1, 2, 3)
    assert (found["ended_jobs_per_minute"], found["more_jobs"]) == (12, 1)
    assert found["callers"][0] == {
        "caller": "ann",
        "waiting_tasks": 2,
        "running_tasks": 1,
        "queued_jobs": 2,
        "running_jobs": 1,
        "ended_jobs_per_minute": 7,
        "waiting_s": 4000.0,
    }
    assert found["callers"][1]["waiting_s"] is None
    assert [(item["id"], item["age_s"]) for item in found["running"] + found["queued"]] == [
        ("run-1", 75.0),
        ("wait-1", 4000.0),
    ]
    assert all(request.all_owners for request in script.of("ListJobs"))
    assert script.of("GetLoad")[0].all_callers


def test_a_caller_who_is_no_admin_is_refused_all(run: Run) -> None:
    refusal = Refusal(grpc.StatusCode.PERMISSION_DENIED, "needs a token with the scope 'admin'", "PERMISSION_DENIED")
    with scripted(GetLoad=[[refusal]], ListJobs=LISTED) as (address, script):
        status, out, err = run("top", "--once", "--all", "--server", address)
    assert (status, out) == (3, "")
    assert "the scope 'admin'" in err
    assert not script.of("ListJobs")


def test_an_earlier_server_has_no_load(run: Run) -> None:
    with scripted(GetLoad=[[Refusal(grpc.StatusCode.UNIMPLEMENTED)]]) as (address, _):
        status, out, err = run("top", "--once", "--server", address)
    assert (status, out) == (3, "")
    assert "is not a RoboSC server of this version" in err


def test_lines_of_json_come_until_it_is_interrupted() -> None:
    asked = threading.Event()
    looks = 0

    def counted(context: Any) -> Any:
        nonlocal looks
        looks += 1
        if looks == 3:
            asked.set()
        yield LOAD

    with scripted(GetLoad=[[counted]], ListJobs=[[jobs_pb2.ListJobsResponse()]]) as (address, _):
        words = ["-m", "robosc_client.main", "top", "--json", "--interval", "0.01", "--server", address]
        status, out, _ = interrupted(words, asked)
    assert status == 130
    # Each is whole, and written as soon as it is known.
    lines = [json.loads(line) for line in out.splitlines()]
    assert len(lines) >= 2
    assert {line["workers"] for line in lines if "error" not in line} == {4}


def test_a_service_that_does_not_answer_in_between_is_asked_again(run: Run) -> None:
    lost = [Refusal(grpc.StatusCode.UNAVAILABLE, "the server is shutting down", "SHUTTING_DOWN")]
    refused = [Refusal(grpc.StatusCode.UNAUTHENTICATED, "the token has expired", "TOKEN_EXPIRED")]
    # The client itself asks four times.
    answers = {"GetLoad": [[LOAD], *4 * [lost], [LOAD], *4 * [lost], refused], "ListJobs": 4 * LISTED}
    for form in ("--json", "--interval=0.02"):
        with scripted(**answers) as (address, _):
            status, out, err = run("top", "--interval", "0.01", form, "--server", address)
        assert status == 3
        assert "the token has expired" in err
        if form == "--json":
            first, failed, second, again, last = map(json.loads, out.splitlines())
            assert first == second
            assert failed == again and "is shutting down" in failed["error"]["message"]
            assert last["error"] == {"status": 3, "message": err.removeprefix("robosc-client: ").strip()}
        else:
            heads = [text for text in out.splitlines() if " UTC" in text]
            assert [text[:9] for text in heads] == ["22:15:00 ", "NO ANSWER", "22:15:00 ", "NO ANSWER"]
            assert heads[1].startswith("NO ANSWER since 22:15:00 UTC, trying again: the server at ")


def test_each_call_has_a_deadline() -> None:
    """An old look must not stay on the screen as if it were new."""
    left: list[float] = []

    def asked(context: Any) -> Any:
        left.append(context.time_remaining())
        yield LOAD

    with scripted(GetLoad=[[asked]], ListJobs=[[jobs_pb2.ListJobsResponse()]]) as (address, _):
        assert main(["top", "--once", "--server", address]) == 0
        assert main(["top", "--once", "--deadline", "3600", "--server", address]) == 0
    # gRPC rounds time limits up.
    assert left[0] < 6 < left[1]


def test_what_a_job_waits_for_is_told(run: Run) -> None:
    jobs = [queued(number, _NOW_S - 9 + number, owner="ann") for number in range(2)]
    jobs[0].progress.stage, jobs[0].progress.message = (
        "waiting",
        "the token has used up its quota of 1 CPU seconds per hour",
    )
    answers = [[jobs_pb2.ListJobsResponse()], [jobs_pb2.ListJobsResponse(jobs=jobs)]]
    with scripted(GetLoad=[[load(workers=0)]], ListJobs=answers) as (address, _):
        _, out, _ = run("top", "--once", "--server", address)
    first, second = out.splitlines()[-2:]
    assert first.endswith("  waiting: the token has used up its quota of 1 CPU seconds per hour")
    assert second.endswith("  waits for workers: there are none")


def drawn(columns: int, lines: int, answers: dict[str, Any]) -> list[str]:
    """The screen of a terminal after some looks."""
    with scripted(**answers) as (address, script):
        ours, theirs = pty.openpty()
        words = [sys.executable, "-m", "robosc_client.main", "top", "--interval", "0.01", "--server", address]
        variables = {**os.environ, "TERM": "xterm", "COLUMNS": str(columns), "LINES": str(lines)}
        process = subprocess.Popen(words, stdin=theirs, stdout=theirs, stderr=theirs, env=variables)
        os.close(theirs)
        shown = bytearray()
        reader = threading.Thread(target=_read, args=(ours, shown))
        reader.start()
        try:
            wait_until(lambda: len(script.of("GetLoad")) >= 3, "the third look")
            process.send_signal(2)
            assert process.wait(PATIENCE_S) == 130
        finally:
            process.kill()
            process.wait()
            reader.join(PATIENCE_S)
            os.close(ours)
    # The other screen is left again.
    assert shown.index(b"\x1b[?1049h") < shown.rindex(b"\x1b[?1049l")
    screens = [re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", text) for text in shown.decode().split("\x1b[H")]
    first = next(text for text in screens if " UTC" in text)
    return [text.rstrip() for text in first.rstrip().splitlines()]


def test_a_terminal_is_drawn_again_and_again_and_given_back() -> None:
    screen = drawn(150, 40, {"GetLoad": [[LOAD]], "ListJobs": 100 * LISTED})
    assert screen[0] == "22:15:00 UTC  servers 3  workers 4, busy 1  waiting 2  ended/min 12"
    assert screen[2].split() == "CALLER QUEUED RUNNING TASKS WAITING TASKS RUNNING ENDED/MIN LONGEST WAIT".split()
    assert screen[7].split()[-5:] == "ann nightly synthesis: round 3".split()
    assert len(screen) <= 40


@pytest.mark.parametrize("columns", [80, 60, 40])
def test_a_narrow_terminal_shows_who_waits_all_the_same(columns: int) -> None:
    identifiers = "0123456789abcdef" * 2
    item = queued(1, _NOW_S - 75, owner="ann-of-the-warehouse", label="nightly run of the maze")
    item.id = identifiers
    jobs = [[jobs_pb2.ListJobsResponse()], [jobs_pb2.ListJobsResponse(jobs=[item])]]
    owner = caller("ann-of-the-warehouse", _NOW_S - 75, queued_jobs=1, waiting_tasks=1)
    screen = drawn(columns, 24, {"GetLoad": [[load(owner)]], "ListJobs": 100 * jobs})
    assert max(map(len, screen)) <= columns
    of_callers, of_jobs = screen[2:4], screen[5:7]
    assert {"CALLER", "QUEUED", "LONGEST"} <= set(of_callers[0].split())
    assert of_callers[1].startswith("ann-of-") and of_callers[1].endswith("1 min 15 s")
    assert {"JOB", "STATE", "AGE", "CALLER"} <= set(of_jobs[0].split())
    assert of_jobs[1].startswith("0123456") and "ann-of-" in of_jobs[1] and "1 min 15 s" in of_jobs[1]


def test_many_callers_leave_room_for_jobs() -> None:
    callers = [caller(f"caller{number}", queued_jobs=1) for number in range(50)]
    jobs = [queued(number, _NOW_S - number, owner="ann") for number in range(50)]
    answers = 100 * [[jobs_pb2.ListJobsResponse()], [jobs_pb2.ListJobsResponse(jobs=jobs)]]
    screen = drawn(100, 24, {"GetLoad": [[load(*callers)]], "ListJobs": answers})
    assert len(screen) <= 24
    assert sum(text.startswith("caller") for text in screen) == 9
    assert sum(text.startswith("wait-") for text in screen) == 9
    assert screen[-1] == "and 41 more callers and 41 more jobs"


def _read(descriptor: int, shown: bytearray) -> None:
    while True:
        try:
            shown += os.read(descriptor, 65536)
        except OSError:
            return
