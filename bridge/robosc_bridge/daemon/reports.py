"""What the threads of the devices tell the loop."""

from dataclasses import dataclass
from enum import StrEnum

from robosc_bridge.devices.interface import DriveReading, Scan
from robosc_bridge.safety import Caution, Reason


class Device(StrEnum):
    """Which device a report is about."""

    DRIVE = "drive"
    SCANNER = "scanner"
    CAMERA = "camera"


@dataclass(frozen=True)
class DeviceUp:
    """A device works: the drive base was opened, the scanner has made a full turn, or the camera has sent a picture.

    Attributes:
        device: Which one.
    """

    device: Device


@dataclass(frozen=True)
class DeviceDown:
    """A device cannot be opened, failed and was closed, or is silent; it will be tried again.

    Attributes:
        device: Which one.
        problem: What is wrong, one line for a person.
        retry_s: In how many seconds it is tried again; 0: it is still being listened to.
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


@dataclass(frozen=True)
class SafetyNotice:
    """Why the safety layer lets nothing through, or something else about it, has changed.

    Attributes:
        reasons: Why nothing may move; empty: it may.
        warnings: What a person should know.
    """

    reasons: tuple[Reason, ...]
    warnings: tuple[Caution, ...]


@dataclass(frozen=True)
class Sighting:
    """What the camera shows of the line, or that it shows nothing at all.

    Attributes:
        time_s: When the picture had come, or was missed.
        correction_rad_s: How to turn to keep on the line, counter-clockwise above zero; None: no line is in sight.
    """

    time_s: float
    correction_rad_s: float | None


Report = DeviceUp | DeviceDown | ResetDone | SafetyNotice | Sighting | DriveReading | Scan
