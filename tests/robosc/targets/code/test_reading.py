"""The runtime that generated Python reads data with."""

from hypothesis import given
from hypothesis import strategies as st

from robosc.targets.code.python.runtime.reading import numbers_of, turned


@given(st.lists(st.tuples(st.booleans(), st.booleans()), max_size=30))
def test_flags_that_turned_are_those_of_one_side_alone(pairs: list[tuple[bool, bool]]) -> None:
    before, after = ([pair[side] for pair in pairs] for side in (0, 1))
    assert set(turned(before, after)) == set(numbers_of(before)) ^ set(numbers_of(after))
