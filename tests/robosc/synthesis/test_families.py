"""The families of systems at sizes that the explicit twin still manages, and one that it never could."""

import pytest

from robosc.automata import Semantics
from robosc.automata.controlled import controlled_graph
from robosc.supervisor.predicates import state_predicates
from robosc.synthesis import SynthesisStatus, synthesize
from robosc.verification import CheckOutcome, synthesize_explicit, verify_explicitly
from support.families import FAMILIES

SMALL = [
    ("dining philosophers", 2),
    ("dining philosophers", 5),
    ("transfer line", 1),
    ("token ring", 4),
    ("cat and mouse, 1 pair", 1),
    ("cat and mouse, 1 pair", 2),
    ("cat and mouse, 2 pairs", 1),
    ("counter", 40),
    ("random robot", 3),
]


@pytest.mark.parametrize("engine", ["cudd", "oxidd", "autoref"])
@pytest.mark.parametrize(("family", "size"), SMALL)
def test_symbolic_is_explicit(family: str, size: int, engine: str) -> None:
    system = FAMILIES[family](size)
    found = synthesize(system, engine=engine)
    assert found.status is SynthesisStatus.SUPERVISOR
    explicit = synthesize_explicit(system, limit=100_000)
    assert explicit is not None
    assert not explicit.is_empty
    assert found.statistics.states == len(explicit.reachable)
    added = state_predicates(system, found.added)
    verified = verify_explicitly(system, added)
    outcomes = (verified.safe, verified.controllable, verified.nonblocking, verified.maximally_permissive)
    assert outcomes == (CheckOutcome.PASSED,) * 4, verified.message
    graph = controlled_graph(Semantics(system), added, limit=100_000)
    assert graph is not None
    assert frozenset(graph.states) == explicit.reachable


def test_most_of_them_need_a_supervisor() -> None:
    disabling = [family for family, size in SMALL if synthesize(FAMILIES[family](size)).added]
    assert set(disabling) >= {"dining philosophers", "transfer line", "cat and mouse, 1 pair", "counter"}


@pytest.mark.timeout(120)
def test_philosophers_that_sweeps_over_all_events_do_not_manage() -> None:
    found = synthesize(FAMILIES["dining philosophers"](40))
    # Beside each other they eat or not, two neighbours never; all may hold one fork but not the same way round.
    assert found.statistics.states > 10**18
    assert found.statistics.peak_nodes < 5_000
