"""Generated ROS 2 packages installed without colcon, and real `launch` that starts their launch files.

`launch` and `launch_ros` are in no package index: a machine with an installed ROS 2 has them, and elsewhere the folder
of their sources in PYTHONPATH serves.
"""

import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from robosc.targets import GeneratedFiles, write_files

# Starts a file of a package as `ros2 launch` does.
RUNNER = """
import os, sys
from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription, LaunchService
from launch.actions import IncludeLaunchDescription
from launch.launch_description_sources import AnyLaunchDescriptionSource

package, file, *given = sys.argv[1:]
path = os.path.join(get_package_share_directory(package), 'launch', file)
arguments = [tuple(item.split(':=', 1)) for item in given]
service = LaunchService(argv=given)
service.include_launch_description(
    LaunchDescription([IncludeLaunchDescription(AnyLaunchDescriptionSource(path), launch_arguments=arguments)])
)
sys.exit(service.run())
"""


def install(prefix: Path, package: str, files: GeneratedFiles, program: str) -> Path:
    """Install a generated package in Python into a prefix, as its setup.py does: its share folder.

    Args:
        prefix: The prefix.
        package: Name of the package.
        files: Its files.
        program: Its program: `controller` or `layer`.
    """
    share = prefix / "share" / package
    write_files(files, share)
    marker = prefix / "share/ament_index/resource_index/packages" / package
    marker.parent.mkdir(parents=True, exist_ok=True)
    marker.touch()
    executable = prefix / "lib" / package / program
    executable.parent.mkdir(parents=True)
    executable.write_text(
        f"#!{sys.executable}\nimport sys\nsys.path.insert(0, {str(share)!r})\n"
        f"from {package}.entry import run_node\nsys.exit(run_node())\n"
    )
    executable.chmod(0o755)
    return share


def launch_command(package: str, file: str, arguments: Sequence[str] = ()) -> list[str]:
    """Words behind the interpreter that start a launch file of an installed package."""
    return ["-c", RUNNER, package, file, *arguments]


def variables(prefix: Path, others: Mapping[str, str]) -> dict[str, str]:
    """Environment of a launch file: packages are found in a prefix."""
    found = filter(None, (str(prefix), os.environ.get("AMENT_PREFIX_PATH")))
    return {**others, "AMENT_PREFIX_PATH": os.pathsep.join(found), "PYTHONUNBUFFERED": "1"}
