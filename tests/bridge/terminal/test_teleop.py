"""Driving by keys: the command as a program on a real pseudo-terminal."""

import pytest

from robosc_bridge.terminal.teleop import ANGULAR_RAD_S, LAPSE_S, LINEAR_M_S, PRESENT, Wished, keys_of


class TestKeys:
    def test_steps_add_up_and_end_at_exactly_zero(self) -> None:
        wished = Wished()
        for _ in range(3):
            wished.press("w", 0.0)
        assert wished.linear_m_s == 0.06
        for _ in range(3):
            wished.press("s", 0.0)
        assert wished.linear_m_s == 0.0
        assert not wished.is_motion

    def test_left_is_counter_clockwise(self) -> None:
        wished = Wished()
        wished.press("a", 0.0)
        assert wished.angular_rad_s == 0.2
        wished.press("d", 0.0)
        wished.press("d", 0.0)
        assert wished.angular_rad_s == -0.2

    @pytest.mark.parametrize(
        ("key", "linear_m_s", "angular_rad_s"),
        [("w", LINEAR_M_S, 0.0), ("s", -LINEAR_M_S, 0.0), ("a", 0.0, ANGULAR_RAD_S), ("d", 0.0, -ANGULAR_RAD_S)],
    )
    def test_wishes_are_bounded(self, key: str, linear_m_s: float, angular_rad_s: float) -> None:
        wished = Wished()
        for _ in range(100):
            wished.press(key, 0.0)
        assert (wished.linear_m_s, wished.angular_rad_s) == (linear_m_s, angular_rad_s)

    @pytest.mark.parametrize("key", ["x", " "])
    def test_halting(self, key: str) -> None:
        wished = Wished()
        wished.press("w", 0.0)
        wished.press("a", 0.0)
        wished.press(key, 0.0)
        assert not wished.is_motion

    def test_other_keys_change_nothing(self) -> None:
        wished = Wished()
        wished.press("w", 0.0)
        for key in "qrWé\x1b[":
            wished.press(key, 0.0)
        assert wished.linear_m_s == 0.02

    def test_a_wish_lapses_after_the_last_key_that_asks_for_motion(self) -> None:
        wished = Wished()
        wished.press("w", 10.0)
        wished.press("k", 10.5)
        wished.press("?", 11.0)
        wished.lapse(10.5 + LAPSE_S - 0.01)
        assert wished.linear_m_s == 0.02
        wished.lapse(10.5 + LAPSE_S)
        assert not wished.is_motion

    def test_a_key_after_that_begins_anew(self) -> None:
        wished = Wished()
        for _ in range(5):
            wished.press("w", 10.0)
        wished.press("k", 11.0)
        assert not wished.is_motion
        wished.press("w", 12.0)
        assert wished.linear_m_s == 0.02

    def test_the_answer_of_the_terminal_is_no_key(self) -> None:
        assert keys_of("w\x1b[0n\x1b[A") == ["w", PRESENT, "w"]

    def test_arrows_are_letters(self) -> None:
        assert keys_of("\x1b[Aa\x1b[B\x1b[C\x1b[Dx\x1b") == ["w", "a", "s", "d", "a", "x", "\x1b"]
