"""Rotator: turns the robot by the angle in a message, by its odometry, and reports when it is done."""

import math
import sys
import time
from typing import Any

import rospy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from std_msgs.msg import Empty, Int16

from robosc_examples.motion import Pose, Turn, pose_of, turning_speed
from robosc_examples.ros1.program import Node, run


class Rotator(Node):
    """Takes degrees on `/rotate_left` and `/rotate_right`, answers on `/rotate_done`; leaves the wheels alone else."""

    def __init__(self) -> None:
        super().__init__()
        self._limit_rad_s = self.number("speed_limit", 0.8, 0.05, 10.0)
        self._tolerance_rad = math.radians(self.number("tolerance", 1.0, 0.05, 45.0))
        self._timeout_s = self.number("odometry_timeout", 0.5, 0.05, 60.0)
        self._asked_rad: float | None = None
        self._turn: Turn | None = None
        self._seen_s = -math.inf
        self._is_moving = False
        self._commands = self.publisher("/cmd_vel", Twist)
        self._done = self.publisher("/rotate_done", Empty)
        self.subscribe("/rotate_left", Int16, lambda message: self._ask(message.data))
        self.subscribe("/rotate_right", Int16, lambda message: self._ask(-message.data))
        self.subscribe("/odom", Odometry, self._read)

    def _ask(self, angle_deg: int) -> None:
        if self._asked_rad is not None:
            rospy.logwarn("a turn by %d degrees is left out: another one is under way", angle_deg)
            return
        self._asked_rad = math.radians(angle_deg)

    def _read(self, message: Any) -> None:
        pose = pose_of(message.pose.pose)
        if pose is None:
            rospy.logwarn_throttle(5.0, "odometry that is not finite, or that looks nowhere, is left out")
            return
        self._seen_s = time.monotonic()
        if self._asked_rad is not None:
            self._advance(self._asked_rad, pose)

    def _advance(self, asked_rad: float, pose: Pose) -> None:
        """Turn on; the first pose is where the turn begins."""
        if self._turn is None:
            self._turn = Turn(asked_rad, pose.yaw_rad)
        remaining_rad = self._turn.update(pose.yaw_rad)
        if abs(remaining_rad) > self._tolerance_rad:
            self._drive(turning_speed(remaining_rad, self._limit_rad_s))
            return
        self._asked_rad = self._turn = None
        self._drive(0.0)
        self._done.publish(Empty())

    def _drive(self, turn_rad_s: float) -> None:
        message = Twist()
        message.angular.z = turn_rad_s
        self._commands.publish(message)
        self._is_moving = turn_rad_s != 0.0

    def tick(self) -> None:
        """Stand still without odometry."""
        if self._is_moving and time.monotonic() - self._seen_s > self._timeout_s:
            rospy.logerr("standing still: no odometry for %g s", self._timeout_s)
            self.stop()

    def stop(self) -> None:
        """Bring the robot to rest if this node moves it; another's velocity is not touched."""
        if self._is_moving:
            self._drive(0.0)


def main() -> int:
    """Run the node: the exit status."""
    return run("rotator", Rotator)


if __name__ == "__main__":
    sys.exit(main())
