"""The safety layer: every motion command must pass it, and by default it lets none pass.

It depends only on the standard library and the values of `robosc_bridge.devices.interface`. The thread of the drive
base evaluates it from the reports of the other threads, so that a supervisor that hangs cannot hold it up.
docs/bridge-safety.md says what each reason leads to, and within what time.
"""

from robosc_bridge.safety.layer import Output, SafetyLayer
from robosc_bridge.safety.limits import SCAN_TIMEOUTS_S, SafetyLimits
from robosc_bridge.safety.reasons import LATCHING, TORQUE_OFF, Caution, Reason

__all__ = [
    "LATCHING",
    "SCAN_TIMEOUTS_S",
    "TORQUE_OFF",
    "Caution",
    "Output",
    "Reason",
    "SafetyLayer",
    "SafetyLimits",
]
