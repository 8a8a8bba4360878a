"""This computer as a host."""

import time

import pytest

from robosc_bridge.transport.system_host import SYSTEM_HOST


def test_time_goes_on_while_the_computer_is_suspended(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(time, "clock_gettime", {time.CLOCK_BOOTTIME: 7.0}.get)
    assert SYSTEM_HOST.monotonic() == 7.0


def test_a_system_without_such_a_clock_has_the_monotonic_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(time, "CLOCK_BOOTTIME")
    monkeypatch.setattr(time, "monotonic", lambda: 7.0)
    assert SYSTEM_HOST.monotonic() == 7.0
