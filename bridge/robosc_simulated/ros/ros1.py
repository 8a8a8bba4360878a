"""`python -m robosc_simulated.ros.ros1`: the twin as a ROS 1 node.

rospy lives under the Python that ROS 1 was installed for, and RoboSC's bridge under a newer one. So the world is in
this process, and a second one, `rospy_side`, speaks ROS; frames go over pipes between them. A second process costs a
copy of each message, which a scan or a small picture does not feel.
"""

import argparse
import contextlib
import os
import select
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from types import TracebackType
from typing import IO, Any, Self, cast

from robosc_simulated.ros.readings import (
    CAMERA,
    FOOTPRINT,
    ODOM,
    SCANNER,
    Battery,
    Clock,
    Odometry,
    Picture,
    Reading,
    Scan,
)
from robosc_simulated.ros.robot import RosRobot
from robosc_simulated.ros.rospy_side.frames import Decoder, Frame, FrameError, encode
from robosc_simulated.ros.serving import MissingRosError, Pacer, ServingError, parser, serve

NODE = "turtlebot3_twin"
PYTHON = "/usr/bin/python3"
END_S = 3.0
MOST_WAITING = 8 * 1024 * 1024
_CHUNK = 65536
_STEP_S = 0.1
_SIDE = Path(__file__).parent / "rospy_side"


class RospySide:
    """The process that speaks ROS 1; use it as a context manager.

    Args:
        python: Its interpreter.
        module: Module that it runs, importable from its folder.
        names: Other names as rospy takes them, such as `__name:=robot` or `/scan:=/front/scan`.

    Attributes:
        dropped: Frames that were not sent because it does not take them.

    Raises:
        MissingRosError: There is no such interpreter.
    """

    def __init__(self, python: str = PYTHON, module: Path = _SIDE, names: Sequence[str] = ()) -> None:
        self.dropped = 0
        try:
            self._process = subprocess.Popen(  # noqa: S603 (the interpreter that the user names)
                [python, "-m", module.name, *names],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                env=_environment(module.parent),
                # Ctrl-C is ours: it ends when its input does.
                start_new_session=True,
            )
        except OSError as error:
            raise MissingRosError(f"there is no Python of ROS 1 at {python}: {error.strerror}") from error
        # Both are pipes, as it was asked for.
        self._stdin, self._stdout = cast(IO[bytes], self._process.stdin), cast(IO[bytes], self._process.stdout)
        self._to, self._from = self._stdin.fileno(), self._stdout.fileno()
        os.set_blocking(self._to, False)
        os.set_blocking(self._from, False)
        self._waiting: deque[bytes] = deque()
        self._waiting_size = 0
        self._decoder = Decoder()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for stream in (self._stdin, self._stdout):
            with contextlib.suppress(OSError):
                stream.close()
        try:
            self._process.wait(END_S)
        except subprocess.TimeoutExpired:
            # It waits for a master.
            self._process.kill()
            self._process.wait()

    def send(self, head: Mapping[str, Any], data: bytes = b"") -> None:
        """Send a frame as soon as it is taken; one for which there is no room is dropped as a whole."""
        frame = encode(dict(head), data)
        if self._waiting_size + len(frame) > MOST_WAITING:
            self.dropped += 1
            return
        self._waiting.append(frame)
        self._waiting_size += len(frame)
        self._flush()

    def _flush(self) -> None:
        while self._waiting:
            frame = self._waiting.popleft()
            self._waiting_size -= len(frame)
            try:
                written = os.write(self._to, frame)
            except BlockingIOError:
                written = 0
            except BrokenPipeError:
                # The end of the process is reported by `receive`.
                self._waiting.clear()
                self._waiting_size = 0
                return
            if written < len(frame):
                self._waiting.appendleft(frame[written:])
                self._waiting_size += len(frame) - written
                return

    def receive(self, longest_s: float) -> list[Frame]:
        """Return the frames that it sends: as soon as the first comes, or after `longest_s` at most.

        Raises:
            ServingError: It has ended, or what it says cannot be read.
        """
        poll = select.poll()
        poll.register(self._from, select.POLLIN)
        if self._waiting:
            poll.register(self._to, select.POLLOUT)
        ready = dict(poll.poll(max(longest_s, 0.0) * 1000))
        if self._to in ready:
            self._flush()
        if self._from not in ready:
            return []
        data = os.read(self._from, _CHUNK)
        if not data:
            status = self._process.wait(END_S)
            raise ServingError(f"its rospy side has ended with status {status}")
        try:
            return list(self._decoder.feed(data))
        except FrameError as error:
            raise ServingError(f"its rospy side cannot be understood: {error}") from error


def plain_environment(variables: Mapping[str, str] | None = None) -> dict[str, str]:
    """The environment of programs of another Python: without what is of this one.

    Args:
        variables: With it; None: those of this process.
    """
    found = dict(os.environ if variables is None else variables)
    # The wheels of ROS 2 set these variables for themselves.
    if found.pop("_ROS_WHEELS_BOOTSTRAP_COMPLETE", None) is not None:
        found.pop("LD_LIBRARY_PATH", None)
    own = (Path(sys.prefix), Path(sys.base_prefix))
    paths = [path for path in found.pop("PYTHONPATH", "").split(os.pathsep) if path]
    if kept := [path for path in paths if not any(Path(path).is_relative_to(each) for each in own)]:
        found["PYTHONPATH"] = os.pathsep.join(kept)
    return found


def _environment(folder: Path) -> dict[str, str]:
    found = plain_environment()
    found["PYTHONPATH"] = os.pathsep.join(filter(None, (str(folder), found.get("PYTHONPATH", ""))))
    return found


class Ros1Node:
    """The node, as the twin sees it.

    Args:
        robot: Robot that it shows.
        pacer: Pacer that brings the world up to now before a velocity acts.
        side: Process that speaks ROS.
        is_stamped: True if velocities come as `TwistStamped`.
        is_sim_time: True if the parameter `use_sim_time` is set, so that the other nodes take their time from `/clock`.
        should_end: Function that returns True to wait no longer for a master.

    Raises:
        MissingRosError: rospy or its messages are not installed.
        ServingError: The other side has ended.
    """

    def __init__(
        self,
        robot: RosRobot,
        pacer: Pacer,
        side: RospySide,
        *,
        is_stamped: bool = False,
        is_sim_time: bool = False,
        should_end: Callable[[], bool],
    ) -> None:
        self._robot = robot
        self._pacer = pacer
        self._side = side
        self._is_ready = False
        side.send(
            {
                "kind": "begin",
                "name": NODE,
                "stamped": is_stamped,
                "sim_time": is_sim_time,
                "frames": [asdict(frame) for frame in robot.frames],
            }
        )
        while not self._is_ready and not should_end():
            self.process_commands(_STEP_S)

    def process_commands(self, longest_s: float) -> None:
        """Obey velocities; comes back after some, or after so long at most."""
        for frame in self._side.receive(longest_s):
            match frame.head:
                case {"kind": "velocity", "linear_m_s": float(linear_m_s), "angular_rad_s": float(angular_rad_s)}:
                    self._pacer.catch_up()
                    self._robot.command(linear_m_s, angular_rad_s)
                case {"kind": "ready"}:
                    self._is_ready = True
                case {"kind": "warning", "text": str(text)}:
                    print(f"warning: {text}", file=sys.stderr)
                case {"kind": "missing", "text": str(text)}:
                    raise MissingRosError(f"ROS 1 is not there ({text}): it needs rospy and its messages")
                case _:
                    raise ServingError(f"its rospy side says {frame.head['kind']!r}, which is not known")

    def publish(self, reading: Reading) -> None:
        """Send what the robot shows."""
        stamp = {"stamp_s": reading.stamp_s}
        match reading:
            case Clock():
                self._side.send({"kind": "clock", **stamp})
            case Scan():
                head = {
                    "kind": "scan",
                    "frame": SCANNER,
                    "count": len(reading.ranges_m),
                    "turn_s": reading.revolution_s,
                    "nearest_m": reading.nearest_m,
                    "farthest_m": reading.farthest_m,
                }
                self._side.send({**head, **stamp}, reading.ranges_m.astype("<f4").tobytes())
            case Odometry():
                self._side.send({"kind": "odometry", "frame": ODOM, "child": FOOTPRINT, **asdict(reading)})
            case Picture():
                head = {
                    "kind": "picture",
                    "frame": CAMERA,
                    "encoding": reading.encoding,
                    "width": reading.width,
                    "height": reading.height,
                }
                self._side.send({**head, **stamp}, reading.data)
            case Battery():
                self._side.send({"kind": "battery", "voltage_v": reading.voltage_v, **stamp})


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command.

    Args:
        arguments: None: those of the process.

    Returns:
        The exit code: 0 when it was interrupted, 1 when it cannot be served.
    """
    given = sys.argv[1:] if arguments is None else arguments
    # Remappings are given to every node of ROS 1, also by roslaunch.
    names = [word for word in given if ":=" in word]
    options = _parser().parse_args([word for word in given if ":=" not in word])

    @contextlib.contextmanager
    def node(robot: RosRobot, pacer: Pacer, ended: threading.Event) -> Any:
        with RospySide(options.python, names=names) as side:
            yield Ros1Node(
                robot,
                pacer,
                side,
                is_stamped=options.stamped,
                is_sim_time=options.sim_time,
                should_end=ended.is_set,
            )

    return serve(options, node)


def _parser() -> argparse.ArgumentParser:
    found = parser(
        "python -m robosc_simulated.ros.ros1",
        "Serve a simulated TurtleBot3 as a ROS 1 node until interrupted. It sends /scan, /odom, /battery_state, "
        "/clock, /tf and, where there is a line, /camera/image_raw, and obeys /cmd_vel. What has `:=` in it is a name "
        "for rospy, such as /scan:=/front/scan.",
    )
    found.add_argument(
        "--stamped", action="store_true", help="velocities come as geometry_msgs/TwistStamped, not as Twist"
    )
    found.add_argument(
        "--sim-time", action="store_true", help="set the parameter /use_sim_time: nodes started later live by /clock"
    )
    found.add_argument("--python", default=PYTHON, metavar="FILE", help="that has rospy; default: %(default)s")
    return found


if __name__ == "__main__":
    sys.exit(main())
