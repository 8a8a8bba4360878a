"""Handling of ground stations' commands: each is answered once, and none blocks the session.

A command that is repeated because its answer was lost has no second effect, and no effect at all if a stop has come in
between. A stop takes effect before it is answered. Answers of the daemon are polled. A command that the daemon does not
answer in time has failed, and is undone if it could still make the robot move.
"""

import math
import struct
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass

from robosc_bridge.daemon.operations import UNDONE_BY, Operations
from robosc_bridge.daemon.states import OperatorCommand
from robosc_bridge.ground_station.commands import Change, Checks, Interval, Meaning, Once, Parameters, Refusal, Stop
from robosc_bridge.ground_station.notices import blocking_notices
from robosc_bridge.ground_station.status import is_held, run_mode
from robosc_bridge.ground_station.status_texts import Sender, Severity
from robosc_bridge.ground_station.stream import HEARTBEAT, Stream
from robosc_bridge.ground_station.telemetry import Make
from robosc_bridge.protocol.mavlink_messages import Result

ANSWER_LIMIT_S = 5.0
RESET_LIMIT_S = 20.0
"""Time that the daemon may take for an answer, in seconds."""

LOOP_HANGS = "The bridge's loop hangs."

REPEATED_S = 10.0
"""Time for which the answer to a command is kept, for a sender that repeats it."""

_MOST_PENDING = 8
_MOST_REMEMBERED = 32
# An ordered stop appears in a snapshot within this time.
_SHOWN_S = 1.0

type Say = Callable[[Severity, str, Sender | None], None]
"""Sends a text of that severity, as an answer to a sender's request; None: as news of the robot."""

type _Key = tuple[Sender, int, bytes]


@dataclass(frozen=True)
class ReceivedCommand:
    """Command as it was received.

    Attributes:
        sender: System and component.
        number: MAV_CMD.
        parameters: The seven parameters.
        is_repeated: True if its sender has marked it as sent before.
    """

    sender: Sender
    number: int
    parameters: Parameters
    is_repeated: bool = False

    @property
    def key(self) -> _Key:
        """Key by which equal commands are recognized; parameters may be NaN."""
        return self.sender, self.number, struct.pack("<7d", *self.parameters)


@dataclass(frozen=True)
class _Pending:
    received: ReceivedCommand
    command: OperatorCommand
    answer: "Future[str]"
    since_s: float
    stops: int


def acknowledgement(received: ReceivedCommand, result: Result) -> Make:
    """Return the answer to a command, for its sender."""
    system, component = received.sender
    return lambda codec: codec.command_ack_encode(received.number, int(result), 0, 0, system, component)


class CommandHandler:
    """Handler of commands and their answers.

    Args:
        operations: The daemon.
        stream: Messages about the daemon.
        say: Function that sends a text to the person at a ground station.
    """

    def __init__(self, operations: Operations, stream: Stream, say: Say) -> None:
        self._operations = operations
        self._stream = stream
        self._say = say
        self._pending: dict[_Key, _Pending] = {}
        self._remembered: dict[_Key, tuple[Result, float]] = {}
        # Stops since the beginning; when the last one came, of any kind and of the operator's.
        self._stops = 0
        self._last_stop_s = self._held_s = -math.inf
        self._ordered: set[Stop] = set()

    def begin(self) -> None:
        """Begin anew: commands that come from now on are newer than every earlier order of any sender."""
        self._ordered.clear()

    def _stop(self, stop: Stop, by: Sender, now_s: float) -> None:
        # No command from before is answered as if it still held, nor obeyed late.
        self._remembered.clear()
        self._stops += 1
        self._last_stop_s = now_s
        if stop is Stop.OPERATOR:
            self._held_s = now_s
        if stop not in self._ordered:
            # Stops that come at the same time count as one: a flood costs the loop little.
            self._ordered.add(stop)
            self._operations.order(stop.command, _name(by))

    def take(self, received: ReceivedCommand, wanted: Meaning, now_s: float) -> list[Make]:
        """Carry out a command; return the messages for its sender that are sent at once.

        Args:
            received: Command as it came.
            wanted: Meaning of the command.
            now_s: The time.
        """
        if isinstance(wanted, Stop):
            self._stop(wanted, received.sender, now_s)
            return [acknowledgement(received, Result.ACCEPTED)]
        if received.key in self._pending:
            return [acknowledgement(received, Result.IN_PROGRESS)]
        match wanted:
            case Change():
                if received.is_repeated and (result := self._again(received, wanted, now_s)) is not None:
                    return [acknowledgement(received, result)]
                return self._change(received, wanted, now_s)
            case Checks():
                return [acknowledgement(received, self._checks(received, now_s))]
            case Interval(message, interval_s):
                return [acknowledgement(received, self._interval(received, message, interval_s))]
            case Once(message):
                found = self._stream.once(message, now_s)
                if found is None:
                    return [acknowledgement(received, Result.UNSUPPORTED)]
                return [acknowledgement(received, Result.ACCEPTED if found else Result.TEMPORARILY_REJECTED), *found]
            case Refusal(result, why):
                if why:
                    self._say(Severity.WARNING, why, received.sender)
                return [acknowledgement(received, result)]

    def poll(self, now_s: float) -> list[Make]:
        """Return the answers that have come."""
        found = []
        for key, pending in list(self._pending.items()):
            limit_s = RESET_LIMIT_S if pending.command is OperatorCommand.RESET else ANSWER_LIMIT_S
            if pending.answer.done():
                result = self._result(pending)
            elif now_s - pending.since_s > limit_s:
                result = self._unanswered(pending)
            else:
                continue
            del self._pending[key]
            if pending.stops == self._stops:
                found.append(self._answered(pending.received, result, now_s))
            else:
                found.append(acknowledgement(pending.received, result))
        return found

    def _again(self, received: ReceivedCommand, change: Change, now_s: float) -> Result | None:
        """Return the answer to a repetition that is not done; None: it is done, since its first sending was lost."""
        result, answered_s = self._remembered.get(received.key, (None, -math.inf))
        if result is not None and now_s - answered_s <= REPEATED_S:
            is_shown = now_s - answered_s > _SHOWN_S
            if result is not Result.ACCEPTED or not is_shown or self._still_holds(change.command):
                return result
        elif now_s - self._last_stop_s > REPEATED_S:
            return None
        # The order of the stop and the first sending is unknown.
        self._say(
            Severity.WARNING,
            f"{_NOT_DONE[change.command]}: the robot was stopped meanwhile; send it anew.",
            received.sender,
        )
        return Result.TEMPORARILY_REJECTED

    def _still_holds(self, command: OperatorCommand) -> bool:
        snapshot = self._stream.snapshot
        if command is OperatorCommand.START:
            return self._stream.is_running
        return command is not OperatorCommand.RESUME or (snapshot is not None and not is_held(snapshot))

    def _change(self, received: ReceivedCommand, change: Change, now_s: float) -> list[Make]:
        if self._stream.is_stale(now_s) or self._stream.snapshot is None:
            self._say(Severity.WARNING, LOOP_HANGS, received.sender)
            return [self._answered(received, Result.TEMPORARILY_REJECTED, now_s)]
        own = run_mode(self._operations.is_layer)
        if change.mode is not None and change.mode is not own:
            self._say(
                Severity.NOTICE, f"The supervisor runs in mode {own.name}, not {change.mode.name}.", received.sender
            )
        if change.command is OperatorCommand.RESUME and not self._is_held(now_s):
            return [self._answered(received, Result.ACCEPTED, now_s)]
        if change.command is OperatorCommand.RESET and self._stream.is_running:
            self._say(Severity.WARNING, "The robot is armed: disarm it before it is reset.", received.sender)
            return [self._answered(received, Result.TEMPORARILY_REJECTED, now_s)]
        if len(self._pending) >= _MOST_PENDING:
            return [acknowledgement(received, Result.TEMPORARILY_REJECTED)]
        self._ordered.clear()
        self._held_s = -math.inf
        answer = self._operations.order(change.command, _name(received.sender))
        self._pending[received.key] = _Pending(received, change.command, answer, now_s, self._stops)
        return []

    def _is_held(self, now_s: float) -> bool:
        snapshot = self._stream.snapshot
        if now_s - self._held_s < _SHOWN_S:
            return True
        return snapshot is not None and is_held(snapshot)

    def _result(self, pending: _Pending) -> Result:
        why = pending.answer.result()
        if not why:
            return Result.ACCEPTED
        self._say(Severity.WARNING, f"{_NOT_DONE[pending.command]}: {why}", pending.received.sender)
        return Result.TEMPORARILY_REJECTED

    def _unanswered(self, pending: _Pending) -> Result:
        undone_by = UNDONE_BY.get(pending.command)
        if undone_by is not None:
            # A command that was reported as failed must not be carried out later.
            self._operations.order(undone_by, _name(pending.received.sender))
        self._say(Severity.ERROR, f"{_NOT_DONE[pending.command]}: the bridge's loop does not answer.", None)
        return Result.FAILED

    def _answered(self, received: ReceivedCommand, result: Result, now_s: float) -> Make:
        self._remembered.pop(received.key, None)
        if len(self._remembered) >= _MOST_REMEMBERED:
            del self._remembered[next(iter(self._remembered))]
        self._remembered[received.key] = (result, now_s)
        return acknowledgement(received, result)

    def _checks(self, received: ReceivedCommand, now_s: float) -> Result:
        snapshot = self._stream.snapshot
        if snapshot is None or self._stream.is_stale(now_s):
            self._say(Severity.WARNING, LOOP_HANGS, received.sender)
            return Result.TEMPORARILY_REJECTED
        found = [text for severity, text in blocking_notices(snapshot) if severity <= Severity.WARNING]
        for text in found:
            # Each of them is to be reported, and there are not more than there are.
            self._say(Severity.WARNING, text, None)
        return Result.TEMPORARILY_REJECTED if found else Result.ACCEPTED

    def _interval(self, received: ReceivedCommand, message: int, interval_s: float | None) -> Result:
        if message == HEARTBEAT:
            self._say(Severity.WARNING, "The heartbeat comes once a second, always.", received.sender)
            return Result.DENIED
        return Result.ACCEPTED if self._stream.schedule.change(message, interval_s) else Result.UNSUPPORTED


_NOT_DONE = {
    OperatorCommand.START: "Not armed",
    OperatorCommand.RESUME: "Not resumed",
    OperatorCommand.RESET: "Not reset",
}


def _name(sender: Sender) -> str:
    return f"MAVLink {sender[0]}/{sender[1]}"
