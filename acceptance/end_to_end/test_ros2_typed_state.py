"""The typed state over DDS: robosc_msgs built with real colcon beside a generated package, whose node fills it in."""

from pathlib import Path

import pytest

from robosc.targets import GenerateOptions, StateMessage, generate, write_files
from support.colcon import Workspace
from support.execution import supervisor_of
from support.models import model_of
from support.ros2 import RosProcess, environment, own_domain

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed")

# The first run makes an environment, which takes a minute or more.
pytestmark = [pytest.mark.ros2, pytest.mark.timeout(2000)]

LIMIT_S = 120.0

MODEL = """
robot Lamp {
    component Light {
        incoming message blink with identifier: "blink", type: none
        behaviour {
            variable is_bright: boolean = true
            initial marked state lit { on request to blink }
        }
    }
}
"""

LISTENER = f"""
import time
import rclpy
from robosc_msgs.msg import SupervisorState

rclpy.init()
node = rclpy.create_node("listener")
found = []
node.create_subscription(SupervisorState, "/lamp_controller/state", found.append, 10)
deadline = time.monotonic() + {LIMIT_S}
while not any(len(state.transitions) for state in found):
    assert time.monotonic() < deadline
    rclpy.spin_once(node, timeout_sec=0.5)
state = found[-1]
(light,) = state.components
(variable,) = light.variables
print(state.robot, state.status, light.name, light.state, variable.name, variable.value, set(state.transitions))
"""


def test_another_program_reads_the_typed_state(tmp_path: Path) -> None:
    workspace = Workspace(tmp_path / "workspace")
    supervisor = supervisor_of(model_of(MODEL))
    options = GenerateOptions(publish_state=True, state_message=StateMessage.TYPED)
    for target, package in (("ros2-msgs", "robosc_msgs"), ("ros2", "lamp_controller")):
        write_files(generate(supervisor, target, options), workspace.folder / "src" / package)
    workspace.colcon("build")
    with own_domain() as domain:
        variables = environment(domain, tmp_path)
        command = workspace.command("lamp_controller", "start_lamp")
        listen = workspace.python("-c", LISTENER)
        with (
            RosProcess(command, variables, tmp_path / "run", program="/bin/bash") as node,
            RosProcess(listen, variables, tmp_path / "listener", program="/bin/bash") as listener,
        ):
            assert listener.wait(2 * LIMIT_S) == 0, listener.stderr + node.stderr
            assert listener.stdout.split() == ["Lamp", "running", "Light", "lit", "is_bright", "true", "{1}"]
