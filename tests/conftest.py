"""What holds for all tests.

Programs that they start can be interrupted, tests that share something dear run one after the other in one process, and
figures are told at the end of the run.
"""

import signal
from typing import Any

import hypothesis
import pytest
from xdist.scheduler import LoadScopeScheduling  # type: ignore[import-untyped]

# A shell starts what it runs in the background with SIGINT ignored, and programs hand that down: Ctrl-C would not reach
# the programs of the tests.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


# How long an example takes says something about the machine, which runs other tests beside.
hypothesis.settings.register_profile("busy", deadline=None, suppress_health_check=[hypothesis.HealthCheck.too_slow])
hypothesis.settings.load_profile("busy")


# They measure how quickly a robot reacts, and would disturb each other.
_IN_REAL_TIME = ("tests/end_to_end/test_demo.py", "tests/test_tutorial.py")

# Their files build packages or start servers, once for all tests of a file.
_BY_FILE = ("tests/end_to_end/", "tests/robosc/targets/cpp/")


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


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Print what tests recorded with `record_property`, whichever process measured it."""
    figures = [
        f"{name}: {value}" for report in terminalreporter.getreports("passed") for name, value in report.user_properties
    ]
    if figures:
        terminalreporter.section("figures")
        for figure in figures:
            terminalreporter.write_line(figure)
