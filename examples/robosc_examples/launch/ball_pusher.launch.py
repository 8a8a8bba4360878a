"""Starts the ball pusher: its controller, detectors of a red ball and a blue goal, and its pusher."""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

CONTROLLER = "ball_pusher_controller"


def generate_launch_description() -> LaunchDescription:
    """The nodes; wheels and sensors are the robot's own."""
    parameters = Path(get_package_share_directory(CONTROLLER)) / "config" / "parameters.yaml"
    return LaunchDescription(
        [
            DeclareLaunchArgument("image", default_value="/image", description="Topic of the camera."),
            Node(
                package="robosc_examples",
                executable="blob_detector",
                name="ball_detector",
                output="screen",
                parameters=[{"width": 0.08}],
                remappings=[("/image", LaunchConfiguration("image")), ("/blob", "/ball")],
            ),
            Node(
                package="robosc_examples",
                executable="blob_detector",
                name="goal_detector",
                output="screen",
                parameters=[{"width": 0.8, "hue_from": 110, "hue_to": 130}],
                remappings=[("/image", LaunchConfiguration("image")), ("/blob", "/goal")],
            ),
            Node(
                package="robosc_examples",
                executable="pusher",
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
