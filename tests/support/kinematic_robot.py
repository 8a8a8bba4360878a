"""A small robot for tests of the example robots: wheels that obey `/cmd_vel`, odometry, a LiDAR and a camera."""

import math
import time
from array import array
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from support.ros2 import Peer

BEAMS = 360
LONGEST_M = 3.5
SCAN_EVERY_S = 0.05
PICTURE_EVERY_S = 0.1
LONGEST_STEP_S = 0.1
FIELD_OF_VIEW_RAD = 1.085
PICTURE_WIDTH, PICTURE_HEIGHT = 160, 120

Picture = NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class Wall:
    """A straight wall from one point to another."""

    x1: float
    y1: float
    x2: float
    y2: float


@dataclass(slots=True)
class Thing:
    """A round object on the floor, of a colour (red, green, blue) and a radius."""

    x: float
    y: float
    radius: float
    colour: tuple[int, int, int] = (120, 120, 120)

    def place_from(self, x: float, y: float, yaw: float) -> tuple[float, float]:
        """Metres ahead and to the left, seen from a pose."""
        ahead, left = self.x - x, self.y - y
        return ahead * math.cos(yaw) + left * math.sin(yaw), left * math.cos(yaw) - ahead * math.sin(yaw)


@dataclass(slots=True)
class World:
    """Surroundings of the robot.

    The LiDAR sees walls and obstacles, the camera things, the nearest over the others.
    """

    walls: list[Wall] = field(default_factory=list)
    obstacles: list[Thing] = field(default_factory=list)
    things: list[Thing] = field(default_factory=list)


class KinematicRobot:
    """The robot, moved on by `step` as time goes by.

    Args:
        peer: The node that it talks through.
        world: Surroundings of the robot.
        camera: Function that makes its pictures (rgb8 or mono8, by their shape); None for no camera.

    Attributes:
        has_odometry: True if odometry is published.
        on_step: Function called when the robot has moved: its effect on the world.
    """

    def __init__(self, peer: Peer, world: World, camera: Callable[["KinematicRobot"], Picture] | None = None) -> None:
        from geometry_msgs.msg import Twist

        self.world = world
        self.x = self.y = self.yaw = 0.0
        self.has_odometry = True
        self.on_step: Callable[[], object] = lambda: None
        self.commands: list[Any] = peer.receive(Twist, "/cmd_vel")
        self._peer = peer
        self._camera = camera
        self._then_s = time.monotonic()
        self._scan_s = self._picture_s = 0.0

    @property
    def speed(self) -> float:
        """The commanded speed ahead."""
        return float(self.commands[-1].linear.x) if self.commands else 0.0

    @property
    def turn(self) -> float:
        """The commanded turn."""
        return float(self.commands[-1].angular.z) if self.commands else 0.0

    def step(self) -> None:
        """Obey the last command since the last step, and publish what the sensors see."""
        now_s = time.monotonic()
        duration_s = min(now_s - self._then_s, LONGEST_STEP_S)
        self._then_s = now_s
        if self.commands:
            command = self.commands[-1]
            ahead, left = command.linear.x * duration_s, command.linear.y * duration_s
            self.x += ahead * math.cos(self.yaw) - left * math.sin(self.yaw)
            self.y += ahead * math.sin(self.yaw) + left * math.cos(self.yaw)
            self.yaw = math.remainder(self.yaw + command.angular.z * duration_s, math.tau)
        self.on_step()
        if self.has_odometry:
            self._publish_odometry()
        if now_s - self._scan_s >= SCAN_EVERY_S:
            self._scan_s = now_s
            self._publish_scan()
        if self._camera is not None and now_s - self._picture_s >= PICTURE_EVERY_S:
            self._picture_s = now_s
            self.publish_picture(self._camera(self))

    def _publish_odometry(self) -> None:
        from nav_msgs.msg import Odometry

        message = Odometry()
        message.header.frame_id = "odom"
        pose = message.pose.pose
        pose.position.x, pose.position.y = self.x, self.y
        pose.orientation.z, pose.orientation.w = math.sin(self.yaw / 2), math.cos(self.yaw / 2)
        self._peer.publish(message, "/odom")

    def _publish_scan(self) -> None:
        from rclpy.qos import qos_profile_sensor_data
        from sensor_msgs.msg import LaserScan

        message = LaserScan(
            angle_min=0.0,
            angle_max=math.tau * (BEAMS - 1) / BEAMS,
            angle_increment=math.tau / BEAMS,
            range_min=0.05,
            range_max=LONGEST_M,
            ranges=array("f", self.ranges()),
        )
        self._peer.publish(message, "/scan", qos_profile_sensor_data)

    def ranges(self) -> NDArray[np.float64]:
        """Return the ranges that the LiDAR measures; infinity where nothing is near enough."""
        angles = self.yaw + np.arange(BEAMS) * math.tau / BEAMS
        directions = np.stack([np.cos(angles), np.sin(angles)])
        nearest = np.full(BEAMS, math.inf)
        with np.errstate(divide="ignore", invalid="ignore"):
            for wall in self.world.walls:
                nearest = np.fmin(nearest, self._to_wall(wall, directions))
            for thing in self.world.obstacles:
                nearest = np.fmin(nearest, self._to_thing(thing, directions))
        return np.where(nearest <= LONGEST_M, nearest, math.inf)

    def _to_wall(self, wall: Wall, directions: NDArray[np.float64]) -> NDArray[np.float64]:
        along_x, along_y = wall.x2 - wall.x1, wall.y2 - wall.y1
        to_x, to_y = wall.x1 - self.x, wall.y1 - self.y
        across = directions[0] * along_y - directions[1] * along_x
        distance = (to_x * along_y - to_y * along_x) / across
        share = (to_x * directions[1] - to_y * directions[0]) / across
        hits = (distance > 0) & (share >= 0) & (share <= 1)
        return np.where(hits, distance, math.inf)

    def _to_thing(self, thing: Thing, directions: NDArray[np.float64]) -> NDArray[np.float64]:
        to_x, to_y = thing.x - self.x, thing.y - self.y
        along = directions[0] * to_x + directions[1] * to_y
        inside = thing.radius**2 - (to_x**2 + to_y**2 - along**2)
        return np.where((inside > 0) & (along > 0), along - np.sqrt(np.maximum(inside, 0)), math.inf)

    def publish_picture(self, picture: Picture) -> None:
        """Send a picture, its rows padded as many drivers do."""
        from rclpy.qos import qos_profile_sensor_data
        from sensor_msgs.msg import Image

        height, width = picture.shape[:2]
        rows = picture.reshape(height, -1)
        padded = np.pad(rows, ((0, 0), (0, 5)), constant_values=255)
        message = Image(
            height=height,
            width=width,
            encoding="mono8" if picture.ndim == 2 else "rgb8",
            step=padded.shape[1],
            data=array("B", padded.tobytes()),
        )
        self._peer.publish(message, "/image", qos_profile_sensor_data)


def coloured_picture(robot: KinematicRobot) -> Picture:
    """Draw the view of a camera that looks straight ahead: things as discs, nearer ones lower and over the others."""
    picture = np.full((PICTURE_HEIGHT, PICTURE_WIDTH, 3), 200, np.uint8)
    rows, columns = np.mgrid[0:PICTURE_HEIGHT, 0:PICTURE_WIDTH]
    pixels = PICTURE_WIDTH / (2 * math.tan(FIELD_OF_VIEW_RAD / 2))
    seen = [(thing.place_from(robot.x, robot.y, robot.yaw), thing) for thing in robot.world.things]
    for (ahead, left), thing in sorted(seen, key=lambda item: -item[0][0]):
        if ahead > 0.05:
            middle, radius = PICTURE_WIDTH / 2 - pixels * left / ahead, pixels * thing.radius / ahead
            disc = (columns + 0.5 - middle) ** 2 + (rows + 0.5 - PICTURE_HEIGHT / 2) ** 2 <= radius**2
            picture[disc] = thing.colour
    return picture


def floor_picture(robot: KinematicRobot, look_ahead: float = 0.3, view: float = 0.6) -> Picture:
    """Draw a dark line along the x axis as a camera that looks down sees it, at that distance and width of view."""
    picture = np.full((48, 64), 220, np.uint8)
    aside = -(robot.y + look_ahead * math.sin(robot.yaw)) / view
    middle = 64 * (0.5 - aside)
    columns = np.arange(64) + 0.5
    picture[:, np.abs(columns - middle) <= 3] = 30
    return picture
