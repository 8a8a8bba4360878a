"""The seeded families at sizes that the explicit twin manages: the same comes out in every order of declarations."""

import pytest

from robosc.automata import Semantics
from robosc.automata.controlled import controlled_graph
from robosc.automata.state import subjects
from robosc.automata.structure import System
from robosc.supervisor.predicates import state_predicates
from robosc.synthesis import SynthesisStatus, synthesize
from robosc.verification import synthesize_explicit
from support.seeded_families import SEEDED_FAMILIES, shuffled

SMALL = {
    "product line": 9,
    "movable bridges": 5,
    "locks": 6,
    "tower": 50,
    "cluster tools": 9,
    "fleet in zones": 4,
    "lifts": 5,
    "ring of machines": 8,
    "hub": 4,
    "pairs": 4,
    "axes": 3,
    "loads": 3,
    "random network": 2,
}


def _states(system: System) -> tuple[frozenset[frozenset[tuple[str, str]]], SynthesisStatus]:
    """The states of the controlled system, each as the values of its places, and the outcome."""
    found = synthesize(system)
    if found.status is SynthesisStatus.EMPTY:
        return frozenset(), found.status
    graph = controlled_graph(Semantics(system), state_predicates(system, found.added), limit=100_000)
    assert graph is not None
    assert found.statistics.states == len(graph.states)
    return frozenset(_named(system, state) for state in graph.states), found.status


def _named(system: System, state: tuple[object, ...]) -> frozenset[tuple[str, str]]:
    return frozenset((str(place), str(value)) for place, value in zip(subjects(system), state, strict=True))


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("family", SMALL)
def test_every_order_of_declarations_gives_what_the_twin_finds(family: str, seed: int) -> None:
    system = SEEDED_FAMILIES[family](SMALL[family], seed)
    explicit = synthesize_explicit(system, limit=100_000)
    assert explicit is not None
    wanted = frozenset() if explicit.is_empty else frozenset(_named(system, state) for state in explicit.reachable)
    assert wanted
    for order in range(3):
        assert _states(shuffled(system, order)) == (wanted, SynthesisStatus.SUPERVISOR)
