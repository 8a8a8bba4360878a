"""Probe of ports: every device is found on every kind of line, and what is wrong with it is reported."""

import json
from argparse import Namespace
from collections.abc import Iterator
from pathlib import Path

import pytest

from robosc_bridge.first_drive import commands
from robosc_bridge.first_drive.ports import serial_ports, stable_name
from robosc_bridge.first_drive.probe import FoundDevice, ProbedPort, probe
from robosc_bridge.main import main
from robosc_simulated import SimulatedTurtleBot3
from robosc_simulated.virtual_host import VirtualHost


@pytest.fixture
def host() -> Iterator[VirtualHost]:
    with VirtualHost() as found:
        yield found


def only(probed: ProbedPort) -> FoundDevice:
    (device,) = probed.devices
    return device


def test_a_sound_opencr_is_found(host: VirtualHost) -> None:
    with SimulatedTurtleBot3("waffle", "opencr", clock=host) as robot:
        probed = probe(robot.base_path, host)
    device = only(probed)
    assert (device.kind, device.facts["firmware"], device.facts["battery_v"]) == ("opencr", 5, 12.0)
    assert device.facts["robots"] == ["waffle", "waffle_pi"]
    assert probed.is_well


def test_what_is_wrong_with_a_board_is_reported(host: VirtualHost) -> None:
    with SimulatedTurtleBot3("burger", "opencr", clock=host, has_motors=False) as robot:
        assert robot.opencr is not None
        robot.opencr.set_battery(10.8)
        host.sleep(2.0)
        problems = only(probe(robot.base_path, host)).problems
    assert "it found no wheel motors when it started: check their cables, then switch it off and on" in problems
    assert any("10.80 V" in problem for problem in problems)


def test_servos_are_found_at_whatever_speed_with_what_keeps_them_from_driving(host: VirtualHost) -> None:
    with SimulatedTurtleBot3("burger", "dynamixel", clock=host) as robot:
        for servo, number in ((robot.left, 1), (robot.right, 1)):
            servo.table["baud rate"] = number
        robot.right.table["drive mode"] = 5
        robot.left.overload()
        probed = probe(robot.base_path, host)
    assert [device.facts["id"] for device in probed.devices] == [1, 2]
    assert {device.facts["baud"] for device in probed.devices} == {57_600}
    left, right = (" ".join(device.problems) for device in probed.devices)
    assert "hardware error (overload)" in left
    assert "57600 baud, not 1000000" in left
    assert "drive mode 5: a time-based profile" in right
    assert not probed.is_well


@pytest.mark.parametrize("lidar", ["lds01", "lds02", "lds03"])
def test_a_lidar_is_distinguished_from_the_others_and_left_as_it_was(lidar: str, host: VirtualHost) -> None:
    with SimulatedTurtleBot3("burger", "opencr", lidar, clock=host) as robot:
        probed = probe(robot.scanner_path, host)
        assert probed.is_well, probed
        device = only(probed)
        assert (device.facts["driver"], device.facts["valid_ranges"]) == (lidar, 360)
        assert device.facts["revolutions_per_s"] > 4
        if lidar != "lds02":
            # Its motor was started, and is stopped again.
            host.sleep(2.0)
            port = host.open_port(robot.scanner_path, 230_400)
            port.discard_input()
            assert port.read(1.0) == b""
            port.close()


def test_a_rover_is_only_listened_to(host: VirtualHost) -> None:
    with SimulatedTurtleBot3("burger", "mavlink-rover", clock=host) as robot:
        assert robot.rover is not None
        probed = probe(robot.base_path, host)
        assert (robot.rover.heartbeats, robot.rover.commands) == ([], [])
        robot.rover.mode, robot.rover.is_armed = 15, True
        armed = only(probe(robot.base_path, host))
    device = only(probed)
    assert (device.kind, device.facts["system"], device.facts["autopilot"]) == ("vehicle", 1, 3)
    assert probed.is_well
    assert armed.problems == ("it is armed: somebody drives it",)


def test_a_port_where_nothing_answers_and_one_that_is_not_there(host: VirtualHost) -> None:
    with SimulatedTurtleBot3("burger", "opencr", clock=host) as robot:
        robot.base_line.faults.is_deaf = True
        mute = probe(robot.base_path, host)
        assert mute.problem.startswith("nothing answers: no OpenCR")
        port = host.open_port(robot.base_path, 57_600)
        assert probe(robot.base_path, host).problem == "another program uses this port"
        port.close()
    missing = probe("/virtual/none", host)
    assert missing.problem == "there is no such port; is the device plugged in?"
    assert not mute.is_well and not missing.is_well


def test_a_probe_moves_nothing_and_writes_nothing(host: VirtualHost) -> None:
    with SimulatedTurtleBot3("burger", "dynamixel", clock=host) as robot:
        robot.left.table["torque enable"] = 1
        robot.left.table["goal velocity"] = 0
        probed = probe(robot.base_path, host)
        assert robot.left.table["torque enable"] == 1
        assert robot.world.pose == (0.0, 0.0, 0.0)
    assert any("its torque is on" in problem for problem in probed.devices[0].problems)


def test_the_command_prints_for_people_and_for_programs(host: VirtualHost, capsys: pytest.CaptureFixture[str]) -> None:
    with SimulatedTurtleBot3("burger", "opencr", "lds02", clock=host) as robot:
        ports = [robot.base_path, robot.scanner_path]
        assert commands._probe(Namespace(port=ports, json=False), host) == 0
        text = capsys.readouterr().out
        assert commands._probe(Namespace(port=[*ports, "/virtual/none"], json=True), host) == 1
        document = json.loads(capsys.readouterr().out)
    assert "  OpenCR: model number 20480, firmware 5, robots burger, battery v 12.0" in text
    assert "  LDS-02: driver lds02, baud 115200" in text
    assert [port["is_well"] for port in document["ports"]] == [True, True, False]
    assert document["ports"][0]["devices"][0]["facts"]["firmware"] == 5


def test_no_port_is_reported(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(commands, "serial_ports", list)
    assert main(["probe"]) == 1
    assert "there is no serial port" in capsys.readouterr().out


def test_ports_are_named_once_and_by_their_most_stable_name(tmp_path: Path) -> None:
    (tmp_path / "serial" / "by-id").mkdir(parents=True)
    for name in ("ttyACM0", "ttyUSB0", "ttyUSB1"):
        (tmp_path / name).touch()
    (tmp_path / "robosc-opencr").symlink_to(tmp_path / "ttyACM0")
    for name, target in (("usb-ROBOTIS-if00", "ttyACM0"), ("usb-CP2102-if00", "ttyUSB0")):
        (tmp_path / "serial" / "by-id" / name).symlink_to(tmp_path / target)
    names = ["robosc-opencr", "serial/by-id/usb-CP2102-if00", "ttyUSB1"]
    assert serial_ports(tmp_path) == [str(tmp_path / name) for name in names]
    assert stable_name(str(tmp_path / "ttyACM0"), tmp_path) == str(tmp_path / "robosc-opencr")
    assert stable_name(str(tmp_path / "ttyUSB1"), tmp_path) == str(tmp_path / "ttyUSB1")
