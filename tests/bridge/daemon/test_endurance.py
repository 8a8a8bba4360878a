"""A bridge that drives through a room in virtual time: nothing grows, the schedule does not drift, no wall is met.

A short version of the benchmark: real drivers, decoders, loop and safety layer on simulated devices.
"""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

PROGRAM = Path(__file__).parents[2] / "benchmarks" / "bridge" / "endurance.py"
HOURS = 0.005
SECONDS = 18


@pytest.mark.parametrize(("base", "period_s"), [("dynamixel", 0.010), ("opencr", 0.020)])
def test_a_robot_wanders_on_and_on(base: str, period_s: float) -> None:
    command = [sys.executable, str(PROGRAM), "--hours", str(HOURS), "--base", base, "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=280)
    assert done.returncode == 0, done.stderr
    found: dict[str, Any] = json.loads(done.stdout)
    # Not in its first moments: all devices must be there, and one full revolution.
    assert SECONDS / period_s - 100 < found["decisions"] <= SECONDS / period_s
    assert abs(found["drift_s"]) < 1e-6
    assert found["overruns"] == 0
    assert found["late_s"] < 1e-3
    assert 10 * SECONDS - 10 < found["scans"] <= 10 * SECONDS
    # The exchanges come with the period, and a few were hurried.
    assert 50 * SECONDS - 50 < found["exchanges"] < 60 * SECONDS
    assert found["driven_m"] > 1.0
    assert found["collisions"] == 0
    assert found["inbox"] == found["files"] == 0
    assert found["objects"] < 100
    assert found["memory_kb"] < 2000
