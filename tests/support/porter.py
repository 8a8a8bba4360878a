"""The robot Porter, its supervision layer on ROS 2, and a controller before it that cares for nothing."""

import json
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from robosc.certification import make_supervisor
from robosc.model.structure import Deployment
from robosc.supervisor import Supervisor
from support.models import bundle_of
from support.ros2 import Peer, RosProcess, environment, own_domain
from support.ros2_servers import ServerHost

PACKAGE = "porter_layer"
LIMIT_S = 15.0
CARELESS = Path(__file__).with_name("ros2_careless.py")

MODEL = """
robot Porter {
    interface twist use Twist from geometry_msgs
    interface laser use LaserScan from sensor_msgs
    interface set_bool use SetBool from std_srvs
    interface fibonacci use Fibonacci from test_msgs
    datatype object Vector { x: double }
    datatype object Twist { linear: Vector }
    datatype object Scan { ranges: array(double) }
    datatype enum Distance from Scan to { value.ranges[0] > 0.5 -> far default -> near }
    datatype object Order { order: integer }
    datatype object Sequence { sequence: array(integer) }
    datatype object Switch { data: boolean }
    datatype object Done { success: boolean }

    component Permission {
        outgoing message allowed with identifier: "/allowed", type: boolean
        outgoing message scan with identifier: "/scan", type: Distance links laser
        behaviour {
            variable seen: Distance = near
            variable yes: boolean
            on response from scan do seen := value
            on response from allowed do yes := value
            initial marked state denied { transition if yes goto granted }
            marked state granted { transition if !yes goto denied }
        }
    }
    component Base {
        incoming message walk with identifier: "/cmd_vel", type: Twist, when: value.linear.x != 0.0 links twist
        incoming message halt with identifier: "/cmd_vel", type: Twist, when: default links twist
        incoming message loud with identifier: "volume", type: double, when: value > 1.0
        incoming message quiet with identifier: "volume", type: double
        behaviour {
            initial marked state ready {
                on request to walk
                on request to halt
                on request to loud
                on request to quiet
            }
        }
    }
    component Power {
        service power with identifier: "/power", request: Switch, response: Done links set_bool
        behaviour {
            variable is_on: boolean = false
            initial marked state idle { on request to power goto asked }
            state asked {
                on response from power do is_on := value.success goto idle
                on error from power goto idle
            }
        }
    }
    component Counter {
        action count with identifier: "/count", request: Order, response: Sequence, feedback: Sequence links fibonacci
        behaviour {
            variable steps: integer = 0
            initial marked state idle { on request to count goto busy }
            state busy {
                on feedback from count do steps := value.sequence[0]
                on response from count goto idle
                on error from count goto idle
                on cancel from count goto idle
            }
        }
    }
    limit walk to { linear: { x: -1.0..1.0 } } if Permission.granted
    requirement walk needs Permission.granted
    requirement loud needs Permission.granted
    requirement power needs Permission.granted
    requirement count needs Permission.granted
}
"""


def porter_supervisor() -> Supervisor:
    """Synthesized and verified, as a layer."""
    made = make_supervisor(bundle_of(MODEL), deployment=Deployment.LAYER)
    assert made.supervisor is not None, made.reason
    return made.supervisor


class Porter:
    """The robot, whose wheels do what came last, and a look at what the layer does."""

    def __init__(self, workspace: Path, peer: Peer, host: ServerHost, variables: dict[str, str], folder: Path) -> None:
        from geometry_msgs.msg import Twist
        from std_msgs.msg import Float32, String

        self.workspace = workspace
        self.variables = variables
        self.folder = folder
        self.peer = peer
        self.host = host
        self.layer: RosProcess
        self.commands = peer.receive(Twist, "/cmd_vel")
        self.volumes = peer.receive(Float32, "/volume")
        self.blocked = peer.receive(String, "/blocked")
        self._states = peer.receive(String, "/state")

    @property
    def speed(self) -> float:
        return float(self.commands[-1].linear.x) if self.commands else 0.0

    def process(self, command: list[str], name: str) -> RosProcess:
        return RosProcess(command, self.variables, self.folder / name, [self.workspace])

    def start(self, *parameters: str, command: tuple[str, ...] = ("-m", f"{PACKAGE}.start"), after: Any = ()) -> None:
        """Start the layer, and perhaps the existing controller with it."""
        given = ["period:=0.02", "publish_state:=true", f"log_folder:={self.folder / 'events'}", *parameters]
        arguments = [item for parameter in given for item in ("-p", parameter)]
        self.layer = self.process([*command, "--ros-args", *arguments, *after], "layer")
        self.peer.wait_for_peers(["/cmd_vel", "/allowed", "/state", "/supervised/cmd_vel", "/blocked"])

    def start_with_careless(self, *parameters: str) -> None:
        self.start(*parameters, after=["--controller", sys.executable, str(CARELESS)])

    def careless(self) -> RosProcess:
        """The careless controller, started by hand with the printed arguments."""
        printing = self.process(["-m", f"{PACKAGE}.start", "--print-remappings"], "printing")
        assert printing.wait() == 0
        remappings = (self.folder / "printing" / "stdout.txt").read_text().split()
        return self.process([str(CARELESS), *remappings], "careless")

    def until(self, condition: Callable[[], bool], what: str, repeat: Callable[[], object] = lambda: None) -> None:
        self.peer.spin_until(condition, LIMIT_S, what, self.layer, repeat)

    def settle(self) -> None:
        """Return when the layer has looked at all that was sent to it."""
        self.peer.settle(self.layer, LIMIT_S)

    def state(self, component: str) -> str | None:
        return json.loads(self._states[-1].data)["current"][component]["state"] if self._states else None

    def variable(self, component: str, name: str) -> str | None:
        """Its value, as the layer published it last; None if it has published nothing."""
        if not self._states:
            return None
        return str(json.loads(self._states[-1].data)["current"][component]["variables"][name])

    def tell_allowed(self, is_allowed: bool) -> None:
        from std_msgs.msg import Bool

        self.peer.publish(Bool(data=is_allowed), "/allowed")

    def allow(self, is_allowed: bool) -> None:
        state = "granted" if is_allowed else "denied"
        self.until(
            lambda: self.state("Permission") == state,
            f"the permission {state}",
            lambda: self.tell_allowed(is_allowed),
        )

    def blocks(self, identifier: str, count: int = 1) -> None:
        """Wait until so many requests more were held back."""
        before = len(self.blocked)
        self.until(
            lambda: self.held_back(before).count(identifier) >= count,
            f"{count} of {identifier} to be held back",
        )

    def held_back(self, before: int = 0) -> list[str]:
        """Identifiers of what was reported as held back, but for some reports at the begin."""
        return [json.loads(item.data)["identifier"] for item in self.blocked[before:]]

    def reasons(self) -> set[str]:
        """The reasons of these reports."""
        return {json.loads(item.data)["reason"] for item in self.blocked}

    def is_blocked(self, identifier: str) -> bool:
        """Return True if something was reported as held back."""
        return identifier in self.held_back()

    def send(self, speed: float, **others: float) -> None:
        """The existing controller, here in this process, sends a velocity."""
        from geometry_msgs.msg import Twist

        message = Twist()
        message.linear.x = speed
        for name, value in others.items():
            setattr(message.angular, name, value)
        self.peer.publish(message, "/supervised/cmd_vel")

    def drive(self) -> None:
        self.allow(True)
        self.until(lambda: self.speed == 0.3, "the robot to move", lambda: self.send(0.3))

    def wait_for(self, future: Any, what: str) -> Any:
        self.until(future.done, what)
        return future.result()

    def call(self, data: bool = True) -> Any:
        """The existing controller calls the service: a future."""
        from std_srvs.srv import SetBool

        client = self.peer.node.create_client(SetBool, "/supervised/power")
        self.until(client.service_is_ready, "the layer's service")
        return client.call_async(SetBool.Request(data=data))

    def send_goal(self, feedback: Callable[[Any], None] | None = None) -> Any:
        """The existing controller sends a goal: its handle."""
        from rclpy.action import ActionClient
        from test_msgs.action import Fibonacci

        client = ActionClient(self.peer.node, Fibonacci, "/supervised/count")
        self.until(client.server_is_ready, "the layer's action")
        return self.wait_for(client.send_goal_async(Fibonacci.Goal(order=5), feedback), "an answer to the goal")

    def end(self) -> list[Any]:
        """End the layer: its event log."""
        self.layer.signal(signal.SIGTERM)
        self.peer.spin_until(lambda: not self.layer.is_running, LIMIT_S, "the layer's end")
        assert self.layer.wait() == 0, self.layer.stderr
        return self.events()

    def events(self) -> list[Any]:
        (log,) = (self.folder / "events").iterdir()
        return [json.loads(line) for line in log.read_text().splitlines()]


@contextmanager
def porter_robot(workspace: Path, folder: Path) -> Iterator[Porter]:
    """Yield a robot on a domain of its own; its layer is ended at the latest at the end.

    Args:
        workspace: Workspace that has the generated package.
        folder: Folder for what processes write.
    """
    with own_domain() as domain:
        variables = environment(domain, folder)
        with Peer(domain, variables) as peer, ServerHost(domain) as host:
            made = Porter(workspace, peer, host, variables, folder)
            try:
                yield made
            finally:
                if hasattr(made, "layer"):
                    made.layer.__exit__(None, None, None)
