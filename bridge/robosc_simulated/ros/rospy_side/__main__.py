"""`/usr/bin/python3 -m rospy_side`: a rospy node that publishes the twin's readings and forwards velocities.

Frames come on standard input and go out on what was standard output; the node ends when standard input does.
"""

from __future__ import annotations

import math
import os
import struct
import sys
import threading
from collections.abc import Callable
from typing import Any

from .frames import Decoder, Frame, FrameError, encode

CHUNK = 65536
EXIT_MISSING, EXIT_FAULT = 3, 1
# Limit of messages for a subscriber that does not take them.
_QUEUE = 10


class Node:
    """The node.

    Args:
        send: Function that takes frames for the twin.
        begin: First message of the twin: its name, and the frames of the robot.
    """

    def __init__(self, send: Callable[[Frame], None], begin: dict[str, Any]) -> None:
        import rospy
        from geometry_msgs.msg import TransformStamped, Twist, TwistStamped
        from nav_msgs.msg import Odometry
        from rosgraph_msgs.msg import Clock
        from sensor_msgs.msg import BatteryState, Image, LaserScan

        self._rospy = rospy
        self._send = send
        # Signals are the twin's; waits until there is a master.
        rospy.init_node(begin["name"], disable_signals=True, anonymous=False)
        if begin["sim_time"]:
            rospy.set_param("/use_sim_time", True)
        self._transform_type = TransformStamped
        self._battery, self._clock, self._image = BatteryState, Clock, Image
        self._odometry, self._scan = Odometry, LaserScan

        def publisher(topic: str, kind: Any, latch: bool = False) -> Any:
            return rospy.Publisher(topic, kind, queue_size=_QUEUE, latch=latch, tcp_nodelay=True)

        self._to_clock = publisher("/clock", Clock)
        self._to_scan = publisher("/scan", LaserScan)
        self._to_odometry = publisher("/odom", Odometry)
        self._to_picture = publisher("/camera/image_raw", Image)
        self._to_battery = publisher("/battery_state", BatteryState)
        self._to_tf = None
        try:
            from tf2_msgs.msg import TFMessage
        except ImportError:
            self._send(Frame({"kind": "warning", "text": "no transforms are sent: tf2_msgs is not installed"}))
        else:
            self._tf_type = TFMessage
            self._to_tf = publisher("/tf", TFMessage)
            self._to_static = publisher("/tf_static", TFMessage, latch=True)
            self._to_static.publish(TFMessage([self._mounting(frame) for frame in begin["frames"]]))
        if begin["stamped"]:
            rospy.Subscriber(
                "/cmd_vel", TwistStamped, lambda message: self._on_velocity(message.twist), tcp_nodelay=True
            )
        else:
            rospy.Subscriber("/cmd_vel", Twist, self._on_velocity, tcp_nodelay=True)
        self._send(Frame({"kind": "ready"}))

    def _on_velocity(self, twist: Any) -> None:
        self._send(Frame({"kind": "velocity", "linear_m_s": twist.linear.x, "angular_rad_s": twist.angular.z}))

    def show(self, frame: Frame) -> None:
        """Send what the robot shows."""
        head = frame.head
        stamp = self._rospy.Time(*divmod(round(head["stamp_s"] * 1e9), 1_000_000_000))
        kind = head["kind"]
        if kind == "clock":
            self._to_clock.publish(self._clock(stamp))
        elif kind == "scan":
            message = self._scan(
                angle_max=2 * math.pi * (head["count"] - 1) / head["count"],
                angle_increment=2 * math.pi / head["count"],
                scan_time=head["turn_s"],
                range_min=head["nearest_m"],
                range_max=head["farthest_m"],
                ranges=struct.unpack("<{}f".format(head["count"]), frame.data),
            )
            self._publish(self._to_scan, message, stamp, head["frame"])
        elif kind == "odometry":
            self._show_odometry(head, stamp)
        elif kind == "picture":
            message = self._image(
                encoding=head["encoding"],
                width=head["width"],
                height=head["height"],
                step=len(frame.data) // head["height"],
                data=frame.data,
            )
            self._publish(self._to_picture, message, stamp, head["frame"])
        elif kind == "battery":
            self._publish(self._to_battery, self._battery(voltage=head["voltage_v"], present=True), stamp, "")

    def _publish(self, publisher: Any, message: Any, stamp: Any, frame_id: str) -> None:
        message.header.stamp, message.header.frame_id = stamp, frame_id
        publisher.publish(message)

    def _show_odometry(self, head: dict[str, Any], stamp: Any) -> None:
        message = self._odometry(child_frame_id=head["child"])
        pose, twist = message.pose.pose, message.twist.twist
        pose.position.x, pose.position.y = head["x_m"], head["y_m"]
        pose.orientation.z, pose.orientation.w = _turned(head["heading_rad"])
        twist.linear.x, twist.angular.z = head["linear_m_s"], head["angular_rad_s"]
        self._publish(self._to_odometry, message, stamp, head["frame"])
        if self._to_tf is None:
            return
        moved = self._transform_type(child_frame_id=head["child"])
        moved.header.stamp, moved.header.frame_id = stamp, head["frame"]
        moved.transform.translation.x, moved.transform.translation.y = head["x_m"], head["y_m"]
        moved.transform.rotation.z, moved.transform.rotation.w = _turned(head["heading_rad"])
        self._to_tf.publish(self._tf_type([moved]))

    def _mounting(self, frame: dict[str, Any]) -> Any:
        found = self._transform_type(child_frame_id=frame["child"])
        found.header.frame_id = frame["parent"]
        found.transform.translation.x, found.transform.translation.z = frame["x_m"], frame["z_m"]
        found.transform.rotation.y, found.transform.rotation.w = _turned(frame["pitch_rad"])
        return found

    def close(self) -> None:
        """End the node: the master forgets it."""
        self._rospy.signal_shutdown("the twin has ended")


def _turned(angle_rad: float) -> tuple[float, float]:
    """The part along the axis, and w, of a quaternion."""
    return math.sin(angle_rad / 2), math.cos(angle_rad / 2)


def main() -> int:
    """Run the node until standard input ends: the exit status."""
    # rospy and whatever it loads print where they like: the pipe is ours alone.
    pipe = os.dup(1)
    os.dup2(2, 1)
    lock = threading.Lock()

    def send(frame: Frame) -> None:
        with lock:
            try:
                data = encode(*frame)
                while data:
                    data = data[os.write(pipe, data) :]
            except BrokenPipeError:
                # The twin is gone; standard input ends now.
                pass

    node = None
    decoder = Decoder()
    try:
        while True:
            data = os.read(0, CHUNK)
            if not data:
                break
            for frame in decoder.feed(data):
                if node is None:
                    node = Node(send, frame.head)
                else:
                    node.show(frame)
    except ImportError as error:
        send(Frame({"kind": "missing", "text": str(error)}))
        return EXIT_MISSING
    except (FrameError, KeyError, OSError, struct.error) as error:
        sys.stderr.write(f"rospy side of the twin: {type(error).__name__}: {error}\n")
        return EXIT_FAULT
    if node is not None:
        node.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
