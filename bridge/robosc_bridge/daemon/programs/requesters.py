"""The caller's side of a supervision layer: programs whose requests the layer passes on or blocks.

Each program has its own ids of calls and goals. The requests of a program end with its connection: goals are cancelled,
and the motion of its messages and calls stops at once, without waiting for `command_timeout_s`. The layer knows only
one caller, and takes every message on an identifier for a sign of its life. Here there are several callers: the motion
that a program has requested goes on only as long as that program itself sends signs of life.
"""

import logging
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from robosc.execution.runtime.layer import Layer
from robosc.model.structure import CommunicationKind
from robosc_bridge.daemon.programs.items import (
    Answered,
    Blocked,
    CallRequested,
    CancelRequested,
    Clients,
    FeedbackPassed,
    GoalOver,
    GoalRejected,
    GoalRequested,
    GoalTaken,
    MessageRequested,
    PassedOn,
    Program,
)
from robosc_bridge.daemon.programs.request_checker import ProgramRequest, RequestChecker

_log = logging.getLogger(__name__)

_Id = tuple[Program, str]
_GONE = "the program that asked for it is gone"
_TOO_MUCH = "the program that asked for it sends too much at once"


@dataclass
class _Sender:
    """Program whose message went through last on an identifier.

    Attributes:
        program: Program that sent it.
        heard_s: Time of the last message from the program there, in seconds, whether it went through or not.
    """

    program: Program
    heard_s: float


class Requesters:
    """Requests of programs to a supervision layer, and the answers that the programs get.

    Args:
        checker: Requests that programs may make.
        clients: Connected programs.
        abandon: Function that ends a rotation that a communication asked for, with the reason.
        command_timeout_s: Time without a message of a program after which its last one on an identifier is released,
            in seconds; 0: never.
        clock: Clock that returns the time, in seconds.
    """

    def __init__(
        self,
        checker: RequestChecker,
        clients: Clients,
        abandon: Callable[[str, str], None],
        command_timeout_s: float,
        clock: Callable[[], float],
    ) -> None:
        self._checker = checker
        self._clients = clients
        self._abandon = abandon
        self._timeout_s = command_timeout_s or math.inf
        self._clock = clock
        self._asker: Program | None = None
        self._was_blocked = False
        # By identifier; then calls and goals under way.
        self._senders: dict[str, _Sender] = {}
        self._calls: dict[_Id, str] = {}
        self._goals: dict[_Id, str] = {}

    def forget(self) -> None:
        """Forget the requests of the last run, when a run ends or a new one begins: their answers never come."""
        for (program, call_id), _ in self._calls.items():
            self._clients.send(program, Answered(call_id, None, is_default=True))
        for (program, goal_id), _ in self._goals.items():
            self._clients.send(program, GoalOver(goal_id, "aborted", None))
        self._senders.clear()
        self._calls.clear()
        self._goals.clear()

    def detach(self, program: Program, layer: Layer | None) -> None:
        """End the calls and goals of a program that is gone, without an answer to it."""
        if layer is not None:
            self._end(program, layer, _GONE)
        self._calls = {item: name for item, name in self._calls.items() if item[0] is not program}
        self._goals = {item: name for item, name in self._goals.items() if item[0] is not program}

    def overflow(self, program: Program, layer: Layer) -> None:
        """End all requests of a program some of whose items were lost: one of them may have been a stop or cancel."""
        self._end(program, layer, _TOO_MUCH)

    def _end(self, program: Program, layer: Layer, reason: str) -> None:
        """Stop what a program's messages keep moving, cancel its goals and end its rotations."""
        for identifier, sender in tuple(self._senders.items()):
            if sender.program is program:
                del self._senders[identifier]
                layer.on_silent(identifier)
                for item in self._checker.messages[identifier]:
                    self._abandon(item.name, reason)
        for (owner, goal_id), action in tuple(self._goals.items()):
            if owner is program:
                layer.on_cancel(action, (program, goal_id))
        for (owner, _), service in tuple(self._calls.items()):
            if owner is program:
                self._abandon(service, reason)

    def release_silent(self, layer: Layer) -> None:
        """Release the last message of each program that has fallen silent where that message may still act."""
        now_s = self._clock()
        for identifier, sender in self._senders.items():
            if now_s >= sender.heard_s + self._timeout_s:
                layer.on_silent(identifier)

    # Requests of programs.

    def take(self, item: ProgramRequest, layer: Layer | None) -> None:
        """Pass a program's request to the layer, or refuse it."""
        program = item.program
        why = self._why_refused(item)
        if why:
            self._clients.refuse(program, why)
        elif layer is None:
            self._hold_back(item)
        else:
            self._asker, self._was_blocked = program, False
            self._pass(item, layer)
            self._asker = None

    def _pass(self, item: ProgramRequest, layer: Layer) -> None:
        match item:
            case MessageRequested(program=program, identifier=identifier, data=data):
                now_s, sender = self._clock(), self._senders.get(identifier)
                layer.on_request(identifier, data)
                if not self._was_blocked:
                    self._senders[identifier] = _Sender(program, now_s)
                elif sender is not None and sender.program is program:
                    sender.heard_s = now_s
            case CallRequested(program=program, service=service, call_id=call_id, data=data):
                self._calls[program, call_id] = service
                layer.on_call(service, (program, call_id), data)
            case GoalRequested(program=program, action=action, goal_id=goal_id, data=data):
                self._goals[program, goal_id] = action
                layer.on_goal(action, (program, goal_id), data)
            case CancelRequested(program=program, action=action, goal_id=goal_id):
                layer.on_cancel(action, (program, goal_id))

    def _hold_back(self, item: ProgramRequest) -> None:
        """Hold a request back, since the bridge executes no supervisor now."""
        match item:
            case MessageRequested(program=program, identifier=identifier):
                self._clients.send(program, Blocked(identifier))
            case CallRequested(program=program, service=service, call_id=call_id):
                self._clients.send(program, Answered(call_id, None, is_default=True))
                self._clients.send(program, Blocked(self._checker.identifier(CommunicationKind.SERVICE, service)))
            case GoalRequested(program=program, action=action, goal_id=goal_id):
                self._clients.send(program, GoalRejected(goal_id))
                self._clients.send(program, Blocked(self._checker.identifier(CommunicationKind.ACTION, action)))

    def _why_refused(self, item: ProgramRequest) -> str:
        """Return the reason why a program's request is invalid now, one sentence; empty: it is valid."""
        match item:
            case CallRequested(program=program, call_id=own_id) | GoalRequested(program=program, goal_id=own_id):
                own = program, own_id
                return f"the id '{own_id}' is in use" if own in self._calls or own in self._goals else ""
            case CancelRequested(program=program, action=action, goal_id=goal_id):
                is_own = self._goals.get((program, goal_id)) == action
                return "" if is_own else f"'{goal_id:.255}' is not a goal of '{action:.255}' in progress"
        return ""

    # Reports of the layer.

    def pass_on(self, identifier: str, message: Any) -> None:
        """Pass a message of the robot on to all programs, after the supervisor has received it."""
        self._clients.send_all(PassedOn(identifier, message))

    def blocked(self, identifier: str, why: str) -> None:
        """Report to a program that its request on an identifier was held back."""
        self._was_blocked = True
        if self._asker is not None:
            self._clients.send(self._asker, Blocked(identifier))

    def answer(self, communication: str, call_id: _Id, data: Any) -> None:
        """Send the reply of a service to the program that called it."""
        self._calls.pop(call_id, None)
        self._clients.send(call_id[0], Answered(call_id[1], data, is_default=False))

    def answer_default(self, communication: str, call_id: _Id, why: str) -> None:
        """Send the default reply to a call that was held back or has failed."""
        self._calls.pop(call_id, None)
        self._clients.send(call_id[0], Answered(call_id[1], None, is_default=True))

    def accept_goal(self, communication: str, goal_id: _Id) -> None:
        """Report to a program that its goal is let through."""
        self._clients.send(goal_id[0], GoalTaken(goal_id[1]))

    def reject_goal(self, communication: str, goal_id: _Id, why: str) -> None:
        """Report to a program that its goal is held back."""
        self._goals.pop(goal_id, None)
        self._clients.send(goal_id[0], GoalRejected(goal_id[1]))

    def pass_feedback(self, communication: str, goal_id: _Id, data: Any) -> None:
        """Send the feedback of a goal to its program."""
        self._clients.send(goal_id[0], FeedbackPassed(goal_id[1], data))

    def end_goal(self, communication: str, goal_id: _Id, outcome: str, data: Any, why: str) -> None:
        """Report the end of an accepted goal to its program."""
        self._goals.pop(goal_id, None)
        self._clients.send(goal_id[0], GoalOver(goal_id[1], outcome, data))
