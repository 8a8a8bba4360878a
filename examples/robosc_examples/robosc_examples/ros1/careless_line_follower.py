"""A line follower that somebody might have: it steers along the line, and heeds neither obstacles nor the stop button.

The supervised line follower is this node with a supervision layer between it and the wheels.
"""

import math
import sys
import time
from typing import Any

from geometry_msgs.msg import Twist
from std_msgs.msg import Float32

from robosc_examples.motion import clamped
from robosc_examples.ros1.program import Node, run


class CarelessLineFollower(Node):
    """Turns each `/line/correction` into a `/cmd_vel`; without one for `correction_timeout` seconds it stands still."""

    def __init__(self) -> None:
        super().__init__()
        self._speed_m_s = self.number("speed", 0.15, 0, 5)
        self._gain = self.number("gain", 1.0, 0, 100)
        self._limit_rad_s = self.number("turn_limit", 1.0, 0, 10)
        self._timeout_s = self.number("correction_timeout", 0.5, 0.05, 60.0)
        self._seen_s = -math.inf
        self._is_moving = False
        self._commands = self.publisher("/cmd_vel", Twist)
        self.subscribe("/line/correction", Float32, self._steer)

    def _steer(self, message: Any) -> None:
        if not math.isfinite(message.data):
            return
        self._seen_s, self._is_moving = time.monotonic(), True
        command = Twist()
        command.linear.x = self._speed_m_s
        command.angular.z = clamped(self._gain * message.data, self._limit_rad_s)
        self._commands.publish(command)

    def tick(self) -> None:
        """Stand still without corrections."""
        if self._is_moving and time.monotonic() - self._seen_s > self._timeout_s:
            self.stop()

    def stop(self) -> None:
        """Stand still."""
        self._is_moving = False
        self._commands.publish(Twist())


def main() -> int:
    """Run the node: the exit status."""
    return run("careless_line_follower", CarelessLineFollower)


if __name__ == "__main__":
    sys.exit(main())
