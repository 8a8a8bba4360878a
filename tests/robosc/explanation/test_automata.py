"""Tests of explanations of automata that are no model's, against explicit synthesis on random systems."""

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given

from robosc.automata import (
    Assignment,
    Automaton,
    DiscreteVariable,
    Edge,
    Event,
    EventCondition,
    Role,
    Semantics,
    System,
    SystemPlaces,
)
from robosc.automata.state import Subject, subjects
from robosc.cif import check_cif, load_cif
from robosc.explanation import Explanation, RequestError, SystemWords, explain_synthesis, explanation_text
from robosc.explanation.parts import StateReport, StateValues
from robosc.explanation.requests import SystemQuestionReader
from robosc.explanation.requirement_automata import as_conditions
from robosc.expressions import Binary, Constant, IntegerType, StateTest, Unary, VariableRead
from robosc.source import Location
from robosc.synthesis.fixed_point import FixedPoint
from support.effort import seeds
from support.random_systems import any_wide_systems, explicit_supervisor, random_system, wide_system
from support.systems import automaton

EXAMPLES = 40
STATES = 60
"""States of a system that are looked at."""


@given(any_wide_systems())
def test_conditions_mean_what_requirement_automata_mean(system: System) -> None:
    conditions, places = as_conditions(system)
    before, after = Semantics(system), Semantics(conditions)
    assert {item.name for item in system.automata if item.role is Role.REQUIREMENT} == places.keys()
    assert before.initial_states == after.initial_states
    waiting = list(before.initial_states)
    seen = set(waiting)
    while waiting and len(seen) < STATES:
        state = waiting.pop()
        assert before.bad(state) == after.bad(state)
        assert before.is_marked(state) == after.is_marked(state)
        for event in (item.name for item in system.events):
            assert before.enabled(state, event) == after.enabled(state, event)
            assert before.condition(state, event) == after.condition(state, event)
            targets = before.targets(state, event)
            assert targets == after.targets(state, event)
            waiting += targets - seen
            seen |= targets


def explained(system: System, state: str | None = None) -> Explanation:
    """Return the explanation of a system, the same by both engines."""
    pytest.importorskip("dd.cudd", reason="dd's C extension is not installed")
    words = SystemWords(system)
    results = [explain_synthesis(words, engine=engine, state=state) for engine in ("cudd", "oxidd", "autoref")]
    assert results == results[:1] * len(results)
    assert explanation_text(results[0])
    return results[0]


def values_of(system: System, state: tuple[object, ...]) -> StateValues:
    """A state as an explanation shows it."""
    values = dict(zip(subjects(system), state, strict=True))
    return StateValues(
        components={item.name: str(values[Subject(item.name)]) for item in system.automata if len(item.locations) > 1},
        variables={str(subject): value for subject, value in values.items() if subject.variable is not None},  # type: ignore[misc]
        communications={},
    )


@pytest.mark.random
def test_explanations_agree_with_explicit_synthesis() -> None:
    met: Counter[str] = Counter()
    for seed in seeds(EXAMPLES):
        system = wide_system(seed)
        supervisor = explicit_supervisor(system)
        assert supervisor is not None
        found = explained(system)
        assert (found.empty is not None) == supervisor.is_empty
        if found.empty is not None:
            assert (found.empty.trouble.kind == "nowhere") == (not supervisor.explored)
            met["empty"] += 1
            continue
        semantics = Semantics(system)
        for report in found.events:
            enabled = [item for item in supervisor.reachable if semantics.enabled(item, report.event)]
            allowed = [item for item in enabled if supervisor.allows(item, report.event)]
            assert (report.status == "never") == (not allowed)
            assert report.status != "free" or len(allowed) == len(enabled)
            met[report.status] += 1
        never = {item.message for item in found.remarks if item.kind == "never-enabled"}
        assert never == {
            f"{event.name} can never happen"
            for event in system.events
            if not event.is_controllable
            and not any(semantics.targets(item, event.name) for item in supervisor.reachable)
        }
        reached = {(subject.automaton, item[place]) for item in supervisor.reachable
                   for place, subject in enumerate(subjects(system)) if subject.variable is None}  # fmt: skip
        unreached = [item.message.partition(": ")[0] for item in found.remarks if item.kind == "unreachable-state"]
        assert unreached == [
            f"{item.name} never gets to '{location}'"
            for item in system.automata
            if len(item.locations) > 1
            for location in item.locations
            if (item.name, location) not in reached
        ]
        _check_a_state(system, seed, met)
    assert all(met[name] for name in ("empty", "never", "restricted", "free", "can happen", "cannot happen")), met


_SEARCHES: tuple[Callable[..., Any], ...] = (
    lambda solver, backwards, *others: backwards(solver),
    lambda solver, backwards, onwards, *others: onwards(solver),
)


@pytest.mark.random
def test_both_searches_find_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    """No explanation speaks of what is left out since nothing leads there."""
    pytest.importorskip("dd.cudd", reason="dd's C extension is not installed")
    for seed in seeds(EXAMPLES):
        for system in (random_system(seed), wide_system(seed)):
            found = []
            for search in _SEARCHES:
                monkeypatch.setattr(FixedPoint, "_first_of", search)
                found.append(explain_synthesis(SystemWords(system), engine="cudd"))
            assert found[0] == found[1], seed


@pytest.mark.parametrize("search", _SEARCHES)
def test_a_step_that_never_happens_is_explained_by_its_harmful_target(
    search: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """From b, which no run reaches, there is a way on: the trouble is c."""
    monkeypatch.setattr(FixedPoint, "_first_of", search)
    plant = automaton("P", ["a -go-> b", "a -go-> c", "b -stop-> a"], marked=["a"])
    never = Unary("not", StateTest("P", "c"))
    (go,) = explained(System("s", (GO, STOP), (plant,), invariants=(never,))).events
    (reason,) = go.reasons
    assert reason.trouble is not None
    assert reason.trouble.way.state.components == {"P": "c"}
    assert reason.trouble.kind == "bad"


def test_states_that_no_run_reaches_do_not_hold_up_explanations() -> None:
    # From the marked states backwards, the whole takes more than two minutes.
    pytest.importorskip("dd.cudd", reason="dd's C extension is not installed")
    found = check_cif(load_cif(Path(__file__).parents[2] / "models" / "wafer_handling.cif"))
    assert found.system is not None
    result = explain_synthesis(SystemWords(found.system), engine="cudd", event="load.c_on")
    assert result.events[0].status == "restricted"


def _check_a_state(system: System, seed: int, met: Counter[str]) -> None:
    """Ask for one state of the controlled system in words, and compare the report with what can happen there."""
    supervisor, semantics = explicit_supervisor(system), Semantics(system)
    assert supervisor is not None
    states = sorted(supervisor.reachable)
    state = states[seed % len(states)]
    values = values_of(system, state)
    asked = [f"{name}.{location}" for name, location in values.components.items()]
    asked += [
        (name if value else f"not {name}") if isinstance(value, bool) else f"{name} = {value}"
        for name, value in values.variables.items()
    ]
    if not asked:
        return
    report = explained(system, state=", ".join(asked)).state
    assert isinstance(report, StateReport)
    assert report.way.state == values
    assert report.fitting == "1"
    for item in report.events:
        can_happen = bool(semantics.targets(state, item.event)) and (
            not item.is_controllable or supervisor.allows(state, item.event)
        )
        assert item.can_happen == can_happen
        assert bool(item.reasons) == (not can_happen)
        met["can happen" if can_happen else "cannot happen"] += 1


# By hand

GO, STOP = Event("go", is_controllable=True), Event("stop", is_controllable=False)
PLANT = Automaton(
    "p.q",
    ("a", "b"),
    ("a",),
    frozenset({"a"}),
    frozenset({"go", "stop"}),
    (Edge("a", "go", "b"), Edge("b", "stop", "a")),
    (DiscreteVariable("n", IntegerType(0, 3), (0,)),),
)
LIMIT = Automaton("limit", ("x", "y"), ("x",), frozenset({"x"}), frozenset({"go"}), (Edge("x", "go", "y"),),
                  role=Role.REQUIREMENT)  # fmt: skip
AT = Location("made.cif", 3, 5)


def test_a_requirement_automaton_is_reported_with_its_place_and_its_location() -> None:
    free = Automaton("limit", ("x", "y"), ("x",), frozenset({"x", "y"}), frozenset({"go"}), (Edge("x", "go", "y"),),
                     role=Role.REQUIREMENT)  # fmt: skip
    system = System("s", (GO, STOP), (PLANT, free))
    found = explain_synthesis(SystemWords(system, SystemPlaces({"limit": AT})), event="go")
    assert explanation_text(found) == (
        "go: restricted\n"
        "  p.q is b, where it has no edge for go; for instance after go\n"
        "  'requirement limit' forbids it: limit is y, where it has no edge for go (made.cif:3:5); for instance "
        "after go, stop\n"
    )


def test_a_requirement_automaton_is_blamed_as_a_whole() -> None:
    loop = Automaton("loop", ("m", "k"), ("m",), frozenset({"k"}), frozenset({"go", "stop"}),
                     (Edge("m", "go", "m"), Edge("m", "stop", "m")), role=Role.REQUIREMENT)  # fmt: skip
    empty = explain_synthesis(SystemWords(System("s", (GO, STOP), (PLANT, loop)))).empty
    assert empty is not None
    assert [item.part.text for item in empty.blamed] == ["that loop gets to a marked state (k)"]
    stopping = Automaton("never", ("m",), ("m",), frozenset({"m"}), frozenset({"stop"}), (), role=Role.REQUIREMENT)
    marked = Automaton("p.q", ("a", "b"), ("a",), frozenset({"b"}), PLANT.alphabet, PLANT.edges)
    empty = explain_synthesis(
        SystemWords(System("s", (GO, STOP), (marked, stopping)), SystemPlaces({"never": AT}))
    ).empty
    assert empty is not None
    assert {(item.part.text, item.part.location) for item in empty.blamed} == {
        ("requirement never", AT),
        ("that p.q gets to a marked state (b)", None),
    }


def test_what_one_invariant_says_of_several_events_is_blamed_together() -> None:
    needs = tuple(EventCondition(event, StateTest("p.q", "b")) for event in ("go", "stop"))
    system = System("s", (GO, STOP), (Automaton("p.q", ("a", "b"), ("a",), frozenset({"b"}), PLANT.alphabet,
                                                PLANT.edges),), conditions=needs)  # fmt: skip
    empty = explain_synthesis(SystemWords(system, SystemPlaces(conditions=(AT, AT)))).empty
    assert empty is not None
    assert empty.blamed[0].part.text == "requirement {go, stop} needs p.q.b"
    assert empty.blamed[0].part.location == AT


def test_a_range_is_no_plant_invariant() -> None:
    counter = replace(PLANT, edges=(Edge("a", "go", "a", updates=(
        Assignment("n", Binary("+", VariableRead("p.q", "n"), Constant(2))),)),))  # fmt: skip
    never = Unary("not", Binary("=", VariableRead("p.q", "n"), Constant(3)))
    system = System("s", (GO, STOP), (counter,), plant_invariants=(never,))
    assert explanation_text(explained(system, state="p.q.n = 2")).splitlines()[2:4] == [
        "go: cannot happen",
        "  it would take p.q.n, which is 2, out of its range",
    ]


def test_a_requirement_that_restricts_by_what_it_marks_is_not_called_unused() -> None:
    plant = automaton("P", ["p0 -go-> p1", "p1 -x-> p1", "p0 -off-> p2"])
    watching = replace(
        automaton("R", ["a -go-> b", "b -x-> b", "a -off-> a", "b -off-> b"], marked=["b"]), role=Role.REQUIREMENT
    )
    events = tuple(Event(name, is_controllable=True) for name in ("go", "x", "off"))
    for requirement, expected in ((watching, []), (replace(watching, marked=frozenset({"a", "b"})), ["R"])):
        found = explained(System("s", events, (plant, requirement)))
        unused = [item.message for item in found.remarks if item.kind == "unused-requirement"]
        assert unused == [f"'requirement {name}' never restricts anything" for name in expected]


def test_runs_begin_where_the_supervisor_lets_them() -> None:
    """From z nothing leads back to a marked state, so the system may not begin there."""
    plant = replace(automaton("P", ["z -stop-> w", "a -go-> a"], marked=["a"]), initial=("z", "a"))
    words = SystemWords(System("s", (GO, STOP), (plant,)))
    with pytest.raises(RequestError, match="'stop' cannot happen in the initial state: P is a"):
        explain_synthesis(words, after="stop")
    assert explain_synthesis(words, after="go").state is not None


def test_no_initial_state_is_reported() -> None:
    system = System("s", (GO, STOP), (PLANT,), initial=StateTest("p.q", "b"))
    found = explain_synthesis(SystemWords(system))
    assert found.empty is not None
    assert not found.empty.blamed
    assert explanation_text(found).startswith("trouble:\n  there is no initial state: ")


ODD = Automaton("odd = 1", ("< 2",), ("< 2",), frozenset(), frozenset(), ())
ASKED = SystemQuestionReader(System("s", (GO, STOP), (PLANT, ODD)))


@pytest.mark.parametrize(
    ("text", "condition"),
    [
        ("p.q.b", StateTest("p.q", "b")),
        ("!p.q.b", Unary("not", StateTest("p.q", "b"))),
        ("not p.q.n >= 2", Unary("not", Binary(">=", VariableRead("p.q", "n"), Constant(2)))),
        ("p.q = b", StateTest("p.q", "b")),
        ("p.q != b", Unary("not", StateTest("p.q", "b"))),
        ("p.q.n=0", Binary("=", VariableRead("p.q", "n"), Constant(0))),
        ("odd = 1.< 2", StateTest("odd = 1", "< 2")),
    ],
)
def test_states_are_asked_for_by_the_names_of_automata(text: str, condition: object) -> None:
    assert ASKED.state(text) == condition


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("p.q.m = 1", "unknown location or variable 'p.q.m'; did you mean 'p.q.n'?"),
        ("p.q = c", "unknown location of p.q 'c'; there is a, b"),
        ("p.q < a", "unknown location or variable 'p.q'; did you mean 'p.q.n'?"),
        ("p.q.n", "p.q.n needs a value: p.q.n = 0"),
        ("p.q.n = x", "'x' is not a value of p.q.n; there is a whole number"),
        ("", 'no state is asked for: write for instance "Door.closed, Lift.n = 2"'),
    ],
)
def test_states_that_are_not_there_are_refused(text: str, problem: str) -> None:
    with pytest.raises(RequestError) as caught:
        ASKED.state(text)
    assert str(caught.value) == problem


def test_events_that_are_not_there_are_refused() -> None:
    with pytest.raises(RequestError, match="unknown event 'gone'; there is go, stop"):
        ASKED.run("go, gone")
