"""Starts the courier: its controller and its rotator."""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch_ros.actions import Node

# Each launch file here is whole, so that it can be copied for a robot of one's own.
CONTROLLER = "courier_controller"


def generate_launch_description() -> LaunchDescription:
    """The nodes; wheels, odometry, battery, door and tray are others."""
    parameters = Path(get_package_share_directory(CONTROLLER)) / "config" / "parameters.yaml"
    return LaunchDescription(
        [
            Node(package="robosc_examples", executable="rotator", output="screen"),
            Node(package=CONTROLLER, executable="controller", output="screen", parameters=[str(parameters)]),
        ]
    )
