"""Scenes: everything around the robot, from a built-in name or a readable file.

A scene file is YAML (see `scene_file` for its keys, docs/twin.md for a person's words); the ones that come with the
package are in `scenes/`.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import NoReturn

from robosc_bridge.configuration.decoding import decode
from robosc_bridge.configuration.document import Document, parse_document, read_file
from robosc_bridge.configuration.problems import ConfigurationError, Problem
from robosc_bridge.configuration.problems import Path as Place
from robosc_simulated.floor import Point, Track, spline
from robosc_simulated.scene_file import (
    MOST_SEGMENTS,
    WALL_HEIGHT_M,
    WALL_SHADE,
    LinePart,
    MazePart,
    SceneFile,
    WallsPart,
)
from robosc_simulated.textures import PLAIN, Texture
from robosc_simulated.walls import CELL_M, Segment, Walls, open_maze

# Share of a cell: the robot's middle is out of the gap before it is there, and is there also where it rounds the corner
# of the gap at once, 0.3 of a cell from it.
_GOAL_SHARE = 0.45
_SEGMENT = "x1, y1, x2, y2"
_FOLDER = Path(__file__).parent / "scenes"


class SceneError(ValueError):
    """A scene cannot be used; one sentence with its place."""


@dataclass(frozen=True)
class Goal:
    """Place to which the robot is to come: it is there when its middle is inside.

    Attributes:
        x_m: x of the middle.
        y_m: y of the middle.
        radius_m: Radius of the round place.
    """

    x_m: float
    y_m: float
    radius_m: float

    def is_reached(self, x_m: float, y_m: float) -> bool:
        """Return True if a robot whose middle is at a point is there."""
        return math.hypot(x_m - self.x_m, y_m - self.y_m) <= self.radius_m


class Look(StrEnum):
    """Look of a wall or an obstacle to a LiDAR."""

    PLAIN = "plain"
    DARK = "dark"
    GLASS = "glass"


@dataclass(frozen=True)
class Obstacle:
    """A round thing that can be moved, put away and put back while the simulation runs.

    Attributes:
        name: Name by which it is known.
        x_m: x of its middle.
        y_m: y of its middle.
        radius_m: Its radius.
        is_there: True if the robot meets and sees it.
        look: Look to a LiDAR.
    """

    name: str
    x_m: float
    y_m: float
    radius_m: float
    is_there: bool = True
    look: Look = Look.PLAIN


@dataclass(frozen=True)
class Noise:
    """Noise that makes motion and sensors less than ideal.

    Attributes:
        slip_share: Share of each wheel's way that is lost on the floor, on average.
        slip_deviation: Standard deviation of that, drawn for each wheel every 0.1 s.
        encoder_deviation: Standard deviation of what encoders count, as a share, drawn likewise.
        lidar_m: Standard deviation of what the LiDAR measures.
        camera_shades: Standard deviation of each pixel, of 255.
    """

    slip_share: float = 0.0
    slip_deviation: float = 0.0
    encoder_deviation: float = 0.0
    lidar_m: float = 0.0
    camera_shades: float = 0.0


IDEAL = Noise()
"""Wheels that do not slip, sensors that measure what is there."""


@dataclass(frozen=True)
class Scene:
    """Surroundings of a robot.

    Attributes:
        name: Name for a person.
        walls: Walls that stand where they are.
        start: Start pose of the robot: x, y in metres, heading in rad.
        goal: Place to which it is to come; None: nowhere in particular.
        line: Line on the floor; None: there is none.
        obstacles: Round things that can be moved.
        floor: Look of the floor.
        noise: Noise that makes motion and sensors less than ideal.
        wall_height_m: Height of walls and obstacles, as a camera sees them; a LiDAR sees them at any height.
        wall_shade: Shade of the same, from 0 (black) to 255 (white).
        special_walls: Those of the walls that a LiDAR sees badly, by their look.
        profile: Name of the profile of a run in it; None: it does not say.
    """

    name: str
    walls: Walls
    start: tuple[float, float, float] = (0.0, 0.0, 0.0)
    goal: Goal | None = None
    line: Track | None = None
    obstacles: tuple[Obstacle, ...] = ()
    floor: Texture = PLAIN
    noise: Noise = IDEAL
    wall_height_m: float = WALL_HEIGHT_M
    wall_shade: int = WALL_SHADE
    special_walls: Mapping[Look, Walls] = field(default_factory=dict)
    profile: str | None = None


def maze_scene(columns: int, rows: int, *, cell_m: float = CELL_M, seed: int = 0) -> Scene:
    """A maze by chance, from its first cell to its exit.

    Args:
        columns: Cells along x.
        rows: Cells along y.
        cell_m: Width of a cell.
        seed: Of the choice.

    Raises:
        ValueError: There is no cell.
    """
    walls, exit_m = open_maze(columns, rows, cell_m, seed)
    return Scene(f"maze {columns}x{rows} seed {seed}", walls, goal=Goal(*exit_m, cell_m * _GOAL_SHARE))


@cache
def scene_names() -> tuple[str, ...]:
    """Names of the scenes that come with the package."""
    return tuple(sorted(path.stem for path in _FOLDER.glob("*.yaml")))


def load_scene(source: str | Path, seed: int = 0) -> Scene:
    """A scene.

    Args:
        source: One of `scene_names`, or a file.
        seed: Of whatever the file leaves to chance.

    Raises:
        SceneError: There is no such scene, it cannot be read, or something in it is wrong; one sentence, with the
            place.
    """
    is_built_in = isinstance(source, str) and source in scene_names()
    path = _FOLDER / f"{source}.yaml" if is_built_in else Path(source)
    if not is_built_in and not path.exists():
        raise SceneError(f"there is no scene and no file {str(source)!r}; there are {', '.join(scene_names())}")
    try:
        return parse_scene(read_file(path), str(source) if is_built_in else path.stem, str(path), seed)
    except ConfigurationError as error:
        # The first of what is wrong is enough to begin with.
        raise SceneError(error.problems[0].text(error.file)) from error


def parse_scene(data: bytes, name: str, file: str, seed: int = 0) -> Scene:
    """A scene from the text of its file.

    Args:
        data: YAML in UTF-8.
        name: Of the scene.
        file: Of its file, for messages.
        seed: Of whatever it leaves to chance.

    Raises:
        SceneError: Something in it is wrong; one sentence, with the place.
    """
    try:
        document = parse_document(data, file)
        return _Maker(document, seed).scene(name, decode(document, SceneFile))
    except ConfigurationError as error:
        raise SceneError(error.problems[0].text(error.file)) from error


class _Maker:
    """Makes a scene of what its file says; a problem is reported with its place."""

    def __init__(self, document: Document, seed: int) -> None:
        self._document = document
        self._seed = seed

    def scene(self, name: str, said: SceneFile) -> Scene:
        """The scene."""
        segments = list(self._segments(said.walls))
        special = {
            look: [self._four(segment, _SEGMENT, ("walls", look, place)) for place, segment in enumerate(found)]
            for look, found in ((Look.DARK, said.walls.dark), (Look.GLASS, said.walls.glass))
        }
        for found in special.values():
            segments += found
        goal = None if said.goal is None else Goal(said.goal.x_m, said.goal.y_m, said.goal.radius_m)
        if said.maze is not None:
            walls, exit_m = self._maze(said.maze)
            segments += walls.segments
            goal = goal or Goal(*exit_m, said.maze.cell_m * _GOAL_SHARE)
        if len(segments) > MOST_SEGMENTS:
            self._fail(f"there are {len(segments)} walls; there may be {MOST_SEGMENTS}", ("walls",))
        start, floor, noise = said.start, said.floor, said.noise
        return Scene(
            name,
            Walls(segments),
            (start.x_m, start.y_m, math.radians(start.heading_deg)),
            goal,
            None if said.line is None else self._line(said.line),
            tuple(
                Obstacle(key, it.x_m, it.y_m, it.radius_m, it.is_there, Look(it.look))
                for key, it in said.obstacles.items()
            ),
            Texture(floor.texture, floor.shade, floor.other_shade, floor.size_m, floor.joint_m, self._seed),
            Noise(noise.slip_share, noise.slip_deviation, noise.encoder_deviation, noise.lidar_m, noise.camera_shades),
            said.walls.height_m,
            said.walls.shade,
            {look: Walls(found) for look, found in special.items() if found},
            said.profile,
        )

    def _maze(self, said: MazePart) -> tuple[Walls, Point]:
        return open_maze(said.columns, said.rows, said.cell_m, self._seed if said.seed is None else said.seed)

    def _segments(self, said: WallsPart) -> Iterator[Segment]:
        for place, segment in enumerate(said.segments):
            yield self._four(segment, _SEGMENT, ("walls", "segments", place))
        for place, polyline in enumerate(said.polylines):
            points = self._points(polyline, ("walls", "polylines", place))
            for start, end in pairwise(points):
                yield *start, *end
        for place, rectangle in enumerate(said.rectangles):
            path = ("walls", "rectangles", place)
            x_m, y_m, width_m, height_m = self._four(rectangle, "x, y, width, height", path)
            if not (width_m > 0 and height_m > 0):
                self._fail("the width and the height of a rectangle must be above 0", path)
            corners = (x_m, y_m), (x_m + width_m, y_m), (x_m + width_m, y_m + height_m), (x_m, y_m + height_m)
            for start, end in pairwise((*corners, corners[0])):
                yield *start, *end

    def _line(self, said: LinePart) -> Track:
        points = self._points(said.points, ("line", "points"))
        if said.is_closed and points[0] != points[-1]:
            points = (*points, points[0])
        try:
            if said.kind == "spline":
                points = spline(points, said.width_m)
            return Track(points, said.width_m, said.shade)
        except ValueError as error:
            self._fail(str(error), ("line",))

    def _four(self, numbers: tuple[float, ...], meaning: str, path: Place) -> Segment:
        if len(numbers) != 4:
            self._fail(f"has {len(numbers)} numbers; it must be [{meaning}]", path)
        first, second, third, fourth = numbers
        return first, second, third, fourth

    def _points(self, points: tuple[tuple[float, ...], ...], path: Place) -> tuple[Point, ...]:
        if len(points) < 2:
            self._fail("has fewer than two points", path)
        for place, point in enumerate(points):
            if len(point) != 2:
                self._fail(f"has {len(point)} numbers; it must be [x, y]", (*path, place))
        return tuple((x_m, y_m) for x_m, y_m in points)

    def _fail(self, message: str, path: Place) -> NoReturn:
        raise ConfigurationError(self._document.name, [Problem(message, path, self._document.line(path))])
