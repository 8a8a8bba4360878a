"""Random CIF models that say much of states: where they begin, what is marked, what is invariant."""

from random import Random

EVENTS = {"c": True, "u": False}
"""Their events, and which are controllable."""


def random_predicates(random: Random) -> str:
    """A model of two plants and a requirement, in which what begins later may depend on what begins earlier."""
    before: list[str] = []
    text = "controllable c; uncontrollable u;\n"
    for role, name in (("plant", "p"), ("plant", "q"), ("requirement", "r")):
        text += _automaton(random, role, name, before)
    lines = [_predicate_line(random, _Reads(random, None)) for _ in range(random.randint(0, 3))]
    return f"{text}{' '.join(lines)}\ngroup g: {_predicate_line(random, _Reads(random, None))} end\n"


class _Reads:
    """Random expressions over what may be read: all variables, or those that begin before."""

    def __init__(self, random: Random, before: list[str] | None) -> None:
        names = [f"{name}.{part}" for name in "pqr" for part in ("x", "t[a]", "b", "t[b]", "l", "k")]
        self._random = random
        self.names = names if before is None else before

    def number(self) -> str:
        numbers = [name for name in self.names if name.endswith((".x", "[a]"))]
        return self._random.choice(["0", "1", "2", *numbers, *numbers])

    def truth(self, depth: int = 2) -> str:
        random = self._random
        if depth == 0 or random.random() < 0.3:
            return random.choice(["true", *(name for name in self.names if not name.endswith((".x", "[a]")))])
        match random.randrange(4):
            case 0:
                return f"{self.number()} {random.choice(['=', '!=', '<', '<='])} {self.number()}"
            case 1:
                return (
                    f"({self.truth(depth - 1)}) {random.choice(['and', 'or', '=>', '<=>'])} ({self.truth(depth - 1)})"
                )
            case 2:
                return f"if {self.truth(depth - 1)}: {self.truth(0)} else not ({self.truth(0)}) end"
            case _:
                return f"not ({self.truth(depth - 1)})"


def _automaton(random: Random, role: str, name: str, before: list[str]) -> str:
    earlier = _Reads(random, list(before))
    everything = _Reads(random, None)
    lines = [f"{role} {name}:"]
    for variable, type_, value in (("x", "int[0..2]", earlier.number), ("b", "bool", earlier.truth)):
        lines.append(f"disc {type_} {variable}{_initial(random, [value() for _ in range(2)])};")
    tuples = [f"({earlier.number()}, {earlier.truth(1)})" for _ in range(2)]
    lines.append(f"disc tuple(int[0..2] a; bool b) t{_initial(random, tuples)};")
    before += [f"{name}.{part}" for part in ("x", "b", "t[a]", "t[b]")]
    now = _Reads(random, list(before))
    if random.random() < 0.3:
        lines.append(_predicate_line(random, everything))
    for place in "lk":
        begins = random.choice(["initial;", f"initial {now.truth()};", f"initial {now.truth()}, {now.truth(1)};", ""])
        marked = random.choice(
            ["marked;", f"marked {everything.truth()};", f"marked; marked {everything.truth()};", ""]
        )
        lines.append(f"location {place}: {begins or ('initial;' if place == 'l' else '')} {marked or 'marked true;'}")
        if random.random() < 0.5:
            lines.append(_invariant(random, everything))
        lines += [
            f"edge {event}{random.choice(['', ' goto l', ' goto k'])};" for event in EVENTS if random.random() < 0.8
        ]
    before += [f"{name}.l", f"{name}.k"]
    return "\n".join([*lines, "end\n"])


def _initial(random: Random, values: list[str]) -> str:
    return random.choice(["", " in any", " in any", f" = {values[0]}", f" in {{{', '.join(values)}}}"])


def _predicate_line(random: Random, reads: _Reads) -> str:
    match random.randrange(4):
        case 0:
            return f"initial {reads.truth()};"
        case 1:
            return f"marked {reads.truth()}, {reads.truth(1)};"
        case _:
            return _invariant(random, reads)


def _invariant(random: Random, reads: _Reads) -> str:
    role = random.choice(["plant", "requirement", "requirement invariant", "plant invariant"])
    event = random.choice(["c", "u"])
    return random.choice(
        [
            f"{role} {reads.truth()};", f"{role} {event} needs {reads.truth()};",
            f"{role} {reads.truth()} disables {event};", f"{role} {{c, u}} needs {reads.truth()};",
            f"{role} {reads.truth()} disables {{u, c}}, {event} needs {reads.truth()};",
        ]
    )  # fmt: skip
