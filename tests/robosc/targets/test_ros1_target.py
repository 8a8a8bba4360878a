"""The generated ROS 1 package: its files are what catkin, roslaunch and a reader expect; what is refused is named."""

import re
import stat
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest

from robosc.errors import UnsupportedModelError
from robosc.execution.interpreter import describe
from robosc.model.structure import Deployment
from robosc.supervisor import Supervisor
from robosc.targets import GeneratedFiles, GenerateOptions, generate, write_files
from robosc.targets.ros.runtime.parameters import USE_SIM_TIME, declarations, validate
from support.generated import example_supervisor, require_sound_python
from support.models import model_of
from support.own_tests import PYTEST, own_tests
from support.random_supervisors import CERTIFICATE

yaml = pytest.importorskip("yaml", reason="PyYAML is not installed")

PACKAGE = "line_follower_controller"
FOLLOWER = "line_follower/line_follower"
MAZE = "maze_solver/maze_solver"
NAVIGATION = "navigation/navigation"


def robot(body: str, name: str = "Robot") -> Supervisor:
    """A supervisor that adds nothing to a model's text."""
    return Supervisor(model_of(f"robot {name} {{ {body} }}"), Deployment.CONTROLLER, (), CERTIFICATE)


@pytest.fixture(scope="module")
def files() -> GeneratedFiles:
    return generate(example_supervisor(FOLLOWER), "ros1")


@pytest.mark.parametrize("name", [FOLLOWER, MAZE, NAVIGATION])
def test_python_files_run_on_3_8_and_name_nothing_undefined(name: str, tmp_path: Path) -> None:
    write_files(generate(example_supervisor(name), "ros1"), tmp_path)
    require_sound_python(tmp_path)


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


@pytest.mark.parametrize("name", [FOLLOWER, MAZE, NAVIGATION])
@pytest.mark.parametrize("command", [PYTEST, ("test/run_tests.py",)])
def test_the_packages_own_tests_pass_without_ros(name: str, command: tuple[str, ...], tmp_path: Path) -> None:
    write_files(generate(example_supervisor(name), "ros1"), tmp_path)
    result = own_tests(tmp_path, command)
    assert result.returncode == 0, result.stdout


@pytest.mark.parametrize("command", [PYTEST, ("test/run_tests.py",)])
def test_the_packages_own_tests_can_fail(command: tuple[str, ...], tmp_path: Path) -> None:
    write_files(generate(example_supervisor(FOLLOWER), "ros1"), tmp_path)
    test = tmp_path / "test/test_supervisor.py"
    test.write_text(test.read_text() + "\n\ndef test_that_fails():\n    assert False\n")
    assert own_tests(tmp_path, command).returncode == 1


def test_a_package_may_be_called_as_one_likes() -> None:
    files = generate(robot(""), "ros1", GenerateOptions(package="my_robot"))
    assert ElementTree.fromstring(files["package.xml"]).findtext("name") == "my_robot"
    assert "my_robot/node.py" in files


@pytest.mark.parametrize(
    ("body", "problem"),
    [
        ('component C { outgoing message m with identifier: "/a b", type: none }', "the identifier '/a b' of 'm'"),
        ('component C { outgoing message m with identifier: "/a b", type: none }', "identifier '/a b' of 'm'"),
        ('component C { outgoing message m with identifier: "{{ 1 }}", type: none }', "identifier '{{ 1 }}' of 'm'"),
        (
            'component C { outgoing message m with identifier: "$(env HOME)", type: none }',
            "the identifier '$(env HOME)' of 'm' is no ROS name",
        ),
        (
            'component C { outgoing message m with identifier: "_x", type: none }',
            "the identifier '_x' is not a name in ROS 1: it begins with an underscore",
        ),
        (
            "interface i use Trigger from std_srvs component C {"
            '  service s with identifier: "_s", request: none, response: none links i }',
            "the identifier '_s' is not a name in ROS 1",
        ),
        (
            'component C { outgoing message m with identifier: "/diagnostics", type: string }',
            "the topic /diagnostics is of the type std_msgs/String, but every generated node publishes",
        ),
        (
            "interface i use X from robot_controller component C { outgoing message m with type: none links i }",
            "the generated package would be called robot_controller, like a package whose types it uses",
        ),
    ],
)
def test_what_it_cannot_do_is_refused_with_its_name(body: str, problem: str) -> None:
    with pytest.raises(UnsupportedModelError) as raised:
        generate(robot(body), "ros1")
    message = str(raised.value)
    assert message.startswith("target ros1: ") and problem in message and "\n" not in message


HOSTILE = r"""
datatype object class { x: double }
datatype enum continue from string to { value = "{{ 1 }} --> `|` \" ' \\ </name>" -> break default -> global }
interface i use Vector3 from geometry_msgs
component def {
    incoming message lambda with identifier: "/a", type: string
    incoming message raise with identifier: "/b", type: class links i
    outgoing message yield with identifier: "/c", type: continue
    behaviour {
        variable y: continue = break
        on response from yield do y := value
        variable x: string = "\" ' \\ ${x} $(env HOME) {{ x }} {% raw %} </name> <!-- --> \u0022 é"
        initial marked state in { on request to lambda on request to raise }
    }
}
provide lambda with "'''\"; import os \\"
requirement lambda needs def.y = break
"""


def test_hostile_texts_get_nowhere(tmp_path: Path) -> None:
    files = generate(robot(HOSTILE, "None"), "ros1")
    write_files(files, tmp_path)
    require_sound_python(tmp_path, "F,E9,B,PLE")
    for path in ("package.xml", "launch/controller.launch"):
        ElementTree.fromstring(files[path])
    yaml.safe_load(files["config/parameters.yaml"])
    result = own_tests(tmp_path, ("test/run_tests.py",))
    assert result.returncode == 0, result.stdout + result.stderr
