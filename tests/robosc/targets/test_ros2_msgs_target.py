"""The package of the typed state: what it holds, and that nodes fill in exactly that."""

import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from types import SimpleNamespace

import pytest

from robosc.model.structure import Deployment
from robosc.targets import GeneratedFiles, GenerateOptions, StateMessage, generate
from robosc.targets.ros.runtime.parameters import ParameterError
from robosc.targets.ros2.runtime.state import STATE_MESSAGE, valid_state_message
from support.generated import example_supervisor, imported
from support.typed_state import Node, install_messages

MAZE = "maze_solver/maze_solver"
PACKAGE = "maze_solver_controller"


@pytest.fixture(scope="module")
def files() -> GeneratedFiles:
    return generate(example_supervisor(MAZE), "ros2-msgs")


def test_it_is_the_same_for_every_model_and_deployment(files: GeneratedFiles) -> None:
    layer = example_supervisor("line_follower/line_follower_layer", Deployment.LAYER)
    assert generate(layer, "ros2-msgs", GenerateOptions(package="other")) == files


def test_the_build_names_every_message(files: GeneratedFiles) -> None:
    messages = sorted(path for path in files if path.endswith(".msg"))
    assert re.findall(r'"(msg/.*?)"', files["CMakeLists.txt"]) == messages
    root = ElementTree.fromstring(files["package.xml"])
    assert root.findtext("name") == "robosc_msgs"
    assert root.findtext("member_of_group") == "rosidl_interface_packages"
    for path in messages:
        used = set(re.findall(r"^([A-Z]\w+)(?:\[\])? ", files[path], re.MULTILINE))
        assert {f"msg/{name}.msg" for name in used} <= set(messages)


def test_only_a_package_whose_state_is_typed_depends_on_it() -> None:
    for form in StateMessage:
        package = generate(example_supervisor(MAZE), "ros2", GenerateOptions(publish_state=True, state_message=form))
        assert ("<exec_depend>robosc_msgs</exec_depend>" in package["package.xml"]) is (form is not StateMessage.JSON)
        assert f'state_message: "{form}"' in package["config/parameters.yaml"]


@pytest.mark.parametrize("value", ["", "xml", 1, ["json"], None])
def test_another_form_is_one_clear_error(value: object) -> None:
    with pytest.raises(ParameterError, match=r"'state_message' is .*; it must be one of json, typed, both"):
        valid_state_message({STATE_MESSAGE.name: value})


@pytest.mark.ros2
@pytest.mark.parametrize("form", ["json", "typed", "both"])
def test_a_node_publishes_its_state_in_the_form_that_is_asked_for(
    form: str, files: GeneratedFiles, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed")
    install_messages(files, monkeypatch)
    node = Node()
    look = {
        "current": {"Wheels": {"state": "driving", "variables": {"speed": "0.5"}}},
        "communications": {"calibrate": "idle"},
        "transitions": [3, 1],
    }
    executor = SimpleNamespace(
        status=SimpleNamespace(value="stopped"), reasons=("scan is stale",), progress=None, cancelling=("navigate",)
    )
    with imported(generate(example_supervisor(MAZE), "ros2"), tmp_path, f"{PACKAGE}.state_publisher") as generated:
        generated.StatePublisher(node, "/r", form).publish(
            executor, look, lambda given, progress, cancelling: f"text of {len(given)}, {progress}, {cancelling}"
        )
    assert [item.data for item in node.published.get("/r/state", [])] == (
        [] if form == "typed" else ["text of 3, None, ('navigate',)"]
    )
    typed = node.published.get("~/state", [])
    assert len(typed) == (form != "json")
    for message in typed:
        assert (message.robot, message.status, message.reasons) == ("MazeSolver", "stopped", ["scan is stale"])
        (component,) = message.components
        assert (component.name, component.state) == ("Wheels", "driving")
        assert [(item.name, item.value) for item in component.variables] == [("speed", "0.5")]
        assert [(item.name, item.value) for item in message.communications] == [("calibrate", "idle")]
        assert message.cancelling == ["navigate"]
        assert (message.transitions, message.header.stamp) == ([3, 1], "now")


@pytest.mark.ros2
def test_without_the_package_a_typed_state_says_how_to_get_it(tmp_path: Path) -> None:
    pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed")
    with (
        imported(generate(example_supervisor(MAZE), "ros2"), tmp_path, f"{PACKAGE}.state_publisher") as generated,
        pytest.raises(generated.SetupError, match=r"robosc_msgs.*generate and build --target ros2-msgs"),
    ):
        generated.StatePublisher(Node(), "", "typed")
