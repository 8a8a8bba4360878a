"""Drivers by name, made as what they are."""

from typing import Any, cast

from robosc_bridge.devices.interface import DriveBase, RangeScanner
from robosc_bridge.driver_registry import Kind, find_driver


def make_drive_base(name: str, **arguments: Any) -> DriveBase:
    """A drive base, not opened yet.

    Args:
        name: Of its driver.
        arguments: Of the driver.

    Raises:
        UnknownDriverError: There is none of that name; the message says what there is.
    """
    return cast(DriveBase, find_driver(Kind.DRIVE_BASE, name).make(**arguments))


def make_range_scanner(name: str, **arguments: Any) -> RangeScanner:
    """A range scanner, not opened yet.

    Args:
        name: Of its driver.
        arguments: Of the driver.

    Raises:
        UnknownDriverError: There is none of that name; the message says what there is.
    """
    return cast(RangeScanner, find_driver(Kind.RANGE_SCANNER, name).make(**arguments))
