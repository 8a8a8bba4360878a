"""The action server of the navigation robot: drives straight to a goal, by odometry.

It knows neither a map nor obstacles. Where a robot has Nav2, its server takes this one's place: the action's fields are
the same.
"""

import math
import sys
from collections.abc import Sequence

from geometry_msgs.msg import PoseStamped
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.task import Future
from robosc_example_interfaces.action import NavigateToPose

from robosc_examples.motion import Pose, Speed, pose_of, steered, turning_speed, wrapped
from robosc_examples.program import ParameterError, run
from robosc_examples.wheels import REST, Wheels

PROGRESS_M = 0.05
TURN_M_RAD = 0.2
"""Metres of way that a radian which is still to be turned counts for."""

NO_PROGRESS, NO_ODOMETRY = 1, 2
FAILURES = {0: "", NO_PROGRESS: "no progress", NO_ODOMETRY: "no odometry"}


class DriveToPose(Wheels):
    """One goal of `/navigate_to_pose` at a time.

    Without progress for `patience` seconds it waits as long at rest and tries again (a recovery); after
    `recoveries` of them, or as long without odometry, the goal is aborted. However a goal ends, it ends when the robot
    stands: whoever cancels it learns that then, and not when the brakes are put on.
    """

    def __init__(self) -> None:
        super().__init__("drive_to_pose")
        self._ahead_limit_m_s = self.number("speed_limit", 0.2, 0.01, 5.0, "Fastest drive in metres a second.")
        self._turn_limit_rad_s = self.number("turn_limit", 1.0, 0.05, 10.0, "Fastest turn in radians a second.")
        self._tolerance_m = self.number("tolerance", 0.05, 0.005, 1.0, "Metres by which a goal may be missed.")
        self._turn_tolerance_rad = self.number("turn_tolerance", 0.05, 0.01, 3.2, "Radians by which it may be off.")
        self._patience_s = self.number("patience", 5.0, 0.1, 600.0, "Seconds without progress before a recovery.")
        self._recoveries = self.count("recoveries", 3, 0, 1000, "Recoveries before a goal is given up.")
        self._frame = self.text("frame", "odom", "Frame of the goals.")
        if not self._frame:
            raise ParameterError("parameter 'frame' is empty; it must name the frame of the odometry")
        self._goal: tuple[object, Pose] | None = None
        self._end: Future | None = None
        # Outcome of the goal once the robot stands, and the result's code.
        self._outcome: tuple[str, int] | None = None
        self._server = ActionServer(
            self,
            NavigateToPose,
            "/navigate_to_pose",
            execute_callback=self._execute,
            goal_callback=self._judge,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
        )
        self.every(0.05, self._check_cancel)

    @property
    def is_busy(self) -> bool:
        """Return True if a goal is under way."""
        return self._goal is not None

    def _judge(self, goal: NavigateToPose.Goal) -> GoalResponse:
        frame = goal.pose.header.frame_id or self._frame
        refusal = (
            "another one is under way"
            if self.is_busy
            else f"its frame is '{frame}', and only '{self._frame}' is known"
            if frame != self._frame
            else "it is not finite, or looks nowhere"
            if pose_of(goal.pose.pose) is None
            else "there is no odometry"
            if self.pose is None
            else ""
        )
        if refusal:
            self.get_logger().warning(f"a goal is rejected: {refusal}")
            return GoalResponse.REJECT
        return GoalResponse.ACCEPT

    async def _execute(self, handle: object) -> NavigateToPose.Result:
        """Wait for the end of a goal; what drives there is called by odometry and timers."""
        if self.is_busy:  # Two goals that were both accepted before one of them began.
            handle.abort()  # type: ignore[attr-defined]
            return NavigateToPose.Result(error_code=NO_PROGRESS, error_msg="another goal is under way")
        target = pose_of(handle.request.pose.pose)  # type: ignore[attr-defined]
        assert target is not None  # noqa: S101  # _judge looked at it
        self._goal, self._end = (handle, target), Future()
        self._started_s = self._progress_s = self.now_s()
        self._shortest_m = math.inf
        self._count, self._wait_until_s = 0, -math.inf
        self._outcome = None
        code = await self._end
        return NavigateToPose.Result(error_code=code, error_msg=FAILURES[code])

    def advance(self, pose: Pose) -> None:
        """Drive on towards the goal."""
        assert self._goal is not None  # noqa: S101  # only called while busy
        if self._outcome is not None:
            self.drive(REST)
            if self.is_still:
                self._conclude()
            return
        _, target = self._goal
        distance_m = math.hypot(target.x_m - pose.x_m, target.y_m - pose.y_m)
        self._publish_feedback(pose, distance_m)
        if distance_m > self._tolerance_m:
            aside_rad = wrapped(math.atan2(target.y_m - pose.y_m, target.x_m - pose.x_m) - pose.yaw_rad)
            speed = steered(distance_m, aside_rad, self._ahead_limit_m_s, self._turn_limit_rad_s)
        else:
            aside_rad = wrapped(target.yaw_rad - pose.yaw_rad)
            if abs(aside_rad) <= self._turn_tolerance_rad:
                self._finish("succeed")
                return
            speed = Speed(0.0, turning_speed(aside_rad, self._turn_limit_rad_s))
        if self._is_getting_on(distance_m + TURN_M_RAD * abs(aside_rad)):
            self.drive(REST if self.now_s() < self._wait_until_s else speed)

    def _is_getting_on(self, way_m: float) -> bool:
        """Return True if the robot shall go on, with so much still to do; count recoveries."""
        now_s = self.now_s()
        if way_m < self._shortest_m - PROGRESS_M:
            self._progress_s, self._shortest_m = now_s, way_m
        if now_s - max(self._progress_s, self._wait_until_s) <= self._patience_s:
            return True
        if self._count >= self._recoveries:
            self._finish("abort", NO_PROGRESS)
            return False
        self._count += 1
        self._wait_until_s = now_s + self._patience_s
        return True

    def _publish_feedback(self, pose: Pose, distance_m: float) -> None:
        assert self._goal is not None  # noqa: S101  # only called while busy
        feedback = NavigateToPose.Feedback(distance_remaining=distance_m, number_of_recoveries=self._count)
        feedback.current_pose = PoseStamped()
        feedback.current_pose.header.frame_id = self._frame
        feedback.current_pose.header.stamp = self.get_clock().now().to_msg()
        feedback.current_pose.pose.position.x, feedback.current_pose.pose.position.y = pose.x_m, pose.y_m
        feedback.current_pose.pose.orientation.z = math.sin(pose.yaw_rad / 2)
        feedback.current_pose.pose.orientation.w = math.cos(pose.yaw_rad / 2)
        feedback.navigation_time.sec = int(self.now_s() - self._started_s)
        self._goal[0].publish_feedback(feedback)  # type: ignore[attr-defined]

    def _check_cancel(self) -> None:
        if self._goal is None or self._outcome is not None:
            return
        if self._goal[0].is_cancel_requested:  # type: ignore[attr-defined]
            self._finish("canceled")

    def without_odometry(self) -> None:
        """Wait for it, but not for ever."""
        if self.now_s() - self._progress_s > self._patience_s:
            if self._outcome is None:
                self._finish("abort", NO_ODOMETRY)
            # No measurement says whether the robot stands.
            self._conclude()

    def _finish(self, how: str, code: int = 0) -> None:
        """Put on the brakes; the goal ends when the robot stands."""
        self._outcome, self._progress_s = (how, code), self.now_s()
        self.drive(REST)

    def _conclude(self) -> None:
        assert self._goal is not None  # noqa: S101  # only called while busy
        assert self._end is not None  # noqa: S101  # made with the goal
        assert self._outcome is not None  # noqa: S101  # chosen before
        (handle, _), (how, code) = self._goal, self._outcome
        self._goal = None
        getattr(handle, how)()
        self._end.set_result(code)


def main(args: Sequence[str] | None = None) -> int:
    """Run the node: the exit status."""
    return run("drive_to_pose", DriveToPose, args)


if __name__ == "__main__":
    sys.exit(main())
