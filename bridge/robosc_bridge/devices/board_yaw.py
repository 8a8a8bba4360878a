"""Rotation of an OpenCR board by its inertial sensor, for odometry that fuses it with the wheels."""

import math

from robosc_bridge.devices.odometry import Rotation
from robosc_bridge.protocol.opencr import Block

UPTIME_MODULUS = 2**32
"""Milliseconds after which the board's uptime begins anew."""

# Variance of the yaw in a second (0.1 degrees), with what the board's filter adds; rates that no body has.
_GYRO_RAD2_S = 3e-6
_FASTEST_RAD_S, _LEAST_RAD = 6.0, 0.1
_REFRESH_S = 0.02


class BoardYaw:
    """Yaw in the last block that was read, and the uptime then."""

    def __init__(self) -> None:
        self._last: tuple[float, int] | None = None

    def forget(self) -> None:
        """Begin anew, as after the board was opened."""
        self._last = None

    def rotation(self, block: Block) -> Rotation | None:
        """Return the rotation since the last block; None: it is not known."""
        motion, last = block.motion, self._last
        w, x, y, z = (motion.get(f"orientation_{axis}", 0.0) for axis in "wxyz")
        if not 0.9 < w * w + x * x + y * y + z * z < 1.1:
            # A sensor that has not started yet.
            self._last = None
            return None
        # The formula is that of turtlebot3_node.
        yaw_rad = math.atan2(x * y + w * z, 0.5 - y * y - z * z)
        self._last = yaw_rad, block.uptime_ms
        if last is None:
            return None
        passed_s = (block.uptime_ms - last[1]) % UPTIME_MODULUS / 1000
        angle_rad = math.remainder(yaw_rad - last[0], math.tau)
        if abs(angle_rad) > _FASTEST_RAD_S * passed_s + _LEAST_RAD:
            # Calibrated, or corrected by itself: no body rotates so fast.
            return None
        return Rotation(angle_rad, _GYRO_RAD2_S * max(passed_s, _REFRESH_S))
