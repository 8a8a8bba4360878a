"""Judges a run: the controller's event log against the requirement, the robot's speed against the clock."""

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from scenario import HAPPENINGS, REACTION_LIMIT_S, Happening

NEEDED = {"LineDetector": "line_found", "LidarSensor": "safe", "EmergencyStop": "in_service"}
"""The states in which `move` is allowed."""

Entry = Mapping[str, Any]


def read_lines(path: Path) -> list[Entry]:
    """The entries of a JSON Lines file."""
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


def judge_log(entries: Sequence[Entry]) -> list[str]:
    """Return the faults in the event log: every `move` must have been requested in an allowed state."""
    faults = []
    state: Mapping[str, Any] = {}
    moves = 0
    for number, entry in enumerate(entries, start=1):
        if entry.get("event") == "move.request" and entry["kind"] == "event":
            moves += 1
            wrong = [f"{c} is {_state(state, c)}" for c, needed in NEEDED.items() if _state(state, c) != needed]
            if wrong:
                faults.append(f"log line {number}: move although {' and '.join(wrong)}")
        if entry["kind"] in ("fault", "unexpected", "unknown"):
            faults.append(f"log line {number}: {entry}")
        state = entry.get("state") or state
    return faults if moves else ["the log has no move at all", *faults]


def _state(state: Mapping[str, Any], component: str) -> str:
    return str(state.get(component, {}).get("state", "unknown"))


def judge_motion(record: Sequence[Entry], happenings: Iterable[Happening] = HAPPENINGS) -> tuple[list[str], list[str]]:
    """Return the faults of the robot's motion, and how fast it came to rest: (faults, remarks).

    For each happening that forbids moving: the robot moved before it, its speed and every command are zero
    from the reaction limit on until the happening that ends it, and afterwards it moves again.
    """
    times = {entry["happening"]: float(entry["time_s"]) for entry in record if "happening" in entry}
    samples = [(float(entry["time_s"]), float(entry["speed_m_s"])) for entry in record if "speed_m_s" in entry]
    commands = [(float(entry["time_s"]), float(entry["command_m_s"])) for entry in record if "command_m_s" in entry]
    faults, remarks = [], []
    for happening in happenings:
        if not happening.forbids_moving:
            continue
        if happening.name not in times or happening.ended_by not in times:
            faults.append(f"{happening.name}: did not take place")
            continue
        begin_s, end_s = times[happening.name], times[happening.ended_by]
        before = [speed for time_s, speed in samples if begin_s - 0.5 <= time_s < begin_s]
        if not before or min(before) <= 0.0:
            faults.append(f"{happening.name}: the robot was not driving before it")
        moving = [time_s for time_s, speed in samples if begin_s <= time_s < end_s and speed != 0.0]
        rest_s = (max(moving) - begin_s) if moving else 0.0
        if rest_s > REACTION_LIMIT_S:
            faults.append(f"{happening.name}: the robot still moved after {rest_s * 1000:.0f} ms")
        else:
            remarks.append(f"{happening.name}: at rest after {rest_s * 1000:.0f} ms")
        if any(command != 0.0 for time_s, command in commands if begin_s + REACTION_LIMIT_S <= time_s < end_s):
            faults.append(f"{happening.name}: a command to drive came more than {REACTION_LIMIT_S:.1f} s later")
        if not any(speed > 0.0 for time_s, speed in samples if end_s <= time_s < end_s + 1.0):
            faults.append(f"{happening.ended_by}: the robot did not move again")
    return faults, remarks


def table(entries: Sequence[Entry]) -> str:
    """The sequence of events for people: a paragraph for each stretch in one state, its events with their counts."""
    header = ["time/s", "event", "", "times", "state after it"]
    paragraphs: list[dict[tuple[str, str], list[str]]] = []
    begin_s = None
    state: dict[str, str] = {}
    shown = ""
    for entry in entries:
        if entry["kind"] not in ("event", "release", "fault", "unexpected", "unknown"):
            continue
        begin_s = float(entry["time"]) if begin_s is None else begin_s
        state |= {name: value["state"] for name, value in (entry.get("state") or {}).items()}
        now = ", ".join(f"{component}.{value}" for component, value in state.items() if component in NEEDED)
        if now != shown or not paragraphs:
            paragraphs.append({})
        side = {True: "controllable", False: "uncontrollable", None: str(entry["kind"])}[entry.get("controllable")]
        name = str(entry.get("event") or entry.get("identifier") or entry["kind"])
        time_s = f"{float(entry['time']) - begin_s:6.2f}"
        row = paragraphs[-1].setdefault((name, side), [time_s, name, side, "0", "" if paragraphs[-1] else now])
        row[3] = str(int(row[3]) + 1)
        shown = now
    rows = [header, *(row for paragraph in paragraphs for row in paragraph.values())]
    widths = [max(len(row[column]) for row in rows) for column in range(len(header))]
    return "\n".join(
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows
    )
