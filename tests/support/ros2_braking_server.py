"""A process with a drive that does not stand at once when its goal is cancelled; it logs when its wheels turn.

Usage: python ros2_braking_server.py KIND FILE, where KIND says what a cancel brings about (`SERVERS` of
support.loaders) and FILE gets a line of JSON for each thing that the robot does.
"""

import json
import os
import signal
import sys
import threading
import time
from pathlib import Path
from typing import Any

import rclpy
from rclpy.action import ActionServer, CancelResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from std_srvs.srv import SetBool
from test_msgs.action import Fibonacci

BRAKING_S = {"brakes": 1.5, "succeeds": 1.0}
REFUSED_S = 3.0


class Robot:
    """The drive and the arm."""

    def __init__(self, kind: str, file: Path) -> None:
        self._kind = kind
        self._file = file
        self._is_over = threading.Event()
        self.node = rclpy.create_node("loader")
        group = ReentrantCallbackGroup()
        self.server = ActionServer(
            self.node, Fibonacci, "/travel", self._drive, cancel_callback=self._cancel, callback_group=group
        )
        if kind != "dies":
            # An arm of another process would go on when this one dies.
            self.node.create_service(SetBool, "/arm/reach", self._reach, callback_group=group)

    def _log(self, what: str, time_s: float | None = None) -> None:
        line = {"time": time.time() if time_s is None else time_s, "what": what}
        with self._file.open("a") as file:
            file.write(json.dumps(line) + "\n")

    def _cancel(self, handle: Any) -> Any:
        self._log("cancel received")
        if self._kind == "dies":
            # The motors' watchdog stops the wheels 0.2 s after the last command.
            self._log("process dies")
            self._log("wheels stand", time.time() + 0.2)
            os.kill(os.getpid(), signal.SIGKILL)
        return CancelResponse.REJECT if self._kind == "refuses" else CancelResponse.ACCEPT

    def _drive(self, handle: Any) -> Any:
        self._log("wheels turn")
        since_s = time.monotonic()
        while not handle.is_cancel_requested and not (
            self._kind == "refuses" and time.monotonic() - since_s > REFUSED_S
        ):
            time.sleep(0.005)
        if self._kind == "never":
            self._is_over.wait()
        time.sleep(BRAKING_S.get(self._kind, 0.0))
        self._log("wheels stand")
        if self._kind == "brakes":
            handle.canceled()
        else:
            handle.succeed()
        return Fibonacci.Result()

    def _reach(self, request: Any, response: Any) -> Any:
        self._log("arm moves")
        time.sleep(0.3)
        response.success = True
        return response

    def end(self, *_: object) -> None:
        """Let what waits go on, so that the process can end."""
        self._is_over.set()


def main(kind: str, file: str) -> None:
    """Serve until a signal."""
    rclpy.init()
    robot = Robot(kind, Path(file))
    signal.signal(signal.SIGTERM, lambda *_: os._exit(0))
    executor = MultiThreadedExecutor(4)
    executor.add_node(robot.node)
    executor.spin()


if __name__ == "__main__":
    main(*sys.argv[1:])
