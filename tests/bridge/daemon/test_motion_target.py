"""Wanted motion, as the safety layer gets it: what was wanted before a stop does not come back."""

from robosc_bridge.daemon.robot.motion import MotionTarget
from robosc_bridge.devices.interface import STANDSTILL, Pose, Velocity
from robosc_bridge.skills import Rotate
from robosc_bridge.skills.settings import RotateSettings
from support.safety import reading

AHEAD = Velocity(0.1, 0.0)


class Passed(MotionTarget):
    """Target whose commands are kept.

    Attributes:
        commands: All velocities that were passed on.
    """

    def __init__(self) -> None:
        self.commands: list[Velocity] = []
        super().__init__(Rotate(RotateSettings()), lambda velocity, now_s: self.commands.append(velocity))

    def heads(self, heading_rad: float, time_s: float) -> Velocity:
        """Take a heading, and return the velocity that is passed on."""
        self.on_drive_reading(reading(time_s, pose=Pose(heading_rad=heading_rad)))
        return self.commands[-1]


def test_a_velocity_lasts_until_the_next_one() -> None:
    motion = Passed()
    motion.drive(AHEAD, 1.0)
    motion.refresh(1.1)
    motion.stop(1.2)
    motion.refresh(1.3)
    assert motion.commands == [AHEAD, AHEAD, STANDSTILL, STANDSTILL]


def test_no_velocity_from_before_a_safe_stop_or_during_it_comes_back() -> None:
    motion = Passed()
    motion.drive(AHEAD, 1.0)
    motion.pause(True, 1.1)
    motion.refresh(1.1)
    motion.pause(False, 1.2)
    motion.refresh(1.2)
    motion.pause(True, 1.3)
    motion.drive(AHEAD, 1.3)
    motion.pause(True, 1.4)
    motion.pause(False, 1.5)
    motion.refresh(1.5)
    assert motion.commands == [AHEAD, *[STANDSTILL] * (len(motion.commands) - 1)]
    motion.drive(AHEAD, 1.6)
    assert motion.commands[-1] == AHEAD


def test_a_rotation_rests_in_a_safe_stop_and_goes_on() -> None:
    motion = Passed()
    assert motion.rotate(1.0, 1.0)
    rotating = motion.heads(0.0, 1.1)
    assert rotating.angular_rad_s > 0
    motion.pause(True, 1.2)
    motion.pause(False, 1.2)
    assert motion.commands[-2:] == [STANDSTILL, rotating]
    motion.pause(True, 1.2)
    assert (motion.commands[-1], motion.heads(0.1, 1.3)) == (STANDSTILL, STANDSTILL)
    motion.pause(False, 1.4)
    assert motion.commands[-1] == rotating


def test_a_rotation_that_takes_too_long_ends_at_a_standstill() -> None:
    motion = Passed()
    motion.rotate(1.0, 1.0)
    motion.heads(0.0, 1.1)
    motion.refresh(1.2)
    assert motion.commands[-1] != STANDSTILL
    motion.refresh(100.0)
    assert (motion.commands[-1], motion.is_rotating, motion.reason) == (
        STANDSTILL,
        False,
        "the rotation has taken too long",
    )


def test_a_rotation_begins_at_a_standstill_and_ends_with_another_motion() -> None:
    motion = Passed()
    motion.drive(AHEAD, 1.0)
    assert motion.rotate(1.0, 1.1) and not motion.rotate(2.0, 1.2)
    assert motion.commands == [AHEAD, STANDSTILL]
    motion.drive(AHEAD, 1.3)
    assert (motion.is_rotating, motion.reason) == (False, "another motion was asked for")
    assert motion.heads(0.0, 1.4) == AHEAD
