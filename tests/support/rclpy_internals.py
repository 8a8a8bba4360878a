"""Trials of what generated ROS 2 nodes in Python need of rclpy beside its documented interface, one function for each.

    python rclpy_internals.py NAME

Each is called like what it tries, and fails if that is no longer as the nodes need it. The Python may be of any
distribution: nothing but rclpy and test_msgs is imported.
"""

import sys
from collections.abc import Callable
from typing import Any

import rclpy
from lifecycle_msgs.srv import ChangeState
from rclpy.action import ActionClient, ActionServer, CancelResponse, GoalResponse
from rclpy.executors import SingleThreadedExecutor, TimeoutException
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn
from rclpy.node import Node
from std_srvs.srv import SetBool
from test_msgs.action import Fibonacci

ROUNDS = 2000


def spun(*nodes: Any, until: Callable[[], bool]) -> None:
    """Spin nodes until a condition holds."""
    executor = nodes[0].executor or SingleThreadedExecutor()
    for node in nodes:
        executor.add_node(node)
    for _ in range(ROUNDS):
        if until():
            return
        executor.spin_once(timeout_sec=0.02)
    raise AssertionError("waited in vain")


def _service_change_state() -> None:
    """A lifecycle node has the service of its transitions there, whose `callback` may be replaced."""

    class Managed(LifecycleNode):  # type: ignore[misc]  # it has no types everywhere
        def __init__(self) -> None:
            super().__init__("managed")
            self.asked: list[Any] = []
            service: Any = self._service_change_state
            self._change = service.callback
            service.callback = self._change_if_possible

        def _change_if_possible(self, request: Any, response: Any) -> Any:
            self.asked.append(request.transition.id)
            return self._change(request, response)

        def on_configure(self, state: Any) -> TransitionCallbackReturn:
            return TransitionCallbackReturn.SUCCESS

    node, other = Managed(), Node("manager")
    client = other.create_client(ChangeState, "/managed/change_state")
    spun(node, other, until=client.service_is_ready)
    request = ChangeState.Request()
    request.transition.id = 1
    future = client.call_async(request)
    spun(node, other, until=future.done)
    assert future.result().success
    assert node.asked == [1]


def send_response() -> None:
    """The executor answers with the attribute `send_response` of a service: replaced, what is returned is held back."""
    node, other = Node("server"), Node("client")
    promise = object()
    service: Any = node.create_service(SetBool, "power", lambda request, response: promise)
    send, held = service.send_response, list[Any]()
    service.send_response = lambda response, header: held.append((response, header))
    client = other.create_client(SetBool, "power")
    spun(node, other, until=client.service_is_ready)
    future = client.call_async(SetBool.Request(data=True))
    spun(node, other, until=lambda: bool(held))
    ((response, header),) = held
    assert response is promise
    assert not future.done()
    send(SetBool.Response(success=True, message="late"), header)
    spun(node, other, until=future.done)
    assert future.result().message == "late"


def _feedback_callbacks() -> None:
    """An action client has the feedback callbacks of its goals there, by the bytes of their UUIDs, and keeps those of
    rejected goals."""
    node, other = Node("server"), Node("client")
    server: Any = ActionServer(
        node, Fibonacci, "count", lambda handle: Fibonacci.Result(), goal_callback=lambda goal: GoalResponse.REJECT
    )
    client: Any = ActionClient(other, Fibonacci, "count")
    spun(node, other, until=client.server_is_ready)
    future = client.send_goal_async(Fibonacci.Goal(order=1), lambda message: None)
    spun(node, other, until=future.done)
    handle = future.result()
    assert not handle.accepted
    kept = client._feedback_callbacks
    assert bytes(handle.goal_id.uuid) in kept
    kept.pop(bytes(handle.goal_id.uuid))
    assert not client._feedback_callbacks
    server.destroy()


def _parameter_overrides() -> None:
    """A node has there what it was given, also for parameters that it never declares."""
    node: Any = Node("given", cli_args=["--ros-args", "-p", "speed:=0.5", "-p", "sped:=0.5"])
    node.declare_parameter("speed", 1.0)
    assert {"speed", "sped"} <= set(node._parameter_overrides)
    assert not node.has_parameter("sped")


def notify_execute() -> None:
    """An action server has a function end a goal with it, and calls it itself without one as a goal begins."""
    begun, handles = list[Any](), list[Any]()

    class Server(ActionServer):  # type: ignore[misc]  # as nodes have it
        def notify_execute(self, goal_handle: Any, execute_callback: Any) -> None:
            begun.append(execute_callback)
            if execute_callback is not None:
                super().notify_execute(goal_handle, execute_callback)

    def accept(handle: Any) -> None:
        handle.execute()
        handles.append(handle)

    node, other = Node("server"), Node("client")
    server: Any = Server(
        node,
        Fibonacci,
        "count",
        execute_callback=accept,
        handle_accepted_callback=accept,
        cancel_callback=lambda handle: CancelResponse.ACCEPT,
    )
    client: Any = ActionClient(other, Fibonacci, "count")
    spun(node, other, until=client.server_is_ready)
    future = client.send_goal_async(Fibonacci.Goal(order=1))
    spun(node, other, until=lambda: future.done() and bool(handles))
    result = future.result().get_result_async()

    def end(handle: Any) -> Any:
        handle.succeed()
        return Fibonacci.Result(sequence=[1, 2])

    server.notify_execute(handles[0], end)
    spun(node, other, until=result.done)
    assert list(result.result().result.sequence) == [1, 2]
    assert begun == [None, end]
    server.destroy()


def wait_for_ready_callbacks() -> None:
    """An executor gives the task of what is ready, and the entity that it belongs to, without running it."""
    node, ran = Node("ticking"), list[str]()
    timer = node.create_timer(0.001, lambda: ran.append("timer"))
    executor: Any = SingleThreadedExecutor()
    executor.add_node(node)
    for _ in range(ROUNDS):
        try:
            task, entity, _ = executor.wait_for_ready_callbacks(timeout_sec=0.02)
        except TimeoutException:
            continue
        if entity is timer:
            break
    assert entity is timer
    assert ran == []
    task()
    assert task.exception() is None
    assert ran == ["timer"]
    executor.shutdown()


if __name__ == "__main__":
    rclpy.init()
    globals()[sys.argv[1]]()
    rclpy.shutdown()
    print("as the nodes need it")
