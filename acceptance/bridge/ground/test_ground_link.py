"""The link over real UDP, TCP and a pseudo-terminal, with pymavlink's own ground station at the other end."""

import time

import pytest

from robosc_bridge.devices.interface import Velocity
from robosc_bridge.ground.link import GroundLink
from robosc_bridge.ground.settings import GroundSettings
from support.ground import PlayedDaemon

FASTEST = Velocity(0.2, 2.0)


@pytest.mark.real_time
def test_it_may_be_stopped_at_any_time() -> None:
    link = GroundLink(PlayedDaemon().operations, GroundSettings("udpin:127.0.0.1:0", FASTEST))
    link.stop()
    link = GroundLink(PlayedDaemon().operations, GroundSettings("tcp:127.0.0.1:1", FASTEST))
    assert not link.is_alive
    link.start()
    assert link.is_alive
    began_s = time.monotonic()
    link.stop()
    assert not link.is_alive
    link.stop()
    assert time.monotonic() - began_s < 2.0
