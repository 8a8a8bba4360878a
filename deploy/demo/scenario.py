"""Scenario of the simulated robot: what happens, and when; shared by the robot, which plays it, and the checks."""

from dataclasses import dataclass

REACTION_LIMIT_S = 0.3
"""The robot must stand still this long after whatever forbids it to move."""


@dataclass(frozen=True)
class Happening:
    """A change in the robot's world.

    Attributes:
        at_s: Seconds after the controller is connected.
        name: Name of what happens, in words for the log.
        forbids_moving: True if the robot must stand still from here on until `ended_by`.
        ended_by: Name of the happening that lets it move again.
    """

    at_s: float
    name: str
    forbids_moving: bool = False
    ended_by: str = ""


HAPPENINGS = (
    Happening(0.5, "line found"),
    Happening(2.5, "line lost", forbids_moving=True, ended_by="line found again"),
    Happening(3.5, "line found again"),
    Happening(5.0, "obstacle", forbids_moving=True, ended_by="obstacle gone"),
    Happening(6.0, "obstacle gone"),
    Happening(7.5, "stop button", forbids_moving=True, ended_by="resume button"),
    Happening(8.5, "resume button"),
    Happening(10.0, "end"),
)
