"""Processes that offer an action or a service, and clients that ask all of them, as DDS has it."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

UNKNOWN_STATUS, UNKNOWN_GOAL = 0, 2


class Process:
    """A process with a server, as the middleware shows it.

    Args:
        number: Number of its endpoint.
        node: Full name of its node.

    Attributes:
        is_alive: True if it answers.
        goals: UUIDs of the goals that it knows and that have not ended.
    """

    def __init__(self, number: int, node: str = "/server") -> None:
        namespace, _, self.node_name = node.rpartition("/")
        self.node_namespace = namespace or "/"
        self.endpoint_gid = bytes([number] * 16)
        self.is_alive = True
        self.goals: set[bytes] = set()
        self.cancelled: list[bytes] = []


class Asked:
    """A client of a service of an action, whose requests every process gets, with the interface of rclpy's.

    Args:
        what: `cancel` or `result`.
        processes: Those that are asked; those that live answer, and do not where they know a goal's result later.
    """

    def __init__(self, what: str, processes: list[Process]) -> None:
        self._what = what
        self._processes = processes
        self._requests: dict[int, Callable[[Any], None]] = {}
        self._count = 0
        self.requests: list[bytes] = []
        self.status = UNKNOWN_STATUS
        self.srv_type = SimpleNamespace(Request=self._request)

    def _request(self) -> Any:
        name = SimpleNamespace(uuid=[])
        return SimpleNamespace(goal_id=name, goal_info=SimpleNamespace(goal_id=name))

    def get_pending_request(self, number: int) -> Any:
        """What rclpy calls when an answer has come."""
        return self._requests[number]

    def remove_pending_request(self, future: Any) -> None:
        """Listen to no answer of a request any more; those that come are counted all the same."""

    def call_async(self, request: Any) -> Any:
        """Ask: the answers come at once, to who listens then."""
        self._count += 1
        number, uuid = self._count, bytes(request.goal_id.uuid)
        self.requests.append(uuid)
        answering = [process for process in self._processes if process.is_alive]
        if self._what == "result":
            answering = [process for process in answering if uuid not in process.goals]
        else:
            for process in answering:
                if uuid in process.goals:
                    process.cancelled.append(uuid)

        def answered(callback: Callable[[Any], None]) -> None:
            self._requests[number] = callback
            for process in answering:
                self.get_pending_request(number)
                if process is answering[0]:
                    callback(SimpleNamespace(result=lambda: SimpleNamespace(status=self.status)))

        return SimpleNamespace(add_done_callback=answered)
