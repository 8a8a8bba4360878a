"""A serial line on pyserial whose reader waits in `select`, so that waiting costs nothing and can be interrupted."""

import contextlib
import errno
import os
import select
import termios
import time
from types import TracebackType
from typing import Self

import serial

from robosc_bridge.errors import LineBusyError, LineDeniedError, LineError, LineLostError, LineMissingError
from robosc_bridge.transport.polled_line import PolledLine

_CHUNK = 4096
# A line that is gone raises OSError, pyserial's own (an OSError, too) or that of termios (which is none).
_FAILURES = (OSError, termios.error)


class SerialLine(PolledLine):
    """An open serial line.

    Args:
        path: Path of the port, best a stable name below /dev/serial/by-id or of a udev rule.
        baud: Bits per second.

    Raises:
        LineMissingError: There is no such port.
        LineBusyError: Another program uses the port.
        LineDeniedError: This user may not open the port.
        LineError: The file is no serial port, or does not support this baud rate.
    """

    def __init__(self, path: str, baud: int) -> None:
        self.baud = baud
        try:
            self._port = serial.Serial(path, baud, timeout=0, exclusive=True)
        except (*_FAILURES, ValueError, OverflowError) as error:
            raise _not_opened(path, error) from error
        # An FTDI adapter, such as the U2D2, keeps back what is less than a full packet for 16 ms otherwise, and for
        # 1 ms then. Only a UART's driver knows this setting; others keep nothing back, or cannot be set.
        with contextlib.suppress(ValueError, NotImplementedError):
            self._port.set_low_latency_mode(True)
        os.set_blocking(self._port.fileno(), False)
        super().__init__(path, self._port.fileno())

    def read(self, limit_s: float) -> bytes:
        """Return the bytes that have come, after waiting for the first one.

        Args:
            limit_s: Longest wait; 0: not at all.

        Returns:
            At least one byte; empty if no byte came in time or `wake` was called.

        Raises:
            LineLostError: The line is gone.
        """
        self._check_open()
        try:
            if not self._is_readable(limit_s):
                return b""
            found = os.read(self._port.fileno(), _CHUNK)
        except BlockingIOError:
            return b""
        except (*_FAILURES, ValueError, TypeError) as error:
            raise self._lost(error) from error
        if not found:
            raise LineLostError(self.path, "the device has hung up")
        return found

    def write(self, data: bytes, limit_s: float = 0.1) -> None:
        """Send all of the data.

        Args:
            data: Data to send.
            limit_s: Longest wait for the line to take it.

        Raises:
            LineLostError: The line is gone, or does not take what is written.
        """
        left = memoryview(data)
        end_s = time.monotonic() + limit_s
        try:
            while left:
                try:
                    left = left[os.write(self._port.fileno(), left) :]
                except BlockingIOError:
                    if not self._is_writable(end_s - time.monotonic()):
                        raise LineLostError(self.path, "the line takes no more bytes") from None
        except (*_FAILURES, ValueError, TypeError) as error:
            raise self._lost(error) from error

    def _is_writable(self, limit_s: float) -> bool:
        poll = select.poll()
        poll.register(self._port.fileno(), select.POLLOUT)
        return bool(poll.poll(max(limit_s, 0.0) * 1000))

    def discard_input(self) -> None:
        """Discard bytes that have come and were not read.

        Raises:
            LineLostError: The line is gone.
        """
        try:
            self._port.reset_input_buffer()
        except (*_FAILURES, ValueError, TypeError) as error:
            raise self._lost(error) from error

    def set_baud(self, baud: int) -> None:
        """Change the baud rate.

        Raises:
            LineError: The port does not support this baud rate, or is gone.
        """
        self._check_open()
        try:
            self._port.baudrate = baud
        except (*_FAILURES, ValueError, OverflowError) as error:
            raise LineError(self.path, f"cannot be set to {baud} baud: {_words(error)}") from error
        self.baud = baud

    def set_dtr(self, is_on: bool) -> None:
        """Set the modem line "data terminal ready", which opening a port raises; a pseudo-terminal has none.

        Raises:
            LineLostError: The line is gone.
        """
        self._check_open()
        try:
            self._port.dtr = is_on
        except _FAILURES as error:
            if getattr(error, "errno", None) not in (errno.EINVAL, errno.ENOTTY):
                raise self._lost(error) from error

    def _close_file(self) -> None:
        with contextlib.suppress(*_FAILURES):
            self._port.close()

    def _lost(self, error: Exception) -> LineLostError:
        if isinstance(error, LineLostError):
            return error
        return LineLostError(self.path, f"the line is gone: {_words(error)}")

    # `robosc_simulated.closing` has the same methods: a driver and a simulated device share no code.
    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def _not_opened(path: str, error: Exception) -> LineError:
    number = getattr(error, "errno", None) or (error.args[0] if error.args else None)
    match number:
        case errno.ENOENT | errno.ENXIO | errno.ENODEV:
            return LineMissingError(path, "there is no such port; is the device plugged in?")
        case errno.EBUSY | errno.EAGAIN:
            return LineBusyError(path, "another program uses this port")
        case errno.EACCES | errno.EPERM:
            return LineDeniedError(path, "no permission; is this user in the group dialout?")
    return LineError(path, f"cannot be opened as a serial port: {_words(error)}")


def _words(error: Exception) -> str:
    found = " ".join(str(error.args[-1] if error.args else error).split())
    return found or type(error).__name__
