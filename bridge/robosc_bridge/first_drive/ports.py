"""Serial ports of this computer, by the most stable of their names."""

import os
from pathlib import Path

DEVICES = Path("/dev")

_STABLE = ("robosc-*", "serial/by-id/*")
_PLAIN = ("ttyACM*", "ttyUSB*", "ttyAMA*")


def serial_ports(devices: Path = DEVICES) -> list[str]:
    """Return the ports, each once: by the project's udev rules, else by its id, else as the kernel names it."""
    found: dict[str, str] = {}
    for pattern in (*_STABLE, *_PLAIN):
        for path in sorted(devices.glob(pattern)):
            found.setdefault(os.path.realpath(path), str(path))
    return list(found.values())


def stable_name(path: str, devices: Path = DEVICES) -> str:
    """Return the most stable name of a port that is there; the path itself where it has no other."""
    real = os.path.realpath(path)
    for pattern in _STABLE:
        for name in sorted(devices.glob(pattern)):
            if os.path.realpath(name) == real:
                return str(name)
    return path
