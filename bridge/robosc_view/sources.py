"""Sources of the page behind one narrow protocol: a source reports to a sink, and a replay may be controlled."""

import importlib.util
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

from robosc_bridge.daemon.states import OperatorCommand
from robosc_bridge.errors import BridgeError
from robosc_view.definition import Robot
from robosc_view.reports import EventBatch, LaserScan, Status


class ViewError(BridgeError):
    """The live view cannot be served as requested; one sentence."""


class SourceLostError(Exception):
    """A source sends nothing any more; one sentence for a person. It is tried again."""


class SourceWrongError(Exception):
    """A source cannot be used, and another attempt cannot succeed without a change; one sentence."""


class RefusedError(Exception):
    """Refusal of a request; one sentence for a person."""


class Sink(Protocol):
    """Receiver of a source's reports; used only in the event loop of the server."""

    async def define(self, robot: Robot) -> None:
        """Define the robot; called first, and again after a change of the robot."""

    def begin(self, components: Mapping[str, object]) -> None:
        """Receive the known state in which what happens next begins; an empty one is the initial state."""

    def show(self, status: Status) -> None:
        """Receive what the robot is doing; only the latest counts."""

    def append_events(self, batch: EventBatch, first: int | None = None) -> None:
        """Receive entries of the event log; `first` is the number of the first one, if entries have numbers."""

    def show_scan(self, scan: LaserScan) -> None:
        """Receive a revolution of the LiDAR; only the latest counts."""

    def replay_jumped(self) -> None:
        """Receive a jump of the replay to another position; everything about that position follows."""

    def show_position(self, time_s: float, speed: float, *, is_playing: bool) -> None:
        """Receive the position of the replay of a log."""

    def show_run(self, text: str) -> None:
        """Receive the message `run` of a run that is stepped by hand; only the latest counts."""

    def answer(self, text: str) -> None:
        """Receive a message that answers a page; each is sent once."""


@dataclass(frozen=True, slots=True)
class Seek:
    """Go to a time of the log.

    Attributes:
        time_s: Time in seconds since 1970-01-01 UTC.
    """

    time_s: float


@dataclass(frozen=True, slots=True)
class Play:
    """Continue to play the log.

    Attributes:
        speed: Seconds of the log in a second.
    """

    speed: float


@dataclass(frozen=True, slots=True)
class Pause:
    """Pause the replay of the log."""


ReplayCommand = Seek | Play | Pause


class Source(Protocol):
    """Source that reports what a robot does, in the event loop of the server; blocking work is done in threads."""

    async def run(self, sink: Sink) -> None:
        """Report everything to the sink, until cancelled.

        Raises:
            SourceLostError: The source is gone.
            SourceWrongError: The source cannot be used.
        """

    async def order(self, command: OperatorCommand, by: str) -> None:
        """Give a command to the robot; returns once it is done.

        A stop is certain as soon as this waits for the first time: it is carried out even if its caller is cancelled.

        Raises:
            RefusedError: The command is refused.
        """

    def control_replay(self, command: ReplayCommand) -> None:
        """Control the replay.

        Raises:
            RefusedError: Nothing is replayed.
        """


def not_replayed() -> RefusedError:
    """Return the error of a live source for requests about a replay."""
    return RefusedError("this robot is shown live: only a log can be replayed")


def require_view() -> None:
    """Do nothing if the extra `view` is installed.

    Raises:
        ViewError: The extra is missing; the message says how to install it.
    """
    missing = [name for name in ("aiohttp", "igraph") if importlib.util.find_spec(name) is None]
    if missing:
        raise ViewError(f"the live view needs {' and '.join(missing)}: install robosc[view]")
