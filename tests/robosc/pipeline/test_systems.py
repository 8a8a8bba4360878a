"""The core's second door: automata that a program has built."""

import json
from dataclasses import replace
from pathlib import Path
from unittest.mock import patch

import pytest
from hypothesis import given, settings

import robosc
from robosc.automata import Automaton, Edge, Event, System
from robosc.conditions import summary
from robosc.conditions.literals import Vocabulary
from robosc.explanation import EmptyExplanation, Explanation
from robosc.expressions import Constant, StateTest, Unary
from robosc.pipeline.conditions import Condition, Conditions
from robosc.pipeline.systems import decode_system
from robosc.supervisor import DecisionDiagram, DecisionNode
from robosc.supervisor.diagram import Subject, SubjectDomain
from robosc.supervisor.predicates import state_predicate
from robosc.synthesis import synthesize
from robosc.verification import Limits, verify
from support.effort import examples
from support.families import FAMILIES
from support.random_systems import any_system, explicit_supervisor, system_seeds
from support.systems import automaton, system

MACHINE = system(
    automaton("M", ["idle -start-> busy", "busy -u_done-> idle", "busy -u_break-> down", "down -repair-> idle"],
              marked=["idle"]),
    automaton("B", ["empty -u_done-> full", "full -take-> empty"], marked=["empty"]),
)  # fmt: skip


def test_a_machine_and_a_buffer() -> None:
    never_lost = replace(MACHINE, invariants=(), automata=(
        MACHINE.automata[0],
        # A full buffer loses what comes.
        automaton("B", ["empty -u_done-> full", "full -u_done-> lost", "full -take-> empty"], marked=["empty"]),
    ))  # fmt: skip
    result = robosc.synthesize(never_lost)
    assert result.status is robosc.SynthesisStatus.SUPERVISOR
    supervisor = result.supervisor
    assert supervisor is not None
    assert str(supervisor.conditions["start"]) == "not B.full"
    assert supervisor.conditions["repair"].adds_nothing
    assert repr(result) == "<SystemSynthesis: <supervisor of by hand: 4 states, conditions added to 1 event>>"
    assert "start needs not B.full" in str(result)
    assert "not B.full" in result._repr_html_()
    verification = robosc.verify(supervisor)
    assert verification.passed
    assert verification.report["states"] == supervisor.states == 4
    # The verifier believes no claim: without its condition, the buffer is lost.
    broken = robosc.verify(replace(supervisor, added=()))
    assert broken.status is robosc.VerificationStatus.FAILED
    (fault,) = broken.report["faults"]
    assert fault["check"] == "nonblocking"
    assert fault["state"]["B"] == "lost"
    assert "not nonblocking: " in str(broken)


@settings(max_examples=examples(40))
@given(system_seeds())
def test_random_automata(seed: int) -> None:
    given_system = any_system(seed)
    result, core = robosc.synthesize(given_system), synthesize(given_system)
    assert str(result.status) == str(core.status)
    explicit = explicit_supervisor(given_system)
    if result.supervisor is None:
        assert result.reason == f"no supervisor exists: {core.reason}"
        assert isinstance(result.explanation, EmptyExplanation)
        return
    assert (result.supervisor.added, result.supervisor.initial) == (core.added, core.initial)
    assert explicit is not None
    verification = robosc.verify(result.supervisor, is_strict=True)
    assert verification.passed, str(verification)
    assert verification.report["states"] == result.supervisor.states
    assert (result.supervisor.initial is None) == (result.supervisor.initial_condition is None)
    few = robosc.verify(result.supervisor, maximum_states=0)
    assert few.status in (robosc.VerificationStatus.NOT_CHECKED, robosc.VerificationStatus.PASSED)


def test_long_diagrams_are_given_by_their_size() -> None:
    domains: dict[Subject, SubjectDomain] = {(name, None): SubjectDomain(("off", "on"), None) for name in "ABCDEFG"}
    # An odd number of them is on: a chain of two nodes a place.
    nodes = [DecisionNode("G", None, (0, 1), (0, 1)), DecisionNode("G", None, (0, 1), (1, 0))]
    for name in "FEDCBA":
        even, odd = len(nodes), len(nodes) + 1
        nodes += [DecisionNode(name, None, (0, 1), (even, odd)), DecisionNode(name, None, (0, 1), (odd, even))]
    diagram, vocabulary = DecisionDiagram(tuple(nodes), len(nodes)), Vocabulary(domains)
    few = DecisionDiagram(tuple(nodes[:2]), 2)
    size = "a decision diagram of 14 nodes"
    conditions = Conditions(
        [
            Condition(f"e{number}", size if item is diagram else "one of 2", None, item, vocabulary)
            for number, item in enumerate([diagram, *[few] * 2])
        ]
    )
    whole = str(conditions).splitlines()
    assert whole[0] == f"e0 needs {size}, to be read from [1] on:" and len(whole) > 14
    # It is long if it has many nodes, and if few nodes distinguish many values.
    for limit in ("_NODES", "_RANGES"):
        with patch.object(summary, limit, 10):
            short = str(conditions)
        assert f"e0 needs {size}; --json lists its nodes\ne1 needs one of 2, to be read from [1] on:\n[1]" in short
    # Asked for by itself it is printed whole.
    assert str(conditions["e0"]).startswith(f"{size}, to be read from [1] on:\n[1]")


def test_a_synthesis_in_modules(tmp_path: Path) -> None:
    row = FAMILIES["machines in a row"](6)
    result, whole = robosc.synthesize(row, is_modular=True), robosc.synthesize(row)
    supervisor = result.supervisor
    assert supervisor is not None
    assert whole.supervisor is not None
    assert (supervisor.states, len(supervisor.modules), {item.group for item in supervisor.modules}) == (0, 3, {1})
    assert repr(supervisor) == "<supervisor of family: 3 modules, conditions added to 5 events>"
    lines = str(result).splitlines()
    assert lines[0] == "family: a supervisor exists (3 modules)"
    assert lines[-2:] == [
        "module 3, 18 states: M3, M4, M5, B3, B4",
        "nonblocking together, as found on abstractions: modules 1, 2, 3",
    ]
    assert "states of module 3" in supervisor._repr_html_()
    # Together they allow what the supervisor of the whole allows.
    graphs = [robosc.explore(item).graph for item in (supervisor, whole.supervisor)]
    assert graphs[0] == graphs[1]
    read = robosc.SystemSupervisor.read(supervisor.write(tmp_path / "row.rsup"))
    assert (read, read.modules) == (supervisor, supervisor.modules)
    for change in ({"states": 0}, {"group": 0}, {"automata": ["M9"]}):
        document = json.loads(supervisor.encode())
        document["system_supervisor"]["modules"][1].update(change)
        with pytest.raises(robosc.InvalidSupervisorError, match="a module names an automaton that it does not have"):
            decode_system(json.dumps(document).encode())
    # Modules that share nothing are counted.
    apart = robosc.synthesize(replace(row, automata=row.automata[:6]), is_modular=True).supervisor
    assert apart is not None
    assert (apart.states, str(apart).splitlines()[0]) == (64, "family: a supervisor exists (64 states, 6 modules)")


def test_no_supervisor_in_modules() -> None:
    row = FAMILIES["machines in a row"](8)
    lost = replace(row, invariants=(Unary("not", StateTest("M7", "idle")),))
    result = robosc.synthesize(lost, is_modular=True)
    assert result.status is robosc.SynthesisStatus.EMPTY
    assert "M7" in result.reason
    assert "M0" not in result.reason
    assert isinstance(result.explanation, EmptyExplanation)
    assert "requirement invariant not M7.idle" in str(result)


def test_no_supervisor_and_automata_that_do_not_fit() -> None:
    blocked = System("s", (Event("u_go", is_controllable=False),), (
        Automaton("A", ("a", "b"), ("a",), frozenset({"a"}), frozenset({"u_go"}), (Edge("a", "u_go", "b"),)),
    ))  # fmt: skip
    result = robosc.synthesize(blocked)
    assert result.status is robosc.SynthesisStatus.EMPTY
    assert result.supervisor is None
    assert isinstance(result.explanation, EmptyExplanation)
    assert str(result) == f"{result.reason}\n{result.explanation}"
    assert "that A gets to a marked state (a)" in str(result)
    assert robosc.explain(blocked).explanation == Explanation(empty=result.explanation, is_of_automata=True)
    with pytest.raises(robosc.InvalidSystemError, match="A: a -u_gone-> b: "):
        robosc.synthesize(replace(blocked, automata=(replace(blocked.automata[0], edges=(Edge("a", "u_gone", "b"),)),)))


def test_ways_to_begin_are_part_of_the_answer() -> None:
    two = System("two", (Event("go", is_controllable=True),), (
        Automaton("A", ("a", "b"), ("a", "b"), frozenset({"a"}), frozenset({"go"}), (Edge("a", "go", "a"),)),
    ))  # fmt: skip
    supervisor = robosc.synthesize(two).supervisor
    assert supervisor is not None
    assert supervisor.initial is not None
    assert str(supervisor.initial_condition) == "A.a"
    assert repr(supervisor.initial_condition) == "<the initial state needs A.a>"
    assert robosc.verify(supervisor).passed
    assert robosc.verify(supervisor, maximum_states=0).status is robosc.VerificationStatus.NOT_CHECKED
    # Too large to be searched one by one, it is searched on sets of states.
    found = verify(two, {}, Limits(0, 0, 1000), initial=state_predicate(two, supervisor.initial), expected_states=1)
    assert (found.is_complete, found.verification.states, found.verification.failures) == (True, 1, ())
    everywhere = verify(two, {}, Limits(0, 0, 1000), expected_states=1)
    assert everywhere.verification.failures[0].property == "nonblocking"


def test_other_doors_are_closed() -> None:
    supervisor = robosc.synthesize(replace(MACHINE, invariants=(Constant(True), StateTest("M", "idle")))).supervisor
    assert supervisor is not None
    with pytest.raises(TypeError, match="properties, supervisor= and as_is= need a model"):
        robosc.verify(supervisor, "invariant true")  # type: ignore[call-overload]
