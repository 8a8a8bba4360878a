"""Random CIF models, of automata at the root with variables, guards, updates and monitors."""

from random import Random

EVENTS = {"c": True, "d": True, "u": False}
"""Their events, and which are controllable."""


def random_model(random: Random) -> str:
    """A model of two plants and a requirement."""
    return "controllable c, d; uncontrollable u;\n" + "\n".join(
        _automaton(random, role, name) for role, name in (("plant", "p"), ("plant", "q"), ("requirement", "r"))
    )


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


def _automaton(random: Random, role: str, name: str) -> str:
    lines = [f"{role} {name}:"]
    if random.random() < 0.2:
        lines.append("monitor;")
    lines.append("disc int[0..2] x in any; disc bool b in any;")
    for place in "lk":
        lines.append(f"location {place}: initial; marked;")
        for _ in range(random.randint(1, 3)):
            events = ", ".join(random.sample(sorted(EVENTS), random.randint(1, 2)))
            guard = f" when {_truth(random, name)}" if random.random() < 0.7 else ""
            assigned = f" do {_updates(random, name)}" if random.random() < 0.6 else ""
            lines.append(f"edge {events}{guard}{assigned}{random.choice(['', ' goto l', ' goto k'])};")
    return "\n".join([*lines, "end"])
