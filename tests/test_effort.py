"""Effort and seed that an environment may ask of random tests."""

import pytest

from support.effort import effort_of


def test_what_is_asked_for() -> None:
    assert effort_of({}) == (0.0, 0)
    assert effort_of({"ROBOSC_EFFORT": "1", "ROBOSC_SEED": "-3"}) == (1.0, -3)
    assert effort_of({"ROBOSC_EFFORT": "2.5"}) == (2.5, 0)


@pytest.mark.parametrize("effort", ["0", "0.5", "-1", "nan", "inf", "much", ""])
def test_an_effort_that_cannot_be_meant(effort: str) -> None:
    with pytest.raises(ValueError, match=rf"^ROBOSC_EFFORT is .*; it is '{effort}'$"):
        effort_of({"ROBOSC_EFFORT": effort})


@pytest.mark.parametrize("seed", ["x", "1.5", ""])
def test_a_seed_that_is_no_number(seed: str) -> None:
    with pytest.raises(ValueError, match=rf"^ROBOSC_SEED is a whole number; it is '{seed}'$"):
        effort_of({"ROBOSC_SEED": seed})
