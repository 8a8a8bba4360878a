"""Requests of a page over its WebSocket: read within bounds, as values."""

import json
from dataclasses import dataclass
from typing import Any

from robosc_bridge.daemon.states import OperatorCommand
from robosc_view.sources import Pause, Play, RefusedError, ReplayCommand, Seek

MAXIMUM_BYTES = 4096
"""Maximum size of one request, in bytes."""

SLOWEST, FASTEST = 0.01, 1000.0
"""Speeds of a replay."""

_COMMANDS = {
    str(item): item
    for item in (OperatorCommand.START, OperatorCommand.STANDBY, OperatorCommand.RESUME, OperatorCommand.RESET)
}


@dataclass(frozen=True, slots=True)
class Stop:
    """Stop the robot."""


@dataclass(frozen=True, slots=True)
class Order:
    """Command that is wanted of the robot.

    Attributes:
        command: The command.
        token: Token that is shown for it.
    """

    command: OperatorCommand
    token: object


PageRequest = Stop | Order | ReplayCommand


def parse_request(text: str) -> PageRequest:
    """Return the request in a text.

    Raises:
        RefusedError: It makes no sense.
    """
    try:
        document = json.loads(text, parse_constant=_refuse)
    except (ValueError, RecursionError) as error:
        raise RefusedError("that is no JSON") from error
    if not isinstance(document, dict):
        raise RefusedError("that is no JSON object")
    match document.get("type"):
        case "stop":
            return Stop()
        case "command":
            name = document.get("command")
            command = _COMMANDS.get(name) if isinstance(name, str) else None
            if command is None:
                raise RefusedError(f"a command is one of {', '.join(_COMMANDS)}")
            return Order(command, document.get("token"))
        case "seek":
            return Seek(_number(document, "time_s", -1e12, 1e12))
        case "play":
            return Play(_number(document, "speed", SLOWEST, FASTEST))
        case "pause":
            return Pause()
    raise RefusedError("there is nothing of that type")


def _number(document: dict[str, Any], name: str, low: float, high: float) -> float:
    value = document.get(name)
    if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
        raise RefusedError(f"'{name}' must be a number from {low:g} to {high:g}")
    return float(value)


def _refuse(text: str) -> float:
    raise ValueError(f"{text} is no JSON number")
