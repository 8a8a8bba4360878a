"""`robosc-bridge run` with the line follower, on a simulated robot that sees a line on the floor."""

import math
import os
import pty
import re
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from robosc_simulated import SimulatedTurtleBot3, Track, Walls, oval, room
from support.models import EXAMPLES

pytestmark = pytest.mark.real_time

MODEL = EXAMPLES / "line_follower" / "line_follower.rscd"
START_LIMIT_S, LIMIT_S = 90.0, 30.0
FAR_M = 3.0
ASIDE_M = 0.03
"""Distance that the middle between the wheels may be off the line, in metres: half of its width and a little more."""


def configuration(folder: Path, robot: SimulatedTurtleBot3) -> Path:
    """Write a configuration like `init`, with the places of the simulated devices."""
    assert robot.camera is not None
    made = subprocess.run(
        [sys.executable, "-m", "robosc_bridge.main", "init", "--model", str(MODEL), "--scanner", "lds01"],
        capture_output=True,
        text=True,
        check=True,
    )
    # The simulator is threads of this process, on a machine that may be busy.
    ports = iter((f"{robot.base_path}\n  options: {{answer_limit_s: 0.5}}", robot.scanner_path))
    text = re.sub(r"^  port: .*$", lambda _: f"  port: {next(ports)}", made.stdout, flags=re.MULTILINE)
    text = re.sub(r"^    camera: .*$", f"    camera: simulated:{robot.camera.path}", text, flags=re.MULTILINE)
    # A machine on which tests run is not one for robots.
    times = r"^  (overrun_s|motor_timeout_s|scan_timeout_s|command_timeout_s): .*$"
    text = re.sub(times, r"  \1: 1.0", text, flags=re.MULTILINE)
    file = folder / "bridge.yaml"
    file.write_text(text)
    return file


class Follower:
    """The bridge on a simulated robot, with a terminal of its own.

    Attributes:
        driven_m: Distance that the robot went since it was last set to 0, in metres.
        aside_m: Greatest distance of the robot from the line, in metres.
    """

    def __init__(self, robot: SimulatedTurtleBot3, track: Track, folder: Path) -> None:
        assert robot.camera is not None
        self.robot, self.track, self.camera = robot, track, robot.camera
        self.driven_m = self.aside_m = 0.0
        self._at = robot.world.pose
        self.keys, terminal = pty.openpty()
        self._log = folder / "log"
        file = configuration(folder, robot)
        with self._log.open("w") as log:
            self.process = subprocess.Popen(
                [sys.executable, "-m", "robosc_bridge.main", "run", "--model", str(MODEL), "--config", str(file)],
                stdin=terminal,
                stdout=subprocess.DEVNULL,
                stderr=log,
            )
        os.close(terminal)

    @property
    def log(self) -> str:
        return self._log.read_text()

    def until(self, condition: Callable[[], bool], what: str, limit_s: float = LIMIT_S) -> None:
        """Wait, and see where the robot goes meanwhile."""
        end_s = time.monotonic() + limit_s
        while not condition():
            assert self.process.poll() is None, self.log
            assert time.monotonic() < end_s, f"waited {limit_s} s in vain for {what}\n{self.log}"
            time.sleep(0.03)
            now = self.robot.world.pose
            self.driven_m += math.dist(self._at[:2], now[:2])
            self.aside_m = max(self.aside_m, self.track.distance_m(*now[:2]))
            self._at = now

    def drives(self) -> bool:
        return self.robot.world.speed_m_s > 0.05

    def stands(self) -> bool:
        self.robot.world.catch_up()
        return self.robot.world.left.speed_rad_s == 0.0 == self.robot.world.right.speed_rad_s

    def put(self, x_m: float, y_m: float, heading_rad: float) -> None:
        self.robot.world.place(x_m, y_m, heading_rad)
        self._at = self.robot.world.pose


@pytest.fixture
def follower(tmp_path: Path) -> Iterator[Follower]:
    track = oval()
    with SimulatedTurtleBot3("burger", "opencr", "lds01", walls=room(4.0, 4.0), line=track) as robot:
        found = Follower(robot, track, tmp_path)
        try:
            found.until(found.drives, "the robot to move", START_LIMIT_S)
            yield found
        finally:
            found.process.kill()
            found.process.wait()
            os.close(found.keys)


def test_it_follows_the_line_and_stops_for_whatever_there_is(follower: Follower) -> None:
    world = follower.robot.world
    follower.until(lambda: follower.driven_m > FAR_M, "some metres", 2 * LIMIT_S)
    assert follower.aside_m < ASIDE_M
    assert world.collisions == 0

    # An obstacle, right before it.
    clear = world.walls
    x_m, y_m, heading_rad = world.pose
    across = heading_rad + math.pi / 2
    middle = x_m + 0.3 * math.cos(heading_rad), y_m + 0.3 * math.sin(heading_rad)
    reach = 0.2 * math.cos(across), 0.2 * math.sin(across)
    obstacle = (middle[0] - reach[0], middle[1] - reach[1], middle[0] + reach[0], middle[1] + reach[1])
    world.walls = Walls((*clear.segments, obstacle))
    follower.until(follower.stands, "a stop before the obstacle")
    assert world.collisions == 0
    world.walls = clear
    follower.until(follower.drives, "it to go on without the obstacle")

    # The operator.
    os.write(follower.keys, b" ")
    follower.until(follower.stands, "a stop by the operator")
    # On OpenCR it lets the motors go, too; the robot continues after that alone.
    servos = (follower.robot.left, follower.robot.right)
    follower.until(lambda: not any(servo.table["torque enable"] for servo in servos), "the motors to let go")
    os.write(follower.keys, b"r")
    follower.until(follower.drives, "it to go on when the operator says so")

    # A place without a line.
    follower.put(-1.0, -1.0, 0.0)
    follower.until(follower.stands, "a stop without a line")
    follower.put(0.0, 0.0, 0.0)
    follower.until(follower.drives, "it to go on with a line")

    # No pictures, and then no camera.
    follower.camera.is_frozen = True
    follower.until(follower.stands, "a stop without pictures")
    follower.until(lambda: "camera: no picture for 0.5 s" in follower.log, "a message")
    follower.camera.is_frozen = False
    follower.until(follower.drives, "it to go on with pictures")
    follower.camera.disconnect()
    follower.until(follower.stands, "a stop without a camera")
    follower.until(lambda: "the camera is gone: whoever served its pictures has ended" in follower.log, "a message")
    follower.camera.reconnect()
    follower.until(follower.drives, "it to go on with a camera")

    follower.process.terminate()
    assert follower.process.wait(LIMIT_S) == 0, follower.log
    assert follower.stands()
    assert "Traceback" not in follower.log
