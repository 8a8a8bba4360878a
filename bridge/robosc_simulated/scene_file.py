"""Content of a scene file: frozen structures that its checks and its documentation are made from.

They are read with the same decoder as the bridge's configuration; `scene` makes a `Scene` of them.
"""

from typing import Annotated, Literal

from msgspec import Meta, Struct

from robosc_simulated.values import FARTHEST_M, MOST_SEED

MOST_SEGMENTS = 5_000
"""Maximum number of segments of all walls of a scene."""

MOST_CELLS = 30
"""Maximum number of cells of a maze, along each side."""

WALL_HEIGHT_M, WALL_SHADE = 0.3, 130
"""Default height of walls and obstacles, in metres, and their shade: a grey between the floors and the lines."""

_Metres = Annotated[float, Meta(ge=-FARTHEST_M, le=FARTHEST_M)]
_Seed = Annotated[int, Meta(ge=0, le=MOST_SEED)]
_Point = tuple[_Metres, ...]
# Python's `$` would take a line feed after the end of a text.
Name = Annotated[str, Meta(pattern=r"^[a-z][a-z0-9_-]{0,39}(?![\s\S])", title="box or box_2")]
"""Name of an obstacle, as it is given on standard input."""


class _Section(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Base of all sections."""


class WallsPart(_Section, frozen=True):
    """Walls that stand where they are, and how the camera sees walls and obstacles."""

    segments: Annotated[
        tuple[tuple[_Metres, ...], ...], Meta(description="Straight walls, `[x1, y1, x2, y2]` in metres each.")
    ] = ()
    polylines: Annotated[
        tuple[tuple[_Point, ...], ...],
        Meta(description="Walls from point to point, a list of `[x, y]` each; the first again at the end closes one."),
    ] = ()
    rectangles: Annotated[
        tuple[tuple[_Metres, ...], ...],
        Meta(
            description="Four walls, `[x, y, width, height]` each, where x, y is the corner of the least coordinates."
        ),
    ] = ()
    dark: Annotated[
        tuple[tuple[_Metres, ...], ...],
        Meta(description="Straight walls that a LiDAR sees from near only, `[x1, y1, x2, y2]` each."),
    ] = ()
    glass: Annotated[
        tuple[tuple[_Metres, ...], ...],
        Meta(description="Straight walls through which most beams of a LiDAR go, `[x1, y1, x2, y2]` each."),
    ] = ()
    height_m: Annotated[
        float, Meta(ge=0.01, le=10, description="Of walls and obstacles, as the camera sees them; the LiDAR sees all.")
    ] = WALL_HEIGHT_M
    shade: Annotated[int, Meta(ge=0, le=255, description="Of walls and obstacles: 0 is black, 255 white.")] = WALL_SHADE


class MazePart(_Section, frozen=True):
    """A maze with an exit, made by chance."""

    columns: Annotated[int, Meta(ge=1, le=MOST_CELLS, description="Cells along x.")]
    rows: Annotated[int, Meta(ge=1, le=MOST_CELLS, description="Cells along y.")]
    cell_m: Annotated[
        float, Meta(ge=0.3, le=5, description="Width of a cell; the middle of the first one is the origin.")
    ] = 1.0
    seed: Annotated[
        _Seed | None, Meta(description="Of the choice; null: that of the run (`--seed`, `load_scene(..., seed)`).")
    ] = None


class PosePart(_Section, frozen=True):
    """Place where the robot starts."""

    x_m: Annotated[float, Meta(ge=-1000, le=1000, description="Of the middle between its wheels.")] = 0.0
    y_m: Annotated[float, Meta(ge=-1000, le=1000, description="Of the same.")] = 0.0
    heading_deg: Annotated[
        float, Meta(ge=-360, le=360, description="Counter-clockwise from the x axis, in degrees.")
    ] = 0.0


class GoalPart(_Section, frozen=True):
    """Place to which the robot is to come; a maze brings its own."""

    x_m: Annotated[float, Meta(ge=-1000, le=1000, description="Of its middle.")]
    y_m: Annotated[float, Meta(ge=-1000, le=1000, description="Of its middle.")]
    radius_m: Annotated[float, Meta(gt=0, le=1000, description="The robot's middle is to be within it.")]


class LinePart(_Section, frozen=True):
    """A line on the floor, and a camera that sees it."""

    points: Annotated[
        tuple[_Point, ...], Meta(description="Points of the line, `[x, y]` in metres each; at least two.")
    ]
    kind: Annotated[
        Literal["straight", "spline"],
        Meta(description="Straight from point to point, or a smooth curve through them (a cubic spline)."),
    ] = "straight"
    is_closed: Annotated[bool, Meta(description="True: it goes on from the last point to the first.")] = False
    width_m: Annotated[float, Meta(ge=0.005, le=1, description="Of the line.")] = 0.05
    shade: Annotated[int, Meta(ge=0, le=255, description="Of the line: 0 is black, 255 white.")] = 30


class FloorPart(_Section, frozen=True):
    """Look of the floor."""

    texture: Annotated[
        Literal["plain", "tiles", "checkerboard", "speckle"],
        Meta(description="`tiles` have joints of the other shade between them, `speckle` is random from cell to cell."),
    ] = "plain"
    shade: Annotated[int, Meta(ge=0, le=255, description="0 is black, 255 white.")] = 200
    other_shade: Annotated[
        int, Meta(ge=0, le=255, description="Of joints and of every other field; the farthest that a speckle goes.")
    ] = 170
    size_m: Annotated[
        float, Meta(ge=0.002, le=10, description="Width of a tile, of a field, of a cell of speckle.")
    ] = 0.3
    joint_m: Annotated[float, Meta(gt=0, le=1, description="Width of the joints between tiles.")] = 0.01


class ObstaclePart(_Section, frozen=True):
    """A round thing that can be moved, put away and put back while the simulation runs."""

    x_m: Annotated[float, Meta(ge=-1000, le=1000, description="Of its middle.")]
    y_m: Annotated[float, Meta(ge=-1000, le=1000, description="Of its middle.")]
    radius_m: Annotated[float, Meta(ge=0.005, le=100, description="Of the thing.")]
    is_there: Annotated[bool, Meta(description="True: it is there from the start.")] = True
    look: Annotated[Literal["plain", "dark", "glass"], Meta(description="Look to a LiDAR, as that of walls.")] = "plain"


class NoisePart(_Section, frozen=True):
    """Noise that makes motion and sensors less than ideal; all of it by the seed of the run."""

    slip_share: Annotated[
        float, Meta(ge=0, le=0.9, description="Share of each wheel's way that is lost on the floor, on average.")
    ] = 0.0
    slip_deviation: Annotated[
        float, Meta(ge=0, le=0.5, description="Standard deviation of that, drawn for each wheel every 0.1 s.")
    ] = 0.0
    encoder_deviation: Annotated[
        float, Meta(ge=0, le=0.5, description="Standard deviation of what encoders count, as a share; drawn as above.")
    ] = 0.0
    lidar_m: Annotated[float, Meta(ge=0, le=1, description="Standard deviation of what the LiDAR measures.")] = 0.0
    camera_shades: Annotated[
        float, Meta(ge=0, le=128, description="Standard deviation of each pixel's shade, of 255.")
    ] = 0.0


class SceneFile(_Section, frozen=True):
    """A scene."""

    walls: Annotated[WallsPart, Meta(description="Walls that stand where they are.")] = WallsPart()
    maze: Annotated[MazePart | None, Meta(description="A maze with an exit, made by chance.")] = None
    start: Annotated[PosePart, Meta(description="Pose in which the robot starts.")] = PosePart()
    goal: Annotated[
        GoalPart | None, Meta(description="Place that the robot is to reach; null: a maze's exit, or nowhere.")
    ] = None
    line: Annotated[LinePart | None, Meta(description="A line on the floor.")] = None
    floor: Annotated[FloorPart, Meta(description="Looks of the floor.")] = FloorPart()
    obstacles: Annotated[dict[Name, ObstaclePart], Meta(description="Round things that can be moved, by name.")] = {}
    noise: Annotated[NoisePart, Meta(description="Disturbances of motion and sensors.")] = NoisePart()
    profile: Annotated[
        Literal["ideal", "typical", "bad-day"] | None,
        Meta(description="Distance of devices and lines from ideal; null: that of the run (`--profile`)."),
    ] = None
