"""Two servos as wheels: what they are sent byte for byte, and what can be wrong with them."""

import logging
from collections.abc import Callable, Iterable, Iterator

import pytest

from robosc_bridge.devices.dynamixel import DynamixelBase
from robosc_bridge.devices.dynamixel_bus import BusCounters
from robosc_bridge.devices.interface import MotorFault, Velocity
from robosc_bridge.devices.robots import BURGER
from robosc_bridge.errors import DeviceFaultError, DeviceSilentError, WrongDeviceError
from robosc_simulated.line import Sending
from support.drive import PATIENT_S, Rig, rig

PINGS = ("ff ff fd 00 01 03 00 01 19 4e",)

DISARM = "ff ff fd 00 fe 0b 00 83 62 00 01 00 01 00 02 00 "

TORQUE_ON = "ff ff fd 00 fe 0b 00 83 40 00 01 00 01 01 02 01 c7 64"

ARM = "ff ff fd 00 fe 0b 00 83 62 00 01 00 01 19 02 19 b4 c5"

GOALS = "ff ff fd 00 fe 11 00 83 68 00 04 00 01 4c 00 00 00 02 b1 00 00 00 54 b6"

BACKWARD = "ff ff fd 00 fe 11 00 83 68 00 04 00 01 b4 ff ff ff 02 4f ff ff ff 52 b9"

ZERO = "ff ff fd 00 fe 11 00 83 68 00 04 00 01 00 00 00 00 02 00 00 00 00 e4 d0"

READ = "ff ff fd 00 fe 09 00 82 7e 00 15 00 01 02 3e 1e"

REBOOT = "ff ff fd 00 01 03 00 08 2f 4e"

VELOCITY_MODE = "ff ff fd 00 01 06 00 03 0b 00 01 47 63"

FORWARD = Velocity(0.15)


@pytest.fixture
def bench() -> Iterator[Rig]:
    with rig("dynamixel") as found:
        yield found


def _exchange(bench: Rig, velocity: Velocity) -> list[str]:
    """The packets of one exchange without the looks in between."""
    bench.tap.packets.clear()
    bench.base.exchange(velocity)
    return bench.tap.packets[:2]


def test_an_exchange_is_as_worked(bench: Rig) -> None:
    bench.start()
    assert _exchange(bench, Velocity(0.10, 0.5)) == [GOALS, READ]
    assert _exchange(bench, Velocity(-0.10, -0.5)) == [BACKWARD, READ]
    assert _exchange(bench, Velocity()) == [ZERO, READ]


def test_torque_comes_on_with_a_goal_of_zero_and_watchdogs_after_it(bench: Rig) -> None:
    bench.base.open()
    bench.tap.packets.clear()
    bench.base.set_torque(True)
    packets = bench.tap.packets
    assert ZERO in packets[: packets.index(TORQUE_ON)]
    assert packets.index(ARM) > packets.index(TORQUE_ON)
    assert bench.robot.left.table["bus watchdog"] == 25
    assert bench.robot.right.table["goal velocity"] == 0


def test_it_begins_with_pings_and_changes_nothing_of_what_it_refuses(bench: Rig) -> None:
    bench.base.open()
    assert bench.tap.packets[0] == PINGS[0]
    assert VELOCITY_MODE not in bench.tap.packets
    assert bench.robot.left.table["led"] == 1
    bench.base.close()
    assert bench.robot.left.table["bus watchdog"] == 0
    bench.until(lambda: bench.robot.left.table["led"] == 0)


def test_with_torque_off_no_goal_is_sent(bench: Rig) -> None:
    bench.base.open()
    bench.tap.packets.clear()
    bench.drive(FORWARD, 0.1)
    assert not [packet for packet in bench.tap.packets if packet.split()[7] == "83"]


def test_another_mode_is_changed_and_kept(bench: Rig) -> None:
    bench.robot.left.table["operating mode"] = 3
    bench.start()
    assert VELOCITY_MODE in bench.tap.packets
    assert bench.robot.left.table["operating mode"] == 1
    assert bench.drive(FORWARD, 0.2).velocity.linear_m_s == pytest.approx(0.15, abs=0.001)


@pytest.mark.parametrize("modes", [(0, 0), (1, 1), (1, 0)])
def test_drive_modes_other_than_the_factorys_are_respected(modes: tuple[int, int]) -> None:
    with rig("dynamixel") as bench:
        bench.robot.left.table["drive mode"], bench.robot.right.table["drive mode"] = modes
        bench.start()
        reading = bench.drive(Velocity(0.1, 0.5), 0.4)
        assert reading.velocity.linear_m_s == pytest.approx(0.1, abs=0.001)
        assert reading.velocity.angular_rad_s == pytest.approx(0.5, abs=0.01)
        bench.drive(seconds=0.1)
        reading = bench.drive()
        assert (reading.pose.x_m, reading.pose.y_m) == pytest.approx(bench.robot.world.pose[:2], abs=0.001)
        assert bench.robot.world.pose[0] > 0.02


@pytest.mark.parametrize(
    ("item", "value", "problem"),
    [
        ("drive mode", 4, r"motor 1 \(left\) has drive mode 4: a time-based profile.* set address 10 to 0"),
        ("drive mode", 9, r"motor 1 \(left\) has drive mode 9: .*torque that a goal switches on; set address 10 to 1"),
        ("startup configuration", 1, r"motor 1 \(left\) would switch torque on by itself, .* set address 60 to 0"),
        ("startup configuration", 2, r"motor 1 \(left\) would .* restore an old goal, .* set address 60 to 0"),
        ("shutdown", 0, r"motor 1 \(left\) would not protect itself .* set address 63 to 52"),
        ("model number", 1200, r"motor 1 \(left\) is of model 1200; what can be driven is XH430.*XL430-W250 \(1060\)"),
        ("model number", 1030, r"motor 1 \(left\) is of model 1030, .*motor 2 \(right\) of 1060; they must be alike"),
        ("firmware version", 37, r"motor 1 \(left\) has firmware 37, without a bus watchdog"),
    ],
)
def test_what_cannot_be_driven_is_refused_with_what_to_do(bench: Rig, item: str, value: int, problem: str) -> None:
    bench.robot.left.table[item] = value
    with pytest.raises(WrongDeviceError, match=problem):
        bench.base.open()
    assert not [packet for packet in bench.tap.packets if packet.split()[7] in ("03", "83")]


def test_a_motor_without_a_startup_configuration_can_be_driven(bench: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    left = bench.robot.left
    read = left.read
    monkeypatch.setattr(left, "read", lambda address, length: (7, b"") if address == 60 else read(address, length))
    bench.start()
    assert bench.drive(FORWARD, 0.2).velocity.linear_m_s == pytest.approx(0.15, abs=0.001)


def test_a_smaller_velocity_limit_is_kept(bench: Rig) -> None:
    bench.robot.right.table["velocity limit"] = 100
    bench.start()
    assert bench.base.limits.wheel_m_s == pytest.approx(100 * BURGER.raw_m_s)
    reading = bench.drive(FORWARD, 0.2)
    assert reading.wheels_m_s == pytest.approx((0.0791, 0.0791), abs=0.001)


def test_a_motor_that_is_missing_is_named(bench: Rig) -> None:
    bench.robot.right.brown_out(0.0)
    with pytest.raises(DeviceSilentError, match=r"motor 2 \(right\) does not answer"):
        bench.base.open()


def test_motors_fresh_from_the_factory_are_found_if_wanted(bench: Rig, caplog: pytest.LogCaptureFixture) -> None:
    for servo in (bench.robot.left, bench.robot.right):
        servo.table["baud rate"] = 1
    with pytest.raises(
        DeviceSilentError, match=r"at 1000000 baud; does it have power\? A motor fresh .* speaks 57600 baud"
    ):
        bench.base.open()
    bench.base = DynamixelBase(
        bench.robot.base_path, BURGER, bauds=(1_000_000, 57_600), answer_limit_s=0.2, host=bench.host
    )
    with caplog.at_level(logging.INFO):
        bench.start()
    assert "the motors speak 57600 baud instead of 1000000" in caplog.text
    assert bench.drive(FORWARD, 0.2).velocity.linear_m_s == pytest.approx(0.15, abs=0.001)
    bench.base.close()


@pytest.mark.parametrize(
    "arguments",
    [
        {"motors": (1, 1)},
        {"bauds": ()},
        {"acceleration_rad_s2": 0.0},
        {"acceleration_rad_s2": 1e9},
        {"watchdog_s": 3.0},
    ],
)
def test_arguments_out_of_their_range_are_refused(arguments: dict[str, object]) -> None:
    with pytest.raises(ValueError, match="must"):
        DynamixelBase("/dev/none", BURGER, **arguments)  # type: ignore[arg-type]


def test_a_wrong_voltage_is_reported_and_stops_nothing(bench: Rig) -> None:
    bench.start()
    bench.robot.right.brown_out(5.8)
    reading = bench.drive(FORWARD, 0.3)
    assert reading.faults == {MotorFault.VOLTAGE}
    assert reading.is_torque_on
    assert reading.battery_v == pytest.approx(5.8)


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("turns", [0.8, -3.0, 8224.0])
def test_a_motor_that_counts_from_another_place_has_not_moved(
    bench: Rig, side: str, turns: float, caplog: pytest.LogCaptureFixture
) -> None:
    bench.start()
    before = bench.drive(FORWARD, 0.3)
    servo = getattr(bench.robot, side)
    with bench.robot.time.lock:
        servo.set_position(round(servo._position() + 4096 * turns))
    after = bench.drive(FORWARD, 0.1)
    # The other wheel goes on, and so does this one, from there.
    assert after.pose.x_m - before.pose.x_m == pytest.approx(0.015, abs=0.004)
    assert abs(after.pose.heading_rad) < 0.03
    assert (after.refused, after.is_torque_on, after.faults) == (1, True, frozenset())
    counters = bench.base.counters
    assert isinstance(counters, BusCounters)
    assert (counters.implausible, counters.begun_anew) == (1, 1)
    assert f"the {side} wheel would have turned by" in caplog.text


def _spoil(bench: Rig, begin: int, times: int) -> None:
    """Let four bytes of the left motor's next measurements be what they cannot be, with a right checksum."""
    servo, read = bench.robot.left, bench.robot.left.read
    left = times

    def spoilt(address: int, length: int) -> tuple[int, bytes]:
        nonlocal left
        error, data = read(address, length)
        if address == 126 and left:
            left -= 1
            data = data[:begin] + b"\xfd\xfd\xfd\xfd" + data[begin + 4 :]
        return error, data

    servo.read = spoilt  # type: ignore[method-assign]


@pytest.mark.parametrize("begin", [2, 6], ids=["velocity", "position"])
def test_a_measurement_that_cannot_be_is_asked_for_again(bench: Rig, begin: int) -> None:
    bench.start()
    before = bench.drive(FORWARD, 0.3)
    _spoil(bench, begin, 1)
    reading = bench.base.exchange(FORWARD)
    assert reading.pose.x_m - before.pose.x_m == pytest.approx(0.0, abs=0.01)
    assert reading.wheels_m_s[0] == pytest.approx(0.15, abs=0.01)
    assert (reading.refused, reading.faults) == (1, frozenset())


def test_measurements_that_never_can_be_are_a_silent_motor_that_is_stopped(bench: Rig) -> None:
    bench.start()
    bench.drive(FORWARD, 0.3)
    _spoil(bench, 2, 1000)
    with pytest.raises(DeviceSilentError, match="the motors do not answer with what can be: a wheel would turn at"):
        bench.base.exchange(FORWARD)
    assert bench.stops_within(0.1)
    assert bench.base.counters.implausible == 2


def test_an_overloaded_motor_is_restarted_when_asked_to_and_has_not_jumped(bench: Rig) -> None:
    bench.robot.left.set_position(4096 + 1000)
    bench.start()
    bench.drive(FORWARD, 0.3)
    bench.robot.left.overload()
    bench.drive_until(lambda reading: MotorFault.OVERLOAD in reading.faults, FORWARD)
    bench.drive(seconds=0.3)
    bench.tap.packets.clear()
    bench.base.reset()
    assert bench.tap.packets.count(REBOOT) == 1
    reading = bench.drive(FORWARD, 0.1)
    assert (reading.faults, reading.is_torque_on) == (frozenset(), False)
    assert reading.pose.x_m == pytest.approx(bench.robot.world.pose[0], abs=0.005)
    assert reading.pose.heading_rad == pytest.approx(bench.robot.world.pose[2], abs=0.05)
    bench.base.set_torque(True)
    assert bench.drive(FORWARD, 0.2).velocity.linear_m_s == pytest.approx(0.15, abs=0.001)


def test_a_hot_motor_is_not_restarted_before_it_is_cool(bench: Rig) -> None:
    bench.start()
    bench.robot.left.overheat(75.0)
    assert bench.drive().temperature_c == 75
    bench.robot.left.cool_down(63.0)
    bench.tap.packets.clear()
    with pytest.raises(DeviceFaultError, match=r"motor 1 \(left\) is at 63 degrees; let it cool down to 62 first"):
        bench.base.reset()
    assert REBOOT not in bench.tap.packets
    bench.robot.left.cool_down(62.0)
    bench.base.reset()
    assert bench.drive().faults == frozenset()


def test_an_error_that_a_restart_does_not_end_is_reported(bench: Rig) -> None:
    bench.start()
    bench.robot.left.brown_out(5.8)
    bench.robot.left.overload()
    with pytest.raises(DeviceFaultError, match=r"motor 1 \(left\) reports input voltage, even after its restart"):
        bench.base.reset()


def test_hardware_errors_from_before_are_reported_when_it_is_opened(bench: Rig) -> None:
    bench.robot.right.overload()
    bench.base.open()
    assert bench.drive(FORWARD).faults == {MotorFault.OVERLOAD}
    bench.base.reset()
    bench.base.set_torque(True)
    assert bench.drive(FORWARD).faults == frozenset()


def test_a_pause_that_trips_the_watchdogs_is_reported_and_nothing_goes_on_by_itself(bench: Rig) -> None:
    bench.start()
    bench.drive(FORWARD, 0.2)
    bench.host.sleep(0.7)
    assert bench.goals_rad_s() == (0.0, 0.0)
    bench.tap.packets.clear()
    reading = bench.base.exchange(FORWARD)
    assert MotorFault.WATCHDOG in reading.faults
    assert not [packet for packet in bench.tap.packets if packet.startswith(GOALS[:36]) and packet != ZERO]
    assert MotorFault.WATCHDOG in bench.drive(FORWARD, 0.3).faults
    assert bench.goals_rad_s() == (0.0, 0.0)
    bench.base.set_torque(True)
    assert bench.drive(FORWARD, 0.2).faults == frozenset()
    assert bench.goals_rad_s() != (0.0, 0.0)


@pytest.mark.parametrize("is_on", [True, False])
def test_motors_whose_watchdogs_tripped_do_not_go_on_when_torque_is_switched(
    bench: Rig, monkeypatch: pytest.MonkeyPatch, is_on: bool
) -> None:
    bench.start()
    bench.drive(FORWARD, 0.2)
    bench.host.sleep(0.7)
    goals = []

    def received(data: bytes, baud: int, receive: Callable[..., Iterable[Sending]] = bench.tap.receive) -> object:
        answers = receive(data, baud)
        goals.append(bench.goals_rad_s())
        return answers

    monkeypatch.setattr(bench.tap, "receive", received)
    bench.tap.packets.clear()
    bench.base.set_torque(is_on)
    assert set(goals) == {(0.0, 0.0)}
    writes = [packet.split()[7:9] for packet in bench.tap.packets if packet.split()[7] in ("03", "83")]
    cleared = ["03", "62"] if is_on else ["83", "62"]
    assert writes.index(["83", "40"]) < writes.index(cleared)


def test_a_motor_that_was_away_has_not_jumped(bench: Rig) -> None:
    bench.robot.left.set_position(4096 + 1000)
    bench.start()
    bench.drive(seconds=0.1)
    bench.hurry()
    bench.robot.left.brown_out(0.0)
    with pytest.raises(DeviceSilentError):
        bench.drive(seconds=1.0)
    # It is pushed on unseen, so that falling back does not look as a jump.
    bench.robot.left.set_position(4096 + 1000 + 2500)
    bench.robot.left.brown_out(12.0)
    bench.host.sleep(0.4)
    bench.take_time()
    reading = bench.drive()
    assert MotorFault.TORQUE_LOST in reading.faults
    assert (reading.pose.x_m, reading.pose.heading_rad) == (0.0, 0.0)


def test_a_restart_while_nothing_is_asked_is_noticed_before_the_wheels_are_commanded(bench: Rig) -> None:
    bench.robot.left.set_position(50_000)
    bench.base.open()
    bench.drive()
    bench.robot.left.reboot()
    bench.host.sleep(0.5)
    reading = bench.drive(seconds=0.2)
    assert (reading.pose.x_m, reading.pose.heading_rad) == (0.0, 0.0)
    bench.base.set_torque(True)
    assert bench.robot.left.table["led"] == 1
    assert bench.drive(FORWARD, 0.2).velocity.linear_m_s == pytest.approx(0.15, abs=0.001)


def test_a_silent_motor_does_not_keep_the_other_one_from_being_let_go(bench: Rig) -> None:
    bench.start()
    bench.drive(FORWARD, 0.1)
    bench.robot.left.brown_out(0.0)
    bench.tap.packets.clear()
    bench.base.close()
    bench.until(lambda: not bench.robot.right.table["torque enable"])
    assert bench.goals_rad_s() == (0.0, 0.0)
    assert not [packet for packet in bench.tap.packets if packet.startswith(DISARM)]


HARDWARE = "ff ff fd 00 01 07 00 02 46 00 01 00 3c a3"


def test_the_wheels_speed_up_as_wanted(bench: Rig) -> None:
    bench.base = DynamixelBase(
        bench.robot.base_path, BURGER, acceleration_rad_s2=5.0, answer_limit_s=PATIENT_S, host=bench.host
    )
    bench.start()
    assert bench.robot.left.table["profile acceleration"] == 13
    begin_s = bench.host.monotonic()
    bench.drive_until(lambda reading: reading.wheels_m_s[0] > 0.145, FORWARD)
    assert 0.5 < bench.host.monotonic() - begin_s < 1.5
    assert bench.drive(FORWARD).faults == frozenset()
    bench.base.close()


@pytest.mark.parametrize(
    ("provoke", "fault"),
    [("overload", MotorFault.OVERLOAD), ("overheat", MotorFault.OVERHEATING)],
)
def test_a_motor_that_shuts_down_stops_the_other_one_at_once(bench: Rig, provoke: str, fault: MotorFault) -> None:
    bench.start()
    bench.drive(FORWARD, 0.2)
    getattr(bench.robot.left, provoke)()
    bench.tap.packets.clear()
    reading = bench.base.exchange(FORWARD)
    assert fault in reading.faults
    assert not reading.is_torque_on
    assert bench.stops_within(0.1)
    assert bench.tap.packets[2] == HARDWARE
    assert bench.tap.packets[3] == ZERO
    # The motors stand still, whatever is wanted then.
    assert fault in bench.drive(FORWARD, 0.2).faults
    assert bench.goals_rad_s() == (0.0, 0.0)
    with pytest.raises(DeviceFaultError, match=rf"motor 1 \(left\) reports {fault}; it must be reset"):
        bench.base.set_torque(True)


def test_a_watchdog_that_trips_unseen_is_reported_soon(bench: Rig) -> None:
    bench.start()
    bench.drive(FORWARD, 0.2)
    bench.robot.right.table["bus watchdog"] = 0xFF
    begin_s = bench.host.monotonic()
    bench.drive_until(lambda reading: MotorFault.WATCHDOG in reading.faults, FORWARD)
    assert bench.host.monotonic() - begin_s < 0.3


def test_torque_that_is_lost_without_a_word_is_reported_soon(bench: Rig) -> None:
    bench.start()
    bench.drive(FORWARD, 0.2)
    bench.robot.right.write(64, b"\0")
    begin_s = bench.host.monotonic()
    reading = bench.drive_until(lambda reading: MotorFault.TORQUE_LOST in reading.faults, FORWARD)
    assert bench.host.monotonic() - begin_s < 0.3
    assert not reading.is_torque_on
    assert bench.stops_within(0.1)
    assert MotorFault.TORQUE_LOST in bench.drive(FORWARD, 0.2).faults
    assert bench.goals_rad_s() == (0.0, 0.0)


@pytest.mark.parametrize("turns", [-3, 0, 7])
def test_a_motor_that_restarts_in_motion_has_not_jumped_and_stops_both(turns: int) -> None:
    with rig("dynamixel") as bench:
        bench.robot.left.set_position(4096 * turns + 1000)
        bench.start()
        bench.drive(FORWARD, 0.3)
        bench.hurry()
        bench.robot.left.reboot()
        sent_at_s = bench.host.monotonic()
        with pytest.raises(DeviceSilentError, match=r"motor 1 \(left\)"):
            bench.drive(FORWARD, 1.0)
        assert bench.host.monotonic() - sent_at_s < 0.3
        assert bench.stops_within(0.2)
        reading = None
        while reading is None:
            try:
                reading = bench.base.exchange(FORWARD)
            except DeviceSilentError:
                assert bench.host.monotonic() - sent_at_s < 5.0
                assert bench.goals_rad_s() == (0.0, 0.0)
        assert MotorFault.TORQUE_LOST in reading.faults
        assert not reading.is_torque_on
        assert reading.pose.x_m == pytest.approx(bench.robot.world.pose[0], abs=0.01)
        # The wheel rolls on unseen for a part of the time above; a jump would be a turn of it, 0.7 rad.
        assert reading.pose.heading_rad == pytest.approx(bench.robot.world.pose[2], abs=0.2)
        assert bench.goals_rad_s() == (0.0, 0.0)
        bench.take_time()
        bench.base.reset()
        bench.base.set_torque(True)
        assert bench.drive(FORWARD, 0.2).velocity.linear_m_s == pytest.approx(0.15, abs=0.001)


def test_a_restart_without_any_silence_is_found_where_the_position_jumps(bench: Rig) -> None:
    bench.robot.left.set_position(50_000)
    bench.start()
    bench.drive(Velocity(0.02), 0.2)
    bench.robot.left._boot()
    assert MotorFault.TORQUE_LOST in bench.base.exchange(Velocity(0.02)).faults
    assert bench.stops_within(0.2)
    assert bench.base.exchange(Velocity()).pose.x_m == pytest.approx(bench.robot.world.pose[0], abs=0.002)
