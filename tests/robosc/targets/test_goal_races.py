"""The table of races, with the clients of generated nodes on scripted middleware; real ones have it in acceptance."""

import threading
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

from robosc.supervisor import Supervisor
from robosc.targets.ros1.runtime.goals import ACTIVE, DONE, PREEMPTED, PREEMPTING, SUCCEEDED, WAITING_FOR_RESULT
from robosc.targets.ros1.runtime.goals import ActionGoals as Ros1Goals
from robosc.targets.ros1.runtime.inbox import Inbox
from robosc.targets.ros1.runtime.services import ServiceCalls as Ros1Calls
from robosc.targets.ros2.runtime.clients import ActionGoals, ServiceCalls
from robosc.targets.ros2.runtime.inquiry import Endpoints, Inquiry
from support.action_servers import Asked, Process
from support.goal_races import RACES, ExecutorWorld, Race, driver_supervisor, run

LIMIT_S = 20.0


class Future:
    """A future of rclpy, which is done when its client reads."""

    def __init__(self) -> None:
        self._callbacks: list[Callable[[Any], None]] = []
        self._result: Any = None

    def add_done_callback(self, callback: Callable[[Any], None]) -> None:
        self._callbacks.append(callback)

    def exception(self) -> None:
        return None

    def result(self) -> Any:
        return self._result

    def done(self, result: Any) -> None:
        # The first answer counts; rclpy has forgotten the request by the second.
        callbacks, self._callbacks = self._callbacks, []
        self._result = result
        for callback in callbacks:
            callback(self)


class Ros2(ExecutorWorld):
    """The clients for ROS 2; what comes is read in the order of rclpy: goals, cancels, results, feedback."""

    def __init__(self, supervisor: Supervisor, servers: int) -> None:
        super().__init__(supervisor)
        self._servers = servers
        self._come: list[tuple[int, Callable[[], None]]] = []
        self._sent = Future()
        self._cancelled = Future()
        self._result = Future()
        self._called = Future()
        self._results: list[Any] = []
        self._is_asked_for_result = False
        self._feedback: Callable[[Any], None]
        shown = [Process(number) for number in range(servers)]
        ends = Endpoints(lambda: shown, self.clock.monotonic)
        client: Any = SimpleNamespace(
            service_is_ready=lambda: True,
            server_is_ready=lambda: True,
            call_async=lambda message: self._called,
            remove_pending_request=lambda future: None,
            send_goal_async=self._send,
        )
        monotonic = self.clock.monotonic
        timeout_s = self._executor.settings.service_timeout_s
        self.calls = ServiceCalls(client, "/reach", self.reports, monotonic, timeout_s, ends)
        inquiry = Inquiry(Asked("cancel", shown), Asked("result", shown), monotonic)
        self.goals = ActionGoals(client, "/go", self.reports, monotonic, bytes, ends, inquiry)

    def _send(self, message: Any, feedback_callback: Callable[[Any], None], goal_uuid: bytes) -> Future:
        self._feedback = feedback_callback
        return self._sent

    def _get_result(self) -> Future:
        self._is_asked_for_result = True
        for answer in self._results:
            self._come.append((2, lambda answer=answer: self._result.done(answer)))  # type: ignore[misc]
        return self._result

    def _ask_to_cancel(self) -> Future:
        answer = SimpleNamespace(goals_canceling=[] if self._results else ["it"], return_code=3 if self._results else 0)
        self._come.append((1, lambda: self._cancelled.done(answer)))
        return self._cancelled

    def accept(self) -> None:
        handle = SimpleNamespace(
            accepted=True,
            goal_id=SimpleNamespace(uuid=b"0" * 16),
            status=2,
            get_result_async=self._get_result,
            cancel_goal_async=self._ask_to_cancel,
        )
        for _ in range(self._servers):
            self._come.append((0, lambda: self._sent.done(handle)))

    def feedback(self) -> None:
        self._come.append((3, lambda: self._feedback(SimpleNamespace(feedback=SimpleNamespace(sequence=[])))))

    def end(self, how: str) -> None:
        answer = SimpleNamespace(status={"succeeded": 4, "cancelled": 5, "aborted": 6}[how], result=None)
        for _ in range(self._servers):
            self._results.append(answer)
            if self._is_asked_for_result:
                self._come.append((2, lambda: self._result.done(answer)))

    def cancel_by_another(self) -> None:
        """This client hears nothing of it."""

    def reply(self) -> None:
        self._come.append((0, lambda: self._called.done({"success": True, "message": ""})))

    def read(self) -> None:
        while self._come:
            come, self._come = sorted(self._come, key=lambda item: item[0]), []
            for _, take in come:
                take()
            self.deliver()


class Ros1(ExecutorWorld):
    """The clients for ROS 1, whose goals are told of by status messages, results and feedback."""

    def __init__(self, supervisor: Supervisor, servers: int) -> None:
        super().__init__(supervisor)
        self._servers = servers
        self._inbox = Inbox({"feedback of /go": 10})
        self._come: list[tuple[int, Callable[[], None]]] = []
        self._replied = threading.Event()
        self._threads = 0
        self.last_status_msg: Any = None
        self.calls = Ros1Calls("/reach", lambda: self._connection, self._put, self.reports)
        self.goals = Ros1Goals(self, lambda: True, dict, "/go", self._inbox.put, self.reports, self.clock.monotonic)

    # The connection of a call, in a thread of its own.

    @property
    def _connection(self) -> Any:
        self._threads += 1

        class Connection:
            def __call__(connection, message: Any) -> Any:  # noqa: N805
                assert self._replied.wait(LIMIT_S)
                return {"success": True, "message": ""}

            def close(connection) -> None:  # noqa: N805
                """Close nothing."""

        return Connection()

    def _put(self, action: Callable[[], None]) -> None:
        self._inbox.put(action)

    # The client of actionlib.

    def send_goal(self, message: Any, transition: Any, feedback: Any) -> Any:
        self._transition, self._feed = transition, feedback
        self._handle = SimpleNamespace(state=0, status=0)
        self._handle.get_comm_state = lambda: self._handle.state
        self._handle.get_goal_status = lambda: self._handle.status
        self._handle.get_result = lambda: None
        self._handle.cancel = self._ask_to_cancel
        return self._handle

    def _ask_to_cancel(self) -> None:
        if self._handle.state != DONE:
            self._come.append((1, lambda: self._change(PREEMPTING, 6)))

    def _change(self, *changes: int) -> None:
        """Tell of a state and a status, unless the goal has ended as actionlib sees it."""
        if self._handle.state != DONE:
            self._handle.state, self._handle.status = changes
            self._transition(self._handle)

    def accept(self) -> None:
        for _ in range(self._servers):
            self._come.append((0, lambda: self._change(ACTIVE, ACTIVE)))

    def feedback(self) -> None:
        self._come.append((3, lambda: self._feed(self._handle, None)))

    def end(self, how: str) -> None:
        status = {"succeeded": SUCCEEDED, "cancelled": PREEMPTED, "aborted": 4}[how]
        for _ in range(self._servers):
            self._come.append((2, lambda: self._change(WAITING_FOR_RESULT, status)))
            self._come.append((2, lambda: self._change(DONE, status)))

    def cancel_by_another(self) -> None:
        self._come.append((1, lambda: self._change(PREEMPTING, 6)))

    def reply(self) -> None:
        self._replied.set()

    def read(self) -> None:
        if self._replied.is_set() and self._threads:
            self._threads = 0
            for action in self._inbox.take(LIMIT_S):
                action()
        while self._come:
            come, self._come = sorted(self._come, key=lambda item: item[0]), []
            for _, take in come:
                take()
            for action in self._inbox.take(0.0):
                action()
            self.deliver()
        self.deliver()


@pytest.mark.parametrize("race", RACES, ids=lambda race: race.name.replace(" ", "-"))
@pytest.mark.parametrize(("world", "model"), [(Ros2, "driver"), (Ros1, "driver_ros1")])
def test_races(race: Race, world: Callable[[Supervisor, int], ExecutorWorld], model: str) -> None:
    run(race, world(driver_supervisor(model), race.servers))
