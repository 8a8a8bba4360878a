"""Conversion between the daemon's values and protobuf messages.

This is the one module of the endpoint with generated names.
"""

import json
import time
from collections.abc import Callable
from typing import Any

from google.protobuf.struct_pb2 import Struct

from robosc._version import __version__
from robosc.errors import UnsupportedModelError
from robosc.execution.runtime.event_log import Entry, plain
from robosc.execution.runtime.progress import MissionStanding, Progress, Standing
from robosc.expressions import ObjectType
from robosc.model.structure import Communication, CommunicationKind, Model
from robosc.supervisor import Supervisor, encode
from robosc.targets.ros.state_topic import state_topic
from robosc_api.v1 import bridge_pb2 as pb
from robosc_api.v1 import bridge_pb2_grpc
from robosc_bridge.configuration.channels import channel_name
from robosc_bridge.daemon.feed import Snapshot
from robosc_bridge.daemon.operations import Operations
from robosc_bridge.daemon.programs import items as programs
from robosc_bridge.daemon.states import OperatorCommand, State
from robosc_bridge.devices.interface import DriveReading, Scan
from robosc_bridge.host import monotonic
from robosc_bridge.remote.data import DataError, plain_of, struct_of, text_of, value_of
from robosc_bridge.safety import LATCHING, Caution, Reason

_SERVICE = pb.DESCRIPTOR.services_by_name["BridgeService"]
SERVICE_NAME = _SERVICE.full_name
METHODS = tuple(method.name for method in _SERVICE.methods)

type GetStatusRequest = pb.GetStatusRequest
type GetDefinitionRequest = pb.GetDefinitionRequest
type StopRequest = pb.StopRequest
type CommandRequest = pb.CommandRequest
type WatchRequest = pb.WatchRequest
type Hello = pb.Hello
type AttachRequest = pb.AttachRequest
type AttachResponse = pb.AttachResponse
GetDefinitionResponse = pb.GetDefinitionResponse
GetStatusResponse = pb.GetStatusResponse
StopResponse = pb.StopResponse
WatchResponse = pb.WatchResponse
CommandResponse = pb.CommandResponse
BridgeServiceServicer = bridge_pb2_grpc.BridgeServiceServicer
add_service = bridge_pb2_grpc.add_BridgeServiceServicer_to_server

MAXIMUM_SUPERVISOR_BYTES = 8 * 2**20
"""Size above which a supervisor is not sent: watchers take messages of 16 MiB, and do without reasons then."""

MAXIMUM_TEXT = 1000
"""Most characters of a name, identifier, id or reason that a program sends."""

_KINDS = {kind: f"COMMUNICATION_KIND_{kind.name}" for kind in CommunicationKind}
_STATES = {state: f"BRIDGE_STATE_{state.name}" for state in State}
_COMMANDS = {
    pb.COMMAND_KIND_START: OperatorCommand.START,
    pb.COMMAND_KIND_STANDBY: OperatorCommand.STANDBY,
    pb.COMMAND_KIND_RESUME: OperatorCommand.RESUME,
    pb.COMMAND_KIND_RESET: OperatorCommand.RESET,
}
_OUTCOMES = {
    "succeeded": pb.GOAL_OUTCOME_SUCCEEDED,
    "aborted": pb.GOAL_OUTCOME_ABORTED,
    "cancelled": pb.GOAL_OUTCOME_CANCELLED,
    "rejected": pb.GOAL_OUTCOME_REJECTED,
}
_OUTCOME_NAMES = {number: name for name, number in _OUTCOMES.items()}


class RequestError(Exception):
    """A malformed request; one sentence for its sender."""


def definition(operations: Operations) -> pb.GetDefinitionResponse:
    """Return the definition: everything that does not change while the bridge runs."""
    model, topic = operations.model, state_topic(operations.model)
    return pb.GetDefinitionResponse(
        robot=model.name,
        version=__version__,
        is_layer=operations.is_layer,
        communications=[
            pb.Communication(
                name=item.name,
                component=item.component,
                kind=_KINDS[item.kind],
                identifier=text_of(item.identifier),
                channel=channel_name(operations.mapping.channels[item.name]),
                fields=_fields(model, item),
            )
            for item in operations.mapping.communications
        ],
        definition=json.dumps(topic.definition, separators=(",", ":")),
        transitions=[
            pb.EventTransition(event=event, component=component, state=state, id=number)
            for event, parts in topic.transitions.items()
            for component, numbers in parts
            for state, number in numbers.items()
        ],
        supervisor=_supervisor(operations.supervisor),
        turtlebot=operations.turtlebot,
        scanner_x_m=None if operations.scanner_place is None else operations.scanner_place[0],
        scanner_y_m=None if operations.scanner_place is None else operations.scanner_place[1],
    )


def _supervisor(supervisor: Supervisor) -> bytes:
    try:
        content = encode(supervisor)
    except UnsupportedModelError:
        return b""  # It was made here, and is too large for a file.
    return content if len(content) <= MAXIMUM_SUPERVISOR_BYTES else b""


def _fields(model: Model, item: Communication) -> list[str]:
    asked = item.response if item.kind is CommunicationKind.OUTGOING_MESSAGE else item.request
    return [part.name for part in model.object(asked.name).properties] if isinstance(asked, ObjectType) else []


def command_of(request: pb.CommandRequest) -> OperatorCommand:
    """Return the command of a request.

    Raises:
        RequestError: There is no such command.
    """
    command = _COMMANDS.get(request.command)
    if command is None:
        raise RequestError(f"there is no command of number {request.command}")
    return command


def rate_hz_of(request: pb.WatchRequest, default_hz: float, least_hz: float, most_hz: float) -> float:
    """Return the maximum number of responses a second.

    Raises:
        RequestError: The number is out of bounds.
    """
    rate_hz = request.maximum_rate_hz or default_hz
    # Not-a-number is in no range.
    if not least_hz <= rate_hz <= most_hz:
        raise RequestError(f"maximum_rate_hz may be from {least_hz:g} to {most_hz:g}")
    return rate_hz


class SnapshotEncoder:
    """Snapshots as messages; each message is made once for all watchers."""

    def __init__(self) -> None:
        self._number = -1
        self._made = pb.Snapshot()

    def put(self, target: pb.Snapshot, snapshot: Snapshot) -> None:
        """Fill a message with a snapshot and its present age."""
        if snapshot.number != self._number:
            self._made = _snapshot(snapshot)
            self._number = snapshot.number
        target.CopyFrom(self._made)
        target.age_s = max(time.time() - snapshot.time_s, 0.0)
        if snapshot.reading is not None:
            target.drive.age_s = max(monotonic() - snapshot.reading.time_s, 0.0)


def _snapshot(snapshot: Snapshot) -> pb.Snapshot:
    made = pb.Snapshot(
        number=snapshot.number,
        state=_STATES[snapshot.state],
        problem=text_of(snapshot.problem),
        reasons=[_notice(item) for item in snapshot.reasons],
        warnings=[_notice(item) for item in snapshot.warnings],
        stops=map(text_of, snapshot.stops),
        devices=[pb.DeviceState(name=str(name), works=works) for name, works in snapshot.devices.items()],
        components=[
            pb.ComponentState(name=name, state=str(item["state"]), variables=struct_of(plain(dict(item["variables"]))))
            for name, item in snapshot.components.items()
        ],
        enabled=snapshot.enabled,
        communications=[
            pb.CommunicationState(name=name, location=location) for name, location in snapshot.communications.items()
        ],
        has_scan=snapshot.scan is not None,
        overruns=snapshot.overruns,
        cancelling=snapshot.cancelling,
        overdue_cancels=snapshot.overdue_cancels,
    )
    if snapshot.progress is not None:
        made.progress.CopyFrom(_progress(snapshot.progress))
    for latency in snapshot.timing.latencies:
        made.latencies.add(
            name=latency.name,
            count=latency.count,
            p50_s=latency.share_s(0.5),
            p99_s=latency.share_s(0.99),
            max_s=latency.max_s,
            sum_s=latency.sum_s,
        )
    for device, counts in snapshot.timing.lines.items():
        made.lines.add(device=device, counts=counts)
    made.time.FromNanoseconds(round(snapshot.time_s * 1e9))
    if snapshot.reading is not None:
        made.drive.CopyFrom(_drive(snapshot.reading))
    return made


def _progress(progress: Progress) -> pb.StrategyProgress:
    return pb.StrategyProgress(
        aims=map(_standing, progress.aims),
        assumptions=map(_standing, progress.assumptions),
        overdue=progress.overdue,
        is_followed=progress.is_followed,
        approached=progress.approached or "",
        chosen=progress.chosen or "",
        missions=map(_mission, progress.missions),
    )


def _standing(item: Standing) -> pb.Standing:
    name, words, is_met, times, unmet_s, mission = item
    return pb.Standing(
        name=name, words=text_of(words), is_met=is_met, times=times, unmet_s=unmet_s, mission=mission or ""
    )


def _mission(item: MissionStanding) -> pb.MissionStanding:
    return pb.MissionStanding(**item._asdict())


def _notice(item: Reason | Caution) -> pb.Notice:
    return pb.Notice(code=item.name, text=str(item), holds_until_reset=item in LATCHING)


def _drive(reading: DriveReading) -> pb.DriveState:
    pose, velocity = reading.pose, reading.velocity
    left_m, right_m = reading.wheels_m or (None, None)
    linear_variance, angular_variance = reading.velocity_variances or (None, None)
    return pb.DriveState(
        pose=pb.Pose(x_m=pose.x_m, y_m=pose.y_m, heading_rad=pose.heading_rad),
        velocity=pb.Twist(linear_m_s=velocity.linear_m_s, angular_rad_s=velocity.angular_rad_s),
        left_wheel_m_s=reading.wheels_m_s[0],
        right_wheel_m_s=reading.wheels_m_s[1],
        is_torque_on=reading.is_torque_on,
        faults=sorted(map(str, reading.faults)),
        battery_v=reading.battery_v,
        battery_share=reading.battery_share,
        temperature_c=reading.temperature_c,
        buttons=dict(reading.buttons),
        time_s=reading.time_s,
        imu=dict(reading.imu),
        left_wheel_m=left_m,
        right_wheel_m=right_m,
        wheel_radius_m=reading.wheel_radius_m,
        pose_covariance=reading.pose_covariance,
        linear_variance=linear_variance,
        angular_variance=angular_variance,
    )


def put_scan(target: pb.Scan, scan: Scan) -> None:
    """Fill a message with a revolution of the LiDAR."""
    target.age_s = max(monotonic() - scan.time_s, 0.0)
    target.turns_per_s = scan.revolutions_per_s
    target.ranges_m.extend(scan.ranges_m)
    target.time_s, target.min_m, target.max_m = scan.time_s, scan.min_m, scan.max_m


def put_sent(target: pb.WatchResponse) -> None:
    """Fill a message with the time of its sending."""
    target.sent_s = monotonic()


def event_of(entry: Entry) -> Struct:
    """An entry of the event log as its file has it."""
    return struct_of(plain(entry))


def program_of(hello: pb.Hello, name: str, send: Callable[[programs.ToProgram], None], operations: Operations) -> Any:
    """Return the program that a first message introduces.

    Args:
        hello: First message of the program.
        name: Name for the log.
        send: Function that sends an item to the program.
        operations: The daemon.

    Raises:
        RequestError: The program has no name, or offers a service or action that is not mapped to `grpc`.
    """
    if not 1 <= len(hello.name) <= 100 or not hello.name.isprintable():
        raise RequestError("a program has a name of 1 to 100 printable characters")
    served = {
        item.name
        for item in operations.mapping.communications
        if item.kind in (CommunicationKind.SERVICE, CommunicationKind.ACTION)
        and channel_name(operations.mapping.channels[item.name]) == "grpc"
    }
    for wanted in hello.serves:
        if wanted not in served:
            shown = wanted[:40] if wanted.isprintable() else "?"
            raise RequestError(f"'{shown}' is not a service or action of the model that is mapped to 'grpc'")
    may_request = hello.is_operator and operations.is_layer
    return programs.Program(name, send, frozenset(hello.serves), may_request)


def item_of(request: pb.AttachRequest, program: programs.Program) -> programs.FromProgram | None:
    """Return the item that a program sends to the loop; None: only a sign of life.

    Raises:
        RequestError: The request is malformed.
    """
    kind = request.WhichOneof("message")
    if kind == "keep_alive":
        return None
    if kind not in _READERS:
        raise RequestError("only the first message may be 'hello'" if kind == "hello" else "a message without a kind")
    try:
        return _READERS[kind](program, getattr(request, kind))
    except DataError as error:
        raise RequestError(str(error)) from error


def _text(text: str) -> str:
    if len(text) > MAXIMUM_TEXT:
        raise RequestError(f"a name, identifier, id or reason has more than {MAXIMUM_TEXT} characters")
    return text


def _data(message: Any) -> Any:
    return plain_of(message.data) if message.HasField("data") else None


def _goal_end(program: programs.Program, end: pb.GoalEnd) -> programs.GoalEnded:
    outcome = _OUTCOME_NAMES.get(end.outcome)
    if outcome is None:
        raise RequestError(f"there is no outcome of number {end.outcome}")
    return programs.GoalEnded(program, end.number, outcome, _data(end))


_READERS: dict[str, Callable[[programs.Program, Any], programs.FromProgram]] = {
    "give": lambda program, it: programs.MessageReceived(program, _text(it.identifier), _data(it)),
    "reply": lambda program, it: programs.Replied(program, it.number, _data(it)),
    "call_failure": lambda program, it: programs.CallFailed(program, it.number, _text(it.reason)),
    "goal_acceptance": lambda program, it: programs.GoalAccepted(program, it.number),
    "feedback": lambda program, it: programs.FeedbackGiven(program, it.number, _data(it)),
    "goal_end": _goal_end,
    "request": lambda program, it: programs.MessageRequested(program, _text(it.identifier), _data(it)),
    "call": lambda program, it: programs.CallRequested(program, _text(it.name), _text(it.id), _data(it)),
    "goal": lambda program, it: programs.GoalRequested(program, _text(it.name), _text(it.id), _data(it)),
    "cancel": lambda program, it: programs.CancelRequested(program, _text(it.name), _text(it.id)),
}


def welcome(operator_timeout_s: float | None) -> pb.AttachResponse:
    """The first item that a program receives."""
    return pb.AttachResponse(welcome=pb.Welcome(operator_timeout_s=operator_timeout_s or 0.0))


def refused(why: str) -> pb.AttachResponse:
    """Return the response to a malformed request of a program."""
    return pb.AttachResponse(refused=pb.Refusal(why=text_of(why)))


def response_of(item: programs.ToProgram) -> pb.AttachResponse:
    """Return the response for an item that the loop sends to a program."""
    match item:
        case programs.MessageSent(name, identifier, data):
            message = pb.ModelMessage(name=name, identifier=text_of(identifier), data=value_of(data))
            return pb.AttachResponse(message_sent=message)
        case programs.CallMade(name, number, data):
            return pb.AttachResponse(call=pb.ModelRequest(name=name, number=number, data=value_of(data)))
        case programs.GoalMade(name, number, data):
            return pb.AttachResponse(goal=pb.ModelRequest(name=name, number=number, data=value_of(data)))
        case programs.CancelMade(name, number):
            return pb.AttachResponse(cancel=pb.ModelCancel(name=name, number=number))
        case programs.PassedOn(identifier, data):
            return pb.AttachResponse(passed_on=pb.Message(identifier=text_of(identifier), data=value_of(data)))
        case programs.Blocked(identifier):
            return pb.AttachResponse(blocked=pb.Blocked(identifier=text_of(identifier)))
        case programs.Answered(call_id, data, is_default):
            answer = pb.OwnAnswer(id=call_id, data=value_of(data), is_default=is_default)
            return pb.AttachResponse(answer=answer)
        case programs.GoalTaken(goal_id):
            return pb.AttachResponse(goal_taken=pb.OwnGoal(id=goal_id))
        case programs.GoalRejected(goal_id):
            return pb.AttachResponse(goal_rejected=pb.OwnGoal(id=goal_id))
        case programs.FeedbackPassed(goal_id, data):
            return pb.AttachResponse(goal_feedback=pb.OwnFeedback(id=goal_id, data=value_of(data)))
        case programs.GoalOver(goal_id, outcome, data):
            end = pb.OwnGoalEnd(id=goal_id, outcome=_OUTCOMES[outcome], data=value_of(data))
            return pb.AttachResponse(goal_over=end)
        case programs.Refused(why):
            return refused(why)
