"""Recorder of a robot's motion, in the format of `robosc.motion_record`."""

import math

import msgspec

from robosc.motion_record import (
    MOST_BYTES,
    MOST_LINE_BYTES,
    Event,
    Motion,
    MotionError,
    Sample,
    read_motion,
)
from robosc_simulated.output import Sink
from robosc_simulated.world import STEP_S, World, WorldEvent

__all__ = [
    "MOST_BYTES",
    "MOST_LINE_BYTES",
    "SAMPLE_S",
    "Event",
    "Motion",
    "MotionError",
    "MotionRecorder",
    "Sample",
    "read_motion",
]

SAMPLE_S = 0.05
"""Time of the world between two samples, in seconds."""

_EVERY = round(SAMPLE_S / STEP_S)
# Readable, and finer than any sensor.
_DIGITS = 6


class MotionRecorder:
    """Recorder that writes down how a world's robot moves, until it is closed.

    Args:
        world: World that is watched from now on.
        stream: Destination, such as an `Output`; is closed by whoever opened it.
    """

    def __init__(self, world: World, stream: Sink) -> None:
        self._world = world
        self._stream = stream
        self._encoder = msgspec.json.Encoder()
        with world.time.lock:
            world.catch_up()
            self._steps = 0
            self._last = (world.x_m, world.y_m, world.heading_rad)
            self._write(self._sample(world.lived_s))
            world.watch(self._step, self._happen)

    def close(self) -> None:
        """Watch no more, and write where the robot is at the end."""
        with self._world.time.lock:
            world = self._world
            world.catch_up()
            steps = self._steps % _EVERY
            # It may have been put down elsewhere since a sample, with no step after it.
            if steps or self._last != (world.x_m, world.y_m, world.heading_rad):
                self._write(self._sample(world.lived_s, (steps or _EVERY) * STEP_S))
            end_s = round(world.lived_s, _DIGITS)
            x_m, y_m = round(world.x_m, _DIGITS), round(world.y_m, _DIGITS)
            self._write(Event(self._time(world.lived_s), end_s, "end", x_m, y_m))
            self._world.unwatch(self._step, self._happen)

    def _step(self, world_s: float) -> None:
        self._steps += 1
        if self._steps % _EVERY == 0:
            self._write(self._sample(world_s))

    def _sample(self, world_s: float, since_s: float = SAMPLE_S) -> Sample:
        world = self._world
        x_m, y_m, heading_rad = self._last
        self._last = (world.x_m, world.y_m, world.heading_rad)
        ahead_m = (world.x_m - x_m) * math.cos(heading_rad) + (world.y_m - y_m) * math.sin(heading_rad)
        return Sample(
            self._time(world_s),
            round(world_s, _DIGITS),
            round(world.x_m, _DIGITS),
            round(world.y_m, _DIGITS),
            round(world.heading_rad, _DIGITS),
            round(ahead_m / since_s, _DIGITS),
            round((world.heading_rad - heading_rad) / since_s, _DIGITS),
            world.collisions,
        )

    def _happen(self, world_s: float, happening: WorldEvent) -> None:
        self._write(
            Event(
                self._time(world_s),
                round(world_s, _DIGITS),
                happening.kind,
                round(happening.x_m, _DIGITS),
                round(happening.y_m, _DIGITS),
                happening.name,
                happening.radius_m,
                happening.is_there,
            )
        )

    def _time(self, world_s: float) -> float:
        """Return the time of a step by the computer's clock: it is often lived some time after it was due."""
        time = self._world.time
        return round(time.clock.wall() - (time.world_s() - world_s) / time.factor, _DIGITS)

    def _write(self, entry: Sample | Event) -> None:
        self._stream.write(self._encoder.encode(entry).decode("utf-8") + "\n")
        self._stream.flush()
