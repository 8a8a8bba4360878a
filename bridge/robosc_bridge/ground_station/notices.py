"""Notices for a person at the ground station: events, and reasons why the robot does not move."""

from collections.abc import Iterator

from robosc.execution.runtime.event_log import Entry
from robosc_bridge.daemon.feed import Snapshot
from robosc_bridge.daemon.states import State
from robosc_bridge.daemon.threads.reports import Device
from robosc_bridge.ground_station.status import ORDINARY
from robosc_bridge.ground_station.status_texts import Severity
from robosc_bridge.safety import LATCHING, Reason

type Notice = tuple[Severity, str]

_STATES = {
    State.STARTING: "Starting: waiting for the devices",
    State.STANDBY: "Standby: disarmed",
    State.RUNNING: "Running: armed",
    State.STOPPING: "Stopping",
    State.FAULT: "Stopped by a fault",
    State.OVER: "The bridge ends",
}


def happened(before: Snapshot | None, after: Snapshot) -> Iterator[Notice]:
    """Yield the notices of differences between two snapshots that are reported once."""
    if before is None or before.state is not after.state:
        severity = Severity.ERROR if after.state is State.FAULT else Severity.NOTICE
        yield severity, _STATES[after.state]
    if before is None:
        return
    for device, works in after.devices.items():
        if works and not before.devices.get(device, True):
            yield Severity.NOTICE, f"The {device} is there"
    if Reason.OPERATOR_STOP in before.reasons and Reason.OPERATOR_STOP not in after.reasons:
        yield Severity.NOTICE, "The operator's stop is over"
    if before.stops and not after.stops and before.state is after.state is State.RUNNING:
        yield Severity.NOTICE, "It goes on"


def blocking_notices(snapshot: Snapshot) -> Iterator[Notice]:
    """Yield the notices about conditions that hold now: reasons why the robot does not move, and warnings."""
    if snapshot.problem:
        yield Severity.CRITICAL, snapshot.problem
    is_running = snapshot.state is State.RUNNING
    for reason in snapshot.reasons:
        # Before the start, no device has reported anything yet.
        if reason in LATCHING:
            is_chosen = reason is Reason.OPERATOR_STOP
            yield Severity.WARNING if is_chosen else Severity.CRITICAL, str(reason)
        elif is_running and reason not in ORDINARY:
            yield Severity.WARNING, str(reason)
    if is_running:
        # At the end of a run, what ends it is no news.
        for stop in snapshot.stops:
            yield Severity.WARNING, f"Stopped: {stop}"
    for warning in snapshot.warnings:
        yield Severity.WARNING, str(warning)
    for device, works in snapshot.devices.items():
        if not works and snapshot.state is not State.OVER:
            yield Severity.ERROR if device is Device.DRIVE else Severity.WARNING, f"The {device} is not there"


def notice_of(entry: Entry) -> Notice | None:
    """Return the notice of an entry of the event log for a person; None: there is none."""
    match entry:
        case {"kind": "blocked", "identifier": identifier, "why": why}:
            return Severity.WARNING, f"Held back: {identifier}: {why}"
        case {"kind": "fault", "what": what}:
            return Severity.ERROR, f"Fault: {what}"
    return None
