"""A generated ROS 2 node on a middleware that acknowledges at once: its last message arrives all the same."""

import signal
from pathlib import Path
from typing import Any

import pytest

from robosc.model.structure import Deployment
from robosc.targets import generate, write_files
from support import models
from support.execution import supervisor_of
from support.models import model_of
from support.ros2 import Peer, RosProcess, environment, own_domain

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed")

pytestmark = pytest.mark.ros2

LIMIT_S = 30.0
MIDDLEWARE = Path(models.__file__).with_name("late_middleware.py")
MODEL = """
robot Rover {
    interface twist use Twist from geometry_msgs
    datatype object Vector { x: double }
    datatype object Twist { linear: Vector }
    component Base {
        incoming message drive with identifier: "/cmd_vel", type: Twist links twist
        behaviour { initial marked state ready { on request to drive } }
    }
    provide drive with { linear: { x: 0.5 } }
}
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_the_last_message_arrives(number: signal.Signals, tmp_path: Path) -> None:
    from geometry_msgs.msg import Twist

    write_files(generate(supervisor_of(model_of(MODEL), Deployment.CONTROLLER), "ros2"), tmp_path / "package")
    with own_domain() as domain:
        around = environment(domain, tmp_path)
        with Peer(domain, around) as peer:
            commands: list[Any] = peer.receive(Twist, "/cmd_vel")
            command = [str(MIDDLEWARE), "rover_controller.node", "--ros-args", "-p", "period:=0.02"]
            with RosProcess(command, around, tmp_path / "run", [tmp_path / "package"]) as node:
                peer.spin_until(lambda: bool(commands), LIMIT_S, "a command", node)
                node.signal(number)
                peer.spin_until(lambda: not node.is_running, LIMIT_S, "the end")
                assert node.wait() == 0, node.stderr
            peer.spin_until(lambda: commands[-1].linear.x == 0.0, LIMIT_S, "the last message, which stops the robot")
