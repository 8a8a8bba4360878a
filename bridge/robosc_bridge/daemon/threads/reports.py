"""Reports of the devices' threads to the loop."""

from dataclasses import dataclass
from enum import StrEnum

from robosc_bridge.devices.interface import DriveReading, Scan
from robosc_bridge.safety import Caution, Reason


class Device(StrEnum):
    """Device that a report is about."""

    DRIVE = "drive"
    SCANNER = "scanner"
    CAMERA = "camera"


@dataclass(frozen=True)
class DeviceUp:
    """Report that a device works.

    The drive base was opened, the scanner has made a full revolution, or the camera has sent a picture.

    Attributes:
        device: Device that works.
    """

    device: Device


@dataclass(frozen=True)
class DeviceDown:
    """Report that a device cannot be opened, failed and was closed, or is silent; it will be tried again.

    Attributes:
        device: Device that the report is about.
        problem: Description of what is wrong, one line for a person.
        retry_s: Time until the next attempt, in seconds; 0: the device is still open and may recover.
        is_first: True if the device was up before, or was never tried; the reports that follow repeat this one.
    """

    device: Device
    problem: str
    retry_s: float
    is_first: bool


@dataclass(frozen=True)
class ResetDone:
    """Report that the drive base was reset on an operator's command.

    Attributes:
        problem: Description of a problem that remains, one line; empty: none.
    """

    problem: str = ""


@dataclass(frozen=True)
class SafetyNotice:
    """Report that the reasons or warnings of the safety layer have changed.

    Attributes:
        reasons: Reasons why the robot may not move; empty: it may.
        warnings: Warnings for a person.
    """

    reasons: tuple[Reason, ...]
    warnings: tuple[Caution, ...]


@dataclass(frozen=True)
class Sighting:
    """Report of the line in a picture of the camera, or that there is no picture.

    Attributes:
        time_s: Time when the picture had come, or was missed, in seconds.
        correction_rad_s: Yaw rate to keep on the line, in rad/s, counter-clockwise above zero; None: no line is in
            sight.
    """

    time_s: float
    correction_rad_s: float | None


Report = DeviceUp | DeviceDown | ResetDone | SafetyNotice | Sighting | DriveReading | Scan
