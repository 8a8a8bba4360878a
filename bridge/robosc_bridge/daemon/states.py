"""What the daemon is doing, and what an operator may want of it."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum


class State(StrEnum):
    """What the daemon is doing."""

    STARTING = "starting"
    STANDBY = "standby"
    RUNNING = "running"
    STOPPING = "stopping"
    FAULT = "fault"
    OVER = "over"


class Command(StrEnum):
    """What an operator may want."""

    START = "start"
    STANDBY = "standby"
    STOP = "stop"
    RESUME = "resume"
    RESET = "reset"
    QUIT = "quit"


@dataclass(frozen=True)
class Order:
    """A command of an operator who wants to know what became of it.

    Attributes:
        command: What is wanted.
        by: Who wants it, for the log.
        answer: Called once, by the loop's thread, or after its end by that of who orders: with why it cannot be, one
            sentence, or with nothing ("") once it is done. It neither waits nor raises.
    """

    command: Command
    by: str
    answer: Callable[[str], None]
