"""
A controller for programs on asyncio: service calls and goals of the robot are coroutines.

Everything happens in the thread of one event loop. The value that a coroutine returns is a reply,
an exception is a failure, and a cancel cancels the coroutine's task.
"""

from __future__ import annotations

import asyncio
from collections import deque
from typing import Any, Awaitable, Callable, Deque, Dict, Optional, Protocol, Set, Tuple

from robosc.execution.runtime.clock import Clock, SystemClock
from robosc.execution.runtime.event_log import EventLog
from robosc.execution.runtime.executor import Executor
from robosc.execution.runtime.protocol import ControlledSystem
from robosc.execution.runtime.runner import Status
from robosc.execution.runtime.safe_stop import CANCEL_WAIT_S, describe_error
from robosc.execution.runtime.settings import Settings

WATCH_S = 0.05
"""Longest time between two readings of the clock, in seconds."""

EARLY_MESSAGES = 1000
"""Messages that are kept until the controller runs."""

Feedback = Callable[[Any], None]
"""Function to call with a goal's feedback."""


class GoalRejected(Exception):
    """A goal is not accepted; to be raised by `AsyncRobot.execute` before it does anything."""


class AsyncRobot(Protocol):
    """
    The robot, as a program on asyncio reaches it.

    Data is the model's: a dict of properties (nested dicts), a plain value, or None for the
    default of everything.
    """

    def publish(self, message: str, data: Any) -> None:
        """
        Send an incoming message of the model.

        Must not wait (`put_nowait` of a queue, `write` of a stream).
        """

    def publish_default(self, identifier: str) -> None:
        """
        Send the default message on an identifier, which ends the effect of the last one.

        Must not wait.
        """

    async def call(self, service: str, data: Any) -> Any:
        """Call a service: its response. Raising anything is its `error`."""

    async def execute(self, action: str, data: Any, feedback: Feedback) -> Any:
        """
        Carry out a goal: its result.

        :raises GoalRejected: It is not accepted.
        A cancel ends nothing before this has returned or raised: until then the action is
        executing for the model, so a robot that brakes is to be awaited.

        :raises asyncio.CancelledError: It was cancelled, as the controller wanted.
        :raises Exception: It was aborted.
        """


class AsyncController:
    """
    A supervisor that runs in an event loop.

        controller = AsyncController(Supervisor(), robot)
        running = asyncio.create_task(controller.run())
        controller.receive("/scan", scan)
        ...
        controller.stop("done")
        await running

    All methods are to be called in the event loop's thread, from another one by
    `loop.call_soon_threadsafe`, and not from within `AsyncRobot.publish`.

    :param system: Plants, requirements and supervisor with their state.
    :param robot: The robot.
    :param settings: Settings that the deployment chose; the defaults if None.
    :param clock: The only source of time; the computer's if None.
    :param log: The event log; none if None.
    :param sleep: Function that waits for some seconds of that clock.
    :ivar executor: Executor that decides; its `status`, `reasons`, `counters` and `is_faulty`
        report its condition.
    :raises DeploymentError: The model has actions and the supervisor was made for a supervision
        layer.
    :raises SettingsError: A setting is wrong, or names what the model does not have.
    """

    def __init__(
        self,
        system: ControlledSystem,
        robot: AsyncRobot,
        settings: Optional[Settings] = None,
        clock: Optional[Clock] = None,
        log: Optional[EventLog] = None,
        sleep: Callable[[float], Awaitable[Any]] = asyncio.sleep,
    ) -> None:
        self._clock: Clock = SystemClock() if clock is None else clock
        self._sleep = sleep
        self._work = _Work(robot, self._report)
        self.executor = Executor(system, self._work, settings, self._clock, log)
        self._news: Optional[asyncio.Event] = None
        self._is_ended = False
        # Data that come before the start; None afterwards.
        self._early: Optional[Deque[Tuple[str, Any]]] = deque(maxlen=EARLY_MESSAGES)

    def receive(self, identifier: str, data: Any) -> None:
        """
        Take in a message of the robot.

        Of the messages before `run` begins, the last ones are taken in when it begins.
        """
        if self._early is not None:
            self._early.append((identifier, data))
            return
        self.executor.receive(identifier, data)
        self._wake()

    def stop(self, reason: str, is_fault: bool = False) -> None:
        """Bring the robot to rest now, and end `run`: as a fault, if something is wrong."""
        self.executor.stop(reason, is_fault)
        self._is_ended = True
        self._wake()

    async def run(self) -> None:
        """
        Start, decide once a period, and end with the robot at rest.

        After `stop`, a fault, or this task's cancel.

        :raises RuntimeError: It runs already or ran before, or ends because of a fault, which the
            message names.
        """
        if self._news is not None:
            raise RuntimeError('a controller runs once')
        news = self._news = asyncio.Event()
        reason = 'cancelled'
        try:
            self._start()
            await self._decide(news)
            reason = 'stop'
        except asyncio.CancelledError:
            raise
        except Exception as error:
            self.executor.stop(describe_error(error), is_fault=True)
        finally:
            if not self.executor.reasons:
                self.executor.stop(reason)
            await self._come_to_rest(news)
        if self.executor.is_faulty:
            raise RuntimeError('; '.join(self.executor.reasons))

    def _start(self) -> None:
        """Begin in the initial state, and take in the messages that came before."""
        early, self._early = self._early, None
        if self._is_ended:
            return
        self.executor.start()
        for identifier, data in early or ():
            self.executor.receive(identifier, data)

    async def _decide(self, news: asyncio.Event) -> None:
        period_s = self.executor.settings.period_s
        next_s = self._clock.monotonic()
        while not self._is_over():
            now_s = self._clock.monotonic()
            if now_s >= next_s:
                self.executor.tick()
                # A period that was missed is not made up for.
                next_s = max(next_s + period_s, now_s)
            else:
                self.executor.watch()
            if not self._is_over():
                await self._wait(news, min(next_s - self._clock.monotonic(), WATCH_S))

    def _is_over(self) -> bool:
        return self._is_ended or self.executor.is_faulty

    async def _wait(self, news: asyncio.Event, seconds: float) -> None:
        """Wait until the time is over or something happens; other tasks run in any case."""
        news.clear()
        waiting = [
            asyncio.ensure_future(self._sleep(max(seconds, 0.0))),
            asyncio.ensure_future(news.wait()),
        ]
        try:
            await asyncio.wait(waiting, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in waiting:
                task.cancel()
        # An error of a broken `sleep` is a fault, not silence.
        if waiting[0].done() and not waiting[0].cancelled():
            waiting[0].result()

    async def _come_to_rest(self, news: asyncio.Event) -> None:
        """Give cancelled goals time to end, and abandon what is still running after that."""
        limit_s = self._clock.monotonic() + CANCEL_WAIT_S
        while self.executor.status is Status.STOPPING and self._clock.monotonic() < limit_s:
            await self._wait(news, WATCH_S)
            self.executor.watch()
        self._work.leave()

    def _report(self, report: Callable[[Executor], None]) -> None:
        """Keep a report of a coroutine for the executor."""
        report(self.executor)
        self._wake()

    def _wake(self) -> None:
        """Wake `run` up if it must end now."""
        if self._news is not None and (self._is_over() or self.executor.reasons):
            self._news.set()


class _Work:
    """
    The robot's coroutines as the middleware of an executor.

    :param robot: The robot.
    :param report: Called, never from within the executor, with the report.
    """

    def __init__(
        self, robot: AsyncRobot, report: Callable[[Callable[[Executor], None]], None]
    ) -> None:
        self._robot = robot
        self._report = report
        self._goals: Dict[int, asyncio.Future[None]] = {}
        self._tasks: Set[asyncio.Future[None]] = set()
        # Goals that were cancelled: what they do then, such as to brake, is not to be broken off.
        self._asked: Set[asyncio.Future[None]] = set()

    # The protocol `Middleware`.

    def prepare(self, communication: str, data: Any) -> Any:
        """Return the model's data, which is the message."""
        return data

    def is_default(self, communication: str, message: Any) -> bool:
        """Return True if nothing in a message differs from zero, false and the empty text."""
        return _is_default(message)

    def publish(self, communication: str, message: Any) -> None:
        """Send a message."""
        self._robot.publish(communication, message)

    def publish_default(self, identifier: str) -> None:
        """Send the default message."""
        self._robot.publish_default(identifier)

    def call(self, communication: str, request_id: int, message: Any) -> None:
        """Begin a call."""
        self._begin(self._call(communication, request_id, message))

    def send_goal(self, communication: str, goal_id: int, message: Any) -> None:
        """Begin a goal."""
        self._goals[goal_id] = self._begin(self._execute(communication, goal_id, message))

    def cancel_goal(self, communication: str, goal_id: int) -> None:
        """Cancel a goal's task."""
        task = self._goals.get(goal_id)
        if task is not None:
            self._asked.add(task)
            task.add_done_callback(self._asked.discard)
            task.cancel()

    def leave(self) -> None:
        """Cancel whatever is still under way and was not cancelled yet."""
        for task in tuple(self._tasks - self._asked):
            task.cancel()

    # Coroutines.

    def _begin(self, work: Any) -> asyncio.Future[None]:
        task: asyncio.Future[None] = asyncio.ensure_future(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return task

    async def _call(self, service: str, request_id: int, data: Any) -> None:
        try:
            reply = await self._robot.call(service, data)
        except asyncio.CancelledError:
            self._report(lambda executor: executor.on_call_failed(request_id, 'cancelled'))
        except Exception as error:
            why = describe_error(error)
            self._report(lambda executor: executor.on_call_failed(request_id, why))
        else:
            self._report(lambda executor: executor.on_reply(request_id, reply))

    async def _execute(self, action: str, goal_id: int, data: Any) -> None:
        outcome, result = 'aborted', None
        try:
            work = self._robot.execute(
                action,
                data,
                lambda news: self._report(lambda executor: executor.on_feedback(goal_id, news)),
            )
            self._report(lambda executor: executor.on_goal_accepted(goal_id))
            outcome, result = 'succeeded', await work
        except asyncio.CancelledError:
            outcome = 'cancelled'
        except GoalRejected:
            outcome = 'rejected'
        except Exception:
            outcome = 'aborted'
        self._goals.pop(goal_id, None)
        self._report(lambda executor: executor.on_goal_ended(goal_id, outcome, result))


def _is_default(data: Any) -> bool:
    """
    Return True if data of the model is all-default.

    None given, or only zero, false and the empty text.
    """
    if isinstance(data, dict):
        return all(_is_default(part) for part in data.values())
    if isinstance(data, (list, tuple)):
        return len(data) == 0
    return data is None or data in (0, '')
