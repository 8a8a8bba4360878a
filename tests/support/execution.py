"""An executor in a test: a clock that is moved by hand, a middleware that remembers, a log in memory."""

from collections.abc import Callable
from typing import Any

from robosc.execution.interpreter import InterpretedSystem
from robosc.execution.runtime.clock import ManualClock
from robosc.execution.runtime.event_log import MemoryLog
from robosc.execution.runtime.executor import Executor
from robosc.execution.runtime.protocol import ControlledSystem, DataDoesNotFit
from robosc.execution.runtime.runner import Runner, Status
from robosc.execution.runtime.settings import Settings
from robosc.model.structure import Deployment, Model
from robosc.supervisor import AddedCondition, Certificate, Supervisor
from support.models import example_model, model_of

Sent = tuple[Any, ...]


def supervisor_of(
    model: Model, deployment: Deployment = Deployment.CONTROLLER, added: tuple[AddedCondition, ...] = ()
) -> Supervisor:
    """A supervisor of a model for which synthesis adds just what is given."""
    certificate = Certificate("0", "0" * 64, deployment, "by hand", *("not checked",) * 4, "1", None)
    return Supervisor(model, deployment, added, certificate)


def unsupervised(text: str, deployment: Deployment = Deployment.CONTROLLER) -> Supervisor:
    """A supervisor of a model's text for which synthesis adds nothing."""
    return supervisor_of(model_of(text), deployment)


def system_of(text: str, deployment: Deployment = Deployment.CONTROLLER) -> InterpretedSystem:
    """The interpreted system of a model's text."""
    return InterpretedSystem(unsupervised(text, deployment))


def example_system(name: str) -> InterpretedSystem:
    """The interpreted system of an example robot for which synthesis adds nothing."""
    return InterpretedSystem(supervisor_of(example_model(name)))


class RecordingMiddleware:
    """Remembers what it is asked for, in order, and fails where the test says so.

    Attributes:
        sent: ("publish", communication, data), ("default", identifier), ("call", service, id, data),
            ("goal", action, id, data), ("cancel", action, id).
        unfit: Communications whose data does not fit.
        failing: Names of methods that raise, such as `publish`, or a method's name and its first argument.
        on_sent: Called with each thing that is sent, before it is remembered.
    """

    def __init__(self) -> None:
        self.sent: list[Sent] = []
        self.unfit: set[str] = set()
        self.failing: set[str | tuple[str, str]] = set()
        self.on_sent: Callable[[Sent], None] = lambda sent: None

    def _maybe_fail(self, method: str, subject: str) -> None:
        if method in self.failing or (method, subject) in self.failing:
            raise RuntimeError(f"{method} of {subject} broke")

    def _send(self, *sent: Any) -> None:
        self.on_sent(sent)
        self.sent.append(sent)

    def prepare(self, communication: str, data: Any) -> Any:
        self._maybe_fail("prepare", communication)
        if communication in self.unfit:
            raise DataDoesNotFit(f"{communication} does not fit")
        return data

    def is_default(self, communication: str, message: Any) -> bool:
        self._maybe_fail("is_default", communication)
        return _is_zero(message)

    def publish(self, communication: str, message: Any) -> None:
        self._maybe_fail("publish", communication)
        self._send("publish", communication, message)

    def publish_default(self, identifier: str) -> None:
        self._maybe_fail("publish_default", identifier)
        self._send("default", identifier)

    def call(self, communication: str, request_id: int, message: Any) -> None:
        self._maybe_fail("call", communication)
        self._send("call", communication, request_id, message)

    def send_goal(self, communication: str, goal_id: int, message: Any) -> None:
        self._maybe_fail("send_goal", communication)
        self._send("goal", communication, goal_id, message)

    def cancel_goal(self, communication: str, goal_id: int) -> None:
        self._maybe_fail("cancel_goal", communication)
        self._send("cancel", communication, goal_id)


def _is_zero(message: Any) -> bool:
    if isinstance(message, dict):
        return all(map(_is_zero, message.values()))
    return message is None or message == 0


class Observed:
    """Questions that a test asks an executor.

    Attributes:
        system: System that it executes.
        executor: The executor.
        log: Its log.
    """

    system: ControlledSystem
    executor: Runner
    log: MemoryLog

    def status(self) -> Status:
        """Return the status of the executor."""
        return self.executor.status

    def state(self, component: str) -> str:
        """The state of a component."""
        return str(self.system.state()[component]["state"])

    def variable(self, component: str, name: str) -> Any:
        """The value of a variable."""
        return self.system.state()[component]["variables"][name]

    @property
    def events(self) -> list[str]:
        """Every event that was taken, in order."""
        return [entry["event"] for entry in self.log.entries if entry["kind"] == "event"]

    def entries(self, kind: str) -> list[dict[str, Any]]:
        """The log's entries of one kind."""
        return [entry for entry in self.log.entries if entry["kind"] == kind]


class Bench(Observed):
    """An executor with everything around it.

    Args:
        system: System to execute.
        start: True if it is started.
        settings: Settings by name.
    """

    executor: Executor

    def __init__(self, system: ControlledSystem, *, start: bool = True, **settings: Any) -> None:
        self.system = system
        self.middleware = RecordingMiddleware()
        self.clock = ManualClock(epoch_s=1_000_000.0)
        self.log = MemoryLog()
        self.executor = Executor(system, self.middleware, Settings(**settings), self.clock, self.log)
        if start:
            self.executor.start()

    def tick(self, periods: int = 1) -> list[Sent]:
        """Let periods pass: what was sent in them."""
        before = len(self.middleware.sent)
        for _ in range(periods):
            self.clock.advance(self.executor.settings.period_s)
            self.executor.tick()
        return self.middleware.sent[before:]

    def receive(self, identifier: str, data: Any = None) -> list[Sent]:
        """Let a message come: what was sent because of it."""
        before = len(self.middleware.sent)
        self.executor.receive(identifier, data)
        return self.middleware.sent[before:]

    def published(self) -> list[str]:
        """Names of the messages that were published, and `default` for default messages."""
        return [sent[1] if sent[0] == "publish" else "default" for sent in self.middleware.sent]


def bench(text: str, **settings: Any) -> Bench:
    """A started executor of a model's text."""
    return Bench(system_of(text), **settings)


class Broken:
    """A system of which one method raises, once it is broken."""

    def __init__(self, system: Any, method: str) -> None:
        self._system = system
        self._method = method
        self.is_broken = False

    def __getattr__(self, name: str) -> Any:
        if self.is_broken and name == self._method:
            raise RuntimeError(f"{name} broke")
        return getattr(self._system, name)
