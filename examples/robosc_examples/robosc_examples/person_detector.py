"""Looks for the nearest person in the laser scan."""

import math
import sys
from collections.abc import Sequence

from geometry_msgs.msg import Point
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Float32

from robosc_examples.persons import USUAL, PersonSettings, Scan, find_person, is_blind
from robosc_examples.program import HelperNode, ParameterError, run


class PersonDetector(HelperNode):
    """Turns `/scan` into `/person` (metres ahead and to the left; z says how sure it is) and `/person/distance`.

    With nobody in sight z is 0 and the distance is the LiDAR's farthest. Blind, or without a scan for `scan_timeout`
    seconds, the distance is 0: somebody might stand there.
    """

    def __init__(self) -> None:
        super().__init__("person_detector")
        usual = USUAL
        self._timeout_s = self.number("scan_timeout", 0.5, 0.05, 60.0, "Seconds without a scan that are blindness.")
        self._settings = PersonSettings(
            self.number("narrowest", usual.narrowest_m, 0, 10, "Least width of a person in metres."),
            self.number("widest", usual.widest_m, 0, 10, "Largest width of a person in metres."),
            self.number("gap", usual.gap_m, 0.001, 10, "Neighbouring ranges that differ by more are of two things."),
            self.count("beams", usual.beams, 2, 1000, "Least number of beams on a person."),
        )
        if self._settings.narrowest_m >= self._settings.widest_m:
            raise ParameterError(
                f"parameter 'narrowest' is {self._settings.narrowest_m:g}; "
                f"it must be below 'widest', which is {self._settings.widest_m:g}"
            )
        self._seen_s = -math.inf
        self._person = self.create_publisher(Point, "/person", 10)
        self._distance = self.create_publisher(Float32, "/person/distance", 10)
        self.create_subscription(LaserScan, "/scan", self._read, qos_profile_sensor_data)
        self.every(self._timeout_s / 2, self._watch)

    def _read(self, message: LaserScan) -> None:
        scan = Scan(message.ranges, message.angle_min, message.angle_increment, message.range_min, message.range_max)
        if is_blind(scan):
            self.get_logger().warning("a scan is left out: most of it is unknown", throttle_duration_sec=5.0)
            self._publish(Point(), 0.0)
            return
        self._seen_s = self.now_s()
        person = find_person(scan, self._settings)
        if person is None:
            self._publish(Point(), scan.farthest_m)
        else:
            self._publish(Point(x=person.ahead_m, y=person.left_m, z=person.confidence), person.distance_m)

    def _publish(self, place: Point, distance_m: float) -> None:
        self._person.publish(place)
        self._distance.publish(Float32(data=distance_m))

    def _watch(self) -> None:
        if self.now_s() - self._seen_s > self._timeout_s:
            self._publish(Point(), 0.0)

    def stop(self) -> None:
        """Publish a distance of 0, since somebody might stand there."""
        self._publish(Point(), 0.0)


def main(args: Sequence[str] | None = None) -> int:
    """Run the node: the exit status."""
    return run("person_detector", PersonDetector, args)


if __name__ == "__main__":
    sys.exit(main())
