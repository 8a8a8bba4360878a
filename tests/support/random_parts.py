"""Random systems of several small plants that share no event, with requirements between them."""

from random import Random

from robosc.automata import Assignment, Automaton, DiscreteVariable, Edge, Event, EventCondition, Role, System
from robosc.expressions import (
    TRUE,
    Binary,
    BinaryOperator,
    Constant,
    Expression,
    IntegerType,
    StateTest,
    Unary,
    VariableRead,
    conjunction,
)

_RANGE = IntegerType(0, 2)


def system_in_parts(seed: int) -> System:
    """A system of 2 to 5 plants with events of their own, and requirements on one to three of them."""
    return _Drawing(Random(seed)).system()


class _Drawing:
    def __init__(self, random: Random) -> None:
        self.random = random
        self.names = tuple(f"P{number}" for number in range(random.choice((2, 3, 3, 4, 5))))
        self.locations = {name: tuple(f"l{place}" for place in range(random.choice((2, 2, 3)))) for name in self.names}
        self.events = {
            name: tuple(
                Event(f"{name}_{kind}{number}", kind == "c")
                for kind, counts in (("c", (1, 1, 2)), ("u", (0, 1, 1)))
                for number in range(random.choice(counts))
            )
            for name in self.names
        }
        self.counters = {name for name in self.names if random.random() < 0.3}

    def chance(self, share: float) -> bool:
        return self.random.random() < share

    def system(self) -> System:
        plants = [self.plant(name) for name in self.names]
        extra = Event("R_only", self.chance(0.5))
        requirements = [self.requirement(f"R{number}", extra) for number in range(self.random.choice((0, 1, 1, 2)))]
        events = [event for name in self.names for event in self.events[name]]
        if any("R_only" in item.alphabet for item in requirements):
            events.append(extra)
        controllable = [event for event in events if event.is_controllable and event is not extra]
        known = controllable if self.chance(0.85) else events
        conditions = [
            EventCondition(self.random.choice(known).name, self.condition(2, requirements))
            for _ in range(self.random.choice((0, 1, 2, 3, 4, 5)))
        ]
        if self.chance(0.3):
            # Each waits for the next, the last for the first: what two of them can do, all together may not.
            for name, other in zip(self.names, (*self.names[1:], self.names[0]), strict=True):
                places = self.random.sample(self.locations[other], self.random.choice((1, 1, 2)))
                whole: Expression = StateTest(other, places[0])
                for place in places[1:]:
                    whole = Binary("or", whole, StateTest(other, place))
                conditions.append(EventCondition(self.events[name][0].name, whole))
        invariants = [
            Unary("not", conjunction(*(self.atom(requirements) for _ in range(2))))
            for _ in range(self.random.choice((0, 0, 0, 1)))
        ]
        return System(
            "parts",
            tuple(events),
            (*plants, *requirements),
            conditions=tuple(conditions),
            invariants=tuple(invariants),
            initial=self.condition(2, requirements) if self.chance(0.15) else TRUE,
            marker=conjunction(self.condition(2, requirements), self.atom(requirements)) if self.chance(0.15) else TRUE,
            plant_conditions=tuple(
                EventCondition(self.random.choice(known).name, self.atom(requirements))
                for _ in range(self.random.choice((0, 0, 0, 1)))
            ),
            plant_invariants=(Binary("or", self.atom(requirements), self.atom(requirements)),)
            if self.chance(0.1)
            else (),
        )

    def plant(self, name: str) -> Automaton:
        locations = self.locations[name]
        # A way round, so that most plants by themselves do not block.
        edges = [
            Edge(source, self.random.choice(self.events[name]).name, target)
            for source, target in zip(locations, (*locations[1:], locations[0]), strict=True)
        ]
        taken = {(edge.source, edge.event) for edge in edges}
        for event in self.events[name]:
            for source in locations:
                if (source, event.name) in taken and not self.chance(0.1):
                    continue
                for _ in range(self.random.choice((0, 0, 1) if event.is_controllable else (0, 0, 0, 0, 1))):
                    updates: tuple[Assignment, ...] = ()
                    if name in self.counters and event.is_controllable and self.chance(0.6):
                        operator: BinaryOperator = self.random.choice(("+", "-"))
                        updates = (Assignment("n", Binary(operator, VariableRead(name, "n"), Constant(1))),)
                    edges.append(Edge(source, event.name, self.random.choice(locations), TRUE, updates))
        marked = frozenset(item for item in locations if self.chance(0.85)) or frozenset(locations[:1])
        return Automaton(
            name,
            locations,
            tuple(dict.fromkeys((locations[0], self.random.choice(locations)))) if self.chance(0.2) else locations[:1],
            marked,
            frozenset(event.name for event in self.events[name]),
            tuple(dict.fromkeys(edges)),
            (DiscreteVariable("n", _RANGE, (0, 1) if self.chance(0.2) else (0,)),) if name in self.counters else (),
        )

    def requirement(self, name: str, extra: Event) -> Automaton:
        events = [event for plant in self.random.sample(self.names, 2) for event in self.events[plant][:1]]
        if self.chance(0.2):
            events.append(extra)
        locations = ("x", "y", "z")[: self.random.choice((1, 2, 2, 3))]
        self.locations[name] = locations
        edges = [
            Edge(source, event.name, self.random.choice(locations), self.atom([]) if self.chance(0.1) else TRUE)
            for event in events
            for source in locations
            if (not event.is_controllable and self.chance(0.97)) or self.chance(0.6)
        ]
        marked = frozenset(item for item in locations if self.chance(0.9)) or frozenset(locations[:1])
        alphabet = frozenset(event.name for event in events)
        return Automaton(name, locations, locations[:1], marked, alphabet, tuple(edges), role=Role.REQUIREMENT)

    def atom(self, requirements: list[Automaton]) -> Expression:
        """A test of a plant, seldom of a requirement automaton."""
        name = self.random.choice(self.names)
        if requirements and self.chance(0.1):
            name = self.random.choice(requirements).name
        elif name in self.counters and self.chance(0.5):
            return Binary(
                self.random.choice(("<=", "=")), VariableRead(name, "n"), Constant(self.random.choice((0, 1)))
            )
        return StateTest(name, self.random.choice(self.locations[name]))

    def condition(self, count: int, requirements: list[Automaton]) -> Expression:
        whole = self.atom(requirements)
        for _ in range(self.random.randrange(count)):
            whole = Binary("or", whole, self.atom(requirements))
        return whole if self.chance(0.7) else Unary("not", whole)
