"""Driving by keys: what they mean, and a terminal in virtual time with a bridge that a test plays."""

import itertools
import math
from collections.abc import Callable, Iterator

import pytest

from robosc_bridge.host import Thread
from robosc_bridge.terminal.client import DriveTopic, RefusedError, RequestedCommand, UnreachableError
from robosc_bridge.terminal.teleop import (
    ANGULAR_RAD_S,
    EXPIRY_S,
    KEEP_ALIVE_S,
    LINEAR_M_S,
    PERIOD_S,
    PRESENT,
    PRESENT_S,
    RequestedVelocity,
    drive,
    keys_of,
)
from robosc_simulated import VirtualHost


class TestKeys:
    def test_steps_add_up_and_end_at_exactly_zero(self) -> None:
        requested = RequestedVelocity()
        for _ in range(3):
            requested.press("w", 0.0)
        assert requested.linear_m_s == 0.06
        for _ in range(3):
            requested.press("s", 0.0)
        assert requested.linear_m_s == 0.0
        assert not requested.is_motion

    def test_left_is_counter_clockwise(self) -> None:
        requested = RequestedVelocity()
        requested.press("a", 0.0)
        assert requested.angular_rad_s == 0.2
        requested.press("d", 0.0)
        requested.press("d", 0.0)
        assert requested.angular_rad_s == -0.2

    @pytest.mark.parametrize(
        ("key", "linear_m_s", "angular_rad_s"),
        [("w", LINEAR_M_S, 0.0), ("s", -LINEAR_M_S, 0.0), ("a", 0.0, ANGULAR_RAD_S), ("d", 0.0, -ANGULAR_RAD_S)],
    )
    def test_wishes_are_bounded(self, key: str, linear_m_s: float, angular_rad_s: float) -> None:
        requested = RequestedVelocity()
        for _ in range(100):
            requested.press(key, 0.0)
        assert (requested.linear_m_s, requested.angular_rad_s) == (linear_m_s, angular_rad_s)

    @pytest.mark.parametrize("key", ["x", " "])
    def test_halting(self, key: str) -> None:
        requested = RequestedVelocity()
        requested.press("w", 0.0)
        requested.press("a", 0.0)
        requested.press(key, 0.0)
        assert not requested.is_motion

    def test_other_keys_change_nothing(self) -> None:
        requested = RequestedVelocity()
        requested.press("w", 0.0)
        for key in "qrWé\x1b[":
            requested.press(key, 0.0)
        assert requested.linear_m_s == 0.02

    def test_a_wish_lapses_after_the_last_key_that_asks_for_motion(self) -> None:
        requested = RequestedVelocity()
        requested.press("w", 10.0)
        requested.press("k", 10.5)
        requested.press("?", 11.0)
        requested.expire(10.5 + EXPIRY_S - 0.01)
        assert requested.linear_m_s == 0.02
        requested.expire(10.5 + EXPIRY_S)
        assert not requested.is_motion

    def test_a_key_after_that_begins_anew(self) -> None:
        requested = RequestedVelocity()
        for _ in range(5):
            requested.press("w", 10.0)
        requested.press("k", 11.0)
        assert not requested.is_motion
        requested.press("w", 12.0)
        assert requested.linear_m_s == 0.02

    def test_the_answer_of_the_terminal_is_no_key(self) -> None:
        assert keys_of("w\x1b[0n\x1b[A") == ["w", PRESENT, "w"]

    def test_arrows_are_letters(self) -> None:
        assert keys_of("\x1b[Aa\x1b[B\x1b[C\x1b[Dx\x1b") == ["w", "a", "s", "d", "a", "x", "\x1b"]


TOPIC = DriveTopic("/cmd_vel", False)


class Bridge:
    """A bridge with an operator's stream, as the client of it has them.

    Attributes:
        requests: Time and velocities of each request: forward, and counter-clockwise, in m/s and rad/s.
        signs_s: Times at which the operator was reported present without a request, in seconds.
        heard: Stops, and commands of other kinds.
        report: Callback that reports something to the operator; set when the stream is begun.
        refusal: Refusal of a resume; None: it is never answered.
        failure: Failure of whatever is sent next.
        is_closed: True if the stream has ended in order.
    """

    def __init__(self, time: VirtualHost) -> None:
        self.requests: list[tuple[float, float, float]] = []
        self.signs_s: list[float] = []
        self.heard: list[RequestedCommand | str] = []
        self.report: Callable[[str, str], None] = lambda what, text: None
        self.refusal: str | None = ""
        self.failure: Exception | None = None
        self.is_closed = False
        self._time = time

    def operate(self, name: str, report: Callable[[str, str], None]) -> "Bridge":
        self.report = report
        return self

    def drive(self, topic: DriveTopic, linear_m_s: float, angular_rad_s: float) -> None:
        assert topic == TOPIC
        if self.failure is not None:
            raise self.failure
        self.requests.append((self._time.monotonic(), linear_m_s, angular_rad_s))

    def keep_alive(self) -> None:
        if self.failure is not None:
            raise self.failure
        self.signs_s.append(self._time.monotonic())

    def close(self) -> None:
        self.is_closed = True

    def stop(self) -> None:
        self.heard.append("stop")

    def request(self, command: RequestedCommand) -> None:
        self.heard.append(command)
        if self.refusal is None:
            self._time.sleep(math.inf)
        if self.refusal:
            raise RefusedError(self.refusal)


class Typed:
    """A terminal whose keys a test types, and the program in it.

    Attributes:
        seen: All output that it was given to show.
        answers: True if it reports that it is there when it is asked.
        asked: Number of times that it was asked.
        error: Error that has ended the program; None: it goes on, or has ended in order.
    """

    def __init__(self, time: VirtualHost) -> None:
        self.time = time
        self.bridge = Bridge(time)
        self.seen = ""
        self.answers = True
        self.asked = 0
        self.error: Exception | None = None
        self._keys = ""
        self.program = time.thread(self._run, "teleop")
        self.program.start()
        time.sleep(0.0)

    def type(self, keys: str) -> None:
        """Type, and let the program take it."""
        self._keys += keys
        self.time.sleep(0.0)

    def monotonic(self) -> float:
        return self.time.monotonic()

    def read(self, limit_s: float) -> list[str]:
        self.time.wait(lambda: bool(self._keys), limit_s)
        keys, self._keys = self._keys, ""
        return keys_of(keys)

    def write(self, text: str) -> None:
        self.seen += text
        if "\x1b[5n" in text:
            self.asked += 1
            if self.answers:
                self._keys += "\x1b[0n"

    def start(self, run: Callable[[], None]) -> Thread:
        thread = self.time.thread(run, "resume")
        thread.start()
        return thread

    def _run(self) -> None:
        try:
            drive(self, self.bridge, TOPIC)  # type: ignore[arg-type]
        except (RefusedError, UnreachableError) as error:
            self.error = error


@pytest.fixture
def typed() -> Iterator[Typed]:
    with VirtualHost(0.0) as time:
        yield Typed(time)


class TestDriving:
    def test_a_key_drives_at_once_and_it_is_said_again_while_wished(self, typed: Typed) -> None:
        typed.time.sleep(10.2)
        assert typed.bridge.requests == []
        typed.type("w\x1b[D")
        for _ in range(20):
            typed.time.sleep(0.5)
            typed.type("k")
        times_s = [time_s for time_s, *_ in typed.bridge.requests]
        assert {command[1:] for command in typed.bridge.requests} == {(0.02, 0.2)}
        assert times_s[0] == pytest.approx(10.2)
        # Every tenth of a second, and with each key.
        assert max(after_s - before_s for before_s, after_s in itertools.pairwise(times_s)) <= PERIOD_S + 1e-9
        assert len(times_s) == pytest.approx(10.0 / PERIOD_S + 20, abs=21)

    def test_without_a_key_it_halts_after_its_time_and_says_so_three_times(self, typed: Typed) -> None:
        typed.type("www")
        begin_s = typed.time.monotonic()
        typed.time.sleep(60.0)
        driven = [time_s for time_s, *command in typed.bridge.requests if command == [0.06, 0.0]]
        halted = [time_s for time_s, *command in typed.bridge.requests if command == [0.0, 0.0]]
        assert driven[-1] - begin_s == pytest.approx(EXPIRY_S - PERIOD_S)
        assert [time_s - begin_s for time_s in halted] == pytest.approx([EXPIRY_S + k * PERIOD_S for k in range(3)])
        # The operator is there, and requests nothing.
        assert len(typed.bridge.signs_s) == pytest.approx(60.0 / KEEP_ALIVE_S, abs=2)
        assert not typed.bridge.is_closed

    def test_without_a_terminal_that_answers_there_is_soon_no_sign_of_life(self, typed: Typed) -> None:
        typed.time.sleep(10.0)
        typed.answers = False
        begin_s, asked = typed.time.monotonic(), typed.asked
        typed.time.sleep(60.0)
        assert typed.asked - asked == pytest.approx(60.0 / KEEP_ALIVE_S, abs=1)
        assert begin_s + PRESENT_S - 2 * KEEP_ALIVE_S <= typed.bridge.signs_s[-1] < begin_s + PRESENT_S
        # A key is one: nothing is requested with it.
        assert typed.bridge.requests == []
        typed.type("?")
        assert typed.bridge.requests == [(typed.time.monotonic(), 0.0, 0.0)]
        typed.time.sleep(1.0)
        assert typed.bridge.signs_s[-1] > 70.0

    def test_what_was_wished_ends_with_zeros_and_the_link_stays(self, typed: Typed) -> None:
        typed.type("wx")
        typed.time.sleep(10.0)
        assert [command[1:] for command in typed.bridge.requests] == [(0.0, 0.0)] * 3
        assert not typed.bridge.is_closed

    def test_q_ends_with_a_stop_of_the_motion(self, typed: Typed) -> None:
        typed.type("www")
        typed.type("q")
        typed.program.join()
        assert [command[1:] for command in typed.bridge.requests] == [(0.06, 0.0), (0.0, 0.0)]
        assert typed.bridge.is_closed
        assert typed.error is None

    def test_the_space_bar_stops_the_robot_and_r_lets_it_go_on(self, typed: Typed) -> None:
        typed.type("w ")
        assert typed.bridge.heard == ["stop"]
        assert typed.bridge.requests[-1][1:] == (0.0, 0.0)
        assert "stopped: r lets it go on" in typed.seen
        typed.bridge.refusal = "a button that stops is pressed"
        typed.type("r")
        typed.time.sleep(KEEP_ALIVE_S)
        assert typed.bridge.heard == ["stop", RequestedCommand.RESUME]
        assert "a button that stops is pressed" in typed.seen

    def test_a_resume_without_an_answer_does_not_keep_a_stop_from_being_typed(self, typed: Typed) -> None:
        typed.bridge.refusal = None
        typed.type("r")
        typed.time.sleep(1.0)
        typed.type("r ")
        assert typed.bridge.heard == [RequestedCommand.RESUME, "stop"]
        typed.type("q")
        typed.program.join()
        assert typed.error is None

    def test_what_is_blocked_and_refused_is_shown(self, typed: Typed) -> None:
        typed.type("w")
        typed.bridge.report("blocked", "/cmd_vel")
        typed.time.sleep(1.5 * PERIOD_S)
        assert "BLOCKED /cmd_vel" in typed.seen
        typed.bridge.report("refused", "who are you?\x1b[2J")
        typed.time.sleep(1.5 * PERIOD_S)
        assert "who are you?" in typed.seen
        assert "\x1b[2J" not in typed.seen

    def test_the_end_of_the_bridge_ends_it(self, typed: Typed) -> None:
        typed.bridge.failure = UnreachableError("the bridge has ended the stream")
        typed.program.join()
        assert typed.time.monotonic() <= KEEP_ALIVE_S
        assert str(typed.error) == "the bridge has ended the stream"
        assert typed.bridge.is_closed
