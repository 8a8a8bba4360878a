"""A rover on a virtual host."""

from collections.abc import Iterator

import pytest

from robosc_bridge.devices import mavlink_rover
from support.rovers import Bench, rig


@pytest.fixture
def bench() -> Iterator[Bench]:
    with rig() as found:
        yield found


@pytest.fixture
def hasty(monkeypatch: pytest.MonkeyPatch) -> None:
    """Waits for what never comes are short."""
    for name, limit_s in (("_ANSWER_LIMIT_S", 0.2), ("_SHOWN_LIMIT_S", 1.0), ("_FIRST_HEARTBEAT_LIMIT_S", 1.0)):
        monkeypatch.setattr(mavlink_rover, name, limit_s)
