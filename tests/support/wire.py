"""The host's end of a simulated serial line, with pyserial or virtual ports and nothing of the drivers."""

from typing import Any

import serial
from dynamixel_sdk import PortHandler

from robosc_simulated import SimulatedLine
from robosc_simulated.closing import Closing
from robosc_simulated.virtual_host import VirtualHost
from support.waiting import PATIENCE_S, wait_until


class VirtualSerial:
    """A port of a virtual host, in the words of pyserial.

    Args:
        time: The virtual host.
        path: Path of the port.
        baud: Its speed.

    Attributes:
        timeout: Maximum time that a read waits for all that it wants, in seconds.
    """

    def __init__(self, time: VirtualHost, path: str, baud: int) -> None:
        self.timeout = PATIENCE_S
        self._time = time
        self._port = time.open_port(path, baud)
        self._found = b""
        # The device at the other end has begun to wait.
        time.sleep(0.0)

    @property
    def in_waiting(self) -> int:
        self._found += self._port.read(0.0)
        return len(self._found)

    def read(self, count: int) -> bytes:
        end_s = self._time.monotonic() + self.timeout
        while self.in_waiting < count and (left_s := end_s - self._time.monotonic()) > 0:
            self._found += self._port.read(left_s)
        found, self._found = self._found[:count], self._found[count:]
        return found

    def write(self, data: bytes) -> None:
        self._port.write(data)
        # A device that has nothing else to do hears it at once.
        self._time.sleep(0.0)

    def reset_input_buffer(self) -> None:
        self._found = b""
        self._port.discard_input()

    def close(self) -> None:
        self._port.close()


class Host(Closing):
    """An open port.

    Args:
        path: Of the port.
        baud: Its speed.
        time: The virtual host whose port it is; None: it is one of this computer.
    """

    def __init__(self, path: str, baud: int = 1_000_000, time: VirtualHost | None = None) -> None:
        self.port: Any = (
            serial.Serial(path, baud, timeout=PATIENCE_S) if time is None else VirtualSerial(time, path, baud)
        )

    def send(self, hexes: str | bytes) -> None:
        self.port.write(bytes.fromhex(hexes) if isinstance(hexes, str) else hexes)

    def receive(self, count: int) -> bytes:
        """Exactly so many bytes."""
        data: bytes = self.port.read(count)
        assert len(data) == count, f"only {len(data)} of {count} bytes: {data.hex(' ')}"
        return data

    def ask(self, hexes: str | bytes) -> str:
        """The status packet that answers, as hexadecimal text."""
        self.send(hexes)
        return self.packet().hex(" ")

    def packet(self) -> bytes:
        """The next Protocol 2.0 packet."""
        head = self.receive(7)
        assert head[:4] == b"\xff\xff\xfd\x00", head.hex(" ")
        return head + self.receive(int.from_bytes(head[5:7], "little"))

    def hears_nothing(self, seconds: float = 0.05) -> bool:
        self.port.timeout = seconds
        data = self.port.read(1)
        self.port.timeout = PATIENCE_S
        return not data

    def close(self) -> None:
        self.port.close()


class SdkPort(PortHandler):  # type: ignore[misc]
    """A port of dynamixel-sdk, open, that gives up when nothing can come any more and not when time is over.

    The SDK waits some 34 ms for an answer, which a busy computer does not always keep.

    Args:
        line: At the other end.
    """

    def __init__(self, line: SimulatedLine) -> None:
        super().__init__(line.path)
        self._line = line
        self._written = line.received
        self._read = line.sent
        self.set_speed(self.baudrate)

    def set_speed(self, baud: int) -> None:
        """Open it anew at a speed."""
        self.settle()
        self._read = self._line.sent
        assert self.setBaudRate(baud)
        # The handler spins while it waits by default, and a simulator in the same process starves.
        self.ser.timeout = 0.005

    def writePort(self, packet: bytes | list[int]) -> int:
        written: int = super().writePort(packet)
        self._written += written
        return written

    def readPort(self, length: int) -> bytes:
        data: bytes = super().readPort(length)
        self._read += len(data)
        return data

    def clearPort(self) -> None:
        """Discard all that the line has sent, also what the kernel has not yet carried to this end."""
        wait_until(self._is_clear)

    def _is_clear(self) -> bool:
        self.readPort(self.ser.in_waiting)
        return self._read == self._line.sent

    def isPacketTimeout(self) -> bool:
        is_over = self._line.has_answered(self._written) and self._read == self._line.sent
        assert is_over or self.getTimeSinceStart() < 1000 * PATIENCE_S, "the line hangs"
        return is_over

    def settle(self) -> None:
        """Wait until all that was written has been heard: the kernel carries it from end to end when it has time."""
        wait_until(lambda: self._line.has_answered(self._written))
