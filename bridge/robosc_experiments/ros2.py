"""The scenarios over ROS 2: a generated rclpy node, the nodes of the example robots and the twin as a ROS 2 node."""

import importlib.util
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from robosc_experiments import ros
from robosc_experiments.domains import own_domain
from robosc_experiments.processes import environment
from robosc_experiments.scenario import Outcome, Say, ScenarioError

# Fast DDS announces itself at once and often with this profile; its default finds peers seconds later now and then.
_PROFILE = """<?xml version="1.0" encoding="UTF-8"?>
<profiles xmlns="http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles">
  <participant profile_name="scenario" is_default_profile="true"><rtps><builtin><discovery_config>
    <initialAnnouncements><count>30</count><period><sec>0</sec><nanosec>50000000</nanosec></period></initialAnnouncements>
    <leaseAnnouncement><sec>0</sec><nanosec>250000000</nanosec></leaseAnnouncement>
  </discovery_config></builtin></rtps></participant>
</profiles>
"""

_OF_OTHERS = ("ROS_DISCOVERY_SERVER", "ROS_STATIC_PEERS", "FASTDDS_DEFAULT_PROFILES_FILE", "ROS_LOCALHOST_ONLY")
"""Variables that lead to nodes elsewhere."""


class Ros2(ros.Middleware):
    """ROS 2 on this machine alone, in a domain of its own, whatever the environment says: a robot may listen there."""

    connection = "ros2"
    helpers = "robosc_examples"
    twin = "robosc_simulated.ros.ros2"

    @contextmanager
    def running(self, folder: Path) -> Iterator[Mapping[str, str]]:
        """Yield the environment variables of a run: no other program has to be started."""
        if importlib.util.find_spec("rclpy") is None:
            raise ScenarioError("ROS 2 is not there: source its setup file, or install RoboSC with its extra `ros2`")
        profile = folder / "discovery.xml"
        profile.write_text(_PROFILE, encoding="utf-8")
        with own_domain() as domain:
            yield {
                **{name: value for name, value in environment().items() if name not in _OF_OTHERS},
                "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
                "ROS_DOMAIN_ID": str(domain),
                "ROS_LOG_DIR": str(folder / "ros_log"),
                "FASTRTPS_DEFAULT_PROFILES_FILE": str(profile),
            }

    def arguments(self, parameters: Mapping[str, object], remappings: Mapping[str, str]) -> list[str]:
        """After `--ros-args`."""
        words = [word for name, value in parameters.items() for word in ("-p", f"{name}:={value}")]
        words += [word for name, other in remappings.items() for word in ("-r", f"{name}:={other}")]
        return ["--ros-args", *words] if words else []


def run_maze(folder: Path, scene: str | Path, *, speed: float, say: Say, seed: int = 0) -> Outcome:
    """Let a robot out of a maze, over ROS 2; see `ros.run_maze`."""
    return ros.run_maze(Ros2(), folder, scene, speed=speed, say=say, seed=seed)


def run_line(folder: Path, scene: str | Path, *, speed: float, say: Say, seed: int = 0) -> Outcome:
    """Let a robot follow a line behind a supervision layer, over ROS 2; see `ros.run_line`."""
    return ros.run_line(Ros2(), folder, scene, speed=speed, say=say, seed=seed)
