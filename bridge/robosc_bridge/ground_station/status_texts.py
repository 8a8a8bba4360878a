"""Texts for a person at the ground station: cut into chunks, not too many a second, the same one not again and again.

The grave ones go first. Answers to requests go last, and each sender has one place in which its answer waits: so no
sender can hold back the news of the robot by sending nonsense.

Source: mavlink.io (STATUSTEXT). A text of up to 50 bytes goes as it is. A longer one goes in chunks of 50, of which one
that is shorter is the last: so a text that fills its chunks is followed by an empty one, and a chunk that would end
within a character is filled up with spaces.
"""

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from enum import IntEnum

from robosc_bridge.ground_station.schedule import Bucket
from robosc_bridge.ground_station.telemetry import Make
from robosc_bridge.protocol.mavlink_messages import CHUNK

LONGEST = 245
"""Bytes of a text; what is longer is cut."""

RATE_PER_S = 8.0
"""Messages a second, over some time."""

BURST = 12.0
"""Messages at once."""

REPEAT_S = 20.0
"""Time after which a text that still holds is reported again, in seconds; the same text is not sent again sooner."""

FLAPPING_S = 2.0
"""Shortest time between two reports of something that comes and goes, in seconds.

It is reported when it comes, but not sooner than this after it was reported last.
"""

MOST_WAITING = 30
"""Chunks that wait; the last text of them may go beyond it."""

_MOST_RECENT = 200


class Severity(IntEnum):
    """MAV_SEVERITY, as far as it is used."""

    CRITICAL = 2
    ERROR = 3
    WARNING = 4
    NOTICE = 5
    INFO = 6


type Sender = tuple[int, int]


@dataclass(frozen=True)
class Chunk:
    """Chunk of a text; number 0: the whole text."""

    data: bytes
    number: int
    place: int


def plain_text(text: str) -> str:
    """Return a text on one line, within `LONGEST` bytes."""
    line = "".join(character if character.isprintable() else " " for character in text)
    data = line.encode("utf-8", errors="replace")
    if len(data) <= LONGEST:
        return data.decode("utf-8")
    return data[: LONGEST - 3].decode("utf-8", errors="ignore") + "..."


def chunks(text: str, number: int) -> tuple[Chunk, ...]:
    """Return the chunks in which a text is sent.

    Args:
        text: Text without the character 0.
        number: Number that distinguishes it from other long texts, 1 to 65535.
    """
    data = text.encode("utf-8")
    if len(data) <= CHUNK:
        return (Chunk(data, 0, 0),)
    pieces: list[bytes] = []
    while len(data) >= CHUNK:
        end = CHUNK
        while end < len(data) and data[end] & 0xC0 == 0x80:
            end -= 1
        pieces.append(data[:end].ljust(CHUNK))
        data = data[end:]
    pieces.append(data)
    return tuple(Chunk(piece, number, place) for place, piece in enumerate(pieces))


def status_text(severity: Severity, chunk: Chunk) -> Make:
    """Return a chunk as a message."""
    return lambda codec: codec.statustext_encode(int(severity), chunk.data, chunk.number, chunk.place)


@dataclass
class _Waiting:
    severity: Severity
    text: str
    pieces: deque[Chunk]
    asked_by: Sender | None

    @property
    def rank(self) -> tuple[bool, int]:
        """Rank of the text: smaller ranks are sent first."""
        return self.asked_by is not None, self.severity


class StatusTexts:
    """Queue of texts to send, and the times of texts that were sent."""

    def __init__(self) -> None:
        self._waiting: list[_Waiting] = []
        # The text of which a piece was sent: a station that joins pieces must get the others next.
        self._begun: _Waiting | None = None
        self._recent: dict[str, float] = {}
        self._standing: frozenset[str] = frozenset()
        self._number = 0
        self._bucket = Bucket(RATE_PER_S, BURST)

    def say(
        self,
        now_s: float,
        severity: Severity,
        text: str,
        *,
        again_s: float = REPEAT_S,
        asked_by: Sender | None = None,
    ) -> None:
        """Queue a text, unless the same one was sent less than `again_s` ago.

        Args:
            now_s: The time.
            severity: Severity of the text; graver texts are sent first.
            text: Text of any length.
            again_s: Shortest time between two equal texts, in seconds.
            asked_by: System and component whose request it answers; None: it is news of the robot, which is sent first.
        """
        text = plain_text(text)
        sent_s = self._recent.get(text)
        if sent_s is not None and now_s - sent_s < again_s:
            return
        if asked_by is not None:
            self._waiting = [item for item in self._waiting if item.asked_by != asked_by]
        if any(item.text == text and item.asked_by == asked_by for item in self._waiting):
            return
        self._number = self._number % 65535 + 1
        item = _Waiting(severity, text, deque(chunks(text, self._number)), asked_by)
        if not self._find_room(item):
            return
        self._waiting.append(item)
        if again_s > 0.0:
            self._note(text, now_s)

    def _find_room(self, item: _Waiting) -> bool:
        """Return True if it may wait; what is less grave makes room for it, the latest first."""
        while sum(len(waiting.pieces) for waiting in self._waiting) >= MOST_WAITING:
            last = max(reversed(self._waiting), key=lambda waiting: waiting.rank)
            if last.rank <= item.rank:
                return False
            self._waiting.remove(last)
            # The dropped text was not sent: the next attempt to send it counts as new.
            self._recent.pop(last.text, None)
        return True

    def _note(self, text: str, now_s: float) -> None:
        # The oldest is first.
        self._recent.pop(text, None)
        if len(self._recent) >= _MOST_RECENT:
            del self._recent[next(iter(self._recent))]
        self._recent[text] = now_s

    def repeat(self, now_s: float, holding: Iterable[tuple[Severity, str]]) -> None:
        """Send the notices that hold now: when they begin, and again every `REPEAT_S`."""
        blocking_notices = {plain_text(text): severity for severity, text in holding}
        for text, severity in blocking_notices.items():
            self.say(now_s, severity, text, again_s=REPEAT_S if text in self._standing else FLAPPING_S)
        self._standing = frozenset(blocking_notices)

    def forget(self) -> None:
        """Forget which texts were sent, for a ground station that has just connected."""
        self._recent.clear()

    def take(self, now_s: float) -> list[Make]:
        """Return the messages to send now."""
        self._bucket.pass_time(now_s)
        found = []
        while self._bucket.has_some and (item := self._next()) is not None:
            self._bucket.take()
            found.append(status_text(item.severity, item.pieces.popleft()))
            self._begun = item if item.pieces else None
        return found

    def _next(self) -> _Waiting | None:
        if self._begun is None and self._waiting:
            self._begun = min(self._waiting, key=lambda waiting: waiting.rank)
            self._waiting.remove(self._begun)
        return self._begun
