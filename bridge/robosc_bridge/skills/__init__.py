"""Skills: what the bridge can do by itself, as state machines that readings and time are passed to.

No threads, no clock, no lines: whoever runs them brings both. The velocities that they ask for are requests, which pass
the safety layer like every other.
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
