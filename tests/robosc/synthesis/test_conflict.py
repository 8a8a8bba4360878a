"""Minimal conflicts and removals against going through every subset."""

from collections.abc import Callable
from itertools import chain, combinations

from hypothesis import given, settings
from hypothesis import strategies as st

from robosc.synthesis.conflict import minimal_conflict, minimal_removal
from support.effort import examples

SETS = st.lists(st.frozensets(st.integers(0, 6), min_size=1, max_size=4), min_size=1, max_size=5)


def is_empty_by(conflicts: list[frozenset[int]]) -> Callable[[frozenset[int]], bool]:
    return lambda kept: any(conflict <= kept for conflict in conflicts)


def subsets(things: range) -> list[frozenset[int]]:
    return [frozenset(item) for item in chain.from_iterable(combinations(things, n) for n in range(len(things) + 1))]


@given(SETS)
@settings(max_examples=examples(60))
def test_against_all_subsets(conflicts: list[frozenset[int]]) -> None:
    is_empty, things = is_empty_by(conflicts), range(7)
    everything = subsets(things)
    minimal = [kept for kept in everything if is_empty(kept) and not any(is_empty(kept - {item}) for item in kept)]
    maximal = [
        kept
        for kept in everything
        if not is_empty(kept) and all(is_empty(kept | {item}) for item in set(things) - kept)
    ]
    assert frozenset(minimal_conflict(things, is_empty)) in minimal
    assert frozenset(things) - frozenset(minimal_removal(things, is_empty)) in maximal


def test_early_things_are_blamed_and_stay() -> None:
    is_empty = is_empty_by([frozenset({0, 1}), frozenset({2, 3}), frozenset({4})])
    assert minimal_conflict(range(5), is_empty) == (0, 1)
    assert minimal_conflict((4, 3, 2, 1, 0), is_empty) == (4,)
    assert minimal_removal(range(5), is_empty) == (1, 3, 4)
    assert minimal_removal((4, 3, 2, 1, 0), is_empty) == (4, 2, 0)


def test_what_is_empty_anyway_has_nothing_to_blame() -> None:
    assert minimal_conflict(range(3), lambda kept: True) == ()


def test_the_questions_are_few() -> None:
    """For three of a thousand things: some 2 * 3 * log2(1000/3) + 2 * 3, not a thousand."""
    asked: list[frozenset[int]] = []
    is_empty = is_empty_by([frozenset({17, 503, 999})])

    def counted(kept: frozenset[int]) -> bool:
        asked.append(kept)
        return is_empty(kept)

    assert minimal_conflict(range(1000), counted) == (17, 503, 999)
    assert len(asked) <= 60
    asked.clear()
    assert minimal_removal(range(1000), counted) == (999,)
    assert len(asked) <= 30
