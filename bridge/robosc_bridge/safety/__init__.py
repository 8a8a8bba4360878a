"""The safety layer: every motion command passes through it, and by default nothing does.

It stands on the standard library and on the values of `robosc_bridge.devices.interface` alone, and is evaluated in the
thread of the drive base, from what the other threads report to it: a supervisor that hangs cannot hold it up. What each
reason leads to, and within what time, stands in docs/bridge-safety.md.
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
