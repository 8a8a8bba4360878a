"""`robosc-bridge run` as a program, on a simulated TurtleBot3 at the other end of real serial lines."""

import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from robosc.cli.main import main as robosc
from robosc_bridge.simulated import SimulatedTurtleBot3
from support.models import EXAMPLES
from support.service import served
from support.waiting import wait_until

pytestmark = pytest.mark.real_time

MODEL = EXAMPLES / "maze_solver" / "maze_solver.rscd"
START_LIMIT_S, LIMIT_S = 90.0, 30.0


def _ended(process: subprocess.Popen[str]) -> str:
    return "" if process.poll() is None else process.communicate()[1] or "it ended"


def bridge(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "robosc_bridge.main", *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def configured(folder: Path, robot: SimulatedTurtleBot3, base: str) -> Path:
    """A configuration as `init` writes it, with the ports of a simulated robot."""
    made = bridge("init", "--model", str(MODEL), "--drive", base, "--scanner", "lds01")
    assert made.returncode == 0, made.stderr
    ports = iter((robot.base_path, robot.scanner_path))
    text = re.sub(r"^  port: .*$", lambda _: f"  port: {next(ports)}", made.stdout, flags=re.MULTILINE)
    # A machine on which tests run is not one for robots.
    text = text.replace("\nscanner:\n", "  options: {answer_limit_s: 0.3}\n\nscanner:\n", 1)
    text = re.sub(r"^  (overrun_s|motor_timeout_s|scan_timeout_s): .*$", r"  \1: 1.0", text, flags=re.MULTILINE)
    file = folder / "bridge.yaml"
    file.write_text(text)
    return file


@contextmanager
def running(folder: Path, robot: SimulatedTurtleBot3, base: str) -> Iterator[subprocess.Popen[str]]:
    """The bridge, until the robot has moved."""
    configuration = configured(folder, robot, base)
    command = [sys.executable, "-m", "robosc_bridge.main", "run", "--model", str(MODEL), "--config", str(configuration)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        start = robot.world.pose
        wait_until(lambda: robot.world.pose != start, "the robot to move", START_LIMIT_S, fault=lambda: _ended(process))
        yield process
    finally:
        process.kill()
        process.communicate()


def stands_still(robot: SimulatedTurtleBot3) -> bool:
    robot.world.catch_up()
    return robot.world.left.speed_rad_s == 0.0 == robot.world.right.speed_rad_s


@pytest.mark.parametrize("base", ["opencr", "dynamixel"])
def test_the_maze_solver_drives_and_a_signal_ends_it_at_rest(base: str, tmp_path: Path) -> None:
    with SimulatedTurtleBot3("burger", base, "lds01") as robot, running(tmp_path, robot, base) as process:
        process.send_signal(signal.SIGTERM)
        _, errors = process.communicate(timeout=LIMIT_S)
        assert process.returncode == 0, errors
        assert stands_still(robot)
        assert robot.left.table["torque enable"] == robot.right.table["torque enable"] == 0
        assert "Traceback" not in errors


@pytest.mark.parametrize("base", ["opencr", "dynamixel"])
def test_a_base_that_is_unplugged_is_one_clear_message_and_the_wheels_stop(base: str, tmp_path: Path) -> None:
    with SimulatedTurtleBot3("burger", base, "lds01") as robot, running(tmp_path, robot, base) as process:
        robot.base_line.disconnect()
        _, errors = process.communicate(timeout=LIMIT_S)
        assert process.returncode == 1, errors
        assert "the drive base is lost" in errors
        assert "Traceback" not in errors
        end_s = time.monotonic() + LIMIT_S
        while not stands_still(robot):
            assert time.monotonic() < end_s, "the wheels still turn"
            time.sleep(0.01)


@pytest.mark.parametrize("base", ["opencr", "dynamixel"])
def test_a_bridge_that_is_killed_leaves_wheels_that_stop(base: str, tmp_path: Path) -> None:
    """The devices' own watchdogs are the last line."""
    with SimulatedTurtleBot3("burger", base, "lds01") as robot, running(tmp_path, robot, base) as process:
        process.kill()
        process.wait()
        end_s = time.monotonic() + LIMIT_S
        while not stands_still(robot):
            assert time.monotonic() < end_s, "the wheels still turn"
            time.sleep(0.01)


def test_what_is_not_tied_is_listed(tmp_path: Path) -> None:
    file = tmp_path / "bridge.yaml"
    file.write_text(
        "robot: burger\ndrive: {driver: opencr, port: /dev/ttyACM0}\nchannels: {/cmd_vel: {channel: drive}}\n"
    )
    for command in ("check", "run"):
        done = bridge(command, "--model", str(MODEL), "--config", str(file))
        assert done.returncode == 2
        for name in ("scan_front", "rotate_left", "rotate_right", "rotate_done"):
            assert f"'{name}'" in done.stderr
        assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (("driver: opencr", "driver: opncr"), "unknown drive base 'opncr'"),
        (("answer_limit_s", "answer_limt_s"), "answer_limt_s"),
        (("token_file: null", "token_file: /nowhere/token"), "/nowhere/token: No such file"),
        (("mavlink_key: null", "mavlink_key: key"), "means nothing without 'mavlink_url'"),
    ],
)
def test_check_refuses_what_run_refuses(change: tuple[str, str], why: str, tmp_path: Path) -> None:
    with SimulatedTurtleBot3("burger", "opencr", "lds01") as robot:
        file = configured(tmp_path, robot, "opencr")
        text = file.read_text()
        assert change[0] in text
        file.write_text(text.replace(*change, 1))
        told = [bridge(command, "--model", str(MODEL), "--config", str(file)) for command in ("check", "run")]
    assert [done.returncode for done in told] == [2, 2]
    lines = [[line for line in done.stderr.splitlines() if line.startswith("robosc-bridge: ")] for done in told]
    assert lines[0] == lines[1]
    assert why in lines[0][0]


def test_a_signed_supervisor_is_run_without_its_model(tmp_path: Path) -> None:
    supervisor = tmp_path / "maze.rsup"
    for command in (
        ("synth", str(MODEL), "-o", str(supervisor)),
        ("key", str(tmp_path / "ours")),
        ("sign", str(supervisor), "--key", str(tmp_path / "ours.key")),
    ):
        assert robosc(list(command)) == 0
    with SimulatedTurtleBot3("burger", "opencr", "lds01") as robot:
        file = configured(tmp_path, robot, "opencr")
        text = file.read_text()
        assert "  trusted_keys: []\n" in text
        file.write_text(text.replace("  trusted_keys: []\n", f"  trusted_keys: [{tmp_path / 'ours.pub'}]\n"))
        command_line = ["run", "--model", str(supervisor), "--config", str(file)]
        process = subprocess.Popen(
            [sys.executable, "-m", "robosc_bridge.main", *command_line], stderr=subprocess.PIPE, text=True
        )
        try:
            start = robot.world.pose
            wait_until(
                lambda: robot.world.pose != start, "the robot to move", START_LIMIT_S, fault=lambda: _ended(process)
            )
            process.send_signal(signal.SIGTERM)
            _, errors = process.communicate(timeout=LIMIT_S)
        finally:
            process.kill()
            process.communicate()
        assert process.returncode == 0, errors
        assert "maze.rsup: signed by SHA256:" in errors
        supervisor.write_bytes(supervisor.read_bytes() + b" ")
        refused = bridge(*command_line)
        assert (refused.returncode, "has been changed" in refused.stderr) == (2, True)


def test_silent_steps_that_never_end_are_refused_unless_they_are_allowed(tmp_path: Path) -> None:
    model, supervisor, file = (tmp_path / name for name in ("live.rscd", "live.rsup", "bridge.yaml"))
    model.write_text(
        """robot Live {
    component C {
        incoming message go with identifier: "/go", type: none
        behaviour { initial marked state s { transition goto t } marked state t { transition goto s } }
    }
}"""
    )
    file.write_text("robot: burger\ndrive: {driver: opencr, port: /dev/none}\nchannels: {/go: {channel: log}}\n")
    assert robosc(["synth", str(model), "--allow-livelock", "-o", str(supervisor)]) == 0
    for path in (model, supervisor):
        # Where they are allowed, the next thing that is wrong is told.
        command_line = ("run", "--standby", "--model", str(path), "--config", str(file))
        refused, allowed = bridge(*command_line), bridge(*command_line, "--allow-livelock")
        assert (refused.returncode, allowed.returncode) == (2, 2)
        assert "silent steps never end (--allow-livelock overrides this)" in refused.stderr
        assert "to wait in standby" not in refused.stderr
        assert "its silent steps may go on for ever" in allowed.stderr
        assert "to wait in standby" in allowed.stderr


def test_what_a_server_made_is_kept_without_being_told_to(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    model, file = tmp_path / "r.rscd", tmp_path / "bridge.yaml"
    model.write_text('robot R { component C { incoming message go with identifier: "/go", type: none } }')
    file.write_text("robot: burger\ndrive: {driver: opencr, port: /dev/none}\nchannels: {/go: {channel: log}}\n")
    # With a supervisor, the next thing that is wrong is told.
    command_line = ["run", "--standby", "--model", str(model), "--config", str(file), "--server"]
    with served() as address:
        first = bridge(*command_line, address)
    (kept,) = (tmp_path / "state" / "robosc-bridge").iterdir()
    assert kept.suffix == ".rsup"
    second = bridge(*command_line, address)
    assert "what it made last is taken" in second.stderr
    for done in (first, second):
        assert "to wait in standby" in done.stderr
    kept.unlink()
    assert "none is kept of an earlier start" in bridge(*command_line, address).stderr


def test_standby_without_a_remote_face_is_refused(tmp_path: Path) -> None:
    with SimulatedTurtleBot3("burger", "opencr", "lds01") as robot:
        file = configured(tmp_path, robot, "opencr")
        done = bridge("run", "--standby", "--model", str(MODEL), "--config", str(file))
    assert done.returncode == 2
    assert (
        "to wait in standby, the bridge needs 'remote.grpc_address', 'remote.mavlink_url' or 'view.address'"
        in done.stderr
    )


def test_drivers_are_listed_for_people_and_programs() -> None:
    assert "opencr" in bridge("drivers").stdout
    assert '"name": "lds03"' in bridge("drivers", "--json").stdout


def test_the_schema_is_printed() -> None:
    assert bridge("schema").stdout.startswith("{")


def test_a_file_is_not_overwritten(tmp_path: Path) -> None:
    file = tmp_path / "bridge.yaml"
    assert bridge("init", "--model", str(MODEL), "-o", str(file)).returncode == 0
    again = bridge("init", "--model", str(MODEL), "-o", str(file))
    assert again.returncode == 2
    assert "File exists" in again.stderr
