"""The other side of the model's communications on the channel `grpc`: messages, services and actions of programs.

Numbers of calls and goals are never reused while the bridge runs, so that a late answer, or an answer to an earlier
run, cannot be taken for the awaited one.
"""

import logging
from dataclasses import dataclass
from typing import Any

from robosc.execution.runtime.protocol import MissingData
from robosc.model.structure import Communication, CommunicationKind
from robosc_bridge.configuration.channel_mapping import ChannelMapping
from robosc_bridge.configuration.channels import GrpcChannel
from robosc_bridge.daemon.executor_inputs import Listeners, Supervised
from robosc_bridge.daemon.programs.items import (
    CallFailed,
    CallMade,
    CancelMade,
    Clients,
    FeedbackGiven,
    GoalAccepted,
    GoalEnded,
    GoalMade,
    MessageReceived,
    MessageSent,
    Program,
    Replied,
)

_log = logging.getLogger(__name__)

OUTCOMES = ("succeeded", "aborted", "cancelled", "rejected")
"""Outcomes that a program may report for a goal."""

_SERVED = (CommunicationKind.SERVICE, CommunicationKind.ACTION)

Answer = Replied | CallFailed | GoalAccepted | FeedbackGiven | GoalEnded
"""Report of a program about a call or goal of the model."""


@dataclass
class _Open:
    """Call or goal that was sent to a program, and whose end the program has not reported.

    Attributes:
        program: Program that serves it.
        name: Name of the service or action.
        number: Number that the executor uses.
        is_goal: True if it is a goal.
        is_cancelled: True if the program was asked to end it.
        is_left: True if it is a goal of an earlier run: the model knows nothing of it, but it may move the robot.
    """

    program: Program
    name: str
    number: int
    is_goal: bool
    is_cancelled: bool = False
    is_left: bool = False


class ProgramChannel:
    """Exchange between the model and programs.

    Args:
        mapping: Channel that each communication is mapped to.
        listeners: Identifiers that each kind of channel reports to.
        clients: Connected programs.
    """

    def __init__(self, mapping: ChannelMapping, listeners: Listeners, clients: Clients) -> None:
        mapped = [item for item, _ in mapping.mapped_to(GrpcChannel)]
        self._services = {item.name: item for item in mapped if item.kind in _SERVED}
        self._heard = frozenset(identifier for identifier, _ in listeners.of(GrpcChannel))
        self._clients = clients
        self._servers: dict[str, Program] = {}
        self._open: dict[int, _Open] = {}
        self._next_number = 1

    # The model's side.

    def forget(self) -> None:
        """Forget the calls of the last run, when a run ends or a new one begins; cancel its goals, and await them."""
        self._open = {own: item for own, item in self._open.items() if item.is_goal}
        for own, item in self._open.items():
            item.is_left = True
            self._cancel(own)

    @property
    def left(self) -> tuple[str, ...]:
        """Actions with a goal of an earlier run that has not ended."""
        return tuple(item.name for item in self._open.values() if item.is_left)

    def send(self, communication: Communication, data: Any) -> None:
        """Send a message of the model to all programs."""
        self._clients.send_all(MessageSent(communication.name, communication.identifier, data))

    def call(self, communication: Communication, number: int, data: Any) -> str:
        """Send a call of the model to the program that serves it; return why there is none, or an empty text."""
        return self._ask(communication, number, data, is_goal=False)

    def send_goal(self, communication: Communication, number: int, data: Any) -> bool:
        """Send a goal of the model to the program that serves its action; return True if there is one."""
        return not self._ask(communication, number, data, is_goal=True)

    def cancel(self, number: int) -> None:
        """Cancel a goal of the model."""
        for own, item in self._open.items():
            if item.is_goal and item.number == number:
                self._cancel(own)

    def _ask(self, communication: Communication, number: int, data: Any, *, is_goal: bool) -> str:
        name = communication.name
        program = self._servers.get(name)
        if program is None:
            why = f"no program serves '{name}' ('{communication.identifier}')"
            _log.warning("%s", why)
            return why
        # The model asks anew: it has given up what it asked for before, such as a call without an answer. A goal that
        # was not accepted in time may have been begun all the same.
        for own in [own for own, item in self._open.items() if item.name == name and item.is_goal]:
            self._cancel(own)
        self._open = {own: item for own, item in self._open.items() if item.name != name}
        own, self._next_number = self._next_number, self._next_number + 1
        self._open[own] = _Open(program, name, number, is_goal)
        self._clients.send(program, GoalMade(name, own, data) if is_goal else CallMade(name, own, data))
        return ""

    def _cancel(self, own: int) -> None:
        item = self._open[own]
        if not item.is_cancelled:
            item.is_cancelled = True
            self._clients.send(item.program, CancelMade(item.name, own))

    # The programs' side.

    def attach(self, program: Program) -> None:
        """Assign to a new program the services and actions that it offers and that no other program serves."""
        for name in sorted(program.serves):
            if name not in self._services:
                self._clients.refuse(
                    program, f"'{name}' is not a service or action of the model that is mapped to grpc"
                )
            elif name in self._servers:
                self._clients.refuse(program, f"'{name}' is served by {self._servers[name].name} already")
            else:
                self._servers[name] = program

    def detach(self, program: Program, executor: Supervised | None) -> None:
        """Let the open calls and goals of a program that is gone fail."""
        self._servers = {name: server for name, server in self._servers.items() if server is not program}
        lost = [own for own, item in self._open.items() if item.program is program]
        for item in [self._open.pop(own) for own in lost]:
            why = f"{program.name}, which served '{item.name}', is gone"
            _log.warning("%s", why)
            if item.is_left:
                continue
            if executor is not None and item.is_goal:
                executor.on_goal_ended(item.number, "lost")
            elif executor is not None:
                executor.on_call_failed(item.number, why)

    def receive(self, item: MessageReceived, executor: Supervised | None) -> None:
        """Pass a program's message to the model; it is dropped while nothing is executed."""
        if item.identifier not in self._heard:
            self._clients.refuse(item.program, f"the model hears nothing on '{item.identifier:.255}' from programs")
        elif executor is not None:
            try:
                executor.receive(item.identifier, item.data)
            except MissingData as error:
                self._clients.refuse(item.program, str(error))

    def take(self, item: Answer, executor: Supervised | None) -> None:
        """Pass a program's answer to a call or goal on to the executor."""
        asked = self._open.get(item.number)
        is_goal = not isinstance(item, Replied | CallFailed)
        if asked is not None and asked.is_left and asked.program is item.program and is_goal:
            if isinstance(item, GoalEnded):
                del self._open[item.number]
            return
        if executor is None or asked is None or asked.program is not item.program or asked.is_goal is not is_goal:
            what = "goal" if is_goal else "call"
            self._clients.refuse(item.program, f"{item.number} is not a {what} that this program has been asked for")
            return
        try:
            self._take(item, asked, executor)
        except MissingData as error:
            # It is still awaited.
            self._open[item.number] = asked
            self._clients.refuse(item.program, str(error))

    def _take(self, item: Answer, asked: _Open, executor: Supervised) -> None:
        """Pass an answer on that is awaited (MissingData if it lacks what every message has)."""
        number = asked.number
        match item:
            case GoalAccepted():
                executor.on_goal_accepted(number)
            case FeedbackGiven(data=data):
                executor.on_feedback(number, data)
            case GoalEnded(outcome=outcome) if outcome not in OUTCOMES:
                self._clients.refuse(item.program, f"a goal ends as one of {', '.join(OUTCOMES)}")
            case GoalEnded(outcome=outcome, data=data):
                del self._open[item.number]
                executor.on_goal_ended(number, outcome, data)
            case Replied(data=data):
                del self._open[item.number]
                executor.on_reply(number, data)
            case CallFailed(reason=reason):
                del self._open[item.number]
                _log.warning("%s: '%s' has failed: %.200r", item.program.name, asked.name, reason)
                executor.on_call_failed(number, reason)
