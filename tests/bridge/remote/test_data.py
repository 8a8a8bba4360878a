import math
from typing import Any

import pytest
from google.protobuf.struct_pb2 import Value
from hypothesis import given
from hypothesis import strategies as st

from robosc.expressions.values import read_double, read_integer
from robosc_bridge.remote.data import (
    MAXIMUM_DEPTH,
    MAXIMUM_NAME,
    MAXIMUM_VALUES,
    DataError,
    plain_of,
    struct_of,
    text_of,
    value_of,
)

DATA = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers(-(2**53), 2**53) | st.text(),
    lambda parts: st.lists(parts, max_size=4) | st.dictionaries(st.text(max_size=20), parts, max_size=4),
    max_leaves=20,
)


def same(a: Any, b: Any) -> bool:
    if isinstance(a, float) and math.isnan(a):
        return isinstance(b, float) and math.isnan(b)
    if isinstance(a, list):
        return isinstance(b, list) and len(a) == len(b) and all(map(same, a, b))
    if isinstance(a, dict):
        return isinstance(b, dict) and a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    return bool(a == b) and isinstance(a, bool) == isinstance(b, bool)


@given(DATA)
def test_data_come_back_as_they_went(data: Any) -> None:
    assert same(data, plain_of(Value.FromString(value_of(data).SerializeToString())))


@pytest.mark.parametrize(
    ("number", "whole"), [(3.0, 3), (-4.0, -4), (0.0, 0), (-0.0, 0), (2.0**53, 2**53), (2147483647.0, 2147483647)]
)
def test_whole_numbers_are_whole_for_the_model(number: float, whole: int) -> None:
    found = plain_of(Value(number_value=number))
    assert type(found) is int
    assert found == whole
    assert read_double(found) == number


def test_whole_numbers_reach_an_integer_of_the_model() -> None:
    assert read_integer(plain_of(Value(number_value=7.0))) == 7
    assert read_integer(plain_of(Value(number_value=7.5))) is None


@pytest.mark.parametrize("number", [0.5, 2.0**53 + 2.0, 1e300, math.inf, -math.inf])
def test_other_numbers_are_doubles(number: float) -> None:
    found = plain_of(Value(number_value=number))
    assert type(found) is float
    assert found == number


def test_not_a_number_stays_one() -> None:
    found = plain_of(value_of({"ranges": [math.nan, 1.5]}))
    assert math.isnan(found["ranges"][0])


def nested(levels: int) -> Value:
    """Lists in each other."""
    value = Value()
    inner = value
    for _ in range(levels):
        inner = inner.list_value.values.add()
    return value


def test_nesting_is_bounded() -> None:
    plain_of(nested(MAXIMUM_DEPTH))
    with pytest.raises(DataError, match="nested deeper than 20 levels"):
        plain_of(nested(MAXIMUM_DEPTH + 1))


def test_the_number_of_values_is_bounded() -> None:
    plain_of(value_of([None] * (MAXIMUM_VALUES - 1)))
    with pytest.raises(DataError, match="more than 20000 values"):
        plain_of(value_of([None] * MAXIMUM_VALUES))


def test_names_are_bounded() -> None:
    plain_of(value_of({"é" * (MAXIMUM_NAME // 2): 1}))
    with pytest.raises(DataError, match="a name of more than 255 bytes"):
        plain_of(value_of({"é" * (MAXIMUM_NAME // 2 + 1): 1}))


def test_a_value_of_no_kind_is_nothing() -> None:
    assert plain_of(Value()) is None


def test_empty_lists_and_dicts_are_there() -> None:
    assert plain_of(value_of([])) == []
    assert plain_of(value_of({"a": {}})) == {"a": {}}


def test_what_protobuf_does_not_take_is_made_fit() -> None:
    assert text_of("a\ud800") == "a?"
    assert struct_of({"\udcff": "\udcff"}).fields["?"].string_value == "?"
    assert value_of(10**400).number_value == math.inf
    assert value_of(-(10**400)).number_value == -math.inf
    with pytest.raises(TypeError):
        value_of(object())
