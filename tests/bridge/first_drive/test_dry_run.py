"""Dry runs: the supervisor goes on as if the robot moved, and its motors never hold."""

import logging
import math

import pytest

from robosc.execution.runtime.event_log import NullLog
from robosc_bridge.assembly import assemble
from robosc_bridge.configuration import map_channels, parse
from robosc_bridge.daemon.states import State
from robosc_bridge.devices.dry_base import DryBase
from robosc_bridge.devices.interface import STANDSTILL, DriveReading, Pose, Velocity
from robosc_simulated import SimulatedTurtleBot3
from robosc_simulated.virtual_host import VirtualHost
from support.daemons import supervisor_of
from support.driven import MODEL

BASES = ("opencr", "dynamixel", "mavlink-rover")


@pytest.mark.parametrize("base", BASES)
def test_a_dry_run_drives_nowhere_and_prints_what_it_would_do(base: str, caplog: pytest.LogCaptureFixture) -> None:
    supervisor = supervisor_of(MODEL.replace("LINEAR", "0.1").replace("ANGULAR", "0.5"))
    with (
        caplog.at_level(logging.INFO, "robosc_bridge"),
        VirtualHost() as host,
        SimulatedTurtleBot3("burger", base, clock=host) as robot,
    ):
        text = (
            f"robot: burger\ndrive: {{driver: {base}, port: {robot.base_path}}}\n"
            "channels: {/cmd_vel: {channel: drive}, /lost: {channel: fault}, /back: {channel: fault, event: back}}\n"
        )
        configuration = parse(text.encode(), "test.yaml").configuration
        mapping = map_channels(supervisor.model, configuration)
        made = assemble(configuration, mapping, supervisor, NullLog(), starts_itself=True, host=host, is_dry=True)

        def run() -> None:
            made.run()

        thread = host.thread(run, "loop")
        thread.start()
        host.sleep(8.0)
        state = made.daemon.state
        snapshot = made.operations.feed.subscribe(lambda: None, 1).take().snapshot
        has_torque = [wheel.is_driven for wheel in (robot.world.left, robot.world.right)]
        made.quit()
        thread.join(10.0)
        pose = robot.world.pose
    assert (state, made.daemon.problem) == (State.RUNNING, "")
    assert pose == (0.0, 0.0, 0.0)
    assert has_torque == [False, False]
    assert snapshot is not None and snapshot.reading is not None
    assert snapshot.reading.velocity == Velocity(0.1, 0.5)
    assert snapshot.reading.wheels_m_s == pytest.approx((0.06, 0.14))
    assert snapshot.reading.battery_v == pytest.approx(12.0)
    assert "dry run: it would drive at 0.10 m/s, 0.50 rad/s" in caplog.messages
    assert "dry run: the motors would hold" in caplog.messages


class Base:
    """A drive base that stands still."""

    limits = None

    def __init__(self) -> None:
        self.calls: list[str] = []
        self.now_s = 0.0

    def open(self) -> None:
        self.calls.append("open")

    def exchange(self, velocity: Velocity) -> DriveReading:
        self.calls.append("read")
        assert velocity == STANDSTILL
        return DriveReading(self.now_s, Pose(5.0, 5.0, 1.0), STANDSTILL, (0.0, 0.0), False, battery_v=11.9)

    def close(self) -> None:
        self.calls.append("close")


def test_its_readings_are_those_of_a_robot_that_moves() -> None:
    base = Base()
    dry = DryBase(base, 0.16, lambda: base.now_s)  # type: ignore[arg-type]
    dry.open()
    # The robot would not move without torque.
    base.now_s = 1.0
    dry.exchange(Velocity(0.2))
    base.now_s = 2.0
    assert dry.exchange(Velocity(0.2)).pose == Pose()
    dry.set_torque(True)
    dry.exchange(Velocity(0.0, math.pi / 2))
    base.now_s = 3.0
    dry.exchange(Velocity(0.2))
    base.now_s = 4.0
    reading = dry.exchange(STANDSTILL)
    assert (reading.pose.x_m, reading.pose.y_m) == pytest.approx((0.0, 0.2))
    assert reading.pose.heading_rad == pytest.approx(math.pi / 2)
    assert (reading.is_torque_on, reading.battery_v) == (True, 11.9)
    dry.set_torque(False)
    dry.reset()
    dry.close()
    assert set(base.calls) == {"open", "read", "close"}
