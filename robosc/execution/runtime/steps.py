"""
Events of the environment, and the silent steps that follow them.

A state is *stable* if no silent step is enabled in it. Releases and the requirements of running
goals are checked once in each new stable state. A stable state that was left and reached again
within a batch counts as new: a second check gives the same result.
"""

from __future__ import annotations

from typing import Any, Dict, Optional, Tuple

from robosc.execution.runtime.calls import Goal, Goals
from robosc.execution.runtime.cancels import BY_SUPERVISOR, Cancels
from robosc.execution.runtime.livelock import LivelockDetector
from robosc.execution.runtime.progress import ProgressAccount
from robosc.execution.runtime.protocol import ControlledSystem, MissingData, Reading, RobotSide
from robosc.execution.runtime.recorder import Recorder
from robosc.execution.runtime.release import Releases


class ExecutionError(Exception):
    """A step that must not happen happened; it becomes a fault."""


class Steps:
    """
    Part of an executor that takes events of a controlled system.

    :param system: The controlled system.
    :param middleware: Middleware that default messages go to.
    :param recorder: Recorder of everything that happens.
    :param releases: Messages that keep acting.
    :param goals: Goals under way.
    :param cancels: Cancels of these goals.
    :param on_unknown: Meaning of an unknown enum: `default`, `keep` or `fault`.
    :param progress: Account of the strategy's progress; None where there is no strategy.
    :ivar is_decided: True if all that a decision depends on is known in this stable state.
    :ivar unchanging: Messages whose request was issued in this stable state and changed nothing:
        their data, whether it is the default, and what of it limits moved. A request's data and
        its step depend only on the state.
    """

    __slots__ = (
        '_cancels',
        '_goals',
        '_middleware',
        '_on_unknown',
        '_pending',
        '_progress',
        '_recorder',
        '_releases',
        '_stable',
        '_system',
        'is_decided',
        'unchanging',
    )

    def __init__(
        self,
        system: ControlledSystem,
        middleware: RobotSide,
        recorder: Recorder,
        releases: Releases,
        goals: Goals,
        cancels: Cancels,
        on_unknown: str,
        progress: Optional[ProgressAccount] = None,
    ) -> None:
        self._system = system
        self._middleware = middleware
        self._recorder = recorder
        self._releases = releases
        self._goals = goals
        self._cancels = cancels
        self._on_unknown = on_unknown
        self._progress = progress
        self.is_decided = False
        self.unchanging: Dict[str, Tuple[Any, bool, Tuple[str, ...]]] = {}
        # The system's `changes` in the last stable state, or None if the state may not be stable.
        self._stable: Optional[int] = None
        # A fault that waits for the end of its batch, because on_unknown is `fault`.
        self._pending: Optional[str] = None

    def restart(self) -> None:
        """Return to the initial state, which may not be stable."""
        self._system.restart()
        if self._progress is not None:
            self._progress.restart()
        self._stable = None
        self.is_decided = False
        self.unchanging.clear()
        self._pending = None

    def happen_with_data(self, event: str, data: Any, may_keep: bool = False) -> bool:
        """
        Convert data and take its event.

        :param event: An uncontrollable event.
        :param data: Received data.
        :param may_keep: True if the setting `keep` applies, as it does to messages.
        :returns: True if the event was handled; False if the data is unknown and `keep` applies.
        :raises MissingData: As `read`; then nothing has happened.
        """
        return self.happen_reading(event, self.read(event, data), may_keep)

    def read(self, event: str, data: Any) -> Reading:
        """
        Convert the data of an uncontrollable event; change nothing.

        :raises MissingData: A part is missing that cannot be unknown by its type.
        """
        try:
            return self._system.read(event, data)
        except MissingData as error:
            raise MissingData('{}: {}'.format(event, error)) from None

    def happen_reading(self, event: str, reading: Reading, may_keep: bool = False) -> bool:
        """Take an event with converted data, as `happen_with_data` does."""
        if reading.unknown:
            # A part that is read alone and with its array is reported once.
            unknown = tuple(dict.fromkeys(reading.unknown))
            self._recorder.unknown(event, unknown)
            if reading.enum_unknown:
                if may_keep and self._on_unknown == 'keep':
                    return False
                self._handle_unknown(event, unknown)
        self.happen(event, reading, reading.data)
        return True

    def happen_at_once(self, identifier: str, data: Any) -> bool:
        """
        Take all events of a message at once, if no data is unknown and no log is active.

        :returns: True if they were taken; if not, nothing has happened.
        """
        skipped = None if self._recorder.is_active else self._system.receive(identifier, data)
        if skipped is None:
            return False
        for event, variables in skipped:
            self._skip(event, variables)
        return True

    def happen(self, event: str, reading: Optional[Reading], data: Any) -> None:
        """
        Take an uncontrollable event, if the state accepts it.

        :param event: The event.
        :param reading: Its converted data, if it carries any.
        :param data: Data that the log reports for it.
        """
        skipped = self._system.step(event, reading)
        if skipped is None:
            self._recorder.unexpected({'event': event, 'data': data})
            return
        if self._recorder.is_active:
            self._recorder.event(event, False, data)
        if skipped:
            self._skip(event, skipped)

    def take(self, event: str, data: Any, is_controllable: bool = True) -> None:
        """
        Take an event that is enabled.

        :param event: The event.
        :param data: Data that the log reports for it.
        :param is_controllable: False for what somebody else decides: a caller's cancel.
        :raises ExecutionError: The state does not accept it.
        """
        skipped = self._system.step(event)
        if skipped is None:
            raise ExecutionError('{} is enabled, but the state does not accept it'.format(event))
        if self._recorder.is_active:
            self._recorder.event(event, is_controllable, data)
        if skipped:
            self._skip(event, skipped)

    def end_cancelled(self, goal: Goal) -> None:
        """
        Take the event of a running goal that its server has ended as cancelled.

        It is `error` if somebody else wanted the cancel, or if the supervisor does not allow it
        now.
        """
        cancel = goal.action + '.cancel'
        if goal.cancelled_by and self._system.enabled(cancel):
            self.take(cancel, None, goal.cancelled_by == BY_SUPERVISOR)
        else:
            self.happen(goal.action + '.error', None, 'cancelled')

    def settle(self, issuing: Optional[str] = None) -> bool:
        """
        Take silent steps until none is enabled; first ask for the cancels that are due.

        Then releases and running goals are checked, if the stable state is a new one.

        :param issuing: Communication whose request was just taken and whose message is about to go
            out, if any.
        :returns: True if the stable state may have changed.
        :raises LivelockError: The silent steps do not end.
        :raises ExecutionError: Some data was unknown, and that is a fault.
        """
        has_changed = self._system.changes != self._stable
        if has_changed:
            # Should anything raise on the way, the state does not count as stable.
            self._stable = None
            self.is_decided = False
            self.unchanging.clear()
            event = self._silent_step()
            if event is not None:
                self._run_on(event)
            self._stable = self._system.changes
            if self._progress is not None:
                self._progress.observe()
            if self._goals:
                self._goals.observe_stable_state()
            for identifier in self._releases.due(issuing):
                self.release(identifier)
        if self._pending is not None:
            pending, self._pending = self._pending, None
            raise ExecutionError(pending)
        return has_changed

    def release(self, identifier: str) -> None:
        """Send the default message on an identifier."""
        self._middleware.publish_default(identifier)
        self._releases.released(identifier)
        self._recorder.release(identifier)

    def _run_on(self, event: Optional[str]) -> None:
        """Take silent steps after the first one, `event`, until none is enabled."""
        detector = LivelockDetector(self._system.description.silent_bound)
        while event is not None:
            detector.check(self._system.signature, event)
            event = self._silent_step()

    def _silent_step(self) -> Optional[str]:
        """
        Ask for the cancels that are due, and take one silent step: resets first, then taus.

        :returns: Its event, or None if none is enabled.
        """
        if self._goals:
            self._cancels.ask_where_due()
        silent = self._system.enabled_silent()
        if silent is not None:
            self.take(silent, None)
        return silent

    def _skip(self, event: str, skipped: Tuple[str, ...]) -> None:
        """Record that updates were skipped: a fault where it was proved that none is."""
        self._recorder.unknown(event, skipped)
        self._handle_unknown(event, skipped)
        for variable in skipped:
            if (event, variable) in self._system.description.sure_updates:
                self._pending = '{} was not updated at {}'.format(variable, event)

    def _handle_unknown(self, event: str, what: Tuple[str, ...]) -> None:
        if self._on_unknown == 'fault':
            self._pending = 'unknown at {}: {}'.format(event, ', '.join(what))
