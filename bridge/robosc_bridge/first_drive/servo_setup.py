"""Set-up of a servo as a wheel: id, baud rate, direction, and the settings that the bridge requires.

Torque goes off first: with torque on, a servo refuses to change its EEPROM. Only registers that differ are written,
because an EEPROM wears out, and each value is read back. Id and baud rate come last, in this order: after a change of
either, the servo must be addressed anew.

Source: ROBOTIS e-Manual, pages XL430-W250 and XM430-W210 ("Control Table Data", "EEPROM Area").
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from robosc_bridge.devices.dynamixel_bus import DynamixelBus
from robosc_bridge.devices.robots import SERVOS
from robosc_bridge.errors import DeviceError, DeviceFaultError, DeviceSilentError, WrongDeviceError
from robosc_bridge.first_drive.servo_bus import BAUD, BAUD_NUMBERS, BAUDS, ID, LIMIT_S, broadcast_ping
from robosc_bridge.host import Host, Port
from robosc_bridge.protocol import servo

MOST_ID = 252
_SHUTDOWN = servo.OVERHEATING | servo.SHOCK | servo.OVERLOAD
_STILL_RAW = 10
_VELOCITY = 128


@dataclass(frozen=True)
class RequestedSettings:
    """Wanted settings of a servo; None: left as it is.

    Attributes:
        device: Id.
        baud: Baud rate.
        is_reversed: True if its direction is reversed, like that of a TurtleBot3's right servo.
    """

    device: int | None = None
    baud: int | None = None
    is_reversed: bool | None = None


@dataclass(frozen=True)
class Change:
    """A register that is to be written.

    Attributes:
        name: Name of the register.
        address: Its address.
        before: Its value.
        after: The wanted value.
    """

    name: str
    address: int
    before: int
    after: int


class ServoSetup:
    """A servo on a line, to be set up.

    Args:
        line: Open line; its baud rate may differ afterwards.
        host: Host whose time is used.
        path: Name of the line in messages.
        bauds: Baud rates at which to look for the servo.
    """

    def __init__(self, line: Port, host: Host, path: str, bauds: Sequence[int] = BAUDS) -> None:
        self._line = line
        self._host = host
        self._path = path
        self._bauds = bauds
        self._bus = self._new_bus()
        self.device = 0
        self._others: frozenset[int] = frozenset()

    @property
    def baud(self) -> int:
        """Speed at which it is reached."""
        return self._line.baud

    def find(self, device: int | None) -> int:
        """Find the servo of an id, or the only one; return its id.

        Raises:
            LineError: The line is gone.
            DeviceSilentError: None answers.
            WrongDeviceError: Several answer, or it is none that can be driven.
        """
        for baud in self._bauds:
            self._line.set_baud(baud)
            models = {one: model for one, model, _ in broadcast_ping(self._line, self._host)}
            wanted = [one for one in models if device in (None, one)]
            if not wanted:
                continue
            if len(wanted) > 1:
                ids = ", ".join(map(str, wanted))
                raise WrongDeviceError(f"{self._path}: servos {ids} answer; name one with --id, or unplug the others")
            if models[wanted[0]] not in SERVOS:
                raise WrongDeviceError(f"{self._path}: servo {wanted[0]} is of model {models[wanted[0]]}, no wheel")
            self._bus = self._new_bus()
            self.device, self._others = wanted[0], frozenset(models) - {wanted[0]}
            return self.device
        which = "no servo" if device is None else f"no servo {device}"
        raise DeviceSilentError(f"{self._path}: {which} answers at {', '.join(map(str, self._bauds))} baud")

    def plan(self, wish: RequestedSettings) -> list[Change]:
        """Return what is to be written, in this order; empty: it is as it is wanted.

        Raises:
            LineError: The line is gone.
            DeviceError: It does not answer, or another one has the id that is wanted.
        """
        if wish.device is not None and wish.device in self._others:
            raise WrongDeviceError(f"{self._path}: another servo on this line has the id {wish.device} already")
        return [change for change in self._wanted(wish) if change.before != change.after]

    def _wanted(self, wish: RequestedSettings) -> Iterator[Change]:
        drive_mode = self._number(servo.DRIVE_MODE)
        is_reversed = bool(drive_mode & servo.REVERSE) if wish.is_reversed is None else wish.is_reversed
        yield Change("drive mode", servo.DRIVE_MODE, drive_mode, servo.REVERSE if is_reversed else 0)
        mode = self._number(servo.OPERATING_MODE)
        yield Change("operating mode", servo.OPERATING_MODE, mode, servo.VELOCITY_MODE)
        startup = self._number(servo.STARTUP)
        yield Change("startup configuration", servo.STARTUP, startup, 0)
        shutdown = self._number(servo.SHUTDOWN)
        yield Change("shutdown", servo.SHUTDOWN, shutdown, shutdown | _SHUTDOWN)
        yield Change("id", ID, self.device, self.device if wish.device is None else wish.device)
        number = self._number(BAUD)
        yield Change("baud rate", BAUD, number, number if wish.baud is None else BAUD_NUMBERS[wish.baud])

    def write(self, changes: Sequence[Change]) -> None:
        """Switch torque off, write the changes, and see that each has been taken.

        Raises:
            LineError: The line is gone.
            DeviceFaultError: It rotates, does not let go, or does not take a value.
            DeviceError: It does not answer, or refuses.
        """
        self._bus.begin(LIMIT_S)
        self._bus.write(self.device, servo.TORQUE, b"\0")
        if self._number(servo.TORQUE):
            raise DeviceFaultError(f"{self._path}: servo {self.device} does not let go; nothing was written")
        speed_raw = int.from_bytes(self._read(_VELOCITY, 4), "little", signed=True)
        if abs(speed_raw) > _STILL_RAW:
            raise DeviceFaultError(f"{self._path}: servo {self.device} still rotates; nothing was written; try again")
        for change in changes:
            self._write(change)

    def _write(self, change: Change) -> None:
        name = f"{self._path}: servo {self.device}"
        self._bus.begin(LIMIT_S)
        try:
            self._bus.write(self.device, change.address, bytes((change.after,)))
        except DeviceSilentError:
            # It may answer by its new name or at its new speed already, whatever became of the answer.
            if change.address not in (ID, BAUD):
                raise
        if change.address == ID:
            self.device = change.after
        elif change.address == BAUD:
            numbers = {number: baud for baud, number in BAUD_NUMBERS.items()}
            self._line.set_baud(numbers[change.after])
        if change.address in (ID, BAUD):
            self._bus = self._new_bus()
        try:
            found = self._number(change.address)
        except DeviceError as error:
            raise DeviceFaultError(f"{name} does not answer after its {change.name} was written: {error}") from error
        if found != change.after:
            raise DeviceFaultError(f"{name} has {change.name} {found}, not {change.after}, after it was written")

    def _new_bus(self) -> DynamixelBus:
        return DynamixelBus(self._line, lambda device: f"{self._path}: servo {device}", host=self._host)

    def _read(self, address: int, length: int) -> bytes:
        self._bus.begin(LIMIT_S)
        return self._bus.read(self.device, address, length).data

    def _number(self, address: int) -> int:
        return self._read(address, 1)[0]
