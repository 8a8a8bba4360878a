"""
Cancels of goals.

To ask for a cancel ends nothing: for the model a goal is executing until its end is known. Its
server is asked once, as soon as it has accepted the goal.
"""

from __future__ import annotations

from typing import Callable, List, Tuple

from robosc.execution.runtime.calls import FOREVER, Goal, Goals
from robosc.execution.runtime.protocol import RobotSide
from robosc.execution.runtime.recorder import Recorder

BY_SUPERVISOR = 'supervisor'
"""A requirement of the running action turned."""

BY_CALLER = 'caller'
"""The existing controller of a supervision layer asked for it."""

BY_NONE = ''
"""Time is over, or the robot comes to rest: no event of the model, which sees an error."""


class Cancels:
    """
    Asks servers for cancels, and reports those that take too long.

    :param middleware: Middleware that cancels go to.
    :param recorder: Recorder of what is asked for.
    :param goals: Goals under way.
    :param timeout_s: Seconds after which a goal that has not ended is reported; 0: never.
    :ivar wake: Called with the reading of the clock at which a goal is to be reported.
    """

    __slots__ = ('_goals', '_middleware', '_recorder', '_timeout_s', 'wake')

    def __init__(
        self, middleware: RobotSide, recorder: Recorder, goals: Goals, timeout_s: float
    ) -> None:
        self._middleware = middleware
        self._recorder = recorder
        self._goals = goals
        self._timeout_s = timeout_s or FOREVER
        self.wake: Callable[[float], None] = lambda due_s: None

    def ask_where_due(self) -> None:
        """Ask for the cancel of each running goal of which a requirement turned."""
        for goal, fallen in self._goals.turned():
            self.ask(goal, _sentence(fallen), BY_SUPERVISOR)

    def ask(self, goal: Goal, why: str, by: str) -> None:
        """
        Decide on the cancel of a goal, and ask for it; not a second time.

        :param goal: A goal whose end is not known.
        :param why: The reason, for the log.
        :param by: `supervisor`, `caller`, or the empty text.
        """
        self.decide(goal, why, by)
        self.send(goal)

    def decide(self, goal: Goal, why: str, by: str) -> None:
        """Decide on the cancel of a goal; the caller of this sends it. Never raises."""
        # A cancel that the caller asks for is an event of the model even if the robot came to
        # rest first.
        goal.cancelled_by = goal.cancelled_by or by
        if goal.is_cancelling:
            return
        goal.is_cancelling = True
        goal.asked_s = self._recorder.began_s
        self._recorder.cancelling(goal.action, why)
        self.wake(self._due_s(goal))

    def send(self, goal: Goal) -> None:
        """Send a cancel that was decided, once; before the goal's acceptance it is remembered."""
        if goal.is_cancelling and goal.is_accepted and not goal.is_cancel_sent:
            self._middleware.cancel_goal(goal.action, goal.number)
            goal.is_cancel_sent = True

    def report_overdue(self, now_s: float) -> None:
        """Report each goal that should have ended by now, once."""
        for goal in self._awaited():
            if now_s >= self._due_s(goal):
                goal.is_overdue = True
                self._recorder.cancel_overdue(goal.action, now_s - goal.asked_s)

    def deadline_s(self) -> float:
        """Return the reading of the clock, in seconds, at which the next goal is reported."""
        return min((self._due_s(goal) for goal in self._awaited()), default=FOREVER)

    def cancelling(self) -> Tuple[str, ...]:
        """Return the actions with a goal that is being cancelled, in source order."""
        return tuple([goal.action for goal in self._goals.open_goals() if goal.is_cancelling])

    def overdue(self) -> Tuple[str, ...]:
        """Return those of them whose goal should have ended by now."""
        return tuple([goal.action for goal in self._goals.open_goals() if goal.is_overdue])

    def _awaited(self) -> List[Goal]:
        return [
            goal for goal in self._goals.open_goals() if goal.is_cancelling and not goal.is_overdue
        ]

    def _due_s(self, goal: Goal) -> float:
        return goal.asked_s + self._timeout_s


def _sentence(fallen: Tuple[int, ...]) -> str:
    numbers = ', '.join(map(str, fallen))
    if len(fallen) == 1:
        return 'requirement {} no longer holds'.format(numbers)
    return 'requirements {} no longer hold'.format(numbers)
