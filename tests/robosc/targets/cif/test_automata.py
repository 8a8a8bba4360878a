"""The controlled system of a CIF model, written as one: read again, it behaves as the supervisor says."""

import re
from random import Random
from typing import Any

import pytest

from robosc.automata import Automaton, DiscreteVariable, Edge, Event, InputVariable, System
from robosc.automata.controlled import controlled_graph
from robosc.automata.semantics import Semantics
from robosc.automata.state import subjects
from robosc.cif import check_cif
from robosc.errors import UnsupportedModelError
from robosc.expressions import BooleanType, EnumType
from robosc.pipeline.options import DEFAULT_OPTIONS
from robosc.pipeline.systems import SystemSupervisor, synthesize_system
from robosc.source import Bundle, SourceFile
from robosc.supervisor.predicates import state_predicates
from robosc.targets.cif import automata
from support.cif_supported import problems
from support.effort import examples
from support.random_cif import random_model
from support.systems import Unrestricted

HALL = """enum Mode = off, on;
input bool sensor;
group hall:
  controllable c_go, when_; uncontrollable u_x;
  enum Level = LOW, HIGH;
  plant def D(uncontrollable e):
    disc Level level = HIGH;
    disc Mode m in any;
    location $final: initial; marked; edge c_go do m := on;
      edge e when level = HIGH and sensor do level := LOW goto other;
    location other: marked; edge c_go when m = on do level := if m = off: LOW else HIGH end goto $final;
    location nowhere;
  end
  one: D(u_x);
end
plant counter:
  disc int[-1..3] n = 0;
  disc int[0..9] c_go in {2, 7};
  location: initial; marked;
    edge hall.c_go do n := n + 1;
    edge hall.when_ do n := max(n - 1, -(1)), c_go := (c_go + 3) mod 10;
end
plant invariant counter.n != 2 or hall.one.other;
plant hall.when_ needs counter.n > -1;
marked counter.n < 4;
requirement sup:
  alphabet hall.c_go, hall.when_, hall.u_x; monitor hall.u_x;
  location a: initial; marked; edge hall.c_go goto b;
  location b: marked; edge hall.when_ goto a;
end
requirement invariant counter.c_go != 3;
requirement hall.c_go needs hall.one.$final or counter.n < 1;
"""


def supervisor_of(text: str) -> SystemSupervisor | None:
    found = check_cif(Bundle(SourceFile("m.cif", text)))
    if found.system is None:
        return None
    return synthesize_system(found.system, DEFAULT_OPTIONS, lambda progress: None, lambda: False).supervisor


def as_plants(text: str) -> str:
    """A controlled system as a synthesis problem in which all that supervisors do is what plants can do."""
    lines = [f"plant {line.removeprefix('supervisor ')}" if line.startswith("supervisor ") else line
             for line in text.splitlines()]  # fmt: skip
    return "\n".join(lines)


def runs(system: System, supervisor: SystemSupervisor | None = None) -> tuple[set[Any], set[Any]]:
    """The initial states of a controlled system and its transitions, by the names of what has more than one value."""
    if supervisor is None:
        graph = controlled_graph(Semantics(system), {}, limit=100_000)
    else:
        added = state_predicates(system, supervisor.added)
        graph = controlled_graph(Semantics(system), added, limit=100_000, initial=supervisor.may_begin)
    assert graph is not None
    single = {item.name for item in system.automata if len(item.locations) == 1}
    names = [None if item.variable is None and item.automaton in single else str(item) for item in subjects(system)]
    states = [
        frozenset((name, value) for name, value in zip(names, state, strict=True) if name) for state in graph.states
    ]
    initial = {state for state, parent in zip(states, graph.parents, strict=True) if parent is None}
    steps = {
        (states[number], event, states[target])
        for number, found in enumerate(graph.steps)
        for event, targets in found
        for target in targets
    }
    return initial, steps


def written(supervisor: SystemSupervisor) -> str:
    return automata.controlled_system(supervisor)


def read_again(text: str) -> System:
    found = check_cif(Bundle(SourceFile("m.cif", as_plants(text))))
    assert found.system is not None, (text, [str(item) for item in found.diagnostics])
    return found.system


def test_what_is_written_behaves_as_the_supervisor_says() -> None:
    supervisor = supervisor_of(HALL)
    assert supervisor is not None
    text = written(supervisor)
    assert runs(read_again(text)) == runs(supervisor.system, supervisor)
    for line in (
        "enum Mode = off, $on;",
        "    disc hall.Level level = hall.HIGH;",
        "  disc int[0..9] c_go in {2, 7};",
        "    location nowhere;",
        "supervisor automaton sup:",
        "  monitor hall.u_x;",
        "plant hall.when_ needs counter.n > -1;",
        "supervisor automaton sup2:",
        "    edge hall.c_go when counter.n + 1 <= 3;",
        "    edge hall.when_ when counter.c_go >= 1;",
    ):
        assert line in text.splitlines(), text


@pytest.mark.random
@pytest.mark.parametrize("limit", [automata.FORMULA_LIMIT, 0])
@pytest.mark.parametrize("seed", range(examples(12)))
def test_random_models(seed: int, limit: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(automata, "FORMULA_LIMIT", limit)
    supervisor = supervisor_of(random_model(Random(seed)))
    if supervisor is None:
        return
    text = written(supervisor)
    # The supervisor alone keeps to ranges that are wider than they were.
    wider = text.replace("disc int[0..2] x in any;", "disc int[-9..9] x in {0, 1, 2};")
    assert runs(read_again(wider)) == runs(supervisor.system, supervisor), text


def differences(random: Random) -> str:
    """A model in the part of CIF that its synthesis takes, with a difference as the outermost operator of a value."""

    def value() -> str:
        sums = random.sample(["x", "y", "1", "x + y", "2", "y + 3", "x div 2"], 2)
        return random.choice([f"{sums[0]} - ({sums[1]})", sums[0]])

    def guard() -> str:
        return f"x {random.choice(['<', '>', '!='])} {random.randrange(3)}"

    edges = " ".join(f"edge c_{event} when {guard()} do x := {value()}, y := {value()};" for event in "abc")
    first, second = random.randrange(3), random.randrange(2)
    return (
        f"plant p: controllable c_a, c_b, c_c; uncontrollable u; disc int[{first}..{first + 3}] x; "
        f"disc int[{second}..4] y; location: initial; marked; {edges} edge u when x = 2 do y := 4; end "
        f"requirement p.u needs p.y != {random.randrange(1, 4)}; requirement p.c_a needs p.x + p.y < 5;"
    )


@pytest.mark.random
@pytest.mark.parametrize("limit", [automata.FORMULA_LIMIT, 0])
@pytest.mark.parametrize("seed", range(examples(40)))
def test_tools_of_cif_take_what_is_written_if_they_take_the_model(
    seed: int, limit: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(automata, "FORMULA_LIMIT", limit)
    model = differences(Random(seed))
    found = check_cif(Bundle(SourceFile("m.cif", model)))
    if found.system is None:
        # A value that never meets the range is an error.
        assert {item.code for item in found.diagnostics if item.severity == "error"} == {"cif-type"}
        return
    supervisor = supervisor_of(model)
    if supervisor is None:
        return
    text = written(supervisor)
    # The reader of what synthesis takes knows no invariants of supervisors, and no variables of an automaton.
    lines = [re.sub(r"^supervisor (?!automaton)", "requirement ", line) for line in text.splitlines()]
    lines.sort(key=lambda line: not line.startswith("  alg "))
    assert problems("".join(f"{line}\n" for line in lines)) == [], text
    wider = re.sub(r"int\[(\d)\.\.\d\] (\w) = ", r"int[-9..19] \2 = ", text)
    assert runs(read_again(wider)) == runs(supervisor.system, supervisor), text


def test_a_difference_is_compared_as_a_sum() -> None:
    model = "plant p: controllable c_a, c_b, c_c; disc int[0..3] x; disc int[2..5] y; location: initial; marked; {} end"
    for update, guard in (
        ("x := x - 1", "1 <= p.x"),
        ("x := x - y", "p.y <= p.x"),
        ("y := y - x", "p.x + 2 <= p.y"),
        ("y := y + 5 - x", "p.y + 5 <= p.x + 5"),
        ("x := x + y - 1", "p.x + p.y <= 4"),
    ):
        supervisor = supervisor_of(model.format(f"edge c_a do {update}; edge c_b do x := 3; edge c_c do y := 5;"))
        assert supervisor is not None
        assert f"    edge p.c_a when {guard};" in written(supervisor).splitlines(), written(supervisor)
    # Below zero, or beyond 32 bits, it stays a difference.
    for type_, guard in (("int[-2..3]", "-2 <= p.x - 1"), ("int[2147483640..2147483647]", "2147483640 <= p.x - 1")):
        supervisor = supervisor_of(
            f"plant p: controllable c; disc {type_} x; location: initial; marked; edge c do x := x - 1; end"
        )
        assert supervisor is not None
        assert f"    edge p.c when {guard};" in written(supervisor).splitlines(), written(supervisor)


CHOICE = """plant p:
  uncontrollable u;
  disc int[0..2] x in any;
  location: initial; marked; edge u when x = 1 do x := 0;
end
requirement p.u needs p.x = 2;
"""


HIDDEN = """controllable go;
group a:
  plant p:
    disc bool a, go;
    location: initial; marked; edge ^go when not a do a := ^a.p.go;
  end
end
"""

NEVER = """controllable go; uncontrollable u;
plant p:
  alg int[0..2] m = 2; disc int[0..2] x;
  location: initial; marked; edge go when x < 1 do x := x + 1; edge u when x = 2 do x := m + m;
end
"""


@pytest.mark.parametrize(
    ("model", "line"),
    [
        pytest.param(CHOICE, "  initial p.x != 1;", id="initial-states-are-those-of-the-supervisor"),
        pytest.param(HIDDEN, "      edge ^go when not a do a := go;", id="hidden-name-is-written-from-the-root"),
        pytest.param(NEVER, "    edge u when x = 2 do x := if true: 4 else 0 end;", id="value-is-never-in-range"),
    ],
)
def test_a_supervisor_is_written_so_that_it_is_read_as_the_same(model: str, line: str) -> None:
    supervisor = supervisor_of(model)
    assert supervisor is not None
    text = written(supervisor)
    assert line in text.splitlines()
    assert runs(read_again(text)) == runs(supervisor.system, supervisor)


@pytest.mark.parametrize(
    ("name", "literal", "data", "message"),
    [
        ("service calibrate", "a", "", "'service calibrate' is not a name of CIF"),
        ("p", "a-b", "", "'a-b' is not a name of CIF"),
        ("p", "a", "e", "the event 'e' carries data"),
        ("e", "a", "e", "the event 'e' carries data"),
    ],
)
def test_automata_that_are_none_of_cif(name: str, literal: str, data: str, message: str) -> None:
    variable = DiscreteVariable("v", EnumType("E", (literal, "b")), (literal,))
    automaton = Automaton(
        name, ("l",), ("l",), frozenset({"l"}), frozenset({"e", "f"}), (Edge("l", "e", "l"),), (variable,)
    )
    inputs = (InputVariable(data, (), BooleanType()),) if data else ()
    with pytest.raises(UnsupportedModelError, match=message):
        made = System("s", (Event("e", is_controllable=True),), (automaton,), inputs)
        automata.controlled_system(Unrestricted(made))
