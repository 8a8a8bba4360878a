"""The operator's stop and resume, from buttons, keys and calls: to the safety layer first, then to the model."""

from collections.abc import Callable, Collection

from robosc_bridge.configuration.channels import EmergencyStopChannel
from robosc_bridge.daemon.executor_inputs import Listeners, Supervised
from robosc_bridge.skills import EmergencyStop, StopEvent

STOP_HELD = "a button that stops the robot is pressed"
"""Reason why nothing can go on."""


class StopSwitch:
    """Stop switch of the operator, for commands from any source.

    Args:
        skill: Skill that interprets buttons, keys and calls.
        listeners: Identifiers that each kind of channel reports to.
        on_stop: Function that is called when the operator stops the robot, before the model gets the message.
        on_resume: Function that is called when the operator lets the robot go on; returns the reason why it cannot, or
            an empty text.
    """

    def __init__(
        self, skill: EmergencyStop, listeners: Listeners, on_stop: Callable[[], None], on_resume: Callable[[], str]
    ) -> None:
        self._skill = skill
        self._listeners = listeners
        self._on_stop = on_stop
        self._on_resume = on_resume

    @property
    def is_stopped(self) -> bool:
        """True if the operator has stopped the robot, and not let it go on since."""
        return self._skill.is_stopped

    @property
    def is_held(self) -> bool:
        """True if a button that stops the robot is pressed."""
        return self._skill.is_held

    def on_buttons(self, held: Collection[str], executor: Supervised | None) -> None:
        """Take the buttons that are pressed now."""
        self._take(self._skill.update(held_buttons=held), executor)

    def on_key(self, key: str, executor: Supervised | None) -> None:
        """Handle a key that was typed in the terminal."""
        self._take(self._skill.update(keys=(key,)), executor)

    def stop(self, executor: Supervised | None) -> None:
        """Stop the robot on a call of a remote operator."""
        self._take(self._skill.update(remote=StopEvent.STOP), executor)

    def resume(self, executor: Supervised | None) -> str:
        """Let the robot continue on a call of a remote operator; return why it cannot, or an empty text."""
        if not self._skill.is_stopped:
            return "no operator has stopped the robot"
        event = self._skill.update(remote=StopEvent.RESUME)
        return STOP_HELD if event is None else self._take(event, executor)

    def begin(self, executor: Supervised) -> None:
        """Begin a new run, in which an earlier stop still holds."""
        if self._skill.is_stopped:
            self._report(StopEvent.STOP, executor)

    def reset(self) -> None:
        """Reset all stops."""
        self._skill.is_stopped = False

    def _take(self, event: StopEvent | None, executor: Supervised | None) -> str:
        """The operator did something; why it has no effect."""
        if event is StopEvent.STOP:
            self._on_stop()
        why = self._on_resume() if event is StopEvent.RESUME else ""
        if why:
            self._skill.is_stopped = True
        elif executor is not None and event is not None:
            self._report(event, executor)
        return why

    def _report(self, event: StopEvent, executor: Supervised) -> None:
        for identifier, channel in self._listeners.of(EmergencyStopChannel):
            if channel.event == event:
                executor.receive(identifier, None)
