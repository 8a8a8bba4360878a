"""Random CIF models of instances: definitions with parameters of every kind, tuples, constants and a channel."""

from random import Random

EVENTS = {"c": True, "u": False, "s": True}
"""Their events, and which are controllable; `s` is a channel."""

CONSTANTS = """\
const int N = 2; const list int L = [0, 1, 2]; const tuple(int a; real b) T = (1, 2);
const dict(int: int) D = {0: 2, 1: 0} + {2: 1}; const real W = 2; const int F = floor(W + 1) - N;
const bool B = W = 2 and T[b] = 2; const set real S = {0, 1}; const bool C = S = {} or 1.0 in S;
"""

FRAME = """\
controllable c; uncontrollable u; controllable int[0..2] s;
group def Y(alg int[0..2] m):
plant def P(event {event} e{flags}):
{p}
end
p: P(s);
end
y: Y({m});
plant def Q(event int[0..2] e{receiving}; alg int n; location z; controllable d):
{q}
end
q: Q(s, {n}, y.p.l, c);
requirement def R(y.P pp; Q qq; uncontrollable v):
{r}
end
r: R(y.p, q, u);
"""


def random_instances(random: Random) -> str:
    """A model of two plants, of which one may send to the other, and a requirement."""
    flags = random.choice(["", "!", "!~", "!?", "~!"])
    p = _Body(random, own="p", other="q", extra=["m", "N"], channel="e!", events=["c", "u"])
    q = _Body(random, own="q", other="y.p", extra=["n", "F"], channel="e?", events=["d", "u"])
    r = _Body(random, own="qq", other="pp", extra=["L[1]", "D[2]"], channel="", events=["c", "v"])
    outside = _Body(random, own="q", other="y.p", extra=["N"], channel="", events=[], is_inside=False)
    frame = FRAME.format(
        event="int[0..2]", flags=flags, receiving=random.choice(["", "?", "?~"]), m=random.choice(["N", "1", "N - 1"]),
        n=outside.number(1), p=p.text(), q=q.text(), r=r.text(),
    )  # fmt: skip
    return CONSTANTS.replace("; const", ";\nconst") + frame


class _Body:
    """Contents of one automaton."""

    def __init__(
        self, random: Random, own: str, other: str, extra: list[str], channel: str, events: list[str], *,
        is_inside: bool = True,
    ) -> None:  # fmt: skip
        self.random, self.own, self.other, self.extra = random, own, other, extra
        self.channel, self.events, self.is_inside = channel, events, is_inside

    def text(self) -> str:
        """Declarations and locations."""
        random = self.random
        lines = ["monitor;"] if random.random() < 0.15 else []
        lines.append("disc int[0..2] x in any; disc bool b in any; disc tuple(int[0..2] a; bool b) t in any;")
        for place in "lk":
            lines.append(f"location {place}: initial; marked;")
            for event in random.sample(self.events, random.randint(1, 2)):
                lines.append(self._edge(event, place))
            if self.channel == "e!":
                # The value that is sent must follow from the state.
                guards = random.choice([["b", "not b"], ["x = 0", "x = 1 and b", "x = 2"], ["true"]])
                lines += [self._edge(f"e!{self._sent()}", place, guard) for guard in guards]
            elif self.channel:
                lines.append(self._edge("e?", place))
        return "\n".join(lines)

    def _sent(self) -> str:
        return self.random.choice(["x", "t[a]", "0", "1", "m", "if b: 0 else x end", "N"])

    def _edge(self, event: str, place: str, guard: str = "") -> str:
        random = self.random
        guard = guard or (self.truth(2) if random.random() < 0.6 else "")
        when = f" when {guard}" if guard else ""
        assigned = f" do {self._updates(event == 'e?')}" if random.random() < 0.7 else ""
        return f"edge {event}{when}{assigned}{random.choice(['', ' goto l', ' goto k'])};"

    def _updates(self, is_receiving: bool) -> str:
        x, b = self.number(2), self.truth(2)
        forms = [
            f"x := {x}", f"b := {b}, x := {x}", f"(x, b) := ({x}, {b})", f"t := ({x}, {b})", f"t[a] := {x}",
            f"t[b] := {b}, t[a] := {x}", "(t[a], x) := (x, t[a])", f"(b, t[1]) := (t[b], {b})", f"t := {self.other}.t",
            f"if {b}: t[a] := {x} elif {self.truth(1)}: b := {b} else t := ({x}, b) end",
            f"t := if {b}: ({x}, true) else t end", "x := t[a], t[0] := x", f"(x, t) := ({x}, (x, b))",
        ]  # fmt: skip
        received = ["x := ?", "t[a] := ?", "t := (?, b)", "x := if ? = 1: 0 else ? end", "(x, t[a]) := (?, x)",
                    "if ? = x: b := not b end, x := (? + 1) mod 3"]  # fmt: skip
        return self.random.choice(received if is_receiving and self.random.random() < 0.8 else forms)

    def number(self, depth: int) -> str:
        """An expression of integers."""
        random = self.random
        if depth == 0 or random.random() < 0.3:
            inner = ["x", "t[a]", "t[0]", *self.extra] if self.is_inside else self.extra
            return random.choice(["0", "1", "2", f"{self.other}.x", f"{self.own}.t[a]", *inner])
        one, other = self.number(depth - 1), self.number(depth - 1)
        match random.randrange(6):
            case 0:
                return f"({one} {random.choice('+-*')} {other})"
            case 1:
                return f"if {self.truth(depth - 1)}: {one} else {other} end"
            case 2:
                return f"({self.own}.x + {random.randint(0, 2)}) mod {random.randint(1, 3)}"
            case 3:
                subject, keys = random.choice(
                    [
                        (self.own, ["l", "k"]), (self.other, ["k", "l"]), (f"{self.own}.x", ["0", "2", "1"]),
                        (f"{self.other}.b", ["true", "false"]),
                        (f"({self.own}.b, {self.other}.l)",
                         ["(true, true)", "(false, true)", "(true, false)", "(false, false)"]),
                    ]
                )  # fmt: skip
                return f"switch {subject}: {' '.join(f'case {key}: {random.choice([one, other])}' for key in keys)} end"
            case 4:
                return f"switch {self.other}.t: case ({random.randint(0, 2)}, {self.truth(0)}): {one} else {other} end"
            case _:
                return f"({one}, {other})[{random.randint(0, 1)}]"

    def truth(self, depth: int) -> str:
        """A condition."""
        random = self.random
        if depth == 0 or random.random() < 0.3:
            inner = ["b", "t[b]", "l"] if self.is_inside else []
            own = ["z"] if self.own == "q" and self.is_inside else []
            return random.choice(["B", "not C", f"{self.other}.b", f"{self.own}.k", f"{self.other}.t[b]", *inner, *own])
        match random.randrange(4):
            case 0:
                operator = random.choice(["=", "!=", "<", "<="])
                return f"{self.number(depth - 1)} {operator} {self.number(depth - 1)}"
            case 1:
                operator = random.choice(["and", "or", "=>", "<=>", "="])
                return f"(({self.truth(depth - 1)}) {operator} ({self.truth(depth - 1)}))"
            case 2:
                return f"{self.own}.t {random.choice(['=', '!='])} {random.choice([f'{self.other}.t', '(1, true)'])}"
            case _:
                return f"not ({self.truth(depth - 1)})"
