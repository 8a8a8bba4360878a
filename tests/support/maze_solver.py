"""The example of a maze solver, in a closed loop with a world: reference executor, ideal rotator, no line or node."""

import math
from dataclasses import dataclass

from robosc.execution.runtime.clock import ManualClock
from robosc.execution.runtime.executor import Executor
from robosc_simulated import BODIES, Scene, Timebase, World
from support.execution import RecordingMiddleware, Sent, example_system

_STEP_S = 0.02
_TURN_RAD_S = 0.8
_SLOW_RAD_S = 0.1
_NEAR_RAD = 0.05


@dataclass
class MazeSolver:
    """The robot and its supervisor.

    Attributes:
        scene: Scene that it is in.
        latency_s: Age of a scan when it is reported to the supervisor, in seconds.
        scan_s: Time between two of them, in seconds.
        tolerance_rad: Error that a turn may have, in radians.
        seed: Seed of the world's chance.
    """

    scene: Scene
    latency_s: float = 0.1
    scan_s: float = 0.2
    tolerance_rad: float = 0.004
    seed: int = 0

    def __post_init__(self) -> None:
        self.clock = ManualClock()
        self.world = World(BODIES["burger"], self.scene, Timebase(self.clock), seed=self.seed)
        self._middleware = RecordingMiddleware()
        self._executor = Executor(example_system("maze_solver/maze_solver"), self._middleware, clock=self.clock)
        self._middleware.on_sent = self._obey
        self._goal_rad: float | None = None
        self._scans: list[tuple[float, list[float]]] = []
        self._scan_due_s = 0.0
        self._done_due_s: float | None = None

    def run(self, longest_s: float) -> None:
        """Live until the goal is reached, a wall is touched, or time is over."""
        self._executor.start()
        while self.clock.now_s < longest_s and self.world.reached_s is None and not self.world.collisions:
            self._sense()
            self._turn()
            self._executor.tick()
            self.world.time.advance(_STEP_S)
            self.world.catch_up()

    def _sense(self) -> None:
        now_s = self.clock.now_s
        if now_s >= self._scan_due_s:
            self._scan_due_s += self.scan_s
            self._scans.append((now_s + self.latency_s, self.world.scan().tolist()))
        while self._scans and self._scans[0][0] <= now_s:
            self._executor.receive("/scan", {"ranges": self._scans.pop(0)[1]})

    def _obey(self, sent: Sent) -> None:
        match sent:
            case ("publish", "move", {"linear": {"x": speed_m_s}}):
                if self._goal_rad is None:
                    self._drive(speed_m_s, 0.0)
            case ("publish", "rotate_left" | "rotate_right" as way, degrees):
                angle_rad = math.radians(degrees)
                self._goal_rad = self.world.heading_rad + (angle_rad if way == "rotate_left" else -angle_rad)
            case ("default", "/cmd_vel"):
                self._drive(0.0, 0.0)

    def _turn(self) -> None:
        now_s = self.clock.now_s
        if self._done_due_s is not None and now_s >= self._done_due_s:
            self._done_due_s = None
            self._executor.receive("/rotate_done", None)
        if self._goal_rad is None:
            return
        left_rad = self._goal_rad - self.world.heading_rad
        if abs(left_rad) > self.tolerance_rad:
            slow = abs(left_rad) < _NEAR_RAD
            self._drive(0.0, math.copysign(_SLOW_RAD_S if slow else _TURN_RAD_S, left_rad))
            return
        self._goal_rad = None
        self._drive(0.0, 0.0)
        # Only a scan of where it stands now shows what is to be done next.
        self._done_due_s = now_s + self.scan_s + self.latency_s + 2 * _STEP_S

    def _drive(self, linear_m_s: float, angular_rad_s: float) -> None:
        body = self.world.body
        for wheel, side in ((self.world.left, -1.0), (self.world.right, 1.0)):
            wheel.is_driven = True
            wheel.goal_rad_s = (linear_m_s + side * angular_rad_s * body.wheel_separation_m / 2) / body.wheel_radius_m
