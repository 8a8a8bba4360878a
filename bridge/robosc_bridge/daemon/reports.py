"""What the threads of the devices tell the loop."""

from dataclasses import dataclass
from enum import StrEnum

from robosc_bridge.devices.interface import DriveReading, Scan


class Device(StrEnum):
    """Which device a report is about."""

    DRIVE = "drive"
    SCANNER = "scanner"


@dataclass(frozen=True)
class DeviceUp:
    """A device was opened.

    Attributes:
        device: Which one.
    """

    device: Device


@dataclass(frozen=True)
class DeviceDown:
    """A device cannot be opened, or failed and was closed; it will be tried again.

    Attributes:
        device: Which one.
        problem: What is wrong, one line for a person.
        retry_s: In how many seconds it is tried again.
        is_first: Whether it was up before, or was never tried: what follows only repeats it.
    """

    device: Device
    problem: str
    retry_s: float
    is_first: bool


@dataclass(frozen=True)
class ResetDone:
    """The drive base was reset, as a person wanted.

    Attributes:
        problem: What is still wrong, one line; empty: nothing.
    """

    problem: str = ""


Report = DeviceUp | DeviceDown | ResetDone | DriveReading | Scan
