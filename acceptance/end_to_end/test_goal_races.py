"""The table of races with the clients of generated nodes on real ROS 2: servers do it before a client reads."""

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from robosc.supervisor import Supervisor
from robosc.targets.ros2.runtime.clients import ActionGoals, ServiceCalls
from robosc.targets.ros2.runtime.inquiry import Endpoints, Inquiry
from support.goal_races import RACES, ExecutorWorld, Race, driver_supervisor, run
from support.ros2 import Peer, environment, own_domain

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed")
pytest.importorskip("test_msgs", reason="test_msgs, with the only actions in a package index, is not installed")

pytestmark = pytest.mark.ros2

LIMIT_S = 20.0
QUIET_S = 0.3
"""Time without anything to read after which all that was sent has been."""


class Real(ExecutorWorld):
    """Clients and servers on nodes of their own, each spun only when it is its turn."""

    def __init__(self, supervisor: Supervisor, servers: int, peer: Peer) -> None:
        from rclpy.action import ActionClient
        from std_srvs.srv import SetBool
        from test_msgs.action import Fibonacci
        from unique_identifier_msgs.msg import UUID  # type: ignore[import-untyped]

        super().__init__(supervisor)
        self._peer = peer
        self._handles: list[Any] = []
        self._calls: list[Any] = []
        self._ends: list[str] = []
        self._made = [self._node(f"server_{number}") for number in range(servers)]
        self._servers = [self._serve(node, Fibonacci) for node, _ in self._made]
        service = self._made[0][0].create_service(SetBool, "/reach", lambda request, response: response)
        self._send_reply = service.send_response
        service.send_response = lambda *reply: self._calls.append(reply)
        self._client_node, self._client_executor = self._node("client")
        node, monotonic = self._client_node, self.clock.monotonic
        action, asked = ActionClient(node, Fibonacci, "/go"), node.create_client(SetBool, "/reach")
        ends = Endpoints(lambda: node.get_publishers_info_by_topic("/go/_action/status"), monotonic)
        replies = Endpoints(lambda: node.get_publishers_info_by_topic("rr/reachReply", no_mangle=True), monotonic)
        impl = Fibonacci.Impl
        inquiry = Inquiry(
            node.create_client(impl.CancelGoalService, "/go/_action/cancel_goal"),
            node.create_client(impl.GetResultService, "/go/_action/get_result"),
            monotonic,
        )
        timeout_s = self._executor.settings.service_timeout_s
        self.calls = ServiceCalls(asked, "/reach", self.reports, monotonic, timeout_s, replies)
        self.goals = ActionGoals(
            action, "/go", self.reports, monotonic, lambda given: UUID(uuid=list(given)), ends, inquiry
        )
        self.calls.call = lambda number, _, call=self.calls.call: call(number, SetBool.Request(data=True))
        self.goals.send = lambda number, _, send=self.goals.send: send(number, Fibonacci.Goal(order=5))

        def are_all_seen() -> bool:
            return (
                len(ends.look()) == servers
                and len(replies.look()) == 1
                and action.server_is_ready()
                and asked.service_is_ready()
                and all(node.count_subscribers("/go/_action/feedback") > 0 for node, _ in self._made)
            )

        self._until(are_all_seen, "everybody to see each other")
        # A server may see a client later than that is seen.
        self._spin(1.0)

    def _node(self, name: str) -> tuple[Any, Any]:
        import rclpy
        from rclpy.executors import SingleThreadedExecutor

        context = self._peer.node.context
        node = rclpy.create_node(name, context=context)
        executor = SingleThreadedExecutor(context=context)
        executor.add_node(node)
        return node, executor

    def _serve(self, node: Any, type_: Any) -> Any:
        from rclpy.action import ActionServer, CancelResponse

        def conclude(handle: Any) -> Any:
            getattr(handle, {"succeeded": "succeed", "aborted": "abort", "cancelled": "canceled"}[self._ends[-1]])()
            return type_.Result()

        return ActionServer(
            node,
            type_,
            "/go",
            conclude,
            handle_accepted_callback=self._handles.append,
            cancel_callback=lambda handle: CancelResponse.ACCEPT,
        )

    def _spin(self, seconds: float, *, reads: bool = True) -> None:
        executors = [executor for _, executor in self._made] + ([self._client_executor] if reads else [])
        end_s = time.monotonic() + seconds
        while time.monotonic() < end_s:
            for executor in executors:
                executor.spin_once(timeout_sec=0.01)

    def _until(self, condition: Callable[[], bool], what: str) -> None:
        end_s = time.monotonic() + LIMIT_S
        while not condition():
            assert time.monotonic() < end_s, f"waited in vain for {what}"
            self._spin(0.05, reads=False)

    def accept(self) -> None:
        self._until(lambda: len(self._handles) == len(self._servers), "the goal")

    def feedback(self) -> None:
        from test_msgs.action import Fibonacci

        self._handles[0].publish_feedback(Fibonacci.Feedback())

    def end(self, how: str) -> None:
        self._ends.append(how)
        if how == "cancelled":
            self._until(lambda: all(handle.is_cancel_requested for handle in self._handles), "the cancel")
        for handle in self._handles:
            handle.execute()
        self._until(lambda: not any(handle.is_active for handle in self._handles), "the end")
        self._spin(QUIET_S, reads=False)

    def cancel_by_another(self) -> None:
        from action_msgs.srv import CancelGoal

        other = self._peer.node.create_client(CancelGoal, "/go/_action/cancel_goal")
        self._until(other.service_is_ready, "the other client")
        other.call_async(CancelGoal.Request())

    def reply(self) -> None:
        self._until(lambda: bool(self._calls), "the call")
        self._send_reply(*self._calls.pop())

    def read(self) -> None:
        end_s = time.monotonic() + QUIET_S
        while time.monotonic() < end_s:
            self._client_executor.spin_once(timeout_sec=0.02)
            self.deliver()
            self._spin(0.02, reads=False)

    def close(self) -> None:
        """Take everything down."""
        for server in self._servers:
            server.destroy()
        for node, executor in [*self._made, (self._client_node, self._client_executor)]:
            executor.shutdown()
            node.destroy_node()


@pytest.fixture
def peer(tmp_path: Path) -> Iterator[Peer]:
    with own_domain() as domain, Peer(domain, environment(domain, tmp_path)) as made:
        yield made


@pytest.mark.parametrize("race", RACES, ids=lambda race: race.name.replace(" ", "-"))
def test_races_on_ros_2(race: Race, peer: Peer) -> None:
    world = Real(driver_supervisor("driver"), race.servers, peer)
    try:
        run(race, world)
    finally:
        world.close()
