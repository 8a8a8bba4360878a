"""Driver of an executor or a layer in Python, and the world that it has around it.

It imports nothing but the standard library and runs on Python 3.8 and later: other interpreters than that of the tests
drive generated packages with it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any


def flat(data: Any, path: str = "") -> dict[str, Any]:
    """Data by path; numbers and truth values as floats, since not every target has all of them."""
    if isinstance(data, list):
        return {
            name: part for place, value in enumerate(data) for name, part in flat(value, f"{path}[{place}]").items()
        }
    if isinstance(data, dict):
        return {
            name: part
            for key, value in data.items()
            for name, part in flat(value, f"{path}.{key}" if path else key).items()
        }
    if data is None:
        return {}
    if isinstance(data, float) and math.isnan(data):
        return {path: "NaN"}  # The text equals itself.
    return {path: data if isinstance(data, str) else float(data)}


class Ids:
    """Calls and goals under way, by the ids that an executor gave them."""

    def __init__(self) -> None:
        self._open: dict[str, list[int]] = {}

    def add(self, name: str, number: int) -> None:
        """Note a call."""
        self._open.setdefault(name, []).append(number)

    def last(self, name: str) -> int:
        """The last one under way."""
        return self._open[name][-1]

    def end(self, name: str) -> int:
        """The last one, which is over."""
        return self._open[name].pop()

    def count(self, name: str) -> int:
        """Return the number of calls or goals under way."""
        return len(self._open.get(name, ()))


class Callers:
    """The numbers of the calls and goals of an existing controller: 1, 2 and so on."""

    def __init__(self) -> None:
        self._count = 0
        self._last: dict[str, int] = {}

    def next(self, name: str) -> int:
        """Return the number of one more call or goal."""
        self._count += 1
        self._last[name] = self._count
        return self._count

    def last(self, name: str) -> int:
        """Return the number of the last call or goal there."""
        return self._last[name]

    def count(self, name: str) -> int:
        """Return the number of calls and goals up to the last one there; 0: none."""
        return self._last.get(name, 0)


class World:
    """A middleware and the caller of a layer, which remember what they are asked for and given.

    Args:
        ids: Keeps the calls and goals under way.
    """

    def __init__(self, ids: Ids) -> None:
        self._ids = ids
        self._issued: list[tuple[str, str, dict[str, Any]]] = []

    def take(self) -> tuple[tuple[str, str, dict[str, Any]], ...]:
        """Return the calls since the last time, in order."""
        issued, self._issued = tuple(self._issued), []
        return issued

    def _note(self, kind: str, name: str, data: Any = None, **more: Any) -> None:
        self._issued.append((kind, name, {**more, **flat(data)}))

    def prepare(self, communication: str, data: Any) -> Any:
        return data

    def is_default(self, communication: str, message: Any) -> bool:
        return not any(flat(message).values())

    def publish(self, communication: str, message: Any) -> None:
        self._note("publish", communication, message)

    def publish_default(self, identifier: str) -> None:
        self._note("default", identifier)

    def call(self, communication: str, request_id: int, message: Any) -> None:
        self._note("call", communication, message)
        self._ids.add(communication, request_id)

    def send_goal(self, communication: str, goal_id: int, message: Any) -> None:
        self._note("goal", communication, message)
        self._ids.add(communication, goal_id)

    def cancel_goal(self, communication: str, goal_id: int) -> None:
        self._note("cancel", communication)

    # The caller's side of a layer.

    def pass_on(self, identifier: str, message: Any) -> None:
        self._note("pass", identifier, message)

    def blocked(self, identifier: str, why: str) -> None:
        self._note("blocked", identifier)

    def answer(self, communication: str, call_id: Any, data: Any) -> None:
        self._note("answer", communication, data, caller=call_id)

    def answer_default(self, communication: str, call_id: Any, why: str) -> None:
        self._note("no answer", communication, caller=call_id)

    def accept_goal(self, communication: str, goal_id: Any) -> None:
        self._note("accept", communication, caller=goal_id)

    def reject_goal(self, communication: str, goal_id: Any, why: str) -> None:
        self._note("reject", communication, caller=goal_id)

    def pass_feedback(self, communication: str, goal_id: Any, data: Any) -> None:
        self._note("feedback", communication, data, caller=goal_id)

    def end_goal(self, communication: str, goal_id: Any, outcome: str, data: Any, why: str) -> None:
        self._note("ended", communication, data, caller=goal_id, how=outcome)


class Driver:
    """An executor or a layer with its world.

    Args:
        system: The controlled system.
        runtime: Object that holds `Executor` or `Layer`, `Settings`, `ManualClock`, `MemoryLog` and `NullLog`, as a
            generated module does.
        is_layer: True for a layer.
        has_log: True if it writes a log: without one it takes shorter ways.

    Attributes:
        executor: The executor or layer, once it was started.
        ids: Calls and goals under way.
        callers: Numbers of an existing controller's calls and goals.
    """

    def __init__(self, system: Any, runtime: Any, *, is_layer: bool, has_log: bool = True) -> None:
        self.executor: Any = None
        self.ids = Ids()
        self.callers = Callers()
        self._system = system
        self._runtime = runtime
        self._is_layer = is_layer
        self._world = World(self.ids)
        self._clock = runtime.ManualClock()
        self._log = runtime.MemoryLog() if has_log else runtime.NullLog()
        self._has_log = has_log

    def start(self, settings: dict[str, Any]) -> None:
        """Begin, with every setting by name."""
        given = (self._runtime.Settings(**settings), self._clock, self._log)
        if self._is_layer:
            self.executor = self._runtime.Layer(self._system, self._world, self._world, *given)
        else:
            self.executor = self._runtime.Executor(self._system, self._world, *given)
        self.executor.start()

    def do(self, do: str, name: str, data: Any, how: str, seconds: float) -> None:
        """Let one thing happen.

        Args:
            do: Its kind, as `Action` of support.equivalence.scenario has it.
            name: Its subject.
            data: Data that comes with it.
            how: Outcome of a goal.
            seconds: Time that passes, in seconds.
        """
        executor, ids, callers = self.executor, self.ids, self.callers
        self._clock.advance(seconds)
        # Later ones than 3.8 would match.
        if do == "tick":
            executor.tick()
        elif do == "wait":
            executor.watch()
        elif do == "message":
            executor.receive(name, data)
        elif do == "reply":
            executor.on_reply(ids.end(name), data)
        elif do == "fail":
            executor.on_call_failed(ids.end(name), "lost")
        elif do == "accept":
            executor.on_goal_accepted(ids.last(name))
        elif do == "feedback":
            executor.on_feedback(ids.last(name), data)
        elif do == "end":
            executor.on_goal_ended(ids.end(name), how, data)
        elif do == "refuse":
            executor.on_cancel_refused(ids.last(name), how == "ended")
        elif do == "stop":
            executor.stop("test")
        elif do == "restart":
            executor.restart()
        elif do == "ask":
            executor.on_request(name, data)
        elif do == "ask_call":
            executor.on_call(name, callers.next(name), data)
        elif do == "ask_goal":
            executor.on_goal(name, callers.next(name), data)
        elif do == "ask_cancel":
            executor.on_cancel(name, callers.last(name))
        else:
            raise ValueError(do)

    def seen(self, events: Sequence[str], servers: Sequence[str]) -> dict[str, Any]:
        """Fields of an `Observation`, since the last time; the log as the executor wrote it.

        Args:
            events: Controllable events.
            servers: Names of the services and actions.
        """
        log: list[Any] = []
        if self._has_log:
            log, self._log.entries = self._log.entries, []
        counters, system = self.executor.counters, self._system
        return {
            "issued": self._world.take(),
            "log": log,
            "state": system.state(),
            "enabled": [event for event in events if system.enabled(event)],
            "locations": {name: system.location(name) for name in servers},
            "status": (self.executor.status.value, self.executor.is_faulty),
            "counters": (counters.unknown, counters.unexpected, counters.faults),
            "cancelling": (self.executor.cancelling, self.executor.overdue_cancels),
            "progress": progress_of(self.executor.progress),
        }


def progress_of(progress: Any) -> dict[str, Any] | None:
    """Progress of a strategy as plain values; None where there is no strategy."""
    if progress is None:
        return None
    return {
        "aims": [tuple(item) for item in progress.aims],
        "missions": [tuple(item) for item in progress.missions],
        "assumptions": [tuple(item) for item in progress.assumptions],
        "overdue": list(progress.overdue),
        "approached": progress.approached,
        "chosen": progress.chosen,
    }
