"""A generated ROS 1 package in a catkin workspace: built, tested, installed, and started by roslaunch."""

import signal
import subprocess
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator, Mapping
from pathlib import Path

import pytest

from robosc.model.structure import Deployment
from robosc.targets import generate, write_files
from support.generated import example_supervisor
from support.process import Process
from support.ros1 import PYTHON, Master, Peer, clean_environment, missing, until
from support.waiting import wait_until

pytestmark = [
    pytest.mark.ros1,
    pytest.mark.skipif(missing() is not None, reason=str(missing())),
    pytest.mark.skipif(not Path("/usr/bin/catkin_make").exists(), reason="catkin is not installed"),
]

PACKAGE = "line_follower_controller"
LAYER = "line_follower_layer_layer"
BUILD_LIMIT_S = 240.0


def run(command: list[str], folder: Path) -> str:
    """The output of a command that succeeds."""
    result = subprocess.run(
        command, cwd=folder, env=clean_environment(), capture_output=True, text=True, timeout=BUILD_LIMIT_S, check=False
    )
    assert result.returncode == 0, result.stdout + result.stderr
    return result.stdout


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A built workspace, with a controller and a supervision layer."""
    folder = tmp_path_factory.mktemp("workspace")
    write_files(generate(example_supervisor("line_follower/line_follower"), "ros1"), folder / "src" / PACKAGE)
    layer = example_supervisor("line_follower/line_follower_layer", Deployment.LAYER)
    write_files(generate(layer, "ros1"), folder / "src" / LAYER)
    run(["catkin_make", f"-DPYTHON_EXECUTABLE={PYTHON}", "install"], folder)
    return folder


def sourced(folder: Path, variables: Mapping[str, str]) -> dict[str, str]:
    """The environment after a workspace's setup file."""
    output = subprocess.run(
        ["/bin/sh", "-c", f". {folder}/setup.sh && env -0"],
        env={**variables, "_CATKIN_SETUP_DIR": str(folder)},
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    return dict(item.split("=", 1) for item in output.split("\0") if item)


@pytest.fixture
def master(tmp_path: Path) -> Iterator[Master]:
    with Master(tmp_path) as found:
        yield found


def test_its_tests_run_and_can_fail(workspace: Path) -> None:
    run(["catkin_make", "run_tests"], workspace)
    file = workspace / "build/test_results" / PACKAGE / "supervisor.xml"
    suite = ElementTree.parse(file).getroot()
    assert (suite.get("tests"), suite.get("failures")) == ("3", "0")
    assert "8 tests, 0 errors, 0 failures" in run(["catkin_test_results", "build/test_results"], workspace)

    supervisor = workspace / "src" / PACKAGE / PACKAGE / "supervisor.py"
    text = supervisor.read_text()
    begin = text.index("def allow_move_request")
    try:
        supervisor.write_text(text[:begin] + text[begin:].replace("== 'safe'", "== 'unsafe'", 1))
        run(["catkin_make", "run_tests"], workspace)
        assert ElementTree.parse(file).getroot().get("failures") == "1"
    finally:
        supervisor.write_text(text)


@pytest.mark.parametrize("space", ["devel", "install"])
def test_roslaunch_starts_it_with_its_parameters(workspace: Path, space: str, master: Master, tmp_path: Path) -> None:
    file = tmp_path / "own.yaml"
    file.write_text("period: 0.02\npublish_state: true\n")
    command = [
        "/usr/bin/roslaunch",
        "-p",
        str(master.port),
        PACKAGE,
        "controller.launch",
        "name:=left",
        f"parameters:={file}",
    ]
    environment = sourced(workspace / space, master.variables)
    with Peer(master, tmp_path) as peer, Process(command, environment, tmp_path / "launch") as launch:
        peer.subscribe("/cmd_vel", "geometry_msgs/Twist")
        peer.subscribe("/state", "std_msgs/String")
        until(lambda: bool(peer.values("/cmd_vel")) and bool(peer.values("/state")), "the commands", launch)
        assert peer.ends("/cmd_vel") == ["/left"]
        launch.signal(signal.SIGINT)
        assert launch.wait(30.0) == 0
        assert "[left-1] killing on exit" in launch.stdout + launch.stderr
        assert "escalating" not in launch.stdout + launch.stderr


def test_the_installed_programs_find_package_and_parameters(workspace: Path, master: Master, tmp_path: Path) -> None:
    environment = sourced(workspace / "install", master.variables)
    share = workspace / "install/share" / PACKAGE
    assert (share / "README.md").is_file() and (share / "launch/controller.launch").is_file()
    parameters = share / "config/parameters.yaml"
    text = parameters.read_text()
    try:
        parameters.write_text(text.replace("period: 0.1", "period: -1.0"))
        for script, complaint in (("start_line_follower", "parameter 'period' is -1.0"), ("controller", "")):
            program = workspace / "install/lib" / PACKAGE / script
            with Process([str(program)], environment, tmp_path / script) as node:
                if complaint:
                    assert node.wait() == 2
                    assert node.stderr.startswith(f"{PACKAGE}: {complaint}")
                else:
                    with Peer(master, tmp_path) as peer:
                        until(lambda: "/cmd_vel" in peer.names()["publishers"], "the node", node)
                    node.signal(signal.SIGTERM)
                    assert node.wait() == 0
    finally:
        parameters.write_text(text)


def test_the_installed_layer_starts_a_controller_from_any_folder(
    workspace: Path, master: Master, tmp_path: Path
) -> None:
    environment = sourced(workspace / "install", master.variables)
    program = workspace / "install/lib" / LAYER / "start_line_follower_layer"
    controller = tmp_path / "controller"
    controller.write_text('#!/bin/sh\necho "$@"\nexec sleep 1000\n')
    controller.chmod(0o755)
    command = [str(program), "_server_wait:=0.0", "--controller", str(controller)]
    with Peer(master, tmp_path) as peer, Process(command, environment, tmp_path / "layer") as layer:
        until(lambda: "/supervised/cmd_vel" in peer.names()["subscribers"], "the layer", layer)
        until(lambda: "/cmd_vel:=/supervised/cmd_vel" in layer.stdout.split(), "the controller", layer)
        layer.signal(signal.SIGTERM)
        assert layer.wait() == 0, layer.stderr
    command = ["/usr/bin/roslaunch", "-p", str(master.port), LAYER, "layer.launch", "topic_prefix:=/r"]
    with Peer(master, tmp_path) as peer, Process(command, environment, tmp_path / "launch") as launch:
        until(lambda: "/r/supervised/cmd_vel" in peer.names()["subscribers"], "the layer", launch)
        launch.signal(signal.SIGINT)
        assert launch.wait(30.0) == 0


def test_a_launch_file_ends_with_its_node(workspace: Path, master: Master, tmp_path: Path) -> None:
    file = tmp_path / "own.yaml"
    file.write_text("period: -1.0\n")
    command = ["/usr/bin/roslaunch", "-p", str(master.port), PACKAGE, "controller.launch", f"parameters:={file}"]
    with Process(command, sourced(workspace / "devel", master.variables), tmp_path / "launch") as launch:
        wait_until(lambda: not launch.is_running, "the end of roslaunch", 60.0)
        assert "parameter 'period' is -1.0; it must be" in launch.stderr
