"""Requests of a page over its WebSocket: read within bounds, as values."""

import json
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Protocol, runtime_checkable

from robosc.pipeline.automata_files import SUFFIXES
from robosc_bridge.daemon.states import OperatorCommand
from robosc_view.sources import Pause, Play, RefusedError, ReplayCommand, Seek, Source

MAXIMUM_BYTES = 4096
"""Maximum size of one request, in bytes."""

MAXIMUM_LED_BYTES = 16384
"""The same where a run is stepped by hand: a link holds a model."""

MAXIMUM_WALK = 5000
"""Events of one walk."""

MAXIMUM_PAGE = 64
"""Characters of the name that a page gives itself."""

ROBOSC = "rscd"
LANGUAGES = (ROBOSC, *sorted(suffix.removeprefix(".") for suffix in SUFFIXES))
"""Languages of models, by the endings of their files."""

_OF_WALKS = (("steps", 1, MAXIMUM_WALK), ("seed", 0, 2**31))

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
class RobotCommand:
    """Command for the robot.

    Attributes:
        command: The command.
        token: Token that is shown for it.
    """

    command: OperatorCommand
    token: object


@dataclass(frozen=True, slots=True)
class TakeEvent:
    """Take an event in a run that is stepped by hand.

    Attributes:
        line: The event with its data, as in a file of events.
        way: Number of the state that it leads to, among those that were reported; None: there is only one.
    """

    line: str
    way: int | None = None


@dataclass(frozen=True, slots=True)
class Wait:
    """Request nothing, in a run against the surroundings."""


class HistoryMove(StrEnum):
    """Move in a run that is stepped by hand."""

    UNDO = "undo"
    REDO = "redo"


@dataclass(frozen=True, slots=True)
class Restart:
    """Begin a run that is stepped by hand again.

    Attributes:
        beginning: Number of the state to begin in, among those that the definition lists; None: the same as before.
    """

    beginning: int | None


@dataclass(frozen=True, slots=True)
class Walk:
    """Take events by chance.

    Attributes:
        steps: Most events to take.
        seed: Seed of the chance.
        until_finding: True if the first finding ends it.
    """

    steps: int
    seed: int
    until_finding: bool


class Form(StrEnum):
    """Form in which a run is kept."""

    LOG = "log"
    TEST = "test"


@dataclass(frozen=True, slots=True)
class Save:
    """Save the run.

    Attributes:
        form: Form in which it is saved.
    """

    form: Form


@dataclass(frozen=True, slots=True)
class LoadModel:
    """Load the model of a link.

    Attributes:
        packed: Part of the link that contains the model.
        language: Language of the model.
        token: Token for the request, so that a foreign link cannot start a synthesis on this machine.
    """

    packed: str
    language: str
    token: object


@dataclass(frozen=True, slots=True)
class Resume:
    """Continue the run that this page had before its connection was lost, or before a reload.

    Attributes:
        page: Name that the page has chosen for itself.
    """

    page: str


RunCommand = TakeEvent | Wait | HistoryMove | Restart | Walk | Save | LoadModel | Resume


@runtime_checkable
class ManualSource(Source, Protocol):
    """Source whose run is stepped by hand from a page."""

    def submit(self, command: RunCommand) -> None:
        """Submit a command for the run.

        Raises:
            RefusedError: Too much waits already.
        """


PageRequest = Stop | RobotCommand | ReplayCommand | RunCommand


def parse_request(text: str) -> PageRequest:
    """Return the request in a text.

    Raises:
        RefusedError: The request is invalid.
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
            return RobotCommand(command, document.get("token"))
        case "seek":
            return Seek(_number(document, "time_s", -1e12, 1e12))
        case "play":
            return Play(_number(document, "speed", SLOWEST, FASTEST))
        case "pause":
            return Pause()
        case "event":
            return TakeEvent(_text(document, "line"), _choice(document, "way"))
        case "wait":
            return Wait()
        case "undo" | "redo" as name:
            return HistoryMove(name)
        case "restart":
            return Restart(_choice(document, "beginning"))
        case "walk":
            steps, seed = (int(_number(document, name, low, high)) for name, low, high in _OF_WALKS)
            return Walk(steps, seed, document.get("until_finding") is True)
        case "save" if document.get("form") in tuple(Form):
            return Save(Form(document["form"]))
        case "resume":
            return Resume(_text(document, "page")[:MAXIMUM_PAGE])
        case "model":
            language = document.get("language", ROBOSC)
            if language not in LANGUAGES:
                raise RefusedError(f"the language of a model is one of {', '.join(LANGUAGES)}")
            return LoadModel(_text(document, "packed"), language, document.get("token"))
    raise RefusedError("there is nothing of that type")


def _text(document: dict[str, Any], name: str) -> str:
    value = document.get(name)
    if not isinstance(value, str) or not value.strip():
        raise RefusedError(f"'{name}' must be a text")
    return value


def _choice(document: dict[str, Any], name: str) -> int | None:
    return None if document.get(name) is None else int(_number(document, name, 0, 2**31))


def _number(document: dict[str, Any], name: str, low: float, high: float) -> float:
    value = document.get(name)
    if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
        raise RefusedError(f"'{name}' must be a number from {low:g} to {high:g}")
    return float(value)


def _refuse(text: str) -> float:
    raise ValueError(f"{text} is not a JSON number")
