"""
Services and actions of a supervision layer, which the existing controller requests.

Their replies and results come later.

The servers are parameters with the interface of rclpy's `Service`, `ActionServer` and
`ServerGoalHandle`. Everything runs in the node's one thread, and nothing there waits: rclpy's
executor would resume a waiting coroutine again and again, without a pause, until the reply comes.

A caller that is gone cannot be notified. This is a warning and no fault, because the robot must
not stop for it.

A copy of this module stands in generated packages, which run on Python 3.8 and later.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from robosc.targets.ros.runtime.supervised import with_reason

ENDED = 'the layer has ended'


class _Call:
    """
    A call without an answer so far.

    What addresses the answer, or the answer that came before that is known.
    """

    __slots__ = ('header', 'number', 'response')

    def __init__(self, number: int) -> None:
        self.number = number
        self.header: Any = None
        self.response: Any = None


class CalledService:
    """
    The calls of one service.

    :param name: The service's name on ROS, for warnings.
    :param make_default: Makes the default response.
    :param on_call: Called with the number and the message of each call.
    :param warn: Called with a text.
    """

    def __init__(
        self,
        name: str,
        make_default: Callable[[], Any],
        on_call: Callable[[int, Any], None],
        warn: Callable[[str], None],
    ) -> None:
        self._name = name
        self._make_default = make_default
        self._on_call = on_call
        self._warn = warn
        self._calls: dict[int, _Call] = {}
        self._count = 0
        self._send: Callable[[Any, Any], None]

    def attach(self, service: Any) -> None:
        """
        Send through a service, whose callback is `handle`.

        :param service: Has `send_response`, called with what `handle` returned and with what
            addresses the answer.
        """
        self._send = service.send_response
        service.send_response = self._respond

    def handle(self, request: Any, _: Any) -> Any:
        """Take in a call; return its answer, or a promise of one."""
        self._count += 1
        call = self._calls[self._count] = _Call(self._count)
        self._on_call(call.number, request)
        return call if call.response is None else call.response

    def _respond(self, response: Any, header: Any) -> None:
        if isinstance(response, _Call):
            response.header = header
        else:
            self._send_to(header, response)

    def answer(self, number: int, response: Any) -> None:
        """Answer a call."""
        call = self._calls.pop(number)
        if call.header is None:
            call.response = response
        else:
            self._send_to(call.header, response)

    def answer_default(self, number: int, why: str) -> None:
        """Answer a call with the default response, and the reason in it."""
        self.answer(number, with_reason(self._make_default(), why))

    def take_leave(self) -> None:
        """Answer every call with the default response, for its caller waits."""
        for number in list(self._calls):
            self.answer_default(number, ENDED)

    def _send_to(self, header: Any, response: Any) -> None:
        try:
            self._send(response, header)
        except Exception as error:
            self._warn(f'no answer to a call of {self._name}: {error}')


class _Goal:
    """
    A goal that was accepted.

    :ivar handle: Handle by which rclpy refers to it, once it is known.
    :ivar end: Outcome, result and reason, if they came before that.
    """

    __slots__ = ('end', 'handle')

    def __init__(self) -> None:
        self.handle: Any = None
        self.end: tuple[str, Any, str] | None = None


class ServedAction:
    """
    The goals of one action.

    :param name: The action's name on ROS, for warnings.
    :param make_default: Makes the default result.
    :param on_goal: Called with the number and the message of each goal; `accept` is called
        meanwhile, or not.
    :param on_cancel: Called with the number of a goal whose cancel was asked for.
    :param warn: Called with a text.
    """

    def __init__(
        self,
        name: str,
        make_default: Callable[[], Any],
        on_goal: Callable[[int, Any], None],
        on_cancel: Callable[[int], None],
        warn: Callable[[str], None],
    ) -> None:
        self._name = name
        self._make_default = make_default
        self._on_goal = on_goal
        self._on_cancel = on_cancel
        self._warn = warn
        self._goals: dict[int, _Goal] = {}
        self._numbers: dict[bytes, int] = {}
        self._count = 0
        self._beginning: int | None = None
        self._ending = 0
        self._server: Any = None

    def attach(self, server: Any) -> None:
        """
        Serve through a server, whose callbacks are `decide`, `begin` and `cancel`.

        :param server: Has `notify_execute`, which has a function end a goal.
        """
        self._server = server

    # Callbacks of the server.

    def decide(self, message: Any) -> bool:
        """Take in a goal; return True if it is accepted."""
        self._count += 1
        number = self._count
        self._on_goal(number, message)
        if number not in self._goals:
            return False
        self._beginning = number
        return True

    def begin(self, handle: Any) -> None:
        """Note that the goal that was just accepted has got its handle."""
        number, self._beginning = self._beginning, None
        if number is None or number not in self._goals:
            return
        goal = self._goals[number]
        goal.handle = handle
        self._numbers[bytes(handle.goal_id.uuid)] = number
        handle.execute()
        if goal.end is not None:
            self.end(number, *goal.end)

    def cancel(self, handle: Any) -> bool:
        """Take in that a caller wants to cancel a goal; return whether that is about to happen."""
        number = self._numbers.get(bytes(handle.goal_id.uuid))
        if number is None:
            return False  # Its end is on the way.
        self._on_cancel(number)
        return True

    def check(self) -> None:
        """
        Cancel a goal whose caller was gone before it could learn that it is accepted.

        Nobody else would.
        """
        number, self._beginning = self._beginning, None
        if number is not None:
            del self._goals[number]
            self._warn(f'a goal of {self._name} is cancelled: its caller is gone')
            self._on_cancel(number)

    # Reports of the layer.

    def accept(self, number: int) -> None:
        """Let the goal through."""
        self._goals[number] = _Goal()

    def feedback(self, number: int, data: Any) -> None:
        """Publish feedback on a goal."""
        goal = self._goals.get(number)
        if goal is None or goal.handle is None:
            return
        try:
            goal.handle.publish_feedback(data)
        except Exception as error:
            self._warn(f'no feedback of a goal of {self._name}: {error}')

    def end(self, number: int, outcome: str, result: Any, why: str) -> None:
        """
        End a goal.

        `succeeded`, `aborted` or `cancelled`, with its result, or None for the default one, in
        which the reason stands.
        """
        goal = self._goals.get(number)
        if goal is None:
            return  # Its caller was gone.
        if goal.handle is None:
            goal.end = (outcome, result, why)
            return
        del self._goals[number]
        del self._numbers[bytes(goal.handle.goal_id.uuid)]
        self._ending += 1
        self._server.notify_execute(
            goal.handle, lambda handle: self._conclude(handle, outcome, result, why)
        )

    def _conclude(self, handle: Any, outcome: str, result: Any, why: str) -> Any:
        """End a goal: its result."""
        self._ending -= 1
        if outcome == 'succeeded':
            handle.succeed()
        elif outcome == 'cancelled':
            handle.canceled()
        else:
            handle.abort()
        return with_reason(self._make_default(), why) if result is None else result

    def take_leave(self) -> None:
        """Abort every goal, for its caller waits."""
        for number in list(self._goals):
            self.end(number, 'aborted', None, ENDED)

    @property
    def is_ending(self) -> bool:
        """Return True if the end of a goal has still to be reported."""
        return self._ending > 0
