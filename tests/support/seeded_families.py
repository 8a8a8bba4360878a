"""Systems of any size with chances in them, and the same systems declared in another order.

They look like what people synthesize for: product lines, bridges and locks, vehicles in zones, lifts, machines in rows,
rings, trees and stars. `seed` decides about what differs between two systems of one size.
"""

from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import partial
from itertools import pairwise
from random import Random

from robosc.automata import Automaton, DiscreteVariable, Edge, EventCondition, Role, System
from robosc.expressions import Binary, BooleanType, Expression, IntegerType, StateTest, Unary, conjunction
from support.families import (
    assembly_tree,
    cat_and_mouse,
    dining_philosophers,
    inspection_tree,
    machines_in_a_row,
    random_robot,
    token_ring,
    transfer_line,
)
from support.systems import automaton, edge, operation, read, system

Needs = list[tuple[str, Expression]]
"""Events, each with a condition that it needs."""


def shuffled(made: System, seed: int) -> System:
    """The same system with everything declared in another order."""
    dice = Random(seed)

    def mixed[T](items: Iterable[T]) -> tuple[T, ...]:
        found = list(items)
        dice.shuffle(found)
        return tuple(found)

    return replace(
        made,
        automata=mixed(made.automata),
        events=mixed(made.events),
        conditions=mixed(made.conditions),
        invariants=mixed(made.invariants),
        plant_conditions=mixed(made.plant_conditions),
        plant_invariants=mixed(made.plant_invariants),
    )


def _either(left: Expression, right: Expression) -> Expression:
    return Binary("or", left, right)


def _no(expression: Expression) -> Expression:
    return Unary("not", expression)


def _with(made: System, needs: Needs, plant_needs: Needs | None = None) -> System:
    """A system with conditions of requirements, and of plants, on its events."""
    return replace(
        made,
        conditions=tuple(EventCondition(*item) for item in needs),
        plant_conditions=tuple(EventCondition(*item) for item in plant_needs or []),
    )


def _switch(name: str, *, is_controllable: bool = True) -> Automaton:
    prefix = "" if is_controllable else "u_"
    return automaton(name, [f"off -{prefix}{name}_on-> on", f"on -{prefix}{name}_off-> off"], marked=["off"])


def product_line(size: int, seed: int) -> System:
    """Devices that some features allow: a tree of features, fixed at the start, and lamps that show other devices."""
    dice = Random(seed)
    count = max(2, size // 3)
    flags = [
        automaton(
            f"F{number}",
            [f"here -F{number}_idle-> here"],
            variables=[DiscreteVariable("has", BooleanType(), (False, True))],
        )
        for number in range(count)
    ]
    rules = []
    # Depth first: features that are near each other by number are near each other in the tree.
    open_ = [0]
    for number in range(1, count):
        child, parent = read(f"F{number}.has"), read(f"F{open_[-1]}.has")
        if dice.random() < 0.5 and len(open_) < 6:
            open_.append(number)
        elif len(open_) > 1 and dice.random() < 0.5:
            open_.pop()
        rules.append(Binary("=", child, parent) if dice.random() < 0.3 else _either(_no(child), parent))
    devices: list[Automaton] = []
    needs: Needs = []
    allowed: Needs = []
    for number in range(size - count):
        name = f"D{number}"
        is_lamp = number > 1 and dice.random() < 0.6
        devices.append(_switch(name, is_controllable=is_lamp))
        # Devices of one feature, and what they show of each other, are near each other.
        feature = read(f"F{min(count - 1, number // 2 + dice.randrange(2))}.has")
        prefix = "" if is_lamp else "u_"
        allowed += [(f"{prefix}{name}_on", feature), (f"{prefix}{name}_off", feature)]
        if is_lamp:
            shown = dice.sample(range(max(0, number - 6), number), 2)
            needs.append((f"{name}_on", _either(*(StateTest(f"D{other}", "on") for other in shown))))
            needs.append((f"{name}_off", StateTest(f"D{shown[0]}", "off")))
    return replace(_with(system(*flags, *devices), needs, allowed), initial=conjunction(*rules))


def _crossing(name: str) -> tuple[list[Automaton], Needs]:
    """A part that opens only while lights are red and barriers are down, and a timer that says when they are clear."""
    open_, lights, barrier, timer = f"{name}_deck", f"{name}_light", f"{name}_barrier", f"{name}_timer"

    def door(part: str) -> Automaton:
        edges = [
            f"shut -{part}_open-> opening",
            f"opening -u_{part}_opened-> wide",
            f"wide -{part}_shut-> closing",
            f"closing -u_{part}_shut-> shut",
        ]
        return automaton(part, edges, marked=["shut", "wide"])

    parts = [door(open_), door(barrier), _switch(lights), _switch(f"{name}_button", is_controllable=False)]
    clock = [
        f"idle -{timer}_start-> running",
        f"running -u_{timer}_ends-> over",
        f"over -{timer}_reset-> idle",
    ]
    parts.append(automaton(timer, clock, marked=["idle"]))
    needs: Needs = [
        (f"{barrier}_shut", StateTest(lights, "on")),
        (f"{barrier}_shut", StateTest(timer, "over")),
        (f"{barrier}_open", StateTest(open_, "shut")),
        (f"{open_}_open", StateTest(barrier, "shut")),
        (f"{open_}_open", StateTest(f"{name}_button", "on")),
        (f"{lights}_off", StateTest(barrier, "wide")),
        (f"{timer}_start", StateTest(lights, "on")),
        (f"{timer}_reset", _either(StateTest(barrier, "shut"), StateTest(lights, "off"))),
    ]
    return parts, needs


def movable_bridges(size: int, seed: int) -> System:
    """Bridges over one water, each of five parts; two neighbours are not open together, and one can be stopped."""
    dice = Random(seed)
    count = max(1, size // 5)
    automata: list[Automaton] = [_switch("stop", is_controllable=False)]
    needs: Needs = []
    for number in range(count):
        parts, more = _crossing(f"b{number}")
        automata += parts
        needs += more
        needs.append((f"b{number}_deck_open", StateTest("stop", "off")))
        if number and dice.random() < 0.8:
            needs.append((f"b{number}_deck_open", StateTest(f"b{number - 1}_deck", "shut")))
            needs.append((f"b{number - 1}_deck_open", StateTest(f"b{number}_deck", "shut")))
    return _with(system(*automata), needs)


def locks(size: int, seed: int) -> System:
    """Chambers in a row with gates between them: of a chamber's two gates one is shut, and water is level to open."""
    dice = Random(seed)
    count = max(1, size // 3)
    automata = []
    needs: Needs = []
    for number in range(count + 1):
        gate = f"g{number}"
        edges = [f"shut -{gate}_open-> wide", f"wide -{gate}_close-> closing", f"closing -u_{gate}_shut-> shut"]
        automata.append(automaton(gate, edges, marked=["shut"]))
        automata.append(_switch(f"light{number}"))
        needs.append((f"light{number}_on", StateTest(gate, "wide")))
        needs.append((f"{gate}_close", StateTest(f"light{number}", "off")))
    for number in range(count):
        water = f"w{number}"
        rise = [f"low -{water}_fill-> filling", f"filling -u_{water}_full-> high"]
        fall = [f"high -{water}_drain-> draining", f"draining -u_{water}_empty-> low"]
        automata.append(automaton(water, [*rise, *fall], marked=["low", "high"]))
        here, there = (f"g{number}", "low"), (f"g{number + 1}", "high")
        for (gate, level), (other, _) in ((here, there), (there, here)):
            needs.append((f"{gate}_open", StateTest(water, level)))
            needs.append((f"{gate}_open", StateTest(other, "shut")))
            needs += [(f"{water}_{move}", StateTest(gate, "shut")) for move in ("fill", "drain")]
    if dice.random() < 0.5:
        needs.append(("g0_open", StateTest(f"w{count - 1}", "low")))
    return _with(system(*automata), needs)


def cluster_tools(size: int, seed: int) -> System:
    """Robots in a row that hand wafers through chambers, some of which process them, for ever."""
    dice = Random(seed)
    count = max(1, size // 3)
    automata = []
    for number in range(count):
        arm = [
            f"empty -take{number}-> loaded",
            f"loaded -put{number}-> empty",
            f"empty -back{number}-> holding",
            f"holding -free{number}-> empty",
        ]
        automata.append(automaton(f"R{number}", arm, marked=["empty"]))
        slot = [f"empty -put{number}-> raw", f"done -back{number}-> empty"]
        slot += [f"raw -u_done{number}-> done"] if dice.random() < 0.5 else [f"raw -next{number}-> done"]
        if number + 1 < count:
            slot += [f"raw -take{number + 1}-> gone", f"gone -free{number + 1}-> done"]
        automata.append(automaton(f"C{number}", slot, initial="empty", marked=["empty"]))
        lock = [f"free -take{number}-> busy", f"busy -free{number}-> free"]
        automata.append(replace(automaton(f"L{number}", lock, marked=["free"]), role=Role.REQUIREMENT))
    return system(*automata)


def fleet(size: int, seed: int) -> System:
    """Vehicles that each go round a few zones of many; no two are in one zone."""
    dice = Random(seed)
    zones = 2 * size
    users: dict[int, list[int]] = {}
    automata = []
    for number in range(size):
        route = [(2 * number + step) % zones for step in dice.sample(range(5), 4)]
        for zone in route:
            users.setdefault(zone, []).append(number)
        edges = [
            f"z{here} -{'u_' if dice.random() < 0.2 else ''}v{number}_{step}-> z{there}"
            for step, (here, there) in enumerate(pairwise(route))
        ]
        edges = [f"home -v{number}_out-> z{route[0]}", *edges, f"z{route[-1]} -v{number}_in-> home"]
        automata.append(automaton(f"V{number}", edges, marked=["home"]))
    apart = [
        _no(Binary("and", StateTest(f"V{one}", f"z{zone}"), StateTest(f"V{other}", f"z{zone}")))
        for zone, visitors in sorted(users.items())
        for place, one in enumerate(visitors)
        for other in visitors[place + 1 :]
    ]
    return replace(system(*automata), invariants=tuple(apart))


def lifts(size: int, seed: int) -> System:
    """Cabins with a door and buttons, some of which share a shaft and so are never on one floor."""
    dice = Random(seed)
    count = max(1, size // 3)
    automata = []
    needs: Needs = []
    apart = []
    for number in range(count):
        floor = read(f"lift{number}.at")
        moves = [
            edge(f"still -up{number}-> still", operation(floor, "<", 3), at=operation(floor, "+", 1)),
            edge(f"still -down{number}-> still", operation(floor, ">", 0), at=operation(floor, "-", 1)),
        ]
        starts = (0,) if number % 2 == 0 else (3,)
        automata.append(
            automaton(f"lift{number}", moves, variables=[DiscreteVariable("at", IntegerType(0, 3), starts)])
        )
        automata.append(_switch(f"door{number}"))
        automata.append(_switch(f"call{number}", is_controllable=False))
        needs += [(f"{way}{number}", StateTest(f"door{number}", "off")) for way in ("up", "down")]
        needs.append((f"door{number}_on", StateTest(f"call{number}", "on")))
        if number % 2 and dice.random() < 0.7:
            apart.append(operation(read(f"lift{number - 1}.at"), "<", floor))
    return replace(_with(system(*automata), needs), invariants=tuple(apart))


def ring_of_machines(size: int, seed: int) -> System:
    """Machines in a ring with a buffer of one part behind each, a requirement; some parts are in it at first."""
    dice = Random(seed)
    count = max(2, size // 2)
    automata = []
    for number in range(count):
        before = (number - 1) % count
        machine = [f"idle -start{number}-> busy", f"busy -u_done{number}-> idle"]
        automata.append(automaton(f"M{number}", machine, marked=["idle"]))
        buffer = [f"empty -u_done{before}-> full", f"full -start{number}-> empty"]
        initial = "full" if number == 0 or dice.random() < 0.3 else "empty"
        made = automaton(f"B{number}", buffer, initial=initial)
        automata.append(replace(made, role=Role.REQUIREMENT))
    return system(*automata)


def hub(size: int, seed: int) -> System:
    """Clients that a hub grants what they ask for, a few at a time, and a fault that ends all grants."""
    dice = Random(seed)
    free = read("hub.free")
    grants: list[Edge] = []
    automata = [_switch("fault", is_controllable=False)]
    needs: Needs = []
    for number in range(size):
        name = f"C{number}"
        edges = [f"idle -u_ask{number}-> asking", f"asking -grant{number}-> busy", f"busy -u_end{number}-> idle"]
        automata.append(automaton(name, edges, marked=["idle"]))
        grants.append(edge(f"on -grant{number}-> on", operation(free, ">", 0), free=operation(free, "-", 1)))
        grants.append(edge(f"on -u_end{number}-> on", operation(free, "<", 3), free=operation(free, "+", 1)))
        needs.append((f"grant{number}", StateTest("fault", "off")))
        if number and dice.random() < 0.3:
            needs.append((f"grant{number}", _no(StateTest(f"C{dice.randrange(number)}", "busy"))))
    automata.append(automaton("hub", grants, variables=[DiscreteVariable("free", IntegerType(0, 3), (3,))]))
    return _with(system(*automata), needs)


def pairs(size: int, seed: int) -> System:
    """Parts that go out and come back by themselves; two and two, chosen by chance, are never both out."""
    dice = Random(seed)
    automata = [
        automaton(
            f"P{number}",
            [f"idle -go{number}-> busy", f"busy -u_gone{number}-> out", f"out -u_back{number}-> idle"],
            marked=["idle"],
        )
        for number in range(size)
    ]
    order = dice.sample(range(size), size)
    apart = [
        _no(Binary("and", StateTest(f"P{one}", "out"), StateTest(f"P{other}", "out")))
        for one, other in zip(order[::2], order[1::2], strict=False)
    ]
    return replace(system(*automata), invariants=tuple(apart))


def _stage(name: str, high: int, *, falls: bool = False) -> Automaton:
    """A counter that goes up by command, and down by command or by itself."""
    level = read(f"{name}.at")
    down = f"{'u_' if falls else ''}{name}_down"
    moves = [
        edge(f"still -{name}_up-> still", operation(level, "<", high), at=operation(level, "+", 1)),
        edge(f"still -{down}-> still", operation(level, ">", 0), at=operation(level, "-", 1)),
    ]
    return automaton(name, moves, variables=[DiscreteVariable("at", IntegerType(0, high), (0,))])


def axes(size: int, seed: int) -> System:
    """Axes that lift one long load: of two neighbours none is far ahead of the other; some sink by themselves."""
    dice = Random(seed)
    automata = [_stage(f"A{number}", 20, falls=dice.random() < 0.1) for number in range(size)]
    level = []
    for one, other in pairwise(range(size)):
        slack = dice.randrange(3, 7)
        low, high = read(f"A{one}.at"), read(f"A{other}.at")
        level += [
            operation(low, "<=", operation(high, "+", slack)),
            operation(high, "<=", operation(low, "+", slack)),
        ]
    return replace(system(*automata), invariants=tuple(level))


def loads(size: int, seed: int) -> System:
    """Bins that are filled and emptied, in groups that overlap in a bin; what a group holds together is bounded."""
    dice = Random(seed)
    automata = [_stage(f"B{number}", 20) for number in range(size)]
    bounds = []
    first = 0
    while first + 1 < size:
        last = min(size - 1, first + dice.randrange(3, 6))
        total: Expression = read(f"B{first}.at")
        for number in range(first + 1, last + 1):
            total = operation(total, "+", read(f"B{number}.at"))
        bounds.append(operation(total, "<=", 12 * (last - first + 1)))
        first = last
    return replace(system(*automata), invariants=tuple(bounds))


def _without_chance(make: Callable[[int], System], parts_of_one: int, size: int, seed: int) -> System:
    del seed
    return make(max(1, size // parts_of_one))


SEEDED_FAMILIES: dict[str, Callable[[int, int], System]] = {
    "product line": product_line,
    "movable bridges": movable_bridges,
    "locks": locks,
    "tower": partial(_without_chance, lambda floors: cat_and_mouse(floors, 2), 50),
    "cluster tools": cluster_tools,
    "philosophers": partial(_without_chance, lambda count: dining_philosophers(max(2, count)), 2),
    "fleet in zones": fleet,
    "lifts": lifts,
    "transfer line": partial(_without_chance, transfer_line, 6),
    "machines in a row": partial(_without_chance, machines_in_a_row, 2),
    "assembly tree": partial(_without_chance, assembly_tree, 2),
    "inspection tree": partial(_without_chance, inspection_tree, 2),
    "token ring": partial(_without_chance, lambda count: token_ring(max(2, count)), 1),
    "ring of machines": ring_of_machines,
    "hub": hub,
    "pairs": pairs,
    "axes": axes,
    "loads": loads,
    "random network": random_robot,
}
"""Systems by family; the arguments are about how many parts they have, and the seed of their chances."""
