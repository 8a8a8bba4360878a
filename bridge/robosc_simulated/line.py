"""The device's end of a serial line: a thread that serves it, and faults of the wire.

The wire lives in the time of the host at its other end, whatever clock the device has: a delayed answer is late by
seconds of the host. That is real time on a pseudo-terminal, and virtual time on a port of a `VirtualHost`.
"""

import math
import random
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from robosc_simulated.closing import Closing
from robosc_simulated.recorder import Tap
from robosc_simulated.terminal_end import TerminalEnd
from robosc_simulated.timebase import Timebase
from robosc_simulated.virtual_host import VirtualHost

# Size of the line discipline's buffer: bytes beyond it wait deeper in the kernel, where no host can flush them, and
# would be old news for the next one that opens the port.
_BUFFER = 4095
# Bits of a byte on the wire, with a start and a stop bit.
_BITS = 10
# A world that passes faster is lived in fewer and larger pieces: a wake-up for each frame would be thousands a second.
_COARSE_S = 0.002
_PIECE = 1024
# Less than a revolution of any LiDAR: who leaves more unread is behind.
_MOST_UNREAD = 1024
# Bytes after which an adapter passes them on though its time is not over: a USB packet of 64 with two of its own.
_USB_PACKET = 62


@dataclass(frozen=True)
class Sending:
    """Bytes that a device sends.

    Attributes:
        data: One packet or frame.
        after_s: Time that the device itself takes before it sends them, in seconds.
    """

    data: bytes
    after_s: float = 0.0


class Device(Protocol):
    """Device on a line. All is called under the lock of its time."""

    @property
    def baud(self) -> int | None:
        """At which it talks; None: any speed is right (a USB device), or it sees to it itself (a bus)."""

    def receive(self, data: bytes, baud: int) -> Iterable[Sending]:
        """Hear bytes at the host's speed and answer."""

    def update(self) -> Iterable[Sending]:
        """Live until now, and send what is due by itself."""

    def due_s(self) -> float:
        """Return the time, by the clock, when `update` is needed next; infinity: not until something comes."""

    def plug_in(self) -> None:
        """Begin after its line was plugged in again."""


@dataclass
class Faults:
    """Faults of a wire; may be changed at any time, and act on what is sent from then on.

    Attributes:
        delay_s: Delay of every packet to the host, in real seconds.
        drop_next: Number of the next packets to the host that are lost.
        drop_share: Share of packets to the host that are lost.
        corrupt_next: Number of the next packets that have a wrong byte.
        corrupt_share: Share of packets that have a wrong byte.
        lose_bytes_share: Share of single bytes that are lost.
        cut_next: Number of the next packets that end in their middle.
        garbage: Bytes sent before every packet.
        split_s: Seconds between single bytes; 0: each is written alone, at once; None: packets are whole.
        echo: True if the adapter sends back what the host sends.
        is_deaf: True if nothing from the host reaches the device.
        duplicate_share: Share of packets to the host that come twice.
        cut_share: Share of packets to the host that end too early.
        flip_share: Share of packets to the host in which one bit is wrong.
        device_drop_share: Share of what the host writes that is lost.
        device_duplicate_share: Share of it that comes twice.
        device_cut_share: Share of it that ends too early.
        device_flip_share: Share of it in which one bit is wrong.
        batch_s: Time for which an adapter gathers less than 62 bytes to the host, in seconds.
        has_wire_time: True if bytes to the host take their time at the device's speed, and less in a faster world; a
            bus sees to it itself.
    """

    delay_s: float = 0.0
    drop_next: int = 0
    drop_share: float = 0.0
    corrupt_next: int = 0
    corrupt_share: float = 0.0
    lose_bytes_share: float = 0.0
    cut_next: int = 0
    garbage: bytes = b""
    split_s: float | None = None
    echo: bool = False
    is_deaf: bool = False
    duplicate_share: float = 0.0
    cut_share: float = 0.0
    flip_share: float = 0.0
    device_drop_share: float = 0.0
    device_duplicate_share: float = 0.0
    device_cut_share: float = 0.0
    device_flip_share: float = 0.0
    batch_s: float = 0.0
    has_wire_time: bool = False

    def clear(self) -> None:
        """A sound wire again."""
        self.__dict__.update(Faults().__dict__)


class SimulatedLine(Closing):
    """Line that serves a device until it is closed.

    It is on a pseudo-terminal, or on a port of the `VirtualHost` that it lives by.

    Args:
        device: Device that answers.
        time: Time that it lives by.
        link: Place of the port's stable name, a symbolic link; None: in a folder of its own.
        seed: Seed of the faults that come by chance.
        tap: Function that takes all bytes that pass here; None: nothing does.

    Attributes:
        path: Path of the port: stable over `disconnect` and `reconnect`, as a udev rule makes it.
        faults: Faults of the wire.
        lost_bytes: Bytes that the host has not read in time, as with a full buffer of a serial driver.
        received: Bytes that the host has sent.
        sent: Bytes that have been sent to it.

    Raises:
        FileExistsError: There is something at `link` already.
    """

    def __init__(
        self, device: Device, time: Timebase, link: Path | None = None, seed: int = 0, tap: Tap | None = None
    ) -> None:
        self.device = device
        self.faults = Faults()
        self.lost_bytes = 0
        self.received = 0
        self.sent = 0
        self._time = time
        self._tap = tap
        self._chance = random.Random(seed)  # noqa: S311 (faults are no secrets)
        clock = time.clock
        self._end = clock.new_end(link) if isinstance(clock, VirtualHost) else TerminalEnd(link)
        self.path = self._end.path
        self._wire: deque[tuple[float, bytes]] = deque()
        # Time at which the last byte has passed; time at which the adapter passes on its batch, and the size of that.
        self._free_s = -math.inf
        self._batch_end_s = -math.inf
        self._gathered = 0
        # Bytes that were unread when it had sent last, and whether any were ever read.
        self._waiting = 0
        self._is_used = False
        self._is_open = True
        time.join(self._catch_up)
        self._thread = self._end.thread(self._serve, f"simulated line {self.path}")
        self._thread.start()

    @property
    def is_connected(self) -> bool:
        """True if the port is there."""
        return self._end.is_connected

    def has_answered(self, received: int) -> bool:
        """Return whether it has heard so many bytes of the host, and has nothing on the wire for it."""
        with self._time.lock:
            return self.received >= received and not self._wire

    def disconnect(self) -> None:
        """Pull the plug: the port is gone, and a program that has it open sees a hang-up."""
        with self._time.lock:
            if not self._end.is_connected:
                return
            self._end.disconnect()
            self._wire.clear()
        self._end.wake()

    def reconnect(self) -> None:
        """Plug it in again: another port under the same name."""
        with self._time.lock:
            if self._end.is_connected or not self._is_open:
                return
            self._end.connect()
            self.device.plug_in()
        self._end.wake()

    def close(self) -> None:
        """End it and remove the port; may be called again."""
        if not self._is_open:
            return
        self._is_open = False
        self._end.wake()
        self._thread.join()
        self._time.read(self, is_behind=False)
        self._time.leave(self._catch_up)
        self.disconnect()
        self._end.close()

    def _serve(self) -> None:
        while self._is_open:
            with self._time.lock:
                self._live()
                limit_s = self._limit_s()
            if self._end.wait(limit_s):
                with self._time.lock:
                    self._hear()

    def _hear(self) -> None:
        data = self._end.read()
        if not data:
            return
        if self._tap is not None:
            self._tap(True, self._end.now_s(), data)
        self.received += len(data)
        self._time.host_sent()
        if self.faults.echo:
            self._send([Sending(data)])
        faults = self.faults
        if not faults.is_deaf:
            shares = (
                faults.device_drop_share,
                faults.device_duplicate_share,
                faults.device_cut_share,
                faults.device_flip_share,
            )
            for heard in self._damaged(data, shares):
                self._send(self.device.receive(self._heard_through(heard), self._end.host_baud()))

    def _catch_up(self) -> None:
        """Hear what has come, and live until now: time has passed."""
        with self._time.lock:
            self._hear()
            self._live()

    def _live(self) -> None:
        with self._time.lock:
            if self._time.waits_for_host:
                self._look_at_the_host()
            # It lives on without a line, and what it sends then goes nowhere.
            sendings = self.device.update()
            if self._end.is_connected:
                self._send(sendings)
            self._flush()
            if self._time.waits_for_host:
                self._waiting = self._end.unread()

    def _look_at_the_host(self) -> None:
        """Report whether the host is behind.

        The world does not wait for a host that has no use for this line, and reads nothing of it.
        """
        unread = self._end.unread()
        self._is_used = self._is_used or unread < self._waiting
        self._time.read(self, is_behind=self._is_used and unread > _MOST_UNREAD)

    def _limit_s(self) -> float:
        wire_s = self._wire[0][0] - self._end.now_s() if self._wire else math.inf
        device_s = math.inf if self._time.is_manual else self.device.due_s() - self._time.now_s()
        if self._time.factor > 1.0:
            device_s = max(device_s, _COARSE_S)
        return min(wire_s, device_s)

    def _send(self, sendings: Iterable[Sending]) -> None:
        for sending in sendings:
            spoilt = self._spoilt(sending.data)
            if spoilt is None:
                continue
            faults = self.faults
            shares = (0.0, faults.duplicate_share, faults.cut_share, faults.flip_share)
            for data in self._damaged(spoilt, shares):
                self._transmit(data, self._end.now_s() + sending.after_s + faults.delay_s)
        self._flush()

    def _transmit(self, data: bytes, due_s: float) -> None:
        faults, baud = self.faults, self.device.baud
        if faults.has_wire_time and baud is not None:
            due_s = self._free_s = max(due_s, self._free_s) + len(data) * _BITS / (baud * self._time.factor)
        if faults.split_s is not None:
            for index in range(len(data)):
                self._wire.append((due_s + index * faults.split_s, data[index : index + 1]))
        elif faults.batch_s:
            self._gather(data, due_s, faults.batch_s)
        else:
            self._wire.append((due_s, data))

    def _gather(self, data: bytes, due_s: float, batch_s: float) -> None:
        """Let an adapter pass bytes on when it has a packet full of them, or when its time is over."""
        end_s = math.ceil(due_s / batch_s) * batch_s
        if end_s != self._batch_end_s:
            self._batch_end_s, self._gathered = end_s, 0
        self._gathered += len(data)
        if self._gathered < _USB_PACKET:
            self._wire.append((end_s, data))
            return
        # The batch goes with the bytes that have made the packet full.
        self._wire = deque((min(at_s, due_s) if at_s == end_s else at_s, held) for at_s, held in self._wire)
        self._gathered %= _USB_PACKET
        full = len(data) - self._gathered
        self._wire.append((due_s, data[:full]))
        if self._gathered:
            self._wire.append((end_s, data[full:]))

    def _damaged(self, data: bytes, shares: tuple[float, float, float, float]) -> list[bytes]:
        """Return what comes of a packet: itself, a part, with a wrong bit, twice, or nothing.

        Args:
            data: Packet.
            shares: Shares that are lost, doubled, cut and have a wrong bit.
        """
        drop, duplicate, cut, flip = shares
        chance = self._chance
        if drop and chance.random() < drop:
            return []
        if cut and chance.random() < cut:
            data = data[: chance.randrange(len(data))]
        if flip and data and chance.random() < flip:
            index = chance.randrange(len(data))
            data = data[:index] + bytes((data[index] ^ 1 << chance.randrange(8),)) + data[index + 1 :]
        if not data:
            return []
        return [data, data] if duplicate and chance.random() < duplicate else [data]

    def _spoilt(self, data: bytes) -> bytes | None:
        faults, chance = self.faults, self._chance
        if faults.drop_next > 0:
            faults.drop_next -= 1
            return None
        if faults.drop_share and chance.random() < faults.drop_share:
            return None
        if faults.corrupt_next > 0 or (faults.corrupt_share and chance.random() < faults.corrupt_share):
            faults.corrupt_next = max(faults.corrupt_next - 1, 0)
            # Behind the header, so that it stays a frame, with a wrong checksum.
            index = chance.randrange(len(data) // 2, len(data))
            data = data[:index] + bytes((data[index] ^ chance.randrange(1, 256),)) + data[index + 1 :]
        if faults.cut_next > 0:
            faults.cut_next -= 1
            data = data[: len(data) // 2]
        if faults.lose_bytes_share:
            data = bytes(byte for byte in data if chance.random() >= faults.lose_bytes_share)
        return self._heard_through(faults.garbage + data)

    def _heard_through(self, data: bytes) -> bytes:
        """Return the data that arrives: noise, if the two ends do not agree on the speed."""
        is_right = self.device.baud is None or self.device.baud == self._end.host_baud()
        return data if is_right else self._chance.randbytes(len(data))

    def _flush(self) -> None:
        """Pass on what is due; nothing overtakes what came before it."""
        now_s = self._end.now_s()
        while self._wire and self._wire[0][0] <= now_s:
            _, data = self._wire.popleft()
            if self._tap is None:
                while self._wire and self._wire[0][0] <= now_s and len(data) + len(self._wire[0][1]) <= _PIECE:
                    data += self._wire.popleft()[1]
            written = 0
            if self._end.is_connected and self._end.unread() + len(data) <= _BUFFER:
                begin_s = self._end.now_s()
                written = self._end.write(data)
                if self._tap is not None and written:
                    self._tap(False, begin_s, data[:written])
            self.sent += written
            self.lost_bytes += len(data) - written if self._end.is_connected else 0
