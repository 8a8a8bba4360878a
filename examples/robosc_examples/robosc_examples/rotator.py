"""Rotator: turns the robot by the angle in a message, by its odometry, and reports when it is done."""

import math
import sys
from collections.abc import Sequence

from std_msgs.msg import Empty, Int16

from robosc_examples.motion import Pose, Speed, Turn, turning_speed
from robosc_examples.program import run
from robosc_examples.wheels import REST, Wheels


class Rotator(Wheels):
    """Takes degrees on `/rotate_left` and `/rotate_right`, answers on `/rotate_done`."""

    def __init__(self) -> None:
        super().__init__("rotator")
        self._limit_rad_s = self.number("speed_limit", 0.8, 0.05, 10.0, "Fastest turn in radians a second.")
        self._tolerance_rad = math.radians(
            self.number("tolerance", 1.0, 0.05, 45.0, "Degrees by which a turn may be off.")
        )
        self._asked_rad: float | None = None
        self._turn: Turn | None = None
        self._done = self.create_publisher(Empty, "/rotate_done", 10)
        self.create_subscription(Int16, "/rotate_left", lambda message: self._ask(message.data), 10)
        self.create_subscription(Int16, "/rotate_right", lambda message: self._ask(-message.data), 10)

    @property
    def is_busy(self) -> bool:
        """Return True if a turn is under way."""
        return self._asked_rad is not None

    def _ask(self, angle_deg: int) -> None:
        if self.is_busy:
            self.get_logger().warning(f"a turn by {angle_deg} degrees is left out: another one is under way")
            return
        self._asked_rad = math.radians(angle_deg)
        if self.pose is not None:
            self.advance(self.pose)

    def advance(self, pose: Pose) -> None:
        """Turn on; the first pose is where the turn begins."""
        if self._turn is None:
            self._turn = Turn(self._asked_rad or 0.0, pose.yaw_rad)
        remaining_rad = self._turn.update(pose.yaw_rad)
        if abs(remaining_rad) > self._tolerance_rad:
            self.drive(Speed(0.0, turning_speed(remaining_rad, self._limit_rad_s)))
            return
        self._asked_rad = self._turn = None
        self.drive(REST)
        self._done.publish(Empty())


def main(args: Sequence[str] | None = None) -> int:
    """Run the node: the exit status."""
    return run("rotator", Rotator, args)


if __name__ == "__main__":
    sys.exit(main())
