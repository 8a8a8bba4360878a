"""Random systems of plain automata: two plants and a requirement, deterministic, over few events."""

from random import Random

from robosc.automata import Automaton, Edge, Event, Role, System

EVENTS = ("a", "b", "c", "u", "v", "w")


def random_plain(random: Random) -> System:
    """A system; its events are in the order of their names."""
    automata = tuple(
        _automaton(random, name, role) for name, role in (("P", Role.PLANT), ("Q", Role.PLANT), ("R", Role.REQUIREMENT))
    )
    known = frozenset[str]().union(*(item.alphabet for item in automata if item.role is Role.PLANT))
    automata = (*automata[:2], _over(automata[2], known))
    return System("model", tuple(Event(name, name < "u") for name in EVENTS if name in known), automata)


def _automaton(random: Random, name: str, role: Role) -> Automaton:
    states = tuple(f"{name.lower()}{number}" for number in range(random.randint(2, 4)))
    alphabet = random.sample(EVENTS, random.randint(2, 4))
    edges = [
        Edge(state, event, random.choice(states))
        for state in states
        for event in sorted(alphabet)
        if random.random() < (0.9 if role is Role.REQUIREMENT and event >= "u" else 0.7)
    ]
    marked = frozenset(state for state in states if random.random() < 0.4).union(states[:1])
    return Automaton(name, states, states[:1], marked, frozenset(alphabet), tuple(edges), role=role)


def _over(automaton: Automaton, events: frozenset[str]) -> Automaton:
    """The automaton over some events alone, or over one of them."""
    alphabet = automaton.alphabet & events or frozenset(sorted(events)[:1])
    edges = tuple(edge for edge in automaton.edges if edge.event in alphabet)
    return Automaton(
        automaton.name, automaton.locations, automaton.initial, automaton.marked, alphabet, edges, role=automaton.role
    )
