"""Skills: abilities of the bridge itself, as state machines that take readings and times.

They have no threads, no clock and no lines: their caller passes readings and times. The velocities that they return are
requests, which pass the safety layer like every other request.
"""

from robosc_bridge.skills.emergency_stop import EmergencyStop, StopEvent
from robosc_bridge.skills.rotate import Rotate, RotateState
from robosc_bridge.skills.settings import EmergencyStopSettings, LineSettings, RotateSettings

__all__ = [
    "EmergencyStop",
    "EmergencyStopSettings",
    "LineSettings",
    "Rotate",
    "RotateSettings",
    "RotateState",
    "StopEvent",
]
