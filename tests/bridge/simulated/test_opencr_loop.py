"""OpenCR's loop on virtual time: its passes, servos that hold them up, and drives that no host has commanded."""

import itertools
import math
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from robosc_simulated import OpenCr, SimulatedTurtleBot3, VirtualHost, Walls
from support.wire import Host

PING = "ff ff fd 00 c8 03 00 01 3b fa"
PONG = "ff ff fd 00 c8 07 00 55 00 00 50 05 4c b7"
ZERO = "ff ff fd 00 c8 1d 00 03 96 00" + " 00" * 24 + " 06 a0"
SLOW = "ff ff fd 00 c8 1d 00 03 96 00 0a 00 00 00" + " 00" * 16 + " 32 00 00 00 4d 37"
BEATS = ("ff ff fd 00 c8 06 00 03 13 00 00 32 27", "ff ff fd 00 c8 06 00 03 13 00 01 37 a7")
# One refresh and one command of its motors are up to two cycles old.
CYCLES_S = 0.045


class Bench:
    """A board on virtual time."""

    def __init__(self, time: VirtualHost, robot: SimulatedTurtleBot3, port: Host) -> None:
        assert robot.opencr is not None
        self.time, self.robot, self.port = time, robot, port
        self.board: OpenCr = robot.opencr
        self.count = 0

    def beat(self, seconds: float) -> None:
        """Change the heartbeat for so long."""
        end_s = self.time.monotonic() + seconds
        while self.time.monotonic() < end_s - 1e-9:
            self.count += 1
            self.port.ask(BEATS[self.count % 2])
            self.time.sleep(min(0.1, end_s - self.time.monotonic()))

    def goals_rad_s(self) -> tuple[float, float]:
        world = self.robot.world
        return world.left.goal_rad_s * world.left.is_driven, world.right.goal_rad_s * world.right.is_driven

    def body(self) -> tuple[float, float]:
        """Linear and angular velocity of the body."""
        assert self.robot.world.pose
        return self.robot.world.speed_m_s, self.robot.world.yaw_rate_rad_s

    def took_s(self, request: str) -> float:
        """Time until a request is answered."""
        begin_s = self.time.monotonic()
        self.port.ask(request)
        return self.time.monotonic() - begin_s


@contextmanager
def bench(**arguments: object) -> Iterator[Bench]:
    with (
        VirtualHost() as time,
        SimulatedTurtleBot3("burger", walls=Walls(()), clock=time, **arguments) as robot,  # type: ignore[arg-type]
        Host(robot.base_path, time=time) as port,
    ):
        yield Bench(time, robot, port)


@pytest.fixture
def board() -> Iterator[Bench]:
    with bench() as found:
        yield found


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_servo_that_does_not_answer_holds_each_pass_up_for_half_a_second(board: Bench, side: str) -> None:
    assert board.took_s(PING) == 0.0
    getattr(board.robot, side).brown_out(0.0)
    board.time.sleep(0.1)
    begin_s = board.time.monotonic()
    for _ in range(5):
        board.port.send(PING)
    times_s = []
    for _ in range(5):
        assert board.port.packet().hex(" ") == PONG
        times_s.append(board.time.monotonic() - begin_s)
    # One packet a pass.
    assert 0.3 < times_s[0] <= 0.5
    assert [after - before for before, after in itertools.pairwise(times_s)] == pytest.approx([0.5] * 4)
    getattr(board.robot, side).brown_out(12.0)
    board.time.sleep(1.0)
    assert board.took_s(PING) == 0.0


def next_beat(board: Bench) -> int:
    board.count += 1
    return board.count % 2


@pytest.mark.parametrize(("is_beat_handled", "seconds"), [(True, 0.5), (False, 1.0)])
def test_the_other_wheel_rotates_on_until_the_pass_after_the_last_heartbeat(
    board: Bench, is_beat_handled: bool, seconds: float
) -> None:
    board.beat(0.3)
    board.port.ask(SLOW)
    board.beat(0.3)
    beat = BEATS[next_beat(board)]
    if is_beat_handled:
        board.port.ask(beat)
    board.robot.left.brown_out(0.0)
    begin_s = board.time.monotonic()
    # Bytes sent now are handled at the end of the pass.
    if not is_beat_handled:
        board.port.send(beat)
    board.port.send(ZERO)
    while board.goals_rad_s() != (0.0, 0.0):
        board.time.sleep(0.005)
    assert board.time.monotonic() - begin_s == pytest.approx(seconds, abs=0.03)


def test_without_motors_nothing_holds_it_up() -> None:
    with bench(has_motors=False) as board:
        board.robot.left.brown_out(0.0)
        board.time.sleep(0.1)
        assert board.took_s(PING) == 0.0


def test_a_button_that_is_held_for_three_seconds_drives(board: Bench) -> None:
    board.board.press(button_1=True)
    board.time.sleep(2.95)
    assert board.body() == (0.0, 0.0)
    board.time.sleep(0.2)
    # No host is connected.
    assert board.body() == pytest.approx((0.05, 0.0), abs=0.001)
    board.time.sleep(10.0)
    assert board.body() == (0.0, 0.0)
    assert board.robot.world.pose[0] == pytest.approx(0.3, abs=0.01)
    # Held on, it does not start again; let go and held, it does.
    board.board.press(button_1=False)
    board.time.sleep(0.1)
    board.board.press(button_1=True)
    board.time.sleep(3.1)
    assert board.body()[0] == pytest.approx(0.05, abs=0.001)


def test_the_other_button_drives_half_a_turn_to_the_right(board: Bench) -> None:
    board.board.press(button_2=True)
    board.time.sleep(3.1)
    assert board.body() == pytest.approx((0.0, -0.7), abs=0.02)
    board.time.sleep(8.0)
    assert board.body() == (0.0, 0.0)
    assert board.robot.world.heading_rad == pytest.approx(-math.pi, abs=0.1)


def test_a_button_that_is_let_go_between_drives_all_the_same(board: Bench) -> None:
    board.board.press(button_1=True)
    board.time.sleep(0.5)
    board.board.press(button_1=False)
    board.time.sleep(2.2)
    board.board.press(button_1=True)
    board.time.sleep(0.5)
    assert board.body()[0] == pytest.approx(0.05, abs=0.001)


def test_a_press_that_is_short_does_nothing(board: Bench) -> None:
    board.board.press(button_1=True)
    board.time.sleep(0.5)
    board.board.press(button_1=False)
    board.time.sleep(5.0)
    assert board.robot.world.pose[0] == 0.0


def test_buttons_and_the_remote_control_add_to_what_the_host_commands(board: Bench) -> None:
    board.beat(0.2)
    board.port.ask(SLOW)
    board.board.steer(0.03, -0.2)
    board.beat(0.2)
    assert board.body() == pytest.approx((0.13, 0.3), abs=0.01)
    # Its host stops it, and then is gone.
    board.port.ask(ZERO)
    board.beat(0.2)
    board.time.sleep(1.0)
    assert board.body() == pytest.approx((0.03, -0.2), abs=0.01)
    assert board.board.is_connected is False
    board.board.steer(0.0, 0.0)
    board.time.sleep(CYCLES_S * 3)
    assert board.body() == (0.0, 0.0)


def test_what_the_remote_control_wants_is_clamped_as_commands_are(board: Bench) -> None:
    for servo in (board.robot.left, board.robot.right):
        servo.table["velocity limit"] = 1023
    board.board.steer(0.0, 9.0)
    board.time.sleep(0.5)
    assert board.body()[1] == pytest.approx(2.635, abs=0.02)


def test_a_packet_waits_for_the_pass_that_handles_it() -> None:
    """Healthy passes take their time, too: a servo's answers for where it is, and more in a pass that refreshes."""
    with VirtualHost() as time, SimulatedTurtleBot3(walls=Walls(()), clock=time) as robot:
        board = OpenCr(robot.world, robot.left, robot.right, pass_s=0.0015, refresh_s=0.008)
        robot.base_line.device = board
        with Host(robot.base_path, time=time) as port:
            found = Bench(time, robot, port)
            times_s = [found.took_s(PING) for _ in range(200)]
            assert min(times_s) < 0.0016
            assert 0.007 < max(times_s) < 0.01
