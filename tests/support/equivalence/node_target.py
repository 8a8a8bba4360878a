"""A generated node on real middleware: what it publishes and calls, and its event log, step by step.

A node's own timers would decide at times that no test knows. So it is run with the longest period and with `every`
set to `event`: each decision comes with what came, and the run is a function of what is sent. After each step the test
waits until as much has come as the reference showed, no longer than a limit; what comes too much is found in the next
step or at the end, where the node is stopped and everything it has said is read.
"""

import json
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, Protocol

from robosc.execution.runtime.settings import Settings
from robosc.model.structure import CommunicationKind, Deployment, Interface, Model
from support.equivalence.observation import FULL, Entry, Issued, Observation, Sight, entry
from support.equivalence.portable import flat
from support.equivalence.scenario import Action, Scenario

LIMIT_S = 15.0
RESEND_S = 3.0

IN_CPP = Sight(
    log_keys=frozenset(
        {
            *("kind", "event", "controllable", "data", "state", "identifier", "action", "why"),
            *("aim", "assumption", "count"),
        }
    ),
    has_readings=False,
)
"""Sight of nodes in C++ through their logs: what was unknown is not reported in the same words."""


class Surroundings(Protocol):
    """A node and everything around it, on one kind of ROS."""

    def start(self, scenario: Scenario, folder: Path) -> None:
        """Start the node with the settings of a scenario and `folder` for its event log; wait until it runs."""

    def send(self, topic: str, data: Any) -> None:
        """Publish a message."""

    def answer(self, action: Action) -> None:
        """Let a server do what an action says: `reply`, `accept`, `feedback`, `end`."""

    def ask(self, action: Action) -> None:
        """Let the existing controller before a layer do what an action says: `ask`, `ask_call` and so on."""

    def take_issued(self) -> list[Issued]:
        """Return the node's requests and reports since the last time, `publish` with the topic."""

    def settle(self) -> None:
        """Return when the node has handled what was sent to it and shows nothing of it."""

    def spin(self) -> None:
        """Handle what comes, for a moment; fail if the node has ended."""

    def stop(self) -> None:
        """Stop the node with a signal and wait for its end."""

    def close(self) -> None:
        """End everything, whatever has happened."""


class TickingSurroundings(Surroundings, Protocol):
    """Those of a node that decides by its own timer."""

    def wait_for_tick(self) -> None:
        """Wait until the timer has ticked after this call: what had ticked before may still be reported."""


def timed_log(surroundings: TickingSurroundings, scenario: Scenario, folder: Path, model: Model) -> list[Entry]:
    """The event log of a node that decides by its own timer, while the messages of a scenario come to it.

    The timer has ticked at least once after each message was taken.
    """
    sizes = Counter(i.identifier for i in model.communications if i.kind is CommunicationKind.OUTGOING_MESSAGE)
    target = NodeTarget("timed", model, surroundings, folder)
    surroundings.start(scenario, folder)
    taken = 0
    log: list[Entry] = []
    try:
        for action in scenario.actions:
            taken += sizes[action.subject]
            surroundings.send(action.subject, action.data)
            began = time.monotonic()
            while sum(1 for item in log if item.get("controllable") is False) < taken:
                assert time.monotonic() < began + LIMIT_S, f"waited {LIMIT_S} s in vain for {action}"
                surroundings.spin()
                target._look()
                log = target._log
            surroundings.wait_for_tick()
        log = list(target.close().log)
    finally:
        surroundings.close()
    return log


class NodeTarget:
    """A node as a target of the suite.

    Args:
        name: Name for messages.
        model: Model that it was made from.
        surroundings: Surroundings in which it runs.
        folder: Folder for its event log.
        sight: Extent of what it reports in its log.
    """

    def __init__(self, name: str, model: Model, surroundings: Surroundings, folder: Path, sight: Sight = FULL) -> None:
        self.name = name
        topics = {i.name: i.identifier for i in model.communications if i.kind is CommunicationKind.INCOMING_MESSAGE}
        first: dict[str, str] = {}
        servers = [i for i in model.communications if i.kind in (CommunicationKind.SERVICE, CommunicationKind.ACTION)]
        names = {i.name: first.setdefault(i.identifier, i.name) for i in servers}
        self.sight = replace(sight, topics=topics, names=names)
        self._surroundings = surroundings
        self._folder = folder
        self._read = 0
        self._issued: list[Issued] = []
        self._log: list[Entry] = []
        self._is_stopped = False

    def start(self, scenario: Scenario, awaited: Observation) -> Observation:
        """Start the node."""
        self._surroundings.start(scenario, self._folder)
        return self._wait_for(awaited)

    def do(self, action: Action, awaited: Observation) -> Observation:
        """Let one thing happen, and wait until it shows."""
        if action.do == "message":
            self._surroundings.send(action.subject, action.data)
            # Sensors' topics may lose a message; one that comes always shows in the log.
            return self._wait_for(awaited, lambda: self._surroundings.send(action.subject, action.data))
        if action.do.startswith("ask"):
            self._surroundings.ask(action)
            return self._wait_for(awaited)
        self._surroundings.answer(action)
        return self._wait_for(awaited)

    def _wait_for(self, awaited: Observation, resend: Callable[[], None] | None = None) -> Observation:
        if not awaited.log and not awaited.issued:
            self._surroundings.settle()
        began = time.monotonic()
        while True:
            self._surroundings.spin()
            self._look()
            if len(self._log) >= len(awaited.log) and len(self._issued) >= len(awaited.issued):
                break
            if time.monotonic() > began + LIMIT_S:
                break
            if resend and not self._log and time.monotonic() > began + RESEND_S:
                resend()
                resend = None
        return self._taken()

    @property
    def issued(self) -> tuple[Issued, ...]:
        """Requests that came and that no observation has yet."""
        return tuple(self._issued)

    def next_entries(self, count: int) -> list[Entry]:
        """Wait until the log has so many entries more, and return all that it has more."""
        began = time.monotonic()
        self._look()
        while len(self._log) < count:
            assert time.monotonic() < began + LIMIT_S, f"waited {LIMIT_S} s in vain for {count} entries: {self._log}"
            self._surroundings.spin()
            self._look()
        found, self._log = self._log, []
        return found

    def _look(self) -> None:
        self._issued += self._surroundings.take_issued()
        for path in self._folder.glob("*.jsonl"):
            text = path.read_text(encoding="utf-8")
            lines = text[: text.rfind("\n") + 1].splitlines()
            self._log += [entry(json.loads(line)) for line in lines[self._read :]]
            self._read = len(lines)

    def _taken(self) -> Observation:
        found = Observation(issued=tuple(self._issued), log=tuple(self._log))
        self._issued, self._log = [], []
        return found

    def close(self) -> Observation:
        """Stop it; what it said but for its safe stop."""
        if self._is_stopped:
            return Observation()
        self._is_stopped = True
        try:
            self._surroundings.stop()
            self._look()
        finally:
            self._surroundings.close()
        stop = next((number for number, item in enumerate(self._log) if item["kind"] == "stop"), len(self._log))
        self._log = self._log[:stop]
        # Messages that bring the robot to rest: all-default messages, and cancels; a layer takes leave of its callers.
        leave = [item for item in self._issued if item[0] in ("answer", "ended")]
        self._issued = [item for item in self._issued if item not in leave and (item[2] or item[0] in ("call", "goal"))]
        return self._taken()


def node_parameters(scenario: Scenario, folder: Path, deployment: Deployment) -> dict[str, Any]:
    """The settings as the node's parameters."""
    settings = scenario.all_settings()
    return {
        **deciding(settings, deployment),
        "period": settings.period_s,
        "service_timeout": settings.service_timeout_s,
        "cancel_timeout": settings.cancel_timeout_s,
        "on_unknown": settings.on_unknown,
        "max_age": [f"{topic}={age}" for topic, age in (settings.max_age_s or {}).items()] or [""],
        "log_folder": str(folder),
        "server_wait": LIMIT_S,
    }


def deciding(settings: Settings, deployment: Deployment) -> dict[str, Any]:
    """The parameters about decisions; without a policy, the node has its own."""
    if deployment is Deployment.LAYER:
        return {"command_timeout": settings.command_timeout_s}
    found: dict[str, Any] = {"every": settings.every}
    if settings.policy is not None:
        found["policy"] = settings.policy
    if settings.assumption_timeout_s != Settings().assumption_timeout_s:
        # Only a node with a strategy has it.
        found["assumption_timeout"] = settings.assumption_timeout_s
    return found


def given(interface: Interface, message: Any) -> dict[str, Any]:
    """Return the contents of a message, given as a dict, by path; parts that have their default are left out."""
    return set_parts((message or {}).get("data") if interface.package == "std_msgs" else message)


def set_parts(value: Any) -> dict[str, Any]:
    """The parts of a request or a goal that are not zero or empty, by path, without headers."""
    return {path: part for path, part in flat(_plain(value)).items() if part}


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _plain(part) for name, part in value.items() if name != "header"}
    if isinstance(value, list):
        return [_plain(part) for part in value]
    return value if isinstance(value, bool | int | float | str) else None
