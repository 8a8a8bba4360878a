"""Tests of messages for ROS 2: made, serialized and read again; no node and no middleware is there."""

import math
import warnings
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robosc_api.v1 import bridge_pb2 as pb
from robosc_bridge.ros2 import uncertainty
from robosc_bridge.ros2.diagnostics import Entry, Level
from robosc_bridge.ros2.frames import Frames, Mounting, Place

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed")

with warnings.catch_warnings():
    # The parser of message definitions, which rclpy loads, uses a module that Python deprecates.
    warnings.simplefilter("ignore", DeprecationWarning)
    from robosc_bridge.ros2 import messages

FRAMES = Frames(prefix="r/")
STAMP_NS = 1_700_000_000_250_000_000
FULL = pb.DriveState(
    pose=pb.Pose(x_m=1.5, y_m=-0.5, heading_rad=2.0),
    velocity=pb.Twist(linear_m_s=0.1, angular_rad_s=-0.3),
    left_wheel_m_s=0.124,
    right_wheel_m_s=0.076,
    left_wheel_m=0.33,
    right_wheel_m=-0.066,
    wheel_radius_m=0.033,
    battery_v=11.5,
    battery_share=0.75,
    imu={
        "angular_velocity_x": 0.01, "angular_velocity_y": 0.02, "angular_velocity_z": -0.3,
        "linear_acceleration_x": 0.1, "linear_acceleration_y": 0.2, "linear_acceleration_z": 9.8,
        "orientation_x": 0.0, "orientation_y": 0.0, "orientation_z": 1.2, "orientation_w": 1.6,
        "magnetic_field_x": 1e-5,
    },
)  # fmt: skip


def sent(message: Any) -> Any:
    """Return a message as its receiver has it."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        from rclpy.serialization import deserialize_message, serialize_message

        return deserialize_message(serialize_message(message), type(message))


def stamp_ns(header: Any) -> int:
    return int(header.stamp.sec) * 1_000_000_000 + int(header.stamp.nanosec)


def yaw(orientation: Any) -> float:
    assert (orientation.x, orientation.y) == (0.0, 0.0)
    return math.remainder(2 * math.atan2(orientation.z, orientation.w), math.tau)


class TestOdometry:
    def test_pose_velocity_and_frames(self) -> None:
        covariance = [float(number) for number in range(36)]
        found = sent(messages.odometry(FULL, STAMP_NS, FRAMES, covariance))
        assert stamp_ns(found.header) == STAMP_NS
        assert (found.header.frame_id, found.child_frame_id) == ("r/odom", "r/base_footprint")
        position = found.pose.pose.position
        assert (position.x, position.y, position.z) == (1.5, -0.5, 0.0)
        assert yaw(found.pose.pose.orientation) == pytest.approx(2.0)
        assert (found.twist.twist.linear.x, found.twist.twist.angular.z) == (0.1, -0.3)
        assert list(found.pose.covariance) == covariance
        assert list(found.twist.covariance) == list(uncertainty.twist())

    def test_variances_that_the_bridge_reports(self) -> None:
        drive = pb.DriveState(linear_variance=0.25, angular_variance=0.5)
        assert list(messages.odometry(drive, 0, FRAMES, [0.0] * 36).twist.covariance) == list(
            uncertainty.twist(0.25, 0.5)
        )
        drive = pb.DriveState(linear_variance=math.nan, angular_variance=0.5)
        assert list(messages.odometry(drive, 0, FRAMES, [0.0] * 36).twist.covariance) == list(
            uncertainty.twist(angular=0.5)
        )

    @given(st.floats(-5.0, 5.0), st.floats(-5.0, 5.0), st.floats(-math.pi, math.pi))
    def test_the_transform_leads_where_the_odometry_says(self, x_m: float, y_m: float, heading_rad: float) -> None:
        drive = pb.DriveState(pose=pb.Pose(x_m=x_m, y_m=y_m, heading_rad=heading_rad))
        odometry, moved = (
            messages.odometry(drive, STAMP_NS, FRAMES, [0.0] * 36),
            messages.moved(drive, STAMP_NS, FRAMES),
        )
        assert (moved.header.frame_id, moved.child_frame_id) == (odometry.header.frame_id, odometry.child_frame_id)
        assert moved.header.stamp == odometry.header.stamp
        pose, place = odometry.pose.pose, moved.transform
        assert (place.translation.x, place.translation.y) == (pose.position.x, pose.position.y) == (x_m, y_m)
        assert place.rotation == pose.orientation
        assert math.cos(yaw(place.rotation) - heading_rad) == pytest.approx(1.0)
        assert place.rotation.z**2 + place.rotation.w**2 == pytest.approx(1.0)


def test_a_part_of_the_robot() -> None:
    found = sent(messages.mounted(Mounting("r/base_link", "r/base_scan", Place(-0.032, 0.01, 0.172)), STAMP_NS))
    assert (found.header.frame_id, found.child_frame_id) == ("r/base_link", "r/base_scan")
    place = found.transform
    assert (place.translation.x, place.translation.y, place.translation.z) == (-0.032, 0.01, 0.172)
    assert (place.rotation.x, place.rotation.y, place.rotation.z, place.rotation.w) == (0.0, 0.0, 0.0, 1.0)


class TestJointStates:
    def test_angles_and_speeds_in_radians(self) -> None:
        found = sent(messages.joint_states(FULL, STAMP_NS))
        assert list(found.name) == ["wheel_left_joint", "wheel_right_joint"]
        assert list(found.position) == pytest.approx([10.0, -2.0])
        assert list(found.velocity) == pytest.approx([0.124 / 0.033, 0.076 / 0.033])
        assert list(found.effort) == []
        assert stamp_ns(found.header) == STAMP_NS

    @pytest.mark.parametrize("missing", ["left_wheel_m", "right_wheel_m", "wheel_radius_m"])
    def test_without_encoders_there_are_none(self, missing: str) -> None:
        drive = pb.DriveState()
        drive.CopyFrom(FULL)
        drive.ClearField(missing)
        assert messages.joint_states(drive, STAMP_NS) is None


class TestImu:
    def test_all_of_it(self) -> None:
        found = sent(messages.imu(FULL, STAMP_NS, FRAMES))
        assert (stamp_ns(found.header), found.header.frame_id) == (STAMP_NS, "r/imu_link")
        assert (found.orientation.z, found.orientation.w) == pytest.approx((0.6, 0.8))
        assert (found.angular_velocity.x, found.angular_velocity.z) == (0.01, -0.3)
        assert (found.linear_acceleration.y, found.linear_acceleration.z) == (0.2, 9.8)
        assert list(found.orientation_covariance) == [0.0025, 0, 0, 0, 0.0025, 0, 0, 0, 0.0025]
        assert found.angular_velocity_covariance[8] == 0.02
        assert found.linear_acceleration_covariance[4] == 0.04

    @pytest.mark.parametrize(
        ("name", "kept"),
        [
            ("orientation_w", ["angular_velocity", "linear_acceleration"]),
            ("angular_velocity_y", ["orientation", "linear_acceleration"]),
            ("linear_acceleration_x", ["orientation", "angular_velocity"]),
        ],
    )
    def test_what_is_not_measured_is_minus_one(self, name: str, kept: list[str]) -> None:
        drive = pb.DriveState(imu={key: value for key, value in FULL.imu.items() if key != name})
        found = sent(messages.imu(drive, STAMP_NS, FRAMES))
        lost = name.rpartition("_")[0]
        assert getattr(found, f"{lost}_covariance")[0] == -1.0
        assert all(getattr(found, f"{part}_covariance")[0] > 0.0 for part in kept)
        vector = getattr(found, lost)
        assert (vector.x, vector.y, vector.z) == (0.0, 0.0, 0.0)

    @pytest.mark.parametrize("quaternion", [(0.0, 0.0, 0.0, 0.0), (math.nan, 0.0, 0.0, 1.0), (math.inf, 0.0, 0.0, 1.0)])
    def test_an_orientation_that_is_none(self, quaternion: tuple[float, ...]) -> None:
        parts = {f"orientation_{axis}": part for axis, part in zip("xyzw", quaternion, strict=True)}
        drive = pb.DriveState(imu={**FULL.imu, **parts})
        found = sent(messages.imu(drive, STAMP_NS, FRAMES))
        assert found.orientation_covariance[0] == -1.0
        assert found.orientation.w == 1.0

    def test_without_a_sensor_there_is_none(self) -> None:
        assert messages.imu(pb.DriveState(imu={"magnetic_field_x": 1.0}), STAMP_NS, FRAMES) is None


class TestBattery:
    def test_all_of_it(self) -> None:
        found = sent(messages.battery_state(FULL, STAMP_NS))
        assert (found.voltage, found.percentage, found.present) == (11.5, 0.75, True)
        assert all(math.isnan(value) for value in (found.current, found.charge, found.capacity, found.temperature))
        assert stamp_ns(found.header) == STAMP_NS

    def test_a_charge_that_is_not_known(self) -> None:
        assert math.isnan(sent(messages.battery_state(pb.DriveState(battery_v=0.0), STAMP_NS)).percentage)

    def test_without_a_voltage_there_is_none(self) -> None:
        assert messages.battery_state(pb.DriveState(battery_share=0.5), STAMP_NS) is None


RANGES_M = st.one_of(st.floats(0.0, 20.0, width=32), st.just(math.nan), st.just(math.inf))


class TestScan:
    @given(st.lists(RANGES_M, min_size=360, max_size=360), st.sampled_from([(0.12, 3.5), (0.0, 0.0), (0.05, math.inf)]))
    def test_ranges_by_rep_117(self, ranges_m: list[float], limits: tuple[float, float]) -> None:
        scan = pb.Scan(ranges_m=ranges_m, min_m=limits[0], max_m=limits[1], turns_per_s=5.0)
        found = messages.laser_scan(scan, STAMP_NS, FRAMES)
        assert len(found.ranges) == 360
        assert (found.range_min, found.range_max) == (limits[0], limits[1] or math.inf)
        for before_m, after_m in zip(ranges_m, found.ranges, strict=True):
            if math.isnan(before_m):
                assert math.isnan(after_m)
            elif math.isfinite(after_m):
                assert after_m == pytest.approx(before_m, rel=1e-6)
                assert limits[0] <= before_m <= found.range_max
            elif after_m > 0:
                assert before_m > found.range_max or before_m == math.inf
            else:
                assert before_m < limits[0]

    def test_angles_and_times(self) -> None:
        found = sent(messages.laser_scan(pb.Scan(ranges_m=[1.0] * 360, turns_per_s=5.0, max_m=3.5), STAMP_NS, FRAMES))
        assert found.header.frame_id == "r/base_scan"
        # The middle of a revolution of 0.2 s.
        assert stamp_ns(found.header) == STAMP_NS - 100_000_000
        assert (found.scan_time, found.time_increment) == (pytest.approx(0.2), 0.0)
        assert found.angle_min == 0.0
        assert found.angle_increment == pytest.approx(math.radians(1.0))
        assert found.angle_min + 359 * found.angle_increment == pytest.approx(found.angle_max, abs=1e-5)
        assert list(found.intensities) == []

    @pytest.mark.parametrize("turns_per_s", [0.0, -1.0, math.nan, math.inf])
    def test_a_speed_that_is_not_known(self, turns_per_s: float) -> None:
        found = sent(messages.laser_scan(pb.Scan(ranges_m=[1.0] * 360, turns_per_s=turns_per_s), STAMP_NS, FRAMES))
        assert (stamp_ns(found.header), found.scan_time) == (STAMP_NS, 0.0)


def test_diagnostics() -> None:
    entries = [Entry("bridge", Level.OK, "running", {"state": "running"}), Entry("safety", Level.ERROR, "Stopped.")]
    found = sent(messages.diagnostics(entries, STAMP_NS, "Porter"))
    assert stamp_ns(found.header) == STAMP_NS
    assert [(item.name, item.level, item.message, item.hardware_id) for item in found.status] == [
        ("robosc_bridge: bridge", b"\x00", "running", "Porter"),
        ("robosc_bridge: safety", b"\x02", "Stopped.", "Porter"),
    ]
    assert [(item.key, item.value) for item in found.status[0].values] == [("state", "running")]
