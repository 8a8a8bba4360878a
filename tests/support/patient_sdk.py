"""Dynamixel's SDK on a busy machine."""

import pytest
from dynamixel_sdk import port_handler


@pytest.fixture(autouse=True)
def patient_sdk(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let an answer take longer than the SDK's 34 ms."""
    monkeypatch.setattr(port_handler, "LATENCY_TIMER", 100)
