"""Frames on the pipes between the twin and its rospy side: JSON objects, each with bytes, after their lengths.

    4 bytes   length of the object, big-endian
    4 bytes   length of the bytes, big-endian
    ...       the object: JSON in UTF-8, `kind` says what it is
    ...       the bytes: numbers of a scan, pixels of a picture

Both sides import this file: it stands on the standard library and Python 3.8 alone.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator
from typing import Any, NamedTuple

MOST_HEAD = 64 * 1024
MOST_DATA = 4 * 1024 * 1024
_LENGTHS = struct.Struct(">II")


class FrameError(ValueError):
    """Received data that is no frame."""


class Frame(NamedTuple):
    """A message between the two sides.

    Attributes:
        head: Kind of the message, and its small values.
        data: Its large ones.
    """

    head: dict[str, Any]
    data: bytes = b""


def encode(head: dict[str, Any], data: bytes = b"") -> bytes:
    """A frame as bytes.

    Raises:
        FrameError: It is too large.
    """
    text = json.dumps(head, separators=(",", ":")).encode()
    if len(text) > MOST_HEAD or len(data) > MOST_DATA:
        raise FrameError(f"a frame of {len(text)} and {len(data)} bytes is too large")
    return _LENGTHS.pack(len(text), len(data)) + text + data


class Decoder:
    """Makes frames of bytes that come in any pieces."""

    def __init__(self) -> None:
        self._rest = bytearray()

    def feed(self, data: bytes) -> Iterator[Frame]:
        """Yield the frames that are complete now.

        Raises:
            FrameError: The data is too large or no JSON object with a kind; nothing after it can be read.
        """
        self._rest += data
        while len(self._rest) >= _LENGTHS.size:
            head_size, data_size = _LENGTHS.unpack_from(self._rest)
            if head_size > MOST_HEAD or data_size > MOST_DATA:
                raise FrameError(f"a frame of {head_size} and {data_size} bytes is announced")
            head_end = _LENGTHS.size + head_size
            end = head_end + data_size
            if len(self._rest) < end:
                return
            head = _head(bytes(self._rest[_LENGTHS.size : head_end]))
            frame = Frame(head, bytes(self._rest[head_end:end]))
            del self._rest[:end]
            yield frame


def _head(text: bytes) -> dict[str, Any]:
    try:
        head = json.loads(text)
    # A deeply nested one ends in a RecursionError.
    except (ValueError, RecursionError) as error:
        raise FrameError("a frame's head is no JSON") from error
    if not isinstance(head, dict) or not isinstance(head.get("kind"), str):
        raise FrameError("a frame's head is not an object with a kind")
    return head
