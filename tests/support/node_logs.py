"""Compares the event log of a node with the reference executor: given what came, it must do the same.

The log of a node has every event with the state after it. What came (events of the environment, with their data) is
taken from the log; all else (requests with their data, silent steps, states, stops, releases) must be what the
reference executor does on the same.
"""

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from robosc.execution.interpreter import InterpretedSystem
from robosc.execution.runtime.clock import ManualClock
from robosc.execution.runtime.event_log import MemoryLog
from robosc.execution.runtime.executor import Executor
from robosc.execution.runtime.settings import Settings
from robosc.model.structure import Communication, CommunicationKind, EventKind, Model
from robosc.supervisor import Supervisor

Entry = dict[str, Any]

BY_EVENT = Settings(period_s=3600.0, every="event")
"""Decisions only after what comes: the same order of everything on every machine."""


def entries_of(folder: Path) -> list[Entry]:
    """The entries of the one log in a folder; none while there is none. A line that is not finished is left out."""
    files = sorted(folder.iterdir()) if folder.is_dir() else []
    lines = files[0].read_text(encoding="utf-8").split("\n")[:-1] if files else []
    return [json.loads(line) for line in lines]


class Recording:
    """A middleware that takes everything and remembers what was sent.

    Attributes:
        sent: Communication or identifier of each message, and its data; None for the all-default message.
        calls: Number of the last call or goal of each service or action.
    """

    def __init__(self) -> None:
        self.sent: list[tuple[str, Any]] = []
        self.calls: dict[str, int] = {}

    def prepare(self, communication: str, data: Any) -> Any:
        """The data itself."""
        return data

    def is_default(self, communication: str, message: Any) -> bool:
        """Return True if everything is zero or empty."""
        if isinstance(message, dict):
            return all(self.is_default(communication, part) for part in message.values())
        return message in (None, 0, "")

    def publish(self, communication: str, message: Any) -> None:
        """Remember."""
        self.sent.append((communication, message))

    def publish_default(self, identifier: str) -> None:
        """Remember."""
        self.sent.append((identifier, None))

    def call(self, communication: str, request_id: int, message: Any) -> None:
        """Remember."""
        self.sent.append((communication, message))
        self.calls[communication] = request_id

    send_goal = call

    def cancel_goal(self, communication: str, goal_id: int) -> None:
        """Remember."""
        self.sent.append((f"{communication}.cancel", None))


class Reference:
    """The reference executor on a robot's own time.

    Args:
        supervisor: The supervisor.
        settings: Its settings.
    """

    def __init__(self, supervisor: Supervisor, settings: Settings = BY_EVENT) -> None:
        self.middleware = Recording()
        self._log = MemoryLog()
        system = InterpretedSystem(supervisor)
        self.executor = Executor(system, self.middleware, settings, ManualClock(), self._log)
        self.executor.start()

    @property
    def entries(self) -> list[Entry]:
        """Entries that it has logged."""
        return self._log.entries


def replayed(supervisor: Supervisor, entries: Iterable[Entry], settings: Settings = BY_EVENT) -> Reference:
    """The reference executor after everything that came to a node, as the node's log has it."""
    reference = Reference(supervisor, settings)
    model, executor = supervisor.model, reference.executor
    last_of_batch = _last_of_batches(model)
    for entry in entries:
        if entry["kind"] == "stop":
            executor.stop(entry["what"])
        if entry["kind"] != "event":
            continue
        name, _, kind = entry["event"].rpartition(".")
        if entry["controllable"] and kind != EventKind.CANCEL:
            continue
        item, data = model.communication(name), _with_numbers(entry["data"])
        number = reference.middleware.calls.get(name, 0)
        if item.kind is CommunicationKind.OUTGOING_MESSAGE:
            # One message is a batch of events.
            if name in last_of_batch:
                executor.receive(item.identifier, data)
        elif kind == EventKind.FEEDBACK:
            executor.on_goal_accepted(number)
            executor.on_feedback(number, data)
        elif item.kind is CommunicationKind.SERVICE:
            _answer(executor, kind, number, data)
        else:
            executor.on_goal_accepted(number)
            outcome = {EventKind.RESPONSE: "succeeded", EventKind.CANCEL: "cancelled"}.get(EventKind(kind), "aborted")
            executor.on_goal_ended(number, outcome, data if outcome == "succeeded" else None)
    return reference


def _with_numbers(data: Any) -> Any:
    """Logged data with the numbers that JSON has none for."""
    if isinstance(data, dict):
        return {name: _with_numbers(part) for name, part in data.items()}
    if isinstance(data, list):
        return [_with_numbers(part) for part in data]
    return float(data) if data in ("nan", "inf", "-inf") else data


def _answer(executor: Executor, kind: str, number: int, data: Any) -> None:
    if kind == EventKind.RESPONSE:
        executor.on_reply(number, data)
    else:
        executor.on_call_failed(number, "as the log says")


def _last_of_batches(model: Model) -> frozenset[str]:
    last: dict[str, Communication] = {}
    for item in model.communications:
        if item.kind is CommunicationKind.OUTGOING_MESSAGE:
            last[item.identifier] = item
    return frozenset(item.name for item in last.values())


def comparable(entries: Iterable[Mapping[str, Any]]) -> list[tuple[Any, ...]]:
    """Return the parts of entries that must be equal.

    These are all parts except times and the data of what came, of which each middleware has its own.
    """
    found: list[tuple[Any, ...]] = []
    for entry in entries:
        if entry["kind"] == "event":
            data = entry["data"] if entry["controllable"] else None
            found.append(("event", entry["event"], json.loads(json.dumps([data, entry["state"]]))))
        elif entry["kind"] in ("unknown", "unexpected"):
            found.append((entry["kind"], entry.get("event")))
        else:
            found.append((entry["kind"], *(entry.get(key) for key in ("what", "identifier", "action", "why"))))
    return found
