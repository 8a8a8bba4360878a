"""Tests of modular synthesis, against explicit synthesis of the whole on random systems."""

from collections import Counter
from dataclasses import replace
from typing import Any

import pytest

from robosc.automata import (
    Automaton,
    DiscreteVariable,
    Edge,
    Event,
    InputVariable,
    Role,
    Semantics,
    System,
)
from robosc.automata.controlled import controlled_graph
from robosc.expressions import (
    TRUE,
    Binary,
    Constant,
    IntegerType,
    Received,
    StateTest,
    Unary,
    VariableRead,
    conjunction,
)
from robosc.modular import abstraction
from robosc.modular.clusters import MAXIMUM_BITS, modules_of
from robosc.modular.partition import partition
from robosc.modular.synthesize import ModularResult, synthesize_modular
from robosc.supervisor.predicates import state_predicate, state_predicates
from robosc.supervisor.validation import validate_added
from support.effort import seeds
from support.families import FAMILIES
from support.random_parts import system_in_parts
from support.random_systems import explicit_supervisor, wide_system
from support.systems import automaton, edge

EXAMPLES = 120


def check(system: System, result: ModularResult) -> bool:
    """Compare with the supervisor of the whole; returns whether there is one."""
    expected = explicit_supervisor(system)
    assert expected is not None
    assert (result.unsolved is not None) == expected.is_empty
    if expected.is_empty:
        return False
    validate_added(result.added, system)
    begins = {} if result.initial is None else {"initial": state_predicate(system, result.initial)}
    graph = controlled_graph(
        Semantics(system),
        state_predicates(system, result.added),
        limit=50_000,
        **begins,  # type: ignore[arg-type]
    )
    assert graph is not None
    assert frozenset(graph.states) == expected.reachable
    controllable = {item.name for item in system.events if item.is_controllable}
    for state, steps in zip(graph.states, graph.steps, strict=True):
        allowed = {event for event in controllable if expected.allows(state, event)}
        assert {event for event, _ in steps} & controllable == allowed
    assert result.states in (None, len(graph.states))
    return True


@pytest.mark.random
def test_modules_together_are_the_supervisor_of_the_whole() -> None:
    met: Counter[str] = Counter()
    for seed in seeds(EXAMPLES):
        system = system_in_parts(seed)
        # Every other system in the smallest modules that there could be.
        bits = MAXIMUM_BITS if seed % 2 else 0.0
        result = synthesize_modular(system, module_bits=bits)
        if check(system, result):
            met["several modules"] += len(result.modules) > 1
            met["counted"] += result.states is not None and len(result.modules) > 1
            met["a group"] += any(len(group) > 1 for group in result.groups)
        else:
            met["empty"] += 1
    assert all(met[name] for name in ("several modules", "counted", "a group", "empty")), met


def philosophers(count: int) -> System:
    """Philosophers as plants, who take the left fork first, and forks as requirements: two neighbours never block."""
    events: list[Event] = []
    automata: list[Automaton] = []
    for place in range(count):
        left, right, free = (f"{what}{place}" for what in ("left", "right", "free"))
        events += [Event(name, is_controllable=True) for name in (left, right, free)]
        edges = (Edge("t", left, "l"), Edge("l", right, "e"), Edge("e", free, "t"))
        automata.append(
            Automaton(f"P{place}", ("t", "l", "e"), ("t",), frozenset({"t"}), frozenset((left, right, free)), edges)
        )
    for place in range(count):
        after = (place + 1) % count
        taking, giving = (f"left{after}", f"right{place}"), (f"free{place}", f"free{after}")
        moves = (*(Edge("here", name, "away") for name in taking), *(Edge("away", name, "here") for name in giving))
        automata.append(Automaton(f"F{place}", ("here", "away"), ("here",), frozenset({"here"}),
                                  frozenset((*taking, *giving)), moves, role=Role.REQUIREMENT))  # fmt: skip
    return System("philosophers", tuple(events), tuple(automata))


@pytest.mark.parametrize("count", [3, 4])
def test_modules_that_block_each_other_become_one(count: int) -> None:
    system = philosophers(count)
    assert len(modules_of(partition(system), 0.0)) == count
    reported: list[str] = []
    result = synthesize_modular(system, module_bits=0.0, on_progress=reported.append)
    assert check(system, result)
    assert len(result.modules) == 1
    assert any(text.startswith("2 modules become one") for text in reported)


def test_modules_that_are_too_large_to_check_become_one() -> None:
    system = philosophers(3)
    result = synthesize_modular(system, module_bits=0.0, limit=2)
    assert len(result.modules) == 1
    assert check(system, result)


def test_modules_that_leave_no_common_beginning_are_found_out() -> None:
    """One module allows one of two beginnings of a part, and another module the other one."""
    trap = ("a -u_leave-> b", "b -u_leave-> a")
    shared = replace(automaton("S", ["x -stay-> x", "y -stay-> y"]), initial=("x", "y"))
    sides = [automaton(name, [edge.replace("leave", f"leave_{name}") for edge in trap]) for name in ("L", "R")]
    events = tuple(
        Event(name, is_controllable=not name.startswith("u_")) for name in ("stay", "u_leave_L", "u_leave_R")
    )
    never = tuple(
        Unary("not", Binary("and", StateTest("S", where), StateTest(name, "b")))
        for where, name in (("x", "L"), ("y", "R"))
    )
    system = System("beginnings", events, (shared, *sides), invariants=never)
    assert not check(system, synthesize_modular(system, module_bits=0.0))


def test_requirements_that_read_the_same_data_stand_together() -> None:
    """Both learn one value: that one of them has learned 1 and the other one 0 is never so."""
    data = InputVariable("u_e", (), IntegerType(0, 1))
    plants = [automaton(f"P_{name}", [f"x -{name}-> x"]) for name in ("u_e", "b", "c")]
    watching = [
        replace(
            automaton(
                f"R_{name}",
                [edge("here -u_e-> here", n=Received(())), f"here -{name}-> here"],
                variables=[DiscreteVariable("n", IntegerType(0, 1), (0,))],
            ),
            role=Role.REQUIREMENT,
        )
        for name in ("b", "c")
    ]
    events = tuple(Event(name, is_controllable=not name.startswith("u_")) for name in ("u_e", "b", "c"))
    one, other = (Binary("=", VariableRead(f"R_{name}", "n"), Constant(value)) for name, value in (("b", 1), ("c", 0)))
    marker = Binary("and", one, other)
    system = System("data", events, (*plants, *watching), (data,), marker=marker)
    assert not check(system, synthesize_modular(system, module_bits=0.0))
    assert len(partition(replace(system, marker=TRUE)).demands) == 1


def of_automata(*automata: Automaton, **more: Any) -> System:
    """The system of some automata; events are uncontrollable if they are called so."""
    names = dict.fromkeys(edge.event for item in automata for edge in item.edges)
    events = tuple(Event(name, is_controllable=not name.startswith("u_")) for name in names)
    return System("by hand", events, automata, **more)


def test_plants_that_share_an_event_or_an_invariant_are_one_part() -> None:
    one, other = automaton("A", ["x -e-> y", "y -back-> x"]), automaton("B", ["x -e-> y", "y -home-> x"])
    assert partition(of_automata(one, other)).parts == (frozenset({"A", "B"}),)
    other = automaton("B", ["x -f-> y", "y -home-> x"])
    assert len(partition(of_automata(one, other)).parts) == 2
    never = Unary("not", Binary("and", StateTest("A", "y"), StateTest("B", "y")))
    assert len(partition(of_automata(one, other, plant_invariants=(never,))).parts) == 1


def test_an_event_that_two_modules_restrict_keeps_both_conditions() -> None:
    """Each of Q and R can at any time do what P must not see; neither module knows of the other one's reason."""
    plant = automaton("P", ["a -c-> b", "b -d-> a"])
    others = [automaton(name, [f"x -u_{name}-> y", f"z -go_{name}-> x", f"x -rest_{name}-> z"]) for name in ("Q", "R")]
    never = tuple(Unary("not", Binary("and", StateTest("P", "b"), StateTest(name, "y"))) for name in ("Q", "R"))
    system = of_automata(plant, *others, invariants=never)
    result = synthesize_modular(system, module_bits=0.0)
    assert len(result.modules) == 2
    assert check(system, result)


def test_what_a_shared_part_leaves_open_is_the_same_in_all_modules() -> None:
    """A shared part goes to b or to c: one module is marked in b alone, the other one in c alone, the whole never."""
    shared = automaton("S", ["a -u_e-> b", "a -u_e-> c", "b -back-> a", "c -back-> a"])
    sides = [automaton(name, [f"x -{name}-> y", f"y -un{name}-> x"]) for name in ("L", "R")]
    marker = conjunction(
        *(
            Binary("or", StateTest("S", where), Binary("and", StateTest(name, "x"), StateTest(name, "y")))
            for where, name in (("b", "L"), ("c", "R"))
        )
    )
    system = of_automata(shared, *sides, marker=marker)
    assert len(modules_of(partition(system), 0.0)) == 2
    assert not check(system, synthesize_modular(system, module_bits=0.0))


def test_a_system_of_nothing_is_one_module() -> None:
    result = synthesize_modular(System("nothing", (), ()))
    assert (len(result.modules), result.states) == (1, 1)


def test_the_module_to_blame_is_reported() -> None:
    system = philosophers(3)
    never = replace(system, invariants=(Unary("not", StateTest("P1", "t")),))
    lost = synthesize_modular(never, module_bits=0.0).unsolved
    assert lost is not None
    assert "P1" in lost.automata
    assert len(lost.automata) < len(system.automata)


@pytest.mark.parametrize(
    ("family", "size", "modules"), [("machines in a row", 4, 3), ("assembly tree", 4, 3), ("inspection tree", 5, 4)]
)
def test_families_in_modules(family: str, size: int, modules: int) -> None:
    system = FAMILIES[family](size)
    result = synthesize_modular(system, module_bits=0.0)
    assert check(system, result)
    assert len(result.modules) == len(result.groups[0]) == modules


def test_what_branches_know_early_takes_the_rules_beyond_bisimulation(monkeypatch: pytest.MonkeyPatch) -> None:
    """Branches that hold other parts are not weakly bisimilar; unless these are seen they block the same."""
    system = FAMILIES["inspection tree"](31)
    assert len(synthesize_modular(system, limit=300).modules) == 16
    monkeypatch.setattr(abstraction, "RULES", (abstraction.weak_bisimulation,))
    assert len(synthesize_modular(system, limit=300).modules) == 1


@pytest.mark.random
def test_any_system_can_be_taken_apart() -> None:
    for seed in seeds(40):
        check(wide_system(seed), synthesize_modular(wide_system(seed)))


@pytest.mark.random
def test_parts_and_demands_are_the_whole() -> None:
    """Each automaton, condition and invariant is in a part or a demand, once, and each of these in a module."""
    for seed in seeds(EXAMPLES):
        system = system_in_parts(seed)
        found = partition(system)
        names = [name for part in found.parts for name in part]
        names += [name for demand in found.demands for name in demand.automata]
        assert sorted(names) == sorted(item.name for item in system.automata)
        assert sorted(place for item in found.demands for place in item.conditions) == list(
            range(len(system.conditions))
        )
        assert sorted(place for item in found.demands for place in item.invariants) == list(
            range(len(system.invariants))
        )
        modules = modules_of(found)
        assert sorted(place for item in modules for place in item.demands) == list(range(len(found.demands)))
        assert {place for item in modules for place in item.parts} == set(range(len(found.parts)))
        for module in modules:
            for place in module.demands:
                assert found.demands[place].parts <= module.parts
