"""A small robot for the demonstration: a ROS 2 node with wheels, a line camera, a LiDAR and a stop button.

It obeys `/cmd_vel` with limited acceleration, publishes what its sensors see while the scenario goes
on, and writes every command and its own speed, sampled 100 times a second on the monotonic clock, as JSON Lines.

Usage: simulated_robot.py RECORD
"""

import json
import math
import signal
import sys
import time
from pathlib import Path
from typing import IO

import rclpy
from geometry_msgs.msg import Twist
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Empty, Float32

from scenario import HAPPENINGS, Happening

STEP_S = 0.01
ACCELERATION_M_S2 = 1.5
SENSOR_EVERY_STEPS = 5
FREE_RANGE_M = 3.0
OBSTACLE_RANGE_M = 0.25
CONNECTION_LIMIT_S = 20.0
BEAMS = 360


class SimulatedRobot(Node):  # type: ignore[misc]  # rclpy has no types
    """Wheels, sensors and the scenario, advanced by one timer.

    Args:
        record: Stream for the JSON Lines.
    """

    def __init__(self, record: IO[str]) -> None:
        super().__init__("simulated_robot")
        self.is_finished = False
        self._record = record
        self._commanded_m_s = self._commanded_rad_s = 0.0
        self._speed_m_s = 0.0
        self._x_m = self._y_m = self._heading_rad = 0.0
        self._sees_line = self._sees_obstacle = False
        self._steps = 0
        self._pending: list[Happening] = list(HAPPENINGS)
        self._started_s: float | None = None
        self._waiting_since_s = time.monotonic()
        self.create_subscription(Twist, "/cmd_vel", self._command, 10)
        self._scan = self.create_publisher(LaserScan, "/scan", qos_profile_sensor_data)
        self._correction = self.create_publisher(Float32, "/line/correction", 10)
        self._events = {
            name: self.create_publisher(Empty, topic, 10)
            for name, topic in (
                ("line lost", "/line/lost"),
                ("stop button", "/emergency_stop/stop"),
                ("resume button", "/emergency_stop/resume"),
            )
        }
        self.create_timer(STEP_S, self._step)

    def _command(self, message: Twist) -> None:
        self._commanded_m_s, self._commanded_rad_s = message.linear.x, message.angular.z
        self._write({"time_s": time.monotonic(), "command_m_s": message.linear.x})

    def _step(self) -> None:
        """One step of 10 ms: happenings that are due, motion, sensors, record."""
        now_s = time.monotonic()
        if self._started_s is None:
            self._wait_for_controller(now_s)
            return
        while self._pending and now_s - self._started_s >= self._pending[0].at_s:
            self._happen(self._pending.pop(0), now_s)
        self._move()
        self._steps += 1
        if self._steps % SENSOR_EVERY_STEPS == 0:
            self._publish_sensors()
        self._write({"time_s": now_s, "speed_m_s": self._speed_m_s, "x_m": self._x_m, "y_m": self._y_m})

    def _wait_for_controller(self, now_s: float) -> None:
        publishers = [self._scan, self._correction, *self._events.values()]
        connected = all(publisher.get_subscription_count() > 0 for publisher in publishers)
        if connected and self.count_publishers("/cmd_vel") > 0:
            self._started_s = now_s
        elif now_s - self._waiting_since_s > CONNECTION_LIMIT_S:
            raise TimeoutError(f"no controller connected within {CONNECTION_LIMIT_S:.0f} s")

    def _happen(self, happening: Happening, now_s: float) -> None:
        """Change the world, and let the sensor that notices it report at once."""
        self._write({"time_s": now_s, "happening": happening.name})
        match happening.name:
            case "line found" | "line found again":
                self._sees_line = True
            case "line lost":
                self._sees_line = False
            case "obstacle":
                self._sees_obstacle = True
            case "obstacle gone":
                self._sees_obstacle = False
            case "end":
                self.is_finished = True
        if happening.name in self._events:
            self._events[happening.name].publish(Empty())
        self._publish_sensors()

    def _move(self) -> None:
        """The wheels follow the command as fast as their acceleration allows."""
        change = ACCELERATION_M_S2 * STEP_S
        self._speed_m_s += max(-change, min(change, self._commanded_m_s - self._speed_m_s))
        if self._speed_m_s != 0.0:
            self._heading_rad += self._commanded_rad_s * STEP_S
        self._x_m += self._speed_m_s * math.cos(self._heading_rad) * STEP_S
        self._y_m += self._speed_m_s * math.sin(self._heading_rad) * STEP_S

    def _publish_sensors(self) -> None:
        range_m = OBSTACLE_RANGE_M if self._sees_obstacle else FREE_RANGE_M
        scan = LaserScan(
            angle_min=0.0,
            angle_max=2 * math.pi * (BEAMS - 1) / BEAMS,
            angle_increment=2 * math.pi / BEAMS,
            range_min=0.12,
            range_max=3.5,
            ranges=[range_m if min(beam, BEAMS - beam) <= 30 else FREE_RANGE_M for beam in range(BEAMS)],
        )
        scan.header.frame_id = "base_scan"
        scan.header.stamp = self.get_clock().now().to_msg()
        self._scan.publish(scan)
        if self._sees_line:
            # The line runs along the x axis: steer towards it, as a camera's offset would.
            self._correction.publish(Float32(data=float(-2.0 * self._y_m - self._heading_rad)))

    def _write(self, entry: dict[str, object]) -> None:
        self._record.write(json.dumps(entry) + "\n")


def main() -> int:
    """Play the scenario once."""
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    interrupted = False

    def interrupt(*_: object) -> None:
        nonlocal interrupted
        interrupted = True

    signal.signal(signal.SIGINT, interrupt)
    signal.signal(signal.SIGTERM, interrupt)
    executor = SingleThreadedExecutor()
    with Path(sys.argv[1]).open("w", encoding="utf-8") as record:
        robot = SimulatedRobot(record)
        executor.add_node(robot)
        try:
            while not interrupted and not robot.is_finished:
                executor.spin_once(timeout_sec=0.2)
        except TimeoutError as error:
            sys.stderr.write(f"simulated robot: {error}\n")
            return 1
        finally:
            executor.shutdown()
            robot.destroy_node()
            rclpy.try_shutdown()
    return 0


if __name__ == "__main__":
    sys.exit(main())
