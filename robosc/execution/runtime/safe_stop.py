"""
Safe stop of the robot.

It sends default messages on release identifiers, and cancels goals.
"""

from __future__ import annotations

from typing import Dict, List, Tuple

from robosc.execution.runtime.calls import Goals
from robosc.execution.runtime.cancels import BY_NONE, Cancels
from robosc.execution.runtime.protocol import RobotSide
from robosc.execution.runtime.release import Releases

CANCEL_WAIT_S = 0.5


def describe_error(error: BaseException) -> str:
    """Return an exception in words."""
    try:
        text = str(error)
    except Exception:
        text = ''
    return '{}: {}'.format(type(error).__name__, text) if text else type(error).__name__


class SafeStop:
    """
    The reasons why an executor has stopped, and the actions of its safe stop.

    :param middleware: Middleware that sends default messages.
    :param releases: The release identifiers.
    :param goals: Goals under way.
    :param cancels: Cancels of these goals.
    :ivar reasons: Reasons in words, by a key; while there is one, no request is issued.
    :ivar awaited_until_s: Time until which the goals' ends are awaited, in seconds.
    :ivar unsent: Release identifiers whose default message could not be sent so far.
    """

    __slots__ = (
        '_cancels',
        '_goals',
        '_middleware',
        '_releases',
        'awaited_until_s',
        'reasons',
        'unsent',
    )

    def __init__(
        self, middleware: RobotSide, releases: Releases, goals: Goals, cancels: Cancels
    ) -> None:
        self._middleware = middleware
        self._releases = releases
        self._goals = goals
        self._cancels = cancels
        self.reasons: Dict[str, str] = {}
        self.awaited_until_s = 0.0
        self.unsent: Tuple[str, ...] = ()

    def stop(self, now_s: float) -> List[str]:
        """Send every default message, cancel every goal; return what failed. Never raises."""
        self.unsent = self._releases.identifiers
        for goal in self._goals.open_goals():
            self._cancels.decide(goal, 'stop', BY_NONE)
        self.awaited_until_s = now_s + CANCEL_WAIT_S
        failures = self.retry()
        self._releases.clear()
        return failures

    def retry(self) -> List[str]:
        """
        Send the default messages and cancels that are still owed; return what failed.

        Never raises.
        """
        failures: List[str] = []
        owed: List[str] = []
        for identifier in self.unsent:
            try:
                self._middleware.publish_default(identifier)
            except Exception as error:
                owed.append(identifier)
                failures.append(
                    'the default message on {} failed: {}'.format(
                        identifier, describe_error(error)
                    )
                )
        self.unsent = tuple(owed)
        for goal in self._goals.open_goals():
            try:
                self._cancels.send(goal)
            except Exception as error:
                failures.append(
                    'cancel of {} failed: {}'.format(goal.action, describe_error(error))
                )
        return failures

    def is_awaiting(self, now_s: float) -> bool:
        """Return True if some goals have not ended and their time to end is not over."""
        return bool(self._goals) and now_s < self.awaited_until_s
