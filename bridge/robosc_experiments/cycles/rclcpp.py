"""The rclcpp of this machine, as CMake finds it."""

import os
import re
import sys
from pathlib import Path

_CONFIGURATION = Path("share", "rclcpp", "cmake", "rclcppConfig.cmake")
VARIABLES = ("AMENT_PREFIX_PATH", "CMAKE_PREFIX_PATH")
"""Variables that name the folders in which CMake looks for the packages of a ROS 2."""


def rclcpp_prefix() -> Path | None:
    """Return the folder in which rclcpp is installed; None: it is not."""
    return next((prefix for prefix in prefixes() if (prefix / _CONFIGURATION).is_file()), None)


def rclcpp_version() -> str | None:
    """Return the version of the rclcpp that is installed, and where; None: there is none."""
    prefix = rclcpp_prefix()
    if prefix is None:
        return None
    try:
        text = (prefix / "share" / "rclcpp" / "package.xml").read_text(encoding="utf-8", errors="replace")
    except OSError:
        text = ""
    version = re.search(r"<version>\s*([^<\s]+)", text)
    return f"{version[1] if version else 'unknown version'} in {prefix}"


def prefixes() -> list[Path]:
    """Return the folders in which CMake looks for packages, in its order."""
    named = [Path(part) for name in VARIABLES for part in os.environ.get(name, "").split(os.pathsep) if part]
    return [*dict.fromkeys((*named, Path(sys.prefix)))]
