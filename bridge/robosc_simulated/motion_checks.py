"""Checks of whether a robot has moved as its scenario demands: its record against its scene, in sentences.

The judges trust nothing but the scene and where the robot was: whether it has touched something is measured again
from
its places, beside what the simulator has counted.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from robosc_simulated.motion import SAMPLE_S, Event, Motion, Sample
from robosc_simulated.robots import BODIES
from robosc_simulated.scene import Scene

LATERAL_M = 0.08
"""Largest distance of the robot's middle from that of the line while it follows it, in metres."""

STILL_M_S = 0.005
STILL_RAD_S = 0.02
"""Largest yaw rate that counts as standing still, in rad/s."""

SETTLE_S = 1.0
"""Maximum time of the world that a robot may take to stand still when it has to, in seconds."""

# Places are rounded, and a body that touches is let a hair into what it touches by nobody.
_SLACK_M = 1e-4
# Twice as far as samples are written.
_MOST_APART_S = 2 * SAMPLE_S
# Between two samples nothing that obeys its motors gets farther: 50 ms at 1 m/s, and some.
_JUMP_M = 0.1


@dataclass(frozen=True)
class Halt:
    """Time in which the robot has to stand still.

    Attributes:
        begin_s: World time from which it was commanded so, or had a reason to.
        end_s: World time until which that holds.
        why: Reason for a person, such as `the stop button`.
    """

    begin_s: float
    end_s: float
    why: str


def check_maze(scene: Scene, motion: Motion) -> tuple[str, ...]:
    """Return the faults of a way out of a maze.

    Args:
        scene: Scene with a goal.
        motion: Motion of a Burger.

    Returns:
        Faults in sentences; none: it has come to the goal without touching anything.

    Raises:
        ValueError: The scene has no goal.
    """
    if scene.goal is None:
        raise ValueError(f"{scene.name} has no goal")
    faults = [*_record_faults(motion), *_touch_faults(scene, motion, BODIES["burger"].radius_m)]
    if motion.samples and not any(scene.goal.is_reached(sample.x_m, sample.y_m) for sample in motion.samples):
        last = motion.samples[-1]
        distance_m = math.hypot(last.x_m - scene.goal.x_m, last.y_m - scene.goal.y_m)
        faults.append(f"it was never at the goal; at the end, {last.world_s:.2f} s, it is {distance_m:.2f} m from it")
    return tuple(faults)


def check_line(
    scene: Scene,
    motion: Motion,
    halts: Sequence[Halt] = (),
    *,
    lateral_m: float = LATERAL_M,
    settle_s: float = SETTLE_S,
    least_m: float = 0.0,
) -> tuple[str, ...]:
    """Return the faults in how a line was followed.

    Args:
        scene: Scene with a line.
        motion: Motion of the robot.
        halts: Times in which it has to stand still.
        lateral_m: Largest distance that its middle may have from the line.
        settle_s: World time that it has to come to rest in each halt.
        least_m: Shortest distance that it has to drive in all, so that standing still for ever is no success.

    Returns:
        Faults in sentences; none: it has kept to the line, and stood still when it had to.

    Raises:
        ValueError: The scene has no line.
    """
    if scene.line is None:
        raise ValueError(f"{scene.name} has no line")
    faults = [*_record_faults(motion), *_touch_faults(scene, motion, BODIES["burger"].radius_m)]
    if motion.samples:
        errors_m = lateral_errors_m(scene, motion)
        worst_m = max(errors_m)
        if worst_m > lateral_m:
            at_s = motion.samples[errors_m.index(worst_m)].world_s
            faults.append(f"at {at_s:.2f} s it is {worst_m:.3f} m beside the line; {lateral_m:g} m are allowed")
        faults += [fault for halt in halts for fault in _halt_faults(motion, halt, settle_s)]
        driven_m = way_m(motion)
        if driven_m < least_m:
            faults.append(f"it has driven {driven_m:.2f} m in all; {least_m:g} m were to be driven")
    return tuple(faults)


def lateral_errors_m(scene: Scene, motion: Motion) -> tuple[float, ...]:
    """Return the distance of the robot's middle from that of the line, for each sample.

    Raises:
        ValueError: The scene has no line.
    """
    if scene.line is None:
        raise ValueError(f"{scene.name} has no line")
    return tuple(scene.line.distance_m(sample.x_m, sample.y_m) for sample in motion.samples)


def way_m(motion: Motion) -> float:
    """Return the distance that the robot has driven, forward and backward."""
    pairs = zip(motion.samples, motion.samples[1:], strict=False)
    return math.fsum(math.hypot(after.x_m - before.x_m, after.y_m - before.y_m) for before, after in pairs)


def _record_faults(motion: Motion) -> Iterator[str]:
    """Yield faults that no robot causes: with one of them, nothing else in the record can be relied on."""
    if not motion.samples:
        yield "nothing was recorded"
    if not motion.has_ended:
        yield "the record has no end: whoever wrote it was killed, or had no room"
    for before, after in zip(motion.samples, motion.samples[1:], strict=False):
        if after.world_s - before.world_s > _MOST_APART_S:
            yield f"nothing was recorded from {before.world_s:.2f} s to {after.world_s:.2f} s"
            return
        jump_m = math.hypot(after.x_m - before.x_m, after.y_m - before.y_m)
        if jump_m > _JUMP_M:
            yield f"at {after.world_s:.2f} s it is suddenly {jump_m:.2f} m away: moved by hand, or time is missing"
            return


def _touch_faults(scene: Scene, motion: Motion, radius_m: float) -> Iterator[str]:
    counted = motion.samples[-1].collisions if motion.samples else 0
    touches = [event for event in motion.happenings if event.happening == "collision"]
    if touches or counted:
        where = f", first at {touches[0].world_s:.2f} s{_what(touches[0])}" if touches else ""
        yield f"it has touched something {max(counted, len(touches))} times{where}"
    obstacles = {
        obstacle.name: (obstacle.x_m, obstacle.y_m, obstacle.radius_m)
        for obstacle in scene.obstacles
        if obstacle.is_there
    }
    changes = [event for event in motion.happenings if event.happening == "obstacle"]
    for sample in motion.samples:
        while changes and changes[0].world_s <= sample.world_s:
            change = changes.pop(0)
            obstacles.pop(change.name, None)
            if change.is_there:
                obstacles[change.name] = (change.x_m, change.y_m, change.radius_m)
        fault = _overlap(scene, sample, obstacles, radius_m)
        if fault:
            yield fault
            return


def _what(event: Event) -> str:
    return f": the obstacle {event.name!r}" if event.name else ": a wall"


def _overlap(
    scene: Scene, sample: Sample, obstacles: dict[str, tuple[float, float, float]], radius_m: float
) -> str | None:
    to_wall_m = scene.walls.distance_m(sample.x_m, sample.y_m)
    if to_wall_m < radius_m - _SLACK_M:
        return (
            f"at {sample.world_s:.2f} s its middle is {to_wall_m:.3f} m from a wall, and its radius is {radius_m:g} m"
        )
    for name, (x_m, y_m, other_m) in obstacles.items():
        if math.hypot(sample.x_m - x_m, sample.y_m - y_m) < radius_m + other_m - _SLACK_M:
            return f"at {sample.world_s:.2f} s it is where the obstacle {name!r} is"
    return None


def _halt_faults(motion: Motion, halt: Halt, settle_s: float) -> Iterator[str]:
    within = [sample for sample in motion.samples if halt.begin_s + settle_s <= sample.world_s <= halt.end_s]
    if not within:
        span = f"from {halt.begin_s:.2f} s to {halt.end_s:.2f} s"
        yield f"it was to stand still for {halt.why} {span}, and there is no sample of that"
        return
    for sample in within:
        if abs(sample.linear_m_s) > STILL_M_S or abs(sample.angular_rad_s) > STILL_RAD_S:
            speeds = f"{sample.linear_m_s:.3f} m/s and {sample.angular_rad_s:.3f} rad/s"
            since = f"since {halt.begin_s:.2f} s it was to stand still for {halt.why}"
            yield f"at {sample.world_s:.2f} s it moves at {speeds}; {since}"
            return
