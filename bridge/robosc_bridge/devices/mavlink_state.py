"""State of a vehicle, as reported so far."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from robosc_bridge.protocol.mavlink_messages import (
    ARDUPILOT,
    AUTOPILOT,
    GROUND_ROVER,
    GROUND_STATIONS,
    Answer,
    Attitude,
    BatteryState,
    Heartbeat,
    LocalPosition,
    Message,
    MotionEstimate,
    Text,
)

TEXT_LIMIT_S = 1.0
"""Longest time between two pieces of a long text; one that is not whole by then is shown as incomplete, in seconds."""

INCOMPLETE = "[a part of this text is missing]"
"""Words where pieces of a text are missing."""

_KEPT_TEXTS = 8
_MOST_CHUNKS = 20
_MOST_UNFINISHED = 8
# A vehicle's clock goes back when it starts anew; datagrams overtake each other by less.
_OVERTAKEN_S = 2.0
# It goes ahead of ours by no more than the time for which a line may hold its reports back.
_HELD_BACK_S = 60.0
# It counts milliseconds, and begins anew after 49.7 days.
_CLOCK_S = 2**32 / 1000


@dataclass(frozen=True, slots=True)
class Timestamped[Content]:
    """A report with the time at which it came.

    Attributes:
        time_s: Time when it came, by the host's clock, in seconds.
        content: Content of the report.
    """

    time_s: float
    content: Content


@dataclass(frozen=True, slots=True)
class _LongText:
    """Pieces of a text of which some are still to come.

    Attributes:
        time_s: Time when the last of them came, in seconds.
        pieces: Pieces that have come, by their numbers.
    """

    time_s: float
    pieces: Mapping[int, Text]

    def joined(self) -> Text:
        """Return the text, with words where pieces are missing."""
        found, expected = list[bytes](), 0
        first = next(iter(self.pieces.values()))
        for number in sorted(self.pieces):
            if number != expected:
                found.append(f"{' ' if found else ''}{INCOMPLETE} ".encode())
            found.append(self.pieces[number].data)
            expected = number + 1
        if not self.pieces[max(self.pieces)].is_last:
            found.append(f" {INCOMPLETE}".encode())
        return replace(first, data=b"".join(found), chunk=0)

    @property
    def is_whole(self) -> bool:
        """True if no piece is missing."""
        return len(self.pieces) == max(self.pieces) + 1 and self.pieces[max(self.pieces)].is_last


@dataclass(frozen=True)
class VehicleState:
    """State of a vehicle after some messages; `after` returns the state after the next.

    Attributes:
        system: System number of the vehicle; None: any, the first rover is taken.
        component: Component number of its autopilot; None: it has not been heard.
        heartbeat: The last one.
        stranger: The last heartbeat of something else that is neither a ground station nor without autopilot.
        attitude: The last one.
        position: The last one.
        motion: The last one; some vehicles report only the two before.
        battery: Battery in the summary that every vehicle sends.
        packs: Batteries in their own messages, by number.
        answers: Answers to commands, by command.
        texts: The last ones, joined; those that were not whole in time say so.
        boot_s: Time of the vehicle's clock, in seconds; it begins anew after 49.7 days.
        boot_heard_s: Time when it was heard, in seconds.
        restarts: Number of times that this clock has begun anew before that.
    """

    system: int | None = None
    component: int | None = None
    heartbeat: Timestamped[Heartbeat] | None = None
    stranger: Heartbeat | None = None
    attitude: Timestamped[Attitude] | None = None
    position: Timestamped[LocalPosition] | None = None
    motion: Timestamped[MotionEstimate] | None = None
    battery: BatteryState | None = None
    packs: Mapping[int, BatteryState] = field(default_factory=dict)
    answers: Mapping[int, Timestamped[Answer]] = field(default_factory=dict)
    texts: tuple[Timestamped[Text], ...] = ()
    boot_s: float = 0.0
    boot_heard_s: float | None = None
    restarts: int = 0
    _unfinished: Mapping[int, _LongText] = field(default_factory=dict)

    def is_vehicle(self, message: Message) -> bool:
        """Return True if a message is of the vehicle's autopilot."""
        return self.component is not None and (message.system, message.component) == (self.system, self.component)

    def after(self, message: Message, time_s: float, own: tuple[int, int]) -> "VehicleState":
        """Return the state after another message.

        Args:
            message: Message that came.
            time_s: Time when it came, in seconds.
            own: Our system and component, to which answers are addressed.
        """
        if isinstance(message.content, Heartbeat) and not self.is_vehicle(message):
            return self._after_new_heartbeat(message, message.content, time_s)
        if not self.is_vehicle(message):
            return self
        return self.at(time_s)._after_own(message, time_s, own)

    def at(self, time_s: float) -> "VehicleState":
        """Return the state at a time, in seconds: texts whose missing pieces no longer come are incomplete ones."""
        late = [number for number, text in self._unfinished.items() if time_s - text.time_s > TEXT_LIMIT_S]
        return self._ended(late) if late else self

    def at_end(self) -> "VehicleState":
        """Return the state when nothing more comes."""
        return self._ended(list(self._unfinished))

    @property
    def heard_s(self) -> float:
        """Time when the vehicle was heard last, in seconds; minus infinity: it was not."""
        reports = (self.heartbeat, self.attitude, self.position, self.motion)
        return max((report.time_s for report in reports if report is not None), default=-math.inf)

    @property
    def is_text_awaited(self) -> bool:
        """True if pieces of a text are still to come."""
        return bool(self._unfinished)

    def _after_own(self, message: Message, time_s: float, own: tuple[int, int]) -> "VehicleState":
        match message.content:
            case Heartbeat() as heartbeat:
                return replace(self, heartbeat=Timestamped(time_s, heartbeat))
            case Attitude() as attitude:
                return replace(self._at(attitude.boot_s, time_s), attitude=Timestamped(time_s, attitude))
            case LocalPosition() as position:
                return replace(self._at(position.boot_s, time_s), position=Timestamped(time_s, position))
            case MotionEstimate() as motion:
                return replace(self, motion=Timestamped(time_s, motion))
            case BatteryState(is_main=True) as battery:
                return replace(self, battery=battery)
            case BatteryState() as battery:
                return replace(self, packs={**self.packs, battery.number: battery})
            case Answer() as answer if _is_for(answer, own):
                return replace(self, answers={**self.answers, answer.command: Timestamped(time_s, answer)})
            case Text() as text:
                return self._after_text(text, time_s)
        return self

    def _after_new_heartbeat(self, message: Message, heartbeat: Heartbeat, time_s: float) -> "VehicleState":
        is_rover = heartbeat.kind == GROUND_ROVER and heartbeat.autopilot == ARDUPILOT
        if is_rover and self.component is None and self.system in (None, message.system):
            return replace(
                self, system=message.system, component=message.component, heartbeat=Timestamped(time_s, heartbeat)
            )
        if message.component == AUTOPILOT and heartbeat.kind not in GROUND_STATIONS:
            return replace(self, stranger=heartbeat)
        return self

    def _at(self, boot_s: float, time_s: float) -> "VehicleState":
        has_restarted = False
        if self.boot_heard_s is not None:
            ahead_s = (boot_s - self.boot_s + _CLOCK_S / 2) % _CLOCK_S - _CLOCK_S / 2
            has_restarted = not -_OVERTAKEN_S <= ahead_s <= time_s - self.boot_heard_s + _HELD_BACK_S
        return replace(self, boot_s=boot_s, boot_heard_s=time_s, restarts=self.restarts + has_restarted)

    def _after_text(self, text: Text, time_s: float) -> "VehicleState":
        if not text.number:
            return self._with_texts([Timestamped(time_s, text)])
        begun = self._unfinished.get(text.number)
        if begun is not None and begun.pieces.get(text.chunk) == text:
            return self
        # A number that is used again: the text before it does not go on.
        is_next = begun is not None and text.chunk not in begun.pieces and len(begun.pieces) < _MOST_CHUNKS
        state = self if is_next or begun is None else self._ended([text.number])
        pieces = dict(begun.pieces) if begun is not None and is_next else {}
        pieces[text.chunk] = text
        unfinished = {**state._unfinished, text.number: _LongText(time_s, pieces)}
        state = replace(state, _unfinished=unfinished)
        if unfinished[text.number].is_whole:
            return state._ended([text.number])
        return state._ended(list(unfinished)[:-_MOST_UNFINISHED])

    def _ended(self, numbers: Sequence[int]) -> "VehicleState":
        """Return the state with these long texts as they are."""
        ended = [Timestamped(self._unfinished[number].time_s, self._unfinished[number].joined()) for number in numbers]
        left = {number: text for number, text in self._unfinished.items() if number not in numbers}
        return replace(self._with_texts(ended), _unfinished=left)

    def _with_texts(self, texts: Sequence[Timestamped[Text]]) -> "VehicleState":
        return replace(self, texts=(*self.texts, *texts)[-_KEPT_TEXTS:])


def _is_for(answer: Answer, own: tuple[int, int]) -> bool:
    return answer.target_system in (0, own[0]) and answer.target_component in (0, own[1])
