"""First drive on real pseudo-terminals, with the commands as programs: probe, set-up of a servo, a dry run."""

import json
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

from robosc_simulated import BODIES, SimulatedLine, SimulatedTurtleBot3, Timebase, World, room
from robosc_simulated.servo import Servo
from robosc_simulated.servo_bus import ServoBus
from support.bridge_process import LIMIT_S, MODEL, START_LIMIT_S, bridge, configured

pytestmark = pytest.mark.real_time


@pytest.mark.parametrize(
    ("base", "lidar", "kinds"),
    [
        ("opencr", "lds01", ["opencr", "lidar"]),
        ("dynamixel", "lds02", ["servo", "servo", "lidar"]),
        ("mavlink-rover", "lds03", ["vehicle", "lidar"]),
    ],
)
def test_a_probe_finds_all_devices_of_a_robot(base: str, lidar: str, kinds: list[str]) -> None:
    with SimulatedTurtleBot3("burger", base, lidar) as robot:
        done = bridge("probe", "--port", robot.base_path, "--port", robot.scanner_path, "--json")
        assert robot.world.pose == (0.0, 0.0, 0.0)
    assert done.returncode == 0, done.stdout + done.stderr
    ports = json.loads(done.stdout)["ports"]
    assert [device["kind"] for port in ports for device in port["devices"]] == kinds
    assert ports[1]["devices"][0]["facts"]["driver"] == lidar


def test_a_servo_from_the_factory_is_set_up_and_found(tmp_path: Path) -> None:
    passing = Timebase()
    world = World(BODIES["burger"], room(4.0, 3.0), passing)
    servo = Servo(BODIES["burger"].servo_model, world, world.right, 1)
    with SimulatedLine(ServoBus((servo,)), passing) as line:
        declined = bridge("setup-servo", "--port", line.path, "--wheel", "right")
        assert (declined.returncode, servo.table["id"]) == (1, 1), declined.stderr
        done = bridge("setup-servo", "--port", line.path, "--wheel", "right", "--yes")
        assert done.returncode == 0, done.stdout + done.stderr
        probed = json.loads(bridge("probe", "--port", line.path, "--json").stdout)
    (device,) = probed["ports"][0]["devices"]
    assert (device["facts"]["id"], device["facts"]["baud"], device["facts"]["drive_mode"]) == (2, 1_000_000, 1)
    assert device["problems"] == []


@pytest.mark.parametrize("base", ["opencr", "dynamixel"])
def test_a_dry_run_decides_and_drives_nowhere(base: str, tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        address = f"127.0.0.1:{server.getsockname()[1]}"
    with SimulatedTurtleBot3("burger", base, "lds01") as robot:
        file = configured(tmp_path, robot, base, address)
        command = [
            sys.executable,
            "-m",
            "robosc_bridge.main",
            "run",
            "--model",
            str(MODEL),
            "--config",
            str(file),
            "--dry",
        ]
        process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
        try:
            lines: list[str] = []
            end_s = time.monotonic() + START_LIMIT_S
            assert process.stderr is not None
            while not any("it would drive at 0." in line and "at 0.00 m/s, 0.00" not in line for line in lines):
                assert time.monotonic() < end_s, lines
                lines.append(process.stderr.readline())
            time.sleep(2.0)
            status = json.loads(bridge("status", "--json", "--address", address).stdout)
            robot.world.catch_up()
            assert robot.world.pose == (0.0, 0.0, 0.0)
            assert not (robot.world.left.is_driven or robot.world.right.is_driven)
            process.terminate()
            process.communicate(timeout=LIMIT_S)
        finally:
            process.kill()
            process.communicate()
    assert status["state"] == "BRIDGE_STATE_RUNNING"
    assert process.returncode == 0
