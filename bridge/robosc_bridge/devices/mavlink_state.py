"""State of a vehicle, as reported so far."""

from collections.abc import Mapping
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

_KEPT_TEXTS = 8
_MOST_CHUNKS = 20
# A vehicle's clock goes back when it starts anew; datagrams overtake each other by less.
_OVERTAKEN_S = 2.0


@dataclass(frozen=True, slots=True)
class Timestamped[Content]:
    """A report with the time at which it came.

    Attributes:
        time_s: Time when it came, by the host's clock, in seconds.
        content: Content of the report.
    """

    time_s: float
    content: Content


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
        pack: Battery in the battery's own message.
        answers: Answers to commands, by command.
        texts: The last ones that were complete.
        boot_s: Time of the vehicle's clock, in seconds.
        restarts: Number of times that this clock went back.
    """

    system: int | None = None
    component: int | None = None
    heartbeat: Timestamped[Heartbeat] | None = None
    stranger: Heartbeat | None = None
    attitude: Timestamped[Attitude] | None = None
    position: Timestamped[LocalPosition] | None = None
    motion: Timestamped[MotionEstimate] | None = None
    battery: BatteryState | None = None
    pack: BatteryState | None = None
    answers: Mapping[int, Timestamped[Answer]] = field(default_factory=dict)
    texts: tuple[Timestamped[Text], ...] = ()
    boot_s: float = 0.0
    restarts: int = 0
    _chunks: tuple[Text, ...] = ()

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
        match message.content:
            case Heartbeat() as heartbeat:
                return replace(self, heartbeat=Timestamped(time_s, heartbeat))
            case Attitude() as attitude:
                return replace(self._at(attitude.boot_s), attitude=Timestamped(time_s, attitude))
            case LocalPosition() as position:
                return replace(self._at(position.boot_s), position=Timestamped(time_s, position))
            case MotionEstimate() as motion:
                return replace(self, motion=Timestamped(time_s, motion))
            case BatteryState(is_main=True) as battery:
                return replace(self, battery=battery)
            case BatteryState() as battery:
                return replace(self, pack=battery)
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

    def _at(self, boot_s: float) -> "VehicleState":
        has_restarted = boot_s < self.boot_s - _OVERTAKEN_S
        return replace(self, boot_s=boot_s, restarts=self.restarts + has_restarted)

    def _after_text(self, text: Text, time_s: float) -> "VehicleState":
        chunks: tuple[Text, ...] = ()
        if text.number:
            if text.chunk and self._chunks and self._chunks[-1].number == text.number:
                chunks = self._chunks[: _MOST_CHUNKS - 1]
            chunks = (*chunks, text)
            if not text.is_last:
                return replace(self, _chunks=chunks)
            text = replace(text, data=b"".join(chunk.data for chunk in chunks))
        return replace(self, texts=(*self.texts, Timestamped(time_s, text))[-_KEPT_TEXTS:], _chunks=())


def _is_for(answer: Answer, own: tuple[int, int]) -> bool:
    return answer.target_system in (0, own[0]) and answer.target_component in (0, own[1])
