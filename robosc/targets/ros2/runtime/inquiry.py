"""
Whose endpoints serve a name, and whether a server that lives knows a goal.

A process that was killed stays visible until its lease ends, 20 s by default, while another one
may have taken its name. Two living servers of one name look the same. So the servers are asked:
each that lives answers the cancel of a goal that nobody has, and each that does not know the goal
in question says so at once when asked for its result. If all that live do not know it, whoever
knew it is gone.

rclpy hands over the first answer to a request only: here every answer is counted.

A copy of this module stands in generated packages, which run on Python 3.8 and later.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

LOOK_S = 0.2
"""Endpoints are looked at once in so long."""

ROUND_S = 0.25
"""Time between two questions about a goal."""

MEMORY_S = 2.0
"""Answers that are older are forgotten."""

CERTAIN_S = 1.2
"""All servers must have said for so long that they do not know a goal: one may be slow."""

_UNKNOWN_NODE = '_NODE_NAME_UNKNOWN_'
_UNKNOWN_STATUS = 0


class Endpoints:
    """
    Endpoints of the servers of one name.

    :param look: Function that returns what the middleware shows: objects with `endpoint_gid`,
        `node_name` and `node_namespace`; it may raise where the middleware shows nothing.
    :param monotonic: A steady clock.
    """

    def __init__(self, look: Callable[[], Iterable[Any]], monotonic: Callable[[], float]) -> None:
        self._look = look
        self._monotonic = monotonic
        self._looked_s = float('-inf')
        self._seen: dict[bytes, str] = {}

    def look(self) -> Mapping[bytes, str]:
        """Return the node of each endpoint, empty if it is not known."""
        self._looked_s = self._monotonic()
        try:
            self._seen = {bytes(item.endpoint_gid): node_of(item) for item in self._look()}
        except Exception:
            # A middleware that shows none: servers are missed as a whole only.
            self._seen = {}
        return self._seen

    def seen(self) -> Mapping[bytes, str]:
        """Return the same, not older than `LOOK_S`."""
        is_old = self._monotonic() >= self._looked_s + LOOK_S
        return self.look() if is_old else self._seen

    def nodes(self) -> list[str]:
        """Return the names of their nodes, in order; one that is not known is 'a node'."""
        return sorted(name or 'a node' for name in self.seen().values())


def node_of(item: Any) -> str:
    """Return the full name of the node of an endpoint; empty if it is not known."""
    if item.node_name == _UNKNOWN_NODE:
        return ''
    return f'{item.node_namespace.rstrip("/")}/{item.node_name}'


class _Counted:
    """Answers to the requests of a client, by the number of the request."""

    def __init__(self, client: Any, monotonic: Callable[[], float]) -> None:
        self._client = client
        self._monotonic = monotonic
        self._answers: dict[int, tuple[int, float]] = {}
        self._future: Any = None
        self._find = client.get_pending_request
        # Called once for every answer that comes, whoever gives it.
        client.get_pending_request = self._came

    def ask(self, request: Any, answered: Callable[[Any], None] = lambda answer: None) -> None:
        """Send a request, instead of the one before."""
        if self._future is not None:
            self._client.remove_pending_request(self._future)
        self._future = self._client.call_async(request)
        self._future.add_done_callback(lambda done: answered(done.result()))

    def _came(self, number: int) -> Any:
        count, _ = self._answers.get(number, (0, 0.0))
        self._answers[number] = (count + 1, self._monotonic())
        return self._find(number)

    def most(self) -> int:
        """Return the largest number of answers to one request that came lately."""
        oldest_s = self._monotonic() - MEMORY_S
        self._answers = {
            number: item for number, item in self._answers.items() if item[1] >= oldest_s
        }
        return max((count for count, _ in self._answers.values()), default=0)

    def forget(self) -> None:
        """Forget the answers so far."""
        self._answers.clear()


class Inquiry:
    """
    Questions to the servers of one action about a goal.

    :param cancels: A client of the action's service `cancel_goal`, of its own.
    :param results: A client of the action's service `get_result`, of its own.
    :param monotonic: A steady clock.
    """

    def __init__(self, cancels: Any, results: Any, monotonic: Callable[[], float]) -> None:
        self._cancel_type = cancels.srv_type
        self._result_type = results.srv_type
        self._living = _Counted(cancels, monotonic)
        self._ignorant = _Counted(results, monotonic)
        self._monotonic = monotonic
        self._goal: bytes | None = None
        self._asked_s = 0.0
        self._denied_s: float | None = None

    def is_unknown(self, goal: bytes) -> bool:
        """
        Ask on; return True if no server that lives knows a goal; to be called again and again.

        :param goal: Its UUID.
        """
        now_s = self._monotonic()
        if goal != self._goal:
            self.end()
            self._goal, self._asked_s = goal, float('-inf')
        if now_s >= self._asked_s + ROUND_S:
            self._asked_s = now_s
            self._ask(goal)
        living, ignorant = self._living.most(), self._ignorant.most()
        if not 0 < living <= ignorant:
            self._denied_s = None
        elif self._denied_s is None:
            self._denied_s = now_s
        return self._denied_s is not None and now_s >= self._denied_s + CERTAIN_S

    def _ask(self, goal: bytes) -> None:
        nobodys = self._cancel_type.Request()
        # The complement of a goal's UUID is that of no goal.
        nobodys.goal_info.goal_id.uuid = [255 - byte for byte in goal]
        self._living.ask(nobodys)
        result = self._result_type.Request()
        result.goal_id.uuid = list(goal)
        self._ignorant.ask(result, self._heard)

    def _heard(self, answer: Any) -> None:
        if answer.status != _UNKNOWN_STATUS:
            # Its end is known to a server, and on the way.
            self._ignorant.forget()

    def cancel(self, goal: bytes) -> None:
        """Ask for the cancel of a goal that need not be accepted, and await no answer."""
        request = self._cancel_type.Request()
        request.goal_info.goal_id.uuid = list(goal)
        self._living.ask(request)

    def end(self) -> None:
        """Nothing is asked any more."""
        self._goal = self._denied_s = None
        self._living.forget()
        self._ignorant.forget()
