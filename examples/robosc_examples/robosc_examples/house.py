"""Door, tray and battery around the courier, without ROS: what they do on command, and when.

The twin has a body, wheels and a LiDAR; whatever else is around a courier is here. A door opens late, somebody takes
what is in the tray a while after it is offered, and the battery drains away from the dock and is charged there.
"""

import math
from dataclasses import dataclass

OPEN_DOOR, CLOSE_DOOR, UNLOCK, LOCK = "/door/open", "/door/close", "/tray/unlock", "/tray/lock"
OPENED, LID_CLOSED = "/door/opened", "/tray/closed"
COMMANDS = (OPEN_DOOR, CLOSE_DOOR, UNLOCK, LOCK)
"""Topics of the commands to a house."""

REPORTED = (OPENED, LID_CLOSED)
"""Topics of what a house reports."""

FULL_V, EMPTY_V = 12.5, 11.2
"""Voltages between which the battery is charged and drained."""

_DOCK_M = 0.35


@dataclass(frozen=True)
class Settings:
    """Settings of a house.

    Attributes:
        opens_after_s: Time from the command to an open door, in seconds; infinite: it never is.
        takes_s: Time until somebody has taken what is in the tray and closed its lid, in seconds.
        drain_v_s: Voltage that the battery loses in a second away from the dock.
        charge_v_s: Voltage that it gains in a second at the dock.
    """

    opens_after_s: float = 6.0
    takes_s: float = 5.0
    drain_v_s: float = 0.008
    charge_v_s: float = 0.08


class House:
    """A door, a tray and a battery, by a time that is given.

    Args:
        settings: Their settings.

    Attributes:
        is_door_open: True if one can go through the door.
        battery_v: Voltage of the battery.
    """

    def __init__(self, settings: Settings | None = None) -> None:
        self.settings = settings or Settings()
        self.is_door_open = False
        self.battery_v = FULL_V
        self._now_s: float | None = None
        self._due: list[tuple[float, str]] = []

    def receive(self, topic: str) -> None:
        """Take what the courier says on one of `COMMANDS`; it takes effect with time."""
        settings, now_s = self.settings, self._now_s or 0.0
        match topic:
            case "/door/open":
                self._due.append((now_s + settings.opens_after_s, OPENED))
            case "/door/close":
                self.is_door_open = False
                self._due = [item for item in self._due if item[1] != OPENED]
            case "/tray/unlock":
                self._due.append((now_s + settings.takes_s, LID_CLOSED))

    def advance(self, now_s: float, x_m: float, y_m: float) -> list[str]:
        """Live until now.

        Args:
            now_s: Time, in seconds; never less than before.
            x_m: x of the courier, in metres from its dock.
            y_m: y of the same.

        Returns:
            Topics of `REPORTED` on which something is reported.
        """
        passed_s = 0.0 if self._now_s is None else now_s - self._now_s
        self._now_s = now_s
        is_docked = math.hypot(x_m, y_m) < _DOCK_M
        change_v_s = self.settings.charge_v_s if is_docked else -self.settings.drain_v_s
        self.battery_v = min(max(self.battery_v + change_v_s * passed_s, EMPTY_V), FULL_V)
        reported = [topic for due_s, topic in sorted(self._due) if due_s <= now_s]
        self._due = [(due_s, topic) for due_s, topic in self._due if due_s > now_s]
        self.is_door_open = self.is_door_open or OPENED in reported
        return reported
