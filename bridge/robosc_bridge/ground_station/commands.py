"""Meaning of a ground station's commands: pure functions from numbers to meanings.

Sources: mavlink.io (command protocol, MAV_CMD, MAV_RESULT) and what stations send in practice. Stopping is never
refused, whatever the other parameters of the command are.
"""

import math
from dataclasses import dataclass
from enum import StrEnum

from pymavlink.dialects.v20 import ardupilotmega as dialect

from robosc_bridge.daemon.states import OperatorCommand
from robosc_bridge.ground_station.status import AUTO, GUIDED
from robosc_bridge.protocol.mavlink_messages import CUSTOM_MODE, FORCE, MavCommand, Mode, Result

SHORTEST_INTERVAL_S = 0.02
LONGEST_INTERVAL_S = 3600.0

type Parameters = tuple[float, float, float, float, float, float, float]


class Stop(StrEnum):
    """Ways of stopping: they are obeyed at once, from every sender."""

    STANDBY = "standby"
    OPERATOR = "operator stop"

    @property
    def command(self) -> OperatorCommand:
        """Command for the daemon."""
        return OperatorCommand.STANDBY if self is Stop.STANDBY else OperatorCommand.STOP


@dataclass(frozen=True)
class Change:
    """Command that changes the state of the daemon.

    Attributes:
        command: Command for the daemon.
        mode: Number of the requested mode; None: no mode was requested.
    """

    command: OperatorCommand
    mode: Mode | None = None


@dataclass(frozen=True)
class Interval:
    """Request to send a message at an interval.

    Attributes:
        message: Number of the message.
        interval_s: Time between two messages, in seconds; `math.inf`: never; None: the default.
    """

    message: int
    interval_s: float | None


@dataclass(frozen=True)
class Once:
    """Request to send a message once.

    Attributes:
        message: Number of the message.
    """

    message: int


@dataclass(frozen=True)
class Checks:
    """Request to report what stands against a start."""


@dataclass(frozen=True)
class Refusal:
    """Refusal of a command.

    Attributes:
        result: Result in the answer.
        why: Reason, one sentence; empty: the result is enough.
    """

    result: Result
    why: str = ""


type Meaning = Stop | Change | Interval | Once | Checks | Refusal

_UNSUPPORTED = Refusal(Result.UNSUPPORTED)
_CAPABILITIES: int = dialect.MAVLINK_MSG_ID_AUTOPILOT_VERSION


def meaning(number: int, parameters: Parameters) -> Meaning:
    """Return the meaning of a command.

    Args:
        number: MAV_CMD.
        parameters: Its seven; any of them may be no number.
    """
    first, second = parameters[0], parameters[1]
    match number:
        case MavCommand.ARM_DISARM:
            return _arming(first, second)
        case MavCommand.SET_MODE:
            return mode_meaning(first, second)
        case MavCommand.PAUSE_CONTINUE:
            return _choice(first, {0.0: Stop.OPERATOR, 1.0: Change(OperatorCommand.RESUME)})
        case MavCommand.FLIGHT_TERMINATION:
            # A parameter that cannot be read is taken for a stop, too.
            why = "A termination is ended by a mode or by going on, not by this command."
            return Refusal(Result.DENIED, why) if first <= 0.5 else Stop.OPERATOR
        case MavCommand.REBOOT_SHUTDOWN:
            return _reboot(first, second)
        case MavCommand.RUN_PREARM_CHECKS:
            return Checks()
        case MavCommand.SET_MESSAGE_INTERVAL:
            return _interval(first, second)
        case MavCommand.REQUEST_MESSAGE:
            return Once(int(first)) if _is_number(first) else _denied(first)
        case MavCommand.REQUEST_CAPABILITIES:
            return _choice(first, {1.0: Once(_CAPABILITIES)})
    return _UNSUPPORTED


def mode_meaning(base_mode: float, custom_mode: float) -> Meaning:
    """Return the meaning of a change of mode.

    Args:
        base_mode: MAV_MODE_FLAG; without the bit for custom modes, its other bits define the mode.
        custom_mode: Mode of ArduPilot Rover.
    """
    if custom_mode == Mode.HOLD:
        return Stop.OPERATOR
    if not _is_number(base_mode):
        return _denied(base_mode)
    if not int(base_mode) & CUSTOM_MODE:
        if int(base_mode) & (AUTO | GUIDED):
            return Change(OperatorCommand.RESUME)
        return Refusal(Result.DENIED, "There is no such mode here; there are HOLD, AUTO and GUIDED.")
    if custom_mode in (Mode.AUTO, Mode.GUIDED):
        return Change(OperatorCommand.RESUME, Mode(int(custom_mode)))
    known = custom_mode in set(Mode)
    name = f"mode {Mode(int(custom_mode)).name}" if known else "such mode"
    return Refusal(Result.DENIED, f"There is no {name} here; there are HOLD, AUTO and GUIDED.")


def _arming(wanted: float, force: float) -> Meaning:
    if wanted == 0.0:
        return Stop.STANDBY
    if wanted == 1.0:
        # By force it is armed as always: nothing gets around the safety layer.
        return Change(OperatorCommand.START) if force in (0.0, float(FORCE)) or math.isnan(force) else _denied(force)
    return _denied(wanted)


def _reboot(autopilot: float, companion: float) -> Meaning:
    if autopilot == 1.0 and companion == 0.0:
        return Change(OperatorCommand.RESET)
    if autopilot == 0.0 and companion == 0.0:
        return _denied(autopilot)
    return Refusal(Result.UNSUPPORTED, "The bridge can be reset (parameter 1 = 1), not rebooted or shut down.")


def _interval(message: float, interval_us: float) -> Meaning:
    if not _is_number(message):
        return _denied(message)
    if interval_us == 0.0:
        return Interval(int(message), None)
    if interval_us == -1.0:
        return Interval(int(message), math.inf)
    if not interval_us > 0.0:
        return _denied(interval_us)
    return Interval(int(message), min(max(interval_us / 1e6, SHORTEST_INTERVAL_S), LONGEST_INTERVAL_S))


def _choice(value: float, meanings: dict[float, Meaning]) -> Meaning:
    return meanings.get(value, _denied(value))


def _is_number(value: float) -> bool:
    """Return True if it is a whole number that a message or mode could have."""
    return 0.0 <= value < 2**24 and value == int(value)


def _denied(value: float) -> Refusal:
    return Refusal(Result.DENIED, f"A parameter of the command cannot be {value:g}.")
