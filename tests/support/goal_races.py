"""Races of goals and calls, as one table: what happens, in which order it is read, and what the model is told.

Each row is for any world that has an action `/go` and a service `/reach` for `tests/models/driver`: a generated node,
or its clients with an executor on a clock that is moved by hand, and servers that do what a row says.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from robosc.certification import make_supervisor
from robosc.execution.interpreter import InterpretedSystem
from robosc.execution.runtime.event_log import MemoryLog
from robosc.execution.runtime.executor import Executor
from robosc.execution.runtime.settings import Settings
from robosc.language import load_bundle
from robosc.supervisor import Supervisor
from robosc.targets.ros.runtime.reports import Reports
from robosc.targets.ros2.runtime.node_time import SimulatedClock

SETTINGS = Settings(service_timeout_s=2.0, action_timeout_s=60.0)
START_NS = 1_000_000_000_000
MODELS = Path(__file__).parents[1] / "models"


def driver_supervisor(name: str) -> Supervisor:
    """The supervisor of one of the models of a driver."""
    made = make_supervisor(load_bundle(MODELS / name / "model.rscd"))
    assert made.supervisor is not None, made.reason
    return made.supervisor


class World(ABC):
    """A controller of the driver, among servers."""

    # The controller's side.

    @abstractmethod
    def press(self, button: str, is_down: bool = True) -> None:
        """Say that a button is down or up."""

    @abstractmethod
    def pass_time(self, seconds: float) -> None:
        """Let time pass for the controller; it may go back."""

    @property
    @abstractmethod
    def happened(self) -> list[str]:
        """The events of the action and the service, those of an error with their reason."""

    @property
    @abstractmethod
    def unexpected(self) -> int:
        """Number of replies and the like that nothing in the model is for."""

    @property
    @abstractmethod
    def status(self) -> str:
        """Status of the executor."""

    # The servers' side; nothing of it is read before `read`.

    @abstractmethod
    def accept(self) -> None:
        """Have every server accept the goal."""

    @abstractmethod
    def feedback(self) -> None:
        """Give feedback."""

    @abstractmethod
    def end(self, how: str) -> None:
        """Every server ends the goal: `succeeded`, `aborted`, `cancelled` after the client asked for it."""

    @abstractmethod
    def cancel_by_another(self) -> None:
        """Another client has the goal cancelled."""

    @abstractmethod
    def reply(self) -> None:
        """The service replies."""

    @abstractmethod
    def read(self) -> None:
        """The clients read what has come, and the executor is told."""


class ExecutorWorld(World):
    """An executor in this process, on a clock that is moved by hand, among clients and servers.

    Args:
        supervisor: The driver's.

    Attributes:
        reports: Reports of the clients.
    """

    calls: Any
    goals: Any

    def __init__(self, supervisor: Supervisor) -> None:
        self.time_ns = START_NS
        self.clock = SimulatedClock(lambda: self.time_ns)
        self.clock.monotonic()
        self.reports = Reports()
        self._log = MemoryLog()
        self._executor = Executor(InterpretedSystem(supervisor), _Seam(self), SETTINGS, self.clock, self._log)
        self._executor.start()

    def press(self, button: str, is_down: bool = True) -> None:
        """Say that a button is down or up, and decide."""
        self._executor.receive(f"/{button}", is_down)
        self._executor.tick()

    def deliver(self) -> None:
        """Tell the executor what the clients reported."""
        while self.reports.deliver(self._executor):
            pass

    def pass_time(self, seconds: float) -> None:
        """Let time pass for the executor; it may go back."""
        self.time_ns += round(seconds * 1e9)
        self._executor.watch()
        self.deliver()

    @property
    def happened(self) -> list[str]:
        """The events of the action and the service, those of an error with their reason."""
        return events_of_servers(self._log.entries)

    @property
    def unexpected(self) -> int:
        """Number of replies and the like that nothing in the model is for."""
        return self._executor.counters.unexpected

    @property
    def status(self) -> str:
        """Status of the executor."""
        return self._executor.status.value


def events_of_servers(entries: Iterable[Mapping[str, Any]]) -> list[str]:
    """Return the events of the action and the service in a log, those of an error with their reason if it is known."""
    return [
        f"{entry['event']}: {entry['data']}" if entry["event"].endswith(".error") and entry["data"] else entry["event"]
        for entry in entries
        if entry["kind"] == "event" and entry["event"].split(".")[0] in ("go", "reach")
    ]


class _Seam:
    """The middleware of the executor: the world's clients."""

    def __init__(self, world: ExecutorWorld) -> None:
        self._world = world

    def prepare(self, communication: str, data: Any) -> Any:
        return data

    def is_default(self, communication: str, message: Any) -> bool:
        return False

    def publish(self, communication: str, message: Any) -> None:
        """Send nothing: nobody listens."""

    def publish_default(self, identifier: str) -> None:
        """Send nothing: nobody listens."""

    def call(self, communication: str, request_id: int, message: Any) -> None:
        self._world.calls.call(request_id, message)

    def send_goal(self, communication: str, goal_id: int, message: Any) -> None:
        self._world.goals.send(goal_id, message)

    def cancel_goal(self, communication: str, goal_id: int) -> None:
        self._world.goals.cancel(goal_id)


class Race(NamedTuple):
    """A row of the table.

    Attributes:
        name: Its name.
        happens: Function that makes it happen in a world.
        told: The events that the model is told, in order; resets are left out.
        servers: Number of servers that get the goal.
        unexpected: Number of things that come and are for nothing.
    """

    name: str
    happens: Callable[[World], None]
    told: tuple[str, ...]
    servers: int = 1
    unexpected: int = 0


def _begin(world: World) -> None:
    world.press("pressed")


def _accepted(world: World) -> None:
    _begin(world)
    world.accept()
    world.read()


def _result_before_feedback(world: World) -> None:
    _accepted(world)
    world.feedback()
    world.end("succeeded")
    world.press("pressed", False)
    world.read()


def _result_before_acceptance(world: World) -> None:
    _begin(world)
    world.accept()
    world.end("succeeded")
    world.press("pressed", False)
    world.read()


def _cancel_before_acceptance(world: World) -> None:
    _begin(world)
    world.accept()
    world.press("pressed", False)
    world.read()
    world.end("cancelled")
    world.read()


def _cancel_meets_success(world: World) -> None:
    _accepted(world)
    world.end("succeeded")
    world.press("pressed", False)
    world.read()


def _two_results(world: World) -> None:
    _accepted(world)
    world.end("succeeded")
    world.press("pressed", False)
    world.read()
    world.read()


def _late_reply(world: World) -> None:
    world.press("wanted")
    world.press("wanted", False)
    world.pass_time(2.5)
    world.reply()
    world.read()


def _preempted(world: World) -> None:
    _accepted(world)
    world.end("aborted")
    world.press("pressed", False)
    world.read()


def _cancelled_by_another(world: World) -> None:
    _accepted(world)
    world.cancel_by_another()
    world.end("cancelled")
    world.read()
    world.press("pressed", False)


def _time_goes_back(world: World) -> None:
    world.press("wanted")
    world.press("wanted", False)
    world.pass_time(1.5)
    world.pass_time(-500.0)
    # Time that went back has not passed.
    world.pass_time(0.4)
    world.reply()
    world.read()


RACES = (
    Race("a result is read before feedback", _result_before_feedback, ("go.request", "go.response")),
    Race("a result is there before the acceptance is read", _result_before_acceptance, ("go.request", "go.response")),
    Race("a cancel is due before the acceptance is read", _cancel_before_acceptance, ("go.request", "go.cancel")),
    Race("a goal succeeds as its cancel is asked for", _cancel_meets_success, ("go.request", "go.response")),
    Race("two servers give a result", _two_results, ("go.request", "go.response"), servers=2),
    Race("a reply comes after the timeout", _late_reply, ("reach.request", "reach.error: timeout"), unexpected=1),
    Race("another client's goal is preferred", _preempted, ("go.request", "go.error: aborted")),
    Race("another client cancels the goal", _cancelled_by_another, ("go.request", "go.error: cancelled")),
    Race("the clock jumps back", _time_goes_back, ("reach.request", "reach.response")),
)
"""The table."""


def told_by(world: World) -> tuple[str, ...]:
    """Return the events that the model was told, without resets, and without feedback that came before the end."""
    told = [event for event in world.happened if not event.endswith(".reset")]
    # Feedback may be read before the end, never after it.
    ends = [number for number, event in enumerate(told) if not event.endswith((".request", ".feedback"))]
    end = min(ends, default=len(told))
    return tuple(event for number, event in enumerate(told) if not (event.endswith(".feedback") and number < end))


def run(race: Race, world: World) -> None:
    """Let a race happen in a world, and look at what the model was told.

    Raises:
        AssertionError: It was something else.
    """
    race.happens(world)
    assert told_by(world) == race.told
    assert world.unexpected == race.unexpected
    assert world.status == "running"
