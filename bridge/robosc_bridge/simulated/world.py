"""A planar world: two wheels move a round robot between walls, and rays from its laser meet them.

Kinematics of a differential drive, integrated in fixed steps along the arc's chord (R. Siegwart, I. Nourbakhsh,
D. Scaramuzza, "Introduction to Autonomous Mobile Robots", 2nd ed., MIT Press 2011, section 5.2.4).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robosc_bridge.simulated.robots import Body
from robosc_bridge.simulated.timebase import Timebase
from robosc_bridge.simulated.walls import Floats, Walls

STEP_S = 0.005
# What a motor can do at all, and how soon a wheel that nothing drives stands.
_STRONGEST_RAD_S2 = 150.0
_FRICTION_RAD_S2 = 60.0
# A body that has left a wall by so much has left it; less is the same collision.
_APART_M = 0.005


@dataclass
class Wheel:
    """A wheel and the motor in it; forward is positive.

    Attributes:
        goal_rad_s: Where the motor drives its speed to.
        acceleration_rad_s2: How fast at most.
        is_driven: Whether the motor has torque; else the wheel runs out.
        is_blocked: Whether something holds it.
        speed_rad_s: At present.
        angle_rad: Turned so far.
    """

    goal_rad_s: float = 0.0
    acceleration_rad_s2: float = _STRONGEST_RAD_S2
    is_driven: bool = False
    is_blocked: bool = False
    speed_rad_s: float = 0.0
    angle_rad: float = 0.0

    def step(self, step_s: float) -> float:
        """Live one step.

        Returns:
            The angle that it turned.
        """
        if self.is_blocked:
            self.speed_rad_s = 0.0
            return 0.0
        goal_rad_s = self.goal_rad_s if self.is_driven else 0.0
        strongest = min(self.acceleration_rad_s2, _STRONGEST_RAD_S2) if self.is_driven else _FRICTION_RAD_S2
        change = goal_rad_s - self.speed_rad_s
        before = self.speed_rad_s
        self.speed_rad_s += math.copysign(min(abs(change), strongest * step_s), change)
        turned = (before + self.speed_rad_s) / 2 * step_s
        self.angle_rad += turned
        return turned


class World:
    """A robot between walls.

    Args:
        body: Of the robot.
        walls: That it meets and sees.
        time: That its devices share.
        pose: Where it starts: x, y in metres, heading in rad.

    Attributes:
        x_m: Of the middle between the wheels.
        y_m: Of the same.
        heading_rad: Counter-clockwise from x, unbounded.
        collisions: How often the body has come to a wall.
        is_touching: Whether it is at one now.
        left: The left wheel.
        right: The right wheel.
    """

    def __init__(
        self, body: Body, walls: Walls, time: Timebase, pose: tuple[float, float, float] = (0.0, 0.0, 0.0)
    ) -> None:
        self.body = body
        self.walls = walls
        self.time = time
        self.x_m, self.y_m, self.heading_rad = pose
        self.left = Wheel()
        self.right = Wheel()
        self.collisions = 0
        self.is_touching = False
        self._lived_s = time.world_s()

    @property
    def speed_m_s(self) -> float:
        """Forward, as the wheels turn."""
        return self.body.wheel_radius_m * (self.left.speed_rad_s + self.right.speed_rad_s) / 2

    @property
    def turn_rad_s(self) -> float:
        """Counter-clockwise, as the wheels turn."""
        difference = self.right.speed_rad_s - self.left.speed_rad_s
        return self.body.wheel_radius_m * difference / self.body.wheel_separation_m

    @property
    def pose(self) -> tuple[float, float, float]:
        """x, y in metres and the heading in rad, at this moment."""
        with self.time.lock:
            self.catch_up()
            return self.x_m, self.y_m, self.heading_rad

    def place(self, x_m: float, y_m: float, heading_rad: float) -> None:
        """Lift the robot and put it down elsewhere; its wheels notice nothing."""
        with self.time.lock:
            self.catch_up()
            self.x_m, self.y_m, self.heading_rad = x_m, y_m, heading_rad
            self.is_touching = False

    def catch_up(self) -> None:
        """Live until now, in whole steps; what is commanded now acts from here on."""
        with self.time.lock:
            now_s = self.time.world_s()
            while self._lived_s + STEP_S <= now_s + 1e-9:
                self._lived_s += STEP_S
                self._step()

    def _step(self) -> None:
        left_m = self.left.step(STEP_S) * self.body.wheel_radius_m
        right_m = self.right.step(STEP_S) * self.body.wheel_radius_m
        if left_m == 0.0 and right_m == 0.0:
            return
        forward_m = (left_m + right_m) / 2
        turn_rad = (right_m - left_m) / self.body.wheel_separation_m
        middle_rad = self.heading_rad + turn_rad / 2
        # A round body can always turn, whatever it touches; its wheels slip where it cannot go on.
        self.heading_rad += turn_rad
        x_m = self.x_m + forward_m * math.cos(middle_rad)
        y_m = self.y_m + forward_m * math.sin(middle_rad)
        nearest_m = self.walls.distance_m(x_m, y_m)
        if nearest_m >= self.body.radius_m or nearest_m > self.walls.distance_m(self.x_m, self.y_m):
            self.x_m, self.y_m = x_m, y_m
            self.is_touching = self.is_touching and nearest_m < self.body.radius_m + _APART_M
        elif forward_m != 0.0 and not self.is_touching:
            self.is_touching = True
            self.collisions += 1

    def cast(self, origins: Floats, directions: Floats) -> Floats:
        """How far rays of the laser go, in its own axes (x forward, y left).

        Args:
            origins: Shape (n, 2): in metres from the laser's middle.
            directions: Shape (n, 2).

        Returns:
            Shape (n,): in lengths of each direction; infinity where no wall is met.
        """
        with self.time.lock:
            self.catch_up()
            cosine, sine = math.cos(self.heading_rad), math.sin(self.heading_rad)
            turn = np.array(((cosine, sine), (-sine, cosine)))
            middle = np.array((self.x_m + cosine * self.body.scanner_x_m, self.y_m + sine * self.body.scanner_x_m))
        return self.walls.cast(origins @ turn + middle, directions @ turn)

    def ranges(self, angles_rad: Sequence[float]) -> tuple[float, ...]:
        """What an ideal laser would measure now.

        Args:
            angles_rad: Counter-clockwise from the front.

        Returns:
            In metres; infinity where no wall is met.
        """
        angles = np.asarray(angles_rad, dtype=np.float64)
        directions = np.stack((np.cos(angles), np.sin(angles)), axis=1)
        return tuple(float(value) for value in self.cast(np.zeros_like(directions), directions))
