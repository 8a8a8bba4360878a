"""The bridge's service as a Python object: the only module of the terminal commands with generated names."""

import os
import queue
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from enum import StrEnum
from types import TracebackType
from typing import Any, Self

# The log of gRPC would repeat in other words what this client reports; gRPC reads this variable when it is imported.
os.environ.setdefault("GRPC_VERBOSITY", "NONE")

import grpc
from google.protobuf.json_format import MessageToDict
from google.protobuf.struct_pb2 import Value

from robosc_api.security import Credentials, SecurityError, close_channel, open_channel
from robosc_api.v1 import bridge_pb2 as pb
from robosc_api.v1 import bridge_pb2_grpc

STOP_LIMIT_S, STATUS_LIMIT_S, COMMAND_LIMIT_S = 3.0, 5.0, 25.0

_OPTIONS = (
    ("grpc.max_receive_message_length", 16 * 2**20),
    # A proxy for web pages, set in the environment, is none for a robot in the next room.
    ("grpc.enable_http_proxy", 0),
    # Else all clients of a process share one connection to an address, and a stop would wait for one that hangs.
    ("grpc.use_local_subchannel_pool", 1),
    # A cable that is pulled and a bridge that hangs are noticed while a stream waits.
    ("grpc.keepalive_time_ms", 5000),
    ("grpc.keepalive_timeout_ms", 3000),
    ("grpc.http2.ping_timeout_ms", 3000),
    ("grpc.http2.max_pings_without_data", 0),
)
_REFUSALS = frozenset(
    {grpc.StatusCode.UNAUTHENTICATED, grpc.StatusCode.PERMISSION_DENIED, grpc.StatusCode.RESOURCE_EXHAUSTED}
)
_PATIENCE_S = 2.0

Snapshot = pb.Snapshot
DriveState = pb.DriveState
StrategyProgress = pb.StrategyProgress
Standing = pb.Standing
MissionStanding = pb.MissionStanding
Scan = pb.Scan
Definition = pb.GetDefinitionResponse
WatchResponse = pb.WatchResponse


class RefusedError(Exception):
    """The bridge refuses the request; one sentence for a person."""


class UnreachableError(Exception):
    """No bridge answers, or the credentials cannot be used; one sentence for a person."""


class RequestedCommand(StrEnum):
    """Request that may be made to a bridge."""

    START = "start"
    STANDBY = "standby"
    RESUME = "resume"
    RESET = "reset"


_COMMANDS = {command: f"COMMAND_KIND_{command.name}" for command in RequestedCommand}


@dataclass(frozen=True, slots=True)
class DriveTopic:
    """Topic on which the wheels are commanded.

    Attributes:
        identifier: Identifier of the communication.
        is_stamped: True if the velocity is in a field `twist`.
    """

    identifier: str
    is_stamped: bool


class BridgeClient:
    """A connection to one bridge; use it with `with`.

    Every method raises `RefusedError` or `UnreachableError`.

    Args:
        address: `HOST:PORT`.
        credentials: Certificates and token.
    """

    def __init__(self, address: str, credentials: Credentials) -> None:
        self._address = address
        try:
            self._channel = open_channel(address, credentials, _OPTIONS)
        except SecurityError as error:
            raise UnreachableError(str(error)) from error
        self._stub: Any = bridge_pb2_grpc.BridgeServiceStub(self._channel)  # type: ignore[no-untyped-call]

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        close_channel(self._channel, error)

    def close(self) -> None:
        """End the connection, and every call that is under way; may be called again, from any thread."""
        close_channel(self._channel)

    def stop(self) -> None:
        """Stop the robot."""
        with self._translated():
            self._stub.Stop(pb.StopRequest(), timeout=STOP_LIMIT_S)

    def request(self, command: RequestedCommand) -> None:
        """Give a command to the bridge, and wait until it is done."""
        with self._translated():
            response = self._stub.Command(pb.CommandRequest(command=_COMMANDS[command]), timeout=COMMAND_LIMIT_S)
        if response.refusal:
            raise RefusedError(response.refusal)

    def status(self) -> pb.Snapshot | None:
        """Return a snapshot of what the bridge is doing; None: its loop has not run yet."""
        with self._translated():
            response = self._stub.GetStatus(pb.GetStatusRequest(), timeout=STATUS_LIMIT_S)
        return response.snapshot if response.HasField("snapshot") else None

    def definition(self) -> pb.GetDefinitionResponse:
        """Return the definition, which does not change while the bridge runs."""
        with self._translated():
            definition: pb.GetDefinitionResponse = self._stub.GetDefinition(
                pb.GetDefinitionRequest(), timeout=STATUS_LIMIT_S
            )
        return definition

    def drive_topic(self) -> DriveTopic:
        """Return the topic on which a supervision layer takes velocities for the wheels."""
        definition = self.definition()
        if not definition.is_layer:
            raise RefusedError(
                f"the supervisor of {definition.robot} is a controller and drives by itself; an operator drives "
                "through a supervision layer"
            )
        incoming = pb.COMMUNICATION_KIND_INCOMING_MESSAGE
        for item in definition.communications:
            if item.kind == incoming and item.channel == "drive":
                return DriveTopic(item.identifier, "twist" in item.fields)
        raise RefusedError(f"no communication of {definition.robot} is mapped to 'drive'")

    def watch(self, *, with_scans: bool, rate_hz: float, with_events: bool = True) -> Iterator[pb.WatchResponse]:
        """Yield snapshots and events of the bridge, until the bridge or the caller ends the stream."""
        request = pb.WatchRequest(maximum_rate_hz=rate_hz, with_scans=with_scans, without_events=not with_events)
        with self._translated():
            call = self._stub.Watch(request)
            try:
                yield from call
            finally:
                call.cancel()

    def operate(self, name: str, on_refusal: Callable[[str, str], None]) -> "Operator":
        """Attach as the operator.

        Args:
            name: Name of the operator, for the bridge's log.
            on_refusal: Function that is called from another thread, with `blocked` and an identifier, or with `refused`
                and the reason.
        """
        return Operator(self._stub, name, on_refusal, self._error)

    @contextmanager
    def _translated(self) -> Iterator[None]:
        """Turn gRPC's errors into ours."""
        try:
            yield
        except grpc.RpcError as error:
            raise self._error(error) from error

    def _error(self, error: grpc.RpcError) -> RefusedError | UnreachableError:
        code, details = error.code(), error.details() or ""
        if code in _REFUSALS:
            return RefusedError(details)
        if code is grpc.StatusCode.UNAVAILABLE:
            return UnreachableError(f"no bridge answers at {self._address}: {details}")
        if code is grpc.StatusCode.DEADLINE_EXCEEDED:
            return UnreachableError(f"the bridge at {self._address} does not answer in time")
        if code is grpc.StatusCode.UNIMPLEMENTED:
            return UnreachableError(f"what answers at {self._address} is not a bridge of this version")
        return UnreachableError(f"the bridge at {self._address} failed ({code.name.lower()}): {details}")


class Operator:
    """An operator's stream to a supervision layer; messages are sent in the order of the calls."""

    def __init__(
        self, stub: Any, name: str, on_refusal: Callable[[str, str], None], translate: Callable[[Any], Exception]
    ) -> None:
        self._requests: queue.SimpleQueue[pb.AttachRequest | None] = queue.SimpleQueue()
        self._requests.put(pb.AttachRequest(hello=pb.Hello(name=name, is_operator=True)))
        self._on_refusal = on_refusal
        self._translate = translate
        self._failure: Exception | None = None
        self._call = stub.Attach(iter(self._requests.get, None))
        self._thread = threading.Thread(target=self._listen, name="operator", daemon=True)
        self._thread.start()

    def drive(self, topic: DriveTopic, linear_m_s: float, angular_rad_s: float) -> None:
        """Request a velocity.

        Raises:
            RefusedError: The bridge has ended the stream.
            UnreachableError: The connection is lost.
        """
        self._look()
        zero = {"x": 0.0, "y": 0.0, "z": 0.0}
        twist = {"linear": {**zero, "x": linear_m_s}, "angular": {**zero, "z": angular_rad_s}}
        data = _value({"twist": twist} if topic.is_stamped else twist)
        self._requests.put(pb.AttachRequest(request=pb.Message(identifier=topic.identifier, data=data)))

    def keep_alive(self) -> None:
        """Send a sign of life of the operator; raises as `drive`."""
        self._look()
        self._requests.put(pb.AttachRequest(keep_alive=pb.KeepAlive()))

    def close(self) -> None:
        """Send the waiting messages, and end the stream."""
        self._requests.put(None)
        self._thread.join(_PATIENCE_S)
        self._call.cancel()
        self._thread.join(_PATIENCE_S)

    def _look(self) -> None:
        if self._failure is not None:
            raise self._failure

    def _listen(self) -> None:
        try:
            for response in self._call:
                match response.WhichOneof("message"):
                    case "blocked":
                        self._on_refusal("blocked", response.blocked.identifier)
                    case "refused":
                        self._on_refusal("refused", response.refused.why)
            self._failure = UnreachableError("the bridge has ended the stream")
        except grpc.RpcError as error:
            self._failure = self._translate(error)


def _value(data: dict[str, Any]) -> Value:
    value = Value()
    value.struct_value.update(data)
    return value


def as_json(message: pb.Snapshot | pb.WatchResponse) -> dict[str, Any]:
    """Return a message as JSON, in protobuf's own mapping."""
    return MessageToDict(message, preserving_proto_field_name=True, always_print_fields_with_no_presence=True)


def state_name(snapshot: pb.Snapshot) -> str:
    """Return the bridge's state in a word."""
    return pb.BridgeState.Name(snapshot.state).removeprefix("BRIDGE_STATE_").lower()


def is_fault(snapshot: pb.Snapshot) -> bool:
    """Return True if a fault has stopped the robot."""
    return snapshot.state == pb.BRIDGE_STATE_FAULT or bool(snapshot.problem)


def events_of(response: pb.WatchResponse) -> list[dict[str, Any]]:
    """Return the entries of the event log."""
    return [MessageToDict(event) for event in response.events]
