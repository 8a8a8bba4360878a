"""Walls and the line on the floor, for the page's map: of a scene of the simulator, or of one after a real place."""

import math
from collections.abc import Mapping
from typing import Any

from robosc_simulated.scene import Scene, SceneError, load_scene
from robosc_view.sources import ViewError

_DIGITS = 4


def scene_map(source: str | None, seed: int = 0) -> Mapping[str, Any] | None:
    """Return a robot's surroundings as its odometry sees them: the origin is where it began, x its first heading.

    Args:
        source: Name or file of a scene; None: nothing is known.
        seed: Seed of the random parts of the scene.

    Returns:
        `walls`, each [x1, y1, x2, y2], and `line`, each [x, y]; in metres.

    Raises:
        ViewError: There is no such scene, or the scene is invalid.
    """
    if source is None:
        return None
    try:
        return scene_from_start(load_scene(source, seed))
    except SceneError as error:
        raise ViewError(f"the scene: {error}") from error


def scene_start(source: str | None, seed: int = 0) -> tuple[float, float, float]:
    """Return where the robot begins in a scene: x and y in metres, heading in radians; the origin without a scene.

    Args:
        source: Name or file of a scene that `scene_map` has accepted, or None.
        seed: Seed of what the scene leaves to chance.
    """
    return (0.0, 0.0, 0.0) if source is None else load_scene(source, seed).start


def scene_from_start(scene: Scene) -> Mapping[str, Any]:
    """Return a scene in the form that `scene_map` returns."""
    begin_x_m, begin_y_m, heading_rad = scene.start
    cosine, sine = math.cos(heading_rad), math.sin(heading_rad)

    def turned(x_m: float, y_m: float) -> list[float]:
        x_m, y_m = x_m - begin_x_m, y_m - begin_y_m
        return [round(cosine * x_m + sine * y_m, _DIGITS), round(cosine * y_m - sine * x_m, _DIGITS)]

    return {
        "walls": [turned(x1, y1) + turned(x2, y2) for x1, y1, x2, y2 in scene.walls.segments],
        "line": [] if scene.line is None else [turned(*point) for point in scene.line.points],
    }
