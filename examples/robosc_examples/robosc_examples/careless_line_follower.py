"""A line follower that somebody might have: it steers along the line, and heeds neither obstacles nor the stop button.

The supervised line follower is this node with a supervision layer between it and the wheels.
"""

import math
import sys
from collections.abc import Sequence

from geometry_msgs.msg import Twist
from std_msgs.msg import Float32

from robosc_examples.motion import clamped
from robosc_examples.program import HelperNode, run


class CarelessLineFollower(HelperNode):
    """Turns each `/line/correction` into a `/cmd_vel`; without one for `correction_timeout` seconds it stands still."""

    def __init__(self) -> None:
        super().__init__("careless_line_follower")
        self._speed_m_s = self.number("speed", 0.15, 0, 5, "Speed in metres a second.")
        self._gain = self.number("gain", 1.0, 0, 100, "Radians a second for each of the correction.")
        self._limit_rad_s = self.number("turn_limit", 1.0, 0, 10, "Fastest turn in radians a second.")
        self._timeout_s = self.number(
            "correction_timeout", 0.5, 0.05, 60.0, "Seconds without a correction after which it stands still."
        )
        self._seen_s = -math.inf
        self._is_moving = False
        self._commands = self.create_publisher(Twist, "/cmd_vel", 10)
        self.create_subscription(Float32, "/line/correction", self._steer, 10)
        self.every(self._timeout_s / 4, self._watch)

    def _steer(self, message: Float32) -> None:
        if not math.isfinite(message.data):
            return
        self._seen_s, self._is_moving = self.now_s(), True
        command = Twist()
        command.linear.x = self._speed_m_s
        command.angular.z = clamped(self._gain * message.data, self._limit_rad_s)
        self._commands.publish(command)

    def _watch(self) -> None:
        if self._is_moving and self.now_s() - self._seen_s > self._timeout_s:
            self.stop()

    def stop(self) -> None:
        """Stand still."""
        self._is_moving = False
        self._commands.publish(Twist())


def main(args: Sequence[str] | None = None) -> int:
    """Run the node: the exit status."""
    return run("careless_line_follower", CarelessLineFollower, args)


if __name__ == "__main__":
    sys.exit(main())
