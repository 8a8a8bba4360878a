"""The record of a robot's motion: poses, velocities and events, as JSON Lines, which a simulator writes.

The record has a sample every 50 ms of simulated time, each happening at its time, and the end, after a last sample if
the robot has moved since. Each line is written at once:

    {"time": 1767225600.05, "world_s": 0.05, "x_m": 0.0, "y_m": 0.0, "heading_rad": 0.0, "linear_m_s": 0.1, ...}
    {"time": 1767225612.4, "world_s": 12.4, "happening": "goal", "x_m": 1.2, "y_m": 0.61}
    {"time": 1767225613.0, "world_s": 13.0, "happening": "end", "x_m": 1.25, "y_m": 0.61}

`time` is in seconds since 1970, `world_s` in seconds of the world since the simulation began.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import msgspec

MOST_BYTES = 512 * 1024 * 1024
"""Maximum size of a file, in bytes: a day of the world has some 350 MB."""

MOST_LINE_BYTES = 4096

_Number = Annotated[float, msgspec.Meta(ge=-1e12, le=1e12)]


class MotionError(ValueError):
    """A record of motion cannot be used; one sentence with its place."""


class Sample(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Place and speed of the robot, as the world has them.

    Attributes:
        time: Seconds since 1970.
        world_s: Seconds of the world, since the simulation began.
        x_m: x of the middle between the wheels.
        y_m: y of the same.
        heading_rad: Heading counter-clockwise from x, unbounded.
        linear_m_s: Forward speed, as it moved on the floor since the last sample.
        angular_rad_s: Yaw rate, counter-clockwise, likewise.
        collisions: Number of times that it has come to a wall or an obstacle.
    """

    time: _Number
    world_s: _Number
    x_m: _Number
    y_m: _Number
    heading_rad: _Number
    linear_m_s: _Number
    angular_rad_s: _Number
    collisions: Annotated[int, msgspec.Meta(ge=0)]


class Event(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An event in the record.

    Attributes:
        time: Seconds since 1970.
        world_s: Seconds of the world, since the simulation began.
        happening: A collision, the goal reached for the first time, an obstacle moved, put away or put back; the end.
        x_m: x of the robot; for an obstacle, x of the place where that is now.
        y_m: y of the same.
        name: Name of the obstacle that was met or moved; nothing for walls and the goal.
        radius_m: Radius of the obstacle that was moved; 0: of something else.
        is_there: True if that obstacle is there now.
    """

    time: _Number
    world_s: _Number
    happening: Literal["collision", "goal", "obstacle", "end"]
    x_m: _Number
    y_m: _Number
    name: Annotated[str, msgspec.Meta(max_length=40)] = ""
    radius_m: _Number = 0.0
    is_there: bool = True


@dataclass(frozen=True)
class Motion:
    """All of a record.

    Attributes:
        samples: Samples in the order of time.
        happenings: Events in the order of time, except the end.
        has_ended: True if the recorder has written its end: one that was killed, or whose disk was full, has not.
    """

    samples: tuple[Sample, ...]
    happenings: tuple[Event, ...]
    has_ended: bool = True


def read_motion(path: Path) -> Motion:
    """Read what a recorder wrote.

    Raises:
        MotionError: It cannot be read, is too large, or a line of it is none of a record; one sentence with the
            place.
    """
    samples: list[Sample] = []
    happenings: list[Event] = []
    sample, event = msgspec.json.Decoder(Sample), msgspec.json.Decoder(Event)
    try:
        if not path.is_file():
            raise MotionError(
                f"{path}: there is no such file" if not path.exists() else f"{path}: is not a regular file"
            )
        if path.stat().st_size > MOST_BYTES:
            raise MotionError(f"{path}: is larger than {MOST_BYTES} bytes")
        with path.open("rb") as file:
            number = 0
            while line := file.readline(MOST_LINE_BYTES + 1):
                number += 1
                if len(line) > MOST_LINE_BYTES:
                    raise MotionError(f"{path}:{number}: is longer than {MOST_LINE_BYTES} bytes")
                try:
                    if b'"happening"' in line:
                        happenings.append(event.decode(line))
                    else:
                        samples.append(sample.decode(line))
                except (msgspec.DecodeError, UnicodeDecodeError) as error:
                    # The last line of a simulator that was killed may be half a line.
                    if not line.endswith(b"\n") and samples:
                        break
                    raise MotionError(f"{path}:{number}: is not an entry of a motion record: {error}") from error
                _check_order(path, number, samples, happenings)
    except OSError as error:
        raise MotionError(f"{path}: cannot be read: {error.strerror}") from error
    has_ended = bool(happenings) and happenings[-1].happening == "end"
    return Motion(tuple(samples), tuple(event for event in happenings if event.happening != "end"), has_ended)


def _check_order(path: Path, number: int, samples: list[Sample], happenings: list[Event]) -> None:
    for found in (samples, happenings):
        if len(found) > 1 and found[-1].world_s < found[-2].world_s:
            raise MotionError(f"{path}:{number}: goes back in time")
