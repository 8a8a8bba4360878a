"""Measures cycles of a generated Python package that publishes a Twist; a process of its own, Python 3.8 and later.

Usage: python_cycle.py rclpy|rospy FOLDER ROBOT; prints a line of JSON: seconds of `cycle` and of `publish` alone.
"""

import json
import sys
import time
from types import SimpleNamespace
from typing import Any, Dict, List, Tuple

RUNS = 3
CYCLES = 1000
WARM_UP = 50
PAUSE_S = 0.001
LIMIT_S = 20.0


class Publishing:
    """The middleware of a generated node as far as publishing goes: fills the one message, and sends it."""

    def __init__(self, publisher: Any, message: Any) -> None:
        self._publisher = publisher
        self._message = message

    def prepare(self, communication: str, data: Any) -> Any:
        """The message with the model's velocities."""
        data = data or {}
        self._message.linear.x = float(data.get("linear", {}).get("x", 0.0))
        self._message.angular.z = float(data.get("angular", {}).get("z", 0.0))
        return self._message

    def is_default(self, communication: str, message: Any) -> bool:
        """Whether it stands for standing still."""
        return bool(message.linear.x == 0.0 and message.angular.z == 0.0)

    def publish(self, communication: str, message: Any) -> None:
        """Send it."""
        self._publisher.publish(message)

    def publish_default(self, identifier: str) -> None:
        """Nothing: the robot goes on."""


def connect(kind: str) -> Tuple[Any, Any]:
    """A publisher of Twist with a subscriber, and a message."""
    from geometry_msgs.msg import Twist

    if kind == "rclpy":
        import rclpy

        rclpy.init()
        publisher = rclpy.create_node("measured").create_publisher(Twist, "/cmd_vel", 10)
        count = publisher.get_subscription_count
    else:
        import rospy

        rospy.init_node("measured")
        publisher = rospy.Publisher("/cmd_vel", Twist, queue_size=10)
        count = publisher.get_num_connections
    deadline = time.monotonic() + LIMIT_S
    while not count():
        if time.monotonic() > deadline:
            raise SystemExit("no subscriber came")
        time.sleep(0.01)
    return publisher, Twist()


def main() -> None:
    """Measure."""
    kind, folder, robot = sys.argv[1:]
    sys.path.insert(0, folder)
    from measured import Executor, Supervisor

    publisher, message = connect(kind)
    scan = SimpleNamespace(ranges=[3.0] * 360)
    found: Dict[str, List[float]] = {"cycle": [], "publish": []}
    for _ in range(RUNS):
        executor = Executor(Supervisor(), Publishing(publisher, message))
        executor.start()
        executor.receive(*(("/line/correction", 0.1) if robot == "line_follower" else ("/rotate_done", None)))
        executor.receive("/scan", scan)
        for number in range(-WARM_UP, CYCLES):
            time.sleep(PAUSE_S)
            begin = time.perf_counter()
            executor.tick()
            cycle = time.perf_counter() - begin
            time.sleep(PAUSE_S)
            begin = time.perf_counter()
            publisher.publish(message)
            alone = time.perf_counter() - begin
            if number >= 0:
                found["cycle"].append(cycle)
                found["publish"].append(alone)
    if message.linear.x <= 0.0:
        raise SystemExit("the robot did not move")
    sys.stdout.write("\n" + json.dumps(found) + "\n")
    sys.stdout.flush()
    if kind == "rclpy":
        import rclpy

        rclpy.shutdown()


if __name__ == "__main__":
    main()
