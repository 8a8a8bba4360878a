"""Cycles of a generated controller that publishes a Twist through rclpy; a program of its own.

Usage: python -m robosc_bridge.experiments.evaluate_rclpy FILE EXPERIMENT RUNS CYCLES; the last line that it prints is a
JSON array of seconds. It starts its own subscriber, on a topic and a domain of their own.
"""

import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from robosc_bridge.experiments.evaluate_cycles import LIMIT_S, Nothing, feed, free_way, load_controller

WARM_UP = 50
PAUSE_S = 0.001
_SUBSCRIBE = "--subscribe"


class Publishing(Nothing):
    """The middleware of a generated node as far as publishing goes: fills the one message, and sends it."""

    def __init__(self, publisher: Any, message: Any) -> None:
        self._publisher = publisher
        self._message = message
        self.has_moved = False

    def prepare(self, communication: str, data: Any) -> Any:
        """The message with the model's velocities."""
        data = data if isinstance(data, dict) else {}
        self._message.linear.x = float(data.get("linear", {}).get("x", 0.0))
        self._message.angular.z = float(data.get("angular", {}).get("z", 0.0))
        return self._message

    def is_default(self, communication: str, message: Any) -> bool:
        """Whether it stands for standing still."""
        return bool(message.linear.x == 0.0 and message.angular.z == 0.0)

    def publish(self, communication: str, message: Any) -> None:
        """Send it."""
        self.has_moved = self.has_moved or message.linear.x > 0.0
        self._publisher.publish(message)


def main() -> None:
    """Publish and measure, or subscribe."""
    import rclpy
    from geometry_msgs.msg import Twist

    topic = os.environ.setdefault("ROBOSC_EVALUATION_TOPIC", f"/robosc_evaluation_{os.getpid()}")
    os.environ.setdefault("ROS_DOMAIN_ID", str(os.getpid() % 100))
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    rclpy.init()
    node = rclpy.create_node("robosc_evaluation")
    if sys.argv[1:] == [_SUBSCRIBE]:
        node.create_subscription(Twist, topic, lambda message: None, 10)
        parent = os.getppid()
        while os.getppid() == parent:
            rclpy.spin_once(node, timeout_sec=0.5)
        return
    command = [sys.executable, "-m", "robosc_bridge.experiments.evaluate_rclpy", _SUBSCRIBE]
    subscriber = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)  # noqa: S603
    try:
        publisher = node.create_publisher(Twist, topic, 10)
        deadline_s = time.monotonic() + LIMIT_S / 4
        while not publisher.get_subscription_count():
            if time.monotonic() > deadline_s:
                raise SystemExit("no subscriber came")
            time.sleep(0.01)
        samples = measured(publisher, Twist())
    finally:
        subscriber.kill()
        subscriber.wait()
    sys.stdout.write("\n" + json.dumps(samples) + "\n")
    sys.stdout.flush()
    rclpy.shutdown()


def measured(publisher: Any, message: Any) -> list[float]:
    """Seconds of each cycle, where the way is free and the robot drives."""
    file, experiment, runs, cycles = sys.argv[1:]
    module = load_controller(Path(file))
    samples = []
    middleware = Publishing(publisher, message)
    for _ in range(int(runs)):
        executor = module.Executor(module.Supervisor(), middleware)
        executor.start()
        executor.receive(*feed(experiment, 0))
        for number in range(-WARM_UP, int(cycles)):
            time.sleep(PAUSE_S)
            # A sensor that says nothing for long stops the robot.
            executor.receive(*free_way())
            begin_s = time.perf_counter()
            executor.tick()
            took_s = time.perf_counter() - begin_s
            if number >= 0:
                samples.append(took_s)
    if not middleware.has_moved:
        raise SystemExit("the robot did not move")
    return samples


if __name__ == "__main__":
    main()
