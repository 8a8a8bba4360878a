"""A few jobs on a service under a proxy while its parts are killed; `soak/outgrow.py` runs thousands."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from support.outgrown_site import Kind, proxy_program
from support.postgresql import skip_without_postgresql

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
