"""Random CIF models that say much of states: where they begin, what is marked, what is invariant."""

from random import Random

EVENTS = {"c": True, "u": False}
"""Their events, and which are controllable."""


INPUTS: dict[str, tuple[str, list[bool] | list[int]]] = {"s": ("bool", [False, True]), "n": ("int[0..2]", [0, 1, 2])}
"""The input variables that they may have: type and values."""


def random_predicates(random: Random, *, is_open: bool = False) -> str:
    """A model of two plants and a requirement, in which what begins later may depend on what begins earlier.

    Args:
        random: Source of its choices.
        is_open: It may have input variables, and its requirement has no variables.
    """
    names = [f"{name}.{part}" for name in "pqr" for part in ("l", "k")]
    names += [f"{name}.{part}" for name in ("pq" if is_open else "pqr") for part in ("x", "b", "t[a]", "t[b]")]
    inputs = [name for name in INPUTS if is_open and random.random() < 0.5]
    text = "controllable c; uncontrollable u;\n" + "".join(f"input {INPUTS[name][0]} {name};\n" for name in inputs)
    before, everything = inputs.copy(), _Reads(random, [*names, *inputs])
    for role, name in (("plant", "p"), ("plant", "q"), ("requirement", "r")):
        text += _automaton(random, role, name, before, everything, has_variables=f"{name}.x" in names)
    lines = [_predicate_line(random, everything) for _ in range(random.randint(0, 3))]
    return f"{text}{' '.join(lines)}\ngroup g: {_predicate_line(random, everything)} end\n"


class _Reads:
    """Random expressions over what may be read."""

    def __init__(self, random: Random, names: list[str]) -> None:
        self._random = random
        self._numbers = [name for name in names if name.endswith((".x", "[a]")) or name == "n"]
        self._truths = [name for name in names if name not in self._numbers]

    def number(self) -> str:
        return self._random.choice(["0", "1", "2", *self._numbers, *self._numbers])

    def truth(self, depth: int = 2) -> str:
        random = self._random
        if depth == 0 or random.random() < 0.3:
            return random.choice(["true", *self._truths])
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


def _automaton(
    random: Random, role: str, name: str, before: list[str], everything: _Reads, *, has_variables: bool
) -> str:
    earlier = _Reads(random, list(before))
    lines = [f"{role} {name}:"]
    if has_variables:
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
        if random.random() < 0.2:
            lines.append(_invariant(random, everything))
        lines += [
            f"edge {event}{_action(random, everything, has_variables)}{random.choice(['', ' goto l', ' goto k'])};"
            for event in EVENTS
            if random.random() < 0.8
        ]
    before += [f"{name}.l", f"{name}.k"]
    return "\n".join([*lines, "end\n"])


def _action(random: Random, reads: _Reads, has_variables: bool) -> str:
    """Text between an event and its target."""
    guard = random.choice(["", "", f" when {reads.truth()}"])
    updates = ["", f" do x := {reads.number()}", f" do x := x + {random.randint(1, 2)}", " do x := x - 1",
               f" do b := {reads.truth()}, t[a] := {reads.number()}",
               f" do t := ({reads.number()}, {reads.truth()}), b := not b"]  # fmt: skip
    return guard + (random.choice(updates) if has_variables else "")


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
