"""Rules for the tests of all tiers: `tests`, `acceptance` and `soak`.

Programs that they start can be interrupted, random examples are those of the chosen effort, and figures are shown at
the end of the run.
"""

import asyncio
import gc
import importlib
import inspect
import os
import signal
import subprocess
from collections.abc import Generator
from typing import Any

import pytest

from support import failing
from support.effort import WRONG, load_profile

# Our programs have gRPC's own log off, which is read at its import: in this process, which runs what they run, it would
# stand among their output. Programs that are started hide it themselves.
_verbosity = os.environ.get("GRPC_VERBOSITY")
os.environ.setdefault("GRPC_VERBOSITY", "NONE")
importlib.import_module("grpc")
if _verbosity is None:
    del os.environ["GRPC_VERBOSITY"]

# A shell starts what it runs in the background with SIGINT ignored, and programs hand that down: Ctrl-C would not reach
# the programs of the tests.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

load_profile()

_wait_for_program = subprocess.Popen.__exit__


def _leave_program(program: subprocess.Popen[Any], kind: Any, error: Any, place: Any) -> None:
    """Kill a program that a test leaves by an error: it would wait for input, and the run of all tests for it."""
    if kind is not None:
        program.kill()
    _wait_for_program(program, kind, error, place)


subprocess.Popen.__exit__ = _leave_program  # type: ignore[method-assign]


def pytest_configure() -> None:
    """Run nothing with an effort that cannot be meant.

    Raises:
        pytest.UsageError: It is none.
    """
    if WRONG:
        raise pytest.UsageError(WRONG)


def pytest_collection_finish() -> None:
    """Have the collector of garbage leave alone what stays for the whole run, and look seldom for the rest.

    Ten thousand tests and all modules would be looked through again and again, and Hypothesis counts each time.
    """
    gc.collect()
    gc.freeze()
    gc.set_threshold(20_000, 10, 10)


def pytest_runtest_setup() -> None:
    """Forget what was made for the test before."""
    failing.forget()


@pytest.hookimpl(tryfirst=True)
def pytest_pyfunc_call(pyfuncitem: pytest.Function) -> None:
    """Have a test that is a coroutine run in an event loop of its own: its fixture `loop`, if it has one."""
    test = pyfuncitem.obj
    if not inspect.iscoroutinefunction(test):
        return

    def run(**fixtures: Any) -> None:
        loop = fixtures.get("loop")
        with asyncio.Runner(loop_factory=None if loop is None else lambda: loop) as runner:
            runner.run(test(**fixtures))

    pyfuncitem.obj = run


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Write down and show the random models of a test that failed."""
    report = yield
    if call.when == "call" and report.failed:
        models = failing.written(item.name, item.config.rootpath / "out" / "failing")
        if models:
            report.sections.append(("random models of this test", models))
    return report


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Print what tests recorded with `record_property`, whichever process measured it."""
    figures = [
        f"{name}: {value}" for report in terminalreporter.getreports("passed") for name, value in report.user_properties
    ]
    if figures:
        terminalreporter.section("figures")
        for figure in figures:
            terminalreporter.write_line(figure)
