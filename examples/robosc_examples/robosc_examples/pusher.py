"""Pushes what stands before the robot: drives ahead by a distance, at the speed that a message asks for."""

import math
import sys
from collections.abc import Sequence

from std_msgs.msg import Bool, Empty, Float32

from robosc_examples.motion import Pose, Speed
from robosc_examples.program import run
from robosc_examples.wheels import REST, Wheels


class Pusher(Wheels):
    """Takes metres a second on `/push`; `/pushed` reports that the push is over, successful or not.

    It ends after its distance, when `/bumper` is pressed, or after `push_timeout` seconds.
    """

    def __init__(self) -> None:
        super().__init__("pusher")
        self._limit_m_s = self.number("speed_limit", 0.6, 0.01, 5.0, "Fastest push in metres a second.")
        self._distance_m = self.number("distance", 0.3, 0.01, 10.0, "How far to push, in metres.")
        self._push_timeout_s = self.number("push_timeout", 5.0, 0.1, 600.0, "Longest push in seconds.")
        self._speed_m_s = 0.0
        self._start: Pose | None = None
        self._until_s = 0.0
        self._is_pressed = False
        self._pushed = self.create_publisher(Empty, "/pushed", 10)
        self.create_subscription(Float32, "/push", self._ask, 10)
        self.create_subscription(Bool, "/bumper", self._touch, 10)
        self.every(0.05, self._check_time)

    @property
    def is_busy(self) -> bool:
        """Return True if a push is under way."""
        return self._speed_m_s > 0.0

    def _ask(self, message: Float32) -> None:
        if self.is_busy:
            self.get_logger().warning("a push is left out: another one is under way")
            return
        if not message.data > 0.0:
            self.get_logger().warning(f"no push at {message.data} m/s: the speed must be above zero")
            self._pushed.publish(Empty())
            return
        self._speed_m_s = min(message.data, self._limit_m_s)
        self._start, self._until_s = None, self.now_s() + self._push_timeout_s
        if self._is_pressed:
            self._end("the bumper is pressed")

    def advance(self, pose: Pose) -> None:
        """Push on; the first pose is where the push begins."""
        self._start = start = self._start or pose
        if math.hypot(pose.x_m - start.x_m, pose.y_m - start.y_m) >= self._distance_m:
            self._end("done")
        else:
            self.drive(Speed(self._speed_m_s, 0.0))

    def _touch(self, message: Bool) -> None:
        self._is_pressed = message.data
        if self._is_pressed and self.is_busy:
            self._end("the bumper is pressed")

    def _check_time(self) -> None:
        if self.is_busy and self.now_s() > self._until_s:
            self._end(f"not done within {self._push_timeout_s:g} s")

    def _end(self, why: str) -> None:
        self._speed_m_s = 0.0
        self.drive(REST)
        self.get_logger().info(f"the push is over: {why}")
        self._pushed.publish(Empty())


def main(args: Sequence[str] | None = None) -> int:
    """Run the node: the exit status."""
    return run("pusher", Pusher, args)


if __name__ == "__main__":
    sys.exit(main())
