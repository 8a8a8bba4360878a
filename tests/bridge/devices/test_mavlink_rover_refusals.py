"""Tests of the refusals of a MAVLink rover, and of the actions of others on it."""

from typing import Any

import pytest

from robosc_bridge.devices.interface import MotorFault
from robosc_bridge.errors import DeviceFaultError, DeviceSilentError, WrongDeviceError
from robosc_simulated.rover import AUTO, GUIDED, HOLD, MANUAL
from support.rovers import FORWARD, Bench, rig


def test_a_refusal_to_arm_reports_the_vehicles_reason(bench: Bench) -> None:
    bench.rover.refusal = (
        "GPS 1: Bad fix, and the compass is not calibrated either, so that nothing at all can be known"
    )
    bench.base.open()
    with pytest.raises(
        DeviceFaultError, match=r"does not arm \(failed\): PreArm: GPS 1: .* nothing at all can be known"
    ):
        bench.base.set_torque(True)
    assert not bench.drive(FORWARD, 0.1).is_torque_on
    bench.rover.refusal = ""
    bench.base.set_torque(True)
    assert bench.drive(FORWARD, 0.1).is_torque_on


LONG = "compass 2 is not calibrated; battery 1 below minimum arming voltage; check the fence, and then try again"


@pytest.mark.parametrize("lost", [(), (0,), (1,), (2,), (0, 1), (1, 2)])
def test_a_reason_whose_pieces_are_lost_says_so(bench: Bench, lost: tuple[int, ...]) -> None:
    bench.rover.refusal = LONG
    bench.rover.lost_pieces = frozenset(lost)
    bench.base.open()
    with pytest.raises(DeviceFaultError) as error:
        bench.base.set_torque(True)
    whole, text = f"PreArm: {LONG}", str(error.value).partition("(failed): ")[2]
    pieces = [whole[begin : begin + 50] for begin in range(0, len(whole), 50)]
    assert all((piece in text) == (number not in lost) for number, piece in enumerate(pieces))
    assert ("[a part of this text is missing]" in text) == bool(lost)
    assert "it gives no reason" not in text


def test_a_text_between_the_pieces_of_a_reason_hides_none_of_it(bench: Bench) -> None:
    bench.rover.refusal = LONG
    bench.rover.text_between = "EKF3 IMU0 is using GPS"
    bench.base.open()
    with pytest.raises(DeviceFaultError, match=rf"\(failed\): PreArm: {LONG}$"):
        bench.base.set_torque(True)


def test_a_refused_mode_is_reported(bench: Bench) -> None:
    bench.rover.refused_modes = (GUIDED,)
    bench.base.open()
    with pytest.raises(DeviceFaultError, match=r"does not go to mode GUIDED \(failed\): it gives no reason"):
        bench.base.set_torque(True)
    assert not bench.rover.is_armed


@pytest.mark.usefixtures("hasty")
def test_an_accepted_command_is_not_a_done_one(bench: Bench) -> None:
    bench.base.open()
    bench.rover.obeys_commands = False
    with pytest.raises(DeviceFaultError, match="accepted the command, but does not show mode GUIDED"):
        bench.base.set_torque(True)


@pytest.mark.usefixtures("hasty")
def test_commands_are_repeated_and_their_silence_is_reported(bench: Bench) -> None:
    bench.base.open()
    bench.rover.answers_commands = False
    with pytest.raises(DeviceSilentError, match="does not answer the command to go to mode GUIDED"):
        bench.base.set_torque(True)
    assert [number for number, _ in bench.rover.commands if number == 176] == [176] * 3


def test_disarming_that_is_refused_is_forced(bench: Bench) -> None:
    bench.start()
    bench.rover.refuses_disarming = True
    bench.base.set_torque(False)
    assert not bench.rover.is_armed
    assert bench.rover.commands[-1] == (400, (0.0, 21196.0, 0, 0, 0, 0, 0))


@pytest.mark.parametrize("how", ["mode", "disarmed"])
def test_a_vehicle_that_is_taken_away_is_reported_and_left_alone(bench: Bench, how: str) -> None:
    bench.start()
    bench.drive(FORWARD, 0.2)
    if how == "mode":
        bench.rover.take_over(MANUAL, -0.1)
    else:
        bench.rover.disarm()
    reading = bench.drive_until(lambda reading: not reading.is_torque_on, FORWARD, 1.5)
    assert reading.faults == {MotorFault.TORQUE_LOST}
    # It stays lost, also if it is given back: nothing moves until a person says so.
    bench.rover.take_over(GUIDED)
    reading = bench.drive(FORWARD, 1.2)
    assert not reading.is_torque_on
    assert reading.faults == {MotorFault.TORQUE_LOST}
    assert bench.speed_m_s == 0.0
    bench.base.reset()
    assert not bench.rover.is_armed
    bench.base.set_torque(True)
    assert bench.drive(FORWARD, 0.1).is_torque_on


def test_closing_leaves_a_vehicle_that_a_person_drives_to_them(bench: Bench) -> None:
    bench.start()
    bench.rover.take_over(MANUAL, -0.1)
    bench.drive_until(lambda reading: not reading.is_torque_on, FORWARD, 1.5)
    bench.base.set_torque(False)
    with pytest.raises(DeviceFaultError, match="somebody else drives the rover"):
        bench.base.set_torque(True)
    bench.base.close()
    assert bench.rover.is_armed
    assert bench.speed_m_s == pytest.approx(-0.1)
    with pytest.raises(DeviceFaultError, match="somebody else drives the rover: it is armed in mode MANUAL"):
        bench.base.open()
    assert bench.speed_m_s == pytest.approx(-0.1)


def test_a_vehicle_that_is_held_is_reported(bench: Bench) -> None:
    bench.start()
    bench.drive(FORWARD, 0.3)
    bench.world.left.is_blocked = bench.world.right.is_blocked = True
    begin_s = bench.host.monotonic()
    reading = bench.drive_until(lambda reading: bool(reading.faults), FORWARD)
    assert reading.faults == {MotorFault.BLOCKED}
    assert 1.9 < bench.host.monotonic() - begin_s < 3.0


@pytest.mark.usefixtures("hasty")
@pytest.mark.parametrize(
    ("found", "error", "words"),
    [
        ({"vehicle": (2, 3)}, WrongDeviceError, "of type 2 with autopilot 3, not ArduPilot Rover"),
        ({"vehicle": (10, 12)}, WrongDeviceError, "of type 10 with autopilot 12, not ArduPilot Rover"),
        ({"vehicle": (6, 8)}, DeviceSilentError, "no heartbeat of a rover within 1 s"),
        ({"system": 2}, WrongDeviceError, "or has another system number"),
    ],
    ids=["copter", "other autopilot", "ground station", "other system"],
)
def test_another_device_than_the_rover_is_reported(found: dict[str, Any], error: type[Exception], words: str) -> None:
    with rig(**found) as bench, pytest.raises(error, match=words):
        bench.base.open()


@pytest.mark.usefixtures("hasty")
def test_a_vehicle_that_does_not_know_where_it_is_cannot_be_driven(bench: Bench) -> None:
    bench.rover.has_origin = False
    with pytest.raises(DeviceFaultError, match="does not report where it is"):
        bench.base.open()


def test_modes_of_others_have_names(bench: Bench) -> None:
    bench.rover.is_armed = True
    for mode, name in ((AUTO, "AUTO"), (HOLD, "HOLD")):
        bench.rover.take_over(mode)
        with pytest.raises(DeviceFaultError, match=f"armed in mode {name}"):
            bench.base.open()
