"""Files that grow while a scenario runs: their last line, and their number of lines."""

import contextlib
from dataclasses import dataclass
from pathlib import Path

import msgspec

_END_BYTES = 4096


@dataclass(frozen=True)
class MotionState:
    """Position and motion of the robot.

    Attributes:
        world_s: Time since the simulation began, in seconds.
        x_m: Position of the middle between its wheels, in metres.
        y_m: Position of the same, in metres.
        linear_m_s: Speed forward.
        angular_rad_s: Yaw rate, counter-clockwise.
        collisions: Number of times that it has come to something.
    """

    world_s: float = 0.0
    x_m: float = 0.0
    y_m: float = 0.0
    linear_m_s: float = 0.0
    angular_rad_s: float = 0.0
    collisions: int = 0

    @property
    def is_standing(self) -> bool:
        """True if the robot does not move at all."""
        return abs(self.linear_m_s) < 1e-3 and abs(self.angular_rad_s) < 1e-2


_DECODER = msgspec.json.Decoder(MotionState)


def latest(motion: Path) -> MotionState:
    """The last whole sample of a record of motion; before there is one, a robot at rest at the origin."""
    with contextlib.suppress(OSError), motion.open("rb") as file:
        file.seek(max(file.seek(0, 2) - _END_BYTES, 0))
        lines = file.read().split(b"\n")
        # Behind the last line feed is a line that is being written; the first one may be the end of another.
        for line in reversed(lines[:-1]):
            if line.startswith(b'{"time":') and b'"happening"' not in line:
                with contextlib.suppress(msgspec.DecodeError):
                    return _DECODER.decode(line)
    return MotionState()


class LineCount:
    """Counts the lines of a file that grows.

    Args:
        path: Of the file; it may not be there yet.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._read = 0
        self._count = 0

    def poll(self) -> int:
        """Return the number of lines by now."""
        with contextlib.suppress(OSError), self._path.open("rb") as file:
            file.seek(self._read)
            while data := file.read(1 << 16):
                self._read += len(data)
                self._count += data.count(b"\n")
        return self._count
