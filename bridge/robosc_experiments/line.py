"""The line follower: a supervision layer around an existing follower that heeds neither obstacles nor the stop button.

The robot drives along a line; a box is put on it and taken away again, the stop button on the robot is pressed, and an
operator stops it from elsewhere. Each time it must stand still until that has ended, while its follower goes on asking.
"""

import math
import time
from pathlib import Path

from robosc.model.structure import Deployment
from robosc_api.security import Credentials
from robosc_bridge.terminal.client import BridgeClient, RefusedError, RequestedCommand, UnreachableError
from robosc_experiments.processes import Program, finish
from robosc_experiments.scenario import Outcome, Say, ScenarioError
from robosc_experiments.serial import EXAMPLES, Rig, Setting, running, scene_of
from robosc_experiments.tail import LineCount
from robosc_experiments.watch import RobotWatch
from robosc_simulated.motion import Motion
from robosc_simulated.motion_checks import check_line
from robosc_simulated.scene import Scene

MODEL = EXAMPLES / "line_follower" / "line_follower_layer.rscd"
SCENES = ("line-oval", "line-curves")
"""The lines that come with the package; there is a box in each that can be put on it."""

CHANNELS = {
    "/scan": "{channel: scanner}",
    "/line/correction": "{channel: line}",
    "/line/lost": "{channel: line_lost}",
    "/emergency_stop/stop": "{channel: emergency_stop, event: stop}",
    "/emergency_stop/resume": "{channel: emergency_stop, event: resume}",
    "/cmd_vel": "{channel: drive}",
}
_PRESSED_S = 0.3
SKILLS = {"emergency_stop": "stop_buttons: [button_1], resume_buttons: [button_2]", "line": "timeout_s: 0.5"}

BOX = "box"
LIMIT_S = 45.0
"""For each thing that happens."""


def run_line(folder: Path, scene: str | Path, *, speed: float, say: Say, seed: int = 0) -> Outcome:
    """Let a robot follow a line behind a supervision layer, over serial lines.

    Args:
        folder: Folder that everything is written to; empty, or not there yet.
        scene: Name or file of a scene with a line and an obstacle called `box`.
        speed: Speed of the world, as a multiple of the clock's. The camera shows 20 pictures a second of the clock.
        say: Function that takes lines of progress.
        seed: Seed of what the scene leaves to chance.

    Raises:
        ScenarioError: It could not be run to its end. A robot that moves when it must not is no such error, but a
            fault of the outcome.
    """
    place = scene_of(scene, seed)
    if place.line is None or BOX not in {each.name for each in place.obstacles}:
        raise ScenarioError(f"the scene {place.name} needs a line, and an obstacle called {BOX}")
    setting = Setting(folder.resolve(), MODEL, Deployment.LAYER, place, scene, seed, speed, "lds02", CHANNELS, SKILLS)
    say("starting the synthesis server, the simulated robot, the bridge and the follower")
    with running(setting) as rig:
        follower = Program("follower", ("-m", "robosc_experiments.follower", "--address", rig.address), folder)
        with follower:

            def check() -> None:
                rig.require()
                follower.require()

            watch = RobotWatch(setting.motion, LineCount(setting.event_log).poll, check, say, step_s=LIMIT_S)
            try:
                _play(rig, watch)
            except (RefusedError, UnreachableError) as error:
                raise ScenarioError(f"the operator is not heard: {error}") from error
            finish(follower)
            figures = rig.finish()
            asked = follower.wait_for(r"^asked (\d+) times, blocked (\d+) times$")
    motion = setting.read_motion()
    faults = (*watch.faults, *check_line(place, motion, watch.halts))
    counts = {"asked": float(asked[1]), "blocked": float(asked[2])}
    return setting.outcome("line", "serial", faults, {**figures, **line_figures(place, motion), **counts})


def _play(rig: Rig, watch: RobotWatch) -> None:
    """Let the events happen to the robot, one after the other; after the first fault, nothing is waited for."""
    send = rig.simulator.send
    with BridgeClient(rig.address, Credentials()) as operator:
        watch.drive("along the line")
        send(f"obstacle {BOX} back")
        watch.stand("for the box on the line", lambda: send(f"obstacle {BOX} away"), is_commanded=False)
        watch.drive("without the box")
        _click(rig, "button_1")
        watch.stand("after the stop button", lambda: _click(rig, "button_2"))
        watch.drive("after the other button")
        operator.stop()
        watch.stand("after the operator's stop", lambda: operator.request(RequestedCommand.RESUME))
        watch.drive("when the operator lets it go on")


def _click(rig: Rig, button: str) -> None:
    """Press a button and let it go: held for three seconds, it lets OpenCR drive by itself."""
    rig.simulator.send(f"press {button}")
    time.sleep(_PRESSED_S)
    rig.simulator.send(f"let {button}")


def line_figures(scene: Scene, motion: Motion) -> dict[str, float]:
    """Return how far off the line the middle between the wheels was, and for how long of the world."""
    if scene.line is None or not motion.samples:
        return {}
    aside_m = [scene.line.distance_m(sample.x_m, sample.y_m) for sample in motion.samples if sample.linear_m_s]
    first, last = motion.samples[0], motion.samples[-1]
    return {
        "world_s": last.world_s - first.world_s,
        "wall_s": last.time - first.time,
        "aside_most_m": max(aside_m, default=0.0),
        "aside_rms_m": math.sqrt(sum(each * each for each in aside_m) / max(len(aside_m), 1)),
        "collisions": float(last.collisions),
    }
