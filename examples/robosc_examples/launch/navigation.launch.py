"""Starts the navigation robot: its controller, the server of its action, its calibrator and its person detector."""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch_ros.actions import Node

CONTROLLER = "navigation_controller"


def generate_launch_description() -> LaunchDescription:
    """The nodes; wheels and sensors are the robot's own."""
    parameters = Path(get_package_share_directory(CONTROLLER)) / "config" / "parameters.yaml"
    return LaunchDescription(
        [
            Node(
                package="robosc_examples",
                executable="drive_to_pose",
                output="screen",
            ),
            Node(
                package="robosc_examples",
                executable="calibrator",
                output="screen",
            ),
            Node(
                package="robosc_examples",
                executable="person_detector",
                output="screen",
            ),
            Node(
                package=CONTROLLER,
                executable="controller",
                output="screen",
                parameters=[str(parameters)],
            ),
        ]
    )
