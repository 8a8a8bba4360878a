"""Redaction of a capture: data that identifies its owner is removed, and data for testing a driver is kept.

| what | what becomes of it |
|---|---|
| time of day | the capture begins in 1970; times between records stay |
| ports and addresses | removed; `/dev/serial/by-id` holds serial numbers, an address reveals a network |
| options that name files, such as `signing_key` | removed |
| problems of lines in words | removed, as they name ports |
| MAVLink: places on the earth, names, serial numbers | only messages that the drivers read or send stay |
| MAVLink: texts | removed, as autopilots send their serial numbers there |
| MAVLink: signatures | removed, and the packets are as if they had never been signed |
| LiDARs: texts of six characters or more between frames | overwritten: some send their serial number at the start |

The ranges of a LiDAR show the shape of a room, and are kept; `without` leaves out the whole line.
"""

import re
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import replace
from itertools import accumulate
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from robosc_bridge.captures.capture_file import Capture, CaptureError, Kind, LineInfo, Record, event
from robosc_bridge.devices.lidar import LDS01, LDS02, LDS03
from robosc_bridge.protocol.framing import FrameDecoder
from robosc_bridge.protocol.mavlink import Codec, Decoder
from robosc_bridge.protocol.mavlink_messages import READERS

_KEPT_OPTIONS = frozenset(
    {
        "acceleration_rad_s2", "answer_limit_s", "baud", "bauds", "calibrates_gyro", "front_rad", "is_upside_down",
        "motion_limit_s", "motors", "own_component", "own_system", "system", "telemetry_s", "watchdog_s",
    }
)  # fmt: skip
_KEPT_EVENTS = frozenset({"event", "baud", "is_on", "records"})
_SENT = frozenset(
    {
        dialect.MAVLINK_MSG_ID_HEARTBEAT,
        dialect.MAVLINK_MSG_ID_COMMAND_LONG,
        dialect.MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED,
    }
)
_KEPT_MESSAGES = (frozenset(READERS) | _SENT) - {dialect.MAVLINK_MSG_ID_STATUSTEXT}
_LIDARS = {model.name: model for model in (LDS01, LDS02, LDS03)}
_READABLE = re.compile(rb"[ -~]{6,}")
# Longer than two frames of any LiDAR.
_AROUND = 200
_SERVOS = ("opencr", "dynamixel")


def redacted(capture: Capture, without: Collection[str] = ()) -> Capture:
    """Return the capture without what identifies its owner.

    Args:
        capture: The capture.
        without: Names of lines that are left out.

    Raises:
        CaptureError: It has no such line, or a line of a driver whose secrets are unknown.
    """
    unknown = sorted(set(without) - set(capture.lines))
    if unknown:
        raise CaptureError(f"the capture has no line '{unknown[0]}'; it has {', '.join(capture.lines)}")
    lines = {name: _info(info) for name, info in capture.lines.items() if name not in without}
    if not lines:
        raise CaptureError("no line of the capture would be left")
    found: list[Record] = []
    for name, info in lines.items():
        records = [record for record in capture.records if record.line == name]
        found += _records(info, records, capture.begin_ns)
    # Sorting is stable: of one time, the order of a line stays.
    return Capture(lines, tuple(sorted(found, key=lambda record: record.time_ns)), capture.is_whole)


def _info(info: LineInfo) -> LineInfo:
    if info.driver not in (*_LIDARS, *_SERVOS, "mavlink-rover"):
        raise CaptureError(
            f"line '{info.name}': it is unknown what its driver '{info.driver}' reveals about the owner; leave it out "
            f"with --without {info.name}"
        )
    options = {name: value for name, value in info.options.items() if name in _KEPT_OPTIONS}
    return replace(info, port="", options=options)


def _records(info: LineInfo, records: list[Record], begin_ns: int) -> Iterator[Record]:
    data_of = {id(record): _event(record) for record in records if record.kind is Kind.EVENTS}
    for kind in (Kind.IN, Kind.OUT):
        passed = [record for record in records if record.kind is kind]
        cleaned = _cleaned(info, [record.data for record in passed])
        data_of |= {id(record): data for record, data in zip(passed, cleaned, strict=True)}
    for record in records:
        if data_of[id(record)]:
            yield replace(record, time_ns=record.time_ns - begin_ns, data=data_of[id(record)])


def _event(record: Record) -> bytes:
    values: dict[str, Any] = {name: value for name, value in record.event.items() if name in _KEPT_EVENTS}
    return event(str(values.pop("event", "")), **values)


def _cleaned(info: LineInfo, pieces: list[bytes]) -> list[bytes]:
    """The bytes of one direction, piece by piece; servos and OpenCR send nothing that identifies an owner."""
    if info.driver == "mavlink-rover":
        decoder = Decoder(Codec(1, 1), lambda message: message)
        return [
            b"".join(_unsigned(message) for message in decoder.feed(piece) if message.get_msgId() in _KEPT_MESSAGES)
            for piece in pieces
        ]
    return _without_texts(_LIDARS[info.driver].make_decoder, pieces) if info.driver in _LIDARS else pieces


def _without_texts(make: Callable[[], FrameDecoder[Any]], pieces: list[bytes]) -> list[bytes]:
    """Overwrite texts; one within a frame is chance, as what a frame holds is measured, and stays."""
    data = bytearray(b"".join(pieces))
    for found in _READABLE.finditer(bytes(data)):
        begin, end = found.span()
        around = bytes(data[max(begin - _AROUND, 0) : end + _AROUND])
        hidden = around.replace(found.group(), b"x" * len(found.group()))
        if make().feed(around) == make().feed(hidden):
            data[begin:end] = b"x" * (end - begin)
    ends = list(accumulate(map(len, pieces)))
    return [bytes(data[end - len(piece) : end]) for end, piece in zip(ends, pieces, strict=True)]


def _unsigned(message: Any) -> bytes:
    """The packet of a message of the library, as its sender would have sent it without signing."""
    header = message.get_header()
    codec: Any = dialect.MAVLink(None, srcSystem=header.srcSystem, srcComponent=header.srcComponent)
    codec.seq = header.seq
    return bytes(message.pack(codec))


def metadata_of(lines: Mapping[str, LineInfo]) -> list[str]:
    """Return one line of text for each line of a capture."""
    return [
        f"{info.name}: {info.driver}{' ' + info.robot if info.robot else ''}{' at ' + info.port if info.port else ''}"
        for info in lines.values()
    ]
