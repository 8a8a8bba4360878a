"""A port for dynamixel-sdk's packet handler on a serial line of ours.

The SDK's own `PortHandler` polls for bytes in a busy loop (33 ms of computing for an answer that takes 34 ms); it
measures time by a clock that a person may set; and it lets the exceptions of pyserial, termios and the system through,
and stays busy forever after one. This port waits in `poll`, by the monotonic clock, raises only `LineError`, and is
never busy, because it is used from one thread.
"""

from collections.abc import Callable, Sequence

from robosc_bridge.host import Host, Port

_BITS_PER_BYTE = 10  # The eight bits have a start and a stop bit around them.


class DynamixelPort:
    """Port for `PacketHandler`.

    Args:
        line: Line that it sends and receives over.
        answer_limit_s: Longest wait for an answer, in addition to the time that its bytes take on the wire.
        host: Host whose time it uses.

    Attributes:
        line: The same.
        answer_limit_s: The same.
        end_s: Latest time of any wait, so that several requests together stay within a limit.
        received_s: Time when the last byte came, in seconds.
        looked: Function that is called after each read while there is time; None: none.
        keeps_input: True while a packet is sent that must not discard received bytes.
    """

    def __init__(self, line: Port, answer_limit_s: float, host: Host) -> None:
        self.line = line
        self._host = host
        self.answer_limit_s = answer_limit_s
        self.end_s = self._host.monotonic()
        self.received_s = self._host.monotonic()
        self.looked: Callable[[], None] | None = None
        self.keeps_input = False
        self._found = b""
        self._answer_end_s = 0.0
        self._is_over = False

    @property
    def is_using(self) -> bool:
        """True if another request is under way: never, with one thread."""
        return False

    @is_using.setter
    def is_using(self, value: bool) -> None:
        """The handler claims the port, and would not give it back after an exception."""

    @property
    def is_late(self) -> bool:
        """True if the time for requests is over."""
        return self._host.monotonic() >= self.end_s

    # The names below are the SDK's.

    def clearPort(self) -> None:  # noqa: N802
        """Discard received bytes; called before each request."""
        if self.keeps_input:
            return
        self.line.discard_input()
        self._found = b""

    def writePort(self, packet: Sequence[int]) -> int:  # noqa: N802
        """Send a whole packet; return the number of its bytes."""
        self.line.write(bytes(packet))
        return len(packet)

    def setPacketTimeout(self, length: int) -> None:  # noqa: N802
        """Begin to wait for an answer of so many bytes."""
        self.wait_for(length)

    def wait_for(self, length: int, limit_s: float | None = None) -> None:
        """Begin to wait for answers of so many bytes together, at most for a limit of their own."""
        wire_s = length * _BITS_PER_BYTE / self.line.baud
        wait_s = wire_s + (self.answer_limit_s if limit_s is None else limit_s)
        self._answer_end_s = min(self._host.monotonic() + wait_s, self.end_s)
        self._is_over = False

    def readPort(self, length: int) -> bytes:  # noqa: N802
        """Return at most so many bytes, after waiting for the first."""
        if not self._found and not self._is_over:
            limit_s = self._answer_end_s - self._host.monotonic()
            # Bytes that came while this thread did not run still count: one look after the end, and no more.
            self._is_over = limit_s <= 0.0
            self._found = self.line.read(limit_s)
            if self._found:
                self.received_s = self._host.monotonic()
            if self.looked is not None and not self._is_over:
                self.looked()
        taken, self._found = self._found[:length], self._found[length:]
        return taken

    def isPacketTimeout(self) -> bool:  # noqa: N802
        """Return True if the wait is over and everything that came is read."""
        return self._is_over and not self._found
