import datetime

from google.protobuf import struct_pb2 as _struct_pb2
from google.protobuf import timestamp_pb2 as _timestamp_pb2
from google.protobuf.internal import containers as _containers
from google.protobuf.internal import enum_type_wrapper as _enum_type_wrapper
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from collections.abc import Iterable as _Iterable, Mapping as _Mapping
from typing import ClassVar as _ClassVar, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class CommunicationKind(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    COMMUNICATION_KIND_UNSPECIFIED: _ClassVar[CommunicationKind]
    COMMUNICATION_KIND_INCOMING_MESSAGE: _ClassVar[CommunicationKind]
    COMMUNICATION_KIND_OUTGOING_MESSAGE: _ClassVar[CommunicationKind]
    COMMUNICATION_KIND_SERVICE: _ClassVar[CommunicationKind]
    COMMUNICATION_KIND_ACTION: _ClassVar[CommunicationKind]

class BridgeState(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    BRIDGE_STATE_UNSPECIFIED: _ClassVar[BridgeState]
    BRIDGE_STATE_STARTING: _ClassVar[BridgeState]
    BRIDGE_STATE_STANDBY: _ClassVar[BridgeState]
    BRIDGE_STATE_RUNNING: _ClassVar[BridgeState]
    BRIDGE_STATE_STOPPING: _ClassVar[BridgeState]
    BRIDGE_STATE_FAULT: _ClassVar[BridgeState]
    BRIDGE_STATE_OVER: _ClassVar[BridgeState]

class CommandKind(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    COMMAND_KIND_UNSPECIFIED: _ClassVar[CommandKind]
    COMMAND_KIND_START: _ClassVar[CommandKind]
    COMMAND_KIND_STANDBY: _ClassVar[CommandKind]
    COMMAND_KIND_RESUME: _ClassVar[CommandKind]
    COMMAND_KIND_RESET: _ClassVar[CommandKind]

class GoalOutcome(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    GOAL_OUTCOME_UNSPECIFIED: _ClassVar[GoalOutcome]
    GOAL_OUTCOME_SUCCEEDED: _ClassVar[GoalOutcome]
    GOAL_OUTCOME_ABORTED: _ClassVar[GoalOutcome]
    GOAL_OUTCOME_CANCELLED: _ClassVar[GoalOutcome]
    GOAL_OUTCOME_REJECTED: _ClassVar[GoalOutcome]
COMMUNICATION_KIND_UNSPECIFIED: CommunicationKind
COMMUNICATION_KIND_INCOMING_MESSAGE: CommunicationKind
COMMUNICATION_KIND_OUTGOING_MESSAGE: CommunicationKind
COMMUNICATION_KIND_SERVICE: CommunicationKind
COMMUNICATION_KIND_ACTION: CommunicationKind
BRIDGE_STATE_UNSPECIFIED: BridgeState
BRIDGE_STATE_STARTING: BridgeState
BRIDGE_STATE_STANDBY: BridgeState
BRIDGE_STATE_RUNNING: BridgeState
BRIDGE_STATE_STOPPING: BridgeState
BRIDGE_STATE_FAULT: BridgeState
BRIDGE_STATE_OVER: BridgeState
COMMAND_KIND_UNSPECIFIED: CommandKind
COMMAND_KIND_START: CommandKind
COMMAND_KIND_STANDBY: CommandKind
COMMAND_KIND_RESUME: CommandKind
COMMAND_KIND_RESET: CommandKind
GOAL_OUTCOME_UNSPECIFIED: GoalOutcome
GOAL_OUTCOME_SUCCEEDED: GoalOutcome
GOAL_OUTCOME_ABORTED: GoalOutcome
GOAL_OUTCOME_CANCELLED: GoalOutcome
GOAL_OUTCOME_REJECTED: GoalOutcome

class GetDefinitionRequest(_message.Message):
    __slots__ = ()
    def __init__(self) -> None: ...

class GetDefinitionResponse(_message.Message):
    __slots__ = ("robot", "version", "is_layer", "communications", "definition", "transitions", "supervisor", "turtlebot", "scanner_x_m", "scanner_y_m")
    ROBOT_FIELD_NUMBER: _ClassVar[int]
    VERSION_FIELD_NUMBER: _ClassVar[int]
    IS_LAYER_FIELD_NUMBER: _ClassVar[int]
    COMMUNICATIONS_FIELD_NUMBER: _ClassVar[int]
    DEFINITION_FIELD_NUMBER: _ClassVar[int]
    TRANSITIONS_FIELD_NUMBER: _ClassVar[int]
    SUPERVISOR_FIELD_NUMBER: _ClassVar[int]
    TURTLEBOT_FIELD_NUMBER: _ClassVar[int]
    SCANNER_X_M_FIELD_NUMBER: _ClassVar[int]
    SCANNER_Y_M_FIELD_NUMBER: _ClassVar[int]
    robot: str
    version: str
    is_layer: bool
    communications: _containers.RepeatedCompositeFieldContainer[Communication]
    definition: str
    transitions: _containers.RepeatedCompositeFieldContainer[EventTransition]
    supervisor: bytes
    turtlebot: str
    scanner_x_m: float
    scanner_y_m: float
    def __init__(self, robot: _Optional[str] = ..., version: _Optional[str] = ..., is_layer: _Optional[bool] = ..., communications: _Optional[_Iterable[_Union[Communication, _Mapping]]] = ..., definition: _Optional[str] = ..., transitions: _Optional[_Iterable[_Union[EventTransition, _Mapping]]] = ..., supervisor: _Optional[bytes] = ..., turtlebot: _Optional[str] = ..., scanner_x_m: _Optional[float] = ..., scanner_y_m: _Optional[float] = ...) -> None: ...

class Communication(_message.Message):
    __slots__ = ("name", "component", "kind", "identifier", "channel", "fields")
    NAME_FIELD_NUMBER: _ClassVar[int]
    COMPONENT_FIELD_NUMBER: _ClassVar[int]
    KIND_FIELD_NUMBER: _ClassVar[int]
    IDENTIFIER_FIELD_NUMBER: _ClassVar[int]
    CHANNEL_FIELD_NUMBER: _ClassVar[int]
    FIELDS_FIELD_NUMBER: _ClassVar[int]
    name: str
    component: str
    kind: CommunicationKind
    identifier: str
    channel: str
    fields: _containers.RepeatedScalarFieldContainer[str]
    def __init__(self, name: _Optional[str] = ..., component: _Optional[str] = ..., kind: _Optional[_Union[CommunicationKind, str]] = ..., identifier: _Optional[str] = ..., channel: _Optional[str] = ..., fields: _Optional[_Iterable[str]] = ...) -> None: ...

class EventTransition(_message.Message):
    __slots__ = ("event", "component", "state", "id")
    EVENT_FIELD_NUMBER: _ClassVar[int]
    COMPONENT_FIELD_NUMBER: _ClassVar[int]
    STATE_FIELD_NUMBER: _ClassVar[int]
    ID_FIELD_NUMBER: _ClassVar[int]
    event: str
    component: str
    state: str
    id: int
    def __init__(self, event: _Optional[str] = ..., component: _Optional[str] = ..., state: _Optional[str] = ..., id: _Optional[int] = ...) -> None: ...

class GetStatusRequest(_message.Message):
    __slots__ = ()
    def __init__(self) -> None: ...

class GetStatusResponse(_message.Message):
    __slots__ = ("snapshot",)
    SNAPSHOT_FIELD_NUMBER: _ClassVar[int]
    snapshot: Snapshot
    def __init__(self, snapshot: _Optional[_Union[Snapshot, _Mapping]] = ...) -> None: ...

class Snapshot(_message.Message):
    __slots__ = ("number", "time", "age_s", "state", "problem", "reasons", "warnings", "stops", "devices", "components", "enabled", "drive", "has_scan", "overruns", "communications", "latencies", "lines", "progress", "cancelling", "overdue_cancels")
    NUMBER_FIELD_NUMBER: _ClassVar[int]
    TIME_FIELD_NUMBER: _ClassVar[int]
    AGE_S_FIELD_NUMBER: _ClassVar[int]
    STATE_FIELD_NUMBER: _ClassVar[int]
    PROBLEM_FIELD_NUMBER: _ClassVar[int]
    REASONS_FIELD_NUMBER: _ClassVar[int]
    WARNINGS_FIELD_NUMBER: _ClassVar[int]
    STOPS_FIELD_NUMBER: _ClassVar[int]
    DEVICES_FIELD_NUMBER: _ClassVar[int]
    COMPONENTS_FIELD_NUMBER: _ClassVar[int]
    ENABLED_FIELD_NUMBER: _ClassVar[int]
    DRIVE_FIELD_NUMBER: _ClassVar[int]
    HAS_SCAN_FIELD_NUMBER: _ClassVar[int]
    OVERRUNS_FIELD_NUMBER: _ClassVar[int]
    COMMUNICATIONS_FIELD_NUMBER: _ClassVar[int]
    LATENCIES_FIELD_NUMBER: _ClassVar[int]
    LINES_FIELD_NUMBER: _ClassVar[int]
    PROGRESS_FIELD_NUMBER: _ClassVar[int]
    CANCELLING_FIELD_NUMBER: _ClassVar[int]
    OVERDUE_CANCELS_FIELD_NUMBER: _ClassVar[int]
    number: int
    time: _timestamp_pb2.Timestamp
    age_s: float
    state: BridgeState
    problem: str
    reasons: _containers.RepeatedCompositeFieldContainer[Notice]
    warnings: _containers.RepeatedCompositeFieldContainer[Notice]
    stops: _containers.RepeatedScalarFieldContainer[str]
    devices: _containers.RepeatedCompositeFieldContainer[DeviceState]
    components: _containers.RepeatedCompositeFieldContainer[ComponentState]
    enabled: _containers.RepeatedScalarFieldContainer[str]
    drive: DriveState
    has_scan: bool
    overruns: int
    communications: _containers.RepeatedCompositeFieldContainer[CommunicationState]
    latencies: _containers.RepeatedCompositeFieldContainer[Latency]
    lines: _containers.RepeatedCompositeFieldContainer[LineCounts]
    progress: StrategyProgress
    cancelling: _containers.RepeatedScalarFieldContainer[str]
    overdue_cancels: _containers.RepeatedScalarFieldContainer[str]
    def __init__(self, number: _Optional[int] = ..., time: _Optional[_Union[datetime.datetime, _timestamp_pb2.Timestamp, _Mapping]] = ..., age_s: _Optional[float] = ..., state: _Optional[_Union[BridgeState, str]] = ..., problem: _Optional[str] = ..., reasons: _Optional[_Iterable[_Union[Notice, _Mapping]]] = ..., warnings: _Optional[_Iterable[_Union[Notice, _Mapping]]] = ..., stops: _Optional[_Iterable[str]] = ..., devices: _Optional[_Iterable[_Union[DeviceState, _Mapping]]] = ..., components: _Optional[_Iterable[_Union[ComponentState, _Mapping]]] = ..., enabled: _Optional[_Iterable[str]] = ..., drive: _Optional[_Union[DriveState, _Mapping]] = ..., has_scan: _Optional[bool] = ..., overruns: _Optional[int] = ..., communications: _Optional[_Iterable[_Union[CommunicationState, _Mapping]]] = ..., latencies: _Optional[_Iterable[_Union[Latency, _Mapping]]] = ..., lines: _Optional[_Iterable[_Union[LineCounts, _Mapping]]] = ..., progress: _Optional[_Union[StrategyProgress, _Mapping]] = ..., cancelling: _Optional[_Iterable[str]] = ..., overdue_cancels: _Optional[_Iterable[str]] = ...) -> None: ...

class StrategyProgress(_message.Message):
    __slots__ = ("aims", "assumptions", "overdue", "is_followed", "approached", "chosen", "missions")
    AIMS_FIELD_NUMBER: _ClassVar[int]
    ASSUMPTIONS_FIELD_NUMBER: _ClassVar[int]
    OVERDUE_FIELD_NUMBER: _ClassVar[int]
    IS_FOLLOWED_FIELD_NUMBER: _ClassVar[int]
    APPROACHED_FIELD_NUMBER: _ClassVar[int]
    CHOSEN_FIELD_NUMBER: _ClassVar[int]
    MISSIONS_FIELD_NUMBER: _ClassVar[int]
    aims: _containers.RepeatedCompositeFieldContainer[Standing]
    assumptions: _containers.RepeatedCompositeFieldContainer[Standing]
    overdue: _containers.RepeatedScalarFieldContainer[str]
    is_followed: bool
    approached: str
    chosen: str
    missions: _containers.RepeatedCompositeFieldContainer[MissionStanding]
    def __init__(self, aims: _Optional[_Iterable[_Union[Standing, _Mapping]]] = ..., assumptions: _Optional[_Iterable[_Union[Standing, _Mapping]]] = ..., overdue: _Optional[_Iterable[str]] = ..., is_followed: _Optional[bool] = ..., approached: _Optional[str] = ..., chosen: _Optional[str] = ..., missions: _Optional[_Iterable[_Union[MissionStanding, _Mapping]]] = ...) -> None: ...

class Standing(_message.Message):
    __slots__ = ("name", "words", "is_met", "times", "unmet_s", "mission")
    NAME_FIELD_NUMBER: _ClassVar[int]
    WORDS_FIELD_NUMBER: _ClassVar[int]
    IS_MET_FIELD_NUMBER: _ClassVar[int]
    TIMES_FIELD_NUMBER: _ClassVar[int]
    UNMET_S_FIELD_NUMBER: _ClassVar[int]
    MISSION_FIELD_NUMBER: _ClassVar[int]
    name: str
    words: str
    is_met: bool
    times: int
    unmet_s: float
    mission: str
    def __init__(self, name: _Optional[str] = ..., words: _Optional[str] = ..., is_met: _Optional[bool] = ..., times: _Optional[int] = ..., unmet_s: _Optional[float] = ..., mission: _Optional[str] = ...) -> None: ...

class MissionStanding(_message.Message):
    __slots__ = ("name", "visit", "is_round", "rounds", "detours")
    NAME_FIELD_NUMBER: _ClassVar[int]
    VISIT_FIELD_NUMBER: _ClassVar[int]
    IS_ROUND_FIELD_NUMBER: _ClassVar[int]
    ROUNDS_FIELD_NUMBER: _ClassVar[int]
    DETOURS_FIELD_NUMBER: _ClassVar[int]
    name: str
    visit: int
    is_round: bool
    rounds: int
    detours: _containers.RepeatedScalarFieldContainer[int]
    def __init__(self, name: _Optional[str] = ..., visit: _Optional[int] = ..., is_round: _Optional[bool] = ..., rounds: _Optional[int] = ..., detours: _Optional[_Iterable[int]] = ...) -> None: ...

class Latency(_message.Message):
    __slots__ = ("name", "count", "p50_s", "p99_s", "max_s", "sum_s")
    NAME_FIELD_NUMBER: _ClassVar[int]
    COUNT_FIELD_NUMBER: _ClassVar[int]
    P50_S_FIELD_NUMBER: _ClassVar[int]
    P99_S_FIELD_NUMBER: _ClassVar[int]
    MAX_S_FIELD_NUMBER: _ClassVar[int]
    SUM_S_FIELD_NUMBER: _ClassVar[int]
    name: str
    count: int
    p50_s: float
    p99_s: float
    max_s: float
    sum_s: float
    def __init__(self, name: _Optional[str] = ..., count: _Optional[int] = ..., p50_s: _Optional[float] = ..., p99_s: _Optional[float] = ..., max_s: _Optional[float] = ..., sum_s: _Optional[float] = ...) -> None: ...

class LineCounts(_message.Message):
    __slots__ = ("device", "counts")
    class CountsEntry(_message.Message):
        __slots__ = ("key", "value")
        KEY_FIELD_NUMBER: _ClassVar[int]
        VALUE_FIELD_NUMBER: _ClassVar[int]
        key: str
        value: int
        def __init__(self, key: _Optional[str] = ..., value: _Optional[int] = ...) -> None: ...
    DEVICE_FIELD_NUMBER: _ClassVar[int]
    COUNTS_FIELD_NUMBER: _ClassVar[int]
    device: str
    counts: _containers.ScalarMap[str, int]
    def __init__(self, device: _Optional[str] = ..., counts: _Optional[_Mapping[str, int]] = ...) -> None: ...

class CommunicationState(_message.Message):
    __slots__ = ("name", "location")
    NAME_FIELD_NUMBER: _ClassVar[int]
    LOCATION_FIELD_NUMBER: _ClassVar[int]
    name: str
    location: str
    def __init__(self, name: _Optional[str] = ..., location: _Optional[str] = ...) -> None: ...

class Notice(_message.Message):
    __slots__ = ("code", "text", "holds_until_reset")
    CODE_FIELD_NUMBER: _ClassVar[int]
    TEXT_FIELD_NUMBER: _ClassVar[int]
    HOLDS_UNTIL_RESET_FIELD_NUMBER: _ClassVar[int]
    code: str
    text: str
    holds_until_reset: bool
    def __init__(self, code: _Optional[str] = ..., text: _Optional[str] = ..., holds_until_reset: _Optional[bool] = ...) -> None: ...

class DeviceState(_message.Message):
    __slots__ = ("name", "works")
    NAME_FIELD_NUMBER: _ClassVar[int]
    WORKS_FIELD_NUMBER: _ClassVar[int]
    name: str
    works: bool
    def __init__(self, name: _Optional[str] = ..., works: _Optional[bool] = ...) -> None: ...

class ComponentState(_message.Message):
    __slots__ = ("name", "state", "variables")
    NAME_FIELD_NUMBER: _ClassVar[int]
    STATE_FIELD_NUMBER: _ClassVar[int]
    VARIABLES_FIELD_NUMBER: _ClassVar[int]
    name: str
    state: str
    variables: _struct_pb2.Struct
    def __init__(self, name: _Optional[str] = ..., state: _Optional[str] = ..., variables: _Optional[_Union[_struct_pb2.Struct, _Mapping]] = ...) -> None: ...

class DriveState(_message.Message):
    __slots__ = ("age_s", "pose", "velocity", "left_wheel_m_s", "right_wheel_m_s", "is_torque_on", "faults", "battery_v", "battery_share", "temperature_c", "buttons", "time_s", "imu", "left_wheel_m", "right_wheel_m", "wheel_radius_m", "pose_covariance", "linear_variance", "angular_variance")
    class ButtonsEntry(_message.Message):
        __slots__ = ("key", "value")
        KEY_FIELD_NUMBER: _ClassVar[int]
        VALUE_FIELD_NUMBER: _ClassVar[int]
        key: str
        value: bool
        def __init__(self, key: _Optional[str] = ..., value: _Optional[bool] = ...) -> None: ...
    class ImuEntry(_message.Message):
        __slots__ = ("key", "value")
        KEY_FIELD_NUMBER: _ClassVar[int]
        VALUE_FIELD_NUMBER: _ClassVar[int]
        key: str
        value: float
        def __init__(self, key: _Optional[str] = ..., value: _Optional[float] = ...) -> None: ...
    AGE_S_FIELD_NUMBER: _ClassVar[int]
    POSE_FIELD_NUMBER: _ClassVar[int]
    VELOCITY_FIELD_NUMBER: _ClassVar[int]
    LEFT_WHEEL_M_S_FIELD_NUMBER: _ClassVar[int]
    RIGHT_WHEEL_M_S_FIELD_NUMBER: _ClassVar[int]
    IS_TORQUE_ON_FIELD_NUMBER: _ClassVar[int]
    FAULTS_FIELD_NUMBER: _ClassVar[int]
    BATTERY_V_FIELD_NUMBER: _ClassVar[int]
    BATTERY_SHARE_FIELD_NUMBER: _ClassVar[int]
    TEMPERATURE_C_FIELD_NUMBER: _ClassVar[int]
    BUTTONS_FIELD_NUMBER: _ClassVar[int]
    TIME_S_FIELD_NUMBER: _ClassVar[int]
    IMU_FIELD_NUMBER: _ClassVar[int]
    LEFT_WHEEL_M_FIELD_NUMBER: _ClassVar[int]
    RIGHT_WHEEL_M_FIELD_NUMBER: _ClassVar[int]
    WHEEL_RADIUS_M_FIELD_NUMBER: _ClassVar[int]
    POSE_COVARIANCE_FIELD_NUMBER: _ClassVar[int]
    LINEAR_VARIANCE_FIELD_NUMBER: _ClassVar[int]
    ANGULAR_VARIANCE_FIELD_NUMBER: _ClassVar[int]
    age_s: float
    pose: Pose
    velocity: Twist
    left_wheel_m_s: float
    right_wheel_m_s: float
    is_torque_on: bool
    faults: _containers.RepeatedScalarFieldContainer[str]
    battery_v: float
    battery_share: float
    temperature_c: float
    buttons: _containers.ScalarMap[str, bool]
    time_s: float
    imu: _containers.ScalarMap[str, float]
    left_wheel_m: float
    right_wheel_m: float
    wheel_radius_m: float
    pose_covariance: _containers.RepeatedScalarFieldContainer[float]
    linear_variance: float
    angular_variance: float
    def __init__(self, age_s: _Optional[float] = ..., pose: _Optional[_Union[Pose, _Mapping]] = ..., velocity: _Optional[_Union[Twist, _Mapping]] = ..., left_wheel_m_s: _Optional[float] = ..., right_wheel_m_s: _Optional[float] = ..., is_torque_on: _Optional[bool] = ..., faults: _Optional[_Iterable[str]] = ..., battery_v: _Optional[float] = ..., battery_share: _Optional[float] = ..., temperature_c: _Optional[float] = ..., buttons: _Optional[_Mapping[str, bool]] = ..., time_s: _Optional[float] = ..., imu: _Optional[_Mapping[str, float]] = ..., left_wheel_m: _Optional[float] = ..., right_wheel_m: _Optional[float] = ..., wheel_radius_m: _Optional[float] = ..., pose_covariance: _Optional[_Iterable[float]] = ..., linear_variance: _Optional[float] = ..., angular_variance: _Optional[float] = ...) -> None: ...

class Pose(_message.Message):
    __slots__ = ("x_m", "y_m", "heading_rad")
    X_M_FIELD_NUMBER: _ClassVar[int]
    Y_M_FIELD_NUMBER: _ClassVar[int]
    HEADING_RAD_FIELD_NUMBER: _ClassVar[int]
    x_m: float
    y_m: float
    heading_rad: float
    def __init__(self, x_m: _Optional[float] = ..., y_m: _Optional[float] = ..., heading_rad: _Optional[float] = ...) -> None: ...

class Twist(_message.Message):
    __slots__ = ("linear_m_s", "angular_rad_s")
    LINEAR_M_S_FIELD_NUMBER: _ClassVar[int]
    ANGULAR_RAD_S_FIELD_NUMBER: _ClassVar[int]
    linear_m_s: float
    angular_rad_s: float
    def __init__(self, linear_m_s: _Optional[float] = ..., angular_rad_s: _Optional[float] = ...) -> None: ...

class Scan(_message.Message):
    __slots__ = ("age_s", "ranges_m", "turns_per_s", "time_s", "min_m", "max_m")
    AGE_S_FIELD_NUMBER: _ClassVar[int]
    RANGES_M_FIELD_NUMBER: _ClassVar[int]
    TURNS_PER_S_FIELD_NUMBER: _ClassVar[int]
    TIME_S_FIELD_NUMBER: _ClassVar[int]
    MIN_M_FIELD_NUMBER: _ClassVar[int]
    MAX_M_FIELD_NUMBER: _ClassVar[int]
    age_s: float
    ranges_m: _containers.RepeatedScalarFieldContainer[float]
    turns_per_s: float
    time_s: float
    min_m: float
    max_m: float
    def __init__(self, age_s: _Optional[float] = ..., ranges_m: _Optional[_Iterable[float]] = ..., turns_per_s: _Optional[float] = ..., time_s: _Optional[float] = ..., min_m: _Optional[float] = ..., max_m: _Optional[float] = ...) -> None: ...

class StopRequest(_message.Message):
    __slots__ = ()
    def __init__(self) -> None: ...

class StopResponse(_message.Message):
    __slots__ = ()
    def __init__(self) -> None: ...

class CommandRequest(_message.Message):
    __slots__ = ("command",)
    COMMAND_FIELD_NUMBER: _ClassVar[int]
    command: CommandKind
    def __init__(self, command: _Optional[_Union[CommandKind, str]] = ...) -> None: ...

class CommandResponse(_message.Message):
    __slots__ = ("refusal",)
    REFUSAL_FIELD_NUMBER: _ClassVar[int]
    refusal: str
    def __init__(self, refusal: _Optional[str] = ...) -> None: ...

class WatchRequest(_message.Message):
    __slots__ = ("maximum_rate_hz", "with_scans", "without_events")
    MAXIMUM_RATE_HZ_FIELD_NUMBER: _ClassVar[int]
    WITH_SCANS_FIELD_NUMBER: _ClassVar[int]
    WITHOUT_EVENTS_FIELD_NUMBER: _ClassVar[int]
    maximum_rate_hz: float
    with_scans: bool
    without_events: bool
    def __init__(self, maximum_rate_hz: _Optional[float] = ..., with_scans: _Optional[bool] = ..., without_events: _Optional[bool] = ...) -> None: ...

class WatchResponse(_message.Message):
    __slots__ = ("snapshot", "events", "lost_events", "scan", "sent_s")
    SNAPSHOT_FIELD_NUMBER: _ClassVar[int]
    EVENTS_FIELD_NUMBER: _ClassVar[int]
    LOST_EVENTS_FIELD_NUMBER: _ClassVar[int]
    SCAN_FIELD_NUMBER: _ClassVar[int]
    SENT_S_FIELD_NUMBER: _ClassVar[int]
    snapshot: Snapshot
    events: _containers.RepeatedCompositeFieldContainer[_struct_pb2.Struct]
    lost_events: int
    scan: Scan
    sent_s: float
    def __init__(self, snapshot: _Optional[_Union[Snapshot, _Mapping]] = ..., events: _Optional[_Iterable[_Union[_struct_pb2.Struct, _Mapping]]] = ..., lost_events: _Optional[int] = ..., scan: _Optional[_Union[Scan, _Mapping]] = ..., sent_s: _Optional[float] = ...) -> None: ...

class AttachRequest(_message.Message):
    __slots__ = ("hello", "keep_alive", "give", "reply", "call_failure", "goal_acceptance", "feedback", "goal_end", "request", "call", "goal", "cancel")
    HELLO_FIELD_NUMBER: _ClassVar[int]
    KEEP_ALIVE_FIELD_NUMBER: _ClassVar[int]
    GIVE_FIELD_NUMBER: _ClassVar[int]
    REPLY_FIELD_NUMBER: _ClassVar[int]
    CALL_FAILURE_FIELD_NUMBER: _ClassVar[int]
    GOAL_ACCEPTANCE_FIELD_NUMBER: _ClassVar[int]
    FEEDBACK_FIELD_NUMBER: _ClassVar[int]
    GOAL_END_FIELD_NUMBER: _ClassVar[int]
    REQUEST_FIELD_NUMBER: _ClassVar[int]
    CALL_FIELD_NUMBER: _ClassVar[int]
    GOAL_FIELD_NUMBER: _ClassVar[int]
    CANCEL_FIELD_NUMBER: _ClassVar[int]
    hello: Hello
    keep_alive: KeepAlive
    give: Message
    reply: NumberedData
    call_failure: CallFailure
    goal_acceptance: GoalNumber
    feedback: NumberedData
    goal_end: GoalEnd
    request: Message
    call: OwnRequest
    goal: OwnRequest
    cancel: OwnCancel
    def __init__(self, hello: _Optional[_Union[Hello, _Mapping]] = ..., keep_alive: _Optional[_Union[KeepAlive, _Mapping]] = ..., give: _Optional[_Union[Message, _Mapping]] = ..., reply: _Optional[_Union[NumberedData, _Mapping]] = ..., call_failure: _Optional[_Union[CallFailure, _Mapping]] = ..., goal_acceptance: _Optional[_Union[GoalNumber, _Mapping]] = ..., feedback: _Optional[_Union[NumberedData, _Mapping]] = ..., goal_end: _Optional[_Union[GoalEnd, _Mapping]] = ..., request: _Optional[_Union[Message, _Mapping]] = ..., call: _Optional[_Union[OwnRequest, _Mapping]] = ..., goal: _Optional[_Union[OwnRequest, _Mapping]] = ..., cancel: _Optional[_Union[OwnCancel, _Mapping]] = ...) -> None: ...

class AttachResponse(_message.Message):
    __slots__ = ("welcome", "message_sent", "call", "goal", "cancel", "passed_on", "blocked", "answer", "goal_taken", "goal_rejected", "goal_feedback", "goal_over", "refused")
    WELCOME_FIELD_NUMBER: _ClassVar[int]
    MESSAGE_SENT_FIELD_NUMBER: _ClassVar[int]
    CALL_FIELD_NUMBER: _ClassVar[int]
    GOAL_FIELD_NUMBER: _ClassVar[int]
    CANCEL_FIELD_NUMBER: _ClassVar[int]
    PASSED_ON_FIELD_NUMBER: _ClassVar[int]
    BLOCKED_FIELD_NUMBER: _ClassVar[int]
    ANSWER_FIELD_NUMBER: _ClassVar[int]
    GOAL_TAKEN_FIELD_NUMBER: _ClassVar[int]
    GOAL_REJECTED_FIELD_NUMBER: _ClassVar[int]
    GOAL_FEEDBACK_FIELD_NUMBER: _ClassVar[int]
    GOAL_OVER_FIELD_NUMBER: _ClassVar[int]
    REFUSED_FIELD_NUMBER: _ClassVar[int]
    welcome: Welcome
    message_sent: ModelMessage
    call: ModelRequest
    goal: ModelRequest
    cancel: ModelCancel
    passed_on: Message
    blocked: Blocked
    answer: OwnAnswer
    goal_taken: OwnGoal
    goal_rejected: OwnGoal
    goal_feedback: OwnFeedback
    goal_over: OwnGoalEnd
    refused: Refusal
    def __init__(self, welcome: _Optional[_Union[Welcome, _Mapping]] = ..., message_sent: _Optional[_Union[ModelMessage, _Mapping]] = ..., call: _Optional[_Union[ModelRequest, _Mapping]] = ..., goal: _Optional[_Union[ModelRequest, _Mapping]] = ..., cancel: _Optional[_Union[ModelCancel, _Mapping]] = ..., passed_on: _Optional[_Union[Message, _Mapping]] = ..., blocked: _Optional[_Union[Blocked, _Mapping]] = ..., answer: _Optional[_Union[OwnAnswer, _Mapping]] = ..., goal_taken: _Optional[_Union[OwnGoal, _Mapping]] = ..., goal_rejected: _Optional[_Union[OwnGoal, _Mapping]] = ..., goal_feedback: _Optional[_Union[OwnFeedback, _Mapping]] = ..., goal_over: _Optional[_Union[OwnGoalEnd, _Mapping]] = ..., refused: _Optional[_Union[Refusal, _Mapping]] = ...) -> None: ...

class Hello(_message.Message):
    __slots__ = ("name", "serves", "is_operator")
    NAME_FIELD_NUMBER: _ClassVar[int]
    SERVES_FIELD_NUMBER: _ClassVar[int]
    IS_OPERATOR_FIELD_NUMBER: _ClassVar[int]
    name: str
    serves: _containers.RepeatedScalarFieldContainer[str]
    is_operator: bool
    def __init__(self, name: _Optional[str] = ..., serves: _Optional[_Iterable[str]] = ..., is_operator: _Optional[bool] = ...) -> None: ...

class KeepAlive(_message.Message):
    __slots__ = ()
    def __init__(self) -> None: ...

class Welcome(_message.Message):
    __slots__ = ("operator_timeout_s",)
    OPERATOR_TIMEOUT_S_FIELD_NUMBER: _ClassVar[int]
    operator_timeout_s: float
    def __init__(self, operator_timeout_s: _Optional[float] = ...) -> None: ...

class Message(_message.Message):
    __slots__ = ("identifier", "data")
    IDENTIFIER_FIELD_NUMBER: _ClassVar[int]
    DATA_FIELD_NUMBER: _ClassVar[int]
    identifier: str
    data: _struct_pb2.Value
    def __init__(self, identifier: _Optional[str] = ..., data: _Optional[_Union[_struct_pb2.Value, _Mapping]] = ...) -> None: ...

class NumberedData(_message.Message):
    __slots__ = ("number", "data")
    NUMBER_FIELD_NUMBER: _ClassVar[int]
    DATA_FIELD_NUMBER: _ClassVar[int]
    number: int
    data: _struct_pb2.Value
    def __init__(self, number: _Optional[int] = ..., data: _Optional[_Union[_struct_pb2.Value, _Mapping]] = ...) -> None: ...

class CallFailure(_message.Message):
    __slots__ = ("number", "reason")
    NUMBER_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    number: int
    reason: str
    def __init__(self, number: _Optional[int] = ..., reason: _Optional[str] = ...) -> None: ...

class GoalNumber(_message.Message):
    __slots__ = ("number",)
    NUMBER_FIELD_NUMBER: _ClassVar[int]
    number: int
    def __init__(self, number: _Optional[int] = ...) -> None: ...

class GoalEnd(_message.Message):
    __slots__ = ("number", "outcome", "data")
    NUMBER_FIELD_NUMBER: _ClassVar[int]
    OUTCOME_FIELD_NUMBER: _ClassVar[int]
    DATA_FIELD_NUMBER: _ClassVar[int]
    number: int
    outcome: GoalOutcome
    data: _struct_pb2.Value
    def __init__(self, number: _Optional[int] = ..., outcome: _Optional[_Union[GoalOutcome, str]] = ..., data: _Optional[_Union[_struct_pb2.Value, _Mapping]] = ...) -> None: ...

class OwnRequest(_message.Message):
    __slots__ = ("name", "id", "data")
    NAME_FIELD_NUMBER: _ClassVar[int]
    ID_FIELD_NUMBER: _ClassVar[int]
    DATA_FIELD_NUMBER: _ClassVar[int]
    name: str
    id: str
    data: _struct_pb2.Value
    def __init__(self, name: _Optional[str] = ..., id: _Optional[str] = ..., data: _Optional[_Union[_struct_pb2.Value, _Mapping]] = ...) -> None: ...

class OwnCancel(_message.Message):
    __slots__ = ("name", "id")
    NAME_FIELD_NUMBER: _ClassVar[int]
    ID_FIELD_NUMBER: _ClassVar[int]
    name: str
    id: str
    def __init__(self, name: _Optional[str] = ..., id: _Optional[str] = ...) -> None: ...

class ModelMessage(_message.Message):
    __slots__ = ("name", "identifier", "data")
    NAME_FIELD_NUMBER: _ClassVar[int]
    IDENTIFIER_FIELD_NUMBER: _ClassVar[int]
    DATA_FIELD_NUMBER: _ClassVar[int]
    name: str
    identifier: str
    data: _struct_pb2.Value
    def __init__(self, name: _Optional[str] = ..., identifier: _Optional[str] = ..., data: _Optional[_Union[_struct_pb2.Value, _Mapping]] = ...) -> None: ...

class ModelRequest(_message.Message):
    __slots__ = ("name", "number", "data")
    NAME_FIELD_NUMBER: _ClassVar[int]
    NUMBER_FIELD_NUMBER: _ClassVar[int]
    DATA_FIELD_NUMBER: _ClassVar[int]
    name: str
    number: int
    data: _struct_pb2.Value
    def __init__(self, name: _Optional[str] = ..., number: _Optional[int] = ..., data: _Optional[_Union[_struct_pb2.Value, _Mapping]] = ...) -> None: ...

class ModelCancel(_message.Message):
    __slots__ = ("name", "number")
    NAME_FIELD_NUMBER: _ClassVar[int]
    NUMBER_FIELD_NUMBER: _ClassVar[int]
    name: str
    number: int
    def __init__(self, name: _Optional[str] = ..., number: _Optional[int] = ...) -> None: ...

class Blocked(_message.Message):
    __slots__ = ("identifier",)
    IDENTIFIER_FIELD_NUMBER: _ClassVar[int]
    identifier: str
    def __init__(self, identifier: _Optional[str] = ...) -> None: ...

class OwnAnswer(_message.Message):
    __slots__ = ("id", "data", "is_default")
    ID_FIELD_NUMBER: _ClassVar[int]
    DATA_FIELD_NUMBER: _ClassVar[int]
    IS_DEFAULT_FIELD_NUMBER: _ClassVar[int]
    id: str
    data: _struct_pb2.Value
    is_default: bool
    def __init__(self, id: _Optional[str] = ..., data: _Optional[_Union[_struct_pb2.Value, _Mapping]] = ..., is_default: _Optional[bool] = ...) -> None: ...

class OwnGoal(_message.Message):
    __slots__ = ("id",)
    ID_FIELD_NUMBER: _ClassVar[int]
    id: str
    def __init__(self, id: _Optional[str] = ...) -> None: ...

class OwnFeedback(_message.Message):
    __slots__ = ("id", "data")
    ID_FIELD_NUMBER: _ClassVar[int]
    DATA_FIELD_NUMBER: _ClassVar[int]
    id: str
    data: _struct_pb2.Value
    def __init__(self, id: _Optional[str] = ..., data: _Optional[_Union[_struct_pb2.Value, _Mapping]] = ...) -> None: ...

class OwnGoalEnd(_message.Message):
    __slots__ = ("id", "outcome", "data")
    ID_FIELD_NUMBER: _ClassVar[int]
    OUTCOME_FIELD_NUMBER: _ClassVar[int]
    DATA_FIELD_NUMBER: _ClassVar[int]
    id: str
    outcome: GoalOutcome
    data: _struct_pb2.Value
    def __init__(self, id: _Optional[str] = ..., outcome: _Optional[_Union[GoalOutcome, str]] = ..., data: _Optional[_Union[_struct_pb2.Value, _Mapping]] = ...) -> None: ...

class Refusal(_message.Message):
    __slots__ = ("why",)
    WHY_FIELD_NUMBER: _ClassVar[int]
    why: str
    def __init__(self, why: _Optional[str] = ...) -> None: ...
