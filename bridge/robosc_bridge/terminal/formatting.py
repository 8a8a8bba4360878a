"""Reports of the bridge, as lines for a person."""

import math
import time
from collections.abc import Iterator, Mapping
from typing import Any

from robosc_bridge.terminal.client import (
    DriveState,
    MissionStanding,
    Snapshot,
    Standing,
    StrategyProgress,
    WatchResponse,
    events_of,
    state_name,
)

STALE_S = 2.0
"""A snapshot that is older comes from a loop that hangs."""

_MARKED = ("blocked", "fault", "owed", "cancel_overdue")
_WORDS = ("event", "identifier", "action", "what")
_SHOWN_APART = ("time", "kind", "state", "controllable", "decision_us")


def status_lines(snapshot: Snapshot) -> Iterator[str]:
    """Yield the status of the bridge, one fact a line."""
    yield printable(state_name(snapshot) + (f": {snapshot.problem}" if snapshot.problem else ""))
    if snapshot.age_s > STALE_S:
        yield f"  this is {snapshot.age_s:.1f} s old: the bridge's loop hangs"
    for reason in snapshot.reasons:
        yield printable(f"  nothing moves: {reason.text}" + (" (until reset)" if reason.holds_until_reset else ""))
    for warning in snapshot.warnings:
        yield printable(f"  warning: {warning.text}")
    for text in snapshot.stops:
        yield printable(f"  nothing is requested: {text}")
    for device in snapshot.devices:
        yield printable(f"  {device.name}: {'works' if device.works else 'is not there'}")
    if snapshot.HasField("drive"):
        yield from map(printable, _drive_lines(snapshot.drive))
    if snapshot.overruns:
        yield f"  decisions left out: {snapshot.overruns}"
    for latency in snapshot.latencies:
        if latency.count:
            milliseconds = (1e3 * time_s for time_s in (latency.p50_s, latency.p99_s, latency.max_s))
            figures = "p50 {:.1f} ms, p99 {:.1f} ms, at most {:.1f} ms".format(*milliseconds)
            yield printable(f"  {latency.name.replace('_', ' ')}: {figures}")
    for line in snapshot.lines:
        words = ", ".join(f"{name.replace('_', ' ')} {count}" for name, count in sorted(line.counts.items()))
        yield printable(f"  line of the {line.device}: {words}")
    width = max((len(item.name) for item in snapshot.components), default=0)
    for item in snapshot.components:
        variables = " ".join(f"{name}={_word(value)}" for name, value in sorted(item.variables.items()))
        yield printable(f"  {item.name:{width}}  {item.state} {variables}".rstrip())
    for action in snapshot.cancelling:
        mark = "warning: " if action in snapshot.overdue_cancels else ""
        yield printable(f"  {mark}the goal of {action} is being cancelled and has not ended")
    if snapshot.HasField("progress"):
        yield from map(printable, _progress_lines(snapshot.progress))
    if snapshot.enabled:
        yield printable(f"  allowed now: {', '.join(snapshot.enabled)}")


def _drive_lines(drive: DriveState) -> Iterator[str]:
    known = []
    if drive.HasField("battery_v"):
        known.append(f"{drive.battery_v:.1f} V")
    if drive.HasField("battery_share"):
        known.append(f"{100.0 * drive.battery_share:.0f} %")
    yield f"  battery: {', '.join(known) or 'not known'}"
    yield f"  motors: {'hold' if drive.is_torque_on else 'do not hold'}"
    for fault in drive.faults:
        yield f"  motor fault: {fault}"
    pose, velocity = drive.pose, drive.velocity
    yield f"  at x {pose.x_m:.2f} m, y {pose.y_m:.2f} m, heading {math.degrees(pose.heading_rad):.0f} degrees"
    yield f"  moves at {velocity.linear_m_s:.2f} m/s, {velocity.angular_rad_s:.2f} rad/s"


def _progress_lines(progress: StrategyProgress) -> Iterator[str]:
    for mission in progress.missions:
        yield f"  mission {mission.name}: {mission_text(mission, progress)}"
    for aim in progress.aims:
        turn = ", approached now" if aim.name == progress.approached else ""
        yield f"  {aim.name}: {standing_text(aim)}{turn}, reached {aim.times} times: {aim.words}"
    if progress.is_followed:
        yield f"  the strategy {f'requests {progress.chosen}' if progress.chosen else 'waits'}"
    for item in progress.assumptions:
        if item.HasField("unmet_s"):
            mark = "warning: " if item.name in progress.overdue else ""
            yield f"  {mark}{owed_text(item)}"


def standing_text(item: Standing) -> str:
    """Return the state of a goal, a visit or an assumption, in words."""
    if item.HasField("unmet_s"):
        return f"{'wanted' if item.mission else 'not yet,'} for {item.unmet_s:.0f} s"
    if item.mission:
        return "made in this round" if item.is_met else "not wanted now"
    return "true" if item.is_met else "not known"


def mission_text(mission: MissionStanding, progress: StrategyProgress) -> str:
    """Return where a mission is, and how many rounds were made, in words."""
    words = {aim.name: aim.words for aim in progress.aims}

    def at(visit: int, title: str) -> str:
        return f"at visit {visit}, {words.get(f'visit {visit} of {title}', '')}"

    title = f"mission {mission.name}"
    parts = ["every visit is true" if mission.is_round else at(mission.visit, title)]
    parts += [
        f"detour {number} under way, {at(visit, f'detour {number} of {title}')}"
        for number, visit in enumerate(mission.detours, start=1)
        if visit
    ]
    where = "; ".join(parts) if mission.visit else "not asked for"
    return f"{where}; rounds made: {mission.rounds}"


def owed_text(item: Standing) -> str:
    """Return in words for how long an assumption has been owed."""
    return f"{item.name} has been owed for {item.unmet_s:.0f} s: {item.words}"


class Lines:
    """Lines for a watcher: one for each event, and one for each change of the bridge's state."""

    def __init__(self) -> None:
        self._before: tuple[Any, ...] = ()

    def of(self, response: WatchResponse) -> Iterator[str]:
        """Yield lines for the news in a response."""
        if response.lost_events:
            yield f"{_clock(time.time())} ! {response.lost_events} events were lost: they came too quickly"
        for entry in events_of(response):
            # The snapshot shows the state of the bridge, with the reasons why the wheels stand still.
            if entry.get("kind") != "state":
                yield event_line(entry)
        if response.HasField("snapshot"):
            yield from self._changes(response.snapshot)

    def _changes(self, snapshot: Snapshot) -> Iterator[str]:
        is_stale = snapshot.age_s > STALE_S
        now = (snapshot.state, snapshot.problem, tuple(item.text for item in snapshot.reasons), is_stale)
        if now == self._before:
            return
        self._before = now
        at = _clock(time.time())
        why = "; ".join([snapshot.problem] * bool(snapshot.problem) + [item.text for item in snapshot.reasons])
        yield printable(f"{at} = {state_name(snapshot)}{': ' if why else ''}{why}")
        if is_stale:
            yield f"{at} ! the bridge's loop hangs"


def event_line(entry: Mapping[str, Any]) -> str:
    """Return a line for an entry of the event log: time, a mark if it was held back or failed, kind, subject."""
    kind = str(entry.get("kind"))
    words = [_word(entry[name]) for name in _WORDS if name in entry]
    rest = {name: value for name, value in entry.items() if name not in (*_SHOWN_APART, *_WORDS)}
    words += [f"{name}={_word(value)}" for name, value in sorted(rest.items()) if value not in (None, {}, [])]
    time_s = entry.get("time")
    at = _clock(time_s if isinstance(time_s, float) else 0.0)
    return printable(f"{at} {'!' if kind in _MARKED else ' '} {kind:10} {' '.join(words)}".rstrip())


def _clock(time_s: float) -> str:
    return f"{time.strftime('%H:%M:%S', time.localtime(time_s))}.{int(time_s % 1.0 * 1000.0):03d}"


def _word(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def printable(text: str) -> str:
    """Return a line without control sequences for a terminal."""
    return "".join(sign if sign.isprintable() else "?" for sign in text)
