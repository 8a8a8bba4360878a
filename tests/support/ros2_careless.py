"""An existing controller that knows of no supervision layer and cares for nothing: it drives, whatever happens.

It says on standard output what it received, one JSON document a line.
"""

import json
import sys
from typing import Any

import rclpy
from geometry_msgs.msg import Twist
from rclpy.action import ActionClient
from rclpy.node import Node
from sensor_msgs.msg import LaserScan
from std_srvs.srv import SetBool
from test_msgs.action import Fibonacci

PERIOD_S = 0.02
SPEED = 0.3


class Careless(Node):  # type: ignore[misc]  # rclpy has no types
    """Sends velocities; asks for a service and an action as soon as they are there."""

    def __init__(self) -> None:
        super().__init__("careless")
        self._velocities = self.create_publisher(Twist, "cmd_vel", 10)
        self._power = self.create_client(SetBool, "/power")
        self._count = ActionClient(self, Fibonacci, "/count")
        self._is_asked = False
        self.create_subscription(LaserScan, "/scan", lambda scan: self._report("scan", list(scan.ranges)), 10)
        self.create_timer(PERIOD_S, self._drive)

    def _report(self, what: str, data: Any) -> None:
        print(json.dumps([what, data]), flush=True)

    def _drive(self) -> None:
        velocity = Twist()
        velocity.linear.x = SPEED
        self._velocities.publish(velocity)
        if not self._is_asked and self._power.service_is_ready() and self._count.server_is_ready():
            self._is_asked = True
            reply = self._power.call_async(SetBool.Request(data=True))
            reply.add_done_callback(lambda done: self._report("reply", done.result().success))
            goal = self._count.send_goal_async(Fibonacci.Goal(order=3))
            goal.add_done_callback(lambda done: self._report("goal", done.result().accepted))


def main() -> None:
    rclpy.init(args=sys.argv)
    rclpy.spin(Careless())


if __name__ == "__main__":
    main()
