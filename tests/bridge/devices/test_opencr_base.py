"""A stock TurtleBot3 through its OpenCR: what it is sent byte for byte, and what can be wrong with it."""

import contextlib
import itertools
import math
import struct
from collections.abc import Callable, Iterable, Iterator

import pytest

from robosc_bridge.devices.dynamixel_bus import ANSWER_LIMIT_S, BusCounters, DynamixelBus
from robosc_bridge.devices.interface import STANDSTILL, MotorFault, Velocity
from robosc_bridge.devices.opencr import OpenCrBase
from robosc_bridge.devices.robots import BURGER, WAFFLE
from robosc_bridge.errors import DeviceError, DeviceFaultError, DeviceSilentError, WrongDeviceError
from robosc_simulated import OpenCr
from robosc_simulated.line import Sending
from support.drive import PATIENT_S, Rig, rig
from support.peer import Answers, VirtualPeer, asked, status

PING = "ff ff fd 00 c8 03 00 01 3b fa"

STATUS = "ff ff fd 00 c8 07 00 02 12 00 01 00 ba 21"

BLOCK = "ff ff fd 00 c8 07 00 02 0a 00 ac 00 b6 2f"

ZERO = "ff ff fd 00 c8 1d 00 03 96 00" + 24 * " 00" + " 06 a0"

WORKED = "ff ff fd 00 c8 1d 00 03 96 00 0a 00 00 00" + 16 * " 00" + " 32 00 00 00 4d 37"

TORQUE_ON = "ff ff fd 00 c8 06 00 03 95 00 01 4c 2d"

CALIBRATE = "ff ff fd 00 c8 06 00 03 3b 00 01 17 a5"

HEARTBEATS = ("ff ff fd 00 c8 06 00 03 13 00 00 32 27", "ff ff fd 00 c8 06 00 03 13 00 01 37 a7")

_HEARTBEAT = "ff ff fd 00 c8 06 00 03 13 00 "


@pytest.fixture
def bench() -> Iterator[Rig]:
    with rig("opencr") as found:
        yield found


def _board(bench: Rig) -> OpenCr:
    assert bench.robot.opencr is not None
    return bench.robot.opencr


def test_it_begins_with_a_ping_and_reads_the_status_before_anything_moves(bench: Rig) -> None:
    bench.base.open()
    packets = bench.tap.packets
    assert packets[0] == PING
    assert STATUS in packets
    begin = packets.index(STATUS)
    assert all(packet.split()[7] in ("01", "02") for packet in packets[: begin + 2])
    assert ZERO in packets[begin:]
    assert TORQUE_ON not in packets


def test_accelerations_that_other_software_has_left_are_cleared(bench: Rig) -> None:
    for servo in (bench.robot.left, bench.robot.right):
        servo.table["profile acceleration"] = 5
    bench.start()
    assert [servo.table["profile acceleration"] for servo in (bench.robot.left, bench.robot.right)] == [0, 0]
    bench.drive(Velocity(0.2), 0.3)
    begin_s = bench.host.monotonic()
    bench.drive_until(lambda reading: reading.wheels_m_s == (0.0, 0.0))
    assert bench.host.monotonic() - begin_s < 0.1


def test_torque_is_switched_on_as_worked_after_a_command_of_zero(bench: Rig) -> None:
    bench.base.open()
    bench.tap.packets.clear()
    bench.base.set_torque(True)
    packets = bench.tap.packets
    assert packets.count(TORQUE_ON) == 1
    assert ZERO in packets[: packets.index(TORQUE_ON)]


def test_an_exchange_commands_then_changes_the_heartbeat_then_reads(bench: Rig) -> None:
    bench.start()
    bench.tap.packets.clear()
    bench.base.exchange(Velocity(0.10, 0.50))
    command, heartbeat, block = bench.tap.packets
    assert command == WORKED
    assert heartbeat.startswith(_HEARTBEAT)
    assert block == BLOCK


def test_the_heartbeat_is_another_one_every_time(bench: Rig) -> None:
    bench.base.open()
    for _ in range(300):
        bench.base.exchange(Velocity())
    beats = [packet for packet in bench.tap.packets if packet.startswith(_HEARTBEAT)]
    assert all(one != other for one, other in itertools.pairwise(beats))
    assert set(HEARTBEATS) <= set(beats)
    assert _board(bench).is_connected


def test_the_first_heartbeat_is_another_than_the_board_has(bench: Rig) -> None:
    bench.base.open()
    last = [packet for packet in bench.tap.packets if packet.startswith(_HEARTBEAT)][-1]
    bench.base.close()
    bench.tap.packets.clear()
    bench.base.open()
    assert next(packet for packet in bench.tap.packets if packet.startswith(_HEARTBEAT)) != last


def test_with_torque_off_no_velocity_is_sent(bench: Rig) -> None:
    bench.base.open()
    bench.tap.packets.clear()
    bench.base.exchange(Velocity(0.1, 0.5))
    assert [packet.split()[7] for packet in bench.tap.packets] == ["03", "02"]
    assert WORKED not in bench.tap.packets


@pytest.mark.parametrize("velocity", [Velocity(0.22), Velocity(0.21), Velocity(0.2097), Velocity(0.2, 2.8)])
def test_a_burger_obeys_at_any_speed(bench: Rig, velocity: Velocity) -> None:
    # Beyond 265 its servos refuse the whole value and keep their last speed.
    bench.start()
    bench.drive(Velocity(0.05), 0.1)
    reading = bench.drive(velocity, 0.3)
    assert reading.wheels_m_s[1] > 0.19
    assert max(abs(speed) for speed in reading.wheels_m_s) <= 265 * BURGER.raw_m_s + 1e-6


def test_buttons_bumpers_battery_and_sensors_are_reported(bench: Rig) -> None:
    bench.base.open()
    _board(bench).press(button_2=True, bumper_1=True)
    _board(bench).set_battery(11.4)
    reading = bench.drive_until(lambda reading: reading.buttons["button_2"] and reading.battery_v == 11.4)
    assert reading.buttons == {"button_1": False, "button_2": True, "bumper_1": True, "bumper_2": False}
    assert reading.battery_share == pytest.approx(0.5)
    assert reading.temperature_c is None
    assert reading.imu["linear_acceleration_z"] == pytest.approx(9.80665)
    assert reading.imu["orientation_w"] == pytest.approx(1.0)


def test_a_battery_below_the_voltages_with_a_share_is_empty(bench: Rig) -> None:
    bench.base.open()
    _board(bench).set_battery(10.4)
    assert bench.drive_until(lambda reading: reading.battery_v == 10.4).battery_share == 0.0


def test_the_gyroscope_sees_the_turn(bench: Rig) -> None:
    bench.start()
    reading = bench.drive(Velocity(0.0, 1.0), 0.3)
    assert reading.imu["angular_velocity_z"] == pytest.approx(1.0, abs=0.02)


def test_the_gyroscope_is_calibrated_at_rest_if_asked_to() -> None:
    with rig("opencr", calibration_s=1.5) as bench:
        bench.base = OpenCrBase(
            bench.robot.base_path, BURGER, calibrates_gyro=True, answer_limit_s=PATIENT_S, host=bench.host
        )
        begin_s = bench.host.monotonic()
        bench.base.open()
        assert bench.host.monotonic() - begin_s >= 1.5
        packets = bench.tap.packets
        assert packets.count(CALIBRATE) == 1
        assert ZERO in packets[: packets.index(CALIBRATE)]
        assert bench.drive().faults == frozenset()
        bench.base.close()


def test_a_late_answer_to_another_programs_calibration_is_none_of_ours() -> None:
    with rig("opencr", answer_limit_s=0.1, calibration_s=2.0) as bench:
        # Another program calibrates and leaves; the board is silent until it is done, and answers all of it then.
        port = bench.host.open_port(bench.robot.base_path, 1_000_000)
        port.write(bytes.fromhex(CALIBRATE))
        bench.until(lambda: CALIBRATE in bench.tap.packets)
        port.close()
        with pytest.raises(DeviceSilentError):
            bench.base.open()
        end_s = bench.host.monotonic() + 5.0
        while True:
            try:
                bench.base.open()
            except DeviceError:
                assert bench.host.monotonic() < end_s
                continue
            break
        bench.base.set_torque(True)
        assert bench.drive(Velocity(0.1), 0.2).velocity.linear_m_s == pytest.approx(0.1, abs=0.002)


def test_it_does_not_start_without_motors() -> None:
    with rig("opencr", has_motors=False) as bench:
        with pytest.raises(DeviceFaultError, match=r"found no wheel motors.*check their cables"):
            bench.base.open()
        assert all(packet.split()[7] in ("01", "02") for packet in bench.tap.packets)


def test_another_robots_board_is_refused(bench: Rig) -> None:
    bench.base = OpenCrBase(bench.robot.base_path, WAFFLE, answer_limit_s=PATIENT_S, host=bench.host)
    with pytest.raises(WrongDeviceError, match="firmware is for another robot than 'waffle'"):
        bench.base.open()


def _answers(model: int, firmware: int, registers: dict[int, bytes]) -> object:
    def answer(request: bytes) -> Answers:
        device, instruction, address, length = asked(request)
        if instruction == 1:
            return [status(device, struct.pack("<HB", model, firmware))]
        if instruction == 2:
            return [status(device, registers.get(address, b"").ljust(length, b"\0")[:length])]
        return [status(device)]

    return answer


@pytest.mark.parametrize(
    ("model", "firmware", "registers", "problem"),
    [
        (1060, 45, {}, "this is device model 1060, not an OpenCR"),
        (0x5000, 1, {}, "firmware version 1 instead of 5: it is from before October 2022; update it"),
        (0x5000, 4, {}, "firmware version 4 instead of 5: it is from before October 2022; update it"),
        (0x5000, 6, {}, "firmware version 6 instead of 5: it is newer than is known here; update the bridge, or load"),
        (0x5000, 5, {2: b"\1", 18: b"\xff", 148: b"\1"}, "found no wheel motors"),
        (0x5000, 5, {2: b"\1", 18: b"\0", 148: b"\0"}, "found no wheel motors"),
    ],
)
def test_what_is_no_sound_turtlebot_is_refused(
    model: int, firmware: int, registers: dict[int, bytes], problem: str
) -> None:
    with VirtualPeer(_answers(model, firmware, registers)) as peer:  # type: ignore[arg-type]
        base = OpenCrBase(peer.path, BURGER, answer_limit_s=PATIENT_S, host=peer.time)
        with pytest.raises(DeviceError, match=problem):
            base.open()
        assert all(request[7] in (1, 2) for request in peer.requests)


def test_an_acceleration_that_the_board_keeps_is_reported() -> None:
    registers = {2: b"\1", 18: b"\0", 148: b"\1", 174: b"\5"}
    with VirtualPeer(_answers(0x5000, 5, registers)) as peer:  # type: ignore[arg-type]
        base = OpenCrBase(peer.path, BURGER, answer_limit_s=PATIENT_S, host=peer.time)
        with pytest.raises(DeviceFaultError, match="OpenCR keeps a profile acceleration; switch the robot off and on"):
            base.open()


def test_answers_to_an_earlier_session_are_not_taken_for_what_the_board_is() -> None:
    answer = _answers(0x5000, 5, {2: b"\2", 18: b"\0", 148: b"\1"})
    count = 0

    def late(request: bytes) -> Answers:
        nonlocal count
        count += 1
        # Behind the answer to the ping, what was asked before: a Burger.
        return [*([status(200, b"\1\0\0\0")] if count == 2 else []), *answer(request)]  # type: ignore[operator]

    with VirtualPeer(late) as peer:
        base = OpenCrBase(peer.path, BURGER, answer_limit_s=PATIENT_S, host=peer.time)
        with pytest.raises(WrongDeviceError, match="another robot"):
            base.open()


def _set_ticks(bench: Rig, left: int, right: int) -> None:
    """Let the wheels count from here, and wait until the board and the driver know."""
    for servo, ticks in ((bench.robot.left, left), (bench.robot.right, right)):
        servo.set_position(ticks)
    bench.host.sleep(0.05)


# Left -1 and right -3 as in the reports: the end of the left count and the begin of the right one look like a header.
@pytest.mark.parametrize("ticks", [(-1, -3), (-65536, 253), (-300, -259)])
def test_a_board_that_spoils_its_answers_is_read_in_two_parts(bench: Rig, ticks: tuple[int, int]) -> None:
    _set_ticks(bench, *ticks)
    bench.base.open()
    first = bench.drive(seconds=0.05)
    counters = bench.base.counters
    assert isinstance(counters, BusCounters)
    _board(bench).stuffs_in_place = True
    last = bench.drive(seconds=0.2)
    assert (last.pose, last.wheels_m, last.wheels_m_s) == (first.pose, first.wheels_m, (0.0, 0.0))
    found = bench.base.counters
    assert isinstance(found, BusCounters)
    assert last.refused == found.implausible > first.refused
    assert (found.begun_anew, found.unanswered) == (counters.begun_anew, counters.unanswered)


def test_a_drive_along_spoilt_answers_ends_where_it_does() -> None:
    with rig("opencr") as bench:
        _board(bench).stuffs_in_place = True
        # The counts become negative soon: every 256th of the right ones follows the left one's end.
        _set_ticks(bench, 20, 301)
        bench.start()
        reading = bench.drive(Velocity(-0.03), 10.0)
        assert reading.refused > 0
        assert reading.pose.x_m == pytest.approx(-0.3, abs=0.01)
        assert reading.pose.heading_rad == pytest.approx(0.0, abs=0.01)


def _answered_with(*blocks: bytes) -> Callable[[bytes], Answers]:
    """Answer as a sound board does; its blocks are these, in turn, and then the last one."""
    waiting = list(blocks)

    def answer(request: bytes) -> Answers:
        _, instruction, address, length = asked(request)
        if instruction == 2 and (address, length) == (10, 172):
            return [status(200, waiting.pop(0) if len(waiting) > 1 else waiting[0])]
        if instruction == 1:
            return [status(200, b"\0\x50\5")]
        known = {2: b"\1\0\0\0", 18: b"\0", 148: b"\1"}
        return [status(200, known.get(address, b"").ljust(length, b"\0") if instruction == 2 else b"")]

    return answer


def _block(uptime_ms: int, ticks: tuple[int, int] = (0, 0), raw: tuple[int, int] = (0, 0), **changes: int) -> bytes:
    data = bytearray(172)
    data[:4] = uptime_ms.to_bytes(4, "little")
    struct.pack_into("<2i2i", data, 118, *raw, *ticks)
    data[138] = 1
    for name, value in changes.items():
        data[int(name.removeprefix("at_")) - 10] = value
    return bytes(data)


@pytest.mark.parametrize(
    ("wrong", "problem"),
    [
        ({"ticks": (0, -33_686_019)}, "the right wheel would have turned"),
        ({"ticks": (90_000, 0)}, "the left wheel would have turned"),
        ({"raw": (-33_686_019, 0)}, "a wheel would turn at"),
        ({"at_149": 0x40}, "a truth value is 64"),
        ({"at_26": 2}, "a truth value is 2"),
    ],
)
def test_an_answer_that_cannot_be_is_asked_for_again(
    wrong: dict[str, object], problem: str, caplog: pytest.LogCaptureFixture
) -> None:
    sound = [_block(1000 + 50 * step) for step in range(8)]
    # From here on torque is on, as far as this board says.
    on = [_block(1400 + 20 * step, at_149=1) for step in range(40)]
    spoilt = _block(1800, **({"at_149": 1} | wrong))  # type: ignore[arg-type]
    peer_answer = _answered_with(*sound, *on)
    with VirtualPeer(lambda request: peer_answer(request)) as peer:
        base = OpenCrBase(peer.path, BURGER, answer_limit_s=PATIENT_S, host=peer.time)
        base.open()
        first = base.exchange(STANDSTILL)
        spoilt = _block(int.from_bytes(sound[-1][:4], "little") + 400, **({"at_149": 1} | wrong))  # type: ignore[arg-type]
        peer_answer = _answered_with(spoilt, _block(int.from_bytes(spoilt[:4], "little") + 20, at_149=1))
        reading = base.exchange(STANDSTILL)
        assert (first.refused, reading.refused) == (0, 1)
        assert reading.pose == first.pose
        assert reading.wheels_m_s == (0.0, 0.0)
        assert problem in caplog.text
        base.close()


def test_an_answer_that_never_can_be_is_a_silent_board() -> None:
    with VirtualPeer(_answered_with(_block(1000))) as peer:
        base = OpenCrBase(peer.path, BURGER, answer_limit_s=PATIENT_S, host=peer.time)
        base._bus = DynamixelBus(peer.time.open_port(peer.path, 1_000_000), str, PATIENT_S, peer.time)
        base.exchange(STANDSTILL)
        spoilt = _block(1000, ticks=(0, -33_686_019), at_149=1)
        peer._answer = _answered_with(spoilt)
        with pytest.raises(DeviceSilentError, match="OpenCR does not answer with what can be: the right wheel"):
            base.exchange(STANDSTILL)
        assert base.counters.implausible == 2


def test_motors_that_restart_in_a_pause_have_not_jumped(bench: Rig) -> None:
    for servo in (bench.robot.left, bench.robot.right):
        servo.set_position(4096 + 1000)
    bench.start()
    bench.drive(seconds=0.1)
    # They are pushed on unseen, so that falling back does not look as a jump.
    for servo in (bench.robot.left, bench.robot.right):
        servo.set_position(4096 + 1000 + 2500)
    _board(bench).set_battery(4.0)
    bench.host.sleep(0.1)
    _board(bench).set_battery(12.0)
    bench.host.sleep(0.5)
    reading = bench.base.exchange(Velocity())
    assert MotorFault.TORQUE_LOST in reading.faults
    assert (reading.pose.x_m, reading.pose.heading_rad) == (0.0, 0.0)


def _mute(bench: Rig, side: str) -> None:
    """Let a servo lose its cable, which takes effect in the board's next cycle."""
    getattr(bench.robot, side).brown_out(0.0)


def _opened_again(bench: Rig) -> list[str]:
    """Open it until it can be; what was wrong until then."""
    problems = []
    end_s = bench.host.monotonic() + 10.0
    while True:
        try:
            bench.base.open()
        except DeviceError as error:
            problems.append(str(error))
            assert bench.host.monotonic() < end_s, problems
            bench.host.sleep(0.25)
            continue
        return problems


def test_motors_that_were_without_power_can_be_used_again_and_have_not_jumped() -> None:
    with rig("opencr", answer_limit_s=ANSWER_LIMIT_S) as bench:
        bench.start()
        bench.robot.left.set_position(40_000)
        bench.robot.right.set_position(-90_000)
        bench.base.open()
        bench.base.set_torque(True)
        bench.drive(Velocity(0.1), 0.3)
        before = bench.robot.world.pose[0]
        _board(bench).set_battery(4.0)
        problem = _slowness(bench)
        assert "may be disconnected, or have no power; check the cables" in problem
        bench.base.close()
        _board(bench).set_battery(12.0)
        _opened_again(bench)
        reading = bench.drive()
        assert (reading.faults, reading.is_torque_on) == (frozenset(), False)
        assert bench.goals_rad_s() == (0.0, 0.0)
        assert reading.pose.x_m == pytest.approx(before, abs=0.03)
        bench.base.set_torque(True)
        bench.drive(Velocity(0.1), 0.2)
        assert bench.goals_rad_s() != (0.0, 0.0)


def _slowness(bench: Rig) -> str:
    """Exchange until the board is reported slow, as the bridge does; what is reported then."""
    for _ in range(100):
        silent = 0
        while True:
            try:
                bench.base.exchange(Velocity(0.1, 0.5))
            except DeviceSilentError:
                silent += 1
                assert silent < 3, "it counts as silent"
                continue
            except DeviceFaultError as error:
                return str(error)
            break
        bench.host.sleep(0.02)
    raise AssertionError("it is not slow")


# At whatever time of a cycle the cable comes off, also between two packets of one.
@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("after_s", [0.0, 0.004, 0.009, 0.013, 0.017])
def test_a_servo_that_does_not_answer_is_reported_and_the_other_wheel_stops(side: str, after_s: float) -> None:
    with rig("opencr", answer_limit_s=ANSWER_LIMIT_S) as bench:
        board = OpenCr(bench.robot.world, bench.robot.left, bench.robot.right, pass_s=0.0015, refresh_s=0.008)
        bench.tap.device = board
        bench.start()
        bench.drive(Velocity(0.1, 0.5), 0.3)
        begin_s = bench.host.monotonic() + after_s
        stopped_s: list[float] = []

        def watch() -> None:
            bench.host.sleep(after_s)
            _mute(bench, side)
            while bench.goals_rad_s() != (0.0, 0.0):
                bench.host.sleep(0.002)
            stopped_s.append(bench.host.monotonic() - begin_s)

        bench.host.thread(watch, "watch").start()
        problem = _slowness(bench)
        assert "OpenCR answers too slowly, as when a wheel servo does not answer it: it may be disconnected" in problem
        assert bench.host.monotonic() - begin_s < 0.8
        bench.base.close()
        bench.host.sleep(1.5)
        # A pass, and another one where the heartbeat was on its way.
        assert stopped_s
        assert stopped_s[0] < 1.03
        # It stays so, and nothing is asked in vain: each time that it is opened, one request at most is.
        bench.host.sleep(10.0)
        asked = len(bench.tap.packets)
        for count in range(4):
            with pytest.raises(DeviceFaultError, match="OpenCR answers too slowly"):
                bench.base.open()
            assert len(bench.tap.packets) - asked <= count + 1
            bench.host.sleep(0.25)
        assert bench.goals_rad_s() == (0.0, 0.0)
        # Plugged in again, it can be used again.
        getattr(bench.robot, side).brown_out(12.0)
        bench.host.sleep(1.0)
        _opened_again(bench)
        bench.base.set_torque(True)
        assert bench.drive(Velocity(0.1), 0.3).velocity.linear_m_s == pytest.approx(0.1, abs=0.002)


def test_a_board_that_is_slow_from_the_start_is_reported_as_slow() -> None:
    with rig("opencr", answer_limit_s=ANSWER_LIMIT_S) as bench:
        _mute(bench, "left")
        bench.host.sleep(0.1)
        with pytest.raises(DeviceFaultError, match="OpenCR answers too slowly"):
            bench.base.open()


def test_a_board_that_is_silent_is_not_slow() -> None:
    with rig("opencr", answer_limit_s=ANSWER_LIMIT_S) as bench:
        bench.start()
        bench.robot.base_faults.drop_share = 1.0
        for _ in range(3):
            with pytest.raises(DeviceSilentError, match="OpenCR does not answer"):
                bench.base.exchange(Velocity())
        bench.base.close()
        with pytest.raises(DeviceSilentError, match="OpenCR does not answer"):
            bench.base.open()


def test_one_answer_that_is_lost_when_it_is_opened_does_no_harm() -> None:
    with rig("opencr", answer_limit_s=ANSWER_LIMIT_S) as bench:
        bench.robot.base_faults.drop_next = 1
        bench.start()


def test_a_board_that_has_started_anew_must_be_opened_again(bench: Rig) -> None:
    bench.start()
    bench.drive(Velocity(0.1), 0.2)
    _board(bench)._began_s = bench.robot.time.now_s()
    bench.host.sleep(0.05)
    for _ in range(2):
        with pytest.raises(DeviceError, match="OpenCR has restarted; it must be opened again"):
            bench.base.exchange(Velocity(0.1))
    bench.base.open()
    assert not bench.drive().is_torque_on


@pytest.mark.parametrize(
    ("uptime_s", "problem"),
    [
        (9.0, "OpenCR has restarted; it must be opened again"),
        (11.0, "the computer stood still or OpenCR has restarted; it must be opened again"),
    ],
)
def test_a_board_whose_time_is_another_than_the_computers_has_restarted(
    bench: Rig, uptime_s: float, problem: str
) -> None:
    bench.start()
    bench.drive(Velocity(0.1), 0.2)
    _board(bench)._began_s += 10.0 - uptime_s + math.copysign(0.1, 10.0 - uptime_s)
    bench.host.sleep(10.0)
    for _ in range(2):
        with pytest.raises(DeviceError, match=problem):
            bench.base.exchange(Velocity(0.1))
        # It was commanded before it was known, which must not last.
        bench.host.sleep(0.05)
        assert bench.goals_rad_s() == (0.0, 0.0)
    bench.base.open()
    assert not bench.drive().is_torque_on


@pytest.mark.parametrize("lead_s", [-0.9, 0.0, 0.6])
def test_a_board_whose_time_is_nearly_the_computers_goes_on(bench: Rig, lead_s: float) -> None:
    bench.start()
    bench.drive(Velocity(0.1), 0.2)
    _board(bench)._began_s -= lead_s
    bench.host.sleep(10.0)
    assert bench.drive(Velocity(0.1), 0.2).velocity.linear_m_s == pytest.approx(0.1, abs=0.002)


def test_answers_that_are_late_are_no_restart() -> None:
    with rig("opencr", answer_limit_s=2.0) as bench:
        bench.start()
        bench.robot.base_faults.delay_s = 1.5
        bench.base.exchange(Velocity())
        bench.robot.base_faults.delay_s = 0.0
        assert bench.drive(Velocity(0.1), 0.2).velocity.linear_m_s == pytest.approx(0.1, abs=0.002)


def test_torque_that_is_gone_is_a_fault_that_stays_until_torque_is_switched_on_anew(bench: Rig) -> None:
    bench.start()
    bench.drive(Velocity(0.1), 0.2)
    bench.robot.left.overload()
    begin_s = bench.host.monotonic()
    reading = bench.drive_until(lambda reading: MotorFault.TORQUE_LOST in reading.faults, Velocity(0.1))
    assert bench.host.monotonic() - begin_s < 0.2
    assert not reading.is_torque_on
    assert bench.stops_within(0.1)
    # The motors stand still, whatever is wanted then.
    reading = bench.drive(Velocity(0.1), 0.2)
    assert reading.faults == {MotorFault.TORQUE_LOST}
    assert bench.goals_rad_s() == (0.0, 0.0)
    with pytest.raises(DeviceFaultError, match="a wheel motor does not hold; switch the robot off and on"):
        bench.base.set_torque(True)
    assert not bench.robot.right.table["torque enable"]
    with pytest.raises(DeviceFaultError, match="does not hold"):
        bench.base.reset()


def test_a_reading_has_the_velocity_that_the_wheels_were_commanded(bench: Rig) -> None:
    bench.start()
    reading = bench.base.exchange(Velocity(0.1, 0.5))
    # The firmware casts them to 75 and 176.
    assert reading.goals_m_s == pytest.approx((75 * BURGER.raw_m_s, 176 * BURGER.raw_m_s))
    bench.base.set_torque(False)
    assert bench.base.exchange(Velocity(0.1)).goals_m_s is None


@pytest.mark.parametrize("velocity", [Velocity(), Velocity(0.1, 0.0), Velocity(0.0, 0.6)])
def test_a_drive_of_a_button_is_a_fault_and_ends_with_the_torque(
    bench: Rig, velocity: Velocity, caplog: pytest.LogCaptureFixture
) -> None:
    bench.start()
    bench.drive(velocity, 0.5)
    _board(bench).press(button_1=True)
    begin_s = bench.host.monotonic()
    reading = bench.drive(velocity, 1.4)
    assert caplog.messages == []
    assert reading.buttons["button_1"]
    bench.drive(velocity, 1.4)
    assert [text.split(": ", 1)[1] for text in caplog.messages] == [
        "let button 1 go: held for 3 s, it lets OpenCR drive 0.3 m forward, whatever the bridge commands"
    ]
    reading = bench.drive_until(lambda reading: bool(reading.faults), velocity)
    assert reading.faults == {MotorFault.UNCOMMANDED}
    # Three seconds, a cycle or two, and half a second.
    assert bench.host.monotonic() - begin_s == pytest.approx(3.55, abs=0.05)
    assert "though the bridge has not commanded it: a button of OpenCR was held" in caplog.messages[-1]
    bench.drive(velocity, 1.0)
    assert len(caplog.messages) == 2
    begin_s = bench.host.monotonic()
    bench.base.set_torque(False)
    assert bench.host.monotonic() - begin_s < 0.2
    assert not bench.robot.world.left.is_driven
    assert bench.drive().faults == frozenset()


def test_a_remote_control_that_steers_is_a_fault(bench: Rig) -> None:
    bench.start()
    bench.drive(Velocity(0.05), 0.3)
    _board(bench).steer(0.0, 0.4)
    begin_s = bench.host.monotonic()
    reading = bench.drive_until(lambda reading: bool(reading.faults), Velocity(0.05))
    assert reading.faults == {MotorFault.UNCOMMANDED}
    assert bench.host.monotonic() - begin_s == pytest.approx(0.55, abs=0.05)
    # It ends, and a new start is possible.
    _board(bench).steer(0.0, 0.0)
    bench.base.set_torque(False)
    bench.base.set_torque(True)
    assert bench.drive(Velocity(0.05), 1.0).faults == frozenset()


def test_a_button_that_is_pressed_shortly_and_often_is_not_warned_of(
    bench: Rig, caplog: pytest.LogCaptureFixture
) -> None:
    bench.start()
    for _ in range(6):
        _board(bench).press(button_2=True)
        bench.drive(seconds=0.3)
        _board(bench).press(button_2=False)
        bench.drive(seconds=0.3)
    assert caplog.messages == []


def test_commands_that_change_at_once_are_followed(bench: Rig) -> None:
    """No stop and no turn is taken for a motion without a command."""
    bench.start()
    for velocity in (Velocity(0.2), Velocity(-0.2), Velocity(0.0, 2.0), Velocity(), Velocity(0.2, -1.0)):
        assert bench.drive(velocity, 0.8).faults == frozenset()


class _Source:
    """Source that has a newer velocity as soon as the first answer of an exchange is awaited.

    Args:
        bench: Rig whose base asks.
        velocity: The velocity; None: there is none.
        sought: Beginning of the packet whose answer is to be awaited then.
    """

    def __init__(self, bench: Rig, velocity: Velocity | None, sought: str = "") -> None:
        assert isinstance(bench.base, OpenCrBase)
        bench.base.attend(self)
        bench.tap.packets.clear()
        self._bench = bench
        self._velocity = velocity
        self._sought = sought
        self.written_after: list[int] = []
        bench.base.wake()

    def newer(self) -> Velocity | None:
        packets = self._bench.tap.packets
        if self._sought and not (packets and packets[-1].startswith(self._sought)):
            # It looks again when it is woken.
            self._bench.base.wake()
            self._bench.host.sleep(0.0001)
            return None
        velocity, self._velocity = self._velocity, None
        return velocity

    def written(self) -> None:
        self.written_after.append(len(self._bench.tap.packets))


def _words(packet: str) -> tuple[int, ...]:
    """Words of a command; none: it is another packet."""
    data = bytes.fromhex(packet)
    return struct.unpack_from("<i16xi", data, 10) if packet.startswith(ZERO[:29]) else ()


def _kinds(bench: Rig) -> list[str | tuple[int, ...]]:
    return [_words(packet) or ("beat" if packet.startswith(_HEARTBEAT) else packet) for packet in bench.tap.packets]


def test_a_newer_velocity_is_written_while_the_board_answers() -> None:
    with rig("opencr", profile="typical") as bench:
        bench.start()
        source = _Source(bench, Velocity(0.05, 0.5))
        began_s = bench.host.monotonic()
        reading = bench.base.exchange(Velocity(0.1, 0.5))
        assert _kinds(bench) == [(10, 50), (5, 50), "beat", BLOCK]
        # The goals are those that hold now.
        assert reading.goals_m_s == pytest.approx((0.01, 0.09), abs=0.001)
        assert source.written_after == [0, 1]
        # It is over in the time of one more pass.
        assert bench.host.monotonic() - began_s < 0.02
        assert isinstance(bench.base, OpenCrBase)
        assert bench.base.counters.unanswered == 0


def test_a_newer_velocity_that_is_too_late_is_none() -> None:
    with rig("opencr", profile="typical") as bench:
        bench.start()
        _Source(bench, Velocity(0.05, 0.5, until_s=bench.host.monotonic() - 1.0))
        bench.base.exchange(Velocity(0.1, 0.5))
        assert _kinds(bench) == [(10, 50), (0, 0), "beat", BLOCK]


@pytest.mark.parametrize("lost", [1, 2])
def test_a_command_is_not_repeated_after_a_newer_one(lost: int) -> None:
    with rig("opencr", profile="typical") as bench:
        bench.start()
        bench.hurry()
        _Source(bench, STANDSTILL)
        bench.robot.base_line.faults.drop_next = lost
        # A stop is sent when there was no answer at all.
        with pytest.raises(DeviceSilentError) if lost == 2 else contextlib.nullcontext():
            bench.base.exchange(Velocity(0.1, 0.5))
        bench.host.sleep(0.02)
        commands = [kind for kind in _kinds(bench) if isinstance(kind, tuple)]
        assert commands == [(10, 50), (0, 0), (0, 0)][: lost + 1]


def test_a_board_that_is_slow_is_sent_no_more_than_without_a_newer_velocity() -> None:
    counts = []
    for newer in (None, STANDSTILL):
        with rig("opencr") as bench:
            bench.start()
            bench.hurry()
            _Source(bench, newer)
            _mute(bench, "left")
            with pytest.raises(DeviceSilentError):
                bench.base.exchange(Velocity(0.1, 0.5))
            bench.host.sleep(0.001)
            assert _kinds(bench)[-1] == (0, 0)
            counts.append(len(bench.tap.packets))
            # After a silence nothing is interjected.
            _Source(bench, Velocity(0.05, 0.5))
            with pytest.raises(DeviceSilentError):
                bench.base.exchange(Velocity(0.1, 0.5))
            assert (5, 50) not in _kinds(bench)
    assert counts[0] == counts[1]


class _Forgetful:
    """A board that loses what comes while it has a packet to answer."""

    def __init__(self, board: OpenCr) -> None:
        self._board = board
        self.lost = 0
        self.baud = board.baud
        self.update, self.due_s, self.plug_in = board.update, board.due_s, board.plug_in

    def receive(self, data: bytes, baud: int) -> Iterable[Sending]:
        if self._board._waiting:
            self.lost += 1
            return []
        return self._board.receive(data, baud)


def test_a_board_that_loses_what_comes_before_it_has_answered_is_sent_no_more_of_it() -> None:
    with rig("opencr", profile="typical") as bench:
        bench.start()
        bench.hurry()
        bench.tap.device = board = _Forgetful(_board(bench))
        for number in range(5):
            velocity = Velocity(0.1, 0.1 * number)
            # Behind a read; behind a write it is unknown which of the two was lost.
            _Source(bench, velocity, BLOCK)
            assert bench.base.exchange(STANDSTILL).is_torque_on
            reading = bench.base.exchange(velocity)
            assert reading.goals_m_s == pytest.approx((0.1 - 0.008 * number, 0.1 + 0.008 * number), abs=0.001)
        # The last two waited for an answer.
        assert board.lost == 3


def test_with_torque_off_no_source_is_asked(bench: Rig) -> None:
    bench.base.open()
    source = _Source(bench, Velocity(0.1))
    bench.base.exchange(Velocity(0.1))
    assert [packet.split()[7] for packet in bench.tap.packets] == ["03", "02"]
    assert source.written_after == []
