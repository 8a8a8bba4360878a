"""Systems of any size, from the literature and our own, for benchmarks and for tests at their small ends.

Sources: dining philosophers and the transfer line after W. M. Wonham and K. Cai, "Supervisory Control of
Discrete-Event Systems", Springer, 2019, ch. 3 and 4; cat and mouse after P. J. Ramadge and W. M. Wonham, "The control
of discrete event systems", Proc. IEEE 77(1), 1989, pp. 81-98, on several floors after S. Miremadi, K. Akesson, B.
Lennartson and M. Fabian, "Symbolic computation and representation of supervisors", IEEE CASE 2010.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from itertools import product
from random import Random

from robosc.automata import Automaton, DiscreteVariable, Edge, Event, EventCondition, Role, System
from robosc.expressions import Binary, BooleanType, Expression, IntegerType, StateTest, Unary
from support.systems import automaton, edge, operation, read, system


def _counter(name: str, high: int, initial: int, up: list[str], down: list[str]) -> Automaton:
    """A store that some events fill and some empty by one; beyond its bounds lies trouble."""
    level = read(f"{name}.n")
    edges = [edge(f"here -{event}-> here", n=operation(level, "+", 1)) for event in up]
    edges += [edge(f"here -{event}-> here", n=operation(level, "-", 1)) for event in down]
    return automaton(name, edges, variables=[DiscreteVariable("n", IntegerType(0, high), (initial,))])


def dining_philosophers(count: int) -> System:
    """Philosophers take two forks in either order and put both down at their own will."""
    automata = []
    for number in range(count):
        left, right = number, (number + 1) % count
        automata.append(
            automaton(
                f"p{number}",
                [
                    f"thinking -p{number}_takes_f{left}-> left",
                    f"thinking -p{number}_takes_f{right}-> right",
                    f"left -p{number}_takes_f{right}-> eating",
                    f"right -p{number}_takes_f{left}-> eating",
                    f"eating -u_p{number}_puts-> thinking",
                ],
                marked=["thinking"],
            )
        )
    for number in range(count):
        users = sorted({number, (number - 1) % count})
        edges = [f"free -p{user}_takes_f{number}-> used" for user in users]
        edges += [f"used -u_p{user}_puts-> free" for user in users]
        automata.append(automaton(f"f{number}", edges, marked=["free"]))
    return system(*automata)


def transfer_line(sections: int) -> System:
    """Two machines, a test unit that sends parts back, and two buffers of three and one part, again and again."""
    automata = []
    for number in range(sections):
        first, second, unit = f"m{number}a", f"m{number}b", f"t{number}"
        automata += [
            automaton(first, [f"idle -{first}_start-> busy", f"busy -u_{first}_end-> idle"], marked=["idle"]),
            automaton(second, [f"idle -{second}_start-> busy", f"busy -u_{second}_end-> idle"], marked=["idle"]),
            automaton(
                unit,
                [f"idle -{unit}_start-> busy", f"busy -u_{unit}_passes-> idle", f"busy -u_{unit}_fails-> idle"],
                marked=["idle"],
            ),
            _counter(f"b{number}a", 3, 0, [f"u_{first}_end", f"u_{unit}_fails"], [f"{second}_start"]),
            _counter(f"b{number}b", 1, 0, [f"u_{second}_end"], [f"{unit}_start"]),
        ]
        if number:
            # Items that have passed the section before wait for this one.
            automata.append(_counter(f"c{number}", 2, 0, [f"u_t{number - 1}_passes"], [f"{first}_start"]))
    return system(*automata)


def token_ring(stations: int) -> System:
    """One token goes round; who has it may work, and passes it on at its own will."""
    automata = []
    for number in range(stations):
        following = (number + 1) % stations
        automata.append(
            automaton(
                f"s{number}",
                [
                    f"waiting -u_pass_to_{number}-> holding",
                    f"holding -work_{number}-> working",
                    f"working -u_done_{number}-> holding",
                    f"holding -u_pass_to_{following}-> waiting",
                ],
                initial="holding" if number == 0 else "waiting",
            )
        )
    return system(*automata)


_CAT_DOORS = ((0, 1, True), (1, 2, True), (2, 0, True), (0, 3, True), (3, 4, True), (4, 0, True), (1, 3, False))
_MOUSE_DOORS = ((0, 2, True), (2, 1, True), (1, 0, True), (0, 4, True), (4, 3, True), (3, 0, True))
_STAIRS = 0
"""The room with the stairs; each animal sets out in a room of its own kind's."""


def cat_and_mouse(floors: int, animals: int) -> System:
    """Floors of five rooms; as many cats as mice, that must never be in one room; one cat's door cannot be shut."""
    automata: list[Automaton] = []
    for kind, doors, home in (("cat", _CAT_DOORS, 2), ("mouse", _MOUSE_DOORS, 4)):
        for number in range(animals):
            name = f"{kind}{number}"
            floor_of_home = (floors - 1 - number % floors) if kind == "mouse" else number % floors
            edges: list[Edge | str] = []
            for floor in range(floors):
                for source, target, is_controllable in doors:
                    event = f"{'' if is_controllable else 'u_'}{name}_{floor}_{source}_{target}"
                    edges.append(f"r{floor}_{source} -{event}-> r{floor}_{target}")
                    if not is_controllable:
                        edges.append(f"r{floor}_{target} -{event}-> r{floor}_{source}")
                if floor + 1 < floors:
                    edges.append(f"r{floor}_{_STAIRS} -{name}_up_{floor}-> r{floor + 1}_{_STAIRS}")
                    edges.append(f"r{floor + 1}_{_STAIRS} -{name}_down_{floor}-> r{floor}_{_STAIRS}")
            start = f"r{floor_of_home}_{home}"
            automata.append(automaton(name, edges, initial=start, marked=[start]))
    meetings: list[Expression] = [
        Unary("not", Binary("and", StateTest(f"cat{cat}", room), StateTest(f"mouse{mouse}", room)))
        for cat in range(animals)
        for mouse in range(animals)
        for room in (f"r{floor}_{place}" for floor in range(floors) for place in range(5))
    ]
    return replace(system(*automata), invariants=tuple(meetings))


def bounded_counters(high: int) -> System:
    """A tank that one event fills and the environment empties by different amounts, up to a bound."""
    level = read("tank.n")
    edges = [
        edge("here -fill-> here", n=operation(level, "+", 3)),
        edge("here -pour-> here", operation(level, ">=", 7), n=operation(level, "-", 7)),
        edge("here -u_leak-> here", operation(level, ">", 0), n=operation(level, "-", 1)),
        edge("here -u_gush-> here", operation(level, "<", high // 2), n=operation(level, "+", 5)),
    ]
    tank = automaton("tank", edges, variables=[DiscreteVariable("n", IntegerType(0, high), (high // 3,))])
    return replace(system(tank), invariants=(operation(level, "!=", high - 1),))


def random_robot(components: int, seed: int = 1) -> System:
    """Components with a sensor, a mode, a message and a service each, and requirements across them: at most 40."""
    dice = Random(seed)
    automata: list[Automaton] = []
    events: list[Event] = []
    for number in range(components):
        name = f"C{number}"
        sensor, stop, service = f"sensor{number}", f"stop{number}.request", f"service{number}"
        edges = [
            edge(f"ready -{sensor}.response-> ready", seen=Unary("not", read(f"{name}.seen"))),
            edge(f"ready -{service}.request-> busy"),
            edge(f"busy -{service}.response-> ready"),
            edge(f"busy -{service}.error-> failed"),
            edge(f"failed -{stop}-> ready"),
            edge(f"busy -{sensor}.response-> busy", seen=Unary("not", read(f"{name}.seen"))),
            edge(f"failed -{sensor}.response-> failed"),
        ]
        variable = DiscreteVariable("seen", BooleanType(), (False,))
        automata.append(automaton(name, edges, marked=["ready"], variables=[variable]))
        events += [
            Event(f"{sensor}.response", False),
            Event(f"{service}.request", True),
            Event(f"{service}.response", False),
            Event(f"{service}.error", False),
            Event(stop, True),
        ]
    conditions = []
    for number in range(min(40, 2 * components)):
        event = f"service{number % components}.request"
        near = [(number + step) % components for step in (dice.randint(1, 3), dice.randint(1, 5))]
        test: Expression = StateTest(f"C{near[0]}", dice.choice(["ready", "busy"]))
        other: Expression = read(f"C{near[1]}.seen")
        conditions.append(EventCondition(event, Binary(dice.choice(["and", "or"]), test, other)))
    return System(f"robot of {components}", tuple(events), tuple(automata), conditions=tuple(conditions))


def machines_in_a_row(count: int) -> System:
    """Machines with a buffer of one place, a requirement, between each and the next: neighbours share them."""
    return _machines(count, {number: number + 1 for number in range(count - 1)})


def assembly_tree(count: int) -> System:
    """Machines in a binary tree, each of which assembles what the two below it have made and put into its buffers."""
    return _machines(count, {number: (number - 1) // 2 for number in range(1, count)})


def inspection_tree(count: int) -> System:
    """Machines in a binary tree, each of which takes a part of either machine below: its own is good if both are.

    Parts of the lowest machines are found to be good or bad; behind each machine a buffer, a requirement, knows what it
    holds. A branch knows long before it shows what it will deliver one after the other.
    """
    kinds = ("good", "bad")
    automata = []
    for number in range(count):
        below = [child for child in (2 * number + 1, 2 * number + 2) if child < count]
        if below:
            moves = [f"idle -take{number}_{pair}-> {_of_both(pair)}" for pair in _pairs(len(below))]
            moves += [f"{kind} -u_{kind}{number}-> idle" for kind in kinds]
        else:
            moves = [f"idle -start{number}-> busy", *(f"busy -u_{kind}{number}-> idle" for kind in kinds)]
        automata.append(automaton(f"M{number}", moves, marked=["idle"]))
        for place, child in enumerate(below):
            moves = [f"empty -u_{kind}{child}-> {kind}" for kind in kinds]
            moves += [
                f"{kind} -take{number}_{pair}-> empty"
                for kind in kinds
                for pair in _pairs(len(below))
                if pair.split("_")[place] == kind
            ]
            automata.append(replace(automaton(f"B{child}", moves, marked=["empty"]), role=Role.REQUIREMENT))
    return _of(automata)


def _pairs(count: int) -> list[str]:
    return ["_".join(kinds) for kinds in product(("good", "bad"), repeat=count)]


def _of_both(pair: str) -> str:
    return "bad" if "bad" in pair.split("_") else "good"


def _machines(count: int, following: Mapping[int, int]) -> System:
    """Machines, and behind each that another one follows a buffer, a requirement, which that one empties."""
    automata = [
        automaton(f"M{number}", [f"idle -start{number}-> busy", f"busy -u_done{number}-> idle"], marked=["idle"])
        for number in range(count)
    ]
    for number, other in following.items():
        edges = [f"empty -u_done{number}-> full", f"full -start{other}-> empty"]
        automata.append(replace(automaton(f"B{number}", edges, marked=["empty"]), role=Role.REQUIREMENT))
    return _of(automata)


def _of(automata: list[Automaton]) -> System:
    """The system of some automata; events are uncontrollable if they are called so."""
    names = dict.fromkeys(edge.event for item in automata for edge in item.edges)
    events = tuple(Event(name, is_controllable=not name.startswith("u_")) for name in names)
    return System("family", events, tuple(automata))


FAMILIES: dict[str, Callable[[int], System]] = {
    "dining philosophers": dining_philosophers,
    "transfer line": transfer_line,
    "token ring": token_ring,
    "cat and mouse, 1 pair": lambda floors: cat_and_mouse(floors, 1),
    "cat and mouse, 2 pairs": lambda floors: cat_and_mouse(floors, 2),
    "counter": bounded_counters,
    "random robot": random_robot,
    "machines in a row": machines_in_a_row,
    "assembly tree": assembly_tree,
    "inspection tree": inspection_tree,
}
"""Systems by family; the argument is how large."""
