"""The generated ROS 2 package of a supervision layer: what it has of its own."""

from pathlib import Path
from typing import Any

import pytest

from robosc.targets import GeneratedFiles, GenerateOptions, generate, write_files
from robosc.targets.registry import SupervisedController
from robosc.targets.ros.runtime.supervised import robots_name
from robosc.targets.ros2.runtime.remapping import remapped, remapping_arguments
from support.launch_stub import evaluated, launch_actions
from support.porter import MODEL
from support.ros_layers import hostile_package, layer_of

pytest.importorskip("yaml", reason="PyYAML, a part of ROS 2, is not installed")

PACKAGE = "porter_layer"


@pytest.fixture(scope="module")
def files() -> GeneratedFiles:
    return generate(layer_of(MODEL), "ros2")


def test_its_program_is_installed(files: GeneratedFiles) -> None:
    assert "'layer = ' + PACKAGE + '.entry:run_node'" in files["setup.py"]


# Names.

CONTROLLER = ("controller_package", "controller_executable", "controller_launch_file")


def test_every_name_of_an_existing_controller_is_remapped() -> None:
    names = remapped(["/a", "b", "/a"], ["/go"])
    assert names[:2] == (("/a", "/supervised/a"), ("b", "supervised/b"))
    assert [old for old, _ in names[2:]] == [
        f"/go/_action/{part}" for part in ("send_goal", "cancel_goal", "get_result", "feedback", "status")
    ]
    assert names[2][1] == "/supervised/go/_action/send_goal"
    rules = ["-r", "/r/a:=/r/supervised/a", "-r", "/r/b:=/r/supervised/b"]
    assert remapping_arguments(names[:2], "/r") == ["--ros-args", *rules]
    rules = ["-r", "/a:=/supervised/a", "-r", "b:=supervised/b", "-r", "__ns:=/n"]
    assert remapping_arguments(names[:2], "", "/n") == ["--ros-args", *rules]


def test_the_launch_file_starts_the_layer_and_an_existing_controller(folder: Path) -> None:
    found = launch_actions(folder / "launch/layer.launch.py", folder)
    arguments = {item.positional[0]: item.named for item in found["DeclareLaunchArgument"]}
    assert set(arguments) == {
        "controller_package",
        "controller_executable",
        "controller_launch_file",
        "topic_prefix",
        "namespace",
        "use_sim_time",
        "params_file",
        "log_level",
    }
    assert all(item["description"].endswith(".") for item in arguments.values())
    assert [arguments[name]["default_value"] for name in CONTROLLER] == ["", "controller", ""]
    assert Path(arguments["params_file"]["default_value"]) == folder / "config/parameters.yaml"
    layer, controller = (node.named for node in found["Node"])
    assert (layer["package"], layer["executable"]) == (PACKAGE, "layer")
    file, override = layer["parameters"]
    assert file.positional == ("params_file",)
    assert override["use_sim_time"].positional[0].positional == ("use_sim_time",)
    assert layer["namespace"].positional == controller["namespace"].positional == ("namespace",)
    assert controller["parameters"][0]["use_sim_time"].positional[0].positional == ("use_sim_time",)
    value = override["topic_prefix"]
    assert (value.positional[0].positional, value.named) == (("topic_prefix",), {"value_type": str})
    assert controller["package"].positional == ("controller_package",)
    assert controller["executable"].positional == ("controller_executable",)
    assert type(layer["on_exit"]).__name__ == type(controller["on_exit"]).__name__ == "Shutdown"
    (group,) = found["GroupAction"]
    outer, pushed, simulated, *remaps, included = group.positional[0]
    for item in (outer, pushed):
        (name,) = item.positional[0].positional
        condition = item.named["condition"].positional[0]
        assert [evaluated(condition, {name: value}) for value in ("", "n")] == ["false", "true"]
    assert (simulated.positional[0], simulated.positional[1].positional) == ("use_sim_time", ("use_sim_time",))
    topics, services = ["/allowed", "/scan", "/cmd_vel", "volume"], ["/power"]
    for prefix in ("", "/r"):
        given = {"topic_prefix": prefix}
        rules = [tuple(evaluated(name, given) for name in rule) for rule in controller["remappings"]]
        expected = [
            (robots_name(prefix, old), robots_name(prefix, new)) for old, new in remapped(topics + services, ["/count"])
        ]
        assert set(expected) <= set(rules)
        # A relative name is found below the prefix, in the namespace, and where there is neither.
        others = {("volume", "supervised/volume"), ("/volume", "/supervised/volume")}
        assert set(rules) - set(expected) <= others
        assert [tuple(evaluated(item.named[name], given) for name in ("src", "dst")) for item in remaps] == rules
    # It gets what is given to it, and nothing else of the layer's: no parameter file, log level, namespace argument.
    assert (group.named["scoped"], group.named["forwarding"]) == (True, False)
    given = {"controller_package": "drives", "controller_launch_file": "drive.launch.py", "namespace": "n"}
    given |= {"use_sim_time": "true", "topic_prefix": "/r", "params_file": "own", "log_level": "debug"}
    passed = {name: evaluated(value, given) for name, value in group.named["launch_configurations"].items()}
    path, around, inside = (names for item in (included.positional[0], outer, pushed) for names in [_name(item)])
    assert passed == {
        "use_sim_time": "true",
        "topic_prefix": "/r",
        path: "share of drives/launch/drive.launch.py",
        around: "",
        inside: "n",
    }


def _name(item: Any) -> str:
    """The launch configuration that something reads."""
    return str(item.positional[0].positional[0])


@pytest.mark.parametrize(
    ("given", "started"), [(("", "x", ""), []), (("p", "x", ""), ["Node"]), (("p", "x", "y"), ["GroupAction"])]
)
def test_the_launch_file_starts_what_its_arguments_name(given: Any, started: list[str], folder: Path) -> None:
    found = launch_actions(folder / "launch/layer.launch.py", folder)
    conditions = {
        "Node": found["Node"][1].named["condition"],
        "GroupAction": found["GroupAction"][0].named["condition"],
    }
    arguments = dict(zip(CONTROLLER, given, strict=True))
    assert [
        name for name, condition in conditions.items() if evaluated(condition.positional[0], arguments) == "true"
    ] == started


@pytest.mark.parametrize(
    "supervised", [SupervisedController("drives", "drive"), SupervisedController("drives", launch_file="d.launch.py")]
)
def test_the_controller_that_is_known_is_the_default(supervised: SupervisedController, tmp_path: Path) -> None:
    files = generate(layer_of(MODEL), "ros2", GenerateOptions(supervised=supervised))
    write_files(files, tmp_path)
    found = launch_actions(tmp_path / "launch/layer.launch.py", tmp_path)
    arguments = {item.positional[0]: item.named["default_value"] for item in found["DeclareLaunchArgument"]}
    assert [arguments[name] for name in CONTROLLER] == [
        "drives",
        supervised.executable or "controller",
        supervised.launch_file or "",
    ]


# Parameters.


def test_the_readme_names_both_sides(files: GeneratedFiles) -> None:
    readme = files["README.md"]
    for row in (
        "| `/scan` | `/supervised/scan` | `sensor_msgs/msg/LaserScan` | sensor, depth 5 | scan |",
        "| `/supervised/cmd_vel` | `/cmd_vel` | `geometry_msgs/msg/Twist` | reliable, depth 10 | walk, halt |",
        "| `supervised/volume` | `volume` | `std_msgs/msg/Float32` | reliable, depth 10 | loud, quiet |",
        "| `/supervised/power` | `/power` | `std_srvs/srv/SetBool` | of services | power (service) |",
        "| `/supervised/count` | `/count` | `test_msgs/action/Fibonacci` | of actions | count (action) |",
        "-r /count/_action/feedback:=/supervised/count/_action/feedback",
    ):
        assert row in readme


# Hostile texts.


def test_texts_of_the_model_stay_texts(tmp_path: Path) -> None:
    hostile_package("ros2", tmp_path)
    (node,) = (item.named for item in launch_actions(tmp_path / "launch/layer.launch.py", tmp_path)["Node"][1:])
    rules = {tuple(evaluated(name, {"topic_prefix": ""}) for name in rule) for rule in node["remappings"]}
    assert ("/import/class", "/supervised/import/class") in rules
