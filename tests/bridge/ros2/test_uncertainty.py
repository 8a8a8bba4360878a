"""Tests of covariances: what they are for ways that are known on paper, and what holds for every way."""

import math

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robosc_bridge.ros2 import uncertainty
from robosc_bridge.ros2.uncertainty import PlanarPose, PoseUncertainty

STEPS = st.lists(st.tuples(st.floats(-0.2, 0.2), st.floats(-0.5, 0.5)), max_size=30)


def poses(steps: list[tuple[float, float]], heading_rad: float = 0.0) -> list[PlanarPose]:
    """Poses along arcs, each given by its way and its rotation."""
    found = [PlanarPose(0.0, 0.0, heading_rad)]
    for way_m, rotation_rad in steps:
        before = found[-1]
        middle_rad = before.heading_rad + rotation_rad / 2
        wrapped_rad = math.remainder(before.heading_rad + rotation_rad, math.tau)
        x_m, y_m = before.x_m + way_m * math.cos(middle_rad), before.y_m + way_m * math.sin(middle_rad)
        found.append(PlanarPose(x_m, y_m, wrapped_rad))
    return found


def after(way: list[PlanarPose]) -> npt.NDArray[np.float64]:
    """Covariance of x, y and heading at the end of a way."""
    followed = PoseUncertainty()
    for pose in way:
        followed.move(pose)
    whole = np.array(followed.covariance()).reshape(6, 6)
    assert np.array_equal(np.diag(whole)[2:5], [uncertainty.UNMEASURED] * 3)
    return whole[np.ix_((0, 1, 5), (0, 1, 5))]


def test_a_straight_way_by_its_closed_form() -> None:
    length_m, count = 3.0, 3000
    found = after(poses([(length_m / count, 0.0)] * count)) - uncertainty.INITIAL * np.eye(3)
    heading = uncertainty.HEADING_RAD2_PER_M
    assert found[0, 0] == pytest.approx(uncertainty.WAY_M2_PER_M * length_m, rel=1e-3)
    assert found[2, 2] == pytest.approx(heading * length_m, rel=1e-3)
    # A random walk of the heading, integrated twice: L^3 / 3 and L^2 / 2.
    assert found[1, 1] == pytest.approx(heading * length_m**3 / 3, rel=5e-3)
    assert found[1, 2] == pytest.approx(heading * length_m**2 / 2, rel=5e-3)


def test_one_long_step_ends_beside_the_way_by_half_of_its_rotation() -> None:
    found = after(poses([(2.0, 0.0)])) - uncertainty.INITIAL * np.array([[1, 0, 0], [0, 5, 2], [0, 2, 1]])
    heading = 2.0 * uncertainty.HEADING_RAD2_PER_M
    assert np.allclose(found, [[2.0 * uncertainty.WAY_M2_PER_M, 0, 0], [0, heading, heading], [0, heading, heading]])


def test_a_rotation_on_the_spot_makes_the_heading_alone_uncertain() -> None:
    found = after(poses([(0.0, 0.25)] * 40)) - uncertainty.INITIAL * np.eye(3)
    assert found[2, 2] == pytest.approx(uncertainty.HEADING_RAD2_PER_RAD * 10.0)
    assert np.abs(found[:2]).max() == pytest.approx(0.0, abs=1e-12)


@given(STEPS, st.floats(-3.0, 3.0))
def test_it_is_a_covariance_whose_heading_only_grows(steps: list[tuple[float, float]], heading_rad: float) -> None:
    way = poses(steps, heading_rad)
    found = after(way)
    assert np.array_equal(found, found.T) or np.allclose(found, found.T, rtol=1e-12)
    assert np.linalg.eigvalsh(found).min() > 0.0
    assert found[2, 2] >= after(way[:-1])[2, 2]


@given(STEPS, st.floats(-3.0, 3.0))
def test_it_turns_with_the_frame(steps: list[tuple[float, float]], heading_rad: float) -> None:
    cosine, sine = math.cos(heading_rad), math.sin(heading_rad)
    turned = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    assert np.allclose(after(poses(steps, heading_rad)), turned @ after(poses(steps)) @ turned.T, atol=1e-9)


def test_a_robot_at_rest_keeps_what_it_has() -> None:
    way = poses([(0.1, 0.2)] * 5)
    assert np.array_equal(after(way), after(way + [way[-1]] * 100))


def test_a_velocity_has_the_variances_of_wheel_measurements() -> None:
    found = np.array(uncertainty.twist()).reshape(6, 6)
    assert np.array_equal(found, np.diag(np.diag(found)))
    assert np.diag(found).tolist() == [1e-4, 1e-4, 1e6, 1e6, 1e6, 1e-3]
    covariance = np.array(uncertainty.twist(0.25, 0.0)).reshape(6, 6)
    assert np.diag(covariance).tolist() == [0.25, 1e-4, 1e6, 1e6, 1e6, 1e-6]


def test_a_covariance_that_is_reported() -> None:
    planar = [0.1, 0.01, 0.02, 0.01, 0.2, 0.03, 0.02, 0.03, 0.3]
    covariance = uncertainty.reported_pose(planar)
    assert covariance is not None
    found = np.array(covariance).reshape(6, 6)
    assert np.array_equal(found, found.T)
    assert np.diag(found).tolist() == [0.1 + 1e-6, 0.2 + 1e-6, 1e6, 1e6, 1e6, 0.3 + 1e-6]
    assert (found[0, 1], found[0, 5], found[1, 5]) == (0.01, 0.02, 0.03)


@pytest.mark.parametrize("planar", [[], [0.0] * 8, [0.0] * 36, [math.nan] + [0.0] * 8])
def test_a_covariance_that_is_none(planar: list[float]) -> None:
    assert uncertainty.reported_pose(planar) is None
