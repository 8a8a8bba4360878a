"""What the loop knows of the devices: whether each is there, and what it told last."""

from robosc_bridge.daemon.reports import Device
from robosc_bridge.devices.interface import DriveReading, Scan

_NAMES = {Device.DRIVE: "drive base"}


class Readiness:
    """Whether the devices that belong to the robot work.

    Args:
        needs_scanner: Whether a LiDAR belongs to it.
        needs_camera: Whether a camera does.

    Attributes:
        devices: Whether each device that belongs to the robot works; replaced at each change, never changed.
        reading: What the drive base told last; None: nothing yet, or it is lost.
        scan: The LiDAR's last full turn; None: the same.
    """

    def __init__(self, *, needs_scanner: bool, needs_camera: bool = False) -> None:
        needed = {Device.DRIVE: True, Device.SCANNER: needs_scanner, Device.CAMERA: needs_camera}
        self.devices = {device: False for device, is_needed in needed.items() if is_needed}
        self.reading: DriveReading | None = None
        self.scan: Scan | None = None

    @property
    def is_drive_there(self) -> bool:
        """Whether the drive base works."""
        return self.devices[Device.DRIVE]

    @property
    def has_torque(self) -> bool:
        """Whether the motors hold, as far as anybody can tell."""
        return self.is_drive_there and self.reading is not None and self.reading.is_torque_on

    def came(self, device: Device) -> bool:
        """A device works; whether that is new."""
        was_there = self.devices.get(device, False)
        self.devices = {**self.devices, device: True}
        return not was_there

    def went(self, device: Device) -> bool:
        """A device does not work; whether that is new."""
        was_there = self.devices.get(device, False)
        self.devices = {**self.devices, device: False}
        if device is Device.SCANNER:
            self.scan = None
        elif device is Device.DRIVE:
            self.reading = None
        return was_there

    def missing(self) -> str:
        """What must be there before anything can start, one sentence; empty: nothing."""
        for device, is_there in self.devices.items():
            if not is_there:
                return f"the {_NAMES.get(device, device)} is not there"
        if Device.SCANNER in self.devices and self.scan is None:
            return "the scanner has made no full turn yet"
        return ""
