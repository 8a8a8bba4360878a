"""The node of ROS 2: publishers only, without any way to command the robot."""

from collections.abc import Iterator, Sequence
from types import TracebackType
from typing import Any, Self

from robosc_bridge.ros2.diagnostics import PEERS, Entry, Level
from robosc_bridge.ros2.frames import Frames, Place, mountings, places_of
from robosc_bridge.ros2.peers import OwnTopic, Peer, clock_misfits, misfits
from robosc_bridge.terminal.client import DriveState, Scan

ROS_ARGUMENTS = "--ros-args"


class MissingRosError(Exception):
    """ROS 2, or one of its packages, is not installed; the message says in one sentence what to do."""


class NodeError(Exception):
    """The node cannot be made as requested; the message is one sentence for a person."""


class BridgeNode:
    """The node, an `Outlet`; use it with `with`.

    No executor spins it: publishers need none, and parameters cannot be set from outside.

    Args:
        frames: Names of frames.
        scan: Place of the LiDAR in `base_link`; None: as the TurtleBot3 has it.
        namespace: Namespace of its topics.
        sends_odom_tf: True if it sends the transform of the odometry.
        sends_static_tf: True if it sends those of the robot's parts.
        arguments: Arguments after `--ros-args`.

    Raises:
        MissingRosError: rclpy or a package of messages is not installed.
        NodeError: ROS does not accept a name or an argument.
    """

    def __init__(
        self,
        frames: Frames,
        scan: Place | None,
        namespace: str,
        *,
        sends_odom_tf: bool,
        sends_static_tf: bool,
        arguments: Sequence[str] = (),
    ) -> None:
        try:
            import rclpy
            from diagnostic_msgs.msg import DiagnosticArray
            from nav_msgs.msg import Odometry
            from rclpy.node import Node
            from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy, qos_profile_sensor_data
            from rclpy.signals import SignalHandlerOptions
            from rclpy.validate_namespace import validate_namespace
            from sensor_msgs.msg import BatteryState, Imu, JointState, LaserScan

            from robosc_bridge.ros2 import messages
        except ImportError as error:
            raise MissingRosError(
                f"ROS 2 is not there ({error}): source its setup file, or install RoboSC with its extra `ros2`"
            ) from error
        self._tf_message: Any = None
        if sends_odom_tf or sends_static_tf:
            try:
                from tf2_msgs.msg import TFMessage
            except ImportError as error:
                raise MissingRosError(
                    f"transforms cannot be sent ({error}): install the package tf2_msgs of ROS 2, or use --no-tf"
                ) from error
            self._tf_message = TFMessage
        self._rclpy = rclpy
        self._messages = messages
        self._frames = frames
        self._scan = scan
        self._context = rclpy.context.Context()
        given = [messages.NODE, ROS_ARGUMENTS, *arguments] if arguments else [messages.NODE]
        try:
            # ROS would print several more lines about a namespace that it refuses.
            validate_namespace(namespace if namespace.startswith("/") else f"/{namespace}")
            rclpy.init(args=given, context=self._context, signal_handler_options=SignalHandlerOptions.NO)
            self._node = node = Node(
                messages.NODE, context=self._context, namespace=namespace or None, start_parameter_services=False
            )
        except Exception as error:
            rclpy.try_shutdown(context=self._context)
            raise NodeError(f"ROS 2 refuses the node: {' '.join(str(error).split())}") from error
        self._to_odometry = node.create_publisher(Odometry, "odom", 10)
        self._to_joints = node.create_publisher(JointState, "joint_states", 10)
        self._to_imu = node.create_publisher(Imu, "imu", qos_profile_sensor_data)
        self._to_battery = node.create_publisher(BatteryState, "battery_state", 10)
        self._to_scan = node.create_publisher(LaserScan, "scan", qos_profile_sensor_data)
        self._to_diagnostics = node.create_publisher(DiagnosticArray, "/diagnostics", 10)
        # Quality as tf2_ros has it.
        self._to_tf = node.create_publisher(self._tf_message, "/tf", 100) if sends_odom_tf else None
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._to_static_tf = node.create_publisher(self._tf_message, "/tf_static", latched) if sends_static_tf else None
        self._reliable = ReliabilityPolicy.RELIABLE
        self._own = {
            publisher.topic_name: OwnTopic(_type_name(publisher.msg_type), is_reliable, is_shared)
            for publisher, is_reliable, is_shared in (
                (self._to_odometry, True, False),
                (self._to_joints, True, False),
                (self._to_imu, False, False),
                (self._to_battery, True, False),
                (self._to_scan, False, False),
                (self._to_diagnostics, True, True),
            )
        }

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._node.destroy_node()
        self._rclpy.try_shutdown(context=self._context)

    def know(self, turtlebot: str, scanner: tuple[float, float] | None) -> None:
        """Publish where the parts of the robot are.

        Args:
            turtlebot: TurtleBot3 as its bridge names it; empty: another robot.
            scanner: Place of its LiDAR as the bridge's configuration has it, forward and to the left; None: not there.

        Raises:
            NodeError: The place of the LiDAR is not known.
        """
        if self._to_static_tf is None:
            return
        places = places_of(turtlebot, self._scan, scanner)
        if places is None:
            raise NodeError(
                f"the bridge drives {repr(turtlebot) if turtlebot else 'no TurtleBot3'}, and it is not known where the "
                "LiDAR is on it: set scanner.x_m and scanner.y_m of its configuration, give --scan-at X Y Z, or use "
                "--no-static-tf"
            )
        now_ns = self._node.get_clock().now().nanoseconds
        transforms = [self._messages.mounted(item, now_ns) for item in mountings(self._frames, places)]
        self._to_static_tf.publish(self._tf_message(transforms=transforms))

    def put_drive(self, drive: DriveState, stamp_ns: int, pose_covariance: tuple[float, ...]) -> None:
        """Publish a reading of the drive base."""
        made = self._messages
        self._to_odometry.publish(made.odometry(drive, stamp_ns, self._frames, pose_covariance))
        if self._to_tf is not None:
            self._to_tf.publish(self._tf_message(transforms=[made.moved(drive, stamp_ns, self._frames)]))
        joints = made.joint_states(drive, stamp_ns)
        if joints is not None:
            self._to_joints.publish(joints)
        imu = made.imu(drive, stamp_ns, self._frames)
        if imu is not None:
            self._to_imu.publish(imu)

    def put_battery(self, drive: DriveState, stamp_ns: int) -> None:
        """Publish the state of the battery, if anything is known of it."""
        message = self._messages.battery_state(drive, stamp_ns)
        if message is not None:
            self._to_battery.publish(message)

    def put_scan(self, scan: Scan, stamp_ns: int) -> None:
        """Publish a revolution of the LiDAR."""
        self._to_scan.publish(self._messages.laser_scan(scan, stamp_ns, self._frames))

    def put_diagnostics(self, reported: tuple[Entry, ...], stamp_ns: int, robot: str) -> None:
        """Publish the present state, and what does not fit among the nodes that are seen."""
        entries = (*reported, self._peers_entry())
        self._to_diagnostics.publish(self._messages.diagnostics(entries, stamp_ns, robot))

    def _peers_entry(self) -> Entry:
        node = self._node
        found = (
            *clock_misfits(
                uses_sim_time=bool(node.get_parameter("use_sim_time").value),
                has_clock=bool(node.get_publishers_info_by_topic("/clock")),
            ),
            *misfits(self._own, self._peers()),
        )
        message = " ".join(found) or "Nothing is wrong with the other nodes on these topics."
        return Entry(PEERS, Level.WARN if found else Level.OK, message)

    def _peers(self) -> Iterator[Peer]:
        """Yield the endpoints of other nodes on the topics of this one."""
        node = self._node
        for topic in self._own:
            for is_publisher, infos in (
                (True, node.get_publishers_info_by_topic(topic)),
                (False, node.get_subscriptions_info_by_topic(topic)),
            ):
                for info in infos:
                    if (info.node_namespace, info.node_name) != (node.get_namespace(), node.get_name()):
                        name = f"{info.node_namespace.rstrip('/')}/{info.node_name}"
                        is_reliable = info.qos_profile.reliability == self._reliable
                        yield Peer(name, topic, info.topic_type, is_publisher, is_reliable)


def _type_name(message_class: Any) -> str:
    """Return the name of a message's type, such as `nav_msgs/msg/Odometry`."""
    package = message_class.__module__.partition(".")[0]
    return f"{package}/msg/{message_class.__name__}"
