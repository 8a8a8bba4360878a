"""Tests that find which messages are the all-default one."""

import warnings
from typing import Any

import pytest

from robosc.targets.ros2.runtime.defaults import is_default

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed")

pytestmark = pytest.mark.ros2


def messages() -> Any:
    with warnings.catch_warnings():
        # A parser that rclpy loads uses a module that Python deprecates, as in support.ros2.
        warnings.simplefilter("ignore", DeprecationWarning)
        import rosidl_generator_py  # type: ignore[import-untyped]  # noqa: F401
    from geometry_msgs import msg

    return msg


def test_the_header_does_not_count() -> None:
    stamped = messages().TwistStamped()
    stamped.header.frame_id = "base"
    stamped.header.stamp.sec = 3
    assert is_default(stamped)
    stamped.twist.angular.y = -0.001
    assert not is_default(stamped)


def test_arrays_count_element_by_element() -> None:
    message = messages().TwistWithCovariance()
    assert is_default(message)
    message.covariance[35] = 0.5
    assert not is_default(message)
    polygon = messages().Polygon()
    assert is_default(polygon)
    polygon.points.append(messages().Point32())
    assert not is_default(polygon)


def test_minus_zero_is_zero() -> None:
    twist = messages().Twist()
    twist.linear.x = -0.0
    assert is_default(twist)
    twist.linear.x = 5e-324
    assert not is_default(twist)
