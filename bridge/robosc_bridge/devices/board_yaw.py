"""Rotation of an OpenCR board by its inertial sensor, for odometry that fuses it with the wheels."""

import math

from robosc_bridge.devices.odometry import Rotation
from robosc_bridge.devices.plausibility import Verdict, yaw_judge
from robosc_bridge.protocol.opencr import Block

UPTIME_MODULUS = 2**32
"""Milliseconds after which the board's uptime begins anew."""

# Variance of the yaw in a second (0.1 degrees), with what the board's filter adds.
_GYRO_RAD2_S = 3e-6
_REFRESH_S = 0.02


class BoardYaw:
    """Yaw in the last block that was read, and the uptime then.

    Args:
        name: Name of the board, for warnings.

    Attributes:
        judge: Judge of the yaw: one that jumps was calibrated, or corrected by itself, and is no rotation.
    """

    def __init__(self, name: str = "OpenCR") -> None:
        self.judge = yaw_judge(name)
        # Yaw and uptime of the last block, if its yaw counted.
        self._last: tuple[float, int] | None = None
        # Uptime that does not begin anew.
        self._uptime_ms = 0
        self._board_s = 0.0

    def forget(self) -> None:
        """Begin anew, as after the board was opened."""
        self._last = None
        self.judge.forget()

    def rotation(self, block: Block) -> Rotation | None:
        """Return the rotation since the last block; None: it is not known."""
        last, self._last = self._last, None
        self._board_s += (block.uptime_ms - self._uptime_ms) % UPTIME_MODULUS / 1000
        self._uptime_ms = block.uptime_ms
        motion = block.motion
        w, x, y, z = (motion.get(f"orientation_{axis}", 0.0) for axis in "wxyz")
        if not 0.9 < w * w + x * x + y * y + z * z < 1.1:
            # A sensor that has not started yet.
            self.judge.forget()
            return None
        # The formula is that of turtlebot3_node.
        yaw_rad = math.atan2(x * y + w * z, 0.5 - y * y - z * z)
        verdict = self.judge.judge(yaw_rad, self._board_s)
        if verdict is Verdict.REFUSED:
            return None
        self._last = yaw_rad, block.uptime_ms
        if last is None or verdict is Verdict.ANEW:
            return None
        passed_s = (block.uptime_ms - last[1]) % UPTIME_MODULUS / 1000
        angle_rad = math.remainder(yaw_rad - last[0], math.tau)
        return Rotation(angle_rad, _GYRO_RAD2_S * max(passed_s, _REFRESH_S))
