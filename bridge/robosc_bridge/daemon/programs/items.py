"""Items that programs and operators beyond a remote endpoint send to the loop, and items that the loop sends to them.

A program is any connected client. It may answer services and actions of the model that are mapped to `grpc`, and
receive and send messages there. If the supervisor is a supervision layer, it may also be the existing controller or
operator whose requests the layer lets through or holds back. Data is plain: None, booleans, numbers, texts, lists, and
dicts with texts as keys. All items of a program are untrusted: an invalid one is answered with `Refused` and has no
effect.
"""

import logging
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from robosc_bridge.daemon.programs.plain_data import weight_bytes


class _Weighed:
    """Item with data that is sent to programs: the same for all that receive it."""

    data: Any

    @cached_property
    def weight_bytes(self) -> int:
        """Memory that its data takes, in bytes."""
        return weight_bytes(self.data)


# Items that the loop sends to a program which serves communications of the model.


@dataclass(frozen=True)
class MessageSent(_Weighed):
    """The model sent a message on an identifier that is mapped to `grpc`; every program gets it."""

    name: str
    identifier: str
    data: Any


@dataclass(frozen=True)
class CallMade(_Weighed):
    """The model calls a service that this program serves; a `Replied` or `CallFailed` with the number is awaited."""

    name: str
    number: int
    data: Any


@dataclass(frozen=True)
class GoalMade(_Weighed):
    """The model sends a goal of an action that this program serves; `GoalAccepted`, then `GoalEnded` are awaited."""

    name: str
    number: int
    data: Any


@dataclass(frozen=True)
class CancelMade:
    """The model wants a goal of this program to end."""

    name: str
    number: int


# Items that the loop sends to a program which calls a supervision layer.


@dataclass(frozen=True)
class PassedOn(_Weighed):
    """The robot sent a message, which the supervisor has seen; every program gets it."""

    identifier: str
    data: Any


@dataclass(frozen=True)
class Blocked:
    """A request of this program on an identifier was held back, for a reason in words."""

    identifier: str
    why: str = field(default="", compare=False)


@dataclass(frozen=True)
class Answered(_Weighed):
    """A call of this program is answered; `data` is None: the default answer, as the call was held back or failed."""

    call_id: str
    data: Any
    is_default: bool


@dataclass(frozen=True)
class GoalTaken:
    """A goal of this program was let through; a `GoalOver` follows."""

    goal_id: str


@dataclass(frozen=True)
class GoalRejected:
    """A goal of this program was held back."""

    goal_id: str


@dataclass(frozen=True)
class FeedbackPassed(_Weighed):
    """Progress of a goal of this program."""

    goal_id: str
    data: Any


@dataclass(frozen=True)
class GoalOver(_Weighed):
    """A goal of this program has ended: `succeeded`, `aborted` or `cancelled`."""

    goal_id: str
    outcome: str
    data: Any


@dataclass(frozen=True)
class Refused:
    """Refusal of an invalid item of this program, in one sentence; the item changed nothing."""

    why: str


ToProgram = (
    MessageSent
    | CallMade
    | GoalMade
    | CancelMade
    | PassedOn
    | Blocked
    | Answered
    | GoalTaken
    | GoalRejected
    | FeedbackPassed
    | GoalOver
    | Refused
)


@dataclass(frozen=True, eq=False)
class Program:
    """One connected program.

    Attributes:
        name: Name of the program, for the log.
        send: Function that the loop's thread calls with each item for the program; neither waits nor raises.
        serves: Names of the model's services and actions, mapped to `grpc`, that it answers.
        may_request: True if it may be the caller of a supervision layer.
    """

    name: str
    send: Callable[[ToProgram], None]
    serves: frozenset[str] = field(default_factory=frozenset)
    may_request: bool = False


# Items that a program sends to the loop.


@dataclass(frozen=True)
class Attached:
    """A program has connected; its first item. It does not serve what another program already serves."""

    program: Program


@dataclass(frozen=True)
class Detached:
    """A program has disconnected: the model's calls and goals at it fail, its own goals at a layer are cancelled."""

    program: Program


@dataclass(frozen=True)
class MessageReceived:
    """A message for the model, on an identifier of an outgoing message that is mapped to `grpc`."""

    program: Program
    identifier: str
    data: Any


@dataclass(frozen=True)
class Replied:
    """The answer to a `CallMade`."""

    program: Program
    number: int
    data: Any


@dataclass(frozen=True)
class CallFailed:
    """A `CallMade` cannot be answered."""

    program: Program
    number: int
    reason: str


@dataclass(frozen=True)
class GoalAccepted:
    """A `GoalMade` is under way."""

    program: Program
    number: int


@dataclass(frozen=True)
class FeedbackGiven:
    """Progress of a `GoalMade`."""

    program: Program
    number: int
    data: Any


@dataclass(frozen=True)
class GoalEnded:
    """A `GoalMade` has ended: `succeeded`, `aborted`, `cancelled` or `rejected`."""

    program: Program
    number: int
    outcome: str
    data: Any


@dataclass(frozen=True)
class MessageRequested:
    """A message for the robot, of a layer's caller."""

    program: Program
    identifier: str
    data: Any


@dataclass(frozen=True)
class CallRequested:
    """A call of a service, of a layer's caller, with an id of the program's own."""

    program: Program
    service: str
    call_id: str
    data: Any


@dataclass(frozen=True)
class GoalRequested:
    """A goal of an action, of a layer's caller, with an id of the program's own."""

    program: Program
    action: str
    goal_id: str
    data: Any


@dataclass(frozen=True)
class CancelRequested:
    """A cancel of a goal of its own, of a layer's caller."""

    program: Program
    action: str
    goal_id: str


FromProgram = (
    Attached
    | Detached
    | MessageReceived
    | Replied
    | CallFailed
    | GoalAccepted
    | FeedbackGiven
    | GoalEnded
    | MessageRequested
    | CallRequested
    | GoalRequested
    | CancelRequested
)


_log = logging.getLogger(__name__)


class Clients:
    """Connected programs, in the order in which they came; used by the loop's thread."""

    def __init__(self) -> None:
        self._programs: dict[Program, None] = {}

    def __contains__(self, program: Program) -> bool:
        return program in self._programs

    def add(self, program: Program) -> None:
        """Add a program."""
        self._programs[program] = None

    def remove(self, program: Program) -> None:
        """Remove a program: it gets no messages any more."""
        self._programs.pop(program, None)

    def send(self, program: Program, item: ToProgram) -> None:
        """Send an item to a program, if it is still connected; never raises."""
        if program not in self._programs:
            return
        try:
            program.send(item)
        except Exception:  # Faults of a program's side must not stop the robot's loop.
            _log.exception("an item could not be sent to %s", program.name)

    def send_all(self, item: ToProgram) -> None:
        """Send an item to every program."""
        for program in self._programs:
            self.send(program, item)

    def refuse(self, program: Program, why: str) -> None:
        """Refuse an item that a program has sent."""
        _log.debug("%s: %s", program.name, why)
        self.send(program, Refused(why))
