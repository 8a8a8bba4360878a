"""Each use of rclpy's private parts by generated nodes, tried on the rclpy of each distribution."""

import subprocess
from pathlib import Path

import pytest

from support import rclpy_uses
from support.other_rclpy import DISTRIBUTIONS, distribution_command
from support.ros2 import environment, own_domain

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed")
pytest.importorskip("test_msgs", reason="test_msgs, with the only actions in a package index, is not installed")

# The first run makes an environment.
pytestmark = [pytest.mark.ros2, pytest.mark.timeout(1500)]

SCRIPT = Path(rclpy_uses.__file__).with_name("rclpy_internals.py")


@pytest.mark.parametrize("distribution", DISTRIBUTIONS)
@pytest.mark.parametrize("name", [*rclpy_uses.PRIVATE, *rclpy_uses.INTERNAL])
def test_rclpy_has(name: str, distribution: str, tmp_path: Path) -> None:
    command = distribution_command(distribution)
    with own_domain() as domain:
        around = [f"{key}={value}" for key, value in environment(domain, tmp_path).items()]
        done = subprocess.run(
            ["env", *around, *command, str(SCRIPT), name], capture_output=True, text=True, timeout=120, check=False
        )
    assert (done.returncode, done.stdout) == (0, "as the nodes need it\n"), done.stderr
