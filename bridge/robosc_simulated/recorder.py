"""A record of all bytes on the lines, with the time of each: what an oscilloscope on the wires would show.

One line of text for each read or write at the device's end: seconds of the monotonic clock, which other processes on
this computer share, the line, `>` to the device or `<` to the host, and the bytes.

    81253.120834 base > fffffd00fe0d00836800040001000000000200000000b0f1
    81253.124310 scanner < 542c680be100...
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

from robosc_simulated.output import Sink

Tap = Callable[[bool, float, bytes], None]
"""Takes whether the host has sent them, when, and the bytes; called under the lock of the line's time."""


@dataclass(frozen=True)
class Record:
    """Bytes that passed at once.

    Attributes:
        time_s: Time in seconds; to the host: before they were written; from the host: once they were read.
        line: Name of the line, such as `base`.
        is_from_host: True if the host has sent them.
        data: The bytes.
    """

    time_s: float
    line: str
    is_from_host: bool
    data: bytes


class Recorder:
    """Writer of records.

    Args:
        stream: Destination, such as an `Output`; is closed by whoever opened it.
    """

    def __init__(self, stream: Sink) -> None:
        self._stream = stream

    def tap(self, line: str) -> Tap:
        """Return the function that records the bytes of a line."""

        def record(is_from_host: bool, time_s: float, data: bytes) -> None:
            self._stream.write(f"{time_s:.6f} {line} {'>' if is_from_host else '<'} {data.hex()}\n")

        return record


def read_records(lines: Iterable[str]) -> Iterator[Record]:
    """Yield the records that a recorder wrote.

    Raises:
        ValueError: It is no record.
    """
    for line in lines:
        time_s, name, direction, data = line.split()
        yield Record(float(time_s), name, direction == ">", bytes.fromhex(data))
