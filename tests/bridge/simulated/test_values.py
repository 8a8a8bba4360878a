"""Numbers that a person types."""

import argparse
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robosc_simulated.values import coordinate, number, number_tuple, option, seed, voltage, whole_number


@given(st.floats())
def test_a_number_is_finite_and_within_its_bounds(value: float) -> None:
    if math.isfinite(value) and -2.5 <= value <= 7:
        assert number(repr(value), -2.5, 7.0) == value
    else:
        with pytest.raises(ValueError, match=r"a number from -2\.5 to 7 is needed, not"):
            number(repr(value), -2.5, 7.0)


@given(st.integers())
def test_a_whole_number_is_within_its_bounds(value: int) -> None:
    if -3 <= value <= 9:
        assert whole_number(str(value), -3, 9) == value
    else:
        with pytest.raises(ValueError, match="a whole number from -3 to 9 is needed, not"):
            whole_number(str(value), -3, 9)


@pytest.mark.parametrize("text", ["", "x", "1.5", "1e3", "nan", "9" * 10_000, "--1", "²", "0x10"])
def test_what_is_no_whole_number_is_reported(text: str) -> None:
    with pytest.raises(ValueError, match="a whole number from 0 to 10000 is needed"):
        whole_number(text, 0, 10_000)


def test_what_has_a_unit_has_its_bounds() -> None:
    assert (coordinate("-1000"), voltage("60"), seed("2147483647")) == (-1000.0, 60.0, 2**31 - 1)
    for read, text in ((coordinate, "1000.1"), (voltage, "-0.1"), (voltage, "inf"), (seed, "-1"), (seed, "2147483648")):
        with pytest.raises(ValueError, match="is needed"):
            read(text)


def test_options_are_read_alike() -> None:
    read = option(number_tuple((coordinate, voltage), ","))
    assert read("1,2") == (1.0, 2.0)
    for text, problem in (("1", "2 numbers with `,` between them"), ("1,2,3", "2 numbers"), ("1,nan", "from 0 to 60")):
        with pytest.raises(argparse.ArgumentTypeError, match=problem):
            read(text)
