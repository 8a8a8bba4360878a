"""Managers of OxiDD: that they grow, and where they end, changes nothing of what comes out."""

import subprocess
import sys
from collections.abc import Iterator
from itertools import product
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robosc import oxidd_diagrams
from robosc.errors import NodeLimitError
from robosc.oxidd_diagrams import DDMemoryError, OxiddManager, Predicate, reorder
from robosc.synthesis import EngineOptions, register, synthesize
from robosc.synthesis.engines import _FACTORIES, limited, node_check
from support.effort import examples
from support.families import FAMILIES
from support.random_systems import random_system, system_seeds

NAMES = tuple(f"x{place}" for place in range(8))


@pytest.fixture(scope="module")
def small() -> Iterator[list[OxiddManager]]:
    """The managers of the engine `small`, which are full again and again."""
    made: list[OxiddManager] = []

    def factory() -> OxiddManager:
        made.append(OxiddManager(32, 8))
        return made[-1]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(oxidd_diagrams, "_SLOTS_GROW", 2)
        patch.setattr(oxidd_diagrams, "_NODES_GROW", 2)
        register("small", factory)
        yield made
    del _FACTORIES["small"]


def _function(manager: Any, names: tuple[str, ...], table: int) -> Any:
    """The function whose value for each choice of bits is a bit of a number."""
    if not names:
        return manager.true if table & 1 else manager.false
    half = 2 ** (len(names) - 1)
    high, low = _function(manager, names[1:], table >> half), _function(manager, names[1:], table & (2**half - 1))
    return manager.ite(manager.var(names[0]), high, low)


def _table(manager: Any, node: Any) -> list[bool]:
    return [
        bool(manager.let(dict(zip(NAMES, bits, strict=True)), node) == manager.true)
        for bits in product((True, False), repeat=len(NAMES))
    ]


@settings(max_examples=examples(15))
@given(st.integers(0, 2**256 - 1), st.integers(0, 2**256 - 1), st.permutations(NAMES))
def test_predicates_stay_what_they_are_while_their_manager_grows(one: int, other: int, order: list[str]) -> None:
    manager = OxiddManager(16, 4)
    manager.declare(*NAMES)
    manager.set_order(order)
    a, b = _function(manager, NAMES, one), _function(manager, NAMES, other)
    values = (
        [bool(one >> place & 1) for place in reversed(range(256))],
        [bool(other >> place & 1) for place in reversed(range(256))],
    )
    assert manager.generation or a.dag_size < 32
    assert (_table(manager, a), _table(manager, b)) == values
    assert manager.order() == order
    assert a & b == _function(manager, NAMES, one & other)
    assert a | ~b == _function(manager, NAMES, one | (~other & (2**256 - 1)))
    assert manager.implies(a & b, a)
    manager.set_order(NAMES)
    assert _table(manager, a) == values[0]


def test_what_is_kept_of_functions_is_made_anew() -> None:
    manager = OxiddManager(16, 4)
    manager.declare(*NAMES)
    pair = manager.var("x0") & manager.var("x1")
    assert manager.exist(["x0"], pair) == manager.var("x1")
    assert manager.support(pair, NAMES) == {"x0", "x1"}
    manager._rebuild(64, 4)
    assert manager.exist(["x0"], pair) == manager.var("x1")
    assert manager.support(pair, NAMES) == manager.support(pair) == {"x0", "x1"}
    assert manager.support(manager.true) == set()


@settings(max_examples=examples(15), deadline=None)
@given(system_seeds())
def test_synthesis_is_the_same_whatever_grows_meanwhile(small: list[OxiddManager], seed: int) -> None:
    made = random_system(seed)
    grown, plain = synthesize(made, engine="small"), synthesize(made, engine="oxidd")
    assert (grown.status, grown.added, grown.initial) == (plain.status, plain.added, plain.initial)
    # A closure that has begun anew counts for a race once.
    assert grown.statistics.race == plain.statistics.race
    assert grown.statistics.peak_nodes == plain.statistics.peak_nodes


@pytest.mark.parametrize("family", ["dining philosophers", "transfer line"])
def test_closures_begin_anew(small: list[OxiddManager], family: str) -> None:
    small.clear()
    made = FAMILIES[family](4)
    assert synthesize(made, engine="small").added == synthesize(made, engine="oxidd").added
    assert max(manager.generation for manager in small) > 3


def _far_apart(manager: Any, width: int) -> Any:
    """Equality of two numbers, one below the other: it needs two to the power of their width of nodes."""
    manager.declare(*(f"x{place}" for place in range(2 * width)))
    found = manager.true
    for place in range(width):
        first, second = manager.var(f"x{place}"), manager.var(f"x{place + width}")
        found = found & manager.ite(first, second, ~second)
    return found


def test_a_single_operation_cannot_fill_the_memory() -> None:
    manager = OxiddManager()
    with pytest.raises(NodeLimitError, match="BDD node limit 1000 exceeded"), limited(manager, 1_000):
        _far_apart(manager, 20)
    assert manager.var("x0") & manager.var("x1") != manager.false


def test_an_operation_can_be_ended_whenever_it_has_filled_its_manager() -> None:
    manager = OxiddManager(2**10, 2**8)

    def pause() -> None:
        raise KeyboardInterrupt

    manager.pause = pause
    with pytest.raises(KeyboardInterrupt):
        _far_apart(manager, 16)
    manager.pause = lambda: None
    assert _far_apart(manager, 12).dag_size == 3 * 2**12 - 3


def test_more_nodes_than_a_manager_may_have_are_refused_without_a_limit_too() -> None:
    manager = OxiddManager(2**10, 2**8)
    manager.limit(2**11)
    with pytest.raises(DDMemoryError, match="more nodes than there may be"):
        _far_apart(manager, 12)


def test_garbage_is_thrown_away_when_it_is_due() -> None:
    manager = OxiddManager(2**16, 2**8)
    check = node_check([manager], None)
    for _ in range(4):
        _far_apart(manager, 10)
        check()
    assert len(manager) < 200


def test_memory_that_is_refused_is_reported_as_such() -> None:
    code = """
import resource
from pathlib import Path
from robosc.oxidd_diagrams import OxiddManager
pages = int(Path("/proc/self/statm").read_text().split()[0])
resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + 2**27,) * 2)
manager = OxiddManager()
width = 24
manager.declare(*(f"x{place}" for place in range(2 * width)))
found = manager.true
try:
    for place in range(width):
        first, second = manager.var(f"x{place}"), manager.var(f"x{place + width}")
        found = found & manager.ite(first, second, ~second)
except MemoryError as error:
    print(error)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "the decision diagrams were refused memory\n"


def test_a_copied_process_can_use_a_manager() -> None:
    code = """
import os
from robosc.oxidd_diagrams import OxiddManager
manager = OxiddManager()
manager.declare("a", "b")
a, b = manager.var("a"), manager.var("b")
pid = os.fork()
if pid == 0:
    found = a & b
    manager.collect_garbage()
    del manager
    os._exit(0 if found.dag_size == 3 else 1)
assert os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]) == 0
"""
    subprocess.run([sys.executable, "-c", code], check=True)


def test_variables_go_where_diagrams_are_smallest() -> None:
    manager = OxiddManager()
    found = _far_apart(manager, 5)
    before = found.dag_size
    reorder(manager)
    assert found.dag_size < before / 2
    names = manager.names
    reorder(manager, {name: level for level, name in enumerate(names)})
    assert found.dag_size == before


def test_a_synthesis_may_change_the_order() -> None:
    made = FAMILIES["dining philosophers"](6)
    options = EngineOptions("oxidd", is_reordering=True)
    assert synthesize(made, engine=options).added == synthesize(made, engine="oxidd").added


def test_a_constant_has_no_cofactors() -> None:
    manager = OxiddManager()
    with pytest.raises(ValueError, match="no cofactors"):
        assert manager.true.cofactors
    assert manager.true != 1
    assert isinstance(manager.true, Predicate)
