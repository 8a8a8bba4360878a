"""Measures cycles of generated Python that drives and publishes a Twist; a program of its own, for Python 3.8 and on.

Usage: driving.py rclpy|rospy TOPIC FILE COMES RUNS CYCLES. COMES is JSON: what comes `first`, as its topic and its
data, and the `ranges` of each scan. Prints a line of JSON: seconds of each `cycle`, and of each `publish` alone.
"""

import importlib
import json
import sys
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

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
        data = data if isinstance(data, dict) else {}
        self._message.linear.x = float(data.get("linear", {}).get("x", 0.0))
        self._message.angular.z = float(data.get("angular", {}).get("z", 0.0))
        return self._message

    def is_default(self, communication: str, message: Any) -> bool:
        """Return True if a message stands for standing still."""
        return bool(message.linear.x == 0.0 and message.angular.z == 0.0)

    def publish(self, communication: str, message: Any) -> None:
        """Send it."""
        self._publisher.publish(message)

    def publish_default(self, identifier: str) -> None:
        """Do nothing: the robot goes on."""


def connect(kind: str, topic: str) -> tuple[Any, Any]:
    """A publisher of Twist that has a subscriber, and a message."""
    from geometry_msgs.msg import Twist

    if kind == "rclpy":
        import rclpy

        rclpy.init()
        publisher = rclpy.create_node("measured").create_publisher(Twist, topic, 10)
        count = publisher.get_subscription_count
    else:
        import rospy

        rospy.init_node("measured")
        publisher = rospy.Publisher(topic, Twist, queue_size=10)
        count = publisher.get_num_connections
    deadline_s = time.monotonic() + LIMIT_S
    while not count():
        if time.monotonic() > deadline_s:
            raise SystemExit("no subscriber came")
        time.sleep(0.01)
    return publisher, Twist()


def timed(work: Any) -> float:
    """Seconds that it takes, after a pause."""
    time.sleep(PAUSE_S)
    begin_s = time.perf_counter()
    work()
    return time.perf_counter() - begin_s


def main() -> None:
    """Measure."""
    kind, topic, file, comes, runs, cycles = sys.argv[1:]
    sys.path.insert(0, str(Path(file).parent))
    module = importlib.import_module(Path(file).stem)
    given = json.loads(comes)
    publisher, message = connect(kind, topic)
    scan = SimpleNamespace(ranges=given["ranges"])
    found: dict[str, list[float]] = {"cycle": [], "publish": []}
    for _ in range(int(runs)):
        executor = module.Executor(module.Supervisor(), Publishing(publisher, message))
        executor.start()
        executor.receive(*given["first"])
        for number in range(-WARM_UP, int(cycles)):
            # A sensor that says nothing for long stops the robot.
            executor.receive("/scan", scan)
            cycle_s = timed(executor.tick)
            publish_s = timed(lambda: publisher.publish(message))
            if number >= 0:
                found["cycle"].append(cycle_s)
                found["publish"].append(publish_s)
    if message.linear.x <= 0.0:
        raise SystemExit("the robot did not move")
    sys.stdout.write("\n" + json.dumps(found) + "\n")
    sys.stdout.flush()
    if kind == "rclpy":
        import rclpy

        rclpy.shutdown()


if __name__ == "__main__":
    main()
