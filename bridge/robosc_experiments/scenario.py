"""Results of a scenario, however the supervisor and the robot were connected."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from robosc_simulated.scene import Scene

Connection = Literal["serial", "ros2", "ros1"]

Say = Callable[[str], None]
"""Takes lines of progress, each meant to stand in place of the one before."""


class ScenarioError(Exception):
    """A scenario that could not be run to its end, in one sentence; files of its processes are in its folder."""


@dataclass(frozen=True)
class Outcome:
    """A scenario that was run.

    Attributes:
        name: Name of the scenario, such as `maze` or `line`.
        connection: Connection by which the supervisor reached the robot.
        folder: Folder of everything that was written.
        event_log: Log of the supervisor's execution (JSON Lines).
        motion: Motion of the robot (JSON Lines), as `robosc_simulated.motion` reads it.
        supervisor: Supervisor that was executed (`.rsup`).
        scene: The world.
        faults: Faults of the log against the supervisor, and of the motion against the requirements.
        figures: Measured figures, by name with the unit, such as `world_s`, `wall_s`, `collisions`.
    """

    name: str
    connection: Connection
    folder: Path
    event_log: Path
    motion: Path
    supervisor: Path
    scene: "Scene"
    faults: tuple[str, ...]
    figures: Mapping[str, float] = field(default_factory=dict)

    @property
    def has_passed(self) -> bool:
        """True if nothing was wrong."""
        return not self.faults
