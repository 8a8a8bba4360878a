"""The maze solver: a controller that leads a robot out of a maze, the wall on its right hand."""

from pathlib import Path

from robosc.model.structure import Deployment
from robosc_experiments.scenario import Outcome, Say, ScenarioError
from robosc_experiments.serial import EXAMPLES, Rig, Setting, running, scene_of
from robosc_experiments.tail import LineCount
from robosc_experiments.watch import RobotWatch
from robosc_simulated.motion import Motion
from robosc_simulated.motion_checks import check_maze

MODEL = EXAMPLES / "maze_solver" / "narrow_maze.rscd"
SCENES = ("maze-rooms", "maze-spiral", "maze-random")
"""The mazes that come with the package; the last one is another one for each seed."""

CHANNELS = {
    "/scan": "{channel: scanner}",
    "/rotate_left": "{channel: rotate, unit: degrees, direction: left}",
    "/rotate_right": "{channel: rotate, unit: degrees, direction: right}",
    "/rotate_done": "{channel: rotated, outcome: done}",
    "/cmd_vel": "{channel: drive}",
}

WORLD_LIMIT_S = 1200.0
"""Time limit of the world, in seconds: at 0.1 m/s that is a way of more than 80 m, rotations included."""

LIMIT_S = 240.0


def run_maze(folder: Path, scene: str | Path, *, speed: float, say: Say, seed: int = 0, model: Path = MODEL) -> Outcome:
    """Let a robot out of a maze, over serial lines.

    Args:
        folder: Folder that everything is written to; empty, or not there yet.
        scene: Name or file of the maze.
        speed: Speed of the world, as a multiple of the clock's.
        say: Function that takes lines of progress.
        seed: Seed of what the scene leaves to chance.
        model: Another one, with the communications of `narrow_maze.rscd`.

    Raises:
        ScenarioError: It could not be run to its end. A robot that does not find the way out is no such error, but a
            fault of the outcome.
    """
    place = scene_of(scene, seed)
    if place.goal is None:
        raise ScenarioError(f"the scene {place.name} has no goal: there is no way out of it")
    setting = Setting(
        folder.resolve(), model.resolve(), Deployment.CONTROLLER, place, scene, seed, speed, "lds01", CHANNELS, {}
    )
    say("starting the synthesis server, the simulated robot and the bridge")
    with running(setting) as rig:
        _wait_until_out(rig, say)
        figures = rig.finish()
    motion = setting.read_motion()
    return setting.outcome("maze", "serial", check_maze(place, motion), {**figures, **path_figures(motion)})


def _wait_until_out(rig: Rig, say: Say) -> None:
    """Wait until the robot is there, or has had time enough."""
    watch = RobotWatch(rig.setting.motion, LineCount(rig.setting.event_log).poll, rig.require, say, step_s=LIMIT_S)
    for now in watch.samples("in the maze", LIMIT_S):
        if rig.simulator.ask("goal") != "not yet" or now.world_s > WORLD_LIMIT_S:
            return


def path_figures(motion: Motion) -> dict[str, float]:
    """From the first motion to the goal, else to the end of the record: seconds of the world and of the clock."""
    begin = next((sample for sample in motion.samples if sample.linear_m_s or sample.angular_rad_s), None)
    reached = next((event for event in motion.happenings if event.happening == "goal"), None)
    if begin is None:
        return {"collisions": float(motion.samples[-1].collisions) if motion.samples else 0.0}
    end = reached or motion.samples[-1]
    world_s, wall_s = end.world_s - begin.world_s, end.time - begin.time
    way = [sample for sample in motion.samples if begin.world_s <= sample.world_s <= end.world_s]
    return {
        "world_s": world_s,
        "wall_s": wall_s,
        "speed": world_s / wall_s if wall_s > 0 else 0.0,
        "way_m": sum(abs(sample.linear_m_s) for sample in way) * (world_s / max(len(way), 1)),
        "collisions": float(motion.samples[-1].collisions),
    }
