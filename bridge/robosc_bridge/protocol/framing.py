"""Finding frames in a stream of bytes that begins anywhere, comes in pieces of any size, and has noise in it.

A frame counts only when its check holds. Where it does not, the search goes on one byte further, so that what looks
like a header inside other data never takes a true frame behind it along. What is found depends on the bytes alone, not
on how reads cut them: `feed(a) + feed(b)` is `feed(a + b)`. Only `idle` knows of time: whoever cannot wait until a
header is proved false by what follows calls it when nothing more comes.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar


@dataclass
class FrameCounts:
    """Counts of a decoder; every byte that was fed is in a frame, skipped, or still waiting for others.

    Attributes:
        frames: Well-formed frames.
        bad_frames: Headers that were followed by a wrong check or impossible contents.
        skipped_bytes: Bytes that belong to no well-formed frame.
    """

    frames: int = 0
    bad_frames: int = 0
    skipped_bytes: int = 0


class FrameDecoder[Frame](ABC):
    """Decoder that finds the frames of one format.

    Holds fewer bytes than the longest frame and `look_ahead` have, whatever comes in.

    Attributes:
        first_byte: Byte that every header begins with, unless `_begin` says else.
        header_length: Bytes from which the length of a frame is known.
        look_ahead: Bytes behind a frame that `_frame` wants to see.
        counts: Counts so far.
    """

    first_byte: ClassVar[int]
    header_length: ClassVar[int]
    look_ahead: int = 0

    def __init__(self) -> None:
        self.counts = FrameCounts()
        self._waiting = b""
        self._is_aligned = False

    def _begin(self, data: bytes, at: int) -> int:
        """Return the place where the next header may begin; -1: nowhere."""
        return data.find(self.first_byte, at)

    @abstractmethod
    def _length(self, data: bytes, at: int) -> int:
        """Return the length of the frame whose `header_length` bytes are there; 0: this is no header."""

    @abstractmethod
    def _frame(self, data: bytes, at: int, length: int) -> Frame | None:
        """Return the content of a complete frame; None: its check fails or it says what cannot be."""

    def _align(self, is_aligned: bool) -> None:
        """Note whether the next bytes follow a well-formed frame without a gap."""
        self._is_aligned = is_aligned

    def feed(self, data: bytes) -> list[Frame]:
        """The frames that these bytes complete, in their order."""
        counts = self.counts
        data = self._waiting + data
        found: list[Frame] = []
        begin = 0
        end = len(data)
        while begin < end:
            at = self._begin(data, begin)
            if at != begin:
                if self._is_aligned:
                    self._align(False)
                counts.skipped_bytes += (end if at < 0 else at) - begin
                begin = at
                if at < 0:
                    begin = end
                    break
            if begin + self.header_length > end:
                break
            length = self._length(data, begin)
            if length:
                if begin + length + self.look_ahead > end:
                    break
                frame = self._frame(data, begin, length)
                if frame is not None:
                    found.append(frame)
                    begin += length
                    self._align(True)
                    continue
                counts.bad_frames += 1
            if self._is_aligned:
                self._align(False)
            begin += 1
            counts.skipped_bytes += 1
        self._waiting = data[begin:]
        counts.frames += len(found)
        return found

    def idle(self) -> list[Frame]:
        """The whole frames behind a header that waits for more, when nothing has come for longer than in any frame.

        That header was false, or its frame was cut. Where no whole frame is behind it, it waits on, and nothing is lost
        of a frame that comes slowly.
        """
        found: list[Frame] = []
        at = 1
        while (at := self._begin(self._waiting, at)) >= 0:
            frame, length = self._whole(self._waiting, at)
            if frame is None:
                at += 1
                continue
            self.counts.bad_frames += 1
            self.counts.frames += 1
            self.counts.skipped_bytes += at
            rest = self._waiting[at + length :]
            self._waiting = b""
            self._align(True)
            found += [frame, *self.feed(rest)]
            at = 1
        return found

    def _whole(self, data: bytes, at: int) -> tuple[Frame | None, int]:
        if at + self.header_length > len(data):
            return None, 0
        length = self._length(data, at)
        if not length or at + length + self.look_ahead > len(data):
            return None, 0
        return self._frame(data, at, length), length

    def forget(self) -> None:
        """Begin anew: what comes next is not what followed what came last."""
        self.counts.skipped_bytes += len(self._waiting)
        self._waiting = b""
        self._align(False)
