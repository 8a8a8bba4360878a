"""The line follower: a supervision layer around an existing follower that heeds neither obstacles nor the stop button.

The robot drives along a line; a box is put on it and taken away again, the stop button on the robot is pressed, and an
operator stops it from elsewhere. Each time it must stand still until that has ended, while its follower goes on asking.
"""

import math
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

from robosc.model.structure import Deployment
from robosc_api.security import Credentials
from robosc_bridge.terminal.client import BridgeClient, RefusedError, RequestedCommand, UnreachableError
from robosc_experiments.processes import Program, finish
from robosc_experiments.scenario import Outcome, Say, ScenarioError
from robosc_experiments.serial import EXAMPLES, Rig, Setting, running, scene_of
from robosc_experiments.tail import LineCount, MotionState, latest
from robosc_simulated.motion import Motion
from robosc_simulated.motion_checks import Halt, check_line
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
SKILLS = {"emergency_stop": "stop_buttons: [button_1], resume_buttons: [button_2]", "line": "timeout_s: 0.5"}

BOX = "box"
FREE_M = 0.6
"""Distance that it drives along the line before anything happens, and in between, in metres."""

HELD_S = 2.0
"""Time of the world for which it must stand still then, in seconds."""

LIMIT_S = 45.0
"""For each thing that happens."""

_LOOK_S = 0.01


def run_line(folder: Path, scene: str | Path, *, speed: float, say: Say, seed: int = 0, model: Path = MODEL) -> Outcome:
    """Let a robot follow a line behind a supervision layer, over serial lines.

    Args:
        folder: Folder that everything is written to; empty, or not there yet.
        scene: Name or file of a scene with a line and an obstacle called `box`.
        speed: Speed of the world, as a multiple of the clock's. The camera shows 20 pictures a second of the clock.
        say: Function that takes lines of progress.
        seed: Seed of what the scene leaves to chance.
        model: Another one, with the communications of `line_follower_layer.rscd`.

    Raises:
        ScenarioError: It could not be run to its end. A robot that moves when it must not is no such error, but a
            fault of the outcome.
    """
    place = scene_of(scene, seed)
    if place.line is None or BOX not in {each.name for each in place.obstacles}:
        raise ScenarioError(f"the scene {place.name} needs a line, and an obstacle called {BOX}")
    setting = Setting(
        folder.resolve(), model.resolve(), Deployment.LAYER, place, scene, seed, speed, "lds02", CHANNELS, SKILLS
    )
    say("starting the synthesis server, the simulated robot, the bridge and the follower")
    with running(setting) as rig:
        follower = Program("follower", ("-m", "robosc_experiments.follower", "--address", rig.address), folder)
        with follower:
            play = _Scenario(rig, follower, say)
            try:
                play.play()
            except (RefusedError, UnreachableError) as error:
                raise ScenarioError(f"the operator is not heard: {error}") from error
            finish(follower)
            figures = rig.finish()
            asked = follower.wait_for(r"^asked (\d+) times, blocked (\d+) times$")
    motion = setting.read_motion()
    faults = (*play.faults, *check_line(place, motion, play.halts))
    told = {"asked": float(asked[1]), "blocked": float(asked[2])}
    return setting.outcome("line", "serial", faults, {**figures, **line_figures(place, motion), **told})


class _Scenario:
    """Events that happen to the robot, one after the other.

    Attributes:
        halts: Times when it had to stand still.
        faults: Things that it should have done, and did not within the time that it had.
    """

    def __init__(self, rig: Rig, follower: Program, say: Say) -> None:
        self.halts: list[Halt] = []
        self.faults: list[str] = []
        self._rig = rig
        self._follower = follower
        self._say = say
        self._events = LineCount(rig.setting.event_log)
        self._begin_s = time.monotonic()
        self._what = ""

    def play(self) -> None:
        """All of it; it ends early with the first fault."""
        tell = self._rig.simulator.tell
        with BridgeClient(self._rig.address, Credentials()) as operator, suppress(_TooLateError):
            self._drive("along the line")
            tell(f"obstacle {BOX} back")
            self._stand("for the box on the line", lambda: tell(f"obstacle {BOX} away"), is_at_once=False)
            self._drive("without the box")
            tell("press button_1")
            self._stand("after the stop button", lambda: (tell("let button_1"), tell("press button_2")))
            self._drive("after the other button")
            tell("let button_2")
            operator.stop()
            self._stand("after the operator's stop", lambda: operator.request(RequestedCommand.RESUME))
            self._drive("when the operator lets it go on")

    def _drive(self, what: str) -> None:
        """Until it has driven some way."""
        now = latest(self._rig.setting.motion)
        driven_m = 0.0
        for after in self._looks(f"did not drive {what}", what):
            driven_m += math.dist((now.x_m, now.y_m), (after.x_m, after.y_m))
            now = after
            if driven_m >= FREE_M:
                return

    def _stand(self, what: str, release: Callable[[], object], *, is_at_once: bool = True) -> None:
        """Wait until it has stood still for a while; then it may go on.

        Args:
            what: Reason why it stands.
            release: Function that lets it go on.
            is_at_once: True if it has to stand from now on; else from when it does.
        """
        told_s = latest(self._rig.setting.motion).world_s
        begin_s: float | None = None
        for now in self._looks(f"did not stand still {what}", f"stands {what}"):
            if not now.is_standing:
                begin_s = None
            elif begin_s is None:
                begin_s = now.world_s
            elif now.world_s - begin_s >= HELD_S:
                self.halts.append(Halt(told_s if is_at_once else begin_s, now.world_s, what))
                release()
                return

    def _looks(self, fault: str, what: str) -> Iterator[MotionState]:
        """Yield the state of the robot again and again; if that takes too long, it is a fault."""
        end_s = time.monotonic() + LIMIT_S
        while time.monotonic() < end_s:
            self._rig.require()
            self._follower.require()
            now = latest(self._rig.setting.motion)
            self._say(
                f"{what}: x {now.x_m:+.2f} m  y {now.y_m:+.2f} m  {self._events.poll()} events  "
                f"{now.world_s:.1f} s of the world in {time.monotonic() - self._begin_s:.1f} s"
            )
            yield now
            time.sleep(_LOOK_S)
        self.faults.append(f"the robot {fault} within {LIMIT_S:g} s")
        raise _TooLateError


class _TooLateError(Exception):
    """Error that an expected event did not happen."""


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
