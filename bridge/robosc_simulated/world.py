"""A planar world: two wheels move a round robot between walls and obstacles, and rays from its laser meet them.

Kinematics of a differential drive, integrated in fixed steps along the arc's chord (R. Siegwart, I. Nourbakhsh,
D. Scaramuzza, "Introduction to Autonomous Mobile Robots", 2nd ed., MIT Press 2011, section 5.2.4).
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from robosc_simulated.control_table import MODELS
from robosc_simulated.discs import Discs
from robosc_simulated.drift import Drift
from robosc_simulated.profile import IDEAL, Profile
from robosc_simulated.robots import Body
from robosc_simulated.scene import IDEAL as NO_NOISE
from robosc_simulated.scene import Look, Obstacle, Scene
from robosc_simulated.sweep import Sweep
from robosc_simulated.timebase import Timebase
from robosc_simulated.walls import Floats, Walls

STEP_S = 0.005
# The motor's highest acceleration, and the deceleration of a wheel that is not driven.
_STRONGEST_RAD_S2 = 150.0
_FRICTION_RAD_S2 = 60.0
# A smaller remaining change is done at once, so that a wheel comes to a standstill.
_NEAR_RAD_S = 0.003
# A body that has left a wall by so much has left it; less is the same collision.
_APART_M = 0.005
# Two rays that are computed in different ways meet the same thing.
_SAME_M = 1e-6


@dataclass
class Wheel:
    """A wheel and the motor in it; forward is positive.

    Attributes:
        fastest_rad_s: Speed of the motor without a load.
        goal_rad_s: Speed to which the motor drives it, if it can.
        acceleration_rad_s2: Largest acceleration towards it.
        is_driven: True if the motor has torque; else the wheel runs out.
        is_blocked: True if something holds it.
        speed_rad_s: Present speed.
        angle_rad: Angle turned so far, as its encoder counts.
        lag_s: Time constant with which it follows its goal: inertia of the robot, and softness of its controller.
        dead_band_rad_s: Goals below this do not overcome its friction.
    """

    fastest_rad_s: float
    goal_rad_s: float = 0.0
    acceleration_rad_s2: float = _STRONGEST_RAD_S2
    is_driven: bool = False
    is_blocked: bool = False
    speed_rad_s: float = 0.0
    angle_rad: float = 0.0
    lag_s: float = 0.0
    dead_band_rad_s: float = 0.0

    def step(self, step_s: float) -> float:
        """Live one step.

        Returns:
            The angle that it turned.
        """
        if self.is_blocked:
            self.speed_rad_s = 0.0
            return 0.0
        goal_rad_s = max(-self.fastest_rad_s, min(self.fastest_rad_s, self.goal_rad_s)) if self.is_driven else 0.0
        strongest = min(self.acceleration_rad_s2, _STRONGEST_RAD_S2) if self.is_driven else _FRICTION_RAD_S2
        if abs(goal_rad_s) < self.dead_band_rad_s:
            goal_rad_s = 0.0
        change = goal_rad_s - self.speed_rad_s
        if self.lag_s and abs(change) > _NEAR_RAD_S:
            change *= 1.0 - math.exp(-step_s / self.lag_s)
        before = self.speed_rad_s
        self.speed_rad_s += math.copysign(min(abs(change), strongest * step_s), change)
        turned = (before + self.speed_rad_s) / 2 * step_s
        self.angle_rad += turned
        return turned


@dataclass(frozen=True)
class WorldEvent:
    """A happening that is worth recording.

    Attributes:
        kind: A collision, the goal reached for the first time, an obstacle moved, put away or put back.
        x_m: x of the robot; for an obstacle, x of the place where that is now.
        y_m: y of the same.
        name: Name of the obstacle that was met or moved; nothing for walls and the goal.
        radius_m: Radius of an obstacle that was moved; 0: of something else.
        is_there: True if that obstacle is there now.
    """

    kind: Literal["collision", "goal", "obstacle"]
    x_m: float
    y_m: float
    name: str = ""
    radius_m: float = 0.0
    is_there: bool = True


Looks = np.ndarray[tuple[int], np.dtype[np.int64]]
"""For each ray, the place in `tuple(Look)` of the look of what it meets."""

OnStep = Callable[[float], None]
"""Receives the world time of every step that was simulated."""

OnWorldEvent = Callable[[float, WorldEvent], None]
"""Receives what happened, and the world time."""


class World:
    """A robot in a scene.

    Args:
        body: Body of the robot.
        walls: Walls that it meets and sees; a scene has more in it.
        time: Time that its devices share.
        pose: Start pose: x, y in metres, heading in rad; None: where its scene says.
        seed: Seed of slip and of what encoders count.
        profile: Distance of its motors and its floor from ideal.

    Attributes:
        profile: The same.
        scene: Scene as it was at the start, with the noise of the profile.
        walls: Walls of the scene.
        x_m: x of the middle between the wheels.
        y_m: y of the same.
        heading_rad: Heading counter-clockwise from x, unbounded.
        floor_speed_m_s: Forward speed, as it moved on the floor in the last step: slip and walls make it less than
            the rotation of the wheels.
        floor_yaw_rate_rad_s: Yaw rate, counter-clockwise, likewise.
        collisions: Number of times that the body has come to a wall or an obstacle.
        is_touching: True if it is at one now.
        left: The left wheel.
        right: The right wheel.
        lived_s: World time that has been lived.
        reached_s: World time when the goal was reached first; None: not yet.
    """

    def __init__(
        self,
        body: Body,
        walls: Walls | Scene,
        time: Timebase,
        pose: tuple[float, float, float] | None = None,
        seed: int = 0,
        profile: Profile = IDEAL,
    ) -> None:
        self.body = body
        self.profile = profile
        scene = walls if isinstance(walls, Scene) else Scene("walls", walls)
        self.scene = replace(scene, noise=profile.noise_in(scene))
        self.walls = self.scene.walls
        self._sweep = Sweep(self.walls)
        self.time = time
        self.x_m, self.y_m, self.heading_rad = self.scene.start if pose is None else pose
        fastest_rad_s = MODELS[body.servo_model].no_load_rpm * math.tau / 60 / body.gear_ratio
        self.left, self.right = (
            Wheel(fastest_rad_s, lag_s=profile.lag_s, dead_band_rad_s=profile.dead_band_rad_s) for _ in range(2)
        )
        self.floor_speed_m_s = 0.0
        self.floor_yaw_rate_rad_s = 0.0
        self.collisions = 0
        self.is_touching = False
        self.lived_s = time.world_s()
        self.reached_s: float | None = None
        self._obstacles = {obstacle.name: obstacle for obstacle in self.scene.obstacles}
        self._see_obstacles()
        noise = self.scene.noise
        self._drift = Drift(noise, seed) if noise != NO_NOISE else None
        self._watchers: list[tuple[OnStep, OnWorldEvent]] = []
        self._see_goal()

    @property
    def speed_m_s(self) -> float:
        """Forward, as the wheels rotate."""
        return self.body.wheel_radius_m * (self.left.speed_rad_s + self.right.speed_rad_s) / 2

    @property
    def yaw_rate_rad_s(self) -> float:
        """Counter-clockwise, as the wheels rotate."""
        difference = self.right.speed_rad_s - self.left.speed_rad_s
        return self.body.wheel_radius_m * difference / self.body.wheel_separation_m

    @property
    def pose(self) -> tuple[float, float, float]:
        """x, y in metres and the heading in rad, at this moment."""
        with self.time.lock:
            self.catch_up()
            return self.x_m, self.y_m, self.heading_rad

    @property
    def obstacles(self) -> tuple[Obstacle, ...]:
        """The round things, as they are now."""
        with self.time.lock:
            return tuple(self._obstacles.values())

    def place(self, x_m: float, y_m: float, heading_rad: float) -> None:
        """Lift the robot and put it down elsewhere; its wheels notice nothing.

        Raises:
            ValueError: A number is not finite.
        """
        if not all(map(math.isfinite, (x_m, y_m, heading_rad))):
            raise ValueError("a place and a heading must be finite numbers")
        with self.time.lock:
            self.catch_up()
            self.x_m, self.y_m, self.heading_rad = x_m, y_m, heading_rad
            self.is_touching = False
            self._clear_m = 0.0
            self._see_goal()

    def move_obstacle(self, name: str, x_m: float, y_m: float) -> None:
        """Put an obstacle somewhere; it is there then.

        Raises:
            ValueError: There is no such obstacle, or a number is not finite.
        """
        if not (math.isfinite(x_m) and math.isfinite(y_m)):
            raise ValueError("an obstacle's place must be finite numbers")
        self._change(name, lambda obstacle: replace(obstacle, x_m=x_m, y_m=y_m, is_there=True))

    def put_obstacle(self, name: str, is_there: bool) -> None:
        """Put an obstacle away, or back to where it was.

        Raises:
            ValueError: There is no such obstacle.
        """
        self._change(name, lambda obstacle: replace(obstacle, is_there=is_there))

    def _change(self, name: str, change: Callable[[Obstacle], Obstacle]) -> None:
        with self.time.lock:
            self.catch_up()
            if name not in self._obstacles:
                known = ", ".join(self._obstacles) or "none in this scene"
                raise ValueError(f"there is no obstacle {name!r}; there is {known}")
            found = self._obstacles[name] = change(self._obstacles[name])
            self._see_obstacles()
            self._notify(WorldEvent("obstacle", found.x_m, found.y_m, name, found.radius_m, found.is_there))

    def _see_obstacles(self) -> None:
        self._there = tuple(obstacle for obstacle in self._obstacles.values() if obstacle.is_there)
        self._discs = Discs((obstacle.x_m, obstacle.y_m, obstacle.radius_m) for obstacle in self._there)
        self._special: list[tuple[int, Walls | Discs]] = []
        for place, look in enumerate(Look):
            if look is Look.PLAIN:
                continue
            if (walls := self.scene.special_walls.get(look)) is not None:
                self._special.append((place, walls))
            round_things = [(it.x_m, it.y_m, it.radius_m) for it in self._there if it.look is look]
            if round_things:
                self._special.append((place, Discs(round_things)))
        self._clear_m = 0.0

    def watch(self, on_step: OnStep, on_event: OnWorldEvent) -> None:
        """Notify an observer of every step and of what happens, under the lock of the time."""
        with self.time.lock:
            self._watchers.append((on_step, on_event))

    def unwatch(self, on_step: OnStep, on_event: OnWorldEvent) -> None:
        """Notify them no more."""
        with self.time.lock:
            self._watchers.remove((on_step, on_event))

    def _notify(self, happening: WorldEvent) -> None:
        for _, on_event in self._watchers:
            on_event(self.lived_s, happening)

    def _see_goal(self) -> None:
        goal = self.scene.goal
        if goal is not None and self.reached_s is None and goal.is_reached(self.x_m, self.y_m):
            self.reached_s = self.lived_s
            self._notify(WorldEvent("goal", self.x_m, self.y_m))

    def catch_up(self) -> None:
        """Live until now, in whole steps; what is commanded now acts from here on."""
        with self.time.lock:
            began_s, before_s, now_s = self.time.now_s(), self.lived_s, self.time.world_s()
            while self.lived_s + STEP_S <= now_s + 1e-9:
                self.lived_s += STEP_S
                self._step()
                for on_step, _ in self._watchers:
                    on_step(self.lived_s)
            self.time.record_work(self.lived_s - before_s, began_s)

    def _step(self) -> None:
        left_rad, right_rad = self.left.step(STEP_S), self.right.step(STEP_S)
        drift = self._drift
        if drift is not None:
            drift.step()
            self.left.angle_rad += left_rad * drift.errors[0]
            self.right.angle_rad += right_rad * drift.errors[1]
            left_rad *= 1.0 - drift.slips[0]
            right_rad *= 1.0 - drift.slips[1]
        if left_rad == 0.0 and right_rad == 0.0:
            self.floor_speed_m_s = self.floor_yaw_rate_rad_s = 0.0
            return
        left_m, right_m = left_rad * self.body.wheel_radius_m, right_rad * self.body.wheel_radius_m
        forward_m = (left_m + right_m) / 2
        rotation_rad = (right_m - left_m) / self.body.wheel_separation_m
        middle_rad = self.heading_rad + rotation_rad / 2
        # A round body can always rotate, whatever it touches; its wheels slip where it cannot go on.
        self.heading_rad += rotation_rad
        has_gone = self._go(forward_m, forward_m * math.cos(middle_rad), forward_m * math.sin(middle_rad))
        self.floor_speed_m_s, self.floor_yaw_rate_rad_s = forward_m * has_gone / STEP_S, rotation_rad / STEP_S

    def _go(self, forward_m: float, along_x_m: float, along_y_m: float) -> bool:
        """Move, unless something is in the way; whether it has."""
        x_m, y_m = self.x_m + along_x_m, self.y_m + along_y_m
        radius_m = self.body.radius_m
        # A distance changes by no more than the way that was gone: most often none is measured.
        self._clear_m -= abs(forward_m)
        if self._clear_m < radius_m + _APART_M:
            nearest_m, name = self._nearest(x_m, y_m)
            if nearest_m < radius_m and nearest_m <= self._nearest(self.x_m, self.y_m)[0]:
                self._clear_m = 0.0
                if forward_m != 0.0 and not self.is_touching:
                    self.is_touching = True
                    self.collisions += 1
                    self._notify(WorldEvent("collision", self.x_m, self.y_m, name))
                return False
            self._clear_m = nearest_m
            self.is_touching = self.is_touching and nearest_m < radius_m + _APART_M
        self.x_m, self.y_m = x_m, y_m
        self._see_goal()
        return True

    def _nearest(self, x_m: float, y_m: float) -> tuple[float, str]:
        """Return the distance of the nearest thing, and its name; nothing for a wall."""
        to_wall_m = self.walls.distance_m(x_m, y_m)
        to_round_m, place = self._discs.nearest(x_m, y_m)
        return (to_round_m, self._there[place].name) if to_round_m < to_wall_m else (to_wall_m, "")

    def cast(self, origins: Floats | None, directions: Floats) -> Floats:
        """Return the lengths of rays of the laser, in its own axes (x forward, y left).

        Args:
            origins: Shape (n, 2): in metres from the laser's middle; None: all are there.
            directions: Shape (n, 2).

        Returns:
            Shape (n,): in lengths of each direction; infinity where nothing is met.
        """
        return self.seen(origins, directions)[0]

    def seen(self, origins: Floats | None, directions: Floats) -> tuple[Floats, Looks | None]:
        """Return the lengths of rays of the laser as `cast` does, and the looks of what they meet.

        Args:
            origins: As of `cast`.
            directions: Likewise.

        Returns:
            Lengths, and for each ray the place in `tuple(Look)`; None: everything is plain.
        """
        with self.time.lock:
            self.catch_up()
            cosine, sine = math.cos(self.heading_rad), math.sin(self.heading_rad)
            x_m, y_m = self._scanner_place()
            discs, special = self._discs, self._special
        rotation = np.array(((cosine, sine), (-sine, cosine)))
        along = directions @ rotation
        if origins is None:
            found = self.walls.cast_from(x_m, y_m, along)
            starts = np.array(((x_m, y_m),))
        else:
            starts = origins @ rotation + np.array((x_m, y_m))
            found = self.walls.cast(starts, along)
        if discs.discs:
            found = np.minimum(found, discs.cast(starts, along))
        if not special:
            return found, None
        looks = np.zeros(len(found), dtype=np.int64)
        for look, things in special:
            looks[things.cast(np.broadcast_to(starts, along.shape), along) <= found + _SAME_M] = look
        looks[np.isinf(found)] = 0
        return found, looks

    def ranges(self, angles_rad: Sequence[float]) -> tuple[float, ...]:
        """Return the ranges that an ideal laser would measure now.

        Args:
            angles_rad: Angles counter-clockwise from the front.

        Returns:
            Ranges in metres; infinity where nothing is met.
        """
        angles = np.asarray(angles_rad, dtype=np.float64)
        directions = np.stack((np.cos(angles), np.sin(angles)), axis=1)
        return tuple(self.cast(None, directions).tolist())

    def scan(self) -> Floats:
        """Return the ranges that an ideal laser would measure now in a whole revolution.

        Returns:
            Shape (360,): counter-clockwise from the front, in metres; infinity where nothing is met.
        """
        with self.time.lock:
            self.catch_up()
            x_m, y_m = self._scanner_place()
            return self._sweep.lengths_m(x_m, y_m, self.heading_rad, self._discs)

    def _scanner_place(self) -> tuple[float, float]:
        cosine, sine = math.cos(self.heading_rad), math.sin(self.heading_rad)
        ahead_m, left_m = self.body.scanner_x_m, self.body.scanner_y_m
        return self.x_m + cosine * ahead_m - sine * left_m, self.y_m + sine * ahead_m + cosine * left_m
