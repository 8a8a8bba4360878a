"""`robosc-bridge run` with a remote endpoint on a simulated TurtleBot3, commanded from a terminal: all as programs."""

import json
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from robosc_api.v1 import bridge_pb2 as pb
from robosc_simulated import SimulatedTurtleBot3
from support.bridge_process import speeds
from support.bridge_runs import LIMIT_S, RUNNER, START_LIMIT_S, Running, configured
from support.real_time import preferred
from support.remote import Attachment, connected
from support.terminals import Terminal
from support.waiting import wait_until

pytestmark = pytest.mark.real_time


def command(*arguments: str) -> subprocess.CompletedProcess[str]:
    line = [sys.executable, "-m", "robosc_bridge.command", *arguments]
    return subprocess.run(line, capture_output=True, text=True, check=False, timeout=LIMIT_S)


CART = """robot Cart {
    interface twist use Twist from geometry_msgs
    datatype object Vector { x: double z: double }
    datatype object Twist { linear: Vector angular: Vector }
    component Gate {
        outgoing message open with identifier: "/gate/open", type: none
        outgoing message shut with identifier: "/gate/shut", type: none
        behaviour {
            initial marked state closed { on response from open goto opened }
            marked state opened { on response from shut goto closed }
        }
    }
    component Wheels {
        incoming message drive with identifier: "/cmd_vel", type: Twist links twist
    }
    requirement drive needs Gate.opened
}
"""


def running(folder: Path, robot: SimulatedTurtleBot3) -> Running:
    return Running(configured(folder, robot, RUNNER))


def becomes(look: Callable[[], bool]) -> None:
    wait_until(look, limit_s=LIMIT_S)


def moves(robot: SimulatedTurtleBot3) -> bool:
    # A look takes the world's lock, which the robot needs as well.
    time.sleep(0.02)
    return speeds(robot) != (0.0, 0.0)


def state(address: str) -> str:
    return str(json.loads(command("status", "--json", "--address", address).stdout)["state"])


def test_a_robot_is_started_watched_stopped_and_let_go_on_from_elsewhere(
    robot: SimulatedTurtleBot3, tmp_path: Path
) -> None:
    with running(tmp_path, robot) as bridge:
        address = bridge.address()
        wait_until(lambda: state(address) == "BRIDGE_STATE_STANDBY", limit_s=START_LIMIT_S)
        assert speeds(robot) == (0.0, 0.0)
        line = [sys.executable, "-m", "robosc_bridge.command", "watch", "--address", address]
        with subprocess.Popen(line, stdout=subprocess.PIPE, text=True) as watcher:
            assert watcher.stdout is not None
            assert "= standby" in watcher.stdout.readline()
            started = command("start", "--address", address)
            assert (started.returncode, started.stdout) == (0, "start: done\n"), started.stderr
            becomes(lambda: moves(robot))

            stopped = command("stop", "--address", address)
            assert (stopped.returncode, stopped.stderr) == (0, "")
            becomes(lambda: not moves(robot))
            done = command("status", "--address", address)
            assert "nothing moves: An operator has stopped the robot. (until reset)" in done.stdout

            resumed = command("resume", "--address", address)
            assert (resumed.returncode, resumed.stderr) == (0, "")
            becomes(lambda: moves(robot))

            assert command("standby", "--address", address).returncode == 0
            assert state(address) == "BRIDGE_STATE_STANDBY"
            assert robot.left.table["torque enable"] == robot.right.table["torque enable"] == 0
            watcher.send_signal(signal.SIGINT)
            shown = watcher.stdout.read()
        assert " event      " in shown
        assert "An operator has stopped the robot." in shown
        bridge.process.send_signal(signal.SIGTERM)
        assert bridge.process.wait(LIMIT_S) == 0
        assert "Traceback" not in bridge.written


def test_a_stop_reaches_the_motors_at_once(
    robot: SimulatedTurtleBot3, tmp_path: Path, record_property: Callable[[str, object], None]
) -> None:
    from robosc_api.security import Credentials
    from robosc_bridge.terminal.client import BridgeClient, RequestedCommand

    with running(tmp_path, robot) as bridge:
        address = bridge.address()
        wait_until(lambda: state(address) == "BRIDGE_STATE_STANDBY", limit_s=START_LIMIT_S)
        with BridgeClient(address, Credentials()) as client:
            client.request(RequestedCommand.START)
            becomes(lambda: moves(robot))
            client.status()
            begin_s = time.monotonic()
            client.stop()
            answered_s = time.monotonic() - begin_s
            with robot.time.lock:
                world = robot.world
            while world.left.goal_rad_s != 0.0 or world.right.goal_rad_s != 0.0:
                assert time.monotonic() - begin_s < 5.0
                time.sleep(0.0005)
            record_property("stop over gRPC, answered (ms)", round(1000.0 * answered_s, 1))
            record_property("stop over gRPC, motors commanded (ms)", round(1000.0 * (time.monotonic() - begin_s), 1))

        line = [sys.executable, "-m", "robosc_bridge.command", "watch", "--address", address]
        with subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as watcher:
            assert watcher.stdout is not None
            assert watcher.stderr is not None
            watcher.stdout.readline()
            # A bridge that hangs is reported to those who rely on it.
            bridge.process.send_signal(signal.SIGSTOP)
            stopped = command("stop", "--address", address)
            assert stopped.returncode == 2
            assert stopped.stderr.startswith("robosc-bridge: ")
            assert watcher.wait(LIMIT_S) == 2
            assert "no bridge answers at" in watcher.stderr.read()


def held(terminal: Terminal) -> bool:
    """A key that is held comes again and again."""
    terminal.type("w")
    return True


def test_a_robot_is_driven_by_keys_as_far_as_the_layer_lets_it(tmp_path: Path) -> None:
    with preferred(), SimulatedTurtleBot3("burger", "opencr", "lds01") as robot:
        configuration = configured(tmp_path, robot, CART, "/gate/open", "/gate/shut", operator="2.0")
        bridge = Running(configuration, "--deployment", "layer")
        try:
            address = bridge.address()
            wait_until(lambda: state(address) == "BRIDGE_STATE_STANDBY", limit_s=START_LIMIT_S)
            with connected(address) as stub:
                gate = Attachment(stub, name="gate")
                gate.receive()
                assert command("start", "--address", address).returncode == 0
                terminal = Terminal(address)
                try:
                    wait_until(lambda: "w/s or up/down" in terminal.seen)
                    terminal.type("wwwww")
                    wait_until(lambda: "BLOCKED /cmd_vel" in terminal.seen)
                    assert speeds(robot) == (0.0, 0.0)
                    gate.send(give=pb.Message(identifier="/gate/open"))
                    becomes(lambda: held(terminal) and moves(robot) and min(speeds(robot)) > 1.0)
                    gate.send(give=pb.Message(identifier="/gate/shut"))
                    becomes(lambda: held(terminal) and not moves(robot))
                    gate.send(give=pb.Message(identifier="/gate/open"))
                    becomes(lambda: held(terminal) and moves(robot) and min(speeds(robot)) > 1.0)
                    # The key is released.
                    becomes(lambda: not moves(robot))
                    becomes(lambda: held(terminal) and moves(robot) and min(speeds(robot)) > 1.0)
                    # The terminal goes without a word.
                    terminal.process.kill()
                    becomes(lambda: not moves(robot))
                    becomes(
                        lambda: (
                            "the link to the operator is lost" in command("status", "--address", address).stdout.lower()
                        )
                    )
                finally:
                    terminal.close()
                gate.send(give=pb.Message(identifier="/nowhere"))
                while not (message := gate.receive()).HasField("refused"):
                    pass
                assert "/nowhere" in message.refused.why
                gate.end()
            bridge.process.send_signal(signal.SIGTERM)
            assert bridge.process.wait(LIMIT_S) == 0
            assert "Traceback" not in bridge.written
        finally:
            bridge.end()
