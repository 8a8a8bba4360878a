"""`robosc-bridge run --record` on a simulated TurtleBot3: kept after a kill, and no obstacle when its disk is full."""

import time
from pathlib import Path

import pytest

from robosc_bridge.captures.capture_file import read_capture
from robosc_bridge.captures.commands import replay
from robosc_bridge.captures.players import Summary
from robosc_simulated import SimulatedTurtleBot3
from support.bridge_process import LIMIT_S, running, wait_until
from support.small_disks import small_disk

pytestmark = pytest.mark.real_time


@pytest.mark.parametrize("base", ["opencr", "dynamixel", "mavlink-rover"])
def test_what_was_recorded_before_a_kill_is_there(base: str, tmp_path: Path) -> None:
    file = tmp_path / "run.mcap"
    with (
        SimulatedTurtleBot3("burger", base, "lds01") as robot,
        running(tmp_path, robot, base, "null", "--record", str(file)) as process,
    ):
        time.sleep(2.0)
        process.kill()
        process.wait()
    capture = read_capture(file)
    found: dict[str, Summary] = {}
    assert [item for item in replay(capture, found) if item.kind == "problem"] == []
    assert not capture.is_whole
    assert found["base"].readings > 20
    assert found["scanner"].scans > 5


def test_a_full_disk_does_not_stop_the_robot(tmp_path: Path) -> None:
    with (
        small_disk(tmp_path / "disk", "64k") as disk,
        SimulatedTurtleBot3("burger", "opencr", "lds01") as robot,
        running(tmp_path, robot, "opencr", "null", "--record", str(disk / "run.mcap")) as process,
    ):

        def is_full() -> bool:
            return (disk / "run.mcap").stat().st_size >= 60_000

        wait_until(is_full, "the disk to be full", process, LIMIT_S)
        time.sleep(1.0)
        pose = robot.world.pose
        wait_until(lambda: robot.world.pose != pose, "the robot to go on", process, LIMIT_S)
        process.terminate()
        _, errors = process.communicate(timeout=LIMIT_S)
    assert process.returncode == 0, errors
    assert errors.count("the recording ends here, and the robot goes on") == 1
    assert "have not answered" not in errors
