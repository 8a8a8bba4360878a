"""Records of a run of a scenario, and the faults in them, however the supervisor and the robot were connected."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from robosc.errors import RoboscError
from robosc.event_logs import check_log, read_log
from robosc.model.structure import Deployment
from robosc.supervisor import decode
from robosc_experiments.scenario import Connection, Outcome, ScenarioError
from robosc_simulated.motion import Motion, MotionError, read_motion
from robosc_simulated.scene import Scene


@dataclass(frozen=True)
class Recorded:
    """Run, as far as records depend on it.

    Attributes:
        folder: Folder that everything is written to.
        model: Model that the supervisor is made of.
        deployment: Deployment of the supervisor.
        scene: The robot's world.
    """

    folder: Path
    model: Path
    deployment: Deployment
    scene: Scene

    @property
    def motion(self) -> Path:
        """The record of the robot's motion."""
        return self.folder / "motion.jsonl"

    @property
    def supervisor(self) -> Path:
        """The supervisor that is executed."""
        return self.folder / f"{self.model.stem}.rsup"

    @property
    def events(self) -> Path:
        """Folder of the event log."""
        return self.folder / "events"

    @property
    def event_log(self) -> Path:
        """The log of the execution; raises ScenarioError if there is none."""
        found = sorted(self.events.glob("*.jsonl"))
        if len(found) != 1:
            raise ScenarioError(f"{len(found)} event logs in {self.events}, where one was to be")
        return found[0]

    def read_motion(self) -> Motion:
        """Return the motion of the robot; raises ScenarioError if its record cannot be read."""
        try:
            return read_motion(self.motion)
        except MotionError as error:
            raise ScenarioError(str(error)) from error

    def outcome(
        self, name: str, connection: Connection, faults: Sequence[str], figures: Mapping[str, float]
    ) -> Outcome:
        """Return the outcome of the run.

        Args:
            name: Name of the scenario.
            connection: Connection by which the supervisor reached the robot.
            faults: Faults of the motion; those of the event log are added.
            figures: Measured figures.

        Raises:
            ScenarioError: There is no event log.
        """
        return Outcome(
            name=name,
            connection=connection,
            folder=self.folder,
            event_log=self.event_log,
            motion=self.motion,
            supervisor=self.supervisor,
            scene=self.scene,
            faults=(*faults, *self._log_faults()),
            figures=figures,
        )

    def _log_faults(self) -> tuple[str, ...]:
        """Return faults of the event log, replayed on the supervisor: each request must have been allowed then."""
        try:
            found = check_log(read_log(self.event_log), decode(self.supervisor.read_bytes()), self.deployment)
        except (RoboscError, OSError) as error:
            return (f"the event log cannot be checked: {error}",)
        faults = [f"line {each.line} of the event log: {each.sentence}" for each in found.violations]
        if not found.requests:
            faults.append("the event log has no request at all")
        return (*faults, *found.notes)
