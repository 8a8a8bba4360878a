"""The generated ROS 1 package: its files are what catkin, roslaunch and a reader expect; what is refused is named."""

import re
import stat
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest

from robosc.execution.interpreter import describe
from robosc.targets import GeneratedFiles, generate, write_files
from robosc.targets.ros.runtime.parameters import USE_SIM_TIME, declarations, validate
from support.generated import example_supervisor

yaml = pytest.importorskip("yaml", reason="PyYAML is not installed")

PACKAGE = "line_follower_controller"
FOLLOWER = "line_follower/line_follower"
MAZE = "maze_solver/maze_solver"
NAVIGATION = "navigation/navigation"


@pytest.fixture(scope="module")
def files() -> GeneratedFiles:
    return generate(example_supervisor(FOLLOWER), "ros1")


def test_package_xml(files: GeneratedFiles) -> None:
    root = ElementTree.fromstring(files["package.xml"])
    assert (root.get("format"), root.findtext("name")) == ("2", PACKAGE)
    assert root.findtext("buildtool_depend") == "catkin"
    needed = {"rospy", "actionlib", "diagnostic_msgs", "geometry_msgs", "sensor_msgs", "std_msgs"}
    assert needed <= {item.text for item in root.findall("exec_depend")}


def test_what_cmake_and_setup_py_install_is_there(files: GeneratedFiles, tmp_path: Path) -> None:
    write_files(files, tmp_path)
    cmake = files["CMakeLists.txt"]
    scripts = re.findall(r"scripts/\w+", cmake)
    assert scripts == ["scripts/controller", "scripts/start_line_follower"]
    for script in scripts:
        assert (tmp_path / script).stat().st_mode & stat.S_IXUSR
        assert files[script].startswith("#!/usr/bin/python3\n")
    found = sorted(str(path.parent.relative_to(tmp_path)).replace("/", ".") for path in tmp_path.rglob("__init__.py"))
    assert found == [PACKAGE, f"{PACKAGE}.runtime"]
    assert f"packages=['{PACKAGE}', '{PACKAGE}.runtime']" in files["setup.py"]
    assert {"config/parameters.yaml", "launch/controller.launch", "README.md"} <= set(files)


def test_the_launch_file_starts_the_node_with_its_parameters(files: GeneratedFiles) -> None:
    root = ElementTree.fromstring(files["launch/controller.launch"])
    arguments = {item.get("name"): item.get("default") for item in root.findall("arg")}
    assert arguments["parameters"] == f"$(find {PACKAGE})/config/parameters.yaml"
    (node,) = root.findall("node")
    assert (node.get("pkg"), node.get("type"), node.get("name")) == (PACKAGE, "controller", "$(arg name)")
    (parameters,) = node.findall("rosparam")
    assert (parameters.get("command"), parameters.get("file")) == ("load", "$(arg parameters)")


def test_the_parameter_file_holds_every_default(files: GeneratedFiles) -> None:
    content = yaml.safe_load(files["config/parameters.yaml"])
    assert content == {item.name: item.default for item in declarations(("/cmd_vel",)) if item.name != USE_SIM_TIME}
    checked = validate({**content, USE_SIM_TIME: False}, describe(example_supervisor(FOLLOWER)))
    assert (checked.settings.period_s, checked.settings.release_identifiers) == (0.1, ("/cmd_vel",))


def test_the_readme_names_every_topic_server_and_parameter(files: GeneratedFiles) -> None:
    readme = files["README.md"]
    for row in (
        "| `/scan` | `sensor_msgs/LaserScan` | received | sensor, depth 5 | scan |",
        "| `/cmd_vel` | `geometry_msgs/Twist` | published | reliable, depth 10 | move, halt |",
        "requirement move needs LineDetector.line_found",
    ):
        assert row in readme
    for parameter in declarations(()):
        assert (f"| `{parameter.name}` |" in readme) == (parameter.name != USE_SIM_TIME)
    readme = generate(example_supervisor(NAVIGATION), "ros1")["README.md"]
    assert "| `/calibrate` | `std_srvs/Trigger` | service | calibrate |" in readme
    assert "| `/navigate_to_pose` | `robosc_example_interfaces/NavigateToPose` | action | navigate |" in readme
    for word in ("rclpy", "colcon", "ros2", "/msg/", "ROS 2"):
        assert word not in readme
