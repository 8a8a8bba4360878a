"""A stand-in for an executor that remembers what it is called with."""

from collections.abc import Callable
from typing import Any


class ExecutorLog:
    """Remembers the calls of its methods.

    Attributes:
        reported: Name and arguments of each call, in order.
    """

    def __init__(self) -> None:
        self.reported: list[tuple[Any, ...]] = []

    def __getattr__(self, name: str) -> Callable[..., None]:
        return lambda *arguments: self.reported.append((name, *arguments))
