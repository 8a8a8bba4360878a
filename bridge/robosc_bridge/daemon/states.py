"""State of the daemon, and commands that an operator may give it."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum


class State(StrEnum):
    """State of the daemon."""

    STARTING = "starting"
    STANDBY = "standby"
    RUNNING = "running"
    STOPPING = "stopping"
    FAULT = "fault"
    OVER = "over"


class OperatorCommand(StrEnum):
    """Command that an operator may give."""

    START = "start"
    STANDBY = "standby"
    STOP = "stop"
    RESUME = "resume"
    RESET = "reset"
    QUIT = "quit"


@dataclass(frozen=True)
class Order:
    """Command of an operator who wants to know what became of it.

    Attributes:
        command: Command that is wanted.
        by: Name of the operator, for the log.
        answer: Function that is called once, by the loop's thread, or after its end by that of the operator: with the
            reason why the command cannot be, one sentence, or with nothing ("") once it is done. It neither waits nor
            raises.
    """

    command: OperatorCommand
    by: str
    answer: Callable[[str], None]
