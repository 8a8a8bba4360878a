"""The runtime that generated Python reads data with."""

from hypothesis import given
from hypothesis import strategies as st

from robosc.targets.code.python.runtime.reading import numbers_after, numbers_of


@given(st.lists(st.booleans(), max_size=30), st.data())
def test_numbers_after_some_flags_turned_are_those_of_the_flags(flags: list[bool], data: st.DataObject) -> None:
    turned = data.draw(st.lists(st.sampled_from(range(len(flags))), unique=True)) if flags else []
    before = numbers_of(flags)
    for number in turned:
        flags[number] = not flags[number]
    assert numbers_after(before, flags, turned) == numbers_of(flags)
