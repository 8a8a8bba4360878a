"""Calibrates the localisation of the navigation robot: looks whether odometry comes and stands still with the robot."""

import math
import sys
from collections import deque
from collections.abc import Sequence

from nav_msgs.msg import Odometry
from rclpy.qos import qos_profile_sensor_data
from std_srvs.srv import Trigger

from robosc_examples.motion import Pose, pose_of
from robosc_examples.program import HelperNode, run

LEAST_POSES = 5


class Calibrator(HelperNode):
    """Answers `/calibrate`: success if the last second's `/odom` stays within `tolerance` metres."""

    def __init__(self) -> None:
        super().__init__("calibrator")
        self._duration_s = self.number("duration", 1.0, 0.1, 60, "Seconds that are looked back.")
        self._tolerance_m = self.number("tolerance", 0.01, 0.0001, 1, "Metres by which poses at rest may differ.")
        self._poses: deque[tuple[float, Pose]] = deque(maxlen=10_000)
        self.create_subscription(Odometry, "/odom", self._read, qos_profile_sensor_data)
        self.create_service(Trigger, "/calibrate", self._calibrate)

    def _read(self, message: Odometry) -> None:
        pose = pose_of(message.pose.pose)
        if pose is not None:
            self._poses.append((self.now_s(), pose))
        self._forget()

    def _forget(self) -> None:
        while self._poses and self._poses[0][0] < self.now_s() - self._duration_s:
            self._poses.popleft()

    def _calibrate(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self._forget()
        response.message = self._fault()
        response.success = not response.message
        if response.message:
            self.get_logger().warning(f"not calibrated: {response.message}")
        return response

    def _fault(self) -> str:
        """Return the fault of the odometry, in words; empty if there is none."""
        if len(self._poses) < LEAST_POSES:
            return f"{len(self._poses)} poses within {self._duration_s:g} s; there must be {LEAST_POSES}"
        first = self._poses[0][1]
        farthest_m = max(math.dist(first[:2], pose[:2]) for _, pose in self._poses)
        return "" if farthest_m <= self._tolerance_m else f"the robot has moved by {farthest_m:.3f} m"


def main(args: Sequence[str] | None = None) -> int:
    """Run the node: the exit status."""
    return run("calibrator", Calibrator, args)


if __name__ == "__main__":
    sys.exit(main())
