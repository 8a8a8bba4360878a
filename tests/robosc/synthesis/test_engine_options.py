"""Limits and orders of the engines: nothing is left broken, and what comes out is the same."""

import gc
from collections.abc import Iterator
from dataclasses import replace

import pytest
from hypothesis import given, settings

from robosc.automata import DiscreteVariable, EventCondition, System
from robosc.errors import NodeLimitError, SynthesisCancelled
from robosc.expressions import Binary, Constant, IntegerType, VariableRead
from robosc.synthesis import EngineOptions, UnknownEngineError, register, synthesize
from robosc.synthesis.engines import _FACTORIES, Manager, limited, make_manager, reordering
from support.effort import examples
from support.families import FAMILIES
from support.random_systems import system_seeds, wide_system
from support.systems import automaton, edge, system


def test_a_synthesis_beyond_its_nodes_is_given_up(engine: str) -> None:
    made = FAMILIES["dining philosophers"](8)
    for maximum in (1, 50, 300):
        with pytest.raises(NodeLimitError, match=f"BDD node limit {maximum} exceeded"):
            synthesize(made, engine=EngineOptions(engine, maximum_nodes=maximum))
    # The manager leaves nothing behind that another synthesis would stumble over.
    gc.collect()
    assert synthesize(made, engine=EngineOptions(engine, maximum_nodes=1_000_000)) == synthesize(made, engine=engine)


def test_the_limit_is_one_of_nodes_in_use(engine: str) -> None:
    """Check that nodes that are thrown away on the way do not count."""
    made = FAMILIES["counter"](200)
    assert synthesize(made, engine=EngineOptions(engine, maximum_nodes=5_000)).added


def test_a_single_operation_of_cudd_cannot_fill_the_memory() -> None:
    pytest.importorskip("dd.cudd", reason="dd's C extension is not installed")
    manager = make_manager("cudd")
    width = 18
    manager.declare(*(f"x{place}" for place in range(2 * width)))
    with pytest.raises(NodeLimitError, match="BDD node limit 1000 exceeded"), limited(manager, 1_000):
        _far_apart(manager, width)
    assert manager.var("x0") & manager.var("x1") != manager.false


def _far_apart(manager: Manager, width: int) -> None:
    """Equality of two numbers, one below the other: it needs two to the power of their width of nodes."""
    found = manager.true
    for place in range(width):
        first, second = manager.var(f"x{place}"), manager.var(f"x{place + width}")
        found = found & manager.ite(first, second, ~second)


def _product() -> System:
    """A condition on the product of two wide integers, far too large for decision diagrams."""
    wide = IntegerType(0, 100_000)
    n, m = VariableRead("A", "n"), VariableRead("A", "m")
    variables = [DiscreteVariable(name, wide, (5,)) for name in ("n", "m")]
    arcs = [edge("a -go-> a", n=Constant(7)), edge("a -u_seen-> a", m=Constant(3))]
    made = system(automaton("A", arcs, variables=variables))
    return replace(made, conditions=(EventCondition("go", Binary("<", n, Binary("*", m, n))),))


def test_an_expression_is_broken_off_in_the_middle(engine: str) -> None:
    asked = 0

    def should_stop() -> bool:
        nonlocal asked
        asked += 1
        return asked > 200

    with pytest.raises(SynthesisCancelled):
        synthesize(_product(), engine=engine, should_stop=should_stop)
    with pytest.raises(NodeLimitError):
        synthesize(_product(), engine=EngineOptions(engine, maximum_nodes=20_000))


def test_memory_that_cudd_is_refused_is_reported_as_such() -> None:
    """Messages are those of dd, far below what the limit of nodes leaves to it."""
    pytest.importorskip("dd.cudd", reason="dd's C extension is not installed")
    manager = make_manager("cudd")
    with pytest.raises(MemoryError, match="were refused memory"), limited(manager, 10**7):
        raise ValueError("`DdNode *node` is `NULL` pointer.")


def test_other_errors_pass_the_limit(engine: str) -> None:
    manager = make_manager(engine)
    with pytest.raises(ValueError, match="something else"), limited(manager, 1_000):
        raise ValueError("something else")


@given(system_seeds())
@settings(max_examples=examples(10))
def test_reordering_changes_nothing(engine: str, seed: int) -> None:
    made = wide_system(seed)
    plain, reordered = (synthesize(made, engine=EngineOptions(engine, is_reordering=flag)) for flag in (False, True))
    assert (plain.status, plain.added, plain.initial) == (reordered.status, reordered.added, reordered.initial)
    assert plain.statistics.states == reordered.statistics.states


def test_the_order_comes_back(engine: str) -> None:
    manager = make_manager(engine)
    names = [f"x{place}" for place in range(12)]
    manager.declare(*names)
    with reordering(manager, names):
        found = manager.true
        for place in range(6):
            first, second = manager.var(names[place]), manager.var(names[place + 6])
            found = found & manager.ite(first, second, ~second)
        module = __import__(type(manager).__module__, fromlist=["reorder"])
        module.reorder(manager)
        small = found.dag_size
    assert [manager.var(name).level for name in names] == list(range(12))
    assert found.dag_size > 2 * small


@pytest.fixture
def fixed_engine() -> Iterator[str]:
    class Fixed:
        """An engine without orders."""

        def __getattr__(self, name: str) -> object:
            if name == "configure":
                raise AttributeError(name)
            return getattr(self.manager, name)

        def __len__(self) -> int:
            return len(self.manager)

        def __init__(self) -> None:
            self.manager = make_manager("autoref")

    register("fixed", Fixed)  # type: ignore[arg-type]  # it hands on what it does not know
    yield "fixed"
    del _FACTORIES["fixed"]


def test_an_engine_without_orders_says_so(fixed_engine: str) -> None:
    made = FAMILIES["dining philosophers"](3)
    assert synthesize(made, engine=fixed_engine).added
    with pytest.raises(UnknownEngineError, match="cannot change the order"):
        synthesize(made, engine=EngineOptions(fixed_engine, is_reordering=True))
