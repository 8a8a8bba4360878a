"""
Service calls in threads of their own.

A call of ROS 1 waits for its reply, but the executor must not wait.

Each call has a connection and a thread, which end with it. The number of calls that never end is
bounded. The result of a call goes through the inbox to the executor's thread.

A copy of this module stands in generated packages, which run on Python 3.8 and later.
"""

from __future__ import annotations

from collections.abc import Callable
import threading
from typing import Any

from robosc.targets.ros.runtime.reports import Reports
from robosc.targets.ros1.runtime.inbox import Action

MAXIMUM_PENDING = 16
"""Calls of one service whose reply is still listened for, so that a late one is noticed."""

MAXIMUM_THREADS = 2 * MAXIMUM_PENDING
"""Threads of one service; one that is connecting cannot be ended before that has failed."""


class ServiceCalls:
    """
    The calls of one service; its methods are for the executor's thread.

    :param name: The service's name on ROS.
    :param connect: Function that makes a connection for one call: `connection(message)` waits for
        the reply and raises an exception where there is none; `connection.close()`, from another
        thread, makes it raise.
    :param put: Function that hands something to the executor's thread.
    :param reports: Reports that take the replies.
    """

    def __init__(
        self,
        name: str,
        connect: Callable[[], Any],
        put: Callable[[Action], None],
        reports: Reports,
    ) -> None:
        self.name = name
        self.is_found = False
        self._connect = connect
        self._put = put
        self._reports = reports
        self._calls: dict[int, Any] = {}
        self._threads = 0

    def call(self, request_id: int, message: Any) -> None:
        """Call it without waiting. Nobody may change the message any more."""
        if self._threads >= MAXIMUM_THREADS:
            self._fail(request_id, f'{self._threads} calls of {self.name} have not ended')
            return
        if len(self._calls) >= MAXIMUM_PENDING:
            self._calls.pop(next(iter(self._calls))).close()
        connection = self._connect()
        self._calls[request_id] = connection
        self._threads += 1
        # A daemon: a server that never answers must not keep the process from ending.
        threading.Thread(
            target=self._work,
            args=(request_id, connection, message),
            name=f'call of {self.name}',
            daemon=True,
        ).start()

    def _work(self, request_id: int, connection: Any, message: Any) -> None:
        reply, reason = None, None
        try:
            reply = connection(message)
        except Exception as error:
            reason = str(error) or type(error).__name__
        self._put(lambda: self._ended(request_id, connection, reply, reason))

    def _ended(self, request_id: int, connection: Any, reply: Any, reason: str | None) -> None:
        self._threads -= 1
        connection.close()
        if self._calls.pop(request_id, None) is None:
            return  # It was given up.
        if reason is not None:
            self._fail(request_id, f'the call of {self.name} failed: {reason}')
        else:
            self._reports.add(lambda executor: executor.on_reply(request_id, reply))

    def _fail(self, request_id: int, reason: str) -> None:
        self._reports.add(lambda executor: executor.on_call_failed(request_id, reason))
