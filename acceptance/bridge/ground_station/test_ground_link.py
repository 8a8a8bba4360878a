"""The link over real UDP and TCP, with a station of pymavlink's codec.

It is the witness that what `tests/bridge/ground/test_ground_link.py` shows on a virtual host is so in real time.
"""

import socket
import time

import pytest

from robosc_bridge.daemon.states import OperatorCommand
from robosc_bridge.devices.interface import Velocity
from robosc_bridge.ground_station.link import GroundLink
from robosc_bridge.ground_station.settings import GroundSettings
from support.ground import PlayedDaemon, Station, of_type

FASTEST = Velocity(0.2, 2.0)


@pytest.mark.real_time
def test_a_station_is_called_arms_the_robot_and_the_link_is_soon_stopped() -> None:
    daemon = PlayedDaemon()
    daemon.answers[OperatorCommand.START] = ""
    station = Station()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as there:
        there.bind(("127.0.0.1", 0))
        there.settimeout(5.0)
        address = f"udpout:127.0.0.1:{there.getsockname()[1]}"
        link = GroundLink(daemon.operations, GroundSettings(address, FASTEST, accepts_unsigned=True))
        link.start()
        data, robot = there.recvfrom(65535)
        assert of_type("HEARTBEAT", station.hear(data))
        there.sendto(station.heartbeat() + station.command(400, 1.0), robot)
        while not of_type("COMMAND_ACK", station.heard):
            station.hear(there.recv(65535))
        assert daemon.commands == [OperatorCommand.START]
        link.stop()
    link = GroundLink(daemon.operations, GroundSettings("tcp:127.0.0.1:1", FASTEST))
    link.start()
    began_s = time.monotonic()
    link.stop()
    assert not link.is_alive
    assert time.monotonic() - began_s < 2.0
