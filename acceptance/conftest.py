"""Real parts and real time: what a run says of what was skipped and tried again, and of a machine that was late."""

from collections.abc import Generator

import pytest

from support.real_time import LATE_S, Lateness, MachineLateError, preferred


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option for machines that are to have every real part."""
    parser.addoption("--no-skips", action="store_true", help="a test that is skipped counts as failed")


@pytest.hookimpl(tryfirst=True)  # Before `-m` chooses.
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """A test in real time is tried again if the machine was late: only a calm one can judge."""
    for item in items:
        if item.get_closest_marker("real_time") is not None:
            item.add_marker(pytest.mark.flaky(reruns=4, only_rerun=[MachineLateError.__name__]))


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, None, None]:
    """Put a test that lives by the computer's clock before other work.

    Whether it got its time is part of its result.

    Raises:
        MachineLateError: It failed, and did not get its time.
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


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """With `--no-skips`, what a machine lacks is a failure."""
    report = yield
    if report.skipped and item.config.option.no_skips:
        report.outcome = "failed"
        report.longrepr = f"skipped: {report.longrepr}"
    return report


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Count what was skipped and what was tried again; pytest's own summary names them."""
    skipped, again = (len(terminalreporter.getreports(kind)) for kind in ("skipped", "rerun"))
    terminalreporter.write_line(f"{skipped} tests skipped, {again} times a test was tried again")
