"""The examples' scenarios on virtual time: a whole bridge, the bytes of its lines, and a robot in a scene."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from robosc.execution.runtime.event_log import MemoryLog
from robosc_bridge.configuration import map_channels, parse
from robosc_bridge.daemon.assembly import Machine, assemble
from robosc_bridge.host import Thread
from robosc_simulated import Scene, SimulatedTurtleBot3, VirtualHost
from support.daemons import supervisor_of

EXAMPLES = Path(__file__).parents[2] / "examples"
LIMIT_S = 15.0
MAZE_CHANNELS = """channels:
  /scan: {channel: scanner}
  /rotate_left: {channel: rotate, unit: degrees, direction: left}
  /rotate_right: {channel: rotate, unit: degrees, direction: right}
  /rotate_done: {channel: rotated, outcome: done}
  /cmd_vel: {channel: drive}
"""


@dataclass
class ScenarioRun:
    """A scenario at work.

    Attributes:
        host: Host on which the bridge runs.
        robot: The simulated robot.
        machine: The daemon and its devices' threads.
        log: Log of the model's events.
        thread: Thread of the loop.
    """

    host: VirtualHost
    robot: SimulatedTurtleBot3
    machine: Machine
    log: MemoryLog
    thread: Thread

    def until_reached(self, longest_s: float) -> float:
        """Wait for the goal; return the time that it took, in seconds of the world.

        Raises:
            AssertionError: It is not reached in time, a wall was touched, or the run has ended.
        """
        world = self.robot.world
        while world.reached_s is None:
            assert world.lived_s < longest_s, f"it is still inside, at {world.pose}"
            assert self.thread.is_alive(), self.machine.daemon.problem
            self.host.sleep(0.5)
            assert world.collisions == 0, f"it has touched a wall at {world.pose} after {world.lived_s:.1f} s"
        return world.reached_s


@contextmanager
def maze_run(
    scene: Scene,
    *,
    profile: str = "ideal",
    base: str = "opencr",
    lidar: str = "lds01",
    seed: int = 0,
    model: str = "narrow_maze",
) -> Iterator[ScenarioRun]:
    """Let a robot solve a maze until the block is left.

    Args:
        scene: Scene with a goal.
        profile: Name of its profile.
        base: Driver of its drive base.
        lidar: Driver of its LiDAR.
        seed: Seed of all that comes by chance.
        model: Name of the model of `examples/maze_solver`.
    """
    text = (EXAMPLES / "maze_solver" / f"{model}.rscd").read_text(encoding="utf-8")
    supervisor = supervisor_of(text)
    with (
        VirtualHost() as host,
        SimulatedTurtleBot3("burger", base, lidar, scene=scene, clock=host, profile=profile, seed=seed) as robot,
    ):
        settings = (
            f"robot: burger\ndrive: {{driver: {base}, port: {robot.base_path}}}\n"
            f"scanner: {{driver: {lidar}, port: {robot.scanner_path}}}\n"
            # The mouth of a maze leads to the open, where a LiDAR may measure nothing.
            "safety: {stops_when_blind: false}\n"
            "skills: {rotate: {speed_rad_s: 0.6, patience_s: 30}}\n" + MAZE_CHANNELS
        )
        configuration = parse(settings.encode(), "maze.yaml").configuration
        log = MemoryLog()
        machine = assemble(
            configuration, map_channels(supervisor.model, configuration), supervisor, log, starts_itself=True, host=host
        )
        thread = host.thread(lambda: _run(machine), "loop")
        thread.start()
        try:
            yield ScenarioRun(host, robot, machine, log, thread)
        finally:
            machine.quit()
            thread.join(LIMIT_S)


def _run(machine: Machine) -> None:
    machine.run()
