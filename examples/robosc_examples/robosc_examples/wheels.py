"""A node that moves the robot by its odometry, and only as long as that keeps coming."""

import math

from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rclpy.qos import qos_profile_sensor_data

from robosc_examples.motion import Pose, Speed, pose_of
from robosc_examples.program import HelperNode

REST = Speed(0.0, 0.0)
STILL_M_S, STILL_RAD_S = 0.01, 0.03
"""Measured speeds up to which the robot stands."""


class Wheels(HelperNode):
    """Reads `/odom` and sends `/cmd_vel`, which it leaves alone while it has nothing to do.

    Without odometry for `odometry_timeout` seconds the wheels stand still; the job goes on when it is back.

    Args:
        name: The node's name.

    Attributes:
        is_still: True if the robot stood when its odometry came last.
    """

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self._timeout_s = self.number(
            "odometry_timeout", 0.5, 0.05, 60.0, "Seconds without odometry after which the wheels stand still."
        )
        self._pose: Pose | None = None
        self._seen_s = -math.inf
        self._is_moving = False
        self.is_still = False
        self._is_reported = False
        self._commands = self.create_publisher(Twist, "/cmd_vel", 10)
        # Takes it from reliable drivers and from others.
        self.create_subscription(Odometry, "/odom", self._read, qos_profile_sensor_data)
        self.every(self._timeout_s / 4, self._watch)

    @property
    def pose(self) -> Pose | None:
        """Pose of the robot; None while nobody knows it."""
        return self._pose if self.now_s() - self._seen_s <= self._timeout_s else None

    @property
    def is_busy(self) -> bool:
        """Return True if there is a job that needs odometry."""
        raise NotImplementedError

    def advance(self, pose: Pose) -> None:
        """Go on with the job, from a new pose."""
        raise NotImplementedError

    def without_odometry(self) -> None:
        """Do what a job wants while nobody knows where the robot is; called again and again."""

    def drive(self, speed: Speed) -> None:
        """Move the robot."""
        message = Twist()
        message.linear.x, message.angular.z = float(speed.ahead_m_s), float(speed.turn_rad_s)
        self._commands.publish(message)
        self._is_moving = speed != REST

    def stop(self) -> None:
        """Bring the robot to rest if this node moves it; another's velocity is not touched."""
        if self._is_moving:
            self.drive(REST)

    def _read(self, message: Odometry) -> None:
        pose = pose_of(message.pose.pose)
        if pose is None:
            self.get_logger().warning(
                "odometry that is not finite, or that looks nowhere, is left out", throttle_duration_sec=5.0
            )
            return
        self._pose, self._seen_s, self._is_reported = pose, self.now_s(), False
        linear, angular = message.twist.twist.linear, message.twist.twist.angular
        self.is_still = math.hypot(linear.x, linear.y) <= STILL_M_S and abs(angular.z) <= STILL_RAD_S
        if self.is_busy:
            self.advance(pose)

    def _watch(self) -> None:
        if not self.is_busy or self.pose is not None:
            return
        self.stop()
        if not self._is_reported:
            self.get_logger().error(f"standing still: no odometry for {self._timeout_s:g} s")
            self._is_reported = True
        self.without_odometry()
