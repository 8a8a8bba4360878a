"""What holds for all tests: programs that they start can be interrupted, and figures are told at the end of the run."""

import signal

import pytest

# A shell starts what it runs in the background with SIGINT ignored, and programs hand that down: Ctrl-C would not reach
# the programs of the tests.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Print what tests recorded with `record_property`, whichever process measured it."""
    figures = [
        f"{name}: {value}" for report in terminalreporter.getreports("passed") for name, value in report.user_properties
    ]
    if figures:
        terminalreporter.section("figures")
        for figure in figures:
            terminalreporter.write_line(figure)
