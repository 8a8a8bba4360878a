"""A session with a ground station, which depends only on time and bytes.

It needs no socket, thread or clock. All input is untrusted: garbage is counted, an invalid message is answered or
dropped, and no input raises an error.
"""

import logging
import math
from collections import deque
from collections.abc import Callable, Iterable

from robosc_bridge.daemon.operations import Operations
from robosc_bridge.daemon.programs.items import Refused, ToProgram
from robosc_bridge.devices.interface import STANDSTILL, Velocity
from robosc_bridge.ground_station import requests
from robosc_bridge.ground_station.command_handler import LOOP_HANGS, CommandHandler, ReceivedCommand
from robosc_bridge.ground_station.commands import Change, Meaning, Refusal, Stop
from robosc_bridge.ground_station.driving import (
    Driving,
    Unusable,
    drive_message,
    from_manual_control,
    from_position_target,
)
from robosc_bridge.ground_station.notices import blocking_notices, happened, notice_of
from robosc_bridge.ground_station.received_messages import (
    OLD,
    STOPPING,
    ReceivedMessage,
    command_in,
    meaning_of,
    received_from,
)
from robosc_bridge.ground_station.schedule import Bucket
from robosc_bridge.ground_station.settings import GroundSettings
from robosc_bridge.ground_station.status import is_held
from robosc_bridge.ground_station.status_texts import Sender, Severity, StatusTexts
from robosc_bridge.ground_station.stream import Stream
from robosc_bridge.ground_station.telemetry import Make
from robosc_bridge.protocol.mavlink import Codec, Decoder
from robosc_bridge.protocol.mavlink_messages import GROUND_STATIONS, Incoming, Result

_log = logging.getLogger(__name__)

STATION_LIMIT_S = 5.0
"""After so long without its heartbeat a ground station is lost."""

IDLE_S = 0.05
"""After so long without a byte, what has come of a packet does not hide whole ones behind it any more."""

MESSAGES_PER_S, MOST_MESSAGES = 100.0, 200.0
"""Messages that are handled; beyond that, only those that stop."""

_OLD = "This station speaks MAVLink 1: set it to MAVLink 2."
_NOT_SIGNED = "Only stopping is obeyed here without a valid signature."


class StationSession:
    """Session with a ground station.

    Args:
        operations: The daemon.
        settings: Settings of the link.
        now_s: Current time, by the clock of readings and scans, in seconds.

    Attributes:
        accepted: Number of messages of stations that were accepted.
        claims: Number of accepted messages that make their sender the station in use: a heartbeat, or a command.

    Raises:
        SigningError: There is no key, or its time cannot be kept.
    """

    def __init__(self, operations: Operations, settings: GroundSettings, now_s: float) -> None:
        self.accepted = self.claims = 0
        self._operations = operations
        self._settings = settings
        self._signing = settings.signing.begin() if settings.signing else None
        self._codec = Codec(
            settings.system,
            settings.component,
            self._signing.key if self._signing else None,
            settings.signing.link if settings.signing else 0,
            self._signing.timestamp() if self._signing else 0,
            STOPPING,
        )
        self._decoder = Decoder(self._codec, received_from, OLD)
        self._texts = StatusTexts()
        self._stream = Stream(operations, settings, now_s)
        self._asking = CommandHandler(operations, self._stream, self._answer_in_words)
        message = drive_message(operations.mapping) if operations.is_layer else None
        self._answers: deque[ToProgram] = deque(maxlen=16)
        self._driving = Driving(operations.model, message, operations.post, self._answers.append) if message else None
        self._knows_old = False
        self._bytes = Bucket(settings.bytes_per_s, settings.bytes_per_s)
        self._heeded = Bucket(MESSAGES_PER_S, MOST_MESSAGES)
        self._station_s: float | None = None
        # Time of the last bytes of a line; infinite once they were looked through.
        self._fed_s = math.inf
        self._now_s = now_s
        self._subscription = operations.feed.subscribe(lambda: None)
        short = [f"{value.name} is {value.meaning}" for value in self._stream.values if value.name != value.meaning]
        if short:
            _log.info("names at the ground station: %s", ", ".join(short))

    def step(self, now_s: float, data: bytes = b"", *, is_datagram: bool = False) -> bytes:
        """Handle received bytes, and return the bytes to send.

        Args:
            now_s: The time.
            data: Bytes that have come.
            is_datagram: True if that is one whole datagram.

        Returns:
            Bytes to send: whole packets.

        Raises:
            SigningError: The time of signed packets cannot be kept.
        """
        self._pass_time(now_s)
        # Commands are judged by the present snapshot.
        self._look()
        replies: list[Make] = []
        for received in self._decoder.take_datagram(data) if is_datagram else self._fed(data):
            self._count(received)
            replies += self._take(received)
        replies += self._asking.poll(now_s)
        self._stream.bad_packets = self._decoder.counts.bad_frames
        # The reason of an answer comes before it.
        urgent = (*self._texts.take(now_s), *replies, *self._stream.pulse(now_s))
        return self._encoded(urgent, self._stream.due(now_s))

    def _fed(self, data: bytes) -> list[ReceivedMessage]:
        if data:
            self._fed_s = self._now_s
            return self._decoder.feed(data)
        if self._now_s - self._fed_s < IDLE_S:
            return []
        # A stop does not wait behind the beginning of a packet that was cut.
        self._fed_s = math.inf
        return self._decoder.idle()

    def receive_from_other(self, now_s: float, data: bytes) -> bytes:
        """Handle a datagram of a sender that is not the station in use, and that may only stop the robot.

        Returns:
            Bytes to send to that sender.
        """
        self._pass_time(now_s)
        replies: list[Make] = []
        for received in self._decoder.take_datagram(data):
            if received.is_old and not self._is_own(received):
                self._report_replay(received)
            command = None if self._is_own(received) else command_in(received, self._settings)
            if command is not None and isinstance(wanted := meaning_of(command), Stop):
                replies += self._asking.take(command, wanted, now_s)
        return self._encoded(replies, ())

    def lost(self) -> None:
        """End driving, since the line is gone."""
        self._end_driving(self._driving is not None and self._driving.end())
        self._decoder.forget()

    def end(self, now_s: float) -> bytes:
        """End the session with the bridge; return the last bytes to send."""
        self.lost()
        found = self.step(now_s)
        self._subscription.close()
        found += self._encoded(self._stream.once(Incoming.HEARTBEAT, now_s) or (), ())
        if self._signing:
            self._signing.release(self._codec.timestamp)
        return found

    def _pass_time(self, now_s: float) -> None:
        self._now_s = now_s
        self._bytes.pass_time(now_s)
        self._heeded.pass_time(now_s)
        self._asking.begin()

    def _encoded(self, urgent: Iterable[Make], telemetry: Iterable[Make]) -> bytes:
        if self._signing:
            self._codec.not_before(self._signing.timestamp())
        packets = []
        for make in urgent:
            packets.append(self._codec.encode(make))
            self._bytes.take(len(packets[-1]))
        waiting = iter(telemetry)
        while self._bytes.has_some and (due := next(waiting, None)) is not None:
            packets.append(self._codec.encode(due))
            self._bytes.take(len(packets[-1]))
        if self._signing and packets:
            self._signing.reserve(self._codec.timestamp)
        return b"".join(packets)

    # The daemon's snapshot.

    def _look(self) -> None:
        now_s = self._now_s
        update = self._subscription.take()
        before = self._stream.snapshot
        holding = []
        if self._stream.poll(update.snapshot, now_s) and update.snapshot is not None:
            for severity, text in happened(before, update.snapshot):
                self._texts.say(now_s, severity, text, again_s=0.0)
        for entry in update.entries:
            self._stream.held_back += entry.get("kind") == "blocked"
            notice = notice_of(entry)
            if notice is not None:
                self._texts.say(now_s, *notice)
        if self._stream.is_stale(now_s):
            holding.append((Severity.CRITICAL, LOOP_HANGS))
        elif self._stream.snapshot is not None:
            holding += blocking_notices(self._stream.snapshot)
        self._texts.repeat(now_s, holding)
        while self._answers:
            item = self._answers.popleft()
            if isinstance(item, Refused):
                self._texts.say(now_s, Severity.WARNING, item.why)
        if self._driving is not None:
            self._end_driving(self._driving.poll(now_s))
        if self._station_s is not None and now_s - self._station_s > STATION_LIMIT_S:
            self._station_s = None
            self._texts.say(now_s, Severity.WARNING, "The ground station is lost.", again_s=0.0)
            _log.warning("the ground station is lost")

    def _end_driving(self, was_moving: bool) -> None:
        if was_moving:
            self._texts.say(self._now_s, Severity.WARNING, "No set-point any more: the robot stands.", again_s=0.0)
            _log.warning("the set-points of the ground station have ended while the robot was moving")

    def _answer_in_words(self, severity: Severity, text: str, asked_by: Sender | None) -> None:
        self._texts.say(self._now_s, severity, text, again_s=0.0, asked_by=asked_by)

    # Messages of the ground station.

    def _is_own(self, received: ReceivedMessage) -> bool:
        """Return True if it was sent by us, and sent back: our own signature says nothing of who did that."""
        return received.sender == (self._settings.system, self._settings.component)

    def _count(self, received: ReceivedMessage) -> None:
        if self._is_own(received) or not self._is_trusted(received):
            return
        self.accepted += 1
        # Messages of another vehicle with the same key must not choose the address that is answered.
        is_station = received.number == Incoming.HEARTBEAT and received.message.type in GROUND_STATIONS
        self.claims += is_station or command_in(received, self._settings) is not None

    def _is_trusted(self, received: ReceivedMessage) -> bool:
        """Return True if it may ask and be heard; not whether it may change anything."""
        return received.is_signed or self._signing is None

    def _may_change(self, received: ReceivedMessage) -> bool:
        return received.is_signed or (self._signing is None and self._settings.accepts_unsigned)

    def _take(self, received: ReceivedMessage) -> list[Make]:
        if self._is_own(received):
            return []
        if received.is_old:
            self._report_replay(received)
        command = command_in(received, self._settings)
        if command is not None and isinstance(wanted := meaning_of(command), Stop):
            return self._asking.take(command, wanted, self._now_s)
        if not self._heeded.has_some:
            return []
        self._heeded.take()
        if command is not None:
            return self._command(received, command, meaning_of(command))
        if not self._is_trusted(received):
            return []
        match received.number:
            case Incoming.HEARTBEAT if received.message.type in GROUND_STATIONS:
                self._station(received)
            case Incoming.MANUAL_CONTROL if received.message.target == self._settings.system:
                self._drive(received, lambda: from_manual_control(received.message, self._settings.fastest))
            case Incoming.SET_POSITION_TARGET if received.is_for(self._settings):
                self._drive(received, lambda: from_position_target(received.message))
            case _ if received.is_for(self._settings):
                return requests.answers(received.number, received.message, received.sender, self._settings, self._now_s)
        return []

    def _report_replay(self, received: ReceivedMessage) -> None:
        if not self._knows_old:
            self._knows_old = True
            _log.warning("the ground station %d/%d speaks MAVLink 1, and is answered in MAVLink 2", *received.sender)
        self._texts.say(self._now_s, Severity.WARNING, _OLD, asked_by=received.sender)

    def _command(self, received: ReceivedMessage, command: ReceivedCommand, wanted: Meaning) -> list[Make]:
        is_refused = isinstance(wanted, Change) and not self._may_change(received)
        if is_refused or not self._is_trusted(received):
            self._texts.say(self._now_s, Severity.WARNING, _NOT_SIGNED, asked_by=received.sender)
            wanted = Refusal(Result.DENIED)
        return self._asking.take(command, wanted, self._now_s)

    def _station(self, received: ReceivedMessage) -> None:
        if self._station_s is None:
            # A station that has just connected has not been sent any text.
            self._texts.forget()
            _log.info("the ground station %d/%d has connected", *received.sender)
        self._station_s = self._now_s
        if self._may_change(received):
            self._operations.operator_seen()

    def _drive(self, received: ReceivedMessage, read: Callable[[], Velocity]) -> None:
        why = ""
        snapshot = self._stream.snapshot
        if not self._may_change(received):
            why = _NOT_SIGNED
        elif self._driving is None:
            why = "Set-points are for a supervision layer whose drive is mapped; this supervisor drives by itself."
        elif snapshot is None or not self._stream.is_running or self._stream.is_stale(self._now_s):
            why = "The robot is not armed: set-points are ignored."
        elif is_held(snapshot):
            why = "An operator has stopped the robot: set-points are ignored."
        try:
            velocity = read()
        except Unusable as error:
            why = str(error)
            velocity = STANDSTILL
        if not why and self._driving is not None:
            self._driving.take(self._now_s, velocity)
        elif why and (velocity != STANDSTILL or received.number == Incoming.SET_POSITION_TARGET):
            # A stick at rest asks for nothing.
            self._texts.say(self._now_s, Severity.WARNING, why, asked_by=received.sender)
