"""Random constants of CIF, of every type; most of them are sound."""

from random import Random

SCALARS = ("bool", "int", "int[-3..9]", "int[0..2]", "real", "string")


def random_constants(random: Random) -> str:
    """Constants named `k0`, `k1`, ..., each of which may use those before it."""
    known: list[tuple[str, str]] = []
    lines = []
    for number in range(random.randint(1, 3)):
        type_ = _type(random, 2)
        lines.append(f"const {type_} k{number} = {_Values(random, known).value(type_, 3)};")
        known.append((f"k{number}", type_))
    return "\n".join(lines)


def _type(random: Random, depth: int) -> str:
    if depth == 0 or random.random() < 0.55:
        return random.choice(SCALARS)
    inner, other = _type(random, depth - 1), _type(random, depth - 1)
    return random.choice(
        [
            f"list {inner}", f"list[2] {inner}", f"list[0..3] {inner}", f"set {inner}", f"dict({inner}: {other})",
            f"tuple({inner} a; {other} b)",
        ]
    )  # fmt: skip


def _split(text: str) -> list[str]:
    """The parts of a type in brackets, split at `:` or `;` outside of others."""
    parts, depth = [""], 0
    for char in text:
        depth += (char in "([") - (char in ")]")
        if char in ":;" and depth == 0:
            parts.append("")
        else:
            parts[-1] += char
    return [part.strip() for part in parts]


class _Values:
    def __init__(self, random: Random, known: list[tuple[str, str]]) -> None:
        self.random, self.known = random, known

    def value(self, type_: str, depth: int) -> str:
        """An expression that is mostly of a type."""
        random = self.random
        if random.random() < 0.02:
            type_ = _type(random, 1)
        names = [name for name, other in self.known if other == type_ or random.random() < 0.01]
        if names and random.random() < 0.3:
            return random.choice(names)
        kind = type_.partition("[")[0].partition(" ")[0].partition("(")[0]
        if depth > 0 and random.random() < 0.2:
            return self._wrapped(type_, depth - 1)
        match kind:
            case "bool":
                return self._truth(depth)
            case "int" | "real":
                return self._number(type_, depth)
            case "string":
                return self._text(depth)
            case "list" | "set" | "dict" | "tuple":
                return self._container(kind, type_, depth)
        raise AssertionError(type_)

    def _wrapped(self, type_: str, depth: int) -> str:
        """An expression of any type: a choice, a switch, an element, a cast."""
        random, value = self.random, self.value
        if type_.startswith("tuple") or random.random() < 0.5:
            match random.randrange(3):
                case 0:
                    more = f" elif {self._truth(depth)}: {value(type_, depth)}" if random.random() < 0.3 else ""
                    return f"if {self._truth(depth)}: {value(type_, depth)}{more} else {value(type_, depth)} end"
                case 1:
                    return self._switch(type_, depth)
                case _:
                    return f"({value(type_, depth)})"
        match random.randrange(4):
            case 0:
                place = random.choice(["0", "1", "-1", "1 - 1"] * 4 + ["2"])
                return f"[{value(type_, depth)}, {value(type_, depth)}][{place}]"
            case 1:
                return f"({value(type_, depth)}, {value('bool', 0)})[{random.choice('0000000001')}]"
            case 2:
                return f"{{1: {value(type_, depth)}, 2: {value(type_, depth)}}}[{random.choice('1212123')}]"
            case _ if type_ in ("bool", "real", "string") or random.random() < 0.1:
                return f"<{type_}>({value(type_, depth)})"
            case _:
                return value(type_, depth)

    def _switch(self, type_: str, depth: int) -> str:
        subject, keys = self.random.choice(
            [
                ("true", ["true", "false"]), ("(false, 1 = 1)", ["(true, true)", "(false, true)", "(false, false)"]),
                ("if 1 < 2: 1 else 2 end", ["1", "2"]), ("[true]", ["[true]", "[false]"]), ("2.0", ["1", "2"]),
            ]
        )  # fmt: skip
        cases = "".join(f" case {key}: {self.value(type_, depth)}" for key in keys)
        otherwise = f" else {self.value(type_, depth)}" if self.random.random() < 0.5 else ""
        return f"switch {subject}:{cases}{otherwise} end"

    def _truth(self, depth: int) -> str:
        if depth == 0:
            return self.random.choice(["true", "false"])
        depth -= 1
        kind = self.random.choice([*SCALARS, "int", "real", "list int", "set real", "tuple(int a; real b)"])
        one, other = self.value(kind, depth), self.value(kind, depth)
        element = kind.rpartition(" ")[2]
        return self.random.choice(
            [
                f"({one}) = ({other})", f"({one}) != ({other})", f"({self._truth(depth)}) and ({self._truth(depth)})",
                f"({self._truth(depth)}) or ({self._truth(depth)})", f"not ({self._truth(depth)})",
                f"({self._truth(depth)}) => ({self._truth(depth)})",
                f"({self._truth(depth)}) <=> ({self._truth(depth)})",
                f"({self.value('int', depth)}) < ({self.value('real', depth)})",
                f"({self.value('real', depth)}) >= ({self.value('int', depth)})",
                f"{self.value(element, 0) if kind[:4] in ('list', 'set ') else '1'} in [{self.value('int', depth)}, 2]",
                f"empty({self.value('set int', depth)})", f"({self.value('set real', depth)}) sub {{1.0, 2.0}}",
            ]
        )  # fmt: skip

    def _number(self, type_: str, depth: int) -> str:
        random = self.random
        is_ranged = "[" in type_
        if depth == 0 or random.random() < (0.8 if is_ranged else 0.3):
            large = ["7", "2147483647"] if random.random() < 0.05 else ["1"]
            return random.choice(["0", "1", "2", *large, *(["1.5", "0.0"] if type_ == "real" else [])])
        depth -= 1
        other = random.choice([type_, "int", "real"]) if type_ == "real" else type_
        one, two = self.value(type_, depth), self.value(other, depth)
        forms = [f"({one}) {operator} ({two})" for operator in ("+", "-", "*", "+", "-", "*")]
        forms += [f"({one}) {random.choice(['div', 'mod'])} {random.choice(['2', '-3', '(1 + 1)', f'({two})'])}"]
        forms += [f"-({one})", f"+({one})", f"min({one}, {two})", f"max({one}, {two})", f"abs({one})"]
        if type_ == "real":
            forms += [
                f"({one}) / 2",
                f"({one}) / ({two})",
                f"sqrt(abs({one}))",
                f"<real>({self.value('int', depth)})",
            ] * 2
        else:
            forms += [f"size({self.value('list int', depth)})", f"floor({self.value('real', depth)})", f"sign({one})",
                      f"size({self.value('list[2] bool', depth)})", f"round({self.value('real', depth)})"]  # fmt: skip
        return random.choice(forms)

    def _text(self, depth: int) -> str:
        if depth == 0:
            return self.random.choice(['"a"', '"bc"', '""'])
        random, one = self.random, self.value("string", depth - 1)
        match random.randrange(8):
            case 0:
                return f'({one}) + "x"'
            case 1:
                return f'("a" + ({one}))[0]'
            case 2:
                return f"({one})[1:]"
            case 3:
                return f"<string>({self.value('int', depth - 1)})"
            case 4:
                return f"<string>({self.value('bool', depth - 1)})"
        flags = "".join(random.choice(["", "", "", flag]) for flag in "-+ 0,")
        width, precision = random.choice(["", "5", "12", "12"]), random.choice(["", "", "", ".2"])
        kind, type_ = random.choice([("d", "int"), ("f", "real"), ("s", "string"), ("b", "bool"), ("x", "int")])
        two = self.value(type_ if random.random() < 0.9 else "int", depth - 1)
        position = random.choice(["", "", "1$", "2$"])
        return f'fmt("<%{position}{flags}{width}{precision}{kind}%%>", {two}, {self.value("int", 0)})'

    def _container(self, kind: str, type_: str, depth: int) -> str:
        random, depth = self.random, max(depth - 1, 0)
        if kind == "tuple":
            fields = [part.rpartition(" ")[0] for part in _split(type_[6:-1])]
            return f"({', '.join(self.value(field, depth) for field in fields)})"
        if kind == "dict":
            key, value = _split(type_[5:-1])
            rows = [f"{self.value(key, 0)}: {self.value(value, depth)}" for _ in range(random.choice([0, 1, 1, 2]))]
            made = f"{{{', '.join(rows)}}}"
            return (
                f"{made} {random.choice(['+', '-'])} {{{self.value(key, 0)}: {self.value(value, 0)}}}"
                if random.random() < 0.3
                else made
            )
        element = type_.partition(" ")[2]
        count = 2 if "[2]" in type_.partition(" ")[0] else random.choice([0, 1, 2, 2])
        items = ", ".join(self.value(element, depth) for _ in range(count))
        if kind == "set":
            more = f"{random.choice(['and', 'or', '-'])} {{{self.value(element, 0)}}}" if random.random() < 0.3 else ""
            return f"({{{items}}} {more})"
        form = random.choice(["[{}]", "[{}]", "[{}] + []", "[{}][0:2]", "[{}][:]", "([{}] + [{}])"])
        return form.replace("{}", items)
