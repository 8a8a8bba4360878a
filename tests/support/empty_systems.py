"""Random small systems that have no supervisor, with invariants, for tests of what is to blame."""

from dataclasses import replace
from functools import lru_cache
from random import Random

from robosc.automata import System
from robosc.expressions import StateTest, Unary
from robosc.verification import synthesize_explicit
from support.random_systems import _Builder

LIMIT = 2_000


@lru_cache(maxsize=4096)
def empty_system(seed: int, *, is_wide: bool = False) -> System:
    """The first of some systems without a supervisor; of every other seed, all locations are marked.

    Those that are wide have all that automata offer beyond RoboSC, and some initial state.
    """
    random = Random(seed)
    while True:
        system = _with_invariants(_Builder(random, is_wide=is_wide).system(), random)
        if seed % 2 and not is_wide:
            automata = (replace(item, marked=frozenset(item.locations)) for item in system.automata)
            system = replace(system, automata=tuple(automata))
        supervisor = synthesize_explicit(system, limit=LIMIT)
        if supervisor is not None and supervisor.is_empty and supervisor.explored:
            return system


def _with_invariants(system: System, random: Random) -> System:
    places = [
        (automaton.name, random.choice(others))
        for automaton in system.automata
        if (others := [item for item in automaton.locations if item not in automaton.initial]) and random.random() < 0.4
    ]
    return replace(system, invariants=tuple(Unary("not", StateTest(*place)) for place in places))
