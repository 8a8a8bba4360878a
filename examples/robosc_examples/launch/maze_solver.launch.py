"""Starts the maze solver: its controller and its rotator."""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

# Each launch file here is whole, so that it can be copied for a robot of one's own.
CONTROLLER = "maze_solver_controller"


def generate_launch_description() -> LaunchDescription:
    """The nodes; wheels and sensors are the robot's own."""
    parameters = Path(get_package_share_directory(CONTROLLER)) / "config" / "parameters.yaml"
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "resample_scans", default_value="false", description="For a LiDAR without 360 beams."
            ),
            Node(
                package="robosc_examples",
                executable="rotator",
                output="screen",
            ),
            Node(
                package=CONTROLLER,
                executable="controller",
                output="screen",
                parameters=[str(parameters), {"resample_scans": LaunchConfiguration("resample_scans")}],
            ),
        ]
    )
