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
    """The live view cannot be served as it is asked for; one sentence."""


class SourceLostError(Exception):
    """A source sends nothing any more; one sentence for a person. It is tried again."""


class SourceWrongError(Exception):
    """A source cannot be used, and trying again would not help before somebody changed something; one sentence."""


class RefusedError(Exception):
    """Refusal of what was asked for; one sentence for a person."""


class Sink(Protocol):
    """Receiver of what a source reports; used in the event loop of the server alone."""

    async def define(self, robot: Robot) -> None:
        """Define the robot; called first, and again where it has become another."""

    def begin(self, components: Mapping[str, object]) -> None:
        """Receive the known state in which what happens next begins; an empty one is the initial state."""

    def show(self, status: Status) -> None:
        """Receive what the robot is doing; the latest alone counts."""

    def append_events(self, batch: EventBatch, first: int | None = None) -> None:
        """Entries of the event log; `first` is the number of the first of them, where they have one of their own."""

    def show_scan(self, scan: LaserScan) -> None:
        """A revolution of the LiDAR; the latest alone counts."""

    def replay_jumped(self) -> None:
        """The replay of a log has jumped to another position; everything about that position follows."""

    def show_position(self, time_s: float, speed: float, *, is_playing: bool) -> None:
        """Receive the position of the replay of a log."""

    def show_run(self, text: str) -> None:
        """Receive the message `run` of a run that is stepped by hand; the latest alone counts."""

    def answer(self, text: str) -> None:
        """Receive a message that answers a page; each is reported once."""


@dataclass(frozen=True, slots=True)
class Seek:
    """Go to a time of the log.

    Attributes:
        time_s: In seconds since 1970-01-01 UTC.
    """

    time_s: float


@dataclass(frozen=True, slots=True)
class Play:
    """Play the log on.

    Attributes:
        speed: Seconds of the log in a second.
    """

    speed: float


@dataclass(frozen=True, slots=True)
class Pause:
    """Stand still in the log."""


ReplayCommand = Seek | Play | Pause


class Source(Protocol):
    """Source that reports what a robot does, in the event loop of the server; blocking work is done in threads."""

    async def run(self, sink: Sink) -> None:
        """Report everything to the sink, until cancelled.

        Raises:
            SourceLostError: It is gone.
            SourceWrongError: It cannot be used as it is.
        """

    async def order(self, command: OperatorCommand, by: str) -> None:
        """Want something of the robot; returns once it is done.

        A stop is certain as soon as this first waits: it is carried out even if nobody awaits its answer any more.

        Raises:
            RefusedError: It is not done.
        """

    def control_replay(self, command: ReplayCommand) -> None:
        """Move in what is replayed.

        Raises:
            RefusedError: Nothing is replayed.
        """


def not_replayed() -> RefusedError:
    """Return the answer of a live source to those who would move in time."""
    return RefusedError("this robot is shown live: only a log can be replayed")


def require_view() -> None:
    """Raise where the extra `view` is missing.

    Raises:
        ViewError: It is, with what to do about it.
    """
    missing = [name for name in ("aiohttp", "igraph") if importlib.util.find_spec(name) is None]
    if missing:
        raise ViewError(f"the live view needs {' and '.join(missing)}: install robosc[view]")
