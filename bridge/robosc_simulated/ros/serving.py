"""The twin behind ROS, served until a signal: the part common to both versions of ROS.

Generated nodes live by the computer's clock, also where they take stamps from `/clock`. So the world follows that
clock, `--speed` times as fast; but where this process was late, the world waits: what nobody could see is not made up
for.
"""

import argparse
import contextlib
import signal
import sys
import threading
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import partial
from pathlib import Path
from types import FrameType
from typing import Protocol

from robosc.execution.runtime.clock import ManualClock
from robosc_simulated.commands import obey_input
from robosc_simulated.error_monitor import ErrorMonitor
from robosc_simulated.lidar import LIDARS
from robosc_simulated.motion import MotionRecorder
from robosc_simulated.output import Output
from robosc_simulated.profile import IDEAL, PROFILES, find_profile
from robosc_simulated.robots import BODIES
from robosc_simulated.ros.commands import execute
from robosc_simulated.ros.readings import Reading
from robosc_simulated.ros.robot import COMMAND_TIMEOUT_S, ENCODINGS, RosRobot
from robosc_simulated.scene import load_scene, scene_names
from robosc_simulated.timebase import FASTEST, Timebase
from robosc_simulated.values import number, option, seed
from robosc_simulated.world import World

READY = "ready"
"""Printed when the node is there and the world begins."""

# Time that this process did not get is not lived.
LONGEST_S = 0.05
# A velocity ends, and a signal is noticed, not much later than it is due.
_TICK_S = 0.02


class MissingRosError(Exception):
    """A ROS is not installed; one sentence that says what to do."""


class ServingError(Exception):
    """The twin cannot be served any longer; one sentence."""


class RosNode(Protocol):
    """The robot's node."""

    def publish(self, reading: Reading) -> None:
        """Send what the robot shows."""

    def process_commands(self, longest_s: float) -> None:
        """Obey velocities; comes back after some, or after so long at most.

        Raises:
            ServingError: The middleware has ended.
        """


class PacedClock(ManualClock):
    """A clock that is moved along the computer's, and keeps its wall clock."""

    def wall(self) -> float:
        """Seconds since 1970-01-01 UTC, by the computer."""
        return time.time()


class Pacer:
    """Lets a robot and its world live along the computer's clock.

    Args:
        robot: In a world on a `PacedClock`.
        monotonic: The computer's clock.

    Attributes:
        late_s: On the computer's clock: what was not lived because this process was late.
    """

    def __init__(self, robot: RosRobot, monotonic: Callable[[], float] = time.monotonic) -> None:
        self.late_s = 0.0
        self._robot = robot
        self._time = robot.world.time
        self._monotonic = monotonic
        self._then_s = monotonic()

    def begin(self) -> None:
        """Time passes from now on."""
        self._then_s = self._monotonic()

    def catch_up(self) -> None:
        """Live until now."""
        now_s = self._monotonic()
        passed_s = now_s - self._then_s
        self._then_s = now_s
        lived_s = min(passed_s, LONGEST_S)
        self.late_s += passed_s - lived_s
        self._robot.advance(lived_s)

    def until_s(self, world_s: float) -> float:
        """Return the time on the computer's clock until the world's time is `world_s`, in seconds."""
        return (world_s - self._time.world_s()) / self._time.factor - (self._monotonic() - self._then_s)


MakeNode = Callable[[RosRobot, Pacer, threading.Event], AbstractContextManager[RosNode]]
"""Opens the node of a robot; the node ends when the event is set."""


def serve(options: argparse.Namespace, make_face: MakeNode) -> int:
    """Serve a twin until it is interrupted.

    Args:
        options: As `parser` reads them.
        make_face: Opens its node.

    Returns:
        The exit code: 0 when it was interrupted, 1 when it cannot be served, or something has gone wrong meanwhile.
    """
    ended = threading.Event()

    def end(number: int, frame: FrameType | None) -> None:
        ended.set()

    for which in (signal.SIGINT, signal.SIGTERM):
        signal.signal(which, end)
    errors = ErrorMonitor()
    try:
        with contextlib.ExitStack() as stack:
            stack.enter_context(errors)
            robot, pacer = make_robot(options)
            if options.motion is not None:
                stream = stack.enter_context(contextlib.closing(Output(options.motion, errors.report)))
                stack.enter_context(contextlib.closing(MotionRecorder(robot.world, stream)))
            node = stack.enter_context(make_face(robot, pacer, ended))
            print(READY, flush=True)
            threading.Thread(target=obey_input, args=(partial(execute, robot),), name="commands", daemon=True).start()
            run(robot, pacer, node, lambda: ended.is_set() or errors.has_crashed)
    except (MissingRosError, ServingError, OSError, ValueError) as error:
        print(f"the robot cannot be simulated: {error}", file=sys.stderr)
        return 1
    return errors.status


def run(robot: RosRobot, pacer: Pacer, node: RosNode, should_end: Callable[[], bool]) -> None:
    """Let the world go on and show it.

    Args:
        robot: Robot in the world.
        pacer: Pacer of its time.
        node: Its node.
        should_end: Function that returns True to end.
    """
    pacer.begin()
    while not should_end():
        pacer.catch_up()
        for reading in robot.update():
            node.publish(reading)
        node.process_commands(min(max(pacer.until_s(robot.due_s), 0.0), _TICK_S))


def make_robot(options: argparse.Namespace) -> tuple[RosRobot, Pacer]:
    """The robot of the options, in its scene.

    Raises:
        ValueError: There is no such scene, or something in it is wrong, or the speed is no positive number.
    """
    scene = load_scene(options.scene, options.seed)
    profile = find_profile(options.profile or scene.profile or IDEAL.name)
    time = Timebase(PacedClock(), options.speed)
    world = World(BODIES[options.robot], scene, time, seed=options.seed, profile=profile)
    robot = RosRobot(
        world,
        lidar=options.lidar,
        encoding=options.encoding,
        command_timeout_s=options.command_timeout,
        patience_s=options.wait,
        seed=options.seed,
    )
    return robot, Pacer(robot)


def parser(prog: str, description: str) -> argparse.ArgumentParser:
    """Return the parser of the arguments that both commands understand.

    Args:
        prog: The command.
        description: Description of what it does.
    """
    # Options of the same names as for serial lines have other choices, defaults and words there.
    found = argparse.ArgumentParser(prog=prog, description=description)
    found.add_argument(
        "--scene",
        default="room",
        metavar="NAME|FILE",
        help=f"one of {', '.join(scene_names())}, or a scene file; default: %(default)s",
    )
    found.add_argument("--robot", choices=sorted(BODIES), default="burger", help="default: %(default)s")
    found.add_argument(
        "--lidar",
        choices=sorted(LIDARS),
        default="lds01",
        help="LiDAR: its range, revolutions and beams; default: %(default)s",
    )
    found.add_argument(
        "--encoding", choices=ENCODINGS, default="mono8", help="of the camera's pictures; default: %(default)s"
    )
    found.add_argument(
        "--speed", type=float, default=1.0, metavar="N", help=f"the world passes N times as fast, up to {FASTEST:g}"
    )
    found.add_argument(
        "--profile",
        choices=sorted(PROFILES),
        help="how far wheels and noise are from ideal; default: the scene's, else ideal",
    )
    found.add_argument(
        "--seed", type=option(seed), default=0, metavar="N", help="of whatever the scene leaves to chance, and of noise"
    )
    found.add_argument(
        "--command-timeout",
        type=option(lambda text: number(text, 0.0, 3600.0)),
        default=COMMAND_TIMEOUT_S,
        metavar="S",
        help="time that a velocity holds, on the computer's clock; 0: for ever; default: %(default)s",
    )
    found.add_argument(
        "--wait",
        type=float,
        metavar="S",
        help="in motion, the world waits for the next velocity S seconds of its own after the last one",
    )
    found.add_argument("--motion", type=Path, metavar="FILE", help="write down how the robot moves (JSON Lines)")
    return found
