"""Service calls and goals that are under way."""

from __future__ import annotations

from typing import Any, Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple

from robosc.execution.runtime.falling_conditions import held_ever, the_fallen
from robosc.execution.runtime.protocol import ControlledSystem, RobotSide

FOREVER = float('inf')

OUTCOMES = ('succeeded', 'rejected', 'aborted', 'cancelled', 'lost')
"""
Outcomes of a goal.

With a result, refused by its server, given up by it, cancelled, or its server is gone.
"""


class Call(NamedTuple):
    """
    A service call without a reply so far.

    :ivar service: Name of the service.
    :ivar deadline_s: Reading of the clock at which it counts as failed.
    :ivar is_left: True if the model started again without it.
    """

    service: str
    deadline_s: float
    is_left: bool = False


class Calls:
    """Service calls under way, by id."""

    __slots__ = ('_calls', '_next_id', '_timeout_s')

    def __init__(self, timeout_s: Optional[float]) -> None:
        self._timeout_s = FOREVER if timeout_s is None else timeout_s
        self._calls: Dict[int, Call] = {}
        self._next_id = 1

    def call(self, robot: RobotSide, service: str, message: Any, now_s: float) -> int:
        """
        Call a service: the id of the new call.

        Nothing is awaited from a call that could not be made.
        """
        number = self._next_id
        self._next_id += 1
        self._calls[number] = Call(service, now_s + self._timeout_s)
        try:
            robot.call(service, number, message)
        except Exception:
            self.close(number)
            raise
        return number

    def close(self, number: int) -> Optional[Call]:
        """End a call; return it, or None if no such call is under way."""
        return self._calls.pop(number, None)

    def find(self, number: int) -> Optional[str]:
        """Return the service of a call; None if the model waits for no such call."""
        call = self._calls.get(number)
        return None if call is None or call.is_left else call.service

    def expired(self, now_s: float) -> List[int]:
        """Ids of the calls whose time is over."""
        return [number for number, call in self._calls.items() if now_s >= call.deadline_s]

    def deadline_s(self) -> float:
        """Return the reading of the clock, in seconds, at which the next call is over its time."""
        return min((call.deadline_s for call in self._calls.values()), default=FOREVER)

    def leave_model(self) -> None:
        """Let the model start again without its calls; their end is still awaited."""
        self._calls = {number: call._replace(is_left=True) for number, call in self._calls.items()}

    def left(self) -> Tuple[str, ...]:
        """Return the services with a call from before the model started again."""
        return tuple([call.service for call in self._calls.values() if call.is_left])


class Goal:
    """
    A goal whose end is not known so far.

    :ivar number: Its id.
    :ivar action: Name of the action.
    :ivar is_running: True if the model's action executes it; no longer after its time was over or
        after a restart.
    :ivar is_left: True if the model started again without it.
    :ivar is_accepted: True if its server accepted it.
    :ivar is_cancelling: True if its cancel was decided.
    :ivar cancelled_by: The one whose cancel is an event of the model when the goal has ended:
        `supervisor` or `caller`; empty: nobody so far.
    :ivar asked_s: Reading of the clock when its cancel was decided.
    :ivar is_cancel_sent: True if its server was asked to cancel it.
    :ivar is_overdue: True if it was reported that it has not ended in time after that.
    :ivar deadline_s: Reading of the clock at which it counts as failed, if nobody cancels it.
    :ivar held: Values for the requirements of the action: True if one held in a stable state since
        the request.
    """

    __slots__ = (
        'action',
        'asked_s',
        'cancelled_by',
        'deadline_s',
        'held',
        'is_accepted',
        'is_cancel_sent',
        'is_cancelling',
        'is_left',
        'is_overdue',
        'is_running',
        'number',
    )

    def __init__(
        self, number: int, action: str, deadline_s: float, held: Tuple[bool, ...]
    ) -> None:
        self.number = number
        self.action = action
        self.is_running = True
        self.is_left = False
        self.is_accepted = False
        self.is_cancelling = False
        self.cancelled_by = ''
        self.asked_s = 0.0
        self.is_cancel_sent = False
        self.is_overdue = False
        self.deadline_s = deadline_s
        self.held = held

    @property
    def time_is_over_s(self) -> float:
        """
        Return the reading of the clock at which it fails unless it has ended; never may be.

        A goal that is being cancelled does not fail: it may still move the robot.
        """
        return self.deadline_s if self.is_running and not self.is_cancelling else FOREVER


class Goals:
    """
    Goals under way, by id; at most one of an action.

    :param system: The system, which decides which requirements hold.
    :param actions: Names of the actions, in source order.
    :param timeout_s: Seconds until a goal counts as failed, or None.
    """

    __slots__ = ('_actions', '_goals', '_next_id', '_system', '_timeout_s')

    def __init__(
        self, system: ControlledSystem, actions: Sequence[str], timeout_s: Optional[float]
    ) -> None:
        self._system = system
        self._actions = tuple(actions)
        self._timeout_s = FOREVER if timeout_s is None else timeout_s
        self._goals: Dict[int, Goal] = {}
        self._next_id = 1

    def __bool__(self) -> bool:
        return bool(self._goals)

    def send(self, robot: RobotSide, action: str, message: Any, now_s: float) -> Goal:
        """
        Send a new goal; the system is in the stable state after its request.

        Nothing is awaited from a goal that could not be sent.
        """
        goal = Goal(
            self._next_id, action, now_s + self._timeout_s, self._system.requirements(action)
        )
        self._next_id += 1
        goals = [*self._goals.values(), goal]
        self._goals = {
            item.number: item
            for item in sorted(goals, key=lambda g: self._actions.index(g.action))
        }
        try:
            robot.send_goal(action, goal.number, message)
        except Exception:
            self.close(goal.number)
            raise
        return goal

    def find(self, number: int) -> Optional[Goal]:
        """Return the goal with an id, if its end is not known."""
        return self._goals.get(number)

    def close(self, number: int) -> Optional[Goal]:
        """Note the end of a goal; return the goal, or None if there is none with that id."""
        return self._goals.pop(number, None)

    def is_open(self, action: str) -> bool:
        """Return True if a goal of an action may still be under way."""
        return any(goal.action == action for goal in self._goals.values())

    def open_goals(self) -> List[Goal]:
        """Return every goal, in source order of the actions."""
        return list(self._goals.values())

    def expired(self, now_s: float) -> Iterator[Goal]:
        """
        Yield running goals whose time is over.

        Each is looked at when its turn comes: what was done about one may cancel the next.
        """
        return (goal for goal in self.open_goals() if now_s >= goal.time_is_over_s)

    def deadline_s(self) -> float:
        """Return the reading of the clock, in seconds, at which the next goal is over its time."""
        return min((goal.time_is_over_s for goal in self._goals.values()), default=FOREVER)

    def turned(self) -> List[Tuple[Goal, Tuple[int, ...]]]:
        """
        Return goals whose cancel is due: a requirement that held since the request has turned.

        A requirement that the request itself made false never held since, and cancels nothing.

        :returns: Each goal with the numbers, from 1, of the action's requirements that turned.
        """
        found = []
        for goal in self._goals.values():
            if goal.is_running and not goal.is_cancelling and any(goal.held):
                fallen = the_fallen(goal.held, self._system.requirements(goal.action))
                if fallen:
                    found.append((goal, fallen))
        return found

    def observe_stable_state(self) -> None:
        """Remember which requirements of the running goals hold."""
        for goal in self._goals.values():
            if goal.is_running:
                goal.held = held_ever(goal.held, self._system.requirements(goal.action))

    def leave_model(self) -> None:
        """Let the model start again without its goals; their end is still awaited."""
        for goal in self._goals.values():
            goal.is_running = False
            goal.is_left = True

    def left(self) -> Tuple[str, ...]:
        """Return the actions with a goal from before the model started again, in source order."""
        return tuple([goal.action for goal in self._goals.values() if goal.is_left])
