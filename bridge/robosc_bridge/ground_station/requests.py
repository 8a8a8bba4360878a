"""Answers to what ground stations request when they connect, so that they do not repeat it.

Sources: mavlink.io (parameter, mission, FTP, PING and TIMESYNC microservices). There are two parameters, which can be
read and not changed; no missions; no files.
"""

import struct
from typing import Any

from robosc_bridge.ground_station.settings import GroundSettings
from robosc_bridge.ground_station.telemetry import Make
from robosc_bridge.protocol.mavlink_messages import Incoming

PARAMETERS = ("SYSID_THISMAV", "SR_INTERVAL")
"""Number of the vehicle; seconds between two messages of pose, and of obstacles."""

_REAL32 = 9
_NAK, _UNKNOWN_COMMAND = 129, 7
_FILE_PAYLOAD = 251


def answers(number: int, message: Any, sender: tuple[int, int], settings: GroundSettings, now_s: float) -> list[Make]:
    """Return the answers to a request; empty: the message is no request.

    Args:
        number: Number of the message.
        message: The library's message, addressed to us.
        sender: Sender of the message.
        settings: Settings of the link.
        now_s: The time.
    """
    match number:
        case Incoming.PING if message.target_system == 0 and message.target_component == 0:
            return [lambda codec: codec.ping_encode(message.time_usec, message.seq, *sender)]
        case Incoming.PARAM_REQUEST_READ:
            place = message.param_index if message.param_index >= 0 else _place(message.param_id)
            return [_parameter(place, settings)] if place in range(len(PARAMETERS)) else []
        case Incoming.PARAM_REQUEST_LIST:
            return [_parameter(place, settings) for place in range(len(PARAMETERS))]
        case Incoming.PARAM_SET:
            # That it is as it was says that it cannot be changed.
            place = _place(message.param_id)
            return [_parameter(place, settings)] if place >= 0 else []
        case Incoming.MISSION_REQUEST_LIST:
            return [lambda codec: codec.mission_count_encode(*sender, 0, message.mission_type)]
        case Incoming.FILE_TRANSFER:
            return [_no_files(message, sender)]
        case Incoming.TIMESYNC if message.tc1 == 0:
            return [lambda codec: codec.timesync_encode(int(now_s * 1e9), message.ts1)]
    return []


def _place(name: str) -> int:
    return PARAMETERS.index(name) if name in PARAMETERS else -1


def _parameter(place: int, settings: GroundSettings) -> Make:
    name = PARAMETERS[place]
    value = {"SYSID_THISMAV": float(settings.system), "SR_INTERVAL": settings.interval_s}[name]
    return lambda codec: codec.param_value_encode(name.encode("ascii"), value, _REAL32, len(PARAMETERS), place)


def _no_files(message: Any, sender: tuple[int, int]) -> Make:
    asked = bytes(message.payload)
    sequence, session, operation = struct.unpack_from("<HBB", asked)
    head = struct.pack("<HBBBBBB", (sequence + 1) % 65536, session, _NAK, 1, operation, 0, 0)
    payload = (head + asked[8:12] + bytes((_UNKNOWN_COMMAND,))).ljust(_FILE_PAYLOAD, b"\0")
    return lambda codec: codec.file_transfer_protocol_encode(0, *sender, list(payload))
