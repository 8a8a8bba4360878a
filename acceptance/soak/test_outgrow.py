"""A few jobs on a service under a proxy while its parts are killed; `soak/outgrow.py` runs thousands."""

import json
import subprocess
import sys
from pathlib import Path

import psycopg
import pytest

from support.earlier_databases import script_of
from support.job_ledger import note_ends, stored_jobs
from support.outgrown_site import Kind, proxy_program
from support.postgresql import postgresql, skip_without_postgresql

PROGRAM = Path(__file__).parents[2] / "soak" / "outgrow.py"


@pytest.mark.real_time
@pytest.mark.timeout(1200)
def test_every_job_ends_once_with_its_right_result(tmp_path: Path) -> None:
    skip_without_postgresql()
    if proxy_program() is None:
        pytest.skip("haproxy is not installed (Debian's package: haproxy)")
    file = tmp_path / "ledger.json"
    command = [sys.executable, str(PROGRAM), "--jobs", "60", "--kill-every", "5", "--seed", "1", "--json", str(file)]
    done = subprocess.run([*command, "--folder", str(tmp_path)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    ledger = json.loads(file.read_text())
    assert ledger["problems"] == []
    assert ledger["accepted"] == ledger["answered"] == 60 + sum(ledger["given_up"].values())
    assert ledger["right"] == 60
    assert ledger["wrong"] == ledger["lost"] == ledger["ended_twice"] == 0
    assert set(ledger["kills"]) == set(Kind) and sum(ledger["kills"].values()) > 0


def test_throughput_is_measured(tmp_path: Path) -> None:
    skip_without_postgresql()
    if proxy_program() is None:
        pytest.skip("haproxy is not installed (Debian's package: haproxy)")
    command = [sys.executable, str(PROGRAM), "--jobs", "20", "--throughput", "1", "--folder", str(tmp_path / "logs")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    (run,) = json.loads(done.stdout)["throughput"]
    assert (run["workers"], run["accepted"], run["right"], run["problems"]) == (1, 20, 20, [])
    assert set(run["cpu_ms_per_job"]) == {*Kind, "proxy"} and min(run["cpu_ms_per_job"].values()) >= 0
    assert 0 < run["work_cpu_ms_per_job"]["p50"] <= run["work_cpu_ms_per_job"]["max"]
    assert run["jobs_per_s"] > 0 and run["memory_mb"]["server"] > 0
    assert "kills" not in run


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["--jobs", "0"], "--jobs, --workers and --throughput take numbers above 0"),
        (["--kill-every", "nan"], "--kill-every takes a number of seconds, or 0 to kill nothing"),
        (["--throughput", "1", "--kill-every", "5"], "--throughput kills nothing"),
        (["--throughput", "1", "--workers", "2"], "without --kill-every and --workers"),
        (["--json", "/nowhere/ledger.json"], "/nowhere/ledger.json: No such file or directory"),
        (["--folder", "/dev/null"], "/dev/null: File exists"),
    ],
)
def test_wrong_use_is_reported_before_anything_starts(words: list[str], complaint: str) -> None:
    done = subprocess.run([sys.executable, PROGRAM, *words], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (2, "")
    assert complaint in done.stderr.splitlines()[-1]


def test_the_database_notes_each_end_of_a_job() -> None:
    skip_without_postgresql()
    with postgresql() as server:
        url = server.new_database()
        with psycopg.connect(url) as connection:
            connection.execute(script_of(2, "postgresql").encode())
            connection.execute("UPDATE jobs SET ended_us = NULL, state = 'running', reason = NULL")
        note_ends(url)
        # All end once, and two of them again: for another reason, and after they have been taken up again.
        changes = [
            "UPDATE jobs SET progress = 'round 2'",
            "UPDATE jobs SET ended_us = 5, state = 'succeeded'",
            "UPDATE jobs SET expires_us = 7",
            "UPDATE jobs SET reason = 'WORKER_DIED', state = 'failed' WHERE id = 'done'",
            "UPDATE jobs SET ended_us = NULL WHERE id = 'zoe'",
            "UPDATE jobs SET ended_us = 6 WHERE id = 'zoe'",
        ]
        seen = []
        for change in changes:
            with psycopg.connect(url) as connection:
                connection.execute(change.encode())
            seen.append({job.id: job.ends for job in stored_jobs(url)})
    others = seen[0].keys() - {"done", "zoe"}
    assert others and set(seen[0].values()) == {0}
    assert all(set(ends.values()) == {1} for ends in seen[1:3])
    assert seen[-1]["done"] > 1 and seen[-1]["zoe"] > 1
    assert {seen[-1][other] for other in others} == {1}
