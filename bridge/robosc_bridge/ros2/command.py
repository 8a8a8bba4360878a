"""`robosc-bridge ros2`: publish what a bridge reads, for RViz, Nav2 and others; nothing is subscribed to."""

import argparse
import signal
import sys
import time
from collections.abc import Sequence
from types import FrameType
from typing import Any

from robosc_api.security import SecurityError
from robosc_bridge.devices.robots import ROBOTS
from robosc_bridge.ros2 import messages
from robosc_bridge.ros2.messages import Angles, Wheels
from robosc_bridge.terminal.client import BridgeClient, RefusedError, Snapshot, UnreachableError, WatchResponse
from robosc_bridge.terminal.commands import add_address, client_credentials

NODE = "robosc_bridge"
DONE, MISSING, WRONG_USE = 0, 1, 2

_RATE_HZ = 20.0
_DIAGNOSTICS_S = 1.0
_RETRY_S = 1.0
_EPILOG = "exit status: 0 told to end; 1 ROS 2 is not installed; 2 wrong use"


def add_command(commands: Any) -> None:
    """Add the command to subparsers of argparse."""
    parser = commands.add_parser(
        "ros2",
        help="publish odometry, tf, joints, IMU, battery, scans and diagnostics of a bridge to ROS 2",
        description="Publish what a bridge reads to ROS 2, so that RViz and Nav2 see the robot. Nothing is subscribed "
        "to: the supervisor keeps command of the wheels. Arguments after --ros-args are those of ROS.",
        epilog=_EPILOG,
    )
    add_address(parser)
    parser.add_argument("--robot", choices=tuple(ROBOTS), default="burger", help="whose wheels these are")
    parser.add_argument("--wheel-radius", type=float, metavar="M", help="radius of the wheels, if it is another")
    parser.add_argument("--wheel-separation", type=float, metavar="M", help="distance between them, if it is another")
    parser.add_argument("--ros-args", nargs=argparse.REMAINDER, default=[], help="arguments of ROS")
    parser.set_defaults(run=_run)


def _run(arguments: argparse.Namespace) -> int:
    robot = ROBOTS[arguments.robot]
    wheels = Wheels(
        arguments.wheel_radius or robot.wheel_radius_m, arguments.wheel_separation or robot.wheel_separation_m
    )
    if min(wheels.radius_m, wheels.separation_m) <= 0:
        sys.stderr.write("robosc-bridge: the wheels must have a radius and a distance above zero\n")
        return WRONG_USE
    try:
        client_credentials(arguments)
        node = RobotNode(wheels, arguments.ros_args)
    except SecurityError as error:
        sys.stderr.write(f"robosc-bridge: {error}\n")
        return WRONG_USE
    except ImportError as error:
        sys.stderr.write(
            f"robosc-bridge: ROS 2 is not there ({error}): source its setup file, or install RoboSC with its extra "
            "`ros2`\n"
        )
        return MISSING
    ending = False

    def end(number: int, frame: FrameType | None) -> None:
        nonlocal ending
        if not ending:
            ending = True
            raise KeyboardInterrupt

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, end)
    try:
        _follow(node, arguments)
    except KeyboardInterrupt:
        return DONE
    finally:
        node.close()
    return DONE


def _follow(node: "RobotNode", arguments: argparse.Namespace) -> None:
    """Publish what the bridge tells, for ever; one that does not answer is asked again."""
    while True:
        try:
            with BridgeClient(arguments.address, client_credentials(arguments)) as client:
                for response in client.watch(with_scans=True, rate_hz=_RATE_HZ):
                    node.publish(response)
            problem = f"the bridge at {arguments.address} has ended"
        except (RefusedError, UnreachableError) as error:
            problem = str(error)
        node.lost(problem)
        time.sleep(_RETRY_S)


class RobotNode:
    """The node.

    Args:
        wheels: Wheels of the robot.
        arguments: Arguments of ROS.

    Raises:
        ImportError: rclpy or its messages are not installed.
    """

    def __init__(self, wheels: Wheels, arguments: Sequence[str] = ()) -> None:
        import rclpy
        from builtin_interfaces.msg import Time
        from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
        from geometry_msgs.msg import TransformStamped
        from nav_msgs.msg import Odometry
        from rclpy.node import Node
        from rclpy.qos import qos_profile_sensor_data
        from rclpy.signals import SignalHandlerOptions
        from sensor_msgs.msg import BatteryState, Imu, JointState, LaserScan

        self._rclpy = rclpy
        self._wheels = wheels
        self._angles = Angles()
        self._told: str | None = None
        self._diagnosed_s = -_DIAGNOSTICS_S
        self._context = rclpy.context.Context()
        given = [NODE, "--ros-args", *arguments] if arguments else [NODE]
        rclpy.init(args=given, context=self._context, signal_handler_options=SignalHandlerOptions.NO)
        node = self._node = Node(NODE, context=self._context)
        self._time_type = Time
        self._types = Odometry, JointState, Imu, BatteryState, LaserScan, TransformStamped
        self._diagnostic_types = DiagnosticArray, DiagnosticStatus, KeyValue
        self._odom = node.create_publisher(Odometry, "odom", 10)
        self._joints = node.create_publisher(JointState, "joint_states", 10)
        self._imu = node.create_publisher(Imu, "imu", 10)
        self._battery = node.create_publisher(BatteryState, "battery_state", 10)
        self._scan = node.create_publisher(LaserScan, "scan", qos_profile_sensor_data)
        self._diagnostics = node.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self._tf: Any = None
        try:
            from tf2_msgs.msg import TFMessage
        except ImportError:
            node.get_logger().warning("no transforms are sent: the package tf2_msgs is not installed")
        else:
            self._tf_type = TFMessage
            self._tf = node.create_publisher(TFMessage, "/tf", 100)

    def publish(self, response: WatchResponse) -> None:
        """Publish what is new in a response."""
        make_odometry, make_joints, make_imu, make_battery, make_scan, make_transform = self._types
        if response.HasField("snapshot"):
            snapshot = response.snapshot
            if snapshot.HasField("drive"):
                drive = snapshot.drive
                stamp = self._stamp(drive.age_s)
                self._angles = self._angles.after(drive, self._wheels)
                self._odom.publish(messages.odometry(make_odometry, stamp, drive))
                self._joints.publish(messages.joint_states(make_joints, stamp, drive, self._angles, self._wheels))
                if self._tf is not None:
                    self._tf.publish(self._tf_type(transforms=[messages.transform(make_transform, stamp, drive)]))
                for publisher, message in (
                    (self._imu, messages.imu(make_imu, stamp, drive.imu)),
                    (self._battery, messages.battery_state(make_battery, stamp, drive)),
                ):
                    if message is not None:
                        publisher.publish(message)
            self._diagnose(snapshot, "")
        if response.HasField("scan"):
            scan = response.scan
            self._scan.publish(messages.laser_scan(make_scan, self._stamp(scan.age_s), scan))

    def lost(self, problem: str) -> None:
        """Tell that the bridge is not reached."""
        self._angles = Angles(self._angles.left_rad, self._angles.right_rad)
        self._diagnose(None, problem)

    def _diagnose(self, snapshot: Snapshot | None, lost: str) -> None:
        now_s = time.monotonic()
        if lost == self._told and now_s - self._diagnosed_s < _DIAGNOSTICS_S:
            return
        if lost and lost != self._told:
            self._node.get_logger().error(lost)
        self._told, self._diagnosed_s = lost, now_s
        self._diagnostics.publish(messages.diagnostics(*self._diagnostic_types, self._stamp(0.0), snapshot, lost))

    def _stamp(self, age_s: float) -> Any:
        now_ns = self._node.get_clock().now().nanoseconds
        ((seconds, nanoseconds),) = messages.stamps(now_ns, [age_s])
        return self._time_type(sec=seconds, nanosec=nanoseconds)

    def close(self) -> None:
        """Take the node away."""
        self._node.destroy_node()
        self._rclpy.shutdown(context=self._context)
