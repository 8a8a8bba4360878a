r"""Reactive problems of any size from the literature, and random small ones.

Sources: the arbiter and the lift after N. Piterman, A. Pnueli and Y. Sa'ar, "Synthesis of reactive(1) designs", VMCAI
2006, LNCS 3855, pp. 364-380; the bus after R. Bloem, S. Galler, B. Jobstmann, N. Piterman, A. Pnueli and M. Weiglhofer,
"Specify, compile, run: hardware from PSL", Electronic Notes in Theoretical Computer Science 190(4), 2007, pp. 3-16
(the arbiter of ARM's AMBA AHB), without bursts of four: a locked access lasts as long as its master requests it.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from itertools import combinations
from random import Random

from support.reactive import ReactiveProblem, primed


def arbiter(clients: int) -> ReactiveProblem:
    """A resource for one client at a time: each client that requests it gets it, and gives it back some time."""
    every = range(clients)
    return ReactiveProblem(
        order=tuple(name for item in every for name in (f"r{item}", f"g{item}")),
        inputs=tuple(f"r{item}" for item in every),
        start_inputs=tuple(f"~ r{item}" for item in every),
        start=tuple(f"~ g{item}" for item in every),
        # A request stays until it is granted; a client without the resource and without a request is granted nothing.
        input_moves=tuple(f"(r{item} <=> g{item}) \\/ (r{item}' <=> r{item})" for item in every),
        moves=(
            *(f"(r{item} <=> g{item}) => (g{item}' <=> g{item})" for item in every),
            *_at_most_one([f"g{item}'" for item in every]),
        ),
        assumptions=tuple(f"~ (r{item} /\\ g{item})" for item in every),
        goals=tuple(f"r{item} <=> g{item}" for item in every),
    )


def keeping_arbiter(clients: int) -> ReactiveProblem:
    """The arbiter whose clients may keep the resource for ever: no system can grant every request."""
    return replace(arbiter(clients), assumptions=())


def lift(floors: int) -> ReactiveProblem:
    """A lift that comes to each floor whose button is pressed, rises only if one is, and parks on the lowest floor."""
    every = range(floors)
    pressed = _any_of(f"b{item}" for item in every)
    rises = _any_of(f"(f{item} /\\ f{item + 1}')" for item in range(floors - 1))
    return ReactiveProblem(
        order=tuple(name for item in every for name in (f"b{item}", f"f{item}")),
        inputs=tuple(f"b{item}" for item in every),
        start_inputs=tuple(f"~ b{item}" for item in every),
        start=("f0", *(f"~ f{item}" for item in every[1:])),
        input_moves=(
            *(f"(b{item} /\\ f{item}) => ~ b{item}'" for item in every),
            *(f"(b{item} /\\ ~ f{item}) => b{item}'" for item in every),
        ),
        moves=(
            *_at_most_one([f"f{item}'" for item in every]),
            *(
                f"f{item} => {_any_of(f"f{near}'" for near in (item - 1, item, item + 1) if near in every)}"
                for item in every
            ),
            f"({rises}) => {pressed}",
        ),
        assumptions=(),
        goals=(*(f"b{item} => f{item}" for item in every), f"f0 \\/ {pressed}"),
    )


def closed_lift(floors: int) -> ReactiveProblem:
    """The lift that may not go to the highest floor: no system can answer its button."""
    whole = lift(floors)
    return replace(whole, moves=(*whole.moves, f"~ f{floors - 1}'"))


def bus(masters: int) -> ReactiveProblem:
    """A bus that each requesting master gets some time, from whichever it is, and keeps while it locks it.

    Signals have the names of AMBA AHB: `req` (HBUSREQ), `lock` (HLOCK), `ready` (HREADY); `grant` (HGRANT), `master`
    (HMASTER), `mastlock` (HMASTLOCK), and the paper's own `start`, `decide` and `locked`; `held` is true from the start
    of a locked access until its master's request ends.
    """
    every = range(masters)
    grants, owners = [f"grant{item}" for item in every], [f"master{item}" for item in every]
    owner_requests = _any_of(f"(master{item} /\\ req{item})" for item in every)
    signals = ("ready", "start", "decide", "locked", "mastlock", "held")
    asks = tuple(name for item in every for name in (f"req{item}", f"lock{item}"))
    return ReactiveProblem(
        order=(
            *signals,
            *(name for item in every for name in (f"req{item}", f"lock{item}", f"grant{item}", f"master{item}")),
        ),
        inputs=("ready", *asks),
        start_inputs=("~ ready", *(f"~ {name}" for name in asks)),
        start=(
            *("start", "decide", "~ locked", "~ mastlock", "~ held", "grant0", "master0"),
            *(f"~ {name}" for name in (*grants[1:], *owners[1:])),
        ),
        input_moves=tuple(f"lock{item}' => req{item}'" for item in every),
        moves=(
            *_exactly_one([primed(name) for name in grants]),
            *_exactly_one([primed(name) for name in owners]),
            "~ ready => ~ start'",
            f"held' <=> ((start' /\\ mastlock') \\/ (held /\\ {owner_requests}))",
            f"(held /\\ {owner_requests}) => ~ start'",
            *(f"ready => (master{item}' <=> grant{item})" for item in every),
            "ready => (mastlock' <=> locked)",
            *(f"~ start' => ({name}' <=> {name})" for name in (*owners, "mastlock")),
            *(f"(decide /\\ grant{item}') => (locked' <=> lock{item})" for item in every),
            *(f"~ decide => ({name}' <=> {name})" for name in (*grants, "locked")),
            *(f"(~ grant{item} /\\ ~ req{item}) => ~ grant{item}'" for item in every[1:]),
            f"(decide /\\ ~ {_any_of(f'req{item}' for item in every)}) => grant0'",
        ),
        assumptions=("ready", f"~ (held /\\ {owner_requests})"),
        goals=tuple(f"~ req{item} \\/ master{item}" for item in every),
    )


def locked_bus(masters: int) -> ReactiveProblem:
    """The bus whose masters may lock it for ever: no system can serve the others."""
    return replace(bus(masters), assumptions=("ready",))


FAMILIES: Mapping[str, Callable[[int], ReactiveProblem]] = {"arbiter": arbiter, "lift": lift, "bus": bus}
"""Families that a system exists for."""

HOPELESS: Mapping[str, Callable[[int], ReactiveProblem]] = {
    "arbiter": keeping_arbiter,
    "lift": closed_lift,
    "bus": locked_bus,
}
"""The same with one thing changed, so that there is none from two clients, floors or masters on."""


def random_problem(random: Random) -> ReactiveProblem:
    """Return a small problem: often one that can be solved, often one that cannot."""
    inputs, outputs = ("a", "b"), ("c", "d", "e")[: random.choice((2, 2, 3))]
    here = (*inputs, *outputs)
    everything = (*here, *map(primed, inputs))

    def literal(names: tuple[str, ...]) -> str:
        return random.choice(("", "~ ")) + random.choice(names)

    def move(targets: tuple[str, ...], seen: tuple[str, ...]) -> str:
        # Many of these say that something stays, or leads to something: a game without a memory is won all or nothing.
        if random.randrange(2):
            kept = random.choice(targets)
            return f"{literal(seen)} => ({primed(kept)} <=> {random.choice(('', '~ '))}{kept})"
        return f"({literal(here)} /\\ {literal(seen)}) => {literal(tuple(map(primed, targets)))}"

    def justice() -> str:
        return f"{literal(here)} {random.choice(('/\\', '\\/', '<=>'))} {literal(here)}"

    return ReactiveProblem(
        order=tuple(random.sample(here, len(here))),
        inputs=inputs,
        start_inputs=tuple(literal(inputs) for _ in range(random.randrange(3))),
        start=tuple(literal(outputs) for _ in range(random.randrange(4))),
        input_moves=tuple(move(inputs, here) for _ in range(random.randrange(4))),
        moves=tuple(move(outputs, everything) for _ in range(random.randrange(1, 7))),
        assumptions=tuple(justice() for _ in range(random.randrange(3))),
        goals=tuple(justice() for _ in range(random.randrange(1, 4))),
    )


def _any_of(formulas: Iterable[str]) -> str:
    return f"({' \\/ '.join(formulas)})"


def _at_most_one(names: list[str]) -> list[str]:
    return [f"~ ({first} /\\ {second})" for first, second in combinations(names, 2)]


def _exactly_one(names: list[str]) -> list[str]:
    return [*_at_most_one(names), _any_of(names)]
