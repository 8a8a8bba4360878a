"""A loader whose drive does not stand at once: its servers, and what node and robot do, side by side."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

MODEL = Path(__file__).parents[1] / "models" / "loader" / "model.rscd"

SERVERS = ("brakes", "succeeds", "refuses", "never", "dies")
"""Servers by what they do when a cancel comes: brake for 1.5 s, end the goal in spite of it, refuse it, accept it and
never end the goal, end as a process."""

BRAKING_S = 1.5
WATCHDOG_S = 0.2
"""Time after which the motors stop without their process, in seconds."""

_SHOWN = ("event", "cancelling", "cancel_overdue", "fault", "stop")


@dataclass(frozen=True)
class Moment:
    """Act of the node or of the robot.

    Attributes:
        time_s: Time, in seconds.
        what: Words about it.
        is_robot: True if it is the robot's.
    """

    time_s: float
    what: str
    is_robot: bool


def of_node(entries: Iterable[Mapping[str, Any]]) -> list[Moment]:
    """Return what a node did, by its event log."""
    return [Moment(float(entry["time"]), _words(entry), False) for entry in entries if entry["kind"] in _SHOWN]


def _words(entry: Mapping[str, Any]) -> str:
    kind = entry["kind"]
    if kind == "event":
        data = entry["data"]
        return f"{entry['event']}{f' ({data})' if isinstance(data, str) else ''}"
    return " ".join(str(entry[name]) for name in ("kind", "action", "why", "asked_s", "what") if name in entry)


def side_by_side(moments: Iterable[Moment], begin_s: float) -> str:
    """Return what node and robot did as a table, one line a moment."""
    lines = [f"{'s':>8}  {'node':<56}  robot"]
    for moment in sorted(moments, key=lambda item: item.time_s):
        node, robot = ("", moment.what) if moment.is_robot else (moment.what, "")
        lines.append(f"{moment.time_s - begin_s:8.3f}  {node[:56]:<56}  {robot}".rstrip())
    return "\n".join(lines)


def check(moments: list[Moment], server: str, expected: str) -> None:
    """Assert that the arm moved only while the wheels stood, and that the goal ended as it should.

    Args:
        moments: All that node and robot did.
        server: Behaviour of the server.
        expected: Words of the node about the end.
    """
    turning = False
    reached = 0
    for moment in sorted(moments, key=lambda item: item.time_s):
        if moment.is_robot and moment.what.startswith("wheels"):
            turning = moment.what == "wheels turn"
        elif moment.what in ("arm moves", "reach.request"):
            reached += 1
            assert not turning, f"{moment.what} at {moment.time_s} while the wheels turn"
    said = [moment.what for moment in moments if not moment.is_robot]
    assert any(what.startswith("cancelling travel") for what in said)
    assert any(what.startswith(expected) for what in said), said
    assert (reached > 0) is (server in ("brakes", "succeeds", "dies"))


EXPECTED = {
    "brakes": "travel.cancel",
    "succeeds": "travel.response",
    "refuses": "fault",
    "never": "cancel_overdue travel",
    "dies": "travel.error (lost)",
}
"""Words of the node about the end of the goal, by the server."""
