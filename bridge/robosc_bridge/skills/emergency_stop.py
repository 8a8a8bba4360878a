"""The operator's stop and resume: from buttons, keys and remote calls to two events.

A stop always wins, and holds as long as a button is pressed. A resume needs a new press of a button, while no stop
button is pressed.
"""

from collections.abc import Collection
from enum import StrEnum

from robosc_bridge.skills.settings import EmergencyStopSettings


class StopEvent(StrEnum):
    """Action of the operator."""

    STOP = "stop"
    RESUME = "resume"


class EmergencyStop:
    """State of the operator's stop: whether the operator has stopped the robot.

    Attributes:
        is_stopped: True since a stop, until the operator lets it go on.

    Args:
        settings: Keys and buttons that stop, and those that let it go on.
    """

    def __init__(self, settings: EmergencyStopSettings) -> None:
        self.is_stopped = False
        self._settings = settings
        self._stopping: frozenset[str] = frozenset()
        # Held until shown otherwise: a button that jams before the start lets nothing go on.
        self._resuming = frozenset(settings.resume_buttons)

    @property
    def is_held(self) -> bool:
        """True if a stop button is pressed."""
        return bool(self._stopping)

    def update(
        self,
        held_buttons: Collection[str] | None = None,
        keys: Collection[str] = (),
        remote: StopEvent | None = None,
    ) -> StopEvent | None:
        """Return the event that the model receives now.

        Args:
            held_buttons: Names of the drive's buttons that are pressed; None: unknown, the last ones count.
            keys: Keys that were typed since the last call.
            remote: Event that came over the network since the last call; if both came, the stop.

        Returns:
            A stop at each new press, also while the robot is stopped, since the first one may have been missed. A
                resume once, when a stop ends.
        """
        settings = self._settings
        stopping, resuming = self._stopping, self._resuming
        if held_buttons is not None:
            stopping = frozenset(settings.stop_buttons).intersection(held_buttons)
            resuming = frozenset(settings.resume_buttons).intersection(held_buttons)
        is_typed = any(key in settings.stop_keys for key in keys) or remote is StopEvent.STOP
        is_pressed = is_typed or bool(stopping - self._stopping)
        is_resumed = (
            bool(resuming - self._resuming)
            or any(key in settings.resume_keys for key in keys)
            or remote is StopEvent.RESUME
        )
        self._stopping, self._resuming = stopping, resuming
        if is_pressed:
            self.is_stopped = True
            return StopEvent.STOP
        if self.is_stopped and is_resumed and not stopping:
            self.is_stopped = False
            return StopEvent.RESUME
        return None
