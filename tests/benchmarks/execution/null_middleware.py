"""A middleware that takes everything and does nothing: what remains is the executor's own time."""

from typing import Any


class NullMiddleware:
    """Accepts every message."""

    def prepare(self, communication: str, data: Any) -> Any:
        """The data itself."""
        return data

    def is_default(self, communication: str, message: Any) -> bool:
        """Whether there is no data."""
        return message is None

    def publish(self, communication: str, message: Any) -> None:
        """Nothing."""

    def publish_default(self, identifier: str) -> None:
        """Nothing."""

    def call(self, communication: str, request_id: int, message: Any) -> None:
        """Nothing."""

    def send_goal(self, communication: str, goal_id: int, message: Any) -> None:
        """Nothing."""

    def cancel_goal(self, communication: str, goal_id: int) -> None:
        """Nothing."""
