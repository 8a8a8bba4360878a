"""A supervision layer in a test: both its sides remember what they receive, in one list."""

from collections.abc import Callable
from typing import Any

from robosc.execution.runtime.clock import ManualClock
from robosc.execution.runtime.event_log import MemoryLog
from robosc.execution.runtime.layer import Layer
from robosc.execution.runtime.protocol import ControlledSystem
from robosc.execution.runtime.settings import Settings
from robosc.model.structure import Deployment
from support.execution import Observed, RecordingMiddleware, Sent, system_of


class BothSides(RecordingMiddleware):
    """The robot's and the caller's side of a layer.

    What the robot's side receives stands in `sent` as in the base class; what the caller's side receives as
    ("pass", identifier, message), ("blocked", identifier), ("answer", service, id, data), ("no answer", service, id),
    ("accept", action, id), ("reject", action, id), ("feedback", action, id, data), ("end", action, id, outcome, data).

    Attributes:
        reasons: The reasons that the caller's side was given, in order.
    """

    def __init__(self) -> None:
        super().__init__()
        self.reasons: list[str] = []

    def pass_on(self, identifier: str, message: Any) -> None:
        self._maybe_fail("pass_on", identifier)
        self._send("pass", identifier, message)

    def blocked(self, identifier: str, why: str) -> None:
        self._maybe_fail("blocked", identifier)
        self.reasons.append(why)
        self._send("blocked", identifier)

    def answer(self, communication: str, call_id: Any, data: Any) -> None:
        self._maybe_fail("answer", communication)
        self._send("answer", communication, call_id, data)

    def answer_default(self, communication: str, call_id: Any, why: str) -> None:
        self._maybe_fail("answer_default", communication)
        self.reasons.append(why)
        self._send("no answer", communication, call_id)

    def accept_goal(self, communication: str, goal_id: Any) -> None:
        self._maybe_fail("accept_goal", communication)
        self._send("accept", communication, goal_id)

    def reject_goal(self, communication: str, goal_id: Any, why: str) -> None:
        self._maybe_fail("reject_goal", communication)
        self.reasons.append(why)
        self._send("reject", communication, goal_id)

    def pass_feedback(self, communication: str, goal_id: Any, data: Any) -> None:
        self._maybe_fail("pass_feedback", communication)
        self._send("feedback", communication, goal_id, data)

    def end_goal(self, communication: str, goal_id: Any, outcome: str, data: Any, why: str) -> None:
        self._maybe_fail("end_goal", communication)
        self.reasons.append(why)
        self._send("end", communication, goal_id, outcome, data)


class LayerBench(Observed):
    """A layer with everything around it.

    Args:
        system: System to execute.
        start: True if it is started.
        settings: Settings by name.
    """

    executor: Layer

    def __init__(self, system: ControlledSystem, *, start: bool = True, **settings: Any) -> None:
        self.system = system
        self.middleware = BothSides()
        self.clock = ManualClock(epoch_s=1_000_000.0)
        self.log = MemoryLog()
        self.executor = Layer(system, self.middleware, self.middleware, Settings(**settings), self.clock, self.log)
        if start:
            self.executor.start()

    def during(self, act: Callable[..., None], *arguments: Any) -> list[Sent]:
        """Let something happen: what both sides received because of it."""
        before = len(self.middleware.sent)
        act(*arguments)
        return self.middleware.sent[before:]

    def request(self, identifier: str, message: Any = None) -> list[Sent]:
        """The existing controller sends a message."""
        return self.during(self.executor.on_request, identifier, message)

    def call(self, service: str, call_id: Any, message: Any = None) -> list[Sent]:
        """Call a service."""
        return self.during(self.executor.on_call, service, call_id, message)

    def goal(self, action: str, goal_id: Any, message: Any = None) -> list[Sent]:
        """Send a goal."""
        return self.during(self.executor.on_goal, action, goal_id, message)

    def cancel(self, action: str, goal_id: Any) -> list[Sent]:
        """Cancel a goal."""
        return self.during(self.executor.on_cancel, action, goal_id)

    def receive(self, identifier: str, data: Any = None) -> list[Sent]:
        """The robot sends a message."""
        return self.during(self.executor.receive, identifier, data)

    def reply(self, number: int, data: Any = None) -> list[Sent]:
        """A service of the robot answers."""
        return self.during(self.executor.on_reply, number, data)

    def fail(self, number: int) -> list[Sent]:
        """A service of the robot fails."""
        return self.during(self.executor.on_call_failed, number, "lost")

    def feedback(self, number: int, data: Any = None) -> list[Sent]:
        """A server of the robot reports how far a goal is."""
        return self.during(self.executor.on_feedback, number, data)

    def end(self, number: int, outcome: str, data: Any = None) -> list[Sent]:
        """A server of the robot ends a goal."""
        return self.during(self.executor.on_goal_ended, number, outcome, data)

    def wait(self, seconds: float) -> list[Sent]:
        """Let time pass."""
        self.clock.advance(seconds)
        return self.during(self.executor.tick)


def layer(text: str, **settings: Any) -> LayerBench:
    """A started layer of a model's text."""
    return LayerBench(system_of(text, Deployment.LAYER), **settings)
