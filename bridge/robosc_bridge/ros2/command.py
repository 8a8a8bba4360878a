"""`robosc-bridge ros2`: publish a bridge's measurements as a ROS 2 node, until it is interrupted."""

import argparse
import math
import signal
import sys
import threading
import time
import traceback
from collections.abc import Sequence
from typing import Any

from robosc_api.security import credentials_of
from robosc_bridge.ros2.frames import Frames, Place
from robosc_bridge.terminal.commands import DONE, REFUSED, WRONG, add_connection_arguments, run_alone

NAME = "ros2"
"""Name of the command."""

FAILED = REFUSED
"""Exit status after ROS 2 has failed."""

RATE_HZ, LEAST_RATE_HZ, MOST_RATE_HZ = 30.0, 1.0, 100.0
"""Looks a second, by default and within bounds; the bridge shows up to 20 readings a second, and every scan."""

REPORT_S = 1.0
"""Time between two messages of diagnostics; a change is reported at once."""

RETRY_S = 1.0
"""Time until a bridge that does not answer is asked again."""

_LOOK_S = 0.1
_END_S = 5.0
_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)

_EPILOG = (
    "It publishes odom, joint_states, imu, battery_state, scan, /tf, /tf_static and /diagnostics, and takes no "
    "velocities: the supervisor keeps command of the wheels. Arguments after --ros-args are passed to ROS, such as "
    "`--ros-args -r odom:=wheels/odometry`. exit status: 0 a signal ended it; 1 the bridge refuses, or ROS 2 has "
    "failed; 2 wrong use, no ROS 2, or a bridge of an earlier version"
)


def add_command(commands: Any) -> None:
    """Add the command to subparsers of argparse."""
    parser = commands.add_parser(
        NAME, help="publish odometry, scans and diagnostics of a bridge as a ROS 2 node", epilog=_EPILOG
    )
    frames = Frames()
    parser.add_argument("--namespace", default="", metavar="NAME", help="namespace of the topics, such as robot1")
    parser.add_argument(
        "--rate",
        type=_rate,
        default=RATE_HZ,
        metavar="HZ",
        help=f"most messages a second on a topic, {LEAST_RATE_HZ:g} to {MOST_RATE_HZ:g} (default: %(default)g)",
    )
    group = parser.add_argument_group("frames")
    group.add_argument(
        "--frame-prefix", default=frames.prefix, metavar="TEXT", help="text before each frame, such as robot1/"
    )
    for name in ("odom", "base", "scan", "imu"):
        group.add_argument(
            f"--{name}-frame", default=getattr(frames, name), metavar="NAME", help="frame (default: %(default)s)"
        )
    group.add_argument(
        "--scan-at",
        nargs=3,
        type=_metres,
        metavar=("X", "Y", "Z"),
        help="place of the LiDAR in base_link, in metres (default: as the TurtleBot3 has it)",
    )
    group.add_argument("--no-tf", action="store_true", help="send no transforms, as where another node fuses odometry")
    group.add_argument(
        "--no-static-tf",
        action="store_true",
        help="send the odometry's transform alone, as where robot_state_publisher sends those of the parts",
    )
    add_connection_arguments(parser)
    parser.add_argument(
        "--ros-args", nargs=argparse.REMAINDER, default=[], metavar="...", help="arguments for ROS 2; they come last"
    )
    parser.set_defaults(run=_run)


def main(argv: Sequence[str] | None = None) -> int:
    """Run only this command; returns the exit status."""
    return run_alone(add_command, __doc__, argv)


def _rate(text: str) -> float:
    number = float(text)
    if not LEAST_RATE_HZ <= number <= MOST_RATE_HZ:
        raise argparse.ArgumentTypeError(f"a number from {LEAST_RATE_HZ:g} to {MOST_RATE_HZ:g} is needed")
    return number


def _metres(text: str) -> float:
    number = float(text)
    if not math.isfinite(number) or abs(number) > 10.0:
        raise argparse.ArgumentTypeError("a number of metres from -10 to 10 is needed")
    return number


# Name that argparse uses in "invalid ... value".
_rate.__name__ = _metres.__name__ = "number"


def _run(arguments: argparse.Namespace) -> int:
    # Threads that are started from here on leave signals to this one, which waits for them. Imports start some, too:
    # a single thread that does not block them would end the program whenever this one is busy.
    before = signal.pthread_sigmask(signal.SIG_BLOCK, _SIGNALS)
    try:
        return _run_node(arguments)
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _run_node(arguments: argparse.Namespace) -> int:
    # gRPC and rclpy are imported where they are needed: help and wrong use are reported at once.
    from robosc_bridge.ros2.node import BridgeNode, MissingRosError, NodeError
    from robosc_bridge.ros2.relay import Relay
    from robosc_bridge.terminal.client import BridgeClient, UnreachableError

    frames = Frames(
        arguments.odom_frame,
        arguments.base_frame,
        arguments.scan_frame,
        arguments.imu_frame,
        arguments.frame_prefix,
    )
    scan = Place(*arguments.scan_at) if arguments.scan_at else None
    try:
        # Files that cannot be used are reported before anything is tried again and again.
        BridgeClient(arguments.address, credentials_of(arguments)).close()
        with BridgeNode(
            frames,
            scan,
            arguments.namespace,
            sends_odom_tf=not arguments.no_tf,
            sends_static_tf=not (arguments.no_tf or arguments.no_static_tf),
            arguments=arguments.ros_args,
        ) as node:
            return _publish(arguments, Relay(arguments.address, node))
    except (MissingRosError, NodeError, UnreachableError) as error:
        _say(str(error))
        return WRONG


def _publish(arguments: argparse.Namespace, relay: Any) -> int:
    """Until a signal comes, or the bridge can never be followed."""
    follower = _Follower(arguments, relay)
    follower.start()
    due_s = -math.inf
    try:
        while follower.status is None:
            if follower.take_news() or time.monotonic() >= due_s:
                relay.report()
                due_s = time.monotonic() + REPORT_S
            if signal.sigtimedwait(_SIGNALS, _LOOK_S) is not None:
                return DONE
        return follower.status
    finally:
        follower.close()


class _Follower:
    """Follows a bridge in a thread of its own, and finds it again.

    Attributes:
        status: Exit status of the command, once it makes no sense to go on; None: it goes on.
    """

    def __init__(self, arguments: argparse.Namespace, relay: Any) -> None:
        self.status: int | None = None
        self._address = arguments.address
        self._credentials = credentials_of(arguments)
        self._rate_hz = arguments.rate
        self._relay = relay
        self._over = threading.Event()
        self._news = threading.Event()
        self._client: Any = None
        self._reported = ""
        self._was_there = False
        self._thread = threading.Thread(target=self._run, name="ros2 follows", daemon=True)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def take_news(self) -> bool:
        """Return True if the bridge has come or gone since the last look."""
        has_news = self._news.is_set()
        self._news.clear()
        return has_news

    def close(self) -> None:
        """End it."""
        self._over.set()
        client = self._client
        if client is not None:
            client.close()
        self._thread.join(_END_S)

    def _run(self) -> None:
        from robosc_bridge.ros2.node import NodeError
        from robosc_bridge.ros2.relay import EarlierBridgeError
        from robosc_bridge.terminal.client import RefusedError, UnreachableError

        while not self._over.is_set():
            try:
                self._follow()
                why = f"the bridge at {self._address} has ended the stream"
            except UnreachableError as error:
                why = str(error)
            except RefusedError as error:
                why = str(error)
                if not self._was_there:
                    self._give_up(why, REFUSED)
                    return
            except (NodeError, EarlierBridgeError) as error:
                self._give_up(str(error), WRONG)
                return
            except Exception as error:
                # A thread that ended without a word would look like a robot that stands still.
                traceback.print_exc()
                self._give_up(f"publishing failed: {type(error).__name__}: {error}", FAILED)
                return
            if not self._over.is_set():
                self._relay.lose(why)
                self._report(why)
                self._over.wait(RETRY_S)

    def _follow(self) -> None:
        """Until the stream ends."""
        from robosc_bridge.terminal.client import BridgeClient

        with BridgeClient(self._address, self._credentials) as client:
            self._client = client
            definition = client.definition()
            self._relay.connect(definition)
            self._was_there = True
            self._report(f"publishes what the bridge of {definition.robot} at {self._address} measures")
            for response in client.watch(with_scans=True, with_events=False, rate_hz=self._rate_hz):
                if self._over.is_set():
                    return
                self._relay.take(response)

    def _report(self, text: str) -> None:
        # A bridge that is away is asked each second, but reported once.
        if text != self._reported:
            self._reported = text
            _say(text)
        self._news.set()

    def _give_up(self, why: str, status: int) -> None:
        _say(why)
        self.status = status


def _say(text: str) -> None:
    one_line = " ".join("".join(sign if sign.isprintable() else " " for sign in text).split())
    sys.stderr.write(f"robosc-bridge: {one_line}\n")
