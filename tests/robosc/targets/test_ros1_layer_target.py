"""The generated ROS 1 package of a supervision layer: what it has of its own."""

import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest

from robosc.errors import UnsupportedModelError
from robosc.targets import GeneratedFiles, GenerateOptions, generate
from robosc.targets.registry import SupervisedController
from robosc.targets.ros1.runtime.remapping import remapped, remapping_arguments
from support.porter_ros1 import PACKAGE, model
from support.ros_layers import hostile_package, layer_of

pytest.importorskip("yaml", reason="PyYAML, a part of ROS 2, is not installed")


@pytest.fixture(scope="module")
def files() -> GeneratedFiles:
    return generate(layer_of(model()), "ros1")


def test_the_packages_own_tests_pass_without_pytest(folder: Path) -> None:
    run = [sys.executable, "test/run_tests.py", "results.xml"]
    result = subprocess.run(run, cwd=folder, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stdout + result.stderr
    suite = ElementTree.parse(folder / "results.xml").getroot()
    assert (suite.get("tests"), suite.get("failures")) == ("5", "0")


def test_its_programs_are_executable_and_installed(files: GeneratedFiles) -> None:
    assert files.executables == {"scripts/layer", "scripts/start_porter"}
    assert "scripts/layer scripts/start_porter" in files["CMakeLists.txt"]


# Names.

LAUNCH = "launch/layer.launch"
CONTROLLER = ("controller_package", "controller_executable", "controller_launch_file")


def test_every_name_of_an_existing_controller_is_remapped() -> None:
    names = remapped(["/a", "b", "/a"], ["/go"])
    assert names[:2] == (("/a", "/supervised/a"), ("b", "supervised/b"))
    assert [old for old, _ in names[2:]] == [
        f"/go/{part}" for part in ("goal", "cancel", "status", "feedback", "result")
    ]
    assert names[2][1] == "/supervised/go/goal"
    assert remapping_arguments(names[:1], "/r") == ["/r/a:=/r/supervised/a"]


def defaults(files: GeneratedFiles) -> list[str | None]:
    """Return the controller that the launch file starts before the layer unless its arguments say otherwise."""
    arguments = {item.get("name"): item.get("default") for item in ElementTree.fromstring(files[LAUNCH]).iter("arg")}
    return [arguments[name] for name in CONTROLLER]


def test_the_launch_file_starts_the_layer_and_an_existing_controller(files: GeneratedFiles) -> None:
    root = ElementTree.fromstring(files[LAUNCH])
    assert all(str(item.get("doc")).endswith(".") for item in root.iter("arg"))
    assert defaults(files) == ["", "controller", ""]
    layer = root.find("node")
    assert layer is not None
    assert (layer.get("pkg"), layer.get("type"), layer.get("required")) == (PACKAGE, "layer", "$(arg required)")
    assert layer.find("remap") is None
    expected = [
        ("$(arg topic_prefix)" + old, "$(arg topic_prefix)" + new)
        for old, new in remapped(["/allowed", "/scan", "/cmd_vel", "/volume", "/power"], ["/count"])
    ]
    # A relative name is found below the prefix or, where there is none, in the namespace.
    expected.insert(3, ("volume", "supervised/volume"))
    node, included = root.findall("group")
    for parent in (node.find("node"), included):
        assert parent is not None
        assert [(item.get("from"), item.get("to")) for item in parent.findall("remap")] == expected
    # A group renames the names that come after that in it.
    assert included[-1].tag == "include"


@pytest.mark.parametrize(
    "supervised", [SupervisedController("drives", "drive"), SupervisedController("drives", launch_file="d.launch")]
)
def test_the_controller_that_is_known_is_the_default(supervised: SupervisedController) -> None:
    files = generate(layer_of(model()), "ros1", GenerateOptions(supervised=supervised))
    assert defaults(files) == ["drives", supervised.executable or "controller", supervised.launch_file or ""]


# Parameters.


def test_the_readme_names_both_sides(files: GeneratedFiles) -> None:
    readme = files["README.md"]
    for row in (
        "| `/scan` | `/supervised/scan` | `sensor_msgs/LaserScan` | sensor, depth 5 | scan |",
        "| `/supervised/cmd_vel` | `/cmd_vel` | `geometry_msgs/Twist` | reliable, depth 10 | walk, halt |",
        "| `supervised/volume` | `volume` | `std_msgs/Float32` | reliable, depth 10 | loud, quiet |",
        "| `/supervised/power` | `/power` | `std_srvs/SetBool` | | power (service) |",
        "| `/supervised/count` | `/count` | `actionlib/Test` | | count (action) |",
        "/count/feedback:=/supervised/count/feedback",
    ):
        assert row in readme


@pytest.mark.parametrize(
    ("body", "problem"),
    [
        (
            "interface i use Go from x_msgs component C {"
            '  action a with identifier: "/a", request: none, response: none, feedback: none links i'
            '  outgoing message m with identifier: "a/status", type: none }',
            "the topic a/status is a part of the action 'a', which a supervision layer offers by itself",
        ),
        (
            'component C { outgoing message m with identifier: "_x", type: none }',
            "the identifier '_x' is not a name in ROS 1",
        ),
    ],
)
def test_names_without_a_meaning_in_ros_1_are_refused(body: str, problem: str) -> None:
    with pytest.raises(UnsupportedModelError) as raised:
        generate(layer_of(f"robot Robot {{ {body} }}"), "ros1")
    assert str(raised.value).startswith(f"target ros1: {problem}")


# Hostile texts.


def test_texts_of_the_model_stay_texts(tmp_path: Path) -> None:
    hostile_package("ros1", tmp_path)
    names = {(item.get("from"), item.get("to")) for item in ElementTree.parse(tmp_path / LAUNCH).iter("remap")}
    assert ("$(arg topic_prefix)/import/class", "$(arg topic_prefix)/supervised/import/class") in names
