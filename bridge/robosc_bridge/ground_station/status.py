"""State of the daemon as the content of a heartbeat: mode, armed or not, system status.

Sources: mavlink.io (HEARTBEAT, MAV_MODE_FLAG, MAV_STATE); the numbers of modes are those of ArduPilot Rover, which
ground stations know by name for a ground rover.
"""

from dataclasses import dataclass
from enum import IntEnum

from robosc_bridge.daemon.feed import Snapshot
from robosc_bridge.daemon.states import State
from robosc_bridge.protocol.mavlink_messages import ARMED, CUSTOM_MODE, Mode
from robosc_bridge.safety import LATCHING, Reason

MANUAL_INPUT, GUIDED, AUTO = 64, 8, 4
"""Bits of the base mode, beside `ARMED` and `CUSTOM_MODE`."""

ORDINARY = frozenset({Reason.STANDBY, Reason.TORQUE_AWAITED, Reason.COMMAND_SILENT})
"""Reasons that belong to every start and stop."""

_HARDWARE = frozenset(LATCHING) - {Reason.OPERATOR_STOP, Reason.SUPERVISOR_FAULT, Reason.PAUSED}


class SystemStatus(IntEnum):
    """MAV_STATE."""

    BOOT = 1
    STANDBY = 3
    ACTIVE = 4
    CRITICAL = 5
    EMERGENCY = 6
    POWEROFF = 7


@dataclass(frozen=True)
class VehicleStatus:
    """Content of a heartbeat.

    Attributes:
        is_armed: True if the wheels may move, or their motors hold.
        mode: `HOLD` while an operator's stop holds.
        base_mode: MAV_MODE_FLAG.
        system_status: State of the system (MAV_STATE).
    """

    is_armed: bool
    mode: Mode
    base_mode: int
    system_status: SystemStatus


def is_held(snapshot: Snapshot) -> bool:
    """Return True if an operator has stopped the robot."""
    return Reason.OPERATOR_STOP in snapshot.reasons


def status_of(snapshot: Snapshot | None, *, is_layer: bool, is_stale: bool) -> VehicleStatus:
    """Return the content of the heartbeat.

    Args:
        snapshot: Latest snapshot; None: there was none yet.
        is_layer: True if the supervisor is a supervision layer.
        is_stale: True if the snapshot is so old that the loop counts as hung.
    """
    if snapshot is None:
        state = SystemStatus.EMERGENCY if is_stale else SystemStatus.BOOT
        return VehicleStatus(False, Mode.INITIALISING, CUSTOM_MODE, state)
    has_torque = snapshot.reading is not None and snapshot.reading.is_torque_on
    is_armed = snapshot.state is State.RUNNING or has_torque
    mode = _mode(snapshot, is_layer)
    bits = {Mode.AUTO: AUTO, Mode.GUIDED: GUIDED | MANUAL_INPUT}.get(mode, 0)
    base_mode = CUSTOM_MODE | bits | (ARMED if is_armed else 0)
    return VehicleStatus(is_armed, mode, base_mode, SystemStatus.EMERGENCY if is_stale else _system_status(snapshot))


def run_mode(is_layer: bool) -> Mode:
    """Return the mode of a run: AUTO for a controller, GUIDED for a supervision layer."""
    return Mode.GUIDED if is_layer else Mode.AUTO


def _mode(snapshot: Snapshot, is_layer: bool) -> Mode:
    if snapshot.state is State.STARTING:
        return Mode.INITIALISING
    return Mode.HOLD if is_held(snapshot) else run_mode(is_layer)


def _system_status(snapshot: Snapshot) -> SystemStatus:
    match snapshot.state:
        case State.STARTING:
            return SystemStatus.BOOT
        case State.OVER:
            return SystemStatus.POWEROFF
        case State.FAULT:
            is_hardware = bool(_HARDWARE & set(snapshot.reasons)) or not all(snapshot.devices.values())
            return SystemStatus.EMERGENCY if is_hardware else SystemStatus.CRITICAL
        case State.RUNNING:
            is_held_back = bool(snapshot.stops) or bool(set(snapshot.reasons) - ORDINARY)
            return SystemStatus.CRITICAL if is_held_back else SystemStatus.ACTIVE
    return SystemStatus.STANDBY
