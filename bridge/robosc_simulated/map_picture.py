"""A picture of a scene from above, with the path of a robot in it. Needs matplotlib."""

import itertools
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from robosc_simulated.motion import Motion, Sample
from robosc_simulated.robots import BODIES, Body
from robosc_simulated.scene import Scene

SUFFIXES = (".png", ".svg", ".pdf")
"""Suffixes of the files that can be drawn."""

_MOST_OUTLINES = 24
_WHEEL_WIDTH_M = 0.018
_WIDTH_IN = 6.0
_TALLEST_IN = 12.0
_WALL, _LINE, _WAY, _THING, _GOAL, _HIT = "#333333", "#b0b0b0", "#0b6bb5", "#8c6d31", "#2e8b57", "#d62728"


def draw_map(scene: Scene, motion: Motion | None, path: Path, robot: str = "burger") -> None:
    """Draw walls, line, goal and obstacles, the way of the robot, and where it has touched something.

    The robot is drawn to scale, with its wheels and its heading, at intervals on its way.

    Args:
        scene: Scene that is drawn; its obstacles as they were at the start.
        motion: Motion of the robot; None: the scene alone.
        path: Path of the picture; its suffix, one of `SUFFIXES`, determines its kind.
        robot: Key of `BODIES`.

    Raises:
        ValueError: The suffix is unknown, or matplotlib is not installed.
        OSError: It cannot be written.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise ValueError(
            f"{path}: a map is drawn as {', '.join(SUFFIXES)}, not as {path.suffix or 'a file without suffix'}"
        )
    try:
        # Here, since it is large and only pictures need it; without its pyplot, there is no window and no global state.
        from matplotlib import rc_context
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
        from matplotlib.patches import Circle
    except ImportError as error:
        raise ValueError("a map needs matplotlib; install RoboSC with its extra `simulation`") from error
    samples = motion.samples if motion is not None else ()
    figure = Figure(layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    axes.set_aspect("equal")
    if scene.line is not None:
        xs_m, ys_m = zip(*scene.line.points, strict=True)
        axes.plot(xs_m, ys_m, color=_LINE, linewidth=4, solid_joinstyle="round", label="line")
    for place, (x1_m, y1_m, x2_m, y2_m) in enumerate(scene.walls.segments):
        axes.plot((x1_m, x2_m), (y1_m, y2_m), color=_WALL, linewidth=2, label="walls" if place == 0 else None)
    if scene.goal is not None:
        middle = (scene.goal.x_m, scene.goal.y_m)
        axes.add_patch(Circle(middle, scene.goal.radius_m, color=_GOAL, alpha=0.4, linewidth=0, label="goal"))
    for obstacle in scene.obstacles:
        look = {"color": _THING} if obstacle.is_there else {"edgecolor": _THING, "fill": False, "linestyle": ":"}
        axes.add_patch(Circle((obstacle.x_m, obstacle.y_m), obstacle.radius_m, **look))
        axes.annotate(obstacle.name, (obstacle.x_m, obstacle.y_m), ha="center", va="center", fontsize=7)
    if samples:
        xs, ys = [sample.x_m for sample in samples], [sample.y_m for sample in samples]
        axes.plot(xs, ys, color=_WAY, linewidth=1.2, label="way of the robot")
        shown = outlined(samples, BODIES[robot].radius_m)
        for number, sample in enumerate(shown):
            is_end = number in (0, len(shown) - 1)
            _draw_robot(axes, sample, BODIES[robot], 1.0 if is_end else 0.45)
        outline: dict[str, Any] = {"linestyle": "", "markersize": 9, "markerfacecolor": "none", "markeredgecolor": _WAY}
        axes.plot([], [], marker="o", label="robot, to scale", **outline)
        axes.plot(xs[:1], ys[:1], marker="o", markersize=4, color=_WAY, linestyle="", label="start")
        axes.plot(xs[-1:], ys[-1:], marker="s", markersize=4, color=_WAY, linestyle="", label="end")
    else:
        axes.plot(*([value] for value in scene.start[:2]), marker="o", color=_WAY, linestyle="", label="start")
    hits = [event for event in (motion.happenings if motion else ()) if event.happening == "collision"]
    if hits:
        axes.plot(
            [hit.x_m for hit in hits],
            [hit.y_m for hit in hits],
            marker="x",
            color=_HIT,
            linestyle="",
            label="collision",
        )
    axes.margins(0.05)
    axes.autoscale_view()
    axes.set_xlabel("x (m)")
    axes.set_ylabel("y (m)")
    axes.set_title(f"{scene.name}: {samples[-1].world_s - samples[0].world_s:.1f} s" if samples else scene.name)
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize=8)
    left_m, right_m = axes.get_xlim()
    low_m, high_m = axes.get_ylim()
    figure.set_size_inches(_WIDTH_IN + 1.5, min(_WIDTH_IN * (high_m - low_m) / (right_m - left_m) + 0.8, _TALLEST_IN))
    # The same picture for the same motion: no time, and no chance in the names within an SVG.
    kind = path.suffix.lower()[1:]
    metadata = {"png": {}, "svg": {"Date": None}, "pdf": {"CreationDate": None}}[kind]
    with rc_context({"svg.hashsalt": "robosc"}):
        figure.savefig(path, dpi=120, metadata=metadata)


def outlined(samples: Sequence[Sample], radius_m: float) -> list[Sample]:
    """Return the samples at which the robot is drawn: its first, its last, and some at like distances between them.

    Args:
        samples: Samples of the way; at least one.
        radius_m: Radius of the robot: two drawn robots are at least five radii apart along the way, and farther on a
            long way, so that they can be distinguished. The last one may be closer.
    """
    way_m, ways_m = 0.0, [0.0]
    for before, after in itertools.pairwise(samples):
        way_m += math.hypot(after.x_m - before.x_m, after.y_m - before.y_m)
        ways_m.append(way_m)
    step_m = max(5 * radius_m, way_m / _MOST_OUTLINES)
    found, next_m = [samples[0]], step_m
    for sample, at_m in zip(samples, ways_m, strict=True):
        if at_m >= next_m:
            found.append(sample)
            next_m = at_m + step_m
    # The last one replaces one that it would cover.
    if len(found) > 1 and math.hypot(samples[-1].x_m - found[-1].x_m, samples[-1].y_m - found[-1].y_m) < 2 * radius_m:
        found.pop()
    return [*found, samples[-1]]


def _draw_robot(axes: Any, sample: Sample, body: Body, alpha: float) -> None:
    """Draw the round body, its two wheels, and an arrow head towards its front."""
    from matplotlib.patches import Circle, Polygon

    ahead = math.cos(sample.heading_rad), math.sin(sample.heading_rad)
    left = -ahead[1], ahead[0]

    def at(forward_m: float, left_m: float) -> tuple[float, float]:
        return (
            sample.x_m + forward_m * ahead[0] + left_m * left[0],
            sample.y_m + forward_m * ahead[1] + left_m * left[1],
        )

    look = {"edgecolor": _WAY, "linewidth": 1.0, "alpha": alpha}
    axes.add_patch(Circle((sample.x_m, sample.y_m), body.radius_m, fill=False, zorder=3, **look))
    for side in (0.5, -0.5):
        middle_m, half_m = side * body.wheel_separation_m, _WHEEL_WIDTH_M / 2
        corners = [
            at(forward_m, middle_m + across_m)
            for forward_m, across_m in (
                (body.wheel_radius_m, half_m),
                (body.wheel_radius_m, -half_m),
                (-body.wheel_radius_m, -half_m),
                (-body.wheel_radius_m, half_m),
            )
        ]
        axes.add_patch(Polygon(corners, facecolor=_WAY, linewidth=0, alpha=alpha, zorder=3))
    radius_m = body.radius_m
    # A line would vanish in the way, which mostly runs as the robot points.
    front = [at(0.95 * radius_m, 0.0), at(0.25 * radius_m, 0.42 * radius_m), at(0.25 * radius_m, -0.42 * radius_m)]
    axes.add_patch(Polygon(front, facecolor=_WAY, linewidth=0, alpha=alpha, zorder=3))
