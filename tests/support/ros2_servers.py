"""Servers of services and actions on real ROS 2 that end when a test says so, in threads of their own."""

import threading
from collections.abc import Callable
from enum import Enum
from typing import Any, Self

from support.ros2 import SERVERS_NODE, Peer
from support.waiting import wait_until

LIMIT_S = 60.0


class ServerHost:
    """A node with servers, spun by threads: their callbacks wait for the test.

    Args:
        domain: Domain id. The environment is set as a `Peer` does it, which must be there first.
    """

    def __init__(self, domain: int) -> None:
        import rclpy
        from rclpy.callback_groups import ReentrantCallbackGroup
        from rclpy.executors import MultiThreadedExecutor

        self._context = rclpy.context.Context()
        rclpy.init(context=self._context, domain_id=domain)
        self.node = rclpy.create_node(SERVERS_NODE, context=self._context)
        self.group = ReentrantCallbackGroup()
        self.gates: list[Gate] = []
        self.action_servers: list[Any] = []
        self._executor = MultiThreadedExecutor(4, context=self._context)
        self._executor.add_node(self.node)
        self._is_spinning = True
        self._thread = threading.Thread(target=self._spin)
        self._thread.start()

    def _spin(self) -> None:
        while self._is_spinning:
            self._executor.spin_once(timeout_sec=0.1)

    def gate(self) -> "Gate":
        """A gate that a server waits for; opened at the latest at the end."""
        self.gates.append(Gate())
        return self.gates[-1]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        import rclpy

        for gate in self.gates:
            gate.open(None)
        # A server that is still at work would live on, and answer the next test.
        wait_until(lambda: all(gate.is_over for gate in self.gates), "the servers' callbacks to end", LIMIT_S)
        self._is_spinning = False
        self._thread.join(LIMIT_S)
        self._executor.shutdown()
        for server in self.action_servers:
            server.destroy()
        self.node.destroy_node()
        rclpy.try_shutdown(context=self._context)


class Gate:
    """Gate that waits until a value is there; the first one counts.

    Attributes:
        is_over: True if what waited for it has done what it does then.
    """

    def __init__(self) -> None:
        self.is_over = False
        self._event = threading.Event()
        self._value: Any = None

    def open(self, value: Any) -> None:
        """Let through who waits."""
        if not self._event.is_set():
            self._value = value
            self._event.set()

    @property
    def is_open(self) -> bool:
        """True if the value is there."""
        return self._event.is_set()

    def pause(self, limit_s: float) -> None:
        """Wait for it, but not for long."""
        self._event.wait(limit_s)

    def wait(self) -> Any:
        """The value, once it is there."""
        assert self._event.wait(LIMIT_S), "the test never went on"
        return self._value


class HeldService:
    """A service that answers a call when the test says so.

    Args:
        host: Host that it runs on.
        service_class: Its type.
        name: Its name.
    """

    def __init__(self, host: ServerHost, service_class: Any, name: str) -> None:
        self.service_class = service_class
        self.requests: list[Any] = []
        self._host = host
        self._gates: list[Gate] = []
        host.node.create_service(service_class, name, self._handle, callback_group=host.group)

    def _handle(self, request: Any, response: Any) -> Any:
        gate = self._host.gate()
        self._gates.append(gate)
        self.requests.append(request)
        for field, value in (gate.wait() or {}).items():
            setattr(response, field, value)
        gate.is_over = True
        return response

    def answer(self, **fields: Any) -> None:
        """Answer the oldest call."""
        self._gates.pop(0).open(fields)


class End(Enum):
    """Way in which a server ends a goal."""

    SUCCEED = "succeed"
    ABORT = "abort"
    CANCEL = "canceled"


class HeldAction:
    """An action whose goals end when the test says so, or when they are cancelled.

    Args:
        host: Host that it runs on.
        action_class: Its type.
        name: Its name.
        accepts: True if it accepts goals.
        cancels: True if it accepts cancels.
        ends_on_cancel: True if a cancelled goal ends by itself.
    """

    def __init__(
        self,
        host: ServerHost,
        action_class: Any,
        name: str,
        *,
        accepts: bool = True,
        cancels: bool = True,
        ends_on_cancel: bool = True,
    ) -> None:
        from rclpy.action import ActionServer, CancelResponse, GoalResponse

        self.requests: list[Any] = []
        self.handles: list[Any] = []
        self.cancels = 0
        self._host = host
        self.action_class = action_class
        self._gates: list[Gate] = []
        self._ends_on_cancel = cancels and ends_on_cancel

        def decide(request: Any) -> Any:
            self.requests.append(request)
            return GoalResponse.ACCEPT if accepts else GoalResponse.REJECT

        def cancel(_: Any) -> Any:
            self.cancels += 1
            return CancelResponse.ACCEPT if cancels else CancelResponse.REJECT

        server = ActionServer(
            host.node,
            action_class,
            name,
            self._execute,
            goal_callback=decide,
            cancel_callback=cancel,
            callback_group=host.group,
        )
        host.action_servers.append(server)

    def _execute(self, handle: Any) -> Any:
        gate = self._host.gate()
        self._gates.append(gate)
        self.handles.append(handle)
        if self._ends_on_cancel:
            watcher = threading.Thread(target=self._watch, args=(handle, gate))
            watcher.start()
        end, fields = gate.wait() or (End.ABORT, {})
        getattr(handle, end.value)()
        gate.is_over = True
        return self.action_class.Result(**fields)

    def _watch(self, handle: Any, gate: Gate) -> None:
        """End a goal once its cancel is asked for: only after its server has answered that."""
        while not gate.is_open:
            if handle.is_cancel_requested:
                gate.open((End.CANCEL, {}))
            gate.pause(0.005)

    def feedback(self, **fields: Any) -> None:
        """Report how far the last goal is."""
        self.handles[-1].publish_feedback(self.action_class.Feedback(**fields))

    def is_last_over(self) -> bool:
        """Return True if the last goal has ended."""
        return bool(self._gates) and self._gates[-1].is_over

    def end(self, how: End, **fields: Any) -> None:
        """End the last goal."""
        self._gates[-1].open((how, fields))


def cancel_all(peer: Peer, action: str) -> Callable[[], object]:
    """A function that, as another client, asks the server of an action to cancel every goal."""
    from action_msgs.srv import CancelGoal

    client = peer.node.create_client(CancelGoal, f"{action}/_action/cancel_goal")
    return lambda: client.call_async(CancelGoal.Request())
