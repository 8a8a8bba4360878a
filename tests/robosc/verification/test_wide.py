"""Tests of the independent verifiers on automata beyond RoboSC: several ways to begin above all."""

from collections import Counter
from collections.abc import Callable
from dataclasses import replace

import pytest

from robosc.automata import System
from robosc.automata.decision import Decision
from robosc.expressions import StateTest
from robosc.supervisor.predicates import state_predicate, state_predicates
from robosc.synthesis import SynthesisStatus, synthesize
from robosc.verification import CheckOutcome, Verification, synthesize_explicit, verify_explicitly
from robosc.verification.symbolic import verify_symbolically
from support.effort import seeds
from support.random_systems import wide_system
from support.systems import automaton, system

LIMIT = 20_000


def verdicts(made: System, added: dict[str, Decision], initial: Decision | None) -> tuple[Verification, Verification]:
    one_by_one = verify_explicitly(made, added, initial=initial, limit=LIMIT, permissive_limit=LIMIT)
    on_sets = verify_symbolically(made, added, initial=initial, limit=10**9)
    for name in ("safe", "controllable", "nonblocking"):
        assert getattr(one_by_one, name) == getattr(on_sets, name), name
    assert one_by_one.states == on_sets.states
    return one_by_one, on_sets


NOWHERE = Decision((), 0, ())
"""A condition on the beginning that is true nowhere."""


@pytest.mark.random
def test_systems_may_not_begin_where_no_supervisor_can_go_on(record_property: Callable[[str, object], None]) -> None:
    """Check the report if a supervisor's initial states are forgotten, or if it lets the system begin nowhere."""
    met: Counter[str] = Counter()
    for seed in seeds(25):
        made = wide_system(seed)
        result = synthesize(made)
        explicit = synthesize_explicit(made, limit=LIMIT)
        if result.status is SynthesisStatus.EMPTY or explicit is None:
            continue
        added = state_predicates(made, result.added)
        one_by_one, _ = verdicts(made, added, NOWHERE)
        assert one_by_one.maximally_permissive is CheckOutcome.FAILED
        assert "may not begin here" in one_by_one.message
        if result.initial is None:
            continue
        begins = state_predicate(made, result.initial)
        assert not verdicts(made, added, begins)[0].failures
        one_by_one, _ = verdicts(made, added, None)
        # Beyond good states the conditions say nothing, so what goes wrong there differs.
        assert one_by_one.failures
        assert one_by_one.trace == one_by_one.failures[0].trace
        met[one_by_one.failures[0].property] += 1
    record_property("systems that begin where they may not", dict(met))
    assert met["safe"] and met["nonblocking"]


def test_a_supervisor_may_choose_where_to_begin() -> None:
    made = system(automaton("A", ["a -u_fall-> broken", "b -go-> b"], initial=["a", "b"], marked=["b"]))
    begin = synthesize(made).initial
    assert begin is not None
    assert not verdicts(made, {}, state_predicate(made, begin))[0].failures
    failed, _ = verdicts(made, {}, None)
    assert (failed.nonblocking, failed.trace, failed.failures[0].state) == (CheckOutcome.FAILED, (), ("a",))


def test_a_marker_may_ask_for_more_than_marked_locations() -> None:
    made = system(automaton("A", ["a -go-> b"], marked=["a", "b"]))
    assert not verdicts(made, {}, None)[0].failures
    failed, _ = verdicts(replace(made, marker=StateTest("A", "a")), {}, None)
    assert (failed.nonblocking, failed.trace, failed.failures[0].state) == (CheckOutcome.FAILED, ("go",), ("b",))


def test_a_system_begins_only_where_its_plant_invariants_are_true() -> None:
    made = system(automaton("A", ["a -u_fall-> broken", "b -go-> b"], initial=["a", "b"], marked=["b"]))
    assert verdicts(made, {}, None)[0].failures
    begins_well, _ = verdicts(replace(made, plant_invariants=(StateTest("A", "b"),)), {}, None)
    assert (begins_well.failures, begins_well.states) == ((), 1)
