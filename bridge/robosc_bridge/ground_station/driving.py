"""Motion that set-points request, as requests of a program to a supervision layer.

Sources: mavlink.io (SET_POSITION_TARGET_LOCAL_NED, MANUAL_CONTROL) and ArduPilot Rover. Rotations are clockwise there
and counter-clockwise here. A ground station that drives by hand must repeat its set-points: when the stream ends, the
robot is requested to stand still.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from robosc.expressions import ObjectType
from robosc.model.structure import Communication, CommunicationKind, Model
from robosc_bridge.configuration.channel_mapping import ChannelMapping
from robosc_bridge.configuration.channels import DriveChannel
from robosc_bridge.daemon.programs.items import Attached, Detached, FromProgram, MessageRequested, Program, ToProgram
from robosc_bridge.devices.interface import STANDSTILL, Velocity

SILENCE_S = 0.5
"""After so long without a set-point, who drove by hand no longer does."""

_BODY_FRAMES = (8, 9, 12)
_VX, _VY, _FORCE, _YAW_RATE = 8, 16, 512, 2048
_POSITION, _ACCELERATION, _YAW = 1 | 2 | 4, 64 | 128 | 256, 1024
_FULL = 1000.0


class Unusable(Exception):
    """A set-point cannot be followed; the message says why."""


def from_position_target(raw: Any) -> Velocity:
    """Return the velocity that SET_POSITION_TARGET_LOCAL_NED requests.

    Raises:
        Unusable: The set-point is not a forward speed, a yaw rate or both.
    """
    mask = raw.type_mask
    if raw.coordinate_frame not in _BODY_FRAMES:
        raise Unusable("Set-points must be in the robot's own frame (8 BODY_NED, 9 or 12).")
    must_ignore = _POSITION | _ACCELERATION | _YAW
    if mask & must_ignore != must_ignore or mask & _FORCE or mask & (_VX | _YAW_RATE) == _VX | _YAW_RATE:
        raise Unusable("Set-points may hold a velocity and a yaw rate only, such as type mask 1511.")
    speed_m_s = 0.0 if mask & _VX else raw.vx
    aside_m_s = 0.0 if mask & _VY else raw.vy
    yaw_rate_rad_s = 0.0 if mask & _YAW_RATE else raw.yaw_rate
    if not all(map(math.isfinite, (speed_m_s, aside_m_s, yaw_rate_rad_s))):
        raise Unusable("A set-point is not a number.")
    if aside_m_s != 0.0:
        raise Unusable("The robot cannot go sideways: vy must be 0.")
    return Velocity(speed_m_s, -yaw_rate_rad_s + 0.0)


def from_manual_control(raw: Any, fastest: Velocity) -> Velocity:
    """Return the velocity of a stick: x ahead, r to the right, as ground stations send it.

    The axes y and z and the buttons are ignored.

    Args:
        raw: MANUAL_CONTROL.
        fastest: Velocity of a full stick.

    Raises:
        Unusable: A required axis is missing.
    """
    if abs(raw.x) > _FULL or abs(raw.r) > _FULL:
        raise Unusable("A stick has no x or no r axis.")
    return Velocity(raw.x / _FULL * fastest.linear_m_s, -raw.r / _FULL * fastest.angular_rad_s + 0.0)


def drive_message(mapping: ChannelMapping) -> Communication | None:
    """Return the message to the robot that is mapped to the drive; of several, the first of the model."""
    return next(
        (item for item, _ in mapping.mapped_to(DriveChannel) if item.kind is CommunicationKind.INCOMING_MESSAGE), None
    )


def drive_data(model: Model, message: Communication, velocity: Velocity) -> dict[str, Any]:
    """Return a velocity in the shape of the message: a twist, or a stamped twist."""
    twist = {
        "linear": {"x": velocity.linear_m_s, "y": 0.0, "z": 0.0},
        "angular": {"x": 0.0, "y": 0.0, "z": velocity.angular_rad_s},
    }
    if isinstance(message.request, ObjectType):
        names = {item.name for item in model.object(message.request.name).properties}
        if "twist" in names:
            return {"twist": twist}
    return twist


@dataclass
class _Drive:
    program: Program
    last_s: float
    velocity: Velocity


class Driving:
    """Driver at the ground station, as a program that is attached to the layer while set-points come.

    Args:
        model: Model that the layer is for.
        message: Its message that is mapped to the drive.
        post: The daemon's inbox.
        notify: Function that takes the reports of the layer; from the loop's thread, neither waits nor raises.
    """

    def __init__(
        self,
        model: Model,
        message: Communication,
        post: Callable[[FromProgram], None],
        notify: Callable[[ToProgram], None],
    ) -> None:
        self._model = model
        self._message = message
        self._post = post
        self._notify = notify
        self._drive: _Drive | None = None

    def take(self, now_s: float, velocity: Velocity) -> None:
        """Pass a set-point on as a request."""
        if self._drive is None:
            self._drive = _Drive(Program("MAVLink", self._notify, may_request=True), now_s, velocity)
            self._post(Attached(self._drive.program))
        self._drive.last_s, self._drive.velocity = now_s, velocity
        self._request(self._drive, velocity)

    def poll(self, now_s: float) -> bool:
        """End driving without set-points; return True if it has just ended while motion was requested."""
        drive = self._drive
        if drive is None or now_s - drive.last_s < SILENCE_S:
            return False
        return self.end()

    def end(self) -> bool:
        """End driving; return True if motion was requested."""
        drive, self._drive = self._drive, None
        if drive is None:
            return False
        was_moving = drive.velocity != STANDSTILL
        if was_moving:
            self._request(drive, STANDSTILL)
        self._post(Detached(drive.program))
        return was_moving

    def _request(self, drive: _Drive, velocity: Velocity) -> None:
        data = drive_data(self._model, self._message, velocity)
        self._post(MessageRequested(drive.program, self._message.identifier, data))
