"""Wanted motion of the wheels: keep a velocity, rotate by an angle, or stand still.

A velocity that the supervisor commanded holds until its next command, as on any drive base, unless the supervisor
releases it. The loop passes it to the safety layer anew in every cycle, so that it ends with the loop.
"""

from collections.abc import Callable

from robosc_bridge.devices.interface import STANDSTILL, DriveReading, Velocity
from robosc_bridge.skills import Rotate, RotateState

STILL_M_S, STILL_RAD_S = 0.01, 0.03
"""Measured speeds up to which the robot counts as standing."""


class MotionTarget:
    """Target of the motion: a velocity, a rotation or a standstill; the last one that was set counts.

    Args:
        rotate: The skill that rotates.
        command: Function of the safety layer that takes a velocity and the time.
    """

    def __init__(self, rotate: Rotate, command: Callable[[Velocity, float], None]) -> None:
        self._rotate = rotate
        self._command = command
        self._wish = STANDSTILL
        self._is_paused = False
        # Since when a standstill is wanted, and True if it was measured since then.
        self._since_s = 0.0
        self._is_still = False

    @property
    def is_braking(self) -> bool:
        """True if a standstill is wanted and was not measured since then: the wheels may still turn."""
        return self._wish == STANDSTILL and not self._is_still

    @property
    def is_rotating(self) -> bool:
        """True if a rotation by an angle is under way."""
        return self._rotate.is_rotating

    @property
    def remaining_rad(self) -> float:
        """Remaining angle of a rotation, in radians, counter-clockwise above zero."""
        return self._rotate.remaining_rad

    @property
    def reason(self) -> str:
        """Reason why the last rotation failed; empty: it did not fail."""
        return self._rotate.reason

    def drive(self, velocity: Velocity, now_s: float) -> None:
        """Keep a velocity from now on; a rotation under way has failed."""
        self._rotate.cancel("another motion was asked for")
        self._pass(velocity, now_s)

    def stop(self, now_s: float, reason: str = "the robot was commanded to stop") -> None:
        """Stand still from now on; a rotation under way has failed."""
        self._rotate.cancel(reason)
        self._pass(STANDSTILL, now_s)

    def rotate(self, angle_rad: float, now_s: float) -> bool:
        """Begin a rotation, counter-clockwise above zero; False: another one is under way and goes on."""
        if not self._rotate.start(angle_rad, now_s):
            return False
        self._pass(STANDSTILL, now_s)
        return True

    def pause(self, is_paused: bool, now_s: float) -> None:
        """Stand still while the executor is in a safe stop; a velocity is forgotten, a rotation goes on afterwards."""
        if is_paused and not self._rotate.is_rotating:
            self._wish = STANDSTILL
        if is_paused != self._is_paused:
            self._is_paused = is_paused
            self._pass(self._wish, now_s)

    def on_drive_reading(self, reading: DriveReading) -> None:
        """Note how fast the robot moves, and go on with a rotation from a new reading of the drive base."""
        velocity = reading.velocity
        if reading.time_s >= self._since_s:
            self._is_still = abs(velocity.linear_m_s) <= STILL_M_S and abs(velocity.angular_rad_s) <= STILL_RAD_S
        if self._rotate.is_rotating:
            self._pass(self._rotate.update(reading.pose.heading_rad, reading.time_s), reading.time_s)

    def refresh(self, now_s: float) -> None:
        """Repeat the wanted motion to the safety layer, in each cycle of the loop."""
        if self._rotate.is_rotating:
            # For its time limit only: the remaining angle is unknown without a new heading.
            self._rotate.update(None, now_s)
            if not self._rotate.is_rotating:
                self._wish = STANDSTILL
        self._pass(self._wish, now_s)

    @property
    def has_arrived(self) -> bool:
        """True if the last rotation has come to its end."""
        return self._rotate.state is RotateState.DONE

    def _pass(self, velocity: Velocity, now_s: float) -> None:
        if velocity == STANDSTILL != self._wish:
            self._since_s, self._is_still = now_s, False
        self._wish = velocity
        self._command(STANDSTILL if self._is_paused else velocity, now_s)
