"""An example robot in the twin within one process: world, supervisor and helpers on one clock that the test moves.

What the helper nodes of the example robots do (`robosc_examples`) is done here with the same arithmetic: turning by an
angle, finding a person in a scan, driving to a pose, following a line without care. Nothing lives by the computer's
clock, so that a run is the same each time, and takes as long as its computations.
"""

import math
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from robosc.event_logs import check_log, read_log
from robosc.execution.interpreter import InterpretedSystem
from robosc.execution.interpreter.missions import MissionPlace
from robosc.execution.runtime.clock import ManualClock
from robosc.execution.runtime.event_log import open_event_log
from robosc.execution.runtime.executor import Executor
from robosc.execution.runtime.layer import Layer
from robosc.execution.runtime.settings import Settings
from robosc.model.structure import Deployment
from robosc_bridge.skills.line import LineDetector
from robosc_bridge.skills.settings import LineSettings
from robosc_examples.house import COMMANDS, House
from robosc_examples.motion import Turn, clamped, steered, turning_speed, wrapped
from robosc_examples.persons import Scan, find_person
from robosc_simulated import (
    BODIES,
    IDEAL,
    Motion,
    MotionRecorder,
    Mount,
    PinholeCamera,
    Scene,
    Timebase,
    World,
    read_motion,
)
from robosc_simulated.motion_checks import STILL_M_S, STILL_RAD_S
from robosc_simulated.profile import Profile
from support.generated import example_supervisor
from support.layers import BothSides

PERIOD_S = 0.1
"""Period of decisions and of pictures, in seconds."""

SCAN_S = 0.2
FARTHEST_M, NEAREST_M = 3.5, 0.12
"""Farthest and nearest distance of a LiDAR such as the LDS-01, in metres."""

_STEP_S = 0.05
_TURN_RAD_S, _TURN_TOLERANCE_RAD = 0.6, 0.005
_GOAL_M, _FOLLOWER_M_S = 0.05, 0.15


class SteppedTwin:
    """A supervised robot in a scene; use it as a context manager.

    Args:
        model: Name of an example, such as `maze_solver/maze_solver`.
        scene: Scene around it.
        folder: Folder for its event log and its motion.
        deployment: Deployment of its supervisor.
        seed: Seed of what the scene leaves to chance.
        profile: Distance of wheels and sensors from ideal.
        house: Door, tray and battery around it; None: the usual ones.

    Attributes:
        world: World that it is in.
        executor: Executor or layer that decides.
        held_back: Number of velocities of the existing controller that were not let through.
        called: Services that were called.
        house: Door, tray and battery around the courier; nobody tells them anything where there is no courier.
    """

    def __init__(
        self,
        model: str,
        scene: Scene,
        folder: Path,
        deployment: Deployment = Deployment.CONTROLLER,
        seed: int = 0,
        profile: Profile = IDEAL,
        house: House | None = None,
    ) -> None:
        self.house = house or House()
        self.held_back = 0
        self.called: list[str] = []
        self.supervisor = example_supervisor(model, deployment)
        self._deployment = deployment
        self._folder = folder
        self._stack = ExitStack()
        clock = ManualClock(epoch_s=1_000_000.0)
        self._time = Timebase(clock)
        self.world = World(BODIES["burger"], scene, self._time, seed=seed, profile=profile)
        self.world.left.is_driven = self.world.right.is_driven = True
        self._eye = PinholeCamera(Mount(), scene, seed)
        self._detector = LineDetector(LineSettings(), 0.0)
        log = open_event_log(str(folder / "events"), "run", clock.wall())
        self._stack.callback(log.close)
        motion = self._stack.enter_context((folder / "motion.jsonl").open("w", encoding="ascii"))
        recorder = MotionRecorder(self.world, motion)
        self._stack.callback(recorder.close)
        self._system = system = InterpretedSystem(self.supervisor)
        self._identifiers = {info.name: info.identifier for info in system.description.communications}
        self._heard = set(self._identifiers.values())
        settings = Settings(period_s=PERIOD_S)
        self.executor: Executor | Layer = (
            Executor(system, self, settings, clock, log)
            if deployment is Deployment.CONTROLLER
            else Layer(system, self, _Careless(self), settings, clock, log)
        )
        # Reactions of others to data that they received; not while the executor is handing it over.
        self._waiting: deque[Callable[[], None]] = deque()
        self._turn: Turn | None = None
        self._goal: tuple[int, float, float] | None = None
        self._steps = 0
        self.executor.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stack.close()

    # Acts of the test.

    @property
    def is_standing(self) -> bool:
        """True if its wheels stand still."""
        return abs(self.world.speed_m_s) < STILL_M_S and abs(self.world.yaw_rate_rad_s) < STILL_RAD_S

    @property
    def place(self) -> tuple[float, float]:
        """Position of its middle, in metres."""
        return self.world.pose[:2]

    def receive(self, identifier: str, data: object = None) -> None:
        """A message comes, without data such as that of a button."""
        self.executor.receive(identifier, data)

    @property
    def now_s(self) -> float:
        """Time of the world, in seconds."""
        return self._time.world_s()

    @property
    def missions(self) -> tuple[MissionPlace, ...]:
        """Places of the missions since the last decision."""
        return self._system.missions()

    @property
    def state(self) -> dict[str, dict[str, Any]]:
        """Locations and variables of the components, by their names."""
        return self._system.state()

    def until(self, condition: Callable[[], bool], what: str, limit_s: float = 60.0) -> None:
        """Let time pass until something holds.

        Raises:
            AssertionError: It did not within so many seconds of the world.
        """
        end_s = self._time.world_s() + limit_s
        while not condition():
            assert self._time.world_s() < end_s, f"waited {limit_s:g} s in vain for {what} at {self.world.pose}"
            self.step()

    def go_on(self, seconds: float) -> None:
        """Let time pass."""
        for _ in range(round(seconds / _STEP_S)):
            self.step()

    def drive(self, way_m: float, what: str) -> None:
        """Until it has driven so far."""
        begin = self.place
        self.until(lambda: math.dist(begin, self.place) >= way_m, what)

    def stand(self, what: str) -> tuple[float, float]:
        """Until it stands, and two seconds more, in which it stays: when that begins and ends."""
        self.until(lambda: self.is_standing, what)
        begin_s = self._time.world_s()
        for _ in range(round(2.0 / _STEP_S)):
            self.step()
            assert self.is_standing, what
        return begin_s, self._time.world_s()

    def finish(self) -> tuple[Motion, tuple[object, ...]]:
        """Stop: the motion, and what is wrong with the log against the supervisor."""
        self.executor.stop("the test is over")
        self.go_on(1.0)
        self._stack.close()
        (path,) = (self._folder / "events").glob("*.jsonl")
        found = check_log(read_log(path), self.supervisor, self._deployment)
        assert found.requests > 0
        return read_motion(self._folder / "motion.jsonl"), (*found.violations, *found.notes)

    def step(self) -> None:
        """Let a twentieth of a second pass."""
        self._time.advance(_STEP_S)
        self.world.catch_up()
        self._steps += 1
        while self._waiting:
            self._waiting.popleft()()
        self._rotate()
        if self._steps % round(SCAN_S / _STEP_S) == 0:
            self._scan()
        if self._steps % round(PERIOD_S / _STEP_S) == 0:
            self._look()
            self._keep_house()
            self._measure()
            self._go_to_goal()
            self.executor.tick()
            assert not self.executor.is_faulty, self.executor.reasons

    # Sensors and helpers.

    def _scan(self) -> None:
        ranges = [min(range_m, FARTHEST_M + 1.0) for range_m in self.world.scan().tolist()]
        if "/scan" in self._heard:
            self.executor.receive("/scan", {"ranges": ranges})
        if self._heard & {"/person", "/person/distance"}:
            person = find_person(Scan(ranges, 0.0, math.tau / len(ranges), NEAREST_M, FARTHEST_M))
            x_m, y_m, sure = (0.0, 0.0, 0.0) if person is None else person
            distance_m = FARTHEST_M if person is None else person.distance_m
            for identifier, data in (("/person", {"x": x_m, "y": y_m, "z": sure}), ("/person/distance", distance_m)):
                if identifier in self._heard:
                    self.executor.receive(identifier, data)

    def _look(self) -> None:
        if "/line/correction" not in self._heard:
            return
        seen = self._detector.update(self._eye.picture(self.world.pose, self.world.obstacles), self._time.world_s())
        assert seen is not None
        if seen.correction_rad_s is None:
            self.executor.receive("/line/lost", None)
        else:
            self.executor.receive("/line/correction", seen.correction_rad_s)

    def _keep_house(self) -> None:
        if "/door/opened" not in self._heard:
            return
        for identifier in self.house.advance(self._time.world_s(), *self.place):
            self.executor.receive(identifier, None)
        if self.house.is_door_open == _is_there(self.world, "door"):
            self.world.put_obstacle("door", not self.house.is_door_open)
        self.executor.receive("/battery_state", {"voltage": self.house.battery_v})

    def _measure(self) -> None:
        """Report the pose, as a robot does that is localised."""
        if "/odom" not in self._heard:
            return
        x_m, y_m, heading_rad = self.world.pose
        orientation = {"z": math.sin(heading_rad / 2), "w": math.cos(heading_rad / 2)}
        speed = {"linear": {"x": self.world.speed_m_s}, "angular": {"z": self.world.yaw_rate_rad_s}}
        pose = {"position": {"x": x_m, "y": y_m}, "orientation": orientation}
        self.executor.receive("/odom", {"pose": {"pose": pose}, "twist": {"twist": speed}})

    def _rotate(self) -> None:
        if self._turn is None:
            return
        remaining_rad = self._turn.update(self.world.pose[2])
        if abs(remaining_rad) > _TURN_TOLERANCE_RAD:
            self._drive(0.0, turning_speed(remaining_rad, _TURN_RAD_S))
        else:
            self._drive(0.0, 0.0)
            if self.is_standing:
                self._turn = None
                self.executor.receive("/rotate_done", None)

    def _go_to_goal(self) -> None:
        if self._goal is None:
            return
        number, goal_x_m, goal_y_m = self._goal
        x_m, y_m, heading_rad = self.world.pose
        distance_m = math.dist((x_m, y_m), (goal_x_m, goal_y_m))
        if distance_m <= _GOAL_M:
            self._goal = None
            self._drive(0.0, 0.0)
            self.executor.on_goal_ended(number, "succeeded", {"error_code": 0})
            return
        aside_rad = wrapped(math.atan2(goal_y_m - y_m, goal_x_m - x_m) - heading_rad)
        self._drive(*steered(distance_m, aside_rad, 0.2, 1.0))
        self.executor.on_feedback(number, {"distance_remaining": distance_m, "number_of_recoveries": 0})

    def _drive(self, ahead_m_s: float, yaw_rate_rad_s: float) -> None:
        body = self.world.body
        aside_m_s = yaw_rate_rad_s * body.wheel_separation_m / 2
        self.world.left.goal_rad_s = (ahead_m_s - aside_m_s) / body.wheel_radius_m
        self.world.right.goal_rad_s = (ahead_m_s + aside_m_s) / body.wheel_radius_m

    # Calls of the executor to the robot.

    def prepare(self, communication: str, data: Any) -> Any:
        return data

    def is_default(self, communication: str, message: Any) -> bool:
        return _is_zero(message)

    def publish(self, communication: str, message: Any) -> None:
        match self._identifiers[communication]:
            case "/cmd_vel":
                self._drive(_part(message, "linear", "x"), _part(message, "angular", "z"))
            case "/rotate_left":
                self._turn = Turn(math.radians(message), self.world.pose[2])
            case "/rotate_right":
                self._turn = Turn(-math.radians(message), self.world.pose[2])
            case other if other in COMMANDS:
                self.house.receive(other)
            case other:
                raise AssertionError(f"nobody hears {other}")

    def publish_default(self, identifier: str) -> None:
        if identifier == "/cmd_vel":
            self._drive(0.0, 0.0)

    def call(self, communication: str, request_id: int, message: Any) -> None:
        self.called.append(communication)
        self._waiting.append(lambda: self.executor.on_reply(request_id, {"success": True}))

    def send_goal(self, communication: str, goal_id: int, message: Any) -> None:
        def accept() -> None:
            self._goal = (goal_id, _part(message, "pose", "pose", "position", "x"), _part(message, *_GOAL_Y))
            self.executor.on_goal_accepted(goal_id)

        self._waiting.append(accept)

    def cancel_goal(self, communication: str, goal_id: int) -> None:
        def cancel() -> None:
            self._goal = None
            self._drive(0.0, 0.0)
            self.executor.on_goal_ended(goal_id, "cancelled")

        self._waiting.append(cancel)

    def ask_for(self, correction: float) -> None:
        """The existing controller asks for a velocity along a correction."""
        data = {"linear": {"x": _FOLLOWER_M_S}, "angular": {"z": clamped(correction, 1.0)}}

        def ask() -> None:
            assert isinstance(self.executor, Layer)
            self.executor.on_request("/cmd_vel", data)

        self._waiting.append(ask)


class _Careless(BothSides):
    """An existing controller, which follows the line whatever else there is."""

    def __init__(self, twin: SteppedTwin) -> None:
        super().__init__()
        self._twin = twin

    def pass_on(self, identifier: str, message: Any) -> None:
        if identifier == "/line/correction":
            self._twin.ask_for(message)

    def blocked(self, identifier: str, why: str) -> None:
        self._twin.held_back += 1


def _is_there(world: World, name: str) -> bool:
    return any(obstacle.is_there for obstacle in world.obstacles if obstacle.name == name)


_GOAL_Y = ("pose", "pose", "position", "y")


def _is_zero(message: Any) -> bool:
    if isinstance(message, Mapping):
        return all(map(_is_zero, message.values()))
    return message is None or message == 0


def _part(message: Any, *names: str) -> float:
    """A property of a property; 0 where it is not there."""
    for name in names:
        message = message.get(name) if isinstance(message, Mapping) else None
    return 0.0 if message is None else float(message)
