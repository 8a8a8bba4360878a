"""A daemon as remote endpoints see it, in the hands of a test, and callers of an endpoint."""

import queue
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import grpc

from robosc.model.check import check
from robosc.model.structure import Deployment, Model
from robosc.supervisor import Supervisor
from robosc_api.security import Credentials, open_channel
from robosc_api.v1 import bridge_pb2 as pb
from robosc_api.v1 import bridge_pb2_grpc
from robosc_bridge.configuration import map_channels, parse
from robosc_bridge.daemon.feed import Feed, Snapshot
from robosc_bridge.daemon.operations import Operations
from robosc_bridge.daemon.programs.items import FromProgram, Program
from robosc_bridge.daemon.states import OperatorCommand, Order, State
from robosc_bridge.daemon.threads.reports import Device
from robosc_bridge.daemon.timing import BOUNDS_S, Latency, TimingFigures
from robosc_bridge.devices.interface import BINS, DriveReading, MotorFault, Pose, RawScan, Scan, Velocity
from robosc_bridge.host import monotonic
from robosc_bridge.remote import RemoteEndpoint, RemoteSettings, serve
from robosc_bridge.safety import Caution, Reason
from support.models import bundle_of
from support.random_supervisors import CERTIFICATE
from support.waiting import PATIENCE_S, wait_until

MODEL = """
robot Porter {
    interface twist use Twist from geometry_msgs
    interface opening use Open from desk_msgs
    interface carrying use Carry from desk_msgs
    datatype object Vector { x: double z: double }
    datatype object Twist { linear: Vector angular: Vector }
    component Wheels {
        incoming message drive with identifier: "/cmd_vel", type: Twist links twist
        behaviour { initial marked state ready { on request to drive } }
    }
    component Desk {
        outgoing message order with identifier: "/order", type: integer
        incoming message show with identifier: "/show", type: string
        service open with identifier: "/open", request: integer, response: boolean links opening
        action carry with identifier: "/carry", request: integer, response: integer, feedback: double links carrying
        behaviour {
            variable count: integer = 0
            initial marked state idle {
                on response from order do count := value goto busy
                on request to open
                on response from open
                on error from open
            }
            marked state busy { on response from order goto idle }
        }
    }
}
"""

CONFIGURATION = b"""
robot: burger
drive: {driver: opencr, port: /dev/none}
channels:
  /cmd_vel: {channel: drive}
  /order: {channel: grpc}
  /show: {channel: grpc}
  /open: {channel: grpc}
  /carry: {channel: grpc}
"""


def model() -> Model:
    checked = check(bundle_of(MODEL))
    assert checked.model is not None, checked.diagnostics
    return checked.model


READING = DriveReading(
    time_s=0.0,
    pose=Pose(1.0, 2.0, 0.5),
    velocity=Velocity(0.1, -0.2),
    wheels_m_s=(0.1, 0.2),
    is_torque_on=True,
    faults=frozenset({MotorFault.VOLTAGE}),
    battery_v=11.8,
    battery_share=None,
    buttons={"button_1": True},
)

SNAPSHOT = Snapshot(
    number=1,
    time_s=0.0,
    state=State.RUNNING,
    problem="",
    reasons=(Reason.SCAN_STALE, Reason.OPERATOR_STOP),
    warnings=(Caution.BATTERY,),
    stops=("'/order' is stale",),
    devices={Device.DRIVE: True, Device.SCANNER: False},
    components={"Desk": {"state": "idle", "variables": {"count": 3}}},
    enabled=("drive",),
    reading=None,
    scan=None,
    overruns=4,
    timing=TimingFigures(
        (Latency("exchange", tuple(int(index in (22, 39)) for index in range(len(BOUNDS_S) + 1)), 0.012, 0.01),),
        {"drive": {"requests": 70, "unanswered": 3}},
    ),
)


AHEAD_S = 3600.0


def scan(first_m: float) -> Scan:
    now_s = monotonic()
    raw = RawScan((0.0,), (first_m,), (1.0,))
    return Scan(now_s, (first_m, *[float("nan")] * (BINS - 1)), raw, 5.0)


class FakeDaemon:
    """Daemon that an endpoint talks to.

    A thread takes what is posted and shows a new snapshot, as the loop does in each turn.

    Attributes:
        seen: Number of times that the operator was seen.
        refusal: Answer to orders; None: they are not answered.
        handle: Function called in the loop's thread with each thing that programs report.
    """

    def __init__(self, *, is_layer: bool = False) -> None:
        checked = model()
        loaded = parse(CONFIGURATION, "test.yaml")
        self.feed = Feed()
        mapping = map_channels(checked, loaded.configuration, loaded.document)
        supervisor = Supervisor(checked, Deployment.LAYER if is_layer else Deployment.CONTROLLER, (), CERTIFICATE)
        self.operations = Operations(supervisor, mapping, self.feed, self._post, self._see, is_layer=is_layer)
        self.seen = 0
        self.refusal: str | None = ""
        self.orders: list[Order] = []
        self.received: list[FromProgram] = []
        self.handle: Callable[[FromProgram], None] = lambda item: None
        self.turns = True
        self._number = 0
        self._turned = 0
        self._inbox: queue.SimpleQueue[Order | FromProgram | None] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._run)

    def __enter__(self) -> "FakeDaemon":
        self.show()
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._inbox.put(None)
        self._thread.join(PATIENCE_S)

    def show(self, **changes: Any) -> Snapshot:
        """Another snapshot."""
        self._number += 1
        # It does not grow old, however long a test takes.
        snapshot = replace(SNAPSHOT, **{"number": self._number, "time_s": time.time() + AHEAD_S, **changes})
        self.feed.show(snapshot)
        return snapshot

    @property
    def waiting(self) -> int:
        """Number of items that are posted and not handled."""
        return self._inbox.qsize()

    def commands(self) -> list[OperatorCommand]:
        """Return the commands that were ordered."""
        return [order.command for order in self.orders]

    def program(self) -> Program:
        """The first that was attached, after the turn in which that was sent: a snapshot was shown at its end."""
        return wait_until(lambda: self.received[0].program if self._turned else None)

    def of(self, kind: type[Any]) -> list[Any]:
        """Return the reported items of a kind."""
        return [item for item in self.received if isinstance(item, kind)]

    def _post(self, item: Order | FromProgram) -> None:
        if isinstance(item, Order) and item.command is OperatorCommand.STOP:
            # It does not wait for the loop's turn.
            self.orders.append(item)
            return
        self._inbox.put(item)

    def _see(self) -> None:
        self.seen += 1

    def _run(self) -> None:
        while (item := self._inbox.get()) is not None:
            while not self.turns:
                time.sleep(0.001)
            if isinstance(item, Order):
                self.orders.append(item)
                if self.refusal is not None:
                    item.answer(self.refusal)
            else:
                self.received.append(item)
                self.handle(item)
            self.show()
            self._turned = len(self.received)


@contextmanager
def served(daemon: FakeDaemon, settings: RemoteSettings | None = None) -> Iterator[RemoteEndpoint]:
    """An endpoint of a daemon, on a port of its own choice."""
    endpoint = serve(daemon.operations, settings or RemoteSettings("127.0.0.1:0"))
    try:
        yield endpoint
    finally:
        endpoint.stop()


@contextmanager
def connected(address: str, credentials: Credentials | None = None) -> Iterator[Any]:
    """A stub of the service over a connection of its own."""
    options = (("grpc.use_local_subchannel_pool", 1),)
    with open_channel(address, credentials or Credentials(), options) as channel:
        yield bridge_pb2_grpc.BridgeServiceStub(channel)  # type: ignore[no-untyped-call]


class Attachment:
    """A program's stream, in the hands of a test."""

    def __init__(self, stub: Any, **hello: Any) -> None:
        self._requests: queue.SimpleQueue[Any] = queue.SimpleQueue()
        if hello:
            self.send(hello=pb.Hello(**hello))
        self.call = stub.Attach(iter(self._requests.get, None))

    def send(self, **message: Any) -> None:
        """Send the bridge a message."""
        self._requests.put(pb.AttachRequest(**message))

    def end(self) -> None:
        """No more is sent."""
        self._requests.put(None)

    def receive(self) -> Any:
        """The next message of the bridge."""
        return next(self.call)

    def failure(self) -> tuple[grpc.StatusCode, str]:
        """Return the status code and the details with which the stream was ended."""
        try:
            for _ in self.call:
                pass
        except grpc.RpcError as error:
            return error.code(), error.details() or ""
        raise AssertionError("it ended well")
