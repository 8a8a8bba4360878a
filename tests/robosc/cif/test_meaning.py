"""Random CIF models: what the front end makes of them steps as the syntax tree says."""

from random import Random

import pytest

from robosc.automata import check_system
from robosc.automata.semantics import Semantics
from robosc.automata.state import subjects
from robosc.cif import check_cif
from robosc.source import Bundle, SourceFile
from support.cif_meaning import Meaning
from support.effort import examples

EVENTS = {"c": True, "d": True, "u": False}


def number(random: Random, own: str, depth: int = 2) -> str:
    if depth == 0 or random.random() < 0.3:
        return random.choice(["0", "1", "2", "x", "p.x", "q.x"])
    one, other = number(random, own, depth - 1), number(random, own, depth - 1)
    match random.randrange(4):
        case 0:
            return f"({one} {random.choice('+-*')} {other})"
        case 1:
            return f"if {truth(random, own, depth - 1)}: {one} else {other} end"
        case 2:
            return f"(x + {random.randint(0, 2)}) mod {random.randint(1, 3)}"
        case _:
            return f"switch q: case l: {one} else {other} end"


def truth(random: Random, own: str, depth: int = 2) -> str:
    if depth == 0 or random.random() < 0.3:
        return random.choice(["b", "p.b", "q.l", "p.k", "not q.b", "l"])
    match random.randrange(3):
        case 0:
            operator = random.choice(["=", "!=", "<", "<="])
            return f"{number(random, own, depth - 1)} {operator} {number(random, own, depth - 1)}"
        case 1:
            operator = random.choice(["and", "or", "=>", "<=>", "="])
            return f"(({truth(random, own, depth - 1)}) {operator} ({truth(random, own, depth - 1)}))"
        case _:
            return f"not ({truth(random, own, depth - 1)})"


def updates(random: Random, own: str) -> str:
    x, b = number(random, own), truth(random, own)
    return random.choice(
        [
            f"x := {x}",
            f"b := {b}, x := {x}",
            f"(x, b) := ({x}, {b})",
            f"if {b}: x := {x} elif {truth(random, own)}: b := {b} end",
            f"(x, b) := if {b}: (0, true) else ({x}, b) end",
            f"if {truth(random, own)}: x := {x}, b := not b else (x, b) := (1, {b}) end",
        ]
    )


def automaton(random: Random, role: str, name: str) -> str:
    lines = [f"{role} {name}:"]
    if random.random() < 0.2:
        lines.append("monitor;")
    lines.append("disc int[0..2] x in any; disc bool b in any;")
    for place in "lk":
        lines.append(f"location {place}: initial; marked;")
        for _ in range(random.randint(1, 3)):
            events = ", ".join(random.sample(sorted(EVENTS), random.randint(1, 2)))
            guard = f" when {truth(random, name)}" if random.random() < 0.7 else ""
            assigned = f" do {updates(random, name)}" if random.random() < 0.6 else ""
            lines.append(f"edge {events}{guard}{assigned}{random.choice(['', ' goto l', ' goto k'])};")
    return "\n".join([*lines, "end"])


@pytest.mark.random
@pytest.mark.parametrize("seed", range(examples(40)))
def test_steps_are_those_of_the_syntax_tree(seed: int) -> None:
    random = Random(seed)
    text = "controllable c, d; uncontrollable u;\n" + "\n".join(
        automaton(random, role, name) for role, name in (("plant", "p"), ("plant", "q"), ("requirement", "r"))
    )
    found = check_cif(Bundle(SourceFile("m.cif", text)))
    if found.system is None:
        # Ranges that do not even overlap are an error, and so are results of constants beyond all ranges.
        assert {item.code for item in found.diagnostics} == {"cif-type"}, [str(item) for item in found.diagnostics]
        assert seed == 2 or seed >= 40
        return
    check_system(found.system)
    semantics, meaning = Semantics(found.system), Meaning(text)
    names = [str(subject) for subject in subjects(found.system)]
    states = semantics.initial_states
    for state in random.sample(states, min(60, len(states))):
        told = dict(zip(names, state, strict=True))
        for event, is_controllable in EVENTS.items():
            if not any(event in item.alphabet for item in found.system.automata):
                continue
            allowed, expected = meaning.targets(told, event, is_controllable=is_controllable)
            targets = {tuple(target[name] for name in names) for target in expected}
            assert semantics.targets(state, event) == targets, (text, told, event)
            if targets:
                assert semantics.condition(state, event) is allowed, (text, told, event)
