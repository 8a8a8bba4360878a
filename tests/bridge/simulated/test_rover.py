"""The simulated rover on a clock that the test moves."""

import math
from typing import Any

import pytest

from robosc.execution.runtime.clock import ManualClock
from robosc_simulated import BODIES, Rover, Timebase, Walls, World
from robosc_simulated.mavlink_packets import Encoder, Packet, Parser
from robosc_simulated.rover import ACCEPTED, DENIED, FAILED, GUIDED, HOLD, MANUAL, UNSUPPORTED


class Station:
    """A ground station right at the vehicle, without a line."""

    def __init__(self, **arguments: Any) -> None:
        self.clock = ManualClock()
        self.world = World(BODIES["burger"], Walls(()), Timebase(self.clock))
        self.rover = Rover(self.world, **arguments)
        self.encoder = Encoder(255, 190)
        self.parser = Parser()

    def said(self, sendings: Any) -> list[Packet]:
        return [packet for sending in sendings for packet in self.parser.feed(sending.data)]

    def passing(self, seconds: float) -> list[Packet]:
        found = []
        for _ in range(round(seconds / 0.01)):
            self.clock.advance(0.01)
            found += self.said(self.rover.update())
        return found

    def send(self, name: str, **values: Any) -> list[Packet]:
        packet = self.encoder.encode(name, **{"target_system": 1, "target_component": 1, **values})
        return self.said(self.rover.receive(packet, 0))

    def command(self, number: int, *parameters: float, **values: Any) -> list[Packet]:
        filled = (*parameters, *(0.0,) * (7 - len(parameters)))
        return self.send("COMMAND_LONG", command=number, parameters=filled, **values)

    def result(self, number: int, *parameters: float) -> int:
        answer = self.command(number, *parameters)[-1]
        assert answer.name == "COMMAND_ACK"
        assert (answer.values["target_system"], answer.values["target_component"]) == (255, 190)
        return int(answer.values["result"])

    def ready(self) -> "Station":
        assert self.result(176, 1, GUIDED) == ACCEPTED
        assert self.result(400, 1) == ACCEPTED
        return self

    def target(self, speed_m_s: float, right_rad_s: float = 0.0, **values: Any) -> None:
        self.send(
            "SET_POSITION_TARGET_LOCAL_NED", **{"type_mask": 0x05E7, "frame": 8, "vx": speed_m_s,
                                                "yaw_rate": right_rad_s, **values}
        )  # fmt: skip


def test_heartbeats_come_once_a_second_and_show_mode_and_arming() -> None:
    station = Station()
    heard = [packet for packet in station.passing(3.05) if packet.name == "HEARTBEAT"]
    assert len(heard) == 4
    assert {(packet.values["base_mode"], packet.values["custom_mode"]) for packet in heard} == {(1, MANUAL)}
    station.ready()
    (later,) = [packet for packet in station.passing(1.0) if packet.name == "HEARTBEAT"]
    assert (later.values["base_mode"], later.values["custom_mode"]) == (129, GUIDED)
    assert (later.values["type"], later.values["autopilot"], later.values["system_status"]) == (10, 3, 4)


def test_a_target_is_followed_for_three_seconds() -> None:
    station = Station().ready()
    station.target(0.2, 0.5)
    assert "STATUSTEXT" not in [packet.name for packet in station.passing(2.9)]
    assert station.world.speed_m_s == pytest.approx(0.2)
    # Turning right.
    assert station.world.yaw_rate_rad_s == pytest.approx(-0.5)
    heard = station.passing(0.3)
    assert station.world.speed_m_s == 0.0
    assert any(b"target not received" in packet.values["text"] for packet in heard if packet.name == "STATUSTEXT")


@pytest.mark.parametrize(
    "values",
    [{"type_mask": 0x05E3}, {"frame": 3}, {"target_system": 2}, {"target_component": 191}],
    ids=["accelerations", "frame", "system", "component"],
)
def test_a_target_that_is_not_meant_or_not_understood_moves_nothing(values: dict[str, int]) -> None:
    station = Station().ready()
    station.target(0.2, **values)
    station.passing(0.2)
    assert station.world.pose == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("lacks", ["arming", "mode", "origin"])
def test_what_is_needed_to_move(lacks: str) -> None:
    station = Station().ready()
    if lacks == "arming":
        station.rover.disarm()
    elif lacks == "mode":
        station.rover.take_over(HOLD)
    else:
        station.rover.has_origin = False
    station.target(0.2)
    station.passing(0.2)
    assert station.world.pose == (0.0, 0.0, 0.0)


def test_backwards_and_no_faster_than_it_cruises() -> None:
    station = Station(cruise_m_s=0.3).ready()
    station.target(-9.0)
    station.passing(1.0)
    assert station.world.speed_m_s == pytest.approx(-0.3)


def test_commands_are_answered_by_what_became_of_them() -> None:
    station = Station()
    assert station.result(176, 1, 99) == DENIED
    assert station.result(176, 0, GUIDED) == DENIED
    assert station.result(410) == UNSUPPORTED
    assert station.result(511, 331, 0.0) == UNSUPPORTED
    assert station.command(400, 1, target_system=9) == []
    station.rover.refusal = "x" * 92
    heard = station.command(400, 1)
    assert [packet.name for packet in heard] == ["STATUSTEXT"] * 3 + ["COMMAND_ACK"]
    # A text of exactly two pieces has a third, empty one.
    assert [len(packet.values["text"].rstrip(b"\0")) for packet in heard[:3]] == [50, 50, 0]
    assert [packet.values["chunk"] for packet in heard[:3]] == [0, 1, 2]
    assert heard[-1].values["result"] == FAILED
    assert not station.rover.is_armed


def test_messages_come_as_often_as_they_are_asked_for() -> None:
    station = Station()
    assert station.result(511, 331, 100_000) == ACCEPTED
    heard = [packet for packet in station.passing(1.0) if packet.name == "ODOMETRY"]
    assert 9 <= len(heard) <= 11
    assert math.isnan(heard[0].values["pose_covariance"][0])
    station.rover.has_origin = False
    assert "ODOMETRY" not in [packet.name for packet in station.passing(0.5)]
    station.rover.reports_motion = False
    assert station.result(511, 331, 100_000) == UNSUPPORTED


def test_the_remote_control_wins() -> None:
    station = Station().ready()
    station.target(0.2)
    station.passing(0.1)
    station.rover.take_over(MANUAL, -0.1, 0.2)
    station.passing(0.3)
    assert station.world.speed_m_s == pytest.approx(-0.1)
    station.rover.take_over(GUIDED)
    station.passing(0.3)
    # The target of before is forgotten.
    assert station.world.speed_m_s == 0.0


def test_a_request_takes_no_message_away() -> None:
    station = Station().ready()
    station.result(511, 30, 100_000)
    station.passing(0.05)
    station.clock.advance(0.1)
    assert "ATTITUDE" in [packet.name for packet in station.send("HEARTBEAT")]


def test_a_silent_one_reports_nothing_and_a_restarted_one_begins_anew() -> None:
    station = Station().ready()
    station.result(511, 30, 100_000)
    assert "ATTITUDE" in [packet.name for packet in station.passing(1.0)]
    station.rover.is_silent = True
    assert station.passing(1.5) == []
    station.rover.is_silent = False
    station.rover.restart()
    assert not station.rover.is_armed
    assert "ATTITUDE" not in [packet.name for packet in station.passing(1.0)]
    station.result(511, 30, 100_000)
    (attitude,) = [packet for packet in station.passing(0.1) if packet.name == "ATTITUDE"]
    assert attitude.values["time_ms"] == pytest.approx(1010, abs=20)
