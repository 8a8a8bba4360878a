"""Code of automata, in C and in Python: it does what the automata and their supervisor mean, walk by walk."""

import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from random import Random
from typing import Any

import pytest

import robosc
from robosc import SystemSupervisor
from robosc.automata import InputVariable, Semantics, System
from robosc.automata.compile import State
from robosc.automata.state import subject_domain, subjects
from robosc.automata.structure import DiscreteVariable, Edge, EventCondition
from robosc.cif import check_cif
from robosc.errors import UnsupportedModelError
from robosc.expressions import (
    FALSE,
    ITSELF,
    Binary,
    BooleanType,
    Constant,
    Expression,
    IntegerType,
    Unary,
    VariableRead,
)
from robosc.recursion import allow_depth
from robosc.source import Bundle, SourceFile
from robosc.supervisor.predicates import state_predicates
from robosc.targets import GenerateOptions, generate_automata
from support.effort import examples
from support.pythons import python_of
from support.random_cif import random_controller
from support.systems import Unrestricted, automaton, system

WARNINGS = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror"]

BAKERY = """
enum Mode = off, slow, fast;
input Mode m; input int[-2..5] heat; input bool lid;
controllable c_bake, c_wait; uncontrollable u_done;
plant oven:
  disc Mode last = slow;
  disc int[-3..3] crumbs = -1;
  location cold: initial; marked;
    edge c_bake when not lid and m != off do last := m, crumbs := max(min(heat, 3), -abs(heat) mod 3) goto hot;
    edge c_wait;
  location hot:
    edge u_done do crumbs := (crumbs * heat) div 6 goto cold;
    edge c_wait when heat mod 4 = -1 or switch last: case slow: heat > 2 else lid end;
end
plant shelf:
  disc int[0..2] count;
  location: initial; marked;
    edge u_done do count := count + 1;
    edge c_wait when count > 0 do count := count - 1;
end
requirement counter:
  monitor c_wait;
  location even: initial; marked;
    edge c_bake goto odd;
    edge c_wait when lid;
  location odd:
    edge c_bake when heat > 0 goto even;
    edge c_wait when not lid goto even;
end
requirement u_done needs oven.crumbs < 3;
"""


def supervisor_of(text: str) -> SystemSupervisor | None:
    found = check_cif(Bundle(SourceFile("model.cif", text)))
    return None if found.system is None else robosc.synthesize(found.system).supervisor


class Reference:
    """Meaning of the automata, printed as the generated programs print it."""

    def __init__(self, supervisor: SystemSupervisor, first: dict[str, Any]) -> None:
        self.system = supervisor.system
        self.semantics = Semantics(self.system)
        self.added = state_predicates(self.system, supervisor.added)
        places = {str(item): place for place, item in enumerate(subjects(self.system))}
        self.inputs = {item.event: places[item.event] for item in self.system.inputs}
        self.values = {
            name: subject_domain(self.system, subjects(self.system)[place]) for name, place in self.inputs.items()
        }
        known = frozenset[str]().union(*(item.alphabet for item in self.system.automata))
        self.events = [item for item in self.system.events if item.name in known and item.name not in self.inputs]
        begins = [
            state
            for state in self.semantics.initial_states
            if all(state[self.inputs[name]] == value for name, value in first.items())
        ]
        self.begins = [state for state in begins if supervisor.may_begin(state)]
        self.state: State = self.begins[0] if self.begins else ()

    def target(self, event: str, given: dict[Any, Any]) -> State | None:
        item = self.system.event(event)
        if item.is_controllable and not self.semantics.condition(self.state, event):
            return None
        if event in self.added and not self.added[event](self.state):
            return None
        targets = self.semantics.targets(self.state, event, given)
        assert len(targets) <= 1
        return next(iter(targets), None)

    def printed(self) -> list[str]:
        lines = []
        for subject, value in zip(subjects(self.system), self.state, strict=True):
            name = subject.automaton if subject.automaton in self.inputs else str(subject)
            is_printed = subject.variable is not None or len(self.system.automaton(subject.automaton).locations) > 1
            if is_printed:
                lines.append(f"{name} = {str(value).lower() if isinstance(value, bool) else value}")
        possible = [event.name for event in self.events if self.target(event.name, {}) is not None]
        return [
            *lines,
            f"marked = {str(self.semantics.is_marked(self.state)).lower()}",
            " ".join(["possible:", *possible]),
        ]

    def line(self, line: str) -> list[str]:
        """The answer to a line: what happens, and then the state."""
        words = line.split()
        if words == ["run"]:
            return [*self._run(), *self.printed()]
        if words[0] in self.inputs:
            raw = {"true": True, "false": False}.get(words[1], words[1])
            value = int(words[1]) if words[1].lstrip("-").isdigit() else raw
            target = self.target(words[0], {(): value}) if value in self.values[words[0]] else None
            printed = [] if target else [f"impossible {words[0]}"]
        else:
            target = self.target(words[0], {})
            printed = [f"happened {words[0]}"] if target else [f"impossible {words[0]}"]
        self.state = target or self.state
        return [*printed, *self.printed()]

    def _run(self) -> list[str]:
        events = [event.name for event in self.events if event.is_controllable]
        printed: list[str] = []
        place = refused = 0
        while events and refused < len(events) and len(printed) < 100:
            target = self.target(events[place], {})
            refused += 1
            if target is not None:
                self.state, refused = target, 0
                printed.append(f"happened {events[place]}")
            place = (place + 1) % len(events)
        return printed


def walk(reference: Reference, random: Random, count: int) -> tuple[str, list[str]]:
    """A walk of some lines, and everything that is printed of it."""
    printed, lines = reference.printed(), []
    for _ in range(count):
        names = [event.name for event in reference.events]
        possible = [name for name in names if reference.target(name, {}) is not None]
        choices = [random.choice(names), *([random.choice(possible)] * 3 if possible else []), "run"]
        for name in reference.inputs:
            value = random.choice([*reference.values[name]])
            choices += [f"{name} {str(value).lower() if isinstance(value, bool) else value}"] * 2
            if not isinstance(value, str | bool):
                choices.append(f"{name} 77")
        lines.append(random.choice(choices))
        printed += reference.line(lines[-1])
    return "".join(f"{line}\n" for line in lines), printed


def in_c(supervisor: SystemSupervisor, folder: Path) -> list[str]:
    files = generate_automata(supervisor, "c99")
    for name, text in files.items():
        (folder / name).write_text(text)
    program = folder / "program"
    subprocess.run(["gcc", *WARNINGS, "-o", program, *sorted(folder.glob("*.c"))], check=True)
    return [str(program)]


def in_python(supervisor: SystemSupervisor, folder: Path) -> list[str]:
    files = generate_automata(supervisor, "python")
    for name, text in files.items():
        (folder / name).write_text(text)
    return [sys.executable, "-I", "-W", "error", str(folder / next(iter(files)))]


def answers(command: list[str], lines: str) -> list[str]:
    return subprocess.run(command, input=lines, capture_output=True, text=True, check=True).stdout.splitlines()


def require_equal(supervisor: SystemSupervisor, first: dict[str, Any], seed: int, count: int, folder: Path) -> int:
    """Compare walks in both languages with what the automata mean; returns how many events happened."""
    lines, printed = walk(Reference(supervisor, first), Random(seed), count)
    for number, make in enumerate((in_c, in_python)):
        own = folder / str(number)
        own.mkdir(parents=True)
        assert answers(make(supervisor, own), lines) == printed, lines
    return sum(line.startswith("happened") for line in printed)


def test_a_model_with_everything(tmp_path: Path) -> None:
    supervisor = supervisor_of(BAKERY)
    assert supervisor is not None
    assert "u_done" in str(supervisor.system.conditions)
    happened = require_equal(supervisor, {"m": "off", "heat": -2, "lid": False}, 1, 300, tmp_path)
    assert happened > 20


def test_an_old_python(tmp_path: Path) -> None:
    supervisor = supervisor_of(BAKERY)
    assert supervisor is not None
    _, *rest = in_python(supervisor, tmp_path)
    lines, printed = walk(Reference(supervisor, {"m": "off", "heat": -2, "lid": False}), Random(2), 100)
    assert answers([str(python_of(8)), *rest], lines) == printed


@pytest.mark.random
def test_random_models(tmp_path: Path) -> None:
    first: dict[str, Any] = {"s": False, "n": -1}
    compared = happened = 0
    for seed in range(examples(15)):
        supervisor = supervisor_of(random_controller(Random(seed)))
        if supervisor is None or not Reference(supervisor, first).begins:
            continue
        happened += require_equal(supervisor, first, seed, 60, tmp_path / str(seed))
        compared += 1
    assert compared > examples(15) // 4
    assert happened > 5 * compared


@pytest.mark.parametrize(
    ("text", "inputs", "least"),
    [
        # The plants cannot do it.
        ("input bool s; controllable c; plant p: location: initial; marked; edge c; end plant c needs s;", ["s"], 5),
        # It may begin in two states, in one of which the supervisor lets it.
        (
            "input bool s; uncontrollable u; controllable c; plant p: disc int[0..1] x in any;"
            " location a: initial; marked; edge u when x = 1 goto b; edge c;"
            " location b: marked; end requirement invariant p.a;",
            ["s"],
            5,
        ),
        # The supervisor compares two variables of an enumeration.
        (
            "enum Room = hall, attic, yard; input bool s; controllable c, d; uncontrollable u, v, w;"
            " plant cat: disc Room room = hall; location: initial; marked; edge u when room = hall do room := attic;"
            " edge u when room = attic do room := yard; edge v when room = yard do room := hall; end"
            " plant mouse: disc Room room = yard; location: initial; marked; edge w do room := cat.room; end"
            " plant bell: location still: initial; marked; edge c when s goto rung; edge u, v, w;"
            " location rung: edge w when cat.room = mouse.room goto lost; edge d goto still; location lost; end",
            ["s"],
            5,
        ),
        # Edges that do the same are one edge.
        (
            "controllable c, d; plant p: disc int[0..3] x; location: initial; marked;"
            " edge c when x < 2 do x := x + 1; edge c when x < 3 do x := x + 1; edge d do x := 0; end",
            [],
            10,
        ),
        # A language keeps these names.
        (
            "controllable int_, count, None_; input bool class_;"
            " plant State: disc bool while_, next_, s; location for_: initial; marked; edge int_ do s := class_"
            " goto lambda_; location lambda_: edge count when s do next_ := s goto for_;"
            " edge None_ do while_ := not while_ goto for_; end",
            ["class_"],
            20,
        ),
    ],
    ids=["plants-restrict", "two-beginnings", "variables-compared", "same-edges", "kept-names"],
)
def test_small_models(text: str, inputs: list[str], least: int, tmp_path: Path) -> None:
    supervisor = supervisor_of(text)
    assert supervisor is not None
    assert require_equal(supervisor, dict.fromkeys(inputs, False), 5, 80, tmp_path) > least


def test_where_the_supervisor_does_not_let_it_begin(tmp_path: Path) -> None:
    """An input that stays as it is, and is bad if it is true."""
    found = check_cif(Bundle(SourceFile("m.cif", "input bool hot; plant p: location a: initial; marked; end")))
    assert found.system is not None
    fixed = replace(
        found.system,
        plant_conditions=(EventCondition("hot", FALSE),),
        invariants=(Unary("not", VariableRead("hot", ITSELF)),),
    )
    supervisor = robosc.synthesize(fixed).supervisor
    assert supervisor is not None
    space: dict[str, Any] = {"__name__": "module"}
    exec(Path(in_python(supervisor, tmp_path)[-1]).read_text(), space)
    assert space["Supervisor"]({"hot": False}).values() == {"hot": False}
    with pytest.raises(ValueError, match="may not begin so"):
        space["Supervisor"]({"hot": True})
    # The program in C begins with what is false.
    turned = replace(fixed, invariants=(VariableRead("hot", ITSELF),))
    supervisor = robosc.synthesize(turned).supervisor
    assert supervisor is not None
    done = subprocess.run(in_c(supervisor, tmp_path), input="", capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (1, "the system may not begin so\n")


def test_where_the_system_may_not_begin(tmp_path: Path) -> None:
    """An input that would lead at once to an inevitable fault is refused at the beginning, not later."""
    supervisor = supervisor_of(
        "input bool hot; uncontrollable u; plant p: location a: initial; marked; edge u when hot goto b;"
        " location b: marked; end\ninitial not hot; plant invariant p.a or hot; requirement invariant p.a;"
        " plant invariant not hot or p.b;"
    )
    assert supervisor is not None
    for make in (in_c, in_python):
        (tmp_path / make.__name__).mkdir()
        assert answers(make(supervisor, tmp_path / make.__name__), "hot true\nu\n").count("impossible hot") == 1
    module = next(iter((tmp_path / "in_python").glob("*.py"))).read_text()
    space: dict[str, Any] = {"__name__": "module"}
    exec(module, space)
    with pytest.raises(ValueError, match="may not begin so"):
        space["Supervisor"]({"hot": True})
    for wrong, message in (({"hot": 1}, "1 is not a value of hot"), ({"cold": True}, "there is no input 'cold'")):
        with pytest.raises(ValueError, match=message):
            space["Supervisor"](wrong)
        with pytest.raises(ValueError, match=message):
            space["Supervisor"]().set_inputs(wrong)


SQUARE = Binary("*", VariableRead("A", "x"), VariableRead("A", "x"))
WIDE = replace(
    automaton("A", ["a -go-> a"]),
    variables=(DiscreteVariable("x", IntegerType(0, 60_000), (0,)),),
    edges=(Edge("a", "go", "a", Binary("<", SQUARE, Constant(7))),),
)
CHOICE = automaton("A", ["a -go-> b", "a -go-> c", "b -back-> a", "c -back-> a"])


@pytest.mark.parametrize(
    ("made", "message"),
    [
        (system(CHOICE), "the event go leads to several states from A.a; its guards must exclude each other"),
        (system(replace(CHOICE, edges=CHOICE.edges[1:], initial=("a", "c"))), "may begin in 2 states"),
        (system(replace(CHOICE, edges=CHOICE.edges[1:], name='A */ "; exit(1)')), "is neither an identifier"),
        (
            replace(system(CHOICE), inputs=(InputVariable("go", (), BooleanType()),)),
            "the event 'go' carries data",
        ),
        (system(WIDE), "a result may leave 32 bits, and has no code: plant A"),
    ],
)
@pytest.mark.parametrize("target", ["c99", "python"])
def test_what_has_no_code(target: str, made: System, message: str) -> None:
    with pytest.raises(UnsupportedModelError, match=re.escape(message)):
        generate_automata(Unrestricted(made), target)


@pytest.mark.parametrize("target", ["c99", "python"])
def test_what_is_nested_too_deeply_has_no_code(target: str) -> None:
    # The depth is the most that a front end may produce, and deeper than compilers take brackets.
    allow_depth(5_000, 4)
    deep: Expression = VariableRead("A", "x")
    for number in range(500):
        deep = Binary("and" if number % 2 else "or", VariableRead("A", "xyz"[number % 3]), deep)
    variables = tuple(DiscreteVariable(name, BooleanType(), (False,)) for name in "xyz")
    made = replace(WIDE, variables=variables, edges=(Edge("a", "go", "a", deep),))
    with pytest.raises(UnsupportedModelError, match="nested too deeply"):
        generate_automata(Unrestricted(system(made)), target)


@pytest.mark.parametrize("kind", ["controllable", "uncontrollable"])
def test_a_model_of_almost_nothing(kind: str, tmp_path: Path) -> None:
    supervisor = supervisor_of(f"{kind} e; plant p: location: initial; marked; edge e; end")
    assert supervisor is not None
    require_equal(supervisor, {}, 1, 5, tmp_path)


def test_the_package_names_the_files() -> None:
    supervisor = supervisor_of(BAKERY)
    assert supervisor is not None
    made = robosc.generate(supervisor, "c99", GenerateOptions(package="bread"))
    assert made.files is not None
    assert {"bread_supervisor.c", "bread_supervisor.h"} < set(made.files)
    made = robosc.generate(supervisor.system, "python", GenerateOptions(package="bread"))
    assert set(made.files or ()) == {"bread.py"}
    refused = robosc.generate(supervisor, "ros2")
    assert "needs a model of a robot" in refused.reason
