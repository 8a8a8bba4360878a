"""Presence of the devices and their last readings, as the loop knows them."""

from robosc_bridge.daemon.threads.reports import Device
from robosc_bridge.devices.interface import DriveReading, Scan

_NAMES = {Device.DRIVE: "drive base"}


class Readiness:
    """State of the devices that belong to the robot: whether they work.

    Args:
        needs_scanner: True if a LiDAR belongs to the robot.
        needs_camera: True if a camera belongs to the robot.

    Attributes:
        devices: For each device that belongs to the robot, True if it works; replaced by a new value at each change.
        reading: Last reading of the drive base; None: there is none yet, or the drive base is lost.
        scan: The LiDAR's last full revolution; None: likewise.
    """

    def __init__(self, *, needs_scanner: bool, needs_camera: bool = False) -> None:
        needed = {Device.DRIVE: True, Device.SCANNER: needs_scanner, Device.CAMERA: needs_camera}
        self.devices = {device: False for device, is_needed in needed.items() if is_needed}
        self.reading: DriveReading | None = None
        self.scan: Scan | None = None

    @property
    def is_drive_there(self) -> bool:
        """True if the drive base works."""
        return self.devices[Device.DRIVE]

    @property
    def has_torque(self) -> bool:
        """True if the motors have torque, by the last reading of a drive base that works."""
        return self.is_drive_there and self.reading is not None and self.reading.is_torque_on

    def device_up(self, device: Device) -> bool:
        """Record that a device works; return True if it did not work before."""
        was_there = self.devices.get(device, False)
        self.devices = {**self.devices, device: True}
        return not was_there

    def device_down(self, device: Device) -> bool:
        """Record that a device does not work; return True if it worked before."""
        was_there = self.devices.get(device, False)
        self.devices = {**self.devices, device: False}
        if device is Device.SCANNER:
            self.scan = None
        elif device is Device.DRIVE:
            self.reading = None
        return was_there

    def missing(self) -> str:
        """Return what must be there before anything can start, in one sentence; empty: nothing."""
        for device, is_there in self.devices.items():
            if not is_there:
                return f"the {_NAMES.get(device, device)} is not there"
        if Device.SCANNER in self.devices and self.scan is None:
            return "the scanner has made no full revolution yet"
        return ""
