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
    """Command of an operator, with the function that takes the answer.

    Attributes:
        command: The command.
        by: Name of the operator, for the log.
        answer: Function that is called once, by the loop's thread or, after its end, by that of the operator: with one
            sentence that says why the command cannot be carried out, or with "" once it is done. It neither waits nor
            raises.
    """

    command: OperatorCommand
    by: str
    answer: Callable[[str], None]
