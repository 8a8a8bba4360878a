"""A bus of servos behind one adapter: addressing of packets, and answers (ROBOTIS e-Manual, Protocol 2.0).

A servo that a SYNC READ or BULK READ lists and that is silent leaves a gap; those behind it answer all the same.
FAST SYNC READ and FAST BULK READ are not there, as in the firmware before them.
"""

from collections.abc import Iterable, Iterator, Sequence

from robosc_simulated.line import Sending
from robosc_simulated.packets import BROADCAST_ID, Error, Instruction, Request, RequestParser, status
from robosc_simulated.robots import BAUDS
from robosc_simulated.servo import Servo

_CLEAR = bytes.fromhex("0144584c22")
_ALL_BUT = {0xFF: frozenset[str](), 0x01: frozenset({"id"}), 0x02: frozenset({"id", "baud rate"})}


class ServoBus:
    """Servos on one line.

    Args:
        servos: With IDs that differ; several may get the same one later, and then talk at once.

    Attributes:
        servos: In the order of the bus.
        answers_as: The ID that every answer carries; None: the sender's own.
    """

    baud: int | None = None

    def __init__(self, servos: Sequence[Servo]) -> None:
        self.servos = tuple(servos)
        self.answers_as: int | None = None
        self._parser = RequestParser()

    def plug_in(self) -> None:
        """The adapter is new; the servos have power of their own and notice nothing."""
        self._parser.clear()

    def update(self) -> Iterable[Sending]:
        """They send nothing by themselves."""
        for servo in self.servos:
            servo.catch_up()
        return ()

    def due_s(self) -> float:
        """Return the time when the first of the servos does something."""
        return min(servo.due_s() for servo in self.servos)

    def receive(self, data: bytes, baud: int) -> Iterable[Sending]:
        """Return the answers of the servos that listen at this speed."""
        found: list[Sending] = []
        for request in self._parser.feed(data, self.servos[0].time.now_s()):
            self.update()
            listening = [servo for servo in self.servos if servo.answers and BAUDS[servo.table["baud rate"]] == baud]
            # A bus takes its time for bytes (ten bits each), and an adapter hands on what is complete.
            byte_s = 10 / baud if baud else 0.0
            after_s = byte_s * len(data)
            for servo, device_id, error, answer in _answers(request, listening):
                sender = device_id if self.answers_as is None else self.answers_as
                packet = status(sender, error | servo.error, answer)
                # Each waits its own time after what came before it.
                after_s += servo.table["return delay time"] * 2e-6 + byte_s * len(packet)
                found.append(Sending(packet, after_s))
        return found


# The servo that answers, its ID, error and data.
Answer = tuple[Servo, int, int, bytes]


def _answers(request: Request, servos: Sequence[Servo]) -> Iterator[Answer]:
    if request.instruction == Instruction.STATUS:
        return
    if request.device_id != BROADCAST_ID:
        for servo in servos:
            if servo.device_id == request.device_id:
                yield from _own(request, servo)
            elif servo.table["secondary id"] == request.device_id <= 252:
                # A group's ID: done, and not answered.
                for _ in _own(request, servo):
                    pass
        return
    if not request.is_intact:
        return
    for servo in servos:
        servo.instruction_received()
    match request.instruction:
        case Instruction.PING:
            for servo in sorted(servos, key=lambda servo: servo.device_id):
                yield servo, servo.device_id, Error.NONE, _identity(servo)
        case Instruction.SYNC_READ:
            yield from _sync_read(request.parameters, servos)
        case Instruction.BULK_READ:
            yield from _bulk_read(request.parameters, servos)
        case Instruction.SYNC_WRITE:
            _sync_write(request.parameters, servos)
        case Instruction.BULK_WRITE:
            _bulk_write(request.parameters, servos)
        case Instruction.FACTORY_RESET if request.parameters[:1] == b"\xff":
            # Every servo would have ID 1.
            return
        case Instruction.READ:
            return
        case _:
            for servo in servos:
                _execute(request, servo)


def _identity(servo: Servo) -> bytes:
    return servo.read(0, 2)[1] + servo.read(6, 1)[1]


def _own(request: Request, servo: Servo) -> Iterator[Answer]:
    """Yield the answers of a servo to a packet that is addressed to it."""
    level = servo.table["status return level"]
    if not request.is_intact:
        if level == 2:
            yield servo, servo.device_id, Error.CRC, b""
        return
    servo.instruction_received()
    match request.instruction:
        case Instruction.PING:
            yield servo, servo.device_id, Error.NONE, _identity(servo)
        case Instruction.READ:
            parameters = request.parameters
            if len(parameters) != 4:
                error, data = int(Error.DATA_LENGTH), b""
            else:
                error, data = servo.read(_word(parameters, 0), _word(parameters, 2))
            if level >= 1:
                yield servo, servo.device_id, error, data
        case Instruction.REBOOT:
            # It answers while it still is what it was: with the alert bit of what the restart will clear.
            if level == 2:
                yield servo, servo.device_id, Error.NONE, b""
            servo.reboot()
        case _:
            # Also what gives it another ID is answered by the one that was asked.
            asked_id = servo.device_id
            error = _execute(request, servo)
            if level == 2:
                yield servo, asked_id, error, b""


def _execute(request: Request, servo: Servo) -> int:
    parameters = request.parameters
    match request.instruction:
        case Instruction.WRITE | Instruction.REG_WRITE:
            if len(parameters) < 3:
                return Error.DATA_LENGTH
            act = servo.write if request.instruction == Instruction.WRITE else servo.register
            return act(_word(parameters, 0), parameters[2:])
        case Instruction.ACTION:
            return servo.act()
        case Instruction.FACTORY_RESET:
            if len(parameters) != 1:
                return Error.DATA_LENGTH
            if parameters[0] not in _ALL_BUT:
                return Error.DATA_RANGE
            servo.reset(_ALL_BUT[parameters[0]])
            return Error.NONE
        case Instruction.REBOOT:
            servo.reboot()
            return Error.NONE
        case Instruction.CLEAR:
            return servo.clear() if parameters == _CLEAR else Error.DATA_RANGE
    return Error.INSTRUCTION


def _word(data: bytes, start: int) -> int:
    return int.from_bytes(data[start : start + 2], "little")


def _by_id(servos: Sequence[Servo], device_id: int) -> Iterator[Servo]:
    return (servo for servo in servos if servo.device_id == device_id)


def _read(servo: Servo, address: int, length: int) -> Iterator[Answer]:
    if servo.table["status return level"] >= 1:
        yield servo, servo.device_id, *servo.read(address, length)


def _sync_read(parameters: bytes, servos: Sequence[Servo]) -> Iterator[Answer]:
    for device_id in parameters[4:]:
        for servo in _by_id(servos, device_id):
            yield from _read(servo, _word(parameters, 0), _word(parameters, 2))


def _bulk_read(parameters: bytes, servos: Sequence[Servo]) -> Iterator[Answer]:
    rows = [parameters[start : start + 5] for start in range(0, len(parameters), 5)]
    if len(parameters) % 5 or len({row[0] for row in rows}) < len(rows):
        return
    for row in rows:
        for servo in _by_id(servos, row[0]):
            yield from _read(servo, _word(row, 1), _word(row, 3))


def _sync_write(parameters: bytes, servos: Sequence[Servo]) -> None:
    if len(parameters) < 4:
        return
    address, length = _word(parameters, 0), _word(parameters, 2)
    rows = parameters[4:]
    if len(rows) % (length + 1):
        return
    for start in range(0, len(rows), length + 1):
        for servo in _by_id(servos, rows[start]):
            servo.write(address, rows[start + 1 : start + 1 + length])


def _bulk_write(parameters: bytes, servos: Sequence[Servo]) -> None:
    start = 0
    while start + 5 <= len(parameters):
        address, length = _word(parameters, start + 1), _word(parameters, start + 3)
        data = parameters[start + 5 : start + 5 + length]
        if len(data) < length:
            return
        for servo in _by_id(servos, parameters[start]):
            servo.write(address, data)
        start += 5 + length
