"""A robot that lives without devices: an executed model that changes by itself, as remote endpoints see a daemon.

`python -m support.live` (with `tests` on the path) serves its live view, for whoever works on the page.
"""

import argparse
import asyncio
import contextlib
import math
import sys
import threading
import time
from collections.abc import AsyncIterator, Iterator, Mapping
from random import Random
from typing import Any

from msgspec import structs

from robosc.execution.interpreter import InterpretedSystem
from robosc.model.structure import CommunicationKind, Deployment
from robosc.supervisor import Supervisor
from robosc_bridge.configuration.channel_mapping import ChannelMapping
from robosc_bridge.configuration.channels import GrpcChannel
from robosc_bridge.daemon.feed import Feed, Snapshot
from robosc_bridge.daemon.operations import Operations
from robosc_bridge.daemon.programs.items import FromProgram
from robosc_bridge.daemon.states import OperatorCommand, Order, State
from robosc_bridge.daemon.threads.reports import Device
from robosc_bridge.daemon.view_settings import ViewSettings
from robosc_bridge.devices.interface import BINS, DriveReading, Pose, RawScan, Scan, Velocity
from robosc_bridge.host import monotonic
from robosc_bridge.safety import Caution, Reason
from robosc_view import ViewEndpoint
from support.fitting_data import fitting, received
from support.models import model_of
from support.random_supervisors import CERTIFICATE

_CALLED = (CommunicationKind.SERVICE, CommunicationKind.ACTION)


def large_model(components: int = 60) -> str:
    """The text of a robot of many components: sensors, motors that some of them hold back, and services."""
    parts = []
    for number in range(components):
        match number % 3:
            case 0:
                parts.append(f"""
    component Sensor{number} {{
        outgoing message seen{number} with identifier: "/seen{number}", type: integer(0..3)
        behaviour {{
            variable level: integer(0..3) = 0
            initial marked state clear {{
                on response from seen{number} do level := value goto near
            }}
            marked state near {{
                on response from seen{number} do level := value goto clear
            }}
        }}
    }}""")
            case 1:
                parts.append(f"""
    component Motor{number} {{
        incoming message go{number} with identifier: "/go{number}", type: integer
        incoming message halt{number} with identifier: "/halt{number}", type: integer
        behaviour {{
            initial marked state still {{ on request to go{number} goto moving }}
            state moving {{ on request to halt{number} goto still }}
        }}
    }}
    requirement go{number} needs Sensor{number - 1}.clear and Sensor{number - 1}.level < 3
    provide go{number} with 1
    provide halt{number} with 0""")
            case _:
                parts.append(f"""
    component Arm{number} {{
        service hold{number} with identifier: "/hold{number}", request: none, response: boolean links holding
        behaviour {{
            variable count: integer(0..100) = 0
            initial marked state open {{
                on request to hold{number}
                on response from hold{number} goto closed
                on error from hold{number}
            }}
            marked state closed {{
                on request to hold{number}
                on response from hold{number} goto open
            }}
        }}
    }}
    requirement Motor{number - 1}.moving disables hold{number}""")
    return "robot Large {\n    interface holding use Hold from large_msgs" + "".join(parts) + "\n}\n"


def supervisor_without_synthesis(text: str) -> Supervisor:
    """A model as its own supervisor, where its requirements are all that is needed."""
    return Supervisor(model_of(text), Deployment.CONTROLLER, (), structs.replace(CERTIFICATE, states="1"))


class LiveRobot:
    """A daemon whose supervisor is at work; every event is reported to the feed, and every state is shown.

    Args:
        supervisor: Supervisor that is executed.
        seed: Seed of what happens.
    """

    def __init__(self, supervisor: Supervisor, seed: int = 1) -> None:
        self.supervisor = supervisor
        self.system = InterpretedSystem(supervisor)
        self.feed = Feed()
        self.orders: list[Order] = []
        self.refusal: str | None = ""
        self.state = State.RUNNING
        self.reasons: tuple[Reason, ...] = ()
        self._model = supervisor.model
        self._dice = Random(seed)
        self._number = 0
        self._begin_s = monotonic()
        self._lock = threading.Lock()
        mapping = ChannelMapping(
            {item.name: GrpcChannel() for item in self._model.communications}, self._model.communications
        )
        self.operations = Operations(supervisor, mapping, self.feed, self._post, lambda: None, is_layer=False)
        self._names = [f"{item.name}.request" for item in self._model.communications if _is_requested(item.kind)]
        self.show()

    def step(self) -> str:
        """Let something happen; returns the event."""
        with self._lock:
            event = self._dice.choice(self._possible())
            self.take(event)
        return event

    def take(self, event: str) -> None:
        """Let an event happen, send it and show the state after it."""
        data = fitting(self._dice, self._model, received(self._model, event), complete=True)
        has_data = event.endswith((".response", ".feedback"))
        self.system.step(event, self.system.read(event, data) if has_data else None)
        self.feed.append(
            {
                "time": time.time(),
                "kind": "event",
                "event": event,
                "controllable": event.endswith((".request", ".reset", ".cancel")) or ".tau_" in event,
                "data": data if has_data else None,
                "state": self.system.state(),
                "decision_us": 100.0,
            }
        )
        self.show()

    def show(self) -> None:
        """The state now."""
        self._number += 1
        self.feed.show(self.snapshot())

    def snapshot(self) -> Snapshot:
        """Return a snapshot like that of a bridge's loop."""
        system, is_running = self.system, self.state is State.RUNNING
        now_s = monotonic()
        angle = 0.2 * (now_s - self._begin_s)
        pose = Pose(2.0 * math.cos(angle), 2.0 * math.sin(angle), math.remainder(angle + math.pi / 2, math.tau))
        ranges = tuple(math.nan if k % 60 < 5 else 2.0 + math.sin(math.radians(3 * k) + angle) for k in range(BINS))
        names = [item.name for item in self._model.communications if _is_requested(item.kind)]
        return Snapshot(
            number=self._number,
            time_s=time.time(),
            state=self.state,
            problem="",
            reasons=self.reasons,
            warnings=(Caution.BATTERY,),
            stops=(),
            devices={Device.DRIVE: True, Device.SCANNER: True},
            components=system.state() if is_running else {},
            enabled=tuple(names[number] for number in system.enabled_requests()) if is_running else (),
            reading=DriveReading(now_s, pose, Velocity(0.4, 0.2), (0.3, 0.5), True, frozenset(), 11.8, None),
            scan=Scan(now_s, ranges, RawScan((), (), ()), 5.0),
            overruns=0,
            communications=self.locations() if is_running else {},
        )

    def locations(self) -> Mapping[str, str]:
        """Return the locations of services and actions."""
        return {
            item.name: self.system.location(item.name) for item in self._model.communications if item.kind in _CALLED
        }

    def _possible(self) -> list[str]:
        """Events that the robot or its supervisor may let happen now."""
        found = [name for name in self._names if self.system.enabled(name)]
        for item in self._model.communications:
            if item.kind is CommunicationKind.OUTGOING_MESSAGE:
                found.append(f"{item.name}.response")
            elif item.kind in _CALLED:
                match self.system.location(item.name):
                    case "waiting" | "executing":
                        found += [f"{item.name}.response", f"{item.name}.error"]
                    case "ready" | "failed":
                        found.append(f"{item.name}.reset")
        return found

    def _post(self, item: Order | FromProgram) -> None:
        if not isinstance(item, Order):
            return
        self.orders.append(item)
        match item.command:
            case OperatorCommand.STOP:
                self.reasons = (Reason.OPERATOR_STOP,)
            case OperatorCommand.RESUME:
                self.reasons = ()
            case OperatorCommand.STANDBY | OperatorCommand.RESET:
                self.state, self.reasons = State.STANDBY, (Reason.STANDBY,)
            case OperatorCommand.START:
                self.system.restart()
                self.state, self.reasons = State.RUNNING, ()
        if self.refusal is not None:
            item.answer(self.refusal)
        self.show()


def _is_requested(kind: CommunicationKind) -> bool:
    return kind is not CommunicationKind.OUTGOING_MESSAGE


@contextlib.contextmanager
def viewed(robot: LiveRobot, address: str = "127.0.0.1:0") -> Iterator[ViewEndpoint]:
    """The live view of a robot."""
    endpoint = ViewEndpoint(robot.operations, ViewSettings(address))
    endpoint.start()
    try:
        yield endpoint
    finally:
        endpoint.stop()


@contextlib.asynccontextmanager
async def viewed_meanwhile(robot: LiveRobot) -> AsyncIterator[ViewEndpoint]:
    """The same for a coroutine, whose connections end while it stops."""
    endpoint = ViewEndpoint(robot.operations, ViewSettings("127.0.0.1:0"))
    endpoint.start()
    try:
        yield endpoint
    finally:
        await asyncio.to_thread(endpoint.stop)


def main(argv: list[str] | None = None) -> int:
    """Serve the live view of a large robot, or of a model's, whose events come by themselves."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--address", default="127.0.0.1:8066")
    parser.add_argument("--components", type=int, default=60)
    parser.add_argument("--rate", type=float, default=50.0, help="events a second")
    parser.add_argument("--example", help="such as maze_solver/maze_solver")
    arguments: Any = parser.parse_args(argv)
    if arguments.example:
        from support.generated import example_supervisor

        supervisor = example_supervisor(arguments.example)
    else:
        supervisor = supervisor_without_synthesis(large_model(arguments.components))
    robot = LiveRobot(supervisor)
    with viewed(robot, arguments.address) as endpoint:
        sys.stdout.write(f"{endpoint.url}\n")
        sys.stdout.flush()
        while True:
            time.sleep(1.0 / arguments.rate)
            if robot.state is State.RUNNING and not robot.reasons:
                robot.step()
            else:
                robot.show()


if __name__ == "__main__":
    sys.exit(main())
