import sys
from collections.abc import Iterator

import pytest
from dynamixel_sdk import port_handler


@pytest.fixture(autouse=True)
def patient_sdk(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """dynamixel-sdk spins while it waits: the simulator's thread must not wait 5 ms for each of its turns.

    And on a busy machine it may have to wait for one longer than the SDK's 34 ms.
    """
    before_s = sys.getswitchinterval()
    sys.setswitchinterval(0.0001)
    monkeypatch.setattr(port_handler, "LATENCY_TIMER", 100)
    yield
    sys.setswitchinterval(before_s)
