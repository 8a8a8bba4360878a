"""`python -m robosc_simulated`: serve a simulated TurtleBot3 until interrupted.

A process of its own leaves the timing of a busy driver alone. It prints the ports, one a line, as `base PATH`,
`scanner PATH` and, where there is a camera, `camera PATH`; then it does what its standard input says, one command a
line (`help` lists them).
"""

import argparse
import contextlib
import signal
import sys
import threading
import time
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import FrameType

from robosc_bridge.configuration.document import MAXIMUM_BYTES, read_file
from robosc_bridge.configuration.problems import ConfigurationError
from robosc_simulated.commands import execute, obey_input
from robosc_simulated.error_monitor import ErrorMonitor
from robosc_simulated.floor import Track, oval, parse_track
from robosc_simulated.lidar import LIDARS
from robosc_simulated.motion import MotionRecorder
from robosc_simulated.output import Output
from robosc_simulated.profile import PROFILES, TYPICAL
from robosc_simulated.recorder import Recorder
from robosc_simulated.robots import BODIES
from robosc_simulated.scene import Scene, load_scene, maze_scene, scene_names
from robosc_simulated.scene_file import MOST_CELLS
from robosc_simulated.timebase import FASTEST
from robosc_simulated.turtlebot3 import BASES, SimulatedTurtleBot3
from robosc_simulated.values import (
    FARTHEST_M,
    angle,
    coordinate,
    number,
    number_tuple,
    option,
    seed,
    whole_number,
)
from robosc_simulated.walls import parse_walls, room

OVAL = "oval"
_POLL_S = 0.05


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command.

    Args:
        arguments: None: those of the process.

    Returns:
        The exit code: 0 when it was interrupted, 1 when it cannot be served, or something has gone wrong meanwhile.
    """
    options = _parser().parse_args(arguments)
    if options.list_scenes:
        print("\n".join(scene_names()))
        return 0
    # Not an event: who waits for one holds its lock now and then, and a handler that sets it then waits forever.
    received: list[int] = []

    def end(number: int, frame: FrameType | None) -> None:
        received.append(number)

    for which in (signal.SIGINT, signal.SIGTERM):
        signal.signal(which, end)
    errors = ErrorMonitor()
    try:
        with contextlib.ExitStack() as stack:
            stack.enter_context(errors)
            recorder = None
            if options.record is not None:
                recorder = Recorder(stack.enter_context(contextlib.closing(Output(options.record, errors.report))))
            motion = None
            if options.motion is not None:
                motion = stack.enter_context(contextlib.closing(Output(options.motion, errors.report)))
            robot = stack.enter_context(_robot(options, recorder))
            if motion is not None:
                stack.enter_context(contextlib.closing(MotionRecorder(robot.world, motion)))
            print(f"base {robot.base_path}")
            print(f"scanner {robot.scanner_path}")
            if robot.camera is not None:
                print(f"camera {robot.camera.path}")
            sys.stdout.flush()
            threading.Thread(target=obey_input, args=(partial(execute, robot),), name="commands", daemon=True).start()
            # Nor without end: a signal that comes just before a wait begins does not end it.
            while not received and not errors.has_crashed:
                time.sleep(_POLL_S)
                if (silence_s := robot.time.new_silence_s()) is not None:
                    print(_lag(silence_s, options.speed), file=sys.stderr, flush=True)
    except (OSError, ValueError) as error:
        print(f"the robot cannot be simulated: {error}", file=sys.stderr)
        return 1
    return errors.status


def _lag(silence_s: float, speed: float) -> str:
    """Return a warning: the robot has driven on while its host had no time."""
    return (
        f"the bridge was not heard for {silence_s:.1f} s of the world, in which the robot drove on: this computer has "
        f"too little time for --speed {speed:g}; choose a lower speed, or --wait 0.5, with which the world waits for it"
    )


def _robot(options: argparse.Namespace, recorder: Recorder | None) -> SimulatedTurtleBot3:
    scene = _scene(options)
    return SimulatedTurtleBot3(
        options.robot,
        options.base,
        options.lidar,
        scene=scene,
        factor=options.speed,
        pose=options.pose,
        base_link=options.base_link,
        scanner_link=options.scanner_link,
        seed=options.seed,
        noise_m=options.noise,
        camera_link=options.camera_link,
        recorder=recorder,
        patience_s=options.wait,
        profile=options.profile or scene.profile or TYPICAL.name,
    )


def _scene(options: argparse.Namespace) -> Scene:
    if options.scene is not None:
        if options.line is not None:
            raise ValueError("a scene has its own line: --line does not go with --scene")
        return load_scene(options.scene, options.seed)
    line = _track(options.line)
    if options.maze is not None:
        columns, rows = options.maze
        return replace(maze_scene(columns, rows, seed=options.seed), line=line)
    if options.walls is not None:
        return Scene("walls", parse_walls(_text(options.walls)), line=line)
    return Scene("room", room(*options.room), line=line)


def _text(path: Path) -> str:
    try:
        data = read_file(path)
    except ConfigurationError as error:
        raise ValueError(str(error)) from error
    if len(data) > MAXIMUM_BYTES:
        raise ValueError(f"{path}: is larger than {MAXIMUM_BYTES} bytes")
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError:
        raise ValueError(f"{path}: is not text in UTF-8") from None


def _track(name: str | None) -> Track | None:
    if name is None:
        return None
    return oval() if name == OVAL else parse_track(_text(Path(name)))


def _side(text: str) -> float:
    return number(text, 0.1, FARTHEST_M)


def _cells(text: str) -> int:
    return whole_number(text, 1, MOST_CELLS)


def _deviation(text: str) -> float:
    return number(text, 0.0, 1.0)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m robosc_simulated",
        description="Serve a simulated TurtleBot3 on two pseudo-terminals until interrupted.",
    )
    parser.add_argument(
        "--robot",
        default="burger",
        metavar="NAME|FILE",
        help=f"{', '.join(sorted(BODIES))}, or a YAML file of another one; default: %(default)s",
    )
    parser.add_argument("--base", choices=BASES, default="opencr", help="default: %(default)s")
    parser.add_argument("--lidar", choices=sorted(LIDARS), default="lds02", help="default: %(default)s")
    place = parser.add_mutually_exclusive_group()
    place.add_argument(
        "--scene", metavar="NAME|FILE", help=f"walls, line, goal, obstacles: {', '.join(scene_names())}, or a YAML file"
    )
    place.add_argument(
        "--room",
        type=option(number_tuple((_side, _side), "x")),
        default=(4.0, 3.0),
        metavar="XxY",
        help="a room in metres; default: 4x3",
    )
    place.add_argument(
        "--maze",
        type=option(number_tuple((_cells, _cells), "x")),
        metavar="COLUMNSxROWS",
        help="a maze of 1 m cells from the first to its exit",
    )
    place.add_argument("--walls", type=Path, metavar="FILE", help="walls from a file, `x1 y1 x2 y2` in metres a line")
    parser.add_argument(
        "--line",
        metavar="oval|FILE",
        help="a line on the floor, and a camera that sees it: an oval from the start, or `x y` in metres a line",
    )
    parser.add_argument(
        "--pose",
        type=option(number_tuple((coordinate, coordinate, angle), ",")),
        metavar="X,Y,HEADING",
        help="start, in m and rad; default: the scene's, else 0,0,0",
    )
    parser.add_argument(
        "--speed", type=float, default=1.0, metavar="N", help=f"the world passes N times as fast, up to {FASTEST:g}"
    )
    parser.add_argument(
        "--wait",
        type=float,
        metavar="S",
        help="the world waits for its host: no more than so many of its seconds pass after the last bytes from there",
    )
    parser.add_argument(
        "--noise",
        type=option(_deviation),
        metavar="M",
        help="standard deviation of the LiDAR in m; default: as the scene and the profile say",
    )
    parser.add_argument(
        "--profile",
        choices=sorted(PROFILES),
        help="how far lines, motors, battery and sensors are from ideal; default: the scene's, else typical",
    )
    parser.add_argument(
        "--seed", type=option(seed), default=0, metavar="N", help="of the maze and of all that comes by chance"
    )
    parser.add_argument("--base-link", type=Path, metavar="PATH", help="path of the base's port")
    parser.add_argument("--scanner-link", type=Path, metavar="PATH", help="path of the LiDAR's port")
    parser.add_argument("--camera-link", type=Path, metavar="PATH", help="path of the camera's socket")
    parser.add_argument(
        "--record", type=Path, metavar="FILE", help="write all bytes on both lines into a file, with their times"
    )
    parser.add_argument(
        "--motion", type=Path, metavar="FILE", help="write how the robot moves into a file (JSON Lines)"
    )
    parser.add_argument("--list-scenes", action="store_true", help="print the names of the scenes, and nothing else")
    return parser


if __name__ == "__main__":
    sys.exit(main())
