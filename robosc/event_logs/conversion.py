"""Event logs as MCAP files, which Foxglove, `ros2 bag` and PlotJuggler open. The conversion needs no installed ROS.

The format is that of https://mcap.dev: schemas `ros2msg`, messages in CDR, profile `ros2`, compressed by Zstandard.
"""

import heapq
import itertools
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from robosc.errors import RoboscError
from robosc.event_logs.entries import notes_of
from robosc.event_logs.messages import (
    Message,
    definition_text,
    happening_messages,
    log_messages,
    motion_messages,
    topics_of,
)
from robosc.event_logs.motions import motion_of_log
from robosc.event_logs.reading import LogReader


class ConversionError(RoboscError):
    """A log cannot be converted as asked."""


class ConversionUnavailableError(RoboscError, LookupError):
    """A package that converts is not installed."""


@dataclass(frozen=True, slots=True)
class Converted:
    """Content of a converted log.

    Attributes:
        path: Its file.
        entries: Number of the log's entries.
        messages: Number of messages that they have become, with those of the motion.
        topics: Type of each topic.
        has_motion: True if the motion of the robot is in it.
        notes: Remarks on how whole the log is, in sentences.
    """

    path: Path
    entries: int
    messages: int
    topics: dict[str, str]
    has_motion: bool
    notes: tuple[str, ...]


def convert_log(log: str | Path, path: str | Path, *, motion: Path | None = None) -> Converted:
    """Convert a log into an MCAP file. The same log gives the same file; a long one takes no room.

    Args:
        log: The log, which is gone through twice.
        path: Output file: `.mcap`.
        motion: Record of the robot's motion; None: `motion.jsonl` beside the log, if it is of the same time.

    Raises:
        ConversionError: The output is no MCAP file by its name.
        ConversionUnavailableError: The extra `robosc[mcap]` is not installed.
        LogError: The log is none, or has what no message can hold.
        MotionOfLogError: The record of motion cannot be used.
        OSError: A file cannot be read or written.
    """
    target, name = Path(path), Path(log).name
    if target.suffix.lower() != ".mcap":
        raise ConversionError(f"{target}: logs are converted to .mcap files")
    writer_class = _writer_class()
    reader = LogReader(log)
    topics = topics_of(reader, str(log))
    moved = motion_of_log(log, motion, topics.begin_s, topics.end_s)
    types = topics.types(moved)
    # The log may grow while it is read: the second time only what was seen the first time is taken.
    streams = [log_messages(itertools.islice(reader, topics.entries), topics, name)]
    if moved is not None:
        streams += [motion_messages(moved), happening_messages(moved, name)]
    try:
        with target.open("wb") as stream:
            count = _write(writer_class(stream), types, heapq.merge(*streams, key=lambda each: each.time_ns))
    except BaseException:
        # Half a file would open, too.
        target.unlink(missing_ok=True)
        raise
    empty = () if topics.entries else ("the log has no entries",)
    notes = (*empty, *notes_of(reader.dropped, reader.torn_line))
    return Converted(target, topics.entries, count, types, moved is not None, notes)


def _write(writer: Any, types: Mapping[str, str], messages: Iterable[Message]) -> int:
    """Write messages; return their number."""
    schemas = {type_: writer.register_msgdef(type_, definition_text(type_)) for type_ in sorted(set(types.values()))}
    count = 0
    for message in messages:
        schema = schemas[types[message.topic]]
        writer.write_message(message.topic, schema, message.content, message.time_ns, sequence=count)
        count += 1
    writer.finish()
    return count


def _writer_class() -> Any:
    """Return the writer of the package that knows the messages of ROS 2, loaded on use.

    Raises:
        ConversionUnavailableError: It is not installed.
    """
    try:
        from mcap_ros2.writer import Writer
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] not in ("mcap", "mcap_ros2"):
            raise
        raise ConversionUnavailableError(
            "an MCAP file needs mcap and mcap-ros2-support: pip install 'robosc[mcap]'"
        ) from error
    return Writer
