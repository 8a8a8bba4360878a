"""Supervisors of automata in files: there and back, and whatever is no such supervisor is refused in one sentence."""

import json
import random
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import robosc
from robosc.automata import System
from robosc.errors import InvalidSupervisorError, InvalidSystemError, UnsupportedModelError
from robosc.expressions import Expression, StateTest, Unary
from robosc.pipeline.systems import decode_system
from support.automata_models import BUFFER, DOOR, TANK
from support.damaged_json import change_value
from support.effort import examples
from support.generated import example_supervisor
from support.random_systems import any_system, system_seeds, wide_system
from support.supervised_systems import supervised
from support.systems import automaton, system

MACHINE = system(
    automaton("M", ["idle -start-> busy", "busy -u_done-> idle"], marked=["idle"]),
    automaton("B", ["empty -u_done-> full", "full -u_done-> lost", "full -take-> empty"], marked=["empty"]),
)


def document(automata: System = MACHINE) -> Any:
    """The file of a supervisor as JSON."""
    return json.loads(supervised(automata).encode())


def as_bytes(value: Any) -> bytes:
    return json.dumps(value).encode()


def test_there_and_back(tmp_path: Path) -> None:
    supervisor = supervised(MACHINE)
    print(supervisor.conditions)  # The conditions in words are no part of it.
    path = supervisor.write(tmp_path / "line.rsup")
    found = robosc.SystemSupervisor.read(path)
    assert (found, found.statistics) == (supervisor, supervisor.statistics)
    assert str(found) == str(supervisor)
    assert robosc.verify(found).passed
    assert found.encode() == path.read_bytes() == supervisor.encode()
    run = robosc.simulate(found)
    run.step("start")
    run.step("u_done")
    assert run.enabled == ("take",)


@settings(max_examples=examples(40))
@given(system_seeds())
def test_random_automata_there_and_back(seed: int) -> None:
    supervisor = robosc.synthesize(any_system(seed)).supervisor
    if supervisor is not None:
        content = supervisor.encode()
        found = decode_system(content)
        assert (found, found.statistics) == (supervisor, supervisor.statistics)
        assert found.encode() == content
        assert decode_system(json.dumps(json.loads(content), indent=2).encode()) == supervisor


def test_all_that_automata_offer_there_and_back() -> None:
    supervisors = [robosc.synthesize(wide_system(seed)).supervisor for seed in range(12)]
    found = [item for item in supervisors if item is not None]
    assert any(item.initial is not None for item in found)
    assert any(item.system.inputs for item in found)
    for supervisor in found:
        assert decode_system(supervisor.encode()) == supervisor


def survives(data: bytes) -> bool:
    """Return True if bytes are a supervisor of automata; then every later stage must be able to take it."""
    try:
        found = decode_system(data)
    except InvalidSupervisorError as error:
        assert str(error)
        assert "\n" not in str(error)
        return False
    assert decode_system(found.encode()) == found
    try:
        robosc.verify(found, maximum_states=200)
    except (InvalidSystemError, UnsupportedModelError) as error:
        assert str(error)  # Faults that only values can show.
    return True


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("tank.cif", f"group yard: {TANK} end requirement yard.tank.c_fill needs yard.tank.level < 3;"),
        (
            "modes.cif",
            "group a: group b: enum E = X, Y; plant p: disc E e = X; controllable c; location s: initial; marked; "
            "edge c when e = X do e := Y goto t; location t: marked; end end end "
            "requirement a.b.p.c needs a.b.p.e = a.b.X and a.b.p.s;",
        ),
        ("line.gen", BUFFER.replace('"Buffer"', '"My\x1bbuffer"').replace("full", "no.1")),
        (
            "door.wmod",
            DOOR.replace('"wide"/>', '"wide"><EventList><SimpleIdentifier Name=":forbidden"/></EventList></SimpleNode>')
            .replace('<EventDecl Kind="C', '<EventDecl Kind="PROPOSITION" Name=":forbidden"/><EventDecl Kind="C')
            .replace('"wide"', '"wide {1}"'),
        ),
    ],
)
def test_names_are_those_of_the_language(name: str, text: str) -> None:
    """Automata of CIF stand in groups, and names of other tools may be any text."""
    model = robosc.load(text=text, name=name)
    supervisor = robosc.synthesize(model).supervisor
    assert isinstance(supervisor, robosc.SystemSupervisor)
    assert decode_system(supervisor.encode()) == supervisor


def test_names_that_are_not_there_move_no_cursor() -> None:
    value = document()
    value["system_supervisor"]["added"][0]["condition"]["nodes"][0]["automaton"] = "B\n\x1b[2J"
    with pytest.raises(InvalidSupervisorError, match="does not exist") as raised:
        decode_system(as_bytes(value))
    assert str(raised.value).isprintable()


def test_damaged_values() -> None:
    contents = [supervised(MACHINE).encode()]
    contents += [made.encode() for seed in range(4) if (made := robosc.synthesize(wide_system(seed)).supervisor)]
    accepted = 0
    for seed in range(300):
        chance = random.Random(seed)
        value = json.loads(chance.choice(contents))
        change_value(value, chance)
        accepted += survives(as_bytes(value))
    assert 5 <= accepted <= 250
    print(f"accepted {accepted} of 300 changed supervisors")


@settings(max_examples=examples(60))
@given(seed=st.integers(0, 2**64))
def test_damaged_bytes(seed: int) -> None:
    chance = random.Random(seed)
    data = bytearray(supervised(MACHINE).encode())
    start = chance.randrange(len(data))
    if chance.random() < 0.5:
        data[start] = chance.randrange(256)
    else:
        del data[start : start + chance.randint(1, 20)]
    survives(bytes(data))


@pytest.mark.parametrize(
    ("path", "new", "words"),
    [
        (("format",), "robosc", "its field 'format' is not 'robosc-supervisor'"),
        (("version",), 2, "this one has version 2"),
        (("system_supervisor", "extra"), 1, r"unknown field 'extra' at \$.system_supervisor"),
        (
            ("system_supervisor", "system", "automata", 0, "edges", 0, "extra"),
            1,
            r"unknown field 'extra' at .*edges\[0\]",
        ),
        (("system_supervisor", "system", "automata", 0, "role"), "model", "malformed"),
        (("system_supervisor", "system", "automata", 0, "initial"), ["gone"], "there is no location gone"),
        (("system_supervisor", "system", "automata", 0, "edges", 0, "target"), "gone", "there is no location gone"),
        (("system_supervisor", "added", 0, "event"), "u_done", "no such controllable event"),
        (("system_supervisor", "added", 0, "event"), "x\n" * 200, "no such controllable event"),
        (("system_supervisor", "added", 0, "condition", "root"), 9, "the root is not a node"),
        (("system_supervisor", "initial"), {"nodes": [], "root": 2}, "the root is not a node"),
        (("system_supervisor", "statistics", "states"), 0, "a figure of the synthesis is too small"),
    ],
)
def test_a_damaged_file_says_where(path: tuple[Any, ...], new: Any, words: str) -> None:
    value = document()
    place = value
    for step in path[:-1]:
        place = place[step]
    place[path[-1]] = new
    with pytest.raises(InvalidSupervisorError, match=words) as raised:
        decode_system(as_bytes(value))
    assert "\n" not in str(raised.value)


def test_each_kind_of_file_names_its_reader(tmp_path: Path) -> None:
    path = supervised(MACHINE).write(tmp_path / "line.rsup")
    with pytest.raises(InvalidSupervisorError, match=r"which robosc\.SystemSupervisor\.read reads"):
        robosc.Supervisor.read(path)
    other = robosc.Supervisor.of(example_supervisor("maze_solver/maze_solver")).write(tmp_path / "maze.rsup")
    with pytest.raises(InvalidSupervisorError, match=r"a model, which robosc\.Supervisor\.read reads"):
        robosc.SystemSupervisor.read(other)


def test_what_no_file_can_hold_is_not_written(tmp_path: Path) -> None:
    place = tmp_path / "line.rsup"
    supervisor = supervised(MACHINE)
    deep: Expression = StateTest("M", "idle")
    for _ in range(500):
        deep = Unary("not", deep)
    for refused, words in (
        (replace(supervisor, system=replace(MACHINE, invariants=(deep,))), "nested more than 400 operators"),
        (replace(supervisor, added=supervisor.added * 2), "no file can hold the supervisor of by hand: .*twice"),
    ):
        with pytest.raises(UnsupportedModelError, match=words):
            refused.write(place)
        assert not place.exists()


def test_ranges_of_any_size_are_read_at_once() -> None:
    value = document()
    whole = {"type": "integer", "low": -(2**31), "high": 2**31 - 1}
    value["system_supervisor"]["system"]["automata"][0]["variables"] = [{"name": "x", "type": whole, "initial": [0]}]
    assert decode_system(as_bytes(value)).system.automata[0].variables[0].initial == (0,)
