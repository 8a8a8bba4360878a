"""Random CIF models, of automata at the root with variables, guards, updates and monitors."""

import re
from random import Random

EVENTS = {"c": True, "d": True, "u": False}
"""Their events, and which are controllable."""


def random_model(random: Random) -> str:
    """A model of two plants and a requirement."""
    return "controllable c, d; uncontrollable u;\n" + "\n".join(
        _automaton(random, role, name) for role, name in (("plant", "p"), ("plant", "q"), ("requirement", "r"))
    )


def random_controller(random: Random) -> str:
    """A model that leaves nothing open but its inputs, a truth value and a number: each event leads to one state."""
    text = "controllable c, d; uncontrollable u;\ninput bool s; input int[-1..2] n;\n" + "\n".join(
        _automaton(random, role, name, is_open=False)
        for role, name in (("plant", "p"), ("plant", "q"), ("requirement", "r"))
    )
    more = ["requirement c needs p.b or n > 0;", "plant d needs q.l or s;", "plant invariant p.x < 2 or q.x < 2;",
            "requirement {d, c} disables p.k and s;", "marked q.x != 2;"]  # fmt: skip
    text += "\n" + "\n".join(random.sample(more, random.randint(0, 2)))
    return re.sub(r"not q\.b|q\.x", lambda found: random.choice([found[0], "s" if "b" in found[0] else "n"]), text)


def _number(random: Random, own: str, depth: int = 2) -> str:
    if depth == 0 or random.random() < 0.3:
        return random.choice(["0", "1", "2", "x", "p.x", "q.x"])
    one, other = _number(random, own, depth - 1), _number(random, own, depth - 1)
    match random.randrange(4):
        case 0:
            return f"({one} {random.choice('+-*')} {other})"
        case 1:
            return f"if {_truth(random, own, depth - 1)}: {one} else {other} end"
        case 2:
            return f"(x + {random.randint(0, 2)}) mod {random.randint(1, 3)}"
        case _:
            return f"switch q: case l: {one} else {other} end"


def _truth(random: Random, own: str, depth: int = 2) -> str:
    if depth == 0 or random.random() < 0.3:
        return random.choice(["b", "p.b", "q.l", "p.k", "not q.b", "l"])
    match random.randrange(3):
        case 0:
            operator = random.choice(["=", "!=", "<", "<="])
            return f"{_number(random, own, depth - 1)} {operator} {_number(random, own, depth - 1)}"
        case 1:
            operator = random.choice(["and", "or", "=>", "<=>", "="])
            return f"(({_truth(random, own, depth - 1)}) {operator} ({_truth(random, own, depth - 1)}))"
        case _:
            return f"not ({_truth(random, own, depth - 1)})"


def _updates(random: Random, own: str) -> str:
    x, b = _number(random, own), _truth(random, own)
    return random.choice(
        [
            f"x := {x}",
            f"b := {b}, x := {x}",
            f"(x, b) := ({x}, {b})",
            f"if {b}: x := {x} elif {_truth(random, own)}: b := {b} end",
            f"(x, b) := if {b}: (0, true) else ({x}, b) end",
            f"if {_truth(random, own)}: x := {x}, b := not b else (x, b) := (1, {b}) end",
        ]
    )


def _automaton(random: Random, role: str, name: str, is_open: bool = True) -> str:
    lines = [f"{role} {name}:"]
    if random.random() < 0.2:
        lines.append("monitor;")
    lines.append("disc int[0..2] x in any; disc bool b in any;" if is_open else "disc int[0..2] x = 1; disc bool b;")
    for place in "lk":
        lines.append(f"location {place}: {'initial; ' if is_open or place == 'l' else ''}marked;")
        left = [] if is_open else random.sample(sorted(EVENTS), 3)
        for _ in range(random.randint(1, 3)):
            events = ", ".join(random.sample(sorted(EVENTS), random.randint(1, 2)) if is_open else [left.pop()])
            guard = f" when {_truth(random, name)}" if random.random() < 0.7 else ""
            assigned = f" do {_updates(random, name)}" if random.random() < 0.6 else ""
            lines.append(f"edge {events}{guard}{assigned}{random.choice(['', ' goto l', ' goto k'])};")
    return "\n".join([*lines, "end"])
