"""Synthesis part by part gives what synthesis of the whole gives, on random systems put side by side."""

from dataclasses import replace
from typing import Any

import msgspec
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from robosc.automata import DiscreteVariable, System
from robosc.automata.parts import independent_parts
from robosc.certification.pipeline import make_supervisor
from robosc.expressions import Binary, BooleanType, StateTest, Unary
from robosc.source import Bundle, SourceFile
from robosc.supervisor.predicates import state_predicates
from robosc.synthesis import Questions, Restriction, SynthesisResult, SynthesisStatus, synthesize, synthesize_in_parts
from robosc.verification import CheckOutcome, verify_explicitly
from support.effort import examples
from support.random_systems import random_system
from support.systems import automaton, edge, system

PASSED = CheckOutcome.PASSED


def renamed(item: Any, names: frozenset[str], suffix: str) -> Any:
    """A value in which some names have got an ending."""
    if isinstance(item, str):
        return type(item)(item + suffix) if item in names and type(item) is str else item
    if isinstance(item, tuple | frozenset):
        return type(item)(renamed(part, names, suffix) for part in item)
    if isinstance(item, msgspec.Struct):
        changes = {name: renamed(getattr(item, name), names, suffix) for name in item.__struct_fields__}
        return type(item)(**changes)
    if hasattr(item, "__dataclass_fields__"):
        fields = [name for name, field in item.__dataclass_fields__.items() if field.init]
        return type(item)(**{name: renamed(getattr(item, name), names, suffix) for name in fields})
    return item


def beside(*systems: System) -> System:
    """Systems side by side: none knows of another."""
    copies = []
    for number, item in enumerate(systems):
        names = frozenset({part.name for part in item.automata} | {event.name for event in item.events})
        copies.append(renamed(item, names, f"_{number}"))
    sides = ("events", "automata", "inputs", "conditions", "invariants", "plant_conditions", "plant_invariants")
    parts: dict[str, Any] = {side: sum((getattr(item, side) for item in copies), ()) for side in sides}
    return System(name="S", **parts)


def asked(made: System) -> Questions:
    return Questions(
        events=tuple(event.name for event in made.events),
        restrictions=(
            *(Restriction(conditions=(place,)) for place in range(len(made.conditions))),
            *(Restriction(invariants=(place,)) for place in range(len(made.invariants))),
            Restriction(),
        ),
        rivals=(tuple(event.name for event in made.events[:2]), tuple(event.name for event in made.events[-2:])),
        locations=tuple((item.name, location) for item in made.automata for location in item.locations),
        prompted=tuple(event.name for event in made.events if event.is_controllable),
    )


def in_parts(made: System, questions: Questions) -> SynthesisResult:
    return synthesize_in_parts(
        made, questions=questions, should_stop=lambda: False, on_progress=lambda progress: None, smallest=0
    )


@settings(max_examples=examples(60))
@given(st.lists(st.integers(0, 2000), min_size=2, max_size=3))
def test_random_systems_side_by_side(seeds: list[int]) -> None:
    made = beside(*map(random_system, seeds))
    questions = asked(made)
    whole, parts = synthesize(made, questions=questions), in_parts(made, questions)
    assert parts.status is whole.status
    if whole.status is SynthesisStatus.EMPTY:
        return
    assume(whole.statistics.states < 20_000)
    assert parts.statistics.states == whole.statistics.states
    found = verify_explicitly(made, state_predicates(made, parts.added), limit=20_000, permissive_limit=20_000)
    if parts.initial is None:
        assert (found.states, found.safe, found.controllable, found.nonblocking) == (
            whole.statistics.states, PASSED, PASSED, PASSED,
        )  # fmt: skip
        assert found.maximally_permissive in (PASSED, CheckOutcome.NOT_CHECKED)
    assert parts.answers.never == whole.answers.never
    assert parts.answers.unused == whole.answers.unused
    assert parts.answers.unreached == whole.answers.unreached
    assert [(item.first, item.second, len(item.trace)) for item in parts.answers.together] == [
        (item.first, item.second, len(item.trace)) for item in whole.answers.together
    ]
    assert {item.event for item in parts.answers.unprompted} == {item.event for item in whole.answers.unprompted}


def test_what_reads_another_automaton_is_one_part() -> None:
    lonely = automaton("C", ["off -run-> on", "on -u_end-> off"])
    one = automaton("A", ["idle -go-> busy", "busy -u_end_a-> idle"])
    other = automaton("B", ["idle -start-> busy", "busy -u_end_b-> idle"])
    made = system(one, other, lonely)
    assert [[item.name for item in part.automata] for part in independent_parts(made)] == [["A"], ["B"], ["C"]]
    tied = replace(made, invariants=(Unary("not", StateTest("A", "busy")),))
    assert len(independent_parts(tied)) == 3
    both = Binary("and", StateTest("A", "busy"), StateTest("C", "on"))
    tied = replace(made, invariants=(Unary("not", both),))
    assert [[item.name for item in part.automata] for part in independent_parts(tied)] == [["A", "C"], ["B"]]
    assert len(independent_parts(made, [("go", "start"), ("start", "run")])) == 1


PAIR = """
  component A{0} {{
    incoming message go{0} with identifier: "/go{0}", type: none
    outgoing message done{0} with identifier: "/done{0}", type: none
    behaviour {{
      initial marked state idle {{ on request to go{0} goto busy }}
      state busy {{ on response from done{0} goto idle }}
    }}
  }}
"""


@pytest.mark.parametrize("parts", [20, 40])
def test_a_robot_of_many_pairs_is_certified_part_by_part(parts: int) -> None:
    pairs = "".join(PAIR.format(number) for number in range(2 * parts))
    never = "".join(f"requirement never A{2 * n}.busy and A{2 * n + 1}.busy\n" for n in range(parts))
    outcome = make_supervisor(Bundle(SourceFile("m.rscd", f"robot Many {{ {pairs} {never} }}"), ()))
    assert outcome.supervisor is not None
    certificate = outcome.supervisor.certificate
    assert certificate.maximally_permissive == "passed"
    assert certificate.states == str(3**parts)
    assert certificate.method.startswith(f"{parts} independent parts each by: explicit forward search")
    assert {item.code for item in outcome.diagnostics} <= {"unprompted-request"}


def test_what_an_edge_reads_is_in_its_part() -> None:
    other = automaton("B", ["idle -start-> busy", "busy -u_end_b-> idle"])
    guarded = automaton("A", [edge("idle -go-> busy", StateTest("B", "busy")), "busy -u_end_a-> idle"])
    assert len(independent_parts(system(guarded, other))) == 1
    flag = DiscreteVariable("flag", BooleanType(), (False,))
    updated = automaton("A", [edge("idle -go-> idle", flag=StateTest("B", "busy"))], variables=[flag])
    assert len(independent_parts(system(updated, other))) == 1
