"""Errors between the bridge and the world.

    BridgeError
    |-- LineError               a serial line or a camera cannot be used
    |   |-- LineMissingError    there is no such port (any more)
    |   |-- LineBusyError       another program has it
    |   |-- LineDeniedError     this user may not open it
    |   `-- LineLostError       it was open and is gone: unplugged, hung up
    `-- DeviceError             something answers, and not as the device should
        |-- DeviceSilentError   it does not answer in time
        |-- StoppedError        it was not begun, as a stop came meanwhile
        |-- WrongDeviceError    another kind of device, another id, firmware or setting than can be driven
        `-- DeviceFaultError    it reports a fault of its own, which a person must see to

Whatever pyserial, termios, dynamixel-sdk or pymavlink raise is translated into one of these where it is first met.
Malformed bytes from a wire are none: they are counted and dropped.
"""


class BridgeError(Exception):
    """Base of all; its text is one line for a person, with what to do about it where that is known."""


class LineError(BridgeError):
    """Error that a serial line or a camera cannot be used.

    Args:
        path: Path of the port.
        problem: Description of what is wrong, without the path.
    """

    def __init__(self, path: str, problem: str) -> None:
        super().__init__(f"{path}: {problem}")
        self.path = path
        self.problem = problem


class LineMissingError(LineError):
    """The port does not exist: not plugged in, or named differently."""


class LineBusyError(LineError):
    """Another program has it."""


class LineDeniedError(LineError):
    """This user may not open it: most often not in the group `dialout`."""


class LineLostError(LineError):
    """The line was open and is gone."""


class DeviceError(BridgeError):
    """The device answers differently from what was expected."""


class DeviceSilentError(DeviceError, TimeoutError):
    """The device does not answer in time."""


class StoppedError(DeviceError):
    """A stop came meanwhile: what was to begin does not."""


class WrongDeviceError(DeviceError):
    """Another device, firmware or setting than can be driven."""


class DeviceFaultError(DeviceError):
    """The device reports a fault of its own, which a person must fix."""
