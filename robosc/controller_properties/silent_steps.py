"""Properties of the controller that follow from the structure of its silent steps, without visiting states.

Each function returns True only if it proves its property; False means unknown. Facts about silent steps of a checked
model:

- A tau changes the location of its own component and nothing else.
- After a reset, only a request can move the service or action again, so each reset happens at most once in a run of
  silent steps.
- Which cancels the executor asks for depends on the states that silent steps pass, so on their order only where two
  steps change what the requirements of one action read.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from itertools import product
from math import prod

import msgspec

from robosc.automata.compile import NO_DATA, Function, State, compile_expression, subjects_read
from robosc.automata.state import Subject, subject_domain, subjects
from robosc.automata.structure import Automaton, Edge, System
from robosc.controller_properties.controller import Controller
from robosc.controller_properties.graphs import components
from robosc.errors import SynthesisCancelled
from robosc.expressions import Constant, IntegerType, Value
from robosc.model.structure import CommunicationKind, EventKind, Model, is_tau
from robosc.supervisor import AddedCondition

MAXIMUM_VALUATIONS = 20_000
"""Maximum number of combinations of values, of all that some silent steps read, that are enumerated."""

_Arcs = dict[str, list[Edge]]
"""Taus of one automaton that change its location, by the location they leave."""


_Steps = dict[tuple[int, Value], list[tuple[Function, str]]]
"""Guards and targets of taus, by the place of their automaton's location and the location they leave."""


def always_end(system: System, should_stop: Callable[[], bool] = lambda: False) -> bool:
    """Return True if the taus of every component prove that silent steps end in every order.

    From some step on, an endless run takes only taus that repeat for ever. Each of them lies on a cycle of the taus of
    its component, and everything that other steps change stays constant. So it is enough to prove, for all values of
    these constants, that such taus cannot form a cycle. Components whose guards read each other are examined together.
    """
    cyclic: dict[str, _Arcs] = {}
    for automaton in system.automata:
        taus = [edge for edge in automaton.edges if is_tau(edge.event) and edge.source != edge.target]
        if any(edge.updates for edge in taus):
            return False
        arcs = _on_cycles(taus)
        if arcs:
            cyclic[automaton.name] = arcs
    return all(_cannot_cycle(system, cyclic, cluster, should_stop) for cluster in _clusters(cyclic))


def _on_cycles(taus: Iterable[Edge]) -> _Arcs:
    """The edges that lie on a cycle if guards are ignored: the source is reachable from the target."""
    leaving: _Arcs = {}
    for edge in taus:
        leaving.setdefault(edge.source, []).append(edge)
    numbers = components({source: [edge.target for edge in edges] for source, edges in leaving.items()})
    kept = {
        source: [edge for edge in edges if numbers.get(edge.target) == numbers[source]]
        for source, edges in leaving.items()
    }
    return {source: edges for source, edges in kept.items() if edges}


def _clusters(cyclic: Mapping[str, _Arcs]) -> Iterator[tuple[str, ...]]:
    """Automata with cycles, in groups whose guards read each other's locations."""
    neighbours: dict[str, set[str]] = {name: set() for name in cyclic}
    for name, arcs in cyclic.items():
        for subject in _read(arcs):
            if subject.variable is None and subject.automaton in cyclic:
                neighbours[name].add(subject.automaton)
                neighbours[subject.automaton].add(name)
    seen: set[str] = set()
    for name in cyclic:
        if name not in seen:
            seen.add(name)
            cluster = [name]
            for member in cluster:
                further = sorted(neighbours[member] - seen)
                seen.update(further)
                cluster.extend(further)
            yield tuple(cluster)


def _read(arcs: _Arcs) -> dict[Subject, None]:
    """Return the subjects that guards read."""
    found = (
        subject for edges in arcs.values() for edge in edges for subject in sorted(subjects_read(edge.guard), key=str)
    )
    return dict.fromkeys(found)


def _cannot_cycle(
    system: System, cyclic: Mapping[str, _Arcs], cluster: tuple[str, ...], should_stop: Callable[[], bool]
) -> bool:
    """Return True if the taus of some automata cannot form a cycle, for all values of everything else."""
    own = [Subject(name) for name in cluster]
    frozen = [
        item for item in dict.fromkeys(item for name in cluster for item in _read(cyclic[name])) if item not in own
    ]
    domains = [subject_domain(system, subject) for subject in (*own, *frozen)]
    if prod(map(len, domains)) > MAXIMUM_VALUATIONS:
        return False
    places = {subject: place for place, subject in enumerate((*own, *frozen))}
    steps: _Steps = {
        (places[Subject(name)], source): [(compile_expression(edge.guard, places), edge.target) for edge in edges]
        for name in cluster
        for source, edges in cyclic[name].items()
    }
    for values in product(*domains[len(own) :]):
        if should_stop():
            raise SynthesisCancelled("the check of the controller was stopped")
        if _has_cycle(steps, len(own), [(*locations, *values) for locations in product(*domains[: len(own)])]):
            return False
    return True


def _has_cycle(steps: _Steps, width: int, states: Iterable[State]) -> bool:
    """Return True if taus form a cycle: some states are left after repeated removal of states without predecessors."""
    after: dict[State, list[State]] = {}
    arriving: dict[State, int] = {}
    for state in states:
        after[state] = [
            (*state[:place], target, *state[place + 1 :])
            for place in range(width)
            for guard, target in steps.get((place, state[place]), ())
            if guard(state, NO_DATA) is True
        ]
        for target in after[state]:
            arriving[target] = arriving.get(target, 0) + 1
    done = [state for state in after if state not in arriving]
    for state in done:
        for target in after[state]:
            arriving[target] -= 1
            if not arriving[target]:
                done.append(target)
    return len(done) < len(after)


class _Step(msgspec.Struct, frozen=True):
    """A silent step.

    Attributes:
        event: Its event.
        reads: A bit for each place of a state that decides whether the step is enabled and where it leads.
        writes: A bit for each place that it may change.
        home: The automaton of a tau; None for resets.
        sources: The locations in which a tau stands.
    """

    event: str
    reads: int
    writes: int
    home: str | None
    sources: frozenset[str]


def never_conflict(
    controller: Controller, added: Iterable[AddedCondition], should_stop: Callable[[], bool] = lambda: False
) -> bool:
    """Return True if any two silent steps that are enabled together lead to one state in either order.

    If silent steps always end, this implies confluence, by Newman's lemma (see `confluence`).

    Args:
        controller: The automaton.
        added: The conditions that its supervisor adds.
        should_stop: Function called now and then; once it returns true, the work ends.

    Raises:
        SynthesisCancelled: `should_stop` became true.
    """
    system = controller.system
    diagrams = {item.event: item.condition for item in added}
    places = {subject: place for place, subject in enumerate(subjects(system))}
    alphabets: dict[str, list[Automaton]] = {}
    for automaton in system.automata:
        for event in automaton.alphabet:
            alphabets.setdefault(event, []).append(automaton)
    conditions: dict[str, set[Subject]] = {}
    for condition in system.conditions:
        conditions.setdefault(condition.event, set()).update(subjects_read(condition.condition))

    def bits(found: Iterable[Subject]) -> int:
        return sum(1 << place for place in {places[subject] for subject in found})

    def step(event: str) -> _Step:
        automata = alphabets.get(event, [])
        edges = [(item.name, edge) for item in automata for edge in item.edges if edge.event == event]
        reads = {Subject(item.name) for item in automata} | conditions.get(event, set())
        for _, edge in edges:
            reads.update(subjects_read(edge.guard), *(subjects_read(update.expression) for update in edge.updates))
        if event in diagrams:
            reads.update(Subject(node.automaton, node.variable) for node in diagrams[event].nodes)
        writes = {Subject(name) for name, edge in edges if edge.source != edge.target}
        writes.update(Subject(name, update.variable) for name, edge in edges for update in edge.updates)
        home = automata[0].name if is_tau(event) and automata else None
        return _Step(event, bits(reads), bits(writes), home, frozenset(edge.source for _, edge in edges))

    steps = [step(event) for event in controller.silent]
    required = [bits(goal.reads) for goal in controller.goals]
    domains = [subject_domain(system, subject) for subject in places]
    budget = MAXIMUM_VALUATIONS
    for number, first in enumerate(steps):
        if should_stop():
            raise SynthesisCancelled("the check of the controller was stopped")
        for second in steps[:number]:
            if first.home is not None and first.home == second.home and not first.sources & second.sources:
                continue
            if any(first.writes & read and second.writes & read for read in required):
                return False
            if not (first.writes & (second.reads | second.writes) or second.writes & first.reads):
                continue
            read = [place for place in range(len(domains)) if (first.reads | second.reads) >> place & 1]
            budget -= prod(len(domains[place]) for place in read)
            if budget < 0 or not _commute(controller, first.event, second.event, read, domains):
                return False
    return True


def _commute(
    controller: Controller,
    first: str,
    second: str,
    read: list[int],
    domains: list[tuple[Value, ...] | range],
) -> bool:
    """Return True if two steps that are enabled together lead to one state, for all values of what they read."""
    base = list(controller.start[0])
    for values in product(*(domains[place] for place in read)):
        for place, value in zip(read, values, strict=True):
            base[place] = value
        state = tuple(base)
        after_first, after_second = _taken(controller, state, first), _taken(controller, state, second)
        if after_first is None or after_second is None or after_first == after_second:
            continue
        end = _taken(controller, after_first, second)
        if end is None or end != _taken(controller, after_second, first):
            return False
    return True


def _taken(controller: Controller, state: State, event: str) -> State | None:
    """Return the target of a reset or tau, or None if it is not taken; a tau that would change nothing is not taken."""
    target = controller.after(state, event)
    return None if target == state else target


def never_forbids(controller: Controller, added: Iterable[AddedCondition]) -> bool:
    """Return True if the supervisor allows every cancel of its executor wherever a requirement does not hold.

    This holds if synthesis adds no condition to the cancels, and none of them can take a variable out of its range.
    """
    restricted = {item.event for item in added}
    return not any(
        goal.cancel in restricted or _may_leave_range(controller.system, goal.cancel) for goal in controller.goals
    )


def _may_leave_range(system: System, event: str) -> bool:
    """Return True unless it is plain that an event keeps every variable in its range."""
    for automaton in system.automata:
        types = {item.name: item.type for item in automaton.variables}
        for edge in automaton.edges:
            for update in edge.updates if edge.event == event else ():
                match types[update.variable], update.expression:
                    case IntegerType(low=low, high=high), Constant(value=int(value)):
                        if low is None or high is None or not low <= value <= high:
                            return True
                    case IntegerType(), _:
                        return True
    return False


def stays_nonblocking(model: Model, controller: Controller, added: Iterable[AddedCondition]) -> bool:
    """Return True if a controlled system that is nonblocking stays so under control.

    This holds if all silent steps are resets and nothing else depends on whether they are taken at once. Every run to a
    marked state, in which services are idle, is then also possible with each reset directly after its answer. And the
    environment and the executor can take every event of the controlled system, one by one.
    """
    has_own_steps = any(is_tau(event) for event in controller.silent) or any(
        item.kind is CommunicationKind.ACTION for item in model.communications
    )
    has_batches = any(len(batch) > 1 for batch in controller.batches)
    services = {item.event(EventKind.RESET) for item in model.communications if item.kind is CommunicationKind.SERVICE}
    answered = {item.name for item in controller.system.automata if services & item.alphabet}
    reads_services = any(
        item.event in services or any(node.automaton in answered for node in item.condition.nodes) for item in added
    )
    return controller.is_deterministic and not (has_own_steps or has_batches or reads_services)
