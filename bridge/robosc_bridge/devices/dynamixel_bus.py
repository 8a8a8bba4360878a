"""Requests to Dynamixel devices, in which no answer is taken for that of another request.

Packets of protocol 2.0 carry no number that assigns an answer to its request, and an answer that comes too late looks
like the answer to the next request. But a device answers requests in their order. So a device that has not answered is
first sent another request, whose answer has a length that no other answer has; once that answer has come, no older one
can follow. Only then is the first request repeated.

A request whose length was damaged on its way makes a device wait for bytes that never come, and take the following
requests for these bytes. So a device that does not answer twice in a row is sent as many zeros as may be missing: a
packet that they complete has a wrong checksum, and between packets they are skipped.

A device on a line of its own, to which one can write while it answers, takes up requests one after the other. So a
write may be interjected: sent while the answer to another request is awaited, and heard after that.

Packets are those of dynamixel-sdk. Its `readTxRx`, `writeTxRx` and `GroupSyncRead` are not used: they take any answer
of a device for the expected one, and the last one loses the error bytes and all answers behind a missing device.
"""

import itertools
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass

from dynamixel_sdk import COMM_RX_TIMEOUT, COMM_SUCCESS, INST_PING, INST_REBOOT

from robosc_bridge.devices.dynamixel_port import DynamixelPort
from robosc_bridge.errors import DeviceError, DeviceSilentError
from robosc_bridge.host import Host, Port
from robosc_bridge.protocol.dynamixel import DAMAGED_REQUEST, PING_DATA, PacketHandler, StatusPacket, status_of
from robosc_bridge.transport.system_host import SYSTEM_HOST

ANSWER_LIMIT_S = 0.034
"""Time limit of an answer: twice the 16 ms for which an adapter may keep bytes back, and 2 ms, like the SDK."""


def exchange_limit_s(answer_limit_s: float) -> float:
    """Return the time that an exchange of a driver may take, in seconds.

    Three answers just in time, with the time that they take on the wire.
    """
    return 3 * answer_limit_s + 0.02


_FILLER = bytes(2048)  # The longest packet that a device takes.
_FILLER_S = 0.02  # On a slower line than 1 Mbps fewer are sent: what is missing may take several times.
_FILL_AFTER = 2  # Requests in a row without an answer.
_BITS_PER_BYTE = 10

_EMPTY_STATUS = 11  # Bytes of an answer without data.

# Reads that let a device send all older answers first: address and length, alternating. Whole registers
# without gaps, which every device has, of lengths that no request of a driver has; so many that with the usual limits
# an answer must be 0.7 s late to be taken for one to a later request.
_SETTLING = (
    *((6, length) for length in (5, 6, 7, 8)),
    *((112, length) for length in (10, 11)),
    *((108, length) for length in (14, 15)),
    *((104, length) for length in (12, 16, 18, 19, 20, 22, 24, 28, 32, 36, 40, 42, 43)),
)
SETTLING_LENGTHS = frozenset(length for _, length in _SETTLING)
"""Lengths that no driver may read."""

_revolutions = itertools.cycle(
    _SETTLING
)  # Shared: a port that is opened anew may still get answers to the last session.


class RefusedError(DeviceError):
    """Error that a device has refused a request.

    Args:
        problem: Description of the request and its device.
        status: Its answer.
    """

    def __init__(self, problem: str, status: StatusPacket) -> None:
        super().__init__(f"{problem}: {status.refusal}")
        self.number = status.number


@dataclass
class BusCounters:
    """Health of a line.

    Attributes:
        requests: Requests that wanted an answer.
        unanswered: Requests without a sound answer in time.
        damaged: Answers with a wrong checksum or cut short.
        foreign: Sound packets that were no answer to the request.
        late: Foreign packets from the device that was asked: its answers to earlier requests.
        repeated: Requests that were repeated.
        implausible: Sound answers that were refused, as their contents cannot be.
        begun_anew: Times that a device has begun to count from another place, as after a restart.
    """

    requests: int = 0
    unanswered: int = 0
    damaged: int = 0
    foreign: int = 0
    late: int = 0
    repeated: int = 0
    implausible: int = 0
    begun_anew: int = 0


class DynamixelBus:
    """One or several devices on a line. Used from one thread.

    Args:
        line: Open line, which still belongs to its owner.
        name_of: Function that returns the name of a device in messages, with the line.
        answer_limit_s: Longest wait for one answer.
        host: Host whose time it uses.

    Attributes:
        counters: Health of the line.
        stranger: Device that has answered to requests for others since the last `begin`; None: none has.
        interruption: Function that is called while the answer to a request is awaited for the first time, and that may
            `interject`; None: none.
        unheard: Number of interjected writes in a row that were not answered though the read before them was. Behind a
            write it is unknown which of two answers is missing, and mostly it is that of a write that was lost.
    """

    def __init__(
        self,
        line: Port,
        name_of: Callable[[int], str],
        answer_limit_s: float = ANSWER_LIMIT_S,
        host: Host = SYSTEM_HOST,
    ) -> None:
        self.counters = BusCounters()
        self._host = host
        self.stranger: int | None = None
        self.interruption: Callable[[], None] | None = None
        self.unheard = 0
        # True if something was interjected, and its answer was not looked for yet.
        self._is_interjected = False
        self._port = DynamixelPort(line, answer_limit_s, host)
        self._handler = PacketHandler()
        self._name_of = name_of
        self._repeats = 0
        self._unsettled: set[int] = set()
        # Requests in a row that were not answered.
        self._silent = 0

    @property
    def received_s(self) -> float:
        """Time when the last byte came, in seconds."""
        return self._port.received_s

    def begin(self, limit_s: float, repeats: int = 1) -> None:
        """Begin a cycle.

        Args:
            limit_s: Time that the requests that follow may take together, in seconds.
            repeats: Number of these requests that may be made again.
        """
        self._port.end_s = self._host.monotonic() + limit_s
        self._repeats = repeats
        self.stranger = None

    def silence_of(self, names: str, verb: str) -> DeviceSilentError:
        """The error for devices that do not answer; it names the device that answers instead."""
        other = "" if self.stranger is None else f", but device {self.stranger} does"
        return DeviceSilentError(f"{names} {verb} not answer{other}")

    def settle(self, device: int) -> bytes:
        """Make sure that no older answer of a device can follow: its next answer belongs to the next request.

        Returns:
            Data that was read for this.

        Raises:
            LineError: The line is gone.
            DeviceSilentError: There is no answer in time.
        """
        address, length = next(_revolutions)
        limit_s = None
        if self._silent >= _FILL_AFTER and not self._port.is_late:
            filler = _FILLER[: int(self._port.line.baud * _FILLER_S / _BITS_PER_BYTE)]
            self._port.line.write(filler)
            limit_s = self._port.answer_limit_s + _FILLER_S

        def fits(status: StatusPacket) -> bool:
            # A refusal has no length to know it by: it may be that of an older request.
            return not status.number and len(status.data) == length

        status = self._answered(device, lambda: self._read(device, address, length), fits, length, limit_s)
        return status.data

    def ping(self, device: int, limit_s: float | None = None) -> tuple[int, int]:
        """Return the model number and the version of the firmware.

        Args:
            device: Id of the device.
            limit_s: Longest wait for the answer, where it is not the usual one.

        Raises:
            LineError: The line is gone.
            DeviceSilentError: There is no answer in time.
        """
        status = self._asked(device, lambda: self._plain(device, INST_PING), PING_DATA, limit_s)
        return int.from_bytes(status.data[:2], "little"), status.data[2]

    def read(self, device: int, address: int, length: int) -> StatusPacket:
        """Read the data at an address.

        Raises:
            LineError: The line is gone.
            DeviceSilentError: There is no answer in time.
            RefusedError: The device refuses it.
        """
        return self._accepted(
            self._asked(device, lambda: self._read(device, address, length), length),
            f"does not let {length} bytes at {address} be read",
        )

    def write(
        self,
        device: int,
        address: int,
        data: bytes,
        limit_s: float | None = None,
        sent: Callable[[], None] | None = None,
    ) -> StatusPacket:
        """Write to an address.

        Args:
            device: Id of the device.
            address: Address of the first byte.
            data: Data to write.
            limit_s: Longest wait for the answer, where it is not the usual one.
            sent: Function that is called each time the line has taken the packet; None: none.

        Raises:
            LineError: The line is gone.
            DeviceSilentError: There is no answer in time.
            RefusedError: The device refuses it.
        """

        def transmit() -> int:
            result = int(self._handler.writeTxOnly(self._port, device, address, len(data), list(data)))
            if sent is not None:
                sent()
            return result

        return self._accepted(
            self._asked(device, transmit, 0, limit_s), f"does not let {len(data)} bytes at {address} be written"
        )

    def interject(self, device: int, address: int, data: bytes) -> None:
        """Write to an address of the device whose answer is awaited; may be called once in an `interruption`.

        The answer to this write is read after the awaited one. If none comes, the write is not repeated: a slow device
        carries out every request, and an older write must not follow a newer one.

        Args:
            device: Id of the device.
            address: Address of the first byte.
            data: Data to write.

        Raises:
            LineError: The line is gone.
        """
        self._is_interjected = True
        self.counters.requests += 1
        self._port.keeps_input = True
        try:
            self._sent(int(self._handler.writeTxOnly(self._port, device, address, len(data), list(data))))
        finally:
            self._port.keeps_input = False

    def is_late(self, device: int, limit_s: float) -> bool:
        """Return True if a device that has not answered in time answers late.

        Args:
            device: Id of the device.
            limit_s: Longest wait for it, in seconds.

        Raises:
            LineError: The line is gone.
        """
        end_s = self._host.monotonic() + limit_s
        self._port.end_s = end_s
        while self._host.monotonic() < end_s:
            self._port.wait_for(0, end_s - self._host.monotonic())
            status = self._received()
            if status is not None and status.device == device:
                self.counters.foreign += 1
                self.counters.late += 1
                return True
        return False

    def write_unanswered(self, device: int, address: int, data: bytes) -> None:
        """Write to an address of a device without waiting for an answer, such as if its answers do not arrive.

        Raises:
            LineError: The line is gone.
        """
        self._unsettled.add(device)
        self._sent(int(self._handler.writeTxOnly(self._port, device, address, len(data), list(data))))

    def reboot(self, device: int) -> None:
        """Restart a device, which is then silent for a while.

        Raises:
            LineError: The line is gone.
            DeviceSilentError: There is no answer in time.
            RefusedError: The device refuses it.
        """
        self._accepted(self._asked(device, lambda: self._plain(device, INST_REBOOT), 0), "does not restart")

    def sync_write(self, address: int, data: Mapping[int, bytes]) -> None:
        """Write to the same address of several devices at once; none of them answers.

        Args:
            address: Address of the first byte.
            data: Data by device, all of the same length.

        Raises:
            LineError: The line is gone.
        """
        length = len(next(iter(data.values())))
        parameters = [byte for device, value in data.items() for byte in (device, *value)]
        self._sent(self._handler.syncWriteTxOnly(self._port, address, length, parameters, len(parameters)))

    def sync_read(self, address: int, length: int, devices: Collection[int]) -> dict[int, StatusPacket]:
        """Read the data at the same address of several devices.

        Returns:
            Answers by device; devices that have not answered, also when asked again, are missing. Answers may be
            refusals.

        Raises:
            LineError: The line is gone.
        """
        found = self._sync_read(address, length, devices)
        if len(found) < len(devices) and self._may_repeat():
            found = self._sync_read(address, length, devices) or found
        return found

    def _sync_read(self, address: int, length: int, devices: Collection[int]) -> dict[int, StatusPacket]:
        found: dict[int, StatusPacket] = {}
        # One that stays silent is left out, and does not make the others look so.
        asked = [device for device in devices if device not in self._unsettled or self._has_settled(device)]
        if not asked or self._port.is_late:
            return found
        self._begin_request()
        self._unsettled.update(asked)
        self._sent(self._handler.syncReadTx(self._port, address, length, asked, len(asked), False))
        self._port.wait_for(len(asked) * (_EMPTY_STATUS + length))
        while len(found) < len(asked):
            status = self._received()
            if status is None:
                self.counters.unanswered += 1
                self._silent += 1
                break
            self._silent = 0
            if status.device in asked and status.device not in found and _fits(status, length):
                self._unsettled.discard(status.device)
                if status.number == DAMAGED_REQUEST:
                    break
                found[status.device] = status
            else:
                self._is_foreign(status, devices)
        return found

    def _has_settled(self, device: int) -> bool:
        try:
            self.settle(device)
        except DeviceSilentError:
            return False
        return True

    def _asked(
        self, device: int, transmit: Callable[[], int], length: int, limit_s: float | None = None
    ) -> StatusPacket:
        """The answer to a request, which is made again if there is none; never that to an older one."""
        self._is_interjected = False
        try:
            return self._asked_once(device, transmit, length, limit_s, self._interrupted)
        except DeviceSilentError:
            if self._is_interjected or not self._may_repeat():
                raise
            return self._asked_once(device, transmit, length, limit_s)

    def _interrupted(self) -> None:
        if self.interruption is not None and not self._is_interjected and not self._port.is_late:
            self.interruption()

    def _asked_once(
        self,
        device: int,
        transmit: Callable[[], int],
        length: int,
        limit_s: float | None,
        interrupted: Callable[[], None] | None = None,
    ) -> StatusPacket:
        if device in self._unsettled:
            self.settle(device)
        self._port.looked = interrupted
        try:
            status = self._answered(device, transmit, lambda status: _fits(status, length), length, limit_s)
        finally:
            self._port.looked = None
        if self._is_interjected:
            self._hear_interjected(device, is_certain=length > 0)
        if status.number == DAMAGED_REQUEST:
            raise DeviceSilentError(f"{self._name_of(device)} received damaged bytes")
        return status

    def _answered(
        self,
        device: int,
        transmit: Callable[[], int],
        fits: Callable[[StatusPacket], bool],
        length: int,
        limit_s: float | None = None,
    ) -> StatusPacket:
        self._begin_request()
        self._unsettled.add(device)
        self._sent(transmit())
        self._port.wait_for(_EMPTY_STATUS + length, limit_s)
        while (status := self._received()) is not None:
            if status.device == device and fits(status):
                self._unsettled.discard(device)
                self._silent = 0
                return status
            if self._is_interjected and _is_done(status, device):
                # Devices answer in their order: the answer that was awaited is lost.
                self._is_interjected = False
                break
            self._is_foreign(status, (device,))
        self.counters.unanswered += 1
        self._silent += 1
        raise self.silence_of(self._name_of(device), "does")

    def _hear_interjected(self, device: int, *, is_certain: bool) -> None:
        """Await the answer to what was interjected; without one, the next request first settles the device."""
        self._is_interjected = False
        self._unsettled.add(device)
        self._port.wait_for(_EMPTY_STATUS)
        while (status := self._received()) is not None:
            if _is_done(status, device):
                self._unsettled.discard(device)
                self.unheard = 0
                return
            self._is_foreign(status, (device,))
        self.counters.unanswered += 1
        self._silent += 1
        self.unheard += is_certain

    def _is_foreign(self, status: StatusPacket, devices: Collection[int]) -> None:
        """Count an answer that is to another request, or comes from another device than these."""
        self.counters.foreign += 1
        if status.device in devices:
            self.counters.late += 1
        else:
            self.stranger = status.device

    def _begin_request(self) -> None:
        if self._port.is_late:
            raise DeviceSilentError(f"{self._port.line.path}: no time is left to ask again")
        self.counters.requests += 1

    def _may_repeat(self) -> bool:
        if self._repeats == 0 or self._port.is_late:
            return False
        self._repeats -= 1
        self.counters.repeated += 1
        return True

    def _received(self) -> StatusPacket | None:
        """The next sound packet in time; None: there is none, or a damaged one, after which it is best to ask again."""
        while not self._port.isPacketTimeout():
            packet, result = self._handler.rxPacket(self._port, False)
            if result != COMM_SUCCESS:
                self.counters.damaged += result != COMM_RX_TIMEOUT
                return None
            status = status_of(packet)
            if status is not None:
                return status
            self.counters.damaged += 1
        return None

    def _accepted(self, status: StatusPacket, problem: str) -> StatusPacket:
        if status.number:
            raise RefusedError(f"{self._name_of(status.device)} {problem}", status)
        return status

    def _read(self, device: int, address: int, length: int) -> int:
        return int(self._handler.readTx(self._port, device, address, length))

    def _plain(self, device: int, instruction: int) -> int:
        """Send a request without parameters; the handler has no call that only sends one."""
        return int(self._handler.txPacket(self._port, [0, 0, 0, 0, device, 3, 0, instruction, 0, 0]))

    @staticmethod
    def _sent(result: int) -> None:
        # The port raises for itself; what is left is a packet that is too long.
        if result != COMM_SUCCESS:
            raise ValueError(f"dynamixel-sdk does not send this packet: {result}")


def _is_done(status: StatusPacket, device: int) -> bool:
    """Return True if an answer is a device's to a write that it has carried out."""
    return status.device == device and status.number == 0 and not status.data


def _fits(status: StatusPacket, length: int) -> bool:
    """Return True if an answer can be one to a request for so many bytes: these, or an error and none."""
    return len(status.data) == length or (status.number != 0 and not status.data)
