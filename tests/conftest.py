"""What holds for all tests.

Programs that they start can be interrupted, tests that share something dear run one after the other in one process, and
figures are told at the end of the run.
"""

import importlib
import os
import signal
from collections.abc import Generator
from pathlib import Path
from typing import Any

import hypothesis
import pytest
from xdist.scheduler import LoadScopeScheduling  # type: ignore[import-untyped]

from support.real_time import LATE_S, Lateness, MachineLateError, preferred

# Our programs have gRPC's own log off, which is read at its import: in this process, which runs what they run, it would
# stand among what they tell. Programs that are started hide it themselves.
_verbosity = os.environ.get("GRPC_VERBOSITY")
os.environ.setdefault("GRPC_VERBOSITY", "NONE")
importlib.import_module("grpc")
if _verbosity is None:
    del os.environ["GRPC_VERBOSITY"]

# A shell starts what it runs in the background with SIGINT ignored, and programs hand that down: Ctrl-C would not reach
# the programs of the tests.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


# How long an example takes says something about the machine, which runs other tests beside.
hypothesis.settings.register_profile("busy", deadline=None, suppress_health_check=[hypothesis.HealthCheck.too_slow])
hypothesis.settings.load_profile("busy")


# They measure how quickly a robot reacts, and would disturb each other: `make test` runs them when all others are
# through. `pytest -m real_time` runs them alone. Single tests of other files carry the marker themselves.
_IN_REAL_TIME = (
    "tests/bridge/daemon/test_assembly.py",
    "tests/bridge/daemon/test_faults.py",
    "tests/bridge/daemon/test_follow_line.py",
    "tests/bridge/daemon/test_run.py",
    "tests/bridge/daemon/test_simulated_scanner.py",
    "tests/bridge/devices/test_drive_bases.py",
    "tests/bridge/devices/test_mavlink_rover.py",
    "tests/bridge/devices/test_mavlink_rover_faults.py",
    "tests/bridge/devices/test_mavlink_rover_obstacles.py",
    "tests/bridge/devices/test_mavlink_rover_refusals.py",
    "tests/bridge/ground/test_ground_run.py",
    "tests/bridge/remote/test_whole.py",
    "tests/bridge/terminal/test_teleop.py",
    "tests/bridge/view/test_page_bridge.py",
    "tests/end_to_end/test_demo.py",
    "tests/end_to_end/test_line_follower_demo.py",
    "tests/end_to_end/test_serial_line.py",
    "tests/end_to_end/test_serial_maze.py",
    "tests/end_to_end/test_twin_ros1.py",
    "tests/end_to_end/test_twin_ros2.py",
    "tests/end_to_end/test_twin_roslaunch.py",
    "tests/server/test_ended_in_time.py",
    "tests/test_tutorial.py",
)

# Their files build packages, or start servers or a browser, once for all tests of a file.
_BY_FILE = (
    "tests/bridge/view/test_page_",
    "tests/editors/test_vscode.py",
    "tests/end_to_end/",
    "tests/robosc/targets/cpp/",
    "tests/server/jobs/test_job_faults.py",
    "tests/server/jobs/test_job_replicas.py",
    "tests/server/test_hostile_models.py",
    "tests/server/test_reflection_client.py",
    "tests/server/test_replicas_on_a_cluster.py",
    "tests/server/test_store_faults.py",
    "tests/server/test_typescript_client.py",
    "tests/server/workers/",
)


class _Scheduling(LoadScopeScheduling):  # type: ignore[misc]
    """Hands tests out one by one, but those that belong together to one process."""

    def _split_scope(self, nodeid: str) -> str:
        file = nodeid.partition("::")[0]
        if file in _IN_REAL_TIME:
            return "real time"
        return file if file.startswith(_BY_FILE) else nodeid


def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> _Scheduling:
    """How tests are handed out to processes; asked for by `-n`."""
    return _Scheduling(config, log)


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Where tests in real time alone are asked for, files that have none are not imported: that takes a minute."""
    if config.option.markexpr != "real_time" or not collection_path.name.startswith("test_"):
        return None
    file = collection_path.relative_to(config.rootpath).as_posix()
    return None if file in _IN_REAL_TIME or "mark.real_time" in collection_path.read_text("utf-8") else True


@pytest.hookimpl(tryfirst=True)  # Before `-m` chooses.
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """A test in real time is marked, and tried again if the machine was late: only a calm one can tell."""
    for item in items:
        if item.nodeid.startswith(_IN_REAL_TIME):
            item.add_marker(pytest.mark.real_time)
        if item.get_closest_marker("real_time") is not None:
            item.add_marker(pytest.mark.flaky(reruns=4, only_rerun=[MachineLateError.__name__]))


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, None, None]:
    """What lives by the computer's clock goes before other work; whether it got its time is part of its result.

    Raises:
        MachineLateError: It failed, and did not.
    """
    if item.get_closest_marker("real_time") is None:
        return (yield)
    with preferred(), Lateness() as lateness:
        try:
            return (yield)
        except (AssertionError, pytest.fail.Exception) as error:
            if lateness.worst_s > LATE_S:
                raise MachineLateError(f"its process had to wait for {lateness.worst_s:.3f} s") from error
            raise


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Print what tests recorded with `record_property`, whichever process measured it."""
    figures = [
        f"{name}: {value}" for report in terminalreporter.getreports("passed") for name, value in report.user_properties
    ]
    if figures:
        terminalreporter.section("figures")
        for figure in figures:
            terminalreporter.write_line(figure)
