"""Time of a control cycle that publishes through real rclpy, and of rclpy's publish alone."""

import os
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))

from figures import micro, text_table
from null_middleware import NullMiddleware
from robosc.execution.executor import Executor
from support.generated import example_supervisor, load_system

CYCLES = 1000
RUNS = 3
PAPER = "34 / 11 / 160 / 25"


class _Publishing(NullMiddleware):
    """Fills one reused Twist and publishes it."""

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


def table() -> str:
    """Mean, minimum, maximum and standard deviation in microseconds of 3 x 1000 publishing cycles."""
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    with tempfile.TemporaryDirectory() as folder:
        os.environ.setdefault("ROS_LOG_DIR", folder)
        try:
            import rclpy
        except ImportError:
            return "Cycle with a real rclpy publish: not measured, rclpy is not installed"
        from geometry_msgs.msg import Twist

        context = rclpy.Context()
        rclpy.init(context=context, domain_id=os.getpid() % 100 + 1)
        node = rclpy.create_node("benchmark", context=context)
        try:
            publisher = node.create_publisher(Twist, "/cmd_vel", 10)
            return _table(publisher, Twist())
        finally:
            node.destroy_node()
            rclpy.shutdown(context=context)


def _table(publisher: Any, message: Any) -> str:
    alone, cycles = [], []
    for _ in range(RUNS):
        executor = Executor(
            load_system(example_supervisor("line_follower/line_follower")), _Publishing(publisher, message)
        )
        executor.start()
        for _ in range(CYCLES):
            begin = time.perf_counter()
            publisher.publish(message)
            middle = time.perf_counter()
            executor.tick()
            cycles.append(time.perf_counter() - middle)
            alone.append(middle - begin)
    rows = [
        ["line_follower, generated: cycle with publish", *micro(cycles), PAPER],
        ["rclpy publish() alone", *micro(alone), ""],
    ]
    header = ["microseconds", "mean", "min", "max", "s.d.", "paper: mean/min/max/s.d."]
    return text_table("Execution with a real rclpy publish (no subscriber)", header, rows)
