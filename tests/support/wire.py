"""The host's end of a simulated serial line, with pyserial and nothing of the drivers."""

import time
from collections.abc import Callable
from types import TracebackType
from typing import Self

import serial
from dynamixel_sdk import PortHandler


class Host:
    """An open port.

    Args:
        path: Of the port.
        baud: Its speed.
    """

    def __init__(self, path: str, baud: int = 1_000_000) -> None:
        self.port = serial.Serial(path, baud, timeout=5.0)

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
        self.port.timeout = 5.0
        return not data

    def close(self) -> None:
        self.port.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def set_speed(port: PortHandler, baud: int) -> None:
    """Open the SDK's port anew at a speed."""
    assert port.setBaudRate(baud)
    # As it comes it spins while it waits, and a simulator in the same process starves.
    port.ser.timeout = 0.005


def sdk_port(path: str, baud: int = 1_000_000) -> PortHandler:
    """A port of dynamixel-sdk, open."""
    port = PortHandler(path)
    set_speed(port, baud)
    return port


def wait_until(is_so: Callable[[], bool], limit_s: float = 5.0) -> None:
    """Wait for a condition, with a limit."""
    end_s = time.monotonic() + limit_s
    while not is_so():
        assert time.monotonic() < end_s, "it has not come to it in time"
        time.sleep(0.002)
