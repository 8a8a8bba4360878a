"""
Services and actions of a supervision layer, which the existing controller requests.

Their replies and results come later.

The servers are those of rospy and actionlib, which call in threads of their own; every call and
goal goes through the inbox to the executor's thread. A service call of ROS 1 is a handler that
returns its reply: it waits in its own thread until the executor's thread has the reply. The
executor's thread never waits.

When the layer ends, the inbox is no longer read: later calls are answered at once.

A copy of this module stands in generated packages, which run on Python 3.8 and later.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
import threading
from typing import Any

from robosc.targets.ros.runtime.supervised import with_reason
from robosc.targets.ros1.runtime.inbox import Action

ENDED = 'the layer has ended'


class _Call:
    """A call that waits in its thread."""

    __slots__ = ('is_answered', 'response')

    def __init__(self) -> None:
        self.is_answered = threading.Event()
        self.response: Any = None


class CalledService:
    """
    The calls of one service.

    :param make_default: Makes the default response.
    :param put: Hands something to the executor's thread.
    :param on_call: Called there with the number and the message of each call; it, or something
        later, has it answered.
    """

    def __init__(
        self,
        make_default: Callable[[], Any],
        put: Callable[[Action], None],
        on_call: Callable[[int, Any], None],
    ) -> None:
        self._make_default = make_default
        self._put = put
        self._on_call = on_call
        self._lock = threading.Lock()
        self._waiting: dict[int, _Call] = {}
        self._count = 0
        self._handled = 0
        self._is_closed = False

    # Methods for the threads of rospy.

    @contextmanager
    def handling(self) -> Iterator[None]:
        """While a call is handled, until its answer was sent."""
        with self._lock:
            self._handled += 1
        try:
            yield
        finally:
            with self._lock:
                self._handled -= 1

    def handle(self, request: Any) -> Any:
        """Take in a call; return its answer. Waits for it."""
        call = _Call()
        with self._lock:
            if self._is_closed:
                return with_reason(self._make_default(), ENDED)
            self._count += 1
            number = self._count
            self._waiting[number] = call
            self._put(lambda: self._on_call(number, request))
        call.is_answered.wait()
        return call.response

    # Methods for the executor's thread.

    def answer(self, number: int, response: Any) -> None:
        """Answer a call."""
        with self._lock:
            call = self._waiting.pop(number)
        call.response = response
        call.is_answered.set()

    def answer_default(self, number: int, why: str) -> None:
        """Answer a call with the default response, and the reason in it."""
        self.answer(number, with_reason(self._make_default(), why))

    def close(self) -> None:
        """Answer every new call with the default response from now on, without a notice."""
        with self._lock:
            self._is_closed = True

    def take_leave(self) -> None:
        """Answer every call that waits with the default response."""
        for number in list(self._waiting):
            self.answer_default(number, ENDED)

    @property
    def is_busy(self) -> bool:
        """Return True if an answer has still to be sent."""
        with self._lock:
            return self._handled > 0


class ServedAction:
    """
    The goals of one action.

    :param name: The action's name on ROS, for warnings.
    :param make_default: Makes the default result.
    :param put: Hands something to the executor's thread.
    :param on_goal: Called there with the number and the message of each goal; it calls `accept`
        or `reject`.
    :param on_cancel: Called there with the number of a goal whose cancel was asked for.
    :param warn: Called with a text.
    """

    def __init__(
        self,
        name: str,
        make_default: Callable[[], Any],
        put: Callable[[Action], None],
        on_goal: Callable[[int, Any], None],
        on_cancel: Callable[[int], None],
        warn: Callable[[str], None],
    ) -> None:
        self._name = name
        self._make_default = make_default
        self._put = put
        self._on_goal = on_goal
        self._on_cancel = on_cancel
        self._warn = warn
        self._lock = threading.Lock()
        self._goals: dict[int, Any] = {}
        self._numbers: dict[str, int] = {}
        self._count = 0
        self._is_closed = False

    # Callbacks in the threads of rospy, while actionlib holds the lock of its server: the
    # executor's thread may wait for that.

    def goal_came(self, handle: Any) -> None:
        """Take in a goal, with its handle as of actionlib's `ServerGoalHandle`."""
        with self._lock:
            if not self._is_closed:
                self._put(lambda: self._judge(handle))
                return
        handle.set_rejected(with_reason(self._make_default(), ENDED), ENDED)

    def cancel_came(self, handle: Any) -> None:
        """Take in that a caller wants to cancel a goal."""
        self._put(lambda: self._cancel(handle))

    # Methods for the executor's thread.

    def _judge(self, handle: Any) -> None:
        self._count += 1
        self._goals[self._count] = handle
        self._numbers[handle.get_goal_id().id] = self._count
        self._on_goal(self._count, handle.get_goal())

    def _cancel(self, handle: Any) -> None:
        number = self._numbers.get(handle.get_goal_id().id)
        if number is not None:  # Otherwise its end is on the way.
            self._on_cancel(number)

    def accept(self, number: int) -> None:
        """Let the goal through."""
        self._try_to('acceptance', self._goals[number].set_accepted)

    def reject(self, number: int, why: str) -> None:
        """Hold the goal back; the reason is the text of its status."""
        handle = self._forgotten(number)
        result = with_reason(self._make_default(), why)
        self._try_to('rejection', lambda: handle.set_rejected(result, why))

    def feedback(self, number: int, data: Any) -> None:
        """Publish feedback on a goal."""
        handle = self._goals[number]
        self._try_to('feedback', lambda: handle.publish_feedback(data))

    def end(self, number: int, outcome: str, result: Any, why: str) -> None:
        """
        End a goal.

        `succeeded`, `aborted` or `cancelled`, with its result, or None for the default one. The
        reason is the text of its status, and stands in a default result.
        """
        handle = self._forgotten(number)
        ends = {'succeeded': handle.set_succeeded, 'cancelled': handle.set_canceled}
        end = ends.get(outcome, handle.set_aborted)
        found = with_reason(self._make_default(), why) if result is None else result
        self._try_to('end', lambda: end(found, why))

    def close(self) -> None:
        """From now on reject every new goal, without a notice."""
        with self._lock:
            self._is_closed = True

    def take_leave(self) -> None:
        """Abort every goal, for its caller waits."""
        for number in list(self._goals):
            self.end(number, 'aborted', None, ENDED)

    def _forgotten(self, number: int) -> Any:
        handle = self._goals.pop(number)
        self._numbers.pop(handle.get_goal_id().id, None)
        return handle

    def _try_to(self, what: str, on_call: Callable[[], None]) -> None:
        """
        Warn of a caller that cannot be notified: that is no fault.

        The robot is not to stop for it.
        """
        try:
            on_call()
        except Exception as error:
            self._warn(f'no {what} of a goal of {self._name}: {error}')
