"""Door, tray and battery around the courier, as a node beside the simulated robot.

On standard output it prints what becomes of the simulated world, as commands for the twin's standard input.
"""

import math
import sys
from collections.abc import Sequence

from nav_msgs.msg import Odometry
from rclpy.qos import qos_profile_sensor_data
from std_msgs.msg import Empty

from robosc_examples.house import COMMANDS, REPORTED, House, Settings
from robosc_examples.motion import Pose, pose_of
from robosc_examples.program import HelperNode, run

PERIOD_S = 0.1


class Household(HelperNode):
    """Answers on the topics of `house`, by odometry and the steady clock."""

    def __init__(self) -> None:
        super().__init__("household")
        opens_s = self.number("opens_after", 6.0, 0.0, 3600.0, "Seconds until the door is open; 0: it never opens.")
        takes_s = self.number("takes", 5.0, 0.0, 3600.0, "Seconds until somebody has emptied the tray.")
        drain_v_s = self.number("drain", 0.008, 0.0, 10.0, "Volts that the battery loses in a second.")
        charge_v_s = self.number("charge", 0.08, 0.0, 10.0, "Volts that it gains in a second at the dock.")
        self._speed = self.number("speed", 1.0, 0.1, 100.0, "Factor by which the world is faster than the clock.")
        self._house = House(Settings(opens_s or math.inf, takes_s, drain_v_s, charge_v_s))
        self._pose = Pose(0.0, 0.0, 0.0)
        self._shown = ("obstacle door back", f"battery {self._house.battery_v:.2f}")
        self._sent_to = {topic: self.create_publisher(Empty, topic, 10) for topic in REPORTED}
        for topic in COMMANDS:
            self.create_subscription(Empty, topic, lambda _, topic=topic: self._house.receive(topic), 10)
        self.create_subscription(Odometry, "/odom", self._read, qos_profile_sensor_data)
        self.every(PERIOD_S, self._live)

    def _read(self, message: Odometry) -> None:
        self._pose = pose_of(message.pose.pose) or self._pose

    def _live(self) -> None:
        reported = self._house.advance(self.now_s() * self._speed, self._pose.x_m, self._pose.y_m)
        shown = (
            f"obstacle door {'away' if self._house.is_door_open else 'back'}",
            f"battery {self._house.battery_v:.2f}",
        )
        for command, before in zip(shown, self._shown, strict=True):
            if command != before:
                sys.stdout.write(f"{command}\n")
        sys.stdout.flush()
        self._shown = shown
        # The world is changed before anybody relies on it.
        for topic in reported:
            self._sent_to[topic].publish(Empty())


def main(args: Sequence[str] | None = None) -> int:
    """Run the node: the exit status."""
    return run("household", Household, args)


if __name__ == "__main__":
    sys.exit(main())
