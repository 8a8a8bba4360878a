"""The packages of the targets ros1-cpp and ros2-cpp as texts: what they hold, and what is refused."""

import json
import re
from collections import Counter
from pathlib import Path
from types import ModuleType
from xml.etree import ElementTree

import pytest
import yaml

from robosc.certification import make_supervisor
from robosc.errors import UnsupportedModelError
from robosc.model.structure import Deployment
from robosc.supervisor import Supervisor
from robosc.targets import GenerateOptions, PackageMetadata, StateMessage, generate, write_files
from robosc.targets.cpp.naming import file_name
from robosc.targets.ros.runtime.parameters import declarations
from robosc.targets.ros1 import package as ros1
from robosc.targets.ros1_cpp import package as ros1_cpp
from robosc.targets.ros2 import package as ros2
from robosc.targets.ros2_cpp import package as ros2_cpp
from support.c99_layer import ABORTS
from support.generated import example_supervisor
from support.launch_stub import launch_actions
from support.models import EXAMPLES, bundle_of
from support.steward import steward

TARGETS = ("ros1-cpp", "ros2-cpp")

FOLLOWER = "line_follower/line_follower"

NAVIGATION = "navigation/navigation"

PACKAGE = "line_follower_controller"


def supervisor_of(body: str) -> Supervisor:
    made = make_supervisor(bundle_of(body))
    assert made.supervisor is not None, made.reason
    return made.supervisor


def robot(body: str) -> Supervisor:
    return supervisor_of(f"robot Robot {{ {body} }}")


@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize("name", [FOLLOWER, "maze_solver/maze_solver", NAVIGATION])
def test_a_package_is_complete_and_the_same_each_time(target: str, name: str) -> None:
    files = generate(example_supervisor(name), target)
    assert generate(example_supervisor(name), target) == files
    root = ElementTree.fromstring(files["package.xml"])
    package = root.findtext("name")
    assert package is not None
    assert package in files["CMakeLists.txt"]
    needed = {item.text for item in root.findall("depend")}
    assert ({"roscpp"} if target == "ros1-cpp" else {"rclcpp"}) | {"diagnostic_msgs", "std_msgs"} <= needed
    # Included files are of a package that is asked for, of the package itself, or of the system.
    client = {"ros", "boost", "xmlrpcpp"} if target == "ros1-cpp" else set()
    for path, text in files.items():
        if path.endswith((".cpp", ".hpp", ".c", ".h")):
            for included in re.findall(r"#include <(\w+)/", text):
                optional = {"actionlib", "actionlib_msgs", "gtest", "rclcpp_action", "sys"}
                assert included in needed | client | optional, (path, included)
            for included in re.findall(r'#include "([^"]+)"', text):
                folder = Path("/package/src") if path.startswith("test/") else (Path("/package") / path).parent
                assert str((folder / included).resolve().relative_to("/package")) in files, (path, included)
            # The runtime's own prefix is the robot's in generated files.
            assert not re.search(r"\brobot_[a-z]\w*_t\b", text), path
    dependencies = [name for name in needed if name]
    assert all(name in files["CMakeLists.txt"] for name in dependencies)


def test_the_actions_client_library_is_needed_for_actions_only() -> None:
    for target, library in (("ros1-cpp", "actionlib"), ("ros2-cpp", "rclcpp_action")):
        for name, is_needed in ((FOLLOWER, False), (NAVIGATION, True)):
            files = generate(example_supervisor(name), target)
            assert (f"<depend>{library}</depend>" in files["package.xml"]) is is_needed
            assert (library in files["CMakeLists.txt"]) is is_needed


@pytest.mark.parametrize("target", TARGETS)
def test_no_package_is_needed_twice(target: str) -> None:
    """An action of the package of the client library itself: catkin refuses a package that is named twice."""
    texts = ("use NavigateToPose from robosc_example_interfaces", "use Test from actionlib")
    body = (EXAMPLES / f"{NAVIGATION}.rscd").read_text(encoding="utf-8")
    assert texts[0] in body
    files = generate(supervisor_of(body.replace(*texts)), target)
    needed = [item.text for item in ElementTree.fromstring(files["package.xml"]).findall("depend")]
    assert "actionlib" in needed
    assert len(needed) == len(set(needed))


@pytest.mark.parametrize("target", TARGETS)
def test_parameters_stand_in_file_code_and_readme(target: str) -> None:
    files = generate(example_supervisor(FOLLOWER), target)
    given = yaml.safe_load(files["config/parameters.yaml"])
    values = given if target == "ros1-cpp" else given["/**"]["ros__parameters"]
    expected = {item.name: item.default for item in declarations(("/cmd_vel",)) if item.name != "use_sim_time"}
    if target == "ros2-cpp":
        expected |= {"autostart": True, "state_message": "json"}
    assert values == expected
    for name, default in expected.items():
        assert f"| `{name}` | `{json.dumps(default)}` |" in files["README.md"]
        assert f'{{"{name}", Value(' in files["src/node.cpp"]


@pytest.mark.parametrize("target", TARGETS)
def test_the_readme_names_every_topic_and_says_how_far_it_was_tested(target: str) -> None:
    text = generate(example_supervisor(FOLLOWER), target)["README.md"]
    for topic in (
        "/line/correction",
        "/line/lost",
        "/scan",
        "/emergency_stop/stop",
        "/cmd_vel",
        "/diagnostics",
        "state",
    ):
        assert f"| `{topic}` |" in text
    assert ("were not\nlinked to rclcpp itself" in text) is (target == "ros2-cpp")
    layer = generate(example_supervisor(f"{FOLLOWER}_layer", Deployment.LAYER), target)["README.md"]
    assert ("were not\nlinked to rclcpp itself" in layer) is (target == "ros2-cpp")
    assert "needs" in text
    services = generate(example_supervisor(NAVIGATION), target)["README.md"]
    assert "| `/calibrate` | `std_srvs/" in services
    assert "| `/navigate_to_pose` | `robosc_example_interfaces/" in services


def test_the_launch_files_start_the_node_with_its_parameters(tmp_path: Path) -> None:
    root = ElementTree.fromstring(generate(example_supervisor(FOLLOWER), "ros1-cpp")["launch/controller.launch"])
    node = root.find("node")
    assert node is not None
    assert (node.get("pkg"), node.get("type"), node.get("name")) == (PACKAGE, "controller", PACKAGE)
    write_files(generate(example_supervisor(FOLLOWER), "ros2-cpp"), tmp_path)
    found = launch_actions(tmp_path / "launch/controller.launch.py", tmp_path)
    (started,) = found["Node"]
    assert (started.named["package"], started.named["executable"]) == (PACKAGE, "controller")
    (loaded,) = found["LoadComposableNodes"]
    (component,) = loaded.named["composable_node_descriptions"]
    assert (component.named["package"], component.named["plugin"]) == (PACKAGE, f"{PACKAGE}::ControllerNode")
    assert component.named["extra_arguments"] == [{"use_intra_process_comms": True}]
    arguments = [item.positional[0] for item in found["DeclareLaunchArgument"]]
    assert arguments == ["namespace", "use_sim_time", "params_file", "log_level", "container"]
    for given in (started.named, component.named):
        assert given["name"] == PACKAGE
        assert given["namespace"].positional == ("namespace",)
        file, simulated = given["parameters"]
        assert file.positional == ("params_file",)
        assert simulated["use_sim_time"].positional[0].positional == ("use_sim_time",)
    # Either a process or a component.
    conditions = [item.named["condition"].positional[0] for item in (started, loaded)]
    assert [type(item).__name__ for item in conditions] == ["EqualsSubstitution", "NotEqualsSubstitution"]
    assert all((item.positional[0].positional, item.positional[1]) == (("container",), "") for item in conditions)


@pytest.mark.parametrize("form", StateMessage)
@pytest.mark.parametrize("target", TARGETS)
def test_only_a_package_whose_state_is_typed_is_built_with_its_message(target: str, form: StateMessage) -> None:
    files = generate(example_supervisor(FOLLOWER), target, GenerateOptions(state_message=form))
    is_typed = target == "ros2-cpp" and form is not StateMessage.JSON
    assert ("<depend>robosc_msgs</depend>" in files["package.xml"]) is is_typed
    assert ("find_package(robosc_msgs REQUIRED)" in files["CMakeLists.txt"]) is is_typed
    assert ("#include <robosc_msgs/msg/supervisor_state.hpp>" in files["src/node.cpp"]) is is_typed
    assert ("| `~/state` | `robosc_msgs/msg/SupervisorState` |" in files["README.md"]) is is_typed
    assert ("with `--state-message typed` or" in files["README.md"]) is (target == "ros2-cpp" and not is_typed)
    given = yaml.safe_load(files["config/parameters.yaml"])
    if target == "ros2-cpp":
        assert given["/**"]["ros__parameters"]["state_message"] == form
    else:
        assert "state_message" not in given


def test_a_package_cannot_be_called_like_that_of_the_typed_state() -> None:
    with pytest.raises(UnsupportedModelError, match="would be called robosc_msgs"):
        generate(example_supervisor(FOLLOWER), "ros2-cpp", GenerateOptions(package="robosc_msgs"))


def test_a_parameter_declares_its_range() -> None:
    text = generate(example_supervisor(FOLLOWER), "ros2-cpp")["src/node.cpp"]
    assert re.search(r'\{"period", .*, Range\{0\.0001, 3600\.0\}\},', text)
    assert re.search(r'\{"policy", .*, std::nullopt\},', text)


def test_every_topic_of_the_model_can_be_overridden_and_the_node_says_what_it_is() -> None:
    metadata = PackageMetadata(version="2.3.4")
    files = generate(example_supervisor(FOLLOWER), "ros2-cpp", GenerateOptions(metadata=metadata))
    text = files["src/node.cpp"]
    assert text.count("options.qos_overriding_options = overridable();") == 2
    found = re.findall(r"listen<[^>]+>\((\d+), ", text)
    assert found == [str(number) for number in range(len(found))]
    assert set(re.findall(r"depths_\.at\((\d+)\)", text)) == set(found)
    assert f'"controller of the robot LineFollower: {PACKAGE} 2.3.4, generated by RoboSC ' in text
    assert "qos_overrides:" in files["README.md"]


def test_two_packages_can_be_loaded_into_one_process() -> None:
    for package in ("one", "two"):
        files = generate(example_supervisor(FOLLOWER), "ros2-cpp", GenerateOptions(package=package))
        assert f"RCLCPP_COMPONENTS_REGISTER_NODE({package}::ControllerNode)" in files["src/node.cpp"]
        assert (
            f'rclcpp_components_register_nodes(${{PROJECT_NAME}} "{package}::ControllerNode")'
            in files["CMakeLists.txt"]
        )
        sources = [text for path, text in files.items() if path.endswith((".hpp", "node.cpp"))]
        assert len(sources) > 10
        # Inline variables and functions of one namespace would be those of whichever package was loaded first.
        for text in sources:
            named = re.findall(r"^namespace(?: (\w+))? \{", text, re.MULTILINE)
            assert named[0] == package
            assert set(named) <= {package, "", "detail", "model"}


@pytest.mark.parametrize("package", ["std", "rclcpp", "main", "namespace"])
@pytest.mark.parametrize("target", TARGETS)
def test_a_package_whose_name_is_no_namespace_is_refused(target: str, package: str) -> None:
    with pytest.raises(UnsupportedModelError, match=f"would be called {package}, which cannot be its namespace"):
        generate(example_supervisor(FOLLOWER), target, GenerateOptions(package=package))


@pytest.mark.parametrize(
    ("body", "problem"),
    [
        (
            'component C { outgoing message m with identifier: "/a b", type: none }',
            "the identifier '/a b' of 'm' is no",
        ),
        (
            "datatype object O { class: double } interface i use Thing from some_msgs"
            " component C { outgoing message m with type: O links i }",
            "no message in C++ has a field 'class', which is a keyword there",
        ),
        (
            "datatype object O { new: double } interface i use Thing from some_msgs"
            " component C { incoming message m with type: O links i }",
            "no message in C++ has a field 'new', which is a keyword there",
        ),
        (
            "interface i use Thing from namespace component C { outgoing message m with type: none links i }",
            "the package 'namespace' is called like a keyword of C++",
        ),
        (
            'component C { outgoing message m with identifier: "/diagnostics", type: string }',
            "the topic /diagnostics is of the type std_msgs/String, but every generated node publishes",
        ),
        (
            "interface i use X from robot_controller component C { outgoing message m with type: none links i }",
            "the generated package would be called robot_controller, like a package whose types it uses",
        ),
        (
            "component C { outgoing message m with type: string"
            ' behaviour { variable t: string = "" on response from m do t := value initial marked state s { } } }',
            "it does not do received texts that are kept",
        ),
    ],
)
@pytest.mark.parametrize("target", TARGETS)
def test_what_it_cannot_do_is_refused_with_its_name(target: str, body: str, problem: str) -> None:
    with pytest.raises(UnsupportedModelError) as raised:
        generate(robot(body), target)
    message = str(raised.value)
    assert message.startswith(f"target {target}: ")
    assert problem in message
    assert "\n" not in message
    assert message.count("target ") == 1


@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize("name", ["line_follower/line_follower_layer", NAVIGATION])
def test_the_package_of_a_layer_is_complete(target: str, name: str) -> None:
    files = generate(example_supervisor(name, Deployment.LAYER), target)
    package = ElementTree.fromstring(files["package.xml"]).findtext("name")
    assert package == name.rpartition("/")[2] + "_layer"
    assert "{% " not in "".join(files.values())
    assert not any(path.startswith("test/") for path in files)
    for path, text in files.items():
        if path.endswith((".cpp", ".hpp", ".c", ".h")):
            folder = (Path("/package") / path).parent
            for included in re.findall(r'#include "([^"]+)"', text):
                assert str((folder / included).resolve().relative_to("/package")) in files, (path, included)
            assert not re.search(r"\brobot_[a-z]\w*_t\b", text), path
            # It contains nothing that decides.
            assert not re.search(r"_tick\(|_POLICY_|get_data|on_fits", text), path
    given = yaml.safe_load(files["config/parameters.yaml"])
    values = given if target == "ros1-cpp" else given["/**"]["ros__parameters"]
    assert "command_timeout" in values
    assert "policy" not in values
    for name_, default in values.items():
        assert f"| `{name_}` | `{json.dumps(default)}` |" in files["README.md"]


@pytest.mark.parametrize("target", TARGETS)
def test_a_layer_tells_the_names_of_both_sides(target: str) -> None:
    files = generate(example_supervisor("line_follower/line_follower_layer", Deployment.LAYER), target)
    for text in (files["README.md"], files["src/node.cpp"]):
        assert "/supervised/cmd_vel" in text
        assert "/supervised/scan" in text
    arguments = ["/cmd_vel", "/supervised/cmd_vel"]
    (launch,) = (path for path in files if path.startswith("launch/layer.launch"))
    assert all(argument.removeprefix("/") in files[launch] for argument in arguments)
    assert ":=".join(arguments) in files["README.md"]


@pytest.mark.parametrize(("target", "python"), [("ros1-cpp", ros1), ("ros2-cpp", ros2)])
def test_names_on_the_side_of_the_existing_controller_are_those_of_the_python_node(
    target: str, python: ModuleType
) -> None:
    middleware = {"ros1-cpp": ros1_cpp, "ros2-cpp": ros2_cpp}[target].MIDDLEWARE
    names = (["/scan", "volume"], ["/count", "move"])
    assert middleware.remapped is not None
    assert middleware.remapped(*names) == python.MIDDLEWARE.remapped(*names)
    assert middleware.parts_of_actions == python.MIDDLEWARE.parts_of_actions


@pytest.mark.parametrize("target", TARGETS)
def test_the_launch_file_of_a_layer_starts_it_and_the_existing_controller(target: str, tmp_path: Path) -> None:
    supervisor = example_supervisor("line_follower/line_follower_layer", Deployment.LAYER)
    files = generate(supervisor, target)
    package = "line_follower_layer_layer"
    if target == "ros1-cpp":
        layer, controller = ElementTree.fromstring(files["launch/layer.launch"]).iter("node")
        assert (layer.get("pkg"), layer.get("type")) == (package, "layer")
        assert controller.find("remap") is not None
        assert "OUTPUT_NAME layer" in files["CMakeLists.txt"]
        return
    write_files(files, tmp_path)
    node, existing = launch_actions(tmp_path / "launch/layer.launch.py", tmp_path)["Node"]
    assert (node.named["package"], node.named["executable"]) == (package, "layer")
    assert existing.named["remappings"]
    assert f'"{package}::LayerNode"' in files["CMakeLists.txt"]
    assert "add_executable(layer src/main.cpp)" in files["CMakeLists.txt"]


@pytest.mark.parametrize(
    ("type_name", "expected"),
    [("Twist", "twist"), ("LaserScan", "laser_scan"), ("PointCloud2", "point_cloud2"), ("BMSStatus", "bms_status")],
)
def test_files_of_types_are_called_as_rosidl_calls_them(type_name: str, expected: str) -> None:
    assert file_name(type_name) == expected


@pytest.mark.parametrize("target", TARGETS)
def test_requests_that_share_a_name_have_one_server_and_a_client_each(target: str) -> None:
    text = generate(steward(Deployment.LAYER, on_ros1=target == "ros1-cpp"), target)["src/node.cpp"]
    clients = re.findall(r"(ServiceCalls|ActionGoals)<.*> client_\d_;", text)
    assert Counter(clients) == {"ServiceCalls": 4, "ActionGoals": 3}
    assert len(re.findall(r"(?:CalledService|ServedAction)<.*> served_\d_;", text)) == 3
    if target == "ros1-cpp":
        # A call waits in a thread: one of each service of the model may be under way.
        assert re.findall(r'served_\d_\(.*"(\S+)"\), .*>, (\d)\)', text) == [
            ("/supervised/power", "2"),
            ("/supervised/plan", "2"),
        ]


@pytest.mark.parametrize("target", TARGETS)
def test_every_number_with_a_limit_can_be_moved_in_a_message(target: str) -> None:
    text = generate(steward(Deployment.LAYER, on_ros1=target == "ros1-cpp"), target)["src/node.cpp"]
    numbers = "order" if target == "ros2-cpp" else "goal", "float64_value" if target == "ros2-cpp" else "tolerance"
    places = re.findall(r"(\S+) = static_cast<std::decay_t", text)
    assert Counter(places) == {
        "sent.linear.x": 1,
        "sent.angular.z": 2,
        "basic_field(sent)": 2,
        f"sent.{numbers[0]}": 2,
        f"sent.{numbers[1]}": 2,
    }


@pytest.mark.parametrize("target", TARGETS)
def test_an_object_of_a_request_is_logged_only_with_a_part(target: str) -> None:
    """A limit may give a part of it, and mostly does not."""
    text = generate(steward(Deployment.CONTROLLER, on_ros1=target == "ros1-cpp"), target)["src/model.hpp"]
    put = text[text.index("void put_request") :]
    assert re.search(r"if \(request\.data\.walk\.angular\.has_z\) \{\s+out \+= .*angular", put)
    assert "if (request.data.walk.linear.has_x || request.data.walk.angular.has_z) {" in put


@pytest.mark.parametrize("target", TARGETS)
def test_a_layer_has_the_reasons_of_the_python_layer_for_goals_that_are_aborted(target: str) -> None:
    files = generate(steward(Deployment.LAYER, on_ros1=target == "ros1-cpp"), target)
    text = next(text for path, text in files.items() if path.endswith("runtime/controller.hpp"))
    assert re.findall(r'"([^"]*)"', text.split("* abort_text(")[1].split("\n    }")[0]) == list(ABORTS)
