"""
Messages that come before the executor starts.

They are held, and taken in before the first decision.

A node waits for its servers before its executor starts, and an executor ignores earlier messages.
But a stop button that is pressed meanwhile must not be forgotten.

A copy of this module stands in generated packages, which run on Python 3.8 and later.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from typing import Any

from robosc.execution.runtime.protocol import MissingData
from robosc.execution.runtime.runner import Runner
from robosc.execution.runtime.safe_stop import describe_error


class HeldMessages:
    """
    Messages that came too early.

    Of each topic the last ones, as many as its subscription would keep.

    :param depths: Maximum number of messages, by identifier.
    """

    def __init__(self, depths: Mapping[str, int]) -> None:
        self._count = 0
        self._held: dict[str, deque[tuple[int, str, Any, float]]] = {
            identifier: deque(maxlen=depth) for identifier, depth in depths.items()
        }

    def hold(self, identifier: str, message: Any, now_s: float) -> None:
        """Keep a message that came now."""
        self._count += 1
        self._held[identifier].append((self._count, identifier, message, now_s))

    def take(self) -> list[tuple[str, Any, float]]:
        """Return identifier, message and time of each that is kept, in order of arrival."""
        held = sorted(
            (entry for entries in self._held.values() for entry in entries),
            key=lambda entry: entry[0],
        )
        for entries in self._held.values():
            entries.clear()
        return [entry[1:] for entry in held]


class StartupBufferingRunner(Runner):
    """An executor of either deployment that starts with what came before."""

    _came_s: float | None = None

    def start_with(self, messages: list[tuple[str, Any, float]]) -> None:
        """
        Begin in the initial state and take messages in, before anything is requested.

        :param messages: Identifier, message and time of each, in the order in which they came.
        """
        self.start()
        self._take_in(messages)
        # A sensor whose last message is too old by now is stale already.
        self._deadline_s = self._now_s
        self.watch()

    def _take_in(self, messages: list[tuple[str, Any, float]]) -> None:
        for identifier, message, came_s in messages:
            self._came_s = came_s
            self.receive(identifier, message)
        self._came_s = None

    def _refuse(self, error: MissingData) -> None:
        # No caller can be told: a message of a type that lacks a field of the model's came.
        self._fail(describe_error(error))

    def _see(self, name: str) -> None:
        if self._came_s is None:
            super()._see(name)
            return
        # Its age counts from when it came.
        now_s, self._now_s = self._now_s, self._came_s
        super()._see(name)
        self._now_s = now_s
