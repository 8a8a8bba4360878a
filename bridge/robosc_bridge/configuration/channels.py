"""The channels of the bridge, to which communications of a model are mapped, with the shapes of their data.

The check of a configuration, its template and its documentation come from one table, `CHANNELS`. Shapes
follow the ROS messages that models link to (geometry_msgs/Twist, sensor_msgs/LaserScan, Imu and BatteryState,
nav_msgs/Odometry), without their headers.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Literal

from msgspec import Meta, Struct

from robosc.model.structure import CommunicationKind
from robosc_bridge.configuration.shapes import Array, Fields, Leaf, OneOf, Shape
from robosc_bridge.skills.settings import TypedKey

_Word = Annotated[str, Meta(min_length=1, max_length=40)]


class _Channel(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag_field="channel"):
    """Common part of all channels."""


class DriveChannel(_Channel, frozen=True, tag="drive"):
    """Velocity for the wheels: `linear.x` in m/s forward, `angular.z` in rad/s to the left; the rest must be 0."""


class StopChannel(_Channel, frozen=True, tag="stop"):
    """Stops the wheels and ends a rotation that is under way."""


class RotateChannel(_Channel, frozen=True, tag="rotate"):
    """Rotates by an angle (skill `rotate`). As an action it reports the remaining angle, in the same unit."""

    unit: Annotated[Literal["degrees", "radians"], Meta(description="Unit of the angle.")] = "degrees"
    direction: Annotated[
        Literal["left", "right"], Meta(description="Direction of angles above zero: left is counter-clockwise.")
    ] = "left"


class RotatedChannel(_Channel, frozen=True, tag="rotated"):
    """A rotation that a message requested has ended."""

    outcome: Annotated[Literal["done", "failed", "any"], Meta(description="Outcomes that are reported.")] = "done"


class ScannerChannel(_Channel, frozen=True, tag="scanner"):
    """A revolution of the LiDAR: 360 ranges in metres, one a degree, counter-clockwise from the front; NaN: unknown."""


class OdometryChannel(_Channel, frozen=True, tag="odometry"):
    """Pose since the start and velocity, as the drive measures them, with covariances."""


class ImuChannel(_Channel, frozen=True, tag="imu"):
    """Yaw rates in rad/s, accelerations in m/s² and orientation, of a drive that measures them."""


class BatteryChannel(_Channel, frozen=True, tag="battery"):
    """Voltage in V and charge of the battery."""

    unit: Annotated[
        Literal["share", "percent"], Meta(description="Unit of `percentage`: 0 to 1 as in ROS, or 0 to 100.")
    ] = "share"


class ButtonChannel(_Channel, frozen=True, tag="button"):
    """A button of the drive."""

    name: Annotated[_Word, Meta(description="Name of the button, such as `button_1`.")]
    on: Annotated[
        Literal["press", "release", "change"],
        Meta(description="Change that is reported: the state is true while pressed."),
    ] = "press"


class BumperChannel(_Channel, frozen=True, tag="bumper"):
    """The bumpers of the drive: true while one touches an obstacle; sent at each change and at the start."""

    side: Annotated[Literal["any", "front", "back"], Meta(description="Side of the bumper.")] = "any"


class KeyChannel(_Channel, frozen=True, tag="key"):
    """A key pressed in the terminal of the bridge."""

    key: Annotated[TypedKey, Meta(description="A single character, or `space`.")]


class EmergencyStopChannel(_Channel, frozen=True, tag="emergency_stop"):
    """The operator has stopped the robot, or lets it go on (skill `emergency_stop`)."""

    event: Annotated[Literal["stop", "resume"], Meta(description="Event that is reported.")]


class LineChannel(_Channel, frozen=True, tag="line"):
    """The line is in sight: the yaw rate that keeps the robot on it, in rad/s counter-clockwise (skill `line`)."""


class LineLostChannel(_Channel, frozen=True, tag="line_lost"):
    """No line is in sight (skill `line`)."""


class FaultChannel(_Channel, frozen=True, tag="fault"):
    """A device is lost or back again; the text says what happened."""

    device: Annotated[
        Literal["drive", "scanner", "camera", "any"], Meta(description="Device whose events are reported.")
    ] = "any"
    event: Annotated[Literal["lost", "back"], Meta(description="Event that is reported.")] = "lost"


class GrpcChannel(_Channel, frozen=True, tag="grpc"):
    """A program at the remote endpoint sends, receives or answers it."""


class LogChannel(_Channel, frozen=True, tag="log"):
    """Writes the message to the log, and does nothing else."""


class NoneChannel(_Channel, frozen=True, tag="none"):
    """Deliberately nothing: messages from the model are dropped, and messages to it never come."""


Channel = (
    DriveChannel
    | StopChannel
    | RotateChannel
    | RotatedChannel
    | ScannerChannel
    | OdometryChannel
    | ImuChannel
    | BatteryChannel
    | ButtonChannel
    | BumperChannel
    | KeyChannel
    | EmergencyStopChannel
    | LineChannel
    | LineLostChannel
    | FaultChannel
    | GrpcChannel
    | LogChannel
    | NoneChannel
)


@dataclass(frozen=True, slots=True)
class Use:
    """Shapes of the data of a channel for one kind of communication.

    Attributes:
        request: Shape of the data that the channel takes from the model.
        response: Shape of the data that the channel reports to the model.
        feedback: Shape of the data that the channel reports while an action is under way.
    """

    request: Shape = Leaf.NOTHING
    response: Shape = Leaf.NOTHING
    feedback: Shape = Leaf.NOTHING


@dataclass(frozen=True, slots=True)
class ChannelInfo:
    """Purpose of a channel.

    Attributes:
        uses: The kinds of communication that can be mapped to it, and the data of each.
        used_parts: Parts of a request that the channel uses, where all other parts must be 0; empty: all.
    """

    uses: Mapping[CommunicationKind, Use]
    used_parts: frozenset[str] = field(default_factory=frozenset)


_N = Leaf.NUMBER
_VECTOR = Fields({"x": _N, "y": _N, "z": _N})
_QUATERNION = Fields({"x": _N, "y": _N, "z": _N, "w": _N})
_TWIST = Fields({"linear": _VECTOR, "angular": _VECTOR})
_SCAN = Fields(
    {
        "ranges": Array(_N),
        "angle_min": _N,
        "angle_max": _N,
        "angle_increment": _N,
        "scan_time": _N,
        "range_min": _N,
        "range_max": _N,
    }
)
_ODOMETRY = Fields(
    {
        "pose": Fields({"pose": Fields({"position": _VECTOR, "orientation": _QUATERNION}), "covariance": Array(_N)}),
        "twist": Fields({"twist": _TWIST, "covariance": Array(_N)}),
    }
)
_IMU = Fields({"angular_velocity": _VECTOR, "linear_acceleration": _VECTOR, "orientation": _QUATERNION})
_BATTERY = Fields({"voltage": _N, "percentage": _N, "present": Leaf.BOOLEAN})
_OUTCOME = OneOf((Fields({"success": Leaf.BOOLEAN, "message": Leaf.TEXT}), Leaf.NOTHING))


def _or_data(leaf: Leaf) -> OneOf:
    """A value by itself, or as the field `data` of a message of std_msgs."""
    return OneOf((leaf, Fields({"data": leaf})))


_ANGLE = OneOf((_N, Fields({"data": _N}), Fields({"angle": _N})))
_SWITCH = _or_data(Leaf.BOOLEAN)
_ANY = Use(Leaf.ANYTHING, Leaf.ANYTHING, Leaf.ANYTHING)
_IN, _OUT = CommunicationKind.INCOMING_MESSAGE, CommunicationKind.OUTGOING_MESSAGE
_SERVICE, _ACTION = CommunicationKind.SERVICE, CommunicationKind.ACTION


def _reported(shape: Shape) -> ChannelInfo:
    return ChannelInfo({_OUT: Use(response=shape)})


CHANNELS: dict[type[Channel], ChannelInfo] = {
    DriveChannel: ChannelInfo(
        {_IN: Use(request=OneOf((_TWIST, Fields({"twist": _TWIST}))))},
        frozenset({"linear.x", "angular.z", "twist.linear.x", "twist.angular.z"}),
    ),
    StopChannel: ChannelInfo({_IN: Use(request=Leaf.ANYTHING), _SERVICE: Use(Leaf.ANYTHING, _OUTCOME)}),
    RotateChannel: ChannelInfo(
        {
            _IN: Use(request=_ANGLE),
            _SERVICE: Use(_ANGLE, _OUTCOME),
            _ACTION: Use(_ANGLE, _OUTCOME, OneOf((Fields({"remaining": _N}), _N))),
        }
    ),
    RotatedChannel: _reported(Leaf.NOTHING),
    ScannerChannel: _reported(_SCAN),
    OdometryChannel: _reported(_ODOMETRY),
    ImuChannel: _reported(_IMU),
    BatteryChannel: _reported(_BATTERY),
    ButtonChannel: _reported(_SWITCH),
    BumperChannel: _reported(_SWITCH),
    KeyChannel: _reported(Leaf.NOTHING),
    EmergencyStopChannel: _reported(Leaf.NOTHING),
    LineChannel: _reported(_or_data(_N)),
    LineLostChannel: _reported(Leaf.NOTHING),
    FaultChannel: _reported(_or_data(Leaf.TEXT)),
    GrpcChannel: ChannelInfo(dict.fromkeys(CommunicationKind, _ANY)),
    LogChannel: ChannelInfo({_IN: _ANY}),
    NoneChannel: ChannelInfo({_IN: _ANY, _OUT: _ANY}),
}


def channel_name(channel: Channel | type[Channel]) -> str:
    """Return the name of a channel in a configuration."""
    return str(channel.__struct_config__.tag)
