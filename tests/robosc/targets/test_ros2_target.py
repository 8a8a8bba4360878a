"""The generated ROS 2 package: its files are what colcon, launch and a reader expect; what is refused is named."""

import ast
import math
import re
import sys
import types
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

import pytest

from robosc.errors import UnsupportedModelError
from robosc.execution.interpreter import describe
from robosc.supervisor import Supervisor
from robosc.targets import GeneratedFiles, GenerateOptions, generate
from robosc.targets.registry import PackageMetadata
from robosc.targets.ros.runtime.parameters import USE_SIM_TIME, ParameterError, declarations, prefixed, validate
from robosc.targets.ros.state_topic import state_topic
from robosc.targets.ros2.runtime.lifecycle import AUTOSTART
from robosc.targets.ros2.runtime.state import STATE_MESSAGE
from support import rclpy_uses
from support.ament_lint import PACKAGES
from support.execution import unsupervised
from support.generated import example_supervisor
from support.launch_stub import launch_actions
from support.rclpy_uses import INTERNAL, PRIVATE, private_uses

yaml = pytest.importorskip("yaml", reason="PyYAML, a part of ROS 2, is not installed")

PACKAGE = "line_follower_controller"
FOLLOWER = "line_follower/line_follower"
MAZE = "maze_solver/maze_solver"
NAVIGATION = "navigation/navigation"


def robot(body: str, name: str = "Robot") -> Supervisor:
    return unsupervised(f"robot {name} {{ {body} }}")


@pytest.fixture(scope="module")
def files() -> GeneratedFiles:
    return generate(example_supervisor(FOLLOWER), "ros2")


def test_everything_that_a_package_needs_is_there(files: GeneratedFiles) -> None:
    assert {
        "README.md",
        "config/parameters.yaml",
        "launch/controller.launch.py",
        "package.xml",
        f"resource/{PACKAGE}",
        "setup.cfg",
        "setup.py",
        "test/test_supervisor.py",
        f"{PACKAGE}/__init__.py",
        f"{PACKAGE}/interfaces.py",
        f"{PACKAGE}/middleware.py",
        f"{PACKAGE}/node.py",
        f"{PACKAGE}/start.py",
        f"{PACKAGE}/supervisor.py",
        f"{PACKAGE}/runtime/startup.py",
    } <= set(files)


def test_package_xml(files: GeneratedFiles) -> None:
    root = ElementTree.fromstring(files["package.xml"])
    assert root.get("format") == "3"
    assert root.findtext("name") == PACKAGE
    assert re.fullmatch(r"[^@ ]+@[a-z]+\.[a-z]{2,}", root.find("maintainer").get("email"))  # type: ignore[union-attr, arg-type]
    assert {"rclpy", "geometry_msgs", "sensor_msgs", "std_msgs"} <= {item.text for item in root.findall("exec_depend")}
    assert root.findtext("export/build_type") == "ament_python"


def test_setup_py_installs_what_is_there(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    given: dict[str, Any] = {}
    stub = types.ModuleType("setuptools")
    stub.setup = lambda **arguments: given.update(arguments)  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "setuptools", stub)
    monkeypatch.chdir(folder)
    exec(compile((folder / "setup.py").read_text(), "setup.py", "exec"), {"__name__": "__main__"})
    assert given["name"] == PACKAGE
    found = [str(path.parent.relative_to(folder)).replace("/", ".") for path in folder.rglob("__init__.py")]
    assert given["packages"] == sorted(found) == [PACKAGE, f"{PACKAGE}.runtime"]
    assert given["extras_require"] == {"test": ["pytest"]}
    scripts = [f"controller = {PACKAGE}.entry:run_node", f"start_line_follower = {PACKAGE}.entry:run_starter"]
    assert given["entry_points"] == {"console_scripts": scripts}
    installed = [path for _, paths in given["data_files"] for path in paths]
    assert all((folder / path).is_file() for path in installed)
    assert {"package.xml", "launch/controller.launch.py", "config/parameters.yaml"} <= set(installed)
    assert f"script_dir=$base/lib/{PACKAGE}" in (folder / "setup.cfg").read_text()
    assert "[tool:pytest]" in (folder / "setup.cfg").read_text()


def test_the_launch_file_starts_the_node_with_its_parameters(folder: Path) -> None:
    found = launch_actions(folder / "launch/controller.launch.py", folder)
    arguments = {item.positional[0]: item.named for item in found["DeclareLaunchArgument"]}
    assert list(arguments) == ["namespace", "use_sim_time", "params_file", "log_level"]
    assert all(item["description"].endswith(".") for item in arguments.values())
    assert (arguments["namespace"]["default_value"], arguments["use_sim_time"]["default_value"]) == ("", "false")
    assert Path(arguments["params_file"]["default_value"]) == folder / "config/parameters.yaml"
    (node,) = found["Node"]
    assert node.named["package"] == PACKAGE
    assert node.named["executable"] == "controller"
    assert node.named["namespace"].positional == ("namespace",)
    file, simulated = node.named["parameters"]
    assert file.positional == ("params_file",)
    value = simulated["use_sim_time"]
    assert (value.positional[0].positional, value.named) == (("use_sim_time",), {"value_type": bool})
    assert set(found) == {"DeclareLaunchArgument", "Node"}


def test_the_parameter_file_holds_every_default(files: GeneratedFiles) -> None:
    content = yaml.safe_load(files["config/parameters.yaml"])["/**"]["ros__parameters"]
    expected = {item.name: item.default for item in (*declarations(("/cmd_vel",)), AUTOSTART, STATE_MESSAGE)}
    # The one who starts the node says whether time is simulated.
    assert {**content, USE_SIM_TIME: False} == expected
    assert USE_SIM_TIME not in content
    description = describe(example_supervisor(FOLLOWER))
    checked = validate(expected, description)
    assert checked.settings.period_s == 0.1
    assert checked.settings.release_identifiers == ("/cmd_vel",)
    assert (checked.topic_prefix, checked.log_folder, checked.publish_state) == ("", "", False)


def test_a_given_parameter_hides_that_of_the_file(files: GeneratedFiles, tmp_path: Path) -> None:
    """ROS keeps one value of each type: the number of the file would win over a text, and nobody would refuse it."""
    text = next(text for path, text in files.items() if path.endswith("/parameter_file.py"))
    names: dict[str, Any] = {"__file__": str(tmp_path / "package" / "parameter_file.py")}
    exec(text.replace("from .interfaces import PACKAGE", "PACKAGE = 'none'"), names)
    (tmp_path / "config").mkdir()
    file = tmp_path / "config" / "parameters.yaml"
    file.write_text(files["config/parameters.yaml"], encoding="utf-8")
    given = ["--ros-args", "-p", "period:=abc", "--param", "node:seed:=x", "-r", "a:=b"]
    first, option, chosen, *rest = names["arguments"](given)
    assert (first, option, rest) == ("--ros-args", "--params-file", ["--", *given])
    whole, left = (yaml.safe_load(Path(path).read_text("utf-8"))["/**"]["ros__parameters"] for path in (file, chosen))
    assert left == {name: value for name, value in whole.items() if name not in ("period", "seed")}
    assert names["arguments"](["--ros-args", "-p", "other:=1"])[2] == str(file)
    # ROS itself refuses a section that is none.
    file.write_text("/**: {ros__parameters: {period: 0.1}}\nodd: 3\n", encoding="utf-8")
    assert yaml.safe_load(Path(names["arguments"](given)[2]).read_text("utf-8")) == {"odd": 3}


def test_the_readme_names_every_topic_and_parameter(files: GeneratedFiles) -> None:
    readme = files["README.md"]
    for row in (
        "| `/scan` | `sensor_msgs/msg/LaserScan` | received | sensor, depth 5 | scan |",
        "| `/line/correction` | `std_msgs/msg/Float32` | received | reliable, depth 10 | correction |",
        "| `/cmd_vel` | `geometry_msgs/msg/Twist` | published | reliable, depth 10 | move, halt |",
        "| safe | no message is sent against a requirement, and no bad state is reached | passed |",
    ):
        assert row in readme
    assert "requirement move needs LineDetector.line_found" in readme
    for parameter in declarations(()):
        assert f"| `{parameter.name}` |" in readme


def test_the_readme_says_how_messages_travel() -> None:
    model = robot(
        "interface t use TwistStamped from geometry_msgs interface s use LaserScan from sensor_msgs "
        "component C { "
        'incoming message go with identifier: "/cmd", type: none, stamped: "base | `x`", qos: best_effort links t '
        'outgoing message scan with identifier: "/scan", type: none, depth: 3, max_age: 30.0 links s }'
    )
    readme = generate(model, "ros2")["README.md"]
    assert "| `/cmd` | `geometry_msgs/msg/TwistStamped` | published | best effort, depth 10 | go |" in readme
    assert "| `/scan` | `sensor_msgs/msg/LaserScan` | received | sensor, depth 3 | scan |" in readme
    assert "\n- `go` on `/cmd` is stamped with the current time" in readme
    assert "\n- `scan` on `/scan` is stale after 30.0 s without a message" in readme


def test_services_and_actions_stand_in_the_package() -> None:
    files = generate(example_supervisor(NAVIGATION), "ros2")
    readme = files["README.md"]
    assert "| `/calibrate` | `std_srvs/srv/Trigger` | service | calibrate |" in readme
    assert "| `/navigate_to_pose` | `robosc_example_interfaces/action/NavigateToPose` | action | navigate |" in readme
    dependencies = {item.text for item in ElementTree.fromstring(files["package.xml"]).findall("exec_depend")}
    assert {"std_srvs", "robosc_example_interfaces", "diagnostic_msgs"} <= dependencies
    assert "start_navigation = " in files["setup.py"]


@pytest.mark.parametrize(
    ("name", "package"),
    [
        ("LineFollower", "line_follower_controller"),
        ("HTTPRobot2", "http_robot2_controller"),
        ("_x__Y_", "x_y_controller"),
        ("_9", "robot_9_controller"),
        ("__", "robot_controller"),
        ("class", "class_controller"),
        ("A" * 255, "a" * 100 + "_controller"),
    ],
)
def test_the_package_has_a_valid_name(name: str, package: str) -> None:
    files = generate(robot("", name), "ros2")
    assert f"{package}/node.py" in files
    assert re.fullmatch(r"[a-z][a-z0-9]*(_[a-z0-9]+)*", package)


def test_a_package_says_who_maintains_it_under_which_licence() -> None:
    metadata = PackageMetadata('Ann & "Bo" O\'Neil', "ann@example.org", "BSD-3-Clause", "1.2.3")
    for target in ("ros2", "ros2-cpp", "ros1", "ros1-cpp"):
        root = ElementTree.fromstring(generate(robot(""), target, GenerateOptions(metadata=metadata))["package.xml"])
        maintainer = root.find("maintainer")
        assert maintainer is not None
        assert (maintainer.text, maintainer.get("email")) == (metadata.maintainer, metadata.email)
        assert (root.findtext("license"), root.findtext("version")) == (metadata.license, metadata.version)
    setup = generate(robot(""), "ros2", GenerateOptions(metadata=metadata))["setup.py"]
    (call,) = (
        node for node in ast.walk(ast.parse(setup)) if isinstance(node, ast.Call) and "setup" in ast.dump(node.func)
    )
    given = {item.arg: item.value.value for item in call.keywords if isinstance(item.value, ast.Constant)}
    assert (given["maintainer"], given["maintainer_email"]) == (metadata.maintainer, metadata.email)
    assert (given["license"], given["version"]) == (metadata.license, metadata.version)


# Refused models.


@pytest.mark.parametrize(("target", "package"), [("ros2", "rclpy"), ("ros2", "robosc_msgs"), ("ros1", "rospy")])
def test_a_package_cannot_be_called_like_one_that_it_needs(target: str, package: str) -> None:
    body = "component C { incoming message m with type: none }"
    with pytest.raises(UnsupportedModelError, match=f"would be called {package}, like a package that it needs"):
        generate(robot(body), target, GenerateOptions(package=package))


# Parameters.


def given(**changes: Any) -> dict[str, Any]:
    return {item.name: item.default for item in declarations(("/cmd_vel",))} | changes


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"period": 0}, "parameter 'period' is 0; it must be"),
        ({"period": float("nan")}, "parameter 'period' is nan; it must be"),
        ({"period": "fast"}, "parameter 'period' is 'fast'; it must be"),
        ({"period": None}, "parameter 'period' is None; it must be"),
        ({"period": 1e9}, "parameter 'period' is 1000000000.0; it must be at most 3600 seconds"),
        ({"policy": "best"}, "parameter 'policy' is 'best'; it must be one of fair, priority, random"),
        ({"policy": ["fair"]}, "parameter 'policy' is "),
        ({"priority": "move"}, "parameter 'priority' is 'move'; it must be a list of strings"),
        ({"priority": ["mvoe"]}, "parameter 'priority': 'mvoe' is not a request; did you mean 'move'?"),
        ({"seed": 1.5}, "parameter 'seed' is 1.5; it must be an integer"),
        ({"every": "day"}, "parameter 'every' is 'day'; it must be one of period, event"),
        ({"release_identifiers": ["/scan"]}, "parameter 'release_identifiers': '/scan' is not"),
        ({"max_age": ["/scan"]}, "parameter 'max_age' is '/scan'; it must be topic=seconds"),
        ({"max_age": ["/scan=soon"]}, "parameter 'max_age' is '/scan=soon'; it must be topic=seconds"),
        ({"max_age": ["/scan=0"]}, "parameter 'max_age of /scan' is 0.0"),
        ({"max_age": ["/cmd_vel=1"]}, "parameter 'max_age': '/cmd_vel' is not"),
        ({"on_unknown": "panic"}, "parameter 'on_unknown' is 'panic'; it must be one of default, keep, fault"),
        ({"service_timeout": -1.0}, "parameter 'service_timeout' is -1.0; it must be a number of seconds, 0 or more"),
        ({"service_timeout": True}, "parameter 'service_timeout' is True; it must be a number of seconds"),
        ({"action_timeout": "long"}, "parameter 'action_timeout' is 'long'; it must be a number of seconds"),
        ({"action_timeout": float("nan")}, "parameter 'action_timeout' is nan; it must be a number of seconds"),
        ({"server_wait": float("inf")}, "parameter 'server_wait' is inf; it must be a number of seconds"),
        ({"resample_scans": "yes"}, "parameter 'resample_scans' is 'yes'; it must be true or false"),
        ({"use_sim_time": 1}, "parameter 'use_sim_time' is 1; it must be true or false"),
        ({"topic_prefix": "a b"}, "parameter 'topic_prefix' is 'a b'; it must be empty or"),
        ({"topic_prefix": "robot"}, "parameter 'topic_prefix' is 'robot'"),
        ({"log_folder": 3}, "parameter 'log_folder' is 3; it must be a string"),
        ({"publish_state": 1}, "parameter 'publish_state' is 1; it must be true or false"),
    ],
)
def test_a_wrong_parameter_is_one_clear_error(changes: dict[str, Any], complaint: str) -> None:
    with pytest.raises(ParameterError) as raised:
        validate(given(**changes), describe(example_supervisor(FOLLOWER)))
    assert str(raised.value).startswith(complaint)


def test_the_ends_of_a_range_are_valid_and_what_lies_beyond_is_not() -> None:
    description = describe(example_supervisor(FOLLOWER))
    ranged = [item for item in declarations(("/cmd_vel",)) if item.bounds is not None]
    assert {item.name for item in ranged} == {
        *("period", "service_timeout", "action_timeout", "cancel_timeout", "server_wait")
    }
    for item in ranged:
        assert item.bounds is not None
        low, high = item.bounds
        for value in (low, item.default, high):
            validate(given(**{item.name: value}), description)
        for value in (math.nextafter(low, -math.inf), math.nextafter(high, math.inf)):
            with pytest.raises(ParameterError):
                validate(given(**{item.name: value}), description)


def test_parameters_become_settings() -> None:
    checked = validate(
        given(
            period=1,
            priority=["halt", ""],
            release_identifiers=[""],
            max_age=["/scan=0.5"],
            service_timeout=3,
            action_timeout=2.5,
            cancel_timeout=1,
            server_wait=0,
            resample_scans=True,
            topic_prefix="/a/b/",
        ),
        describe(example_supervisor(FOLLOWER)),
    )
    assert checked.settings.period_s == 1.0
    assert checked.settings.priority == ("halt",)
    assert checked.settings.release_identifiers == ()
    assert checked.settings.max_age_s == {"/scan": 0.5}
    assert (checked.settings.service_timeout_s, checked.settings.action_timeout_s) == (3.0, 2.5)
    assert checked.settings.cancel_timeout_s == 1.0
    assert (checked.server_wait_s, checked.resample_scans) == (0.0, True)
    assert checked.topic_prefix == "/a/b"


def test_zero_is_no_timeout() -> None:
    checked = validate(given(service_timeout=0, action_timeout=0.0), describe(example_supervisor(FOLLOWER)))
    assert (checked.settings.service_timeout_s, checked.settings.action_timeout_s) == (None, None)
    default = validate(given(), describe(example_supervisor(FOLLOWER)))
    assert (default.settings.service_timeout_s, default.settings.action_timeout_s) == (10.0, None)


def test_prefixes() -> None:
    assert prefixed("", "/scan") == "/scan"
    assert prefixed("/a", "/scan") == "/a/scan"
    assert prefixed("/a", "scan") == "/a/scan"
    assert prefixed("/a", "~/scan") == "~/scan"


# The topic /state.


def test_every_transition_has_a_number_of_its_own() -> None:
    tables = state_topic(example_supervisor(FOLLOWER).model)
    components: Any = tables.definition["components"]
    drawn = [
        (component["name"], state["name"], item)
        for component in components
        for state in component["behaviour"]["states"]
        for item in state["transitions"]
    ]
    numbers = [item["id"] for _, _, item in drawn]
    assert numbers == list(range(1, len(numbers) + 1))
    lidar = [
        (state, item["next"], item["type"], item["communication"])
        for name, state, item in drawn
        if name == "LidarSensor"
    ]
    assert lidar == [
        ("unsafe", "safe", "tau", ""),
        ("unsafe", "unsafe", "response", "scan"),
        ("safe", "unsafe", "tau", ""),
        ("safe", "safe", "response", "scan"),
    ]
    by_place = {(name, state, item["type"], item["communication"]): item["id"] for name, state, item in drawn}
    assert dict(tables.transitions["scan.response"])["LidarSensor"] == {
        state: by_place["LidarSensor", state, "response", "scan"] for state in ("unsafe", "safe")
    }


# Uses of rclpy beside its documented interface.


@pytest.mark.parametrize("name", ["ros2", "ros2-goals", "ros2-types", "ros2-layer"])
def test_every_use_of_a_private_attribute_of_rclpy_is_known_and_tried(name: str) -> None:
    files = PACKAGES[name]()
    assert private_uses(files) <= set(PRIVATE)
    trials = ast.parse(Path(rclpy_uses.__file__).with_name("rclpy_internals.py").read_text(encoding="utf-8"))
    tried = {item.name for item in trials.body if isinstance(item, ast.FunctionDef)}
    assert {*PRIVATE, *INTERNAL} <= tried


def test_all_of_them_are_used() -> None:
    texts = {
        path: text for name in ("ros2-goals", "ros2-types", "ros2-layer") for path, text in PACKAGES[name]().items()
    }
    assert private_uses(texts) == set(PRIVATE)
    assert all(any(name in text for text in texts.values()) for name in INTERNAL)


def test_a_use_that_nobody_knows_is_noticed() -> None:
    text = "class A(Node):\n    def f(self):\n        self._own = self._clock\n        return self._own\n"
    assert private_uses({"a.py": text, "b.py": "getattr(x, '_timers', ())\n"}) == {"_clock", "_timers"}
