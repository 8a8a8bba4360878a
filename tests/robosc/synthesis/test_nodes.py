"""Walks over nodes against enumeration, over both engines."""

from itertools import product
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robosc.synthesis.engines import make_manager
from robosc.synthesis.nodes import cofactors, count_models, met, nodes_made, regular, renamed, restrict
from support.effort import examples

NAMES = tuple(f"x{number}" for number in range(6))
formulas = st.recursive(
    st.sampled_from(NAMES),
    lambda inner: st.one_of(
        st.tuples(st.just("not"), inner), st.tuples(st.sampled_from(["and", "or", "xor"]), inner, inner)
    ),
    max_leaves=12,
)


@pytest.fixture(scope="module", params=["cudd", "oxidd", "autoref"])
def manager(request: pytest.FixtureRequest) -> Any:
    if request.param == "cudd":
        pytest.importorskip("dd.cudd", reason="dd's C extension is not installed")
    found = make_manager(request.param)
    found.declare(*NAMES)
    return found


def build(manager: Any, formula: Any) -> Any:
    if isinstance(formula, str):
        return manager.var(formula)
    if formula[0] == "not":
        return ~build(manager, formula[1])
    left, right = build(manager, formula[1]), build(manager, formula[2])
    return {"and": left & right, "or": left | right, "xor": manager.ite(left, ~right, right)}[formula[0]]


def truth(formula: Any, values: dict[str, bool]) -> bool:
    if isinstance(formula, str):
        return values[formula]
    if formula[0] == "not":
        return not truth(formula[1], values)
    left, right = truth(formula[1], values), truth(formula[2], values)
    return {"and": left and right, "or": left or right, "xor": left != right}[formula[0]]


VALUATIONS = [dict(zip(NAMES, bits, strict=True)) for bits in product((False, True), repeat=len(NAMES))]


def with_names(formula: Any, names: dict[str, str]) -> Any:
    if isinstance(formula, str):
        return names.get(formula, formula)
    return (formula[0], *(with_names(part, names) for part in formula[1:]))


@settings(max_examples=examples(60))
@given(formula=formulas, places=st.sets(st.integers(0, 2)))
def test_renaming(manager: Any, formula: Any, places: set[int]) -> None:
    """Each variable is called like its neighbour, which the predicate does not depend on."""
    own = with_names(formula, {f"x{2 * place + 1}": f"x{2 * place}" for place in range(3)})
    names = {f"x{2 * place}": f"x{2 * place + 1}" for place in places}
    assert renamed(manager, names, build(manager, own)) == build(manager, with_names(own, names))


@settings(max_examples=examples(60))
@given(formula=formulas, other=formulas, names=st.sets(st.sampled_from(NAMES)))
def test_what_two_predicates_meet_in(manager: Any, formula: Any, other: Any, names: set[str]) -> None:
    found = met(manager, sorted(names), build(manager, formula), build(manager, other))
    for values in VALUATIONS:
        others = [
            values | dict(zip(sorted(names), bits, strict=True)) for bits in product((False, True), repeat=len(names))
        ]
        expected = any(truth(formula, item) and truth(other, item) for item in others)
        assert (manager.let(values, found) == manager.true) == expected


def _chosen(manager: Any, names: tuple[str, ...], table: int) -> Any:
    """The function whose value for each choice of bits is a bit of a number."""
    if not names:
        return manager.true if table & 1 else manager.false
    half = 2 ** (len(names) - 1)
    high, low = _chosen(manager, names[1:], table >> half), _chosen(manager, names[1:], table & (2**half - 1))
    return manager.ite(manager.var(names[0]), high, low)


@settings(max_examples=examples(60))
@given(table=st.integers(0, 2**64 - 1), order=st.permutations([*NAMES, *(f"{name}'" for name in NAMES)]))
@pytest.mark.parametrize("engine", ["cudd", "oxidd", "autoref"])
def test_names_are_right_whatever_becomes_of_the_order_meanwhile(engine: str, table: int, order: list[str]) -> None:
    if engine == "cudd":
        pytest.importorskip("dd.cudd", reason="dd's C extension is not installed")
    manager: Any = make_manager(engine)
    manager.declare(*order)
    before = _chosen(manager, tuple(f"{name}'" for name in NAMES), table)
    expected = _chosen(manager, NAMES, table)
    others = [
        _chosen(manager, (*NAMES[3:], *(f"{name}'" for name in NAMES[:3])), table ^ number) for number in range(3)
    ]
    manager.configure(reordering=True)
    if engine == "autoref":
        # It asks for another order when it has grown to twice this, which is in the middle of the work then.
        manager._bdd._last_len = len(manager) // 2 + table % 16
    assert renamed(manager, {f"{name}'": name for name in NAMES}, before) == expected
    assert len(others) == 3


@settings(max_examples=examples(60))
@given(formula=formulas)
def test_counting(manager: Any, formula: Any) -> None:
    expected = sum(truth(formula, values) for values in VALUATIONS)
    assert count_models(manager, build(manager, formula), NAMES) == expected


@settings(max_examples=examples(60))
@given(formula=formulas, care=formulas)
def test_restricting_keeps_what_matters(manager: Any, formula: Any, care: Any) -> None:
    node, cared = build(manager, formula), build(manager, care)
    assert restrict(manager, node, cared) & cared == node & cared


@settings(max_examples=examples(60))
@given(formula=formulas)
def test_cofactors_are_the_branches_of_the_top_variable(manager: Any, formula: Any) -> None:
    node = build(manager, formula)
    if node in (manager.true, manager.false):
        return
    low, high = cofactors(node)
    assert low == manager.let({node.var: False}, node)
    assert high == manager.let({node.var: True}, node)


def test_counting_is_exact_beyond_a_double() -> None:
    manager = make_manager("autoref")
    names = [f"y{number}" for number in range(200)]
    manager.declare(*names)
    node = manager.var("y0")
    assert count_models(manager, node, names) == 2**199
    assert count_models(manager, node | manager.var("y199"), names) == 2**199 + 2**198


def nodes_of(predicate: Any) -> set[Any]:
    node = regular(predicate)
    return set() if node.var is None else {node} | nodes_of(node.low) | nodes_of(node.high)


@settings(max_examples=examples(60))
@given(before=formulas, more=formulas, touched=st.frozensets(st.integers(0, len(NAMES) - 1)))
def test_no_node_that_was_made_is_missed_and_few_others_are_counted(
    manager: Any, before: Any, more: Any, touched: frozenset[int]
) -> None:
    known = build(manager, before)
    found = known | build(manager, more)
    made = nodes_made(found, known, touched)
    assert len(nodes_of(found) - nodes_of(known)) <= made <= len(nodes_of(found))
    assert nodes_made(known, known, touched) == 0


def test_what_a_step_has_only_moved_is_not_counted(manager: Any) -> None:
    moved, *others = map(manager.var, NAMES)
    rest = others[0] & others[1] | others[2] & others[3]
    known = moved & rest
    found = known | ~moved & rest
    assert nodes_made(found, known, {moved.level}) == 0
    assert nodes_made(~moved & rest, known, {moved.level}) == 1
    # If the step does not touch the variable, nothing says that what is on its other side was there.
    assert nodes_made(~moved & rest, known, ()) > 1
