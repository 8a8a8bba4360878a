"""Generated launch files on real `launch`: what is started, under which names, and with whose parameters."""

import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

from robosc.model.structure import Deployment
from robosc.supervisor import Supervisor
from robosc.targets import generate
from support.execution import supervisor_of
from support.launched import install, launch_command, variables
from support.models import EXAMPLES, model_of
from support.ros2 import Peer, RosProcess, environment, own_domain

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed")
pytest.importorskip("launch_ros", reason="launch and launch_ros, which no package index has, are not installed")

pytestmark = pytest.mark.ros2

CONTROLLER, LAYER = "line_follower_controller", "line_follower_layer_layer"
INCLUDING = (f"controller_package:={CONTROLLER}", "controller_launch_file:=controller.launch.py")
LIMIT_S = 60.0


@pytest.fixture(scope="module")
def prefix(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An installed layer and an installed controller, whose author gave it a period of its own."""
    folder = tmp_path_factory.mktemp("prefix")
    controller = generate(_relative("line_follower", Deployment.CONTROLLER), "ros2")
    share = install(folder, CONTROLLER, controller, "controller")
    _set(share / "config/parameters.yaml", CONTROLLER, period=0.0625)
    layer = generate(_relative("line_follower_layer", Deployment.LAYER), "ros2")
    share = install(folder, LAYER, layer, "layer")
    _set(share / "config/parameters.yaml", LAYER, period=0.03125)
    return folder


def _relative(example: str, deployment: Deployment) -> Supervisor:
    """The supervisor of an example whose velocity has a relative name."""
    text = (EXAMPLES / "line_follower" / f"{example}.rscd").read_text(encoding="utf-8")
    return supervisor_of(model_of(text.replace('"/cmd_vel"', '"cmd_vel"')), deployment)


def _set(file: Path, package: str, **values: object) -> None:
    content = yaml.safe_load(file.read_text(encoding="utf-8"))
    (section,) = content.values()
    section["ros__parameters"] |= values
    file.write_text(yaml.safe_dump(content), encoding="utf-8")


class Launched:
    """A launch file that was started, and a look at its nodes."""

    def __init__(self, process: RosProcess, peer: Peer) -> None:
        self.process = process
        self.peer = peer

    def has(self, *nodes: str) -> None:
        """Wait until exactly these nodes are there."""
        self.peer.spin_until(lambda: self._nodes() == set(nodes), LIMIT_S, f"{nodes}", self.process)

    def _nodes(self) -> set[str]:
        found = self.peer.node.get_node_names_and_namespaces()
        full = {f"{space.rstrip('/')}/{name}" for name, space in found if not name.startswith("_")}
        return {name for name in full if not name.startswith(("/launch_ros_", "/test_peer"))}

    def parameters(self, node: str, *names: str) -> list[Any]:
        """Values of parameters of a node."""
        from rcl_interfaces.srv import GetParameters
        from rclpy.parameter import parameter_value_to_python

        client = self.peer.node.create_client(GetParameters, f"{node}/get_parameters")
        answer = self.peer.ask(client, GetParameters.Request(names=names), LIMIT_S, self.process)
        return [parameter_value_to_python(value) for value in answer.values]

    def ends(self, topic: str) -> tuple[set[str], set[str]]:
        """Full names of the nodes that publish and that subscribe on a topic."""
        node = self.peer.node
        publishers, subscribers = (
            {f"{end.node_namespace.rstrip('/')}/{end.node_name}" for end in found}
            for found in (node.get_publishers_info_by_topic(topic), node.get_subscriptions_info_by_topic(topic))
        )
        return publishers, subscribers

    def connects(self, topic: str, publisher: str, subscriber: str) -> None:
        """Wait until two nodes meet on a topic."""
        self.peer.spin_until(
            lambda: self.ends(topic) == ({publisher}, {subscriber}),
            LIMIT_S,
            f"{topic}: {self.ends(topic)}",
            self.process,
        )


@pytest.fixture
def start(prefix: Path, tmp_path: Path) -> Iterator[Any]:
    """Function that starts a launch file."""
    with own_domain() as domain:
        around = environment(domain, tmp_path)
        with Peer(domain, around) as peer:
            started: list[RosProcess] = []

            def begin(package: str, file: str, *arguments: str) -> Launched:
                command = launch_command(package, file, arguments)
                started.append(RosProcess(command, variables(prefix, around), tmp_path / "launch"))
                return Launched(started[-1], peer)

            try:
                yield begin
            finally:
                for process in started:
                    process.__exit__(None, None, None)


def test_an_included_controller_has_its_own_parameters(start: Any, prefix: Path, tmp_path: Path) -> None:
    own = tmp_path / "layer.yaml"
    own.write_text((prefix / "share" / LAYER / "config/parameters.yaml").read_text(encoding="utf-8"), encoding="utf-8")
    _set(own, LAYER, period=0.015625)
    launched = start(LAYER, "layer.launch.py", *INCLUDING, f"params_file:={own}", "log_level:=warn")
    launched.has(f"/{LAYER}", f"/{CONTROLLER}")
    assert launched.parameters(f"/{LAYER}", "period") == [0.015625]
    assert launched.parameters(f"/{CONTROLLER}", "period") == [0.0625]
    launched.connects("/supervised/cmd_vel", f"/{CONTROLLER}", f"/{LAYER}")
    launched.process.signal(signal.SIGINT)
    assert launched.process.wait() == 0
    log = launched.process.stdout + launched.process.stderr
    assert f"[{CONTROLLER}]" in log and f"[{LAYER}]" not in log, "the log level is the layer's"


def test_a_namespace_is_that_of_both_once(start: Any) -> None:
    launched = start(LAYER, "layer.launch.py", *INCLUDING, "namespace:=n")
    layer, controller = f"/n/{LAYER}", f"/n/{CONTROLLER}"
    launched.has(layer, controller)
    assert launched.parameters(controller, "period") == [0.0625]
    # A relative name is in the namespace, an absolute one is not.
    launched.connects("/n/supervised/cmd_vel", controller, layer)
    launched.connects("/supervised/scan", layer, controller)


def test_an_executable_has_the_namespace_once(start: Any) -> None:
    launched = start(LAYER, "layer.launch.py", INCLUDING[0], "namespace:=n")
    layer, controller = f"/n/{LAYER}", f"/n/{CONTROLLER}"
    launched.has(layer, controller)
    launched.connects("/n/supervised/cmd_vel", controller, layer)


def test_a_layer_that_is_included_in_a_namespace_is_in_it_once_with_its_controller(start: Any, prefix: Path) -> None:
    (prefix / "share" / LAYER / "launch/robot.launch.py").write_text(OUTER, encoding="utf-8")
    launched = start(LAYER, "robot.launch.py")
    layer, controller = f"/outer/n/{LAYER}", f"/outer/n/{CONTROLLER}"
    launched.has(layer, controller)
    assert launched.parameters(controller, "period") == [0.0625]
    launched.connects("/outer/n/supervised/cmd_vel", controller, layer)


OUTER = f"""
from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import GroupAction, IncludeLaunchDescription
from launch_ros.actions import PushRosNamespace


def generate_launch_description():
    file = get_package_share_directory('{LAYER}') + '/launch/layer.launch.py'
    given = [tuple(item.split(':=')) for item in {INCLUDING!r}] + [('namespace', 'n')]
    layer = IncludeLaunchDescription(file, launch_arguments=given)
    return LaunchDescription([GroupAction([PushRosNamespace('outer'), layer])])
"""


def test_without_a_controller_the_layer_is_alone(start: Any) -> None:
    launched = start(LAYER, "layer.launch.py")
    launched.has(f"/{LAYER}")
    launched.process.signal(signal.SIGINT)
    assert launched.process.wait() == 0


def test_a_controller_alone_has_its_own_parameters_and_the_namespace(start: Any) -> None:
    launched = start(CONTROLLER, "controller.launch.py", "namespace:=/n")
    launched.has(f"/n/{CONTROLLER}")
    assert launched.parameters(f"/n/{CONTROLLER}", "period") == [0.0625]
