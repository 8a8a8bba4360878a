"""The robot as the drivers of a TurtleBot3 show it to ROS: periodic readings, and wheels that follow velocities.

The drivers: ROBOTIS-GIT/turtlebot3 (`turtlebot3_node`) and ROBOTIS-GIT/hls_lfcd_lds_driver. The firmware for ROS 1
stops the wheels when no velocity has come for half a second (`CONTROL_MOTOR_TIMEOUT` in ROBOTIS-GIT/OpenCR).
"""

import math
import random
from collections.abc import Callable
from functools import partial

import numpy as np

from robosc_simulated.lidar import LIDARS
from robosc_simulated.pinhole_camera import DARKNESS, Mount, PinholeCamera
from robosc_simulated.ros.readings import (
    BASE,
    CAMERA,
    FOOTPRINT,
    SCANNER,
    Battery,
    Clock,
    Mounted,
    Odometry,
    Picture,
    Reading,
    Scan,
)
from robosc_simulated.sweep import BEAMS as SCAN_BEAMS
from robosc_simulated.world import World

COMMAND_TIMEOUT_S = 0.5
ODOMETRY_HZ = 30.0
BATTERY_HZ = 1.0
CLOCK_HZ = 100.0
ENCODINGS = ("mono8", "rgb8")
_BASE_Z_M, _SCANNER_Z_M = 0.010, 0.172
_EPSILON_S = 1e-9


class RosRobot:
    """A robot in a world, without any ROS.

    Two times are kept apart, as everywhere in the twin: sensors live in the world's time, and how long a velocity
    holds
    is measured on the computer's clock, because the nodes that send it live by that. So that a machine that has no
    time
    for those nodes does not run a robot in a fast world into a wall, the world may wait for the next velocity.

    Args:
        world: World in which it is; where its scene has a line, there is a camera.
        mount: The camera and where it sits; None: the usual one.
        lidar: Key of `LIDARS`: how far it sees, how often, and how many beams it has.
        encoding: Encoding of pictures, one of `ENCODINGS`.
        command_timeout_s: Time for which a velocity holds on the computer's clock; 0: for ever.
        patience_s: Seconds that the robot may go in the world after a velocity; then the world stands still until the
            next one comes, or until this one ends. None: it never waits.
        seed: Seed of the noise that the world's scene describes.

    Attributes:
        world: World in which it is.
        battery_v: Voltage of its supply.
        is_scanner_covered: True if something covers the LiDAR: it measures nothing.
        is_camera_covered: True if something covers the camera: its pictures are black.
        commands: Velocities that it was sent.
        refused: Velocities that were no finite numbers; the wheels stand still on one.

    Raises:
        ValueError: There is no such LiDAR or encoding, or the patience is no positive, finite number.
    """

    def __init__(
        self,
        world: World,
        mount: Mount | None = None,
        *,
        lidar: str = "lds01",
        encoding: str = "mono8",
        command_timeout_s: float = COMMAND_TIMEOUT_S,
        patience_s: float | None = None,
        seed: int = 0,
    ) -> None:
        for kind, name, known in (("LiDAR", lidar, LIDARS), ("encoding", encoding, ENCODINGS)):
            if name not in known:
                raise ValueError(f"there is no {kind} {name!r}; there are {', '.join(known)}")
        if patience_s is not None and not 0 < patience_s < math.inf:
            raise ValueError(f"the patience must be a positive number of seconds, and is {patience_s}")
        self.battery_v = 12.0
        self.is_scanner_covered = False
        self.is_camera_covered = False
        self.commands = 0
        self.refused = 0
        self.world = world
        self._time = world.time
        self._mount = mount = mount or Mount()
        scene = world.scene
        self._camera = None if scene.line is None else PinholeCamera(mount, scene, seed)
        self._nearest_m: float = LIDARS[lidar].nearest_m  # type: ignore[attr-defined]
        self._farthest_m: float = LIDARS[lidar].farthest_m  # type: ignore[attr-defined]
        self._beams: int = LIDARS[lidar].beams  # type: ignore[attr-defined]
        self._angles_rad = [math.tau * beam / self._beams for beam in range(self._beams)]
        self._revolution_s: float = 1.0 / LIDARS[lidar].nominal_hz  # type: ignore[attr-defined]
        self._encoding = encoding
        self._timeout_s = command_timeout_s
        self._noise_m = scene.noise.lidar_m
        self._chance = random.Random(seed)  # noqa: S311 (noise is no secret)
        self._patience_s = patience_s
        # On the computer's clock, as far as it was lived.
        self._host_s = 0.0
        self._commanded_s = -math.inf
        # Limit of the world's time, which goes no further before the next velocity.
        self._limit_s = math.inf
        self._left_rad, self._right_rad = world.left.angle_rad, world.right.angle_rad
        self._x_m = self._y_m = self._heading_rad = 0.0
        # Readings in the order of their reports; the clock comes first, so that readers of a stamp know the time.
        self._periods: list[tuple[float, Callable[[float], Reading]]] = [
            # No faster than a hundred times a second on the computer's clock.
            (max(1.0, self._time.factor) / CLOCK_HZ, Clock),
            (1.0 / ODOMETRY_HZ, self._odometry),
            (self._revolution_s, self._scan),
            (1.0 / BATTERY_HZ, lambda stamp_s: Battery(stamp_s, self.battery_v)),
        ]
        if self._camera is not None:
            self._periods.append((1.0 / mount.rate_hz, partial(self._picture, self._camera)))
        self._due_s = [0.0] * len(self._periods)
        for wheel in (world.left, world.right):
            wheel.is_driven = True

    @property
    def frames(self) -> tuple[Mounted, ...]:
        """Places of its parts on it."""
        body = self.world.body
        found = [
            Mounted(FOOTPRINT, BASE, 0.0, _BASE_Z_M),
            Mounted(BASE, SCANNER, body.scanner_x_m, _SCANNER_Z_M, y_m=body.scanner_y_m),
        ]
        if self._camera is not None:
            mount = self._mount
            found.append(Mounted(BASE, CAMERA, mount.x_m, mount.height_m - _BASE_Z_M, mount.tilt_rad))
        return tuple(found)

    def command(self, linear_m_s: float, angular_rad_s: float) -> None:
        """Obey a velocity from now on, as far as the motors can.

        Args:
            linear_m_s: Forward.
            angular_rad_s: Counter-clockwise.
        """
        with self._time.lock:
            self.world.catch_up()
            self.commands += 1
            if not (math.isfinite(linear_m_s) and math.isfinite(angular_rad_s)):
                self.refused += 1
                linear_m_s = angular_rad_s = 0.0
            self._commanded_s = self._host_s
            self._drive(linear_m_s, angular_rad_s)

    def _drive(self, linear_m_s: float, angular_rad_s: float) -> None:
        body = self.world.body
        fastest_rad_s = body.fastest_rpm * math.tau / 60
        aside_m_s = angular_rad_s * body.wheel_separation_m / 2
        for wheel, speed_m_s in (
            (self.world.left, linear_m_s - aside_m_s),
            (self.world.right, linear_m_s + aside_m_s),
        ):
            wheel.goal_rad_s = max(-fastest_rad_s, min(fastest_rad_s, speed_m_s / body.wheel_radius_m))
        is_at_rest = linear_m_s == 0.0 and angular_rad_s == 0.0
        waits = self._patience_s is not None and not is_at_rest
        self._limit_s = self._time.world_s() + (self._patience_s or 0.0) if waits else math.inf

    def advance(self, seconds: float) -> None:
        """Let time pass on the computer's clock, and in the world unless that waits.

        A velocity that nobody has repeated ends here: call it at least every tenth of a second.

        Args:
            seconds: On the computer's clock.
        """
        with self._time.lock:
            self._host_s += seconds
            left_s = (self._limit_s - self._time.world_s()) / self._time.factor
            self._time.advance(max(min(seconds, left_s), 0.0))
            if self._timeout_s > 0 and self._host_s - self._commanded_s > self._timeout_s:
                self.world.catch_up()
                self._drive(0.0, 0.0)

    @property
    def due_s(self) -> float:
        """The world's time at which `update` has something to do next."""
        return min(self._due_s)

    def update(self) -> list[Reading]:
        """Return the readings that are due now; missed ones are not made up for."""
        with self._time.lock:
            self.world.catch_up()
            now_s = self._time.world_s()
            found = []
            for place, (period_s, make) in enumerate(self._periods):
                if self._due_s[place] <= now_s + _EPSILON_S:
                    found.append(make(now_s))
                    missed = math.floor((now_s - self._due_s[place] + _EPSILON_S) / period_s)
                    self._due_s[place] += period_s * (missed + 1)
            return found

    def _odometry(self, stamp_s: float) -> Odometry:
        world, body = self.world, self.world.body
        left_m = (world.left.angle_rad - self._left_rad) * body.wheel_radius_m
        right_m = (world.right.angle_rad - self._right_rad) * body.wheel_radius_m
        self._left_rad, self._right_rad = world.left.angle_rad, world.right.angle_rad
        forward_m, rotation_rad = (left_m + right_m) / 2, (right_m - left_m) / body.wheel_separation_m
        self._x_m += forward_m * math.cos(self._heading_rad + rotation_rad / 2)
        self._y_m += forward_m * math.sin(self._heading_rad + rotation_rad / 2)
        self._heading_rad += rotation_rad
        return Odometry(stamp_s, self._x_m, self._y_m, self._heading_rad, world.speed_m_s, world.yaw_rate_rad_s)

    def _scan(self, stamp_s: float) -> Scan:
        if self.is_scanner_covered:
            # The cover is too near: readers of the scan stop.
            ranges_m = np.full(self._beams, -np.inf)
        else:
            # The one of a beam for each degree is quicker.
            is_whole = self._beams == SCAN_BEAMS
            ranges_m = self.world.scan() if is_whole else np.array(self.world.ranges(self._angles_rad))
            if self._noise_m:
                ranges_m += [self._chance.gauss(0.0, self._noise_m) for _ in range(self._beams)]
        ranges_m[ranges_m > self._farthest_m] = np.inf
        ranges_m[ranges_m < self._nearest_m] = -np.inf
        return Scan(stamp_s, ranges_m.astype(np.float32), self._nearest_m, self._farthest_m, self._revolution_s)

    def _picture(self, camera: PinholeCamera, stamp_s: float) -> Picture:
        shades = camera.picture(self.world.pose, self.world.obstacles)
        if self.is_camera_covered:
            shades[:] = DARKNESS
        height, width = shades.shape
        data = shades.tobytes() if self._encoding == "mono8" else np.repeat(shades, 3).tobytes()
        return Picture(stamp_s, self._encoding, width, height, data)
