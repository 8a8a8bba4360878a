"""`python -m robosc_simulated.ros.ros2`: the twin as a ROS 2 node.

The names and types are those of a TurtleBot3 (ROBOTIS-GIT/turtlebot3); quality of service as its drivers': best effort
for scans and pictures, reliable for the rest, which serves subscribers of either kind.
"""

import argparse
import math
import sys
from array import array
from collections.abc import Sequence
from types import TracebackType
from typing import Any, Self

from robosc_simulated.ros.readings import (
    CAMERA,
    FOOTPRINT,
    ODOM,
    SCANNER,
    Battery,
    Clock,
    Mounted,
    Odometry,
    Picture,
    Reading,
    Scan,
)
from robosc_simulated.ros.robot import RosRobot
from robosc_simulated.ros.serving import MissingRosError, Pacer, ServingError, parser, serve

NODE = "turtlebot3_twin"
ROS_ARGUMENTS = "--ros-args"


class Ros2Node:
    """The node; use it as a context manager.

    Args:
        robot: Robot that it shows.
        pacer: Pacer that brings the world up to now before a velocity acts.
        is_stamped: True if velocities come as `TwistStamped`, unless the TurtleBot3's own parameter
            `enable_stamped_cmd_vel` says otherwise.
        arguments: Arguments after `--ros-args`.

    Raises:
        MissingRosError: rclpy or its messages are not installed.
        ServingError: A parameter has a wrong type.
    """

    def __init__(
        self, robot: RosRobot, pacer: Pacer, *, is_stamped: bool = False, arguments: Sequence[str] = ()
    ) -> None:
        # The message is that of `robosc_bridge.ros2.node`, which no simulator may import; it is short, and the imports
        # differ.
        try:
            import rclpy
            from geometry_msgs.msg import TransformStamped, Twist, TwistStamped
            from nav_msgs.msg import Odometry as OdometryMessage
            from rclpy.executors import SingleThreadedExecutor
            from rclpy.node import Node
            from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
            from rclpy.signals import SignalHandlerOptions
            from rosgraph_msgs.msg import Clock as ClockMessage
            from sensor_msgs.msg import BatteryState, Image, LaserScan
        except ImportError as error:
            raise MissingRosError(
                f"ROS 2 is not there ({error}): source its setup file, or install RoboSC with its extra `ros2`"
            ) from error
        self._rclpy = rclpy
        self._robot = robot
        self._pacer = pacer
        self._context = rclpy.context.Context()
        given = [NODE, ROS_ARGUMENTS, *arguments] if arguments else [NODE]
        rclpy.init(args=given, context=self._context, signal_handler_options=SignalHandlerOptions.NO)
        self._node = node = Node(NODE, context=self._context)
        has_header = self._is_stamped(is_stamped)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(node)
        self._types = (ClockMessage, LaserScan, OdometryMessage, Image, BatteryState)
        self._transform_type = TransformStamped
        self._to_clock = node.create_publisher(ClockMessage, "/clock", 10)
        self._to_scan = node.create_publisher(LaserScan, "/scan", qos_profile_sensor_data)
        self._to_odometry = node.create_publisher(OdometryMessage, "/odom", 10)
        self._to_picture = node.create_publisher(Image, "/camera/image_raw", qos_profile_sensor_data)
        self._to_battery = node.create_publisher(BatteryState, "/battery_state", 10)
        self._to_tf: Any = None
        try:
            from tf2_msgs.msg import TFMessage
        except ImportError:
            node.get_logger().warning("no transforms are sent: the package tf2_msgs is not installed")
        else:
            self._tf_type = TFMessage
            self._to_tf = node.create_publisher(TFMessage, "/tf", 100)
            latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
            self._to_static = node.create_publisher(TFMessage, "/tf_static", latched)
            self._to_static.publish(
                TFMessage(transforms=[mounting(TransformStamped(), frame) for frame in robot.frames])
            )
        if has_header:
            node.create_subscription(TwistStamped, "/cmd_vel", lambda message: self._obey(message.twist), 10)
        else:
            node.create_subscription(Twist, "/cmd_vel", self._obey, 10)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._executor.shutdown()
        self._node.destroy_node()
        self._rclpy.try_shutdown(context=self._context)

    def _is_stamped(self, default: bool) -> bool:
        """Return True if velocities come with a header: the parameter of the TurtleBot3's bring-up."""
        from rcl_interfaces.msg import ParameterDescriptor
        from rclpy.exceptions import InvalidParameterTypeException

        name = "enable_stamped_cmd_vel"
        descriptor = ParameterDescriptor(description="Velocities come as TwistStamped.", read_only=True)
        try:
            given: bool = self._node.declare_parameter(name, default, descriptor).value
        except InvalidParameterTypeException as error:
            raise ServingError(f"the parameter {name} must be true or false") from error
        return given

    def process_commands(self, longest_s: float) -> None:
        """Obey velocities, all that have come; comes back after some, or after so long at most."""
        before = self._robot.commands
        self._executor.spin_once(timeout_sec=longest_s)
        # Those that have waited come together: the world must not go on in between as if each were new.
        while self._robot.commands > before:
            before = self._robot.commands
            self._executor.spin_once(timeout_sec=0.0)

    def _obey(self, twist: Any) -> None:
        self._pacer.catch_up()
        self._robot.command(twist.linear.x, twist.angular.z)

    def publish(self, reading: Reading) -> None:
        """Send what the robot shows."""
        clock_type, scan_type, odometry_type, image_type, battery_type = self._types
        match reading:
            case Clock(stamp_s):
                message = clock_type()
                _set_time(message.clock, stamp_s)
                self._to_clock.publish(message)
            case Scan():
                self._to_scan.publish(_scan(scan_type(), reading))
            case Odometry():
                self._to_odometry.publish(_odometry(odometry_type(), reading))
                if self._to_tf is not None:
                    self._to_tf.publish(self._tf_type(transforms=[moved(self._transform_type(), reading)]))
            case Picture():
                self._to_picture.publish(_picture(image_type(), reading))
            case Battery(stamp_s, voltage_v):
                message = battery_type(voltage=voltage_v, present=True)
                _set_time(message.header.stamp, stamp_s)
                self._to_battery.publish(message)


def moved(message: Any, reading: Odometry) -> Any:
    """The robot in the frame of its odometry, as a `TransformStamped`."""
    message.child_frame_id = FOOTPRINT
    _set_header(message.header, reading.stamp_s, ODOM)
    place = message.transform
    place.translation.x, place.translation.y = reading.x_m, reading.y_m
    place.rotation.z, place.rotation.w = _turned(reading.heading_rad)
    return message


def mounting(message: Any, frame: Mounted) -> Any:
    """A part of the robot in another one, as a `TransformStamped`."""
    message.child_frame_id = frame.child
    _set_header(message.header, 0.0, frame.parent)
    place = message.transform
    place.translation.x, place.translation.y, place.translation.z = frame.x_m, frame.y_m, frame.z_m
    place.rotation.y, place.rotation.w = _turned(frame.pitch_rad)
    return message


def _turned(angle_rad: float) -> tuple[float, float]:
    """The part along the axis, and w, of a quaternion."""
    return math.sin(angle_rad / 2), math.cos(angle_rad / 2)


def _set_time(stamp: Any, stamp_s: float) -> None:
    stamp.sec, stamp.nanosec = divmod(round(stamp_s * 1e9), 1_000_000_000)


def _set_header(header: Any, stamp_s: float, frame: str) -> None:
    header.frame_id = frame
    _set_time(header.stamp, stamp_s)


def _scan(message: Any, reading: Scan) -> Any:
    _set_header(message.header, reading.stamp_s, SCANNER)
    count = len(reading.ranges_m)
    message.angle_increment = math.tau / count
    message.angle_max = math.tau * (count - 1) / count
    message.scan_time = reading.revolution_s
    message.range_min, message.range_max = reading.nearest_m, reading.farthest_m
    message.ranges = array("f", reading.ranges_m.tobytes())
    return message


def _odometry(message: Any, reading: Odometry) -> Any:
    _set_header(message.header, reading.stamp_s, ODOM)
    message.child_frame_id = FOOTPRINT
    pose, twist = message.pose.pose, message.twist.twist
    pose.position.x, pose.position.y = reading.x_m, reading.y_m
    pose.orientation.z, pose.orientation.w = _turned(reading.heading_rad)
    twist.linear.x, twist.angular.z = reading.linear_m_s, reading.angular_rad_s
    return message


def _picture(message: Any, reading: Picture) -> Any:
    _set_header(message.header, reading.stamp_s, CAMERA)
    message.encoding, message.width, message.height = reading.encoding, reading.width, reading.height
    message.step = len(reading.data) // reading.height
    message.data = array("B", reading.data)
    return message


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command.

    Args:
        arguments: None: those of the process.

    Returns:
        The exit code: 0 when it was interrupted, 1 when it cannot be served.
    """
    given = list(sys.argv[1:] if arguments is None else arguments)
    ours, theirs = _parted(given)
    options = _parser().parse_args(ours)
    return serve(
        options,
        lambda robot, pacer, ended: Ros2Node(robot, pacer, is_stamped=options.stamped, arguments=theirs),
    )


def _parted(given: list[str]) -> tuple[list[str], list[str]]:
    """Split the arguments into ours and those for ROS."""
    if ROS_ARGUMENTS not in given:
        return given, []
    place = given.index(ROS_ARGUMENTS)
    return given[:place], given[place + 1 :]


def _parser() -> argparse.ArgumentParser:
    found = parser(
        "python -m robosc_simulated.ros.ros2",
        "Serve a simulated TurtleBot3 as a ROS 2 node until interrupted. It sends /scan, /odom, /battery_state, "
        "/clock, /tf and, where there is a line, /camera/image_raw, and obeys /cmd_vel.",
    )
    found.add_argument(
        "--stamped",
        action="store_true",
        help="velocities come as geometry_msgs/TwistStamped, not as Twist; the same as the "
        "TurtleBot3's parameter enable_stamped_cmd_vel",
    )
    found.epilog = f"What stands after {ROS_ARGUMENTS} is ROS's, such as `{ROS_ARGUMENTS} -r /scan:=/lidar`."
    return found


if __name__ == "__main__":
    sys.exit(main())
