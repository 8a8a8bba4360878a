"""Random small systems for tests that compare an algorithm with a slow, obvious twin.

`systems()` and `any_systems()` are hypothesis strategies. Most systems of the first have a supervisor that disables
something and some have none; run this module to see the shares:

    python -m support.random_systems        (with `tests` as the working folder)

A system is drawn from a seed with `random.Random`: drawing each edge through hypothesis takes a hundred
times as long, and what fails is small already.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache
from pprint import pformat
from random import Random

from hypothesis import strategies as st

from robosc.automata import (
    Assignment,
    Automaton,
    DiscreteVariable,
    Edge,
    EnvironmentVariable,
    Event,
    EventCondition,
    InputVariable,
    Role,
    Semantics,
    System,
    environment_variable,
)
from robosc.expressions import (
    ITSELF,
    TRUE,
    Binary,
    BinaryOperator,
    BooleanType,
    Call,
    Conditional,
    Constant,
    EnumType,
    EnumValue,
    Expression,
    IntegerType,
    Received,
    StateTest,
    Type,
    Unary,
    Value,
    VariableRead,
    domain,
    leaves,
)
from robosc.verification import ExplicitSupervisor, synthesize_explicit
from support.effort import EFFORT
from support.failing import made

COLOUR = EnumType("Colour", ("red", "green", "blue"))
CONTROLLABLE = tuple(Event(name, True) for name in ("go", "stop", "turn", "lift"))
UNCONTROLLABLE = tuple(Event(name, False) for name in ("seen", "lost", "done"))
MAXIMUM_STATES = 20_000
WANTED_STATES = 5
ATTEMPTS = 30


def wide_system(seed: int) -> System:
    """Return a system like `random_system`, with all that automata offer beyond RoboSC.

    Several ways to begin, requirement automata, monitors, events of requirements alone, conditions on initial and
    marked states and on what plants can do and be, choices between edges of controllable events, an input variable,
    whole division.
    """
    return _kept("wide_system", seed, _of_seed(seed, is_wide=True))


def systems() -> st.SearchStrategy[System]:
    """Systems of 2 to 4 automata with 1 to 4 locations and 0 to 2 variables each.

    Tests draw from the same few hundred, which are made once: they differ by what they look at. `make soak` draws from
    all.
    """
    return system_seeds().map(random_system)


def system_seeds() -> st.SearchStrategy[int]:
    """Seeds of `random_system` and `wide_system`: see `systems`."""
    return st.integers(0, 2**32 - 1 if EFFORT else 299)


def any_systems() -> st.SearchStrategy[System]:
    """The same, as they are drawn: see `any_system`."""
    return st.integers(0, 2**32 - 1).map(any_system)


def any_system(seed: int) -> System:
    """A system as it is drawn, most of which have no supervisor: for what looks at all states, reachable or not.

    Takes a thirtieth of the time of `random_system`.
    """
    return _kept("any_system", seed, _Builder(Random(seed), is_wide=False).system())


def any_wide_systems() -> st.SearchStrategy[System]:
    """Return the systems of `any_wide_system`."""
    return st.integers(0, 2**32 - 1).map(any_wide_system)


def any_wide_system(seed: int) -> System:
    """Return a system like `any_system`, with all that `wide_system` has."""
    return _kept("any_wide_system", seed, _Builder(Random(seed), is_wide=True).system())


def random_system(seed: int) -> System:
    """The system of a seed: mostly the first of some candidates whose supervisor disables something."""
    return _kept("random_system", seed, _of_seed(seed, is_wide=False))


def _kept(maker: str, seed: int, system: System) -> System:
    """The system, kept for the case that the test fails; automata that are of no robot have no text but Python's."""
    made(maker, seed, lambda: {"system.py": f"{pformat(system, width=120)}\n"})
    return system


@lru_cache(maxsize=4096)
def _of_seed(seed: int, *, is_wide: bool) -> System:
    return _chosen(Random(seed), is_wide=is_wide)


@lru_cache(maxsize=1024)
def explicit_supervisor(system: System) -> ExplicitSupervisor | None:
    """Return the supervisor of the slow, obvious synthesizer, worked out once; None beyond `MAXIMUM_STATES`."""
    return synthesize_explicit(system, limit=MAXIMUM_STATES)


def _chosen(random: Random, *, is_wide: bool) -> System:
    candidate = _Builder(random, is_wide=is_wide).system()
    if random.random() < 0.1:
        return candidate
    for _ in range(ATTEMPTS):
        supervisor = explicit_supervisor(candidate)
        if supervisor and len(supervisor.reachable) >= WANTED_STATES and disables_something(candidate, supervisor):
            break
        candidate = _Builder(random, is_wide=is_wide).system()
    return candidate


def disables_something(system: System, supervisor: ExplicitSupervisor) -> bool:
    """Return True if the supervisor forbids, in a reachable state, what plants and requirements would allow."""
    semantics = Semantics(system)
    return any(
        semantics.enabled(state, event.name)
        and semantics.condition(state, event.name)
        and not supervisor.allows(state, event.name)
        for state in supervisor.reachable
        for event in system.events
        if event.is_controllable
    )


def kind(system: System) -> str:
    """`empty`, `disables` or `free`: what its supervisor is like."""
    supervisor = explicit_supervisor(system)
    if supervisor is None:
        return "too large"
    if supervisor.is_empty:
        return "empty"
    return "disables" if disables_something(system, supervisor) else "free"


def shares(systems: Sequence[System]) -> dict[str, float]:
    """The share of each kind among some systems."""
    found = [kind(system) for system in systems]
    return {name: found.count(name) / len(found) for name in ("disables", "free", "empty")}


class _Builder:
    """Draws one system."""

    def __init__(self, random: Random, *, is_wide: bool) -> None:
        self.random = random
        self.is_wide = is_wide
        names = ("A", "B", "C", "D")[: random.choice((2, 2, 3, 3, 4))]
        self.events = (*CONTROLLABLE[: random.choice((2, 3, 4))], *UNCONTROLLABLE[: random.choice((1, 2, 3))])
        self.locations = {name: tuple(f"l{n}" for n in range(random.choice((1, 2, 2, 3, 3, 4)))) for name in names}
        self.variables = {
            (name, f"v{number}"): self._type() for name in names for number in range(random.choice((0, 1, 1, 2)))
        }
        # Data of a controllable event is the environment's choice, too: wherever it leads must be good.
        carrying = [event for event in self.events if not event.is_controllable or (is_wide and self._chance(0.25))]
        self.inputs = tuple(item for event in carrying for item in self._inputs(event))
        self.sensors: list[EnvironmentVariable] = []
        if is_wide and self._chance(0.2):
            self.variables["S", ITSELF] = self._type()
            self.sensors.append(environment_variable("S", self.variables["S", ITSELF]))

    def _chance(self, share: float) -> bool:
        return self.random.random() < share

    def _type(self) -> Type:
        low = self.random.randint(-2, 1)
        return self.random.choice((BooleanType(), COLOUR, IntegerType(low, low + self.random.randint(1, 4))))

    def _inputs(self, event: Event) -> list[InputVariable]:
        count = self.random.choice((0, 0, 1, 2))
        result = [InputVariable(event.name, (f"p{number}",), self._type()) for number in range(count)]
        if self._chance(0.6):
            element, indices = self._type(), self.random.sample(range(5), self.random.choice((1, 2, 2, 3)))
            result.extend(InputVariable(event.name, ("scan", index), element, True) for index in indices)
        return result

    def system(self) -> System:
        """The drawn system; each event belongs to one or two automata."""
        # An event of no plant is one of requirements alone, or one that cannot happen.
        counts = (1, 1, 2, 1, 1, 2, 1, 1, 2, 0) if self.is_wide else (1, 1, 2)
        owners = {event: self.random.sample(tuple(self.locations), self.random.choice(counts)) for event in self.events}
        automata = tuple(
            self._automaton(name, [event for event in self.events if name in owners[event]]) for name in self.locations
        )
        if self.is_wide:
            automata = (*automata, *self._requirements())
        read = {(edge.event, leaf) for automaton in automata for edge in automaton.edges for leaf in _paths(edge)}
        inputs = tuple(item for item in self.inputs if (item.event, item.path) in read)
        conditions = tuple(condition for event in self.events for condition in self._event_conditions(event))
        invariants = (Binary("or", self._condition(), self._condition()),) if self._chance(0.25) else ()
        if not self.is_wide:
            return System("random", self.events, automata, inputs, conditions, invariants)
        return System(
            "random",
            (*self.events, *(sensor.event for sensor in self.sensors)),
            (*automata, *(sensor.automaton for sensor in self.sensors)),
            (*inputs, *(sensor.received for sensor in self.sensors)),
            conditions,
            invariants,
            initial=self._condition() if self._chance(0.3) else TRUE,
            marker=Binary("or", self._condition(), self._condition()) if self._chance(0.3) else TRUE,
            plant_conditions=tuple(
                EventCondition(event.name, self._condition()) for event in self.events if self._chance(0.15)
            ),
            plant_invariants=tuple(
                Binary("or", self._condition(), self._condition()) for _ in range(self.random.choice((0, 0, 1, 2)))
            ),
        )

    def _requirements(self) -> list[Automaton]:
        """No requirement automaton, or one that forbids some events, seldom an uncontrollable one."""
        if self._chance(0.4):
            return []
        watched = self.random.sample(self.events, self.random.choice((1, 2, 3)))
        self.locations["R"] = ("r0", "r1", "r2")[: self.random.choice((1, 2, 3))]
        self.variables["R", "w"] = self._type()
        made = self._automaton("R", watched)
        has_edge = {(edge.source, edge.event) for edge in made.edges}
        loops = [
            Edge(location, event.name, location)
            for event in watched
            for location in made.locations
            if not event.is_controllable and (location, event.name) not in has_edge and self._chance(0.9)
        ]
        return [replace(made, edges=(*made.edges, *loops), role=Role.REQUIREMENT)]

    def _monitors(self, alphabet: list[Event]) -> frozenset[str]:
        """Events of an alphabet that are only monitored, now and then."""
        return frozenset(event.name for event in alphabet if self.is_wide and self._chance(0.1))

    def _automaton(self, name: str, alphabet: list[Event]) -> Automaton:
        locations = self.locations[name]
        edges = [edge for event in alphabet for where in locations for edge in self._edges(name, where, event)]
        variables = tuple(
            DiscreteVariable(variable, type_, self._initial(tuple(domain(type_))))
            for (owner, variable), type_ in self.variables.items()
            if owner == name
        )
        marked = frozenset(location for location in locations if self._chance(0.5)) or frozenset(locations[:1])
        return Automaton(
            name,
            locations,
            self._initial(locations) if self.is_wide else locations[:1],
            marked,
            frozenset(e.name for e in alphabet),
            tuple(edges),
            variables,
            monitors=self._monitors(alphabet),
        )

    def _initial[T: Value](self, values: tuple[T, ...]) -> tuple[T, ...]:
        """One value, and now and then more."""
        count = self.random.randint(1, len(values)) if self.is_wide and self._chance(0.3) else 1
        return tuple(self.random.sample(values, count))

    def _edges(self, name: str, source: str, event: Event) -> list[Edge]:
        """No edge, one, or two; the two of a controllable event mostly have guards that exclude each other."""
        count = self.random.choice((0, 1, 1, 1, 2) if event.is_controllable else (0, 0, 0, 1, 2))
        guards: list[Expression] = []
        if count >= 1:
            guards.append(self._condition() if self._chance(0.4) else TRUE)
        if count == 2:
            opposite = Unary("not", Unary("holds", guards[0]))
            free = self._condition() if self._chance(0.5) else TRUE
            is_choice = not event.is_controllable or (self.is_wide and self._chance(0.3))
            guards.append(free if is_choice else opposite)
        targets = self.locations[name]
        return [
            Edge(source, event.name, self.random.choice(targets), guard, self._updates(name, event)) for guard in guards
        ]

    def _updates(self, name: str, event: Event) -> tuple[Assignment, ...]:
        return tuple(
            Assignment(variable, self._value(type_, event, VariableRead(owner, variable)))
            for (owner, variable), type_ in self.variables.items()
            if owner == name and self._chance(0.6)
        )

    def _value(self, type_: Type, event: Event, own: VariableRead) -> Expression:
        """A new value for a variable; integers count up and down and may leave their range."""
        inputs = [item for item in self.inputs if item.event == event.name]
        choices: list[Callable[[], Expression]] = [lambda: self._constant(type_)]
        same = [Received(item.path) for item in inputs if item.type == type_]
        if same:
            choices.extend([lambda: self.random.choice(same)] * 5)
        if isinstance(type_, BooleanType):
            choices.append(self._condition)
            if inputs:
                choices.extend([lambda: self._condition_on(inputs)] * 4)
        elif isinstance(type_, IntegerType):
            # The environment rarely counts: it would leave every range sooner or later.
            if event.is_controllable or self._chance(0.2):
                choices.extend([lambda: self._count(own)] * 3)
                choices.append(lambda: self._arithmetic(own))
            numbers = [item for item in inputs if isinstance(item.type, IntegerType)]
            if numbers:
                choices.append(lambda: Binary("-", own, Received(self.random.choice(numbers).path)))
        else:
            choices.append(
                lambda: self.random.choice([VariableRead(*v) for v, t in self.variables.items() if t == type_])
            )
        return self.random.choice(choices)()

    def _count(self, own: VariableRead) -> Expression:
        return Binary("+" if self._chance(0.5) else "-", own, Constant(1))

    def _arithmetic(self, own: VariableRead) -> Expression:
        others = [VariableRead(*v) for v, type_ in self.variables.items() if isinstance(type_, IntegerType)]
        shape = self.random.randrange(6)
        if shape == 0:
            return Call("clamp", (self._count(own), Constant(-1), Constant(2)))
        if shape == 1:
            return Conditional(self._condition(), self._count(own), Call("abs", (self.random.choice(others),)))
        if shape == 2:
            return Call(self.random.choice(("min", "max")), (own, self.random.choice(others)))
        if shape == 3:
            return Call("integer", (Binary("/", own, self.random.choice(others)),))
        operators: tuple[BinaryOperator, ...] = ("+", "-", "*", "div", "mod") if self.is_wide else ("+", "-", "*")
        return Binary(self.random.choice(operators), own, self.random.choice(others))

    def _constant(self, type_: Type) -> Expression:
        value = self.random.choice(tuple(domain(type_)))
        return EnumValue(COLOUR.name, str(value)) if isinstance(type_, EnumType) else Constant(value)

    def _condition_on(self, inputs: list[InputVariable]) -> Expression:
        """Return the condition that one or two received data have some values; unknown where such a datum is."""
        parts = [
            Binary("=", Received(item.path), self._constant(item.type))
            for item in self.random.sample(inputs, min(len(inputs), self.random.choice((1, 2))))
        ]
        return parts[0] if len(parts) == 1 else Binary(self.random.choice(("and", "or")), parts[0], parts[1])

    def _condition(self) -> Expression:
        operators: tuple[BinaryOperator, ...] = ("and", "or", "or", "implies", "=")
        shape = self.random.randrange(8)
        if shape < len(operators):
            return Binary(operators[shape], self._atom(), self._atom())
        return Unary("not", self._atom()) if shape == len(operators) else self._atom()

    def _atom(self) -> Expression:
        if not self.variables or self._chance(0.4):
            name = self.random.choice(tuple(self.locations))
            return StateTest(name, self.random.choice(self.locations[name]))
        variable = self.random.choice(tuple(self.variables))
        type_, read = self.variables[variable], VariableRead(*variable)
        if isinstance(type_, BooleanType):
            return read
        if isinstance(type_, EnumType):
            return Binary(self.random.choice(("=", "!=")), read, self._constant(type_))
        operators: tuple[BinaryOperator, ...] = ("=", "!=", "<", "<=", ">", ">=")
        # A quotient is unknown where the divisor is zero.
        if self.is_wide and self._chance(0.2):
            left: Expression = Binary(self.random.choice(("div", "mod")), Constant(3), read)
        else:
            left = Binary("/", Constant(2), read) if self._chance(0.2) else read
        return Binary(self.random.choice(operators), left, self._constant(type_))

    def _event_conditions(self, event: Event) -> list[EventCondition]:
        """Conditions on controllable events, and now and then a weak one on an uncontrollable event."""
        if not self._chance(0.4 if event.is_controllable else 0.5):
            return []
        if event.is_controllable:
            return [EventCondition(event.name, self._condition()) for _ in range(self.random.choice((1, 1, 2)))]
        return [EventCondition(event.name, Binary("or", self._condition(), self._condition()))]


def _paths(edge: Edge) -> list[tuple[object, ...]]:
    return [leaf.path for update in edge.updates for leaf in leaves(update.expression) if isinstance(leaf, Received)]


def main() -> None:
    """Print the shares among systems of successive seeds."""
    drawn = shares([random_system(seed) for seed in range(1000)])
    plain = shares([_Builder(Random(seed), is_wide=False).system() for seed in range(1000)])
    print("drawn:", {name: f"{share:.0%}" for name, share in drawn.items()})
    print("without choosing:", {name: f"{share:.0%}" for name, share in plain.items()})


if __name__ == "__main__":
    main()
