"""Texts for a person at the ground station: cut into chunks, not too many a second, the same one not again and again.

Source: mavlink.io (STATUSTEXT). A text of up to 50 bytes goes as it is. A longer one goes in chunks of 50, of which one
that is shorter is the last: so a text that fills its chunks is followed by an empty one, and a chunk that would end
within a character is filled up with spaces.
"""

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from enum import IntEnum

from robosc_bridge.ground.schedule import Bucket
from robosc_bridge.ground.telemetry import Make
from robosc_bridge.protocol.mavlink_messages import CHUNK

LONGEST = 245
"""Bytes of a text; what is longer is cut."""

RATE_PER_S = 8.0
"""Messages a second, over some time."""

BURST = 12.0
"""Messages at once."""

REPEAT_S = 20.0
"""What still holds is told again after so long; the same news is not told again sooner."""

FLAPPING_S = 2.0
"""What comes and goes is told when it comes, but not sooner than this after it was told last."""

MOST_WAITING = 30
_MOST_RECENT = 200


class Severity(IntEnum):
    """MAV_SEVERITY, as far as it is used."""

    CRITICAL = 2
    ERROR = 3
    WARNING = 4
    NOTICE = 5
    INFO = 6


@dataclass(frozen=True)
class Chunk:
    """A piece of a text; number 0: it is a whole one."""

    data: bytes
    number: int
    place: int


def plain_text(text: str) -> str:
    """On one line, within `LONGEST` bytes."""
    line = "".join(character if character.isprintable() else " " for character in text)
    data = line.encode("utf-8", errors="replace")
    if len(data) <= LONGEST:
        return data.decode("utf-8")
    return data[: LONGEST - 3].decode("utf-8", errors="ignore") + "..."


def chunks(text: str, number: int) -> tuple[Chunk, ...]:
    """A text as it is sent.

    Args:
        text: Without the character 0.
        number: That tells it from other long ones, 1 to 65535.
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
    """A chunk as a message."""
    return lambda codec: codec.statustext_encode(int(severity), chunk.data, chunk.number, chunk.place)


class Texts:
    """What is to be told, and when."""

    def __init__(self) -> None:
        self._waiting: deque[tuple[Severity, Chunk]] = deque()
        self._recent: dict[str, float] = {}
        self._standing: frozenset[str] = frozenset()
        self._number = 0
        self._bucket = Bucket(RATE_PER_S, BURST)

    def say(self, now_s: float, severity: Severity, text: str, *, again_s: float = REPEAT_S) -> None:
        """Tell something, unless the same was told less than `again_s` ago."""
        text = plain_text(text)
        told_s = self._recent.get(text)
        if told_s is not None and now_s - told_s < again_s:
            return
        if len(self._waiting) >= MOST_WAITING:
            return
        if len(self._recent) >= _MOST_RECENT:
            self._recent = {said: time_s for said, time_s in self._recent.items() if now_s - time_s < REPEAT_S}
            if len(self._recent) >= _MOST_RECENT:
                return
        self._recent[text] = now_s
        self._number = self._number % 65535 + 1
        self._waiting.extend((severity, chunk) for chunk in chunks(text, self._number))

    def stand(self, now_s: float, holding: Iterable[tuple[Severity, str]]) -> None:
        """What holds now: told when it begins, and again every `REPEAT_S`."""
        standing = {plain_text(text): severity for severity, text in holding}
        for text, severity in standing.items():
            self.say(now_s, severity, text, again_s=REPEAT_S if text in self._standing else FLAPPING_S)
        self._standing = frozenset(standing)

    def forget(self) -> None:
        """Somebody listens anew, to whom nothing was told yet."""
        self._recent.clear()

    def take(self, now_s: float) -> list[Make]:
        """What goes out now."""
        self._bucket.pass_time(now_s)
        found = []
        while self._waiting and self._bucket.has_some:
            self._bucket.take()
            found.append(status_text(*self._waiting.popleft()))
        return found
