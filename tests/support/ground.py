"""A daemon that a test plays for its remote endpoints, and a ground station of pymavlink's own making."""

import math
import threading
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from robosc.execution.runtime.event_log import Entry
from robosc.model.check import check
from robosc.model.structure import Deployment
from robosc.supervisor import Supervisor
from robosc_bridge.configuration import map_channels, parse
from robosc_bridge.daemon.feed import Feed, Snapshot
from robosc_bridge.daemon.operations import Operations
from robosc_bridge.daemon.programs.items import FromProgram
from robosc_bridge.daemon.states import OperatorCommand, Order, State
from robosc_bridge.daemon.threads.reports import Device
from robosc_bridge.devices.interface import BINS, DriveReading, Pose, RawScan, Scan, Velocity
from support.models import bundle_of
from support.random_supervisors import CERTIFICATE

MODEL = """
robot Carrier {
    interface twist use Twist from geometry_msgs
    datatype object Vector { x: double z: double }
    datatype object Twist { linear: Vector angular: Vector }
    datatype enum Load from double to { value > 5.0 -> heavy value > 1.0 -> light default -> none_at_all }
    component Lift {
        outgoing message load with identifier: "/load", type: Load
        outgoing message weight with identifier: "/weight", type: double
        behaviour {
            variable load: Load = none_at_all
            variable is_full: boolean
            variable count: integer(0..9) = 3
            variable weight_of_all: double
            on response from load do load := value
            on response from weight do weight_of_all := value
            initial marked state down {}
            marked state up {}
        }
    }
    component LongishComponentName {
        incoming message drive with identifier: "/cmd_vel", type: Twist links twist
        behaviour { initial marked state ready { on request to drive } }
    }
    provide drive with { linear: { x: 0.1 } }
}
"""
CONFIGURATION = """
robot: burger
drive: {driver: opencr, port: /dev/base}
channels:
  /load: {channel: none}
  /weight: {channel: none}
  /cmd_vel: {channel: drive}
"""
KEY = bytes(range(32))


def scan_of(ranges_m: Mapping[int, float], time_s: float = 100.0) -> Scan:
    """A turn with a few ranges; NaN elsewhere."""
    found = tuple(ranges_m.get(k, math.nan) for k in range(BINS))
    return Scan(time_s, found, RawScan((), (), ()), 5.0)


def reading_of(time_s: float = 100.0, **values: Any) -> DriveReading:
    """Return a reading of a drive base."""
    usual: dict[str, Any] = {"pose": Pose(), "velocity": Velocity(), "wheels_m_s": (0.0, 0.0), "is_torque_on": False}
    return DriveReading(time_s=time_s, **{**usual, **values})


STANDBY = Snapshot(
    number=1,
    time_s=1.7e9,
    state=State.STANDBY,
    problem="",
    reasons=(),
    warnings=(),
    stops=(),
    devices={Device.DRIVE: True, Device.SCANNER: True},
    components={},
    enabled=(),
    reading=None,
    scan=None,
    overruns=0,
)


@dataclass
class PlayedDaemon:
    """A daemon of which a test says what it shows and answers.

    Attributes:
        orders: Orders that came, oldest first.
        received: Messages that programs sent to it.
        seen: Number of times that the operator was seen.
        answers: Immediate answers to orders, by command; others wait for `answer`.
    """

    is_layer: bool = False
    model: str = MODEL
    configuration: str = CONFIGURATION
    orders: list[Order] = field(default_factory=list)
    received: list[FromProgram] = field(default_factory=list)
    seen: int = 0
    answers: dict[OperatorCommand, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        checked = check(bundle_of(self.model))
        assert checked.model is not None, checked.diagnostics
        self.feed = Feed()
        configuration = parse(self.configuration.encode(), "test.yaml").configuration
        mapping = map_channels(checked.model, configuration)
        deployment = Deployment.LAYER if self.is_layer else Deployment.CONTROLLER
        supervisor = Supervisor(checked.model, deployment, (), CERTIFICATE)
        self.operations = Operations(
            supervisor, mapping, self.feed, self._post, self._operator_seen, is_layer=self.is_layer
        )
        self.snapshot = STANDBY
        self._showing = threading.Lock()
        self.show()

    def _post(self, item: Order | FromProgram) -> None:
        if not isinstance(item, Order):
            self.received.append(item)
            return
        self.orders.append(item)
        if item.command in self.answers:
            item.answer(self.answers[item.command])

    def _operator_seen(self) -> None:
        self.seen += 1

    @property
    def commands(self) -> list[OperatorCommand]:
        """Commands that were ordered."""
        return [order.command for order in self.orders]

    def show(self, **values: Any) -> None:
        """Show another snapshot."""
        with self._showing:
            self.snapshot = replace(self.snapshot, number=self.snapshot.number + 1, **values)
            self.feed.show(self.snapshot)

    def write(self, **entry: Any) -> None:
        """Write an entry into the event log."""
        whole: Entry = entry
        self.feed.append(whole)


class Station:
    """A ground station's codec.

    Args:
        key: Of signing; None: it does not sign.
        system: Its own.
    """

    def __init__(self, key: bytes | None = None, system: int = 255, component: int = 190) -> None:
        self.codec: Any = dialect.MAVLink(None, srcSystem=system, srcComponent=component)
        self.codec.robust_parsing = True
        if key is not None:
            self.codec.signing.secret_key = key
            self.codec.signing.sign_outgoing = True
            self.codec.signing.timestamp = 2**40
            self.codec.signing.allow_unsigned_callback = lambda *_: False
        self.heard: list[Any] = []

    def pack(self, message: Any) -> bytes:
        """A message as bytes."""
        data = bytes(message.pack(self.codec))
        self.codec.seq = (self.codec.seq + 1) % 256
        return data

    def heartbeat(self) -> bytes:
        return self.pack(self.codec.heartbeat_encode(6, 8, 0, 0, 4))

    def command(self, number: int, *parameters: float, confirmation: int = 0, to: tuple[int, int] = (1, 1)) -> bytes:
        values = (*parameters, *(0.0,) * (7 - len(parameters)))
        return self.pack(self.codec.command_long_encode(*to, number, confirmation, *values))

    def old(self, message: Any) -> bytes:
        """A message as bytes of MAVLink 1, which are never signed."""
        return bytes(message.pack(self.codec, force_mavlink1=True))

    def old_command(self, number: int, *parameters: float) -> bytes:
        values = (*parameters, *(0.0,) * (7 - len(parameters)))
        return self.old(self.codec.command_long_encode(1, 1, number, 0, *values))

    def command_int(self, number: int, *parameters: float, to: tuple[int, int] = (1, 1)) -> bytes:
        first = (*parameters, *(0.0,) * (4 - len(parameters)))
        return self.pack(self.codec.command_int_encode(*to, 0, number, 0, 0, *first, 0, 0, 0.0))

    def hear(self, data: bytes) -> list[Any]:
        """The messages in what came."""
        found = [item for item in self.codec.parse_buffer(data) or [] if item.get_type() != "BAD_DATA"]
        self.heard += found
        return found


def of_type(name: str, messages: list[Any]) -> list[Any]:
    """The messages of one kind."""
    return [item for item in messages if item.get_type() == name]


def joined_texts(messages: list[Any]) -> list[str]:
    """The texts of STATUSTEXT messages, put together as a station does."""
    found, parts = [], b""
    for item in of_type("STATUSTEXT", messages):
        data = bytes(item._text_raw).partition(b"\0")[0]
        parts += data
        if item.id == 0 or len(data) < 50:
            found.append(parts.decode("utf-8"))
            parts = b""
    return found
