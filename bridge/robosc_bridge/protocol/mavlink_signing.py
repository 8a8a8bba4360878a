"""The key of MAVLink signing, and its time, which must never be used twice, not even across restarts.

Source: mavlink.io, "Message Signing". It says who sent a packet; it hides nothing. Of this package it alone reads files
and the clock.
"""

import logging
import stat
import time
from dataclasses import dataclass
from pathlib import Path

from robosc_bridge.errors import DeviceError

_log = logging.getLogger(__name__)

KEY_LENGTH = 32
"""Bytes of a key of signing."""

_HEXADECIMAL = frozenset(b"0123456789abcdefABCDEF")
_EPOCH_S = 1_420_070_400  # 2015-01-01 in UTC.
_UNITS_PER_S = 100_000
# A sender that restarts within this time is ahead of the clock by as much; others are heard up to a minute behind.
_RESERVED = 10 * _UNITS_PER_S


class SigningError(DeviceError):
    """The key is missing, or the time of the last packet cannot be kept."""


@dataclass(frozen=True, slots=True)
class Signing:
    """Signing of packets.

    Attributes:
        key_file: File with 32 bytes, or 64 hexadecimal digits. Beside it, with the ending `.timestamp`, the time is
            kept.
        link: Number of the signed stream, 0 to 255: another one for every line to the same vehicle.
    """

    key_file: Path
    link: int = 0

    def check(self) -> None:
        """Read the key.

        Raises:
            SigningError: There is none.
        """
        _read_key(self.key_file)

    def begin(self) -> "SigningTime":
        """The key, and a time after all that were used.

        Raises:
            SigningError: There is no key, or the time cannot be kept.
        """
        return SigningTime(_read_key(self.key_file), self.key_file.with_name(self.key_file.name + ".timestamp"))


class SigningTime:
    """A time that only goes on.

    It is reserved in steps ahead of what is used, so that a file is written every ten seconds and a program that is
    killed has used nothing beyond what its successor begins with.

    Args:
        key: Key of signing.
        path: File that the time is kept in.

    Raises:
        SigningError: It cannot be kept there.
    """

    def __init__(self, key: bytes, path: Path) -> None:
        self.key = key
        self._path = path
        try:
            self._least = int(path.read_text(encoding="ascii")) if path.exists() else 0
        except (OSError, ValueError) as error:
            raise SigningError(f"{path}: the time of the last signed packet cannot be read") from error
        self._reserved = 0
        self.reserve(self.timestamp())

    def timestamp(self) -> int:
        """Now, and never before what was used; in units of 10 us since 2015."""
        return max(self._least, int((time.time() - _EPOCH_S) * _UNITS_PER_S))

    def reserve(self, timestamp: int) -> None:
        """See to it that no successor uses a time up to this one.

        Raises:
            SigningError: It cannot be kept.
        """
        if timestamp < self._reserved:
            return
        self._keep(timestamp + _RESERVED)

    def release(self, timestamp: int) -> None:
        """Give back the reserved times: a successor may begin with this one.

        Raises:
            SigningError: It cannot be kept.
        """
        self._keep(timestamp)

    def _keep(self, timestamp: int) -> None:
        self._reserved = timestamp
        written = self._path.with_name(self._path.name + ".new")
        try:
            written.write_text(str(self._reserved), encoding="ascii")
            written.replace(self._path)
        except OSError as error:
            raise SigningError(f"{self._path}: the time of signed packets cannot be kept: {error.strerror}") from error


def _read_key(path: Path) -> bytes:
    try:
        data = path.read_bytes()
        mode = path.stat().st_mode
    except OSError as error:
        raise SigningError(f"{path}: the key of signing cannot be read: {error.strerror}") from error
    text = data.strip()
    is_hexadecimal = bool(text) and set(text) <= _HEXADECIMAL
    # A text of hexadecimal digits, as many as a key has bytes, is half a key: a random key never looks so.
    if len(data) == KEY_LENGTH and not is_hexadecimal:
        key = data
    else:
        key = bytes.fromhex(text.decode("ascii")) if is_hexadecimal and len(text) % 2 == 0 else b""
    if len(key) != KEY_LENGTH:
        what = f"{len(text)} hexadecimal digits" if is_hexadecimal else f"{len(data)} bytes"
        needed = f"a key of signing is {KEY_LENGTH} bytes, or {2 * KEY_LENGTH} hexadecimal digits"
        raise SigningError(f"{path}: {needed}, not {what}")
    if mode & (stat.S_IRGRP | stat.S_IWGRP | stat.S_IROTH | stat.S_IWOTH):
        _log.warning("%s: others than its owner can read or change the key of signing: chmod 600 it", path)
    return key
