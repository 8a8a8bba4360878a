import pytest
from dynamixel_sdk import port_handler


@pytest.fixture(autouse=True)
def patient_sdk(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a busy machine an answer may take longer than the SDK's 34 ms."""
    monkeypatch.setattr(port_handler, "LATENCY_TIMER", 100)
