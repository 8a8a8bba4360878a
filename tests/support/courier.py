"""Courier of the tests of services and actions, on either ROS: orders, permission, and the state of its node."""

import json
import signal
from abc import ABC, abstractmethod
from collections.abc import Callable
from pathlib import Path
from typing import Any

from support.process import Process
from support.ros2 import RosProcess


class CourierSide(ABC):
    """Test's side of the courier.

    Args:
        folder: Folder of the node's files; its event log is in the folder `events` there.
    """

    node: Process | RosProcess

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    @abstractmethod
    def until(self, condition: Callable[[], bool], what: str, repeat: Callable[[], object] = lambda: None) -> None:
        """Wait for a condition while the node runs."""

    @abstractmethod
    def last_state(self) -> str | None:
        """Return the last text of the topic of states; None: none came."""

    @abstractmethod
    def health(self) -> tuple[int, str, dict[str, str]] | None:
        """Return level, message and values of the last diagnostics; None: none came."""

    @abstractmethod
    def publish_order(self, what: str) -> None:
        """Publish an order."""

    @abstractmethod
    def publish_allowed(self, is_allowed: bool) -> None:
        """Publish the permission."""

    def order(self, what: str, condition: Callable[[], bool]) -> None:
        """Order something until a condition shows that it is under way."""
        self.until(condition, f"the order {what}", lambda: self.publish_order(what))

    def allow(self, is_allowed: bool) -> None:
        """Grant or deny permission until the node has seen it."""
        state = "granted" if is_allowed else "denied"
        self.until(
            lambda: self.state("Permission") == state,
            f"the permission {state}",
            lambda: self.publish_allowed(is_allowed),
        )

    def cancelling(self) -> list[str]:
        """Return the actions whose goal is being cancelled, as the node says."""
        text = self.last_state()
        return [] if text is None else list(json.loads(text)["cancelling"])

    def _current(self, component: str) -> Any:
        text = self.last_state()
        return None if text is None else json.loads(text)["current"][component]

    def state(self, component: str) -> str | None:
        """Return the location of a component; None: no state came."""
        current = self._current(component)
        return None if current is None else str(current["state"])

    def reaches(self, component: str, state: str) -> None:
        """Wait for a location."""
        self.until(lambda: self.state(component) == state, f"{component} to be {state}")

    def value(self, component: str, variable: str) -> str:
        """Return the value of a variable."""
        return str(self._current(component)["variables"][variable])

    def has(self, component: str, variable: str, value: str) -> None:
        """Wait for a value."""
        self.until(
            lambda: self.state(component) is not None and self.value(component, variable) == value,
            f"{variable} to be {value}",
        )

    def count_reaches(self, name: str, number: int) -> None:
        """Wait for a counter of the diagnostics."""

        def is_there() -> bool:
            health = self.health()
            return health is not None and int(health[2][name]) >= number

        self.until(is_there, f"{number} {name}")

    def events(self) -> list[Any]:
        """Return the event log; of a node that goes on, what it has written to the end."""
        (log,) = (self.folder / "events").iterdir()
        text = log.read_text()
        return [json.loads(line) for line in text[: text.rfind("\n") + 1].splitlines()]

    def reasons_so_far(self, event: str) -> list[Any]:
        """Return the data of every such event."""
        return [item["data"] for item in self.events() if item.get("event") == event]

    def reasons_of(self, event: str) -> list[Any]:
        """End the node, and return the data of every such event."""
        self.node.signal(signal.SIGTERM)
        assert self.node.wait() == 0
        return self.reasons_so_far(event)
