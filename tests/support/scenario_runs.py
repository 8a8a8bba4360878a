"""The examples' scenarios on virtual time: a whole bridge, the bytes of its lines, and a robot in a scene.

Where a scenario needs a camera, its pictures come on the same clock, and so does what a program beyond the remote
endpoint shows.
"""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from unittest.mock import patch

from robosc.execution.runtime.event_log import MemoryLog
from robosc_bridge.assembly import Machine, assemble
from robosc_bridge.configuration import map_channels, parse
from robosc_bridge.daemon.programs.items import Attached, FromProgram, MessageReceived, Program, ToProgram
from robosc_bridge.devices.camera import GreyRows
from robosc_bridge.devices.interface import Scan as Ranges
from robosc_bridge.host import Thread
from robosc_examples.persons import Person, Scan, find_person
from robosc_simulated import Mount, PinholeCamera, Scene, SimulatedTurtleBot3, VirtualHost
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

    @property
    def is_standing(self) -> bool:
        """True if both wheels stand still."""
        world = self.robot.world
        with world.time.lock:
            world.catch_up()
            return world.left.speed_rad_s == world.right.speed_rad_s == 0.0

    def until(self, condition: Callable[[], bool], what: str, longest_s: float = 30.0) -> None:
        """Wait until something holds.

        Raises:
            AssertionError: It did not in time, something was touched, or the run has ended.
        """
        end_s = self.host.monotonic() + longest_s
        while not condition():
            assert self.host.monotonic() < end_s, (
                f"waited {longest_s:g} s in vain for {what}, at {self.robot.world.pose}"
            )
            self.live(0.1)

    def live(self, seconds: float) -> None:
        """Let time pass in which nothing is touched and the run goes on."""
        self.host.sleep(seconds)
        assert self.thread.is_alive(), self.machine.daemon.problem
        assert self.robot.world.collisions == 0, f"it has touched something at {self.robot.world.pose}"

    def drive(self, way_m: float, what: str) -> None:
        """Wait until it has driven so far, there and back included."""
        place, driven_m = self.robot.world.pose[:2], 0.0

        def has_driven() -> bool:
            nonlocal place, driven_m
            before, place = place, self.robot.world.pose[:2]
            driven_m += math.dist(before, place)
            return driven_m >= way_m

        self.until(has_driven, what)

    def stand(self, what: str, within_m: float = 0.0) -> None:
        """Wait until it stands, and see that it stays for two seconds, or does not go farther than so."""
        self.until(lambda: self.is_standing, what)
        place, end_s = self.robot.world.pose[:2], self.host.monotonic() + 2.0
        while self.host.monotonic() < end_s:
            self.live(0.1)
            is_near = math.dist(place, self.robot.world.pose[:2]) < within_m
            assert self.is_standing or is_near, what

    def press(self, button: str) -> None:
        """Press a button of the board for a while."""
        assert self.robot.opencr is not None
        self.robot.opencr.press(**{button: True})
        self.host.sleep(0.3)
        self.robot.opencr.press(**{button: False})

    def until_reached(self, longest_s: float) -> float:
        """Wait for the goal; return the time that it took, in seconds of the world.

        Raises:
            AssertionError: It is not reached in time, a wall was touched, or the run has ended.
        """
        world = self.robot.world
        self.until(lambda: world.reached_s is not None, "the goal", longest_s)
        assert world.reached_s is not None
        return world.reached_s


class Companion:
    """A program beyond the remote endpoint: it looks at the robot's scans for a person, and serves what it is asked.

    Args:
        run: Scenario that it belongs to.
        serves: Services and actions of the model that it answers.
        identifier: Identifier on which it informs the person of each scan.
        data: Function that returns what is reported of a person, or of nobody.
    """

    def __init__(
        self, run: ScenarioRun, identifier: str, data: Callable[[Person | None], object], serves: frozenset[str]
    ) -> None:
        self.received: list[ToProgram] = []
        self.program = Program("companion", self.received.append, serves)
        self._run = run
        self._identifier = identifier
        self._data = data
        self.say(Attached(self.program))
        run.host.thread(self._work, "companion").start()

    def say(self, item: FromProgram) -> None:
        """Send the bridge a message."""
        self._run.machine.operations.post(item)

    def _work(self) -> None:
        last: Ranges | None = None
        while self._run.thread.is_alive():
            snapshot = self._run.machine.operations.feed.snapshot
            if snapshot is not None and snapshot.scan is not None and snapshot.scan is not last:
                last = snapshot.scan
                # An unmeasured range is too far away, as a LiDAR of ROS reports it.
                ranges_m = [math.inf if math.isnan(range_m) else range_m for range_m in last.ranges_m]
                person = find_person(Scan(ranges_m, 0.0, math.tau / len(ranges_m), last.min_m, last.max_m))
                self.say(MessageReceived(self.program, self._identifier, self._data(person)))
            self._run.host.sleep(0.05)


class _Pictures:
    """A camera on the host's time.

    Args:
        host: Host whose time passes.
        robot: Robot that carries it.
        scene: Scene that it sees.
        seed: Seed of its noise.
    """

    def __init__(self, host: VirtualHost, robot: SimulatedTurtleBot3, scene: Scene, seed: int) -> None:
        self._host = host
        self._robot = robot
        self._mount = Mount()
        noise = robot.world.scene.noise
        self._eye = PinholeCamera(self._mount, replace(scene, noise=noise), seed)

    def open(self) -> None: ...

    def receive(self, limit_s: float) -> GreyRows | None:
        """Return the next picture."""
        self._host.sleep(1.0 / self._mount.rate_hz)
        return self._eye.picture(self._robot.world.pose, self._robot.world.obstacles)

    def close(self) -> None: ...


@contextmanager
def scenario_run(
    model: str,
    scene: Scene,
    settings: str,
    *,
    profile: str = "ideal",
    base: str = "opencr",
    lidar: str = "lds01",
    seed: int = 0,
    factor: float = 1.0,
) -> Iterator[ScenarioRun]:
    """Let a supervised robot live in a scene until the block is left.

    Args:
        model: Model, below `examples` and without its suffix.
        scene: Scene around it; one with a line is seen by a camera.
        settings: Sections of the configuration but `robot`, `drive` and `scanner`, in YAML.
        profile: Name of its profile.
        base: Driver of its drive base.
        lidar: Driver of its LiDAR.
        seed: Seed of all that comes by chance.
        factor: Speed of its world, as a multiple of the clock's.
    """
    supervisor = supervisor_of((EXAMPLES / f"{model}.rscd").read_text(encoding="utf-8"))
    # The simulated camera lives in real time.
    seen = replace(scene, line=None)
    with (
        VirtualHost() as host,
        SimulatedTurtleBot3(
            "burger", base, lidar, scene=seen, clock=host, factor=factor, profile=profile, seed=seed
        ) as robot,
        patch("robosc_bridge.devices.camera.make_camera", lambda name: _Pictures(host, robot, scene, seed)),
    ):
        text = (
            f"robot: burger\ndrive: {{driver: {base}, port: {robot.base_path}}}\n"
            f"scanner: {{driver: {lidar}, port: {robot.scanner_path}}}\n{settings}"
        )
        configuration = parse(text.encode(), "scenario.yaml").configuration
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
    """Let a robot solve a maze until the block is left; `model` is one of `examples/maze_solver`."""
    settings = (
        # The mouth of a maze leads to the open, where a LiDAR may measure nothing.
        "safety: {stops_when_blind: false}\nskills: {rotate: {speed_rad_s: 0.6, patience_s: 30}}\n" + MAZE_CHANNELS
    )
    with scenario_run(
        f"maze_solver/{model}", scene, settings, profile=profile, base=base, lidar=lidar, seed=seed
    ) as run:
        yield run


def _run(machine: Machine) -> None:
    machine.run()
