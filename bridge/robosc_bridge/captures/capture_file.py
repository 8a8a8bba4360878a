"""A capture in a file: an MCAP file (https://mcap.dev) with a channel for each line and direction.

| topic | message encoding | a message is |
|---|---|---|
| `base/out`, `base/in`, `scanner/in`, ... | `octets` | bytes that were written or read at once |
| `base/events`, ... | `json` | a happening: the line was opened, set to a speed, emptied, closed or lost |

The metadata of a channel describe its line: driver, robot, options. While a capture is recorded, its messages are not
gathered in chunks, so that a file that ends in the middle only lacks its last messages.
"""

import json
import math
import struct
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import IO, Any

from mcap.exceptions import McapError
from mcap.records import Channel, Message
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, IndexType, Writer
from zstandard import ZstdError

from robosc_bridge.errors import BridgeError

SUFFIX = ".mcap"
MAGIC = b"\x89MCAP0\r\n"
_PROFILE = "robosc-bridge-capture"
_LONGEST_RECORD = 1 << 26
# The library's own, and those of what it reads with: structures, compression by lz4 or zstd, numbers of channels.
_DAMAGED = (McapError, struct.error, RuntimeError, ZstdError, EOFError, LookupError, ValueError, OverflowError)


class CaptureError(BridgeError):
    """A capture cannot be written or read; the message says why."""


class Kind(StrEnum):
    """Kind of a record, which is the end of its topic."""

    OUT = "out"
    IN = "in"
    EVENTS = "events"


@dataclass(frozen=True)
class LineInfo:
    """A line, with what a reader needs to know of it.

    Attributes:
        name: Name: `base` or `scanner`.
        driver: Driver that uses it.
        robot: Name of the robot; empty: it has none.
        options: Options of the driver.
        port: Path or address; empty: removed.
        separation_m: Distance between the wheels of a robot that has no name, in metres; 0: it is not known.
    """

    name: str
    driver: str
    robot: str = ""
    options: Mapping[str, Any] = field(default_factory=dict)
    port: str = ""
    separation_m: float = 0.0

    @property
    def metadata(self) -> dict[str, str]:
        """Metadata of a channel."""
        separation = f"{self.separation_m}" if self.separation_m else ""
        texts = {"driver": self.driver, "robot": self.robot, "port": self.port, "wheel_separation_m": separation}
        return {name: text for name, text in texts.items() if text} | {"options": json.dumps(dict(self.options))}

    @classmethod
    def of(cls, name: str, metadata: Mapping[str, str]) -> "LineInfo":
        """Return the line of a channel.

        Raises:
            ValueError: These are no metadata of one.
        """
        options = json.loads(metadata.get("options", "{}"))
        if not isinstance(options, dict):
            raise ValueError("options of a line are no mapping")
        separation_m = float(metadata.get("wheel_separation_m", "0"))
        if not 0.0 <= separation_m < math.inf:
            raise ValueError("the distance between the wheels is not a number of metres")
        return cls(
            name,
            metadata.get("driver", ""),
            metadata.get("robot", ""),
            options,
            metadata.get("port", ""),
            separation_m,
        )


@dataclass(frozen=True, slots=True)
class Record:
    """Bytes that were read or written at once, or an event of the line.

    Attributes:
        time_ns: Time in nanoseconds since 1970: for bytes that were read, just after that; for bytes that were written,
            just before.
        line: Name of the line.
        kind: Direction of the bytes, or the kind for an event.
        data: Bytes; for an event, its JSON.
    """

    time_ns: int
    line: str
    kind: Kind
    data: bytes

    @property
    def event(self) -> dict[str, Any]:
        """The happening."""
        found = json.loads(self.data)
        return found if isinstance(found, dict) else {}


def event(name: str, **values: object) -> bytes:
    """Return the data of a happening."""
    return json.dumps({"event": name, **values}).encode()


class CaptureWriter:
    """Writer of a capture.

    Args:
        stream: File that it is written to, which still belongs to its owner.
        lines: Lines whose records are written, by name.
        is_packed: True to gather and compress messages, as in files that are kept.
    """

    def __init__(self, stream: IO[bytes], lines: Mapping[str, LineInfo], *, is_packed: bool = False) -> None:
        self._writer = Writer(
            stream,
            compression=CompressionType.ZSTD if is_packed else CompressionType.NONE,
            index_types=IndexType.ALL if is_packed else IndexType.NONE,
            use_chunking=is_packed,
        )
        self._writer.start(_PROFILE, "robosc-bridge")
        self._channels = {
            (name, kind): self._writer.register_channel(
                f"{name}/{kind}", "json" if kind is Kind.EVENTS else "octets", 0, info.metadata
            )
            for name, info in lines.items()
            for kind in Kind
        }

    def write(self, record: Record) -> None:
        """Write a record.

        Raises:
            OSError: The file cannot be written.
        """
        channel = self._channels[record.line, record.kind]
        self._writer.add_message(channel, record.time_ns, record.data, record.time_ns)

    def finish(self) -> None:
        """Write the end of the file.

        Raises:
            OSError: The file cannot be written.
        """
        self._writer.finish()


@dataclass(frozen=True)
class Capture:
    """A capture that was read.

    Attributes:
        lines: Its lines, by name.
        records: Records, in the order in which they were written.
        is_whole: True if the file is complete; else its recording was interrupted.
    """

    lines: Mapping[str, LineInfo]
    records: tuple[Record, ...]
    is_whole: bool = True

    @property
    def begin_ns(self) -> int:
        """Time of the first record; 0: there is none."""
        return self.records[0].time_ns if self.records else 0


def read_capture(file: Path) -> Capture:
    """Read a capture.

    Raises:
        CaptureError: It is none, or is damaged before its first record.
        OSError: The file cannot be read.
    """
    lines: dict[str, LineInfo] = {}
    channels: dict[int, tuple[str, Kind]] = {}
    records: list[Record] = []
    is_whole = True
    with file.open("rb") as stream:
        if stream.read(len(MAGIC)) != MAGIC:
            raise CaptureError(f"{file}: not a capture: it is no MCAP file")
        stream.seek(0)
        try:
            for item in _items(stream):
                if isinstance(item, Channel):
                    name, _, kind = item.topic.rpartition("/")
                    channels[item.id] = (name, Kind(kind))
                    lines.setdefault(name, LineInfo.of(name, item.metadata))
                else:
                    name, kind_of = channels[item.channel_id]
                    records.append(Record(item.log_time, name, kind_of, item.data))
        except _DAMAGED as error:
            if not lines:
                raise CaptureError(f"{file}: not a capture of `robosc-bridge run --record`: {error}") from error
            is_whole = False
    if not lines:
        raise CaptureError(f"{file}: not a capture of `robosc-bridge run --record`: it names no line")
    return Capture(lines, tuple(records), is_whole)


def _items(stream: IO[bytes]) -> Iterator[Channel | Message]:
    for item in StreamReader(stream, record_size_limit=_LONGEST_RECORD).records:
        if isinstance(item, (Channel, Message)):
            yield item


def write_capture(file: Path, lines: Mapping[str, LineInfo], records: Iterable[Record]) -> None:
    """Write a whole capture, packed.

    Raises:
        FileExistsError: There is such a file already.
        OSError: It cannot be written.
    """
    with file.open("xb") as stream:
        writer = CaptureWriter(stream, lines, is_packed=True)
        for record in records:
            writer.write(record)
        writer.finish()
