"""A MAVLink rover as a drive base, over a real pseudo-terminal and real UDP."""

import pytest

from robosc_bridge.devices.interface import (
    DriveBase,
)
from robosc_bridge.devices.registry import make_drive_base
from robosc_bridge.errors import (
    DeviceError,
    LineMissingError,
)
from support.rovers import BODY, FORWARD


def test_a_missing_port_is_told() -> None:
    base: DriveBase = make_drive_base("mavlink-rover", path="/dev/none", robot=BODY)
    with pytest.raises(LineMissingError, match="/dev/none: there is no such port"):
        base.open()
    base.close()
    with pytest.raises(DeviceError, match="not open"):
        base.exchange(FORWARD)
