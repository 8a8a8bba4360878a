"""Checks of the two CIF files of a supervisor against the supervisor: state by state, event by event."""

from collections.abc import Iterator
from dataclasses import dataclass
from random import Random
from typing import Any

from robosc.automata import Semantics, System, to_automata
from robosc.automata.semantics import TooManyChoicesError
from robosc.automata.state import Subject, subject_domain, subjects
from robosc.expressions.evaluate import evaluate
from robosc.supervisor import Supervisor
from robosc.supervisor.predicates import state_predicates
from robosc.targets import generate
from support.cif_parser import Type
from support.cif_system import CifSystem, Table, TooManyValuationsError
from support.cif_types import Place

State = tuple[Any, ...]


@dataclass
class Twin:
    """One file beside the system that it was made of.

    Args:
        text: The file.
        system: The system.
    """

    text: str
    system: System

    def __post_init__(self) -> None:
        self.cif = CifSystem(self.text)
        self.table = Table(self.text)
        self.places = subjects(self.system)
        self.events = {meaning: name for name, meaning in self.table.events.items()}
        self.types = {
            (automaton.name, name): type_
            for automaton in self.cif.specification.automata
            for name, type_, _ in automaton.variables
        }
        self.owners = {meaning: name for name, meaning in self.table.automata.items()}
        assert self.cif.declared_names() == self.table.names
        assert {name: kind for name, kind in self.cif.events.items() if name in self.table.events} == {
            self.events[event.name]: event.is_controllable for event in self.system.events
        }

        for automaton in self.system.automata:
            alphabet = {self.events[name] for name in automaton.alphabet}
            assert self.cif.alphabets[self.owners[automaton.name]] == alphabet

    def ours(self, values: dict[Place, Any]) -> State:
        """A CIF state as one of the system."""
        found = self.table.state(values)
        return tuple(found[place.automaton, place.variable] for place in self.places)

    def theirs(self, state: State) -> dict[Place, Any]:
        """A state of the system as one of CIF; data plants are where they begin."""
        found = dict(self.cif.initial)
        for subject, value in zip(self.places, state, strict=True):
            owner = self.owners[subject.automaton]
            if subject.variable is None:
                names = {meaning: place for place, meaning in self.table.locations.items() if place[0] == owner}
                found[owner, ""] = names[value][1]
                continue
            (place,) = (
                place
                for place, (meaning, _) in self.table.variables.items()
                if place[0] == owner and meaning == subject.variable
            )
            found[place] = self._stored(value, self.types[place], self.table.variables[place][1])
        return found

    def _stored(self, value: Any, type_: Type, less: int) -> Any:
        if isinstance(value, str):
            (literal,) = (name for name in self.cif.scope.enums[type_.name] if self.table.literals[name] == value)
            return literal
        return value if isinstance(value, bool) else value + less

    def is_marked(self, values: dict[Place, Any]) -> bool:
        return all(values[name, ""] in marked for name, marked in self.cif.marked.items())

    def random_states(self, seed: int, count: int) -> Iterator[State]:
        """States that need not be reachable."""
        dice = Random(seed)
        domains = [subject_domain(self.system, Subject(item.automaton, item.variable)) for item in self.places]
        for _ in range(count):
            yield tuple(dice.choice(domain) for domain in domains)


def assert_same_problem(supervisor: Supervisor, *, reachable: int, others: int = 0) -> int:
    """`controller.cif` is the uncontrolled system with its requirements.

    Args:
        supervisor: The supervisor.
        reachable: Reachable states to compare, at most.
        others: States to compare that need not be reachable.

    Returns:
        The number of states compared.
    """
    system = to_automata(supervisor.model, supervisor.deployment)
    semantics = Semantics(system)
    twin = Twin(generate(supervisor, "cif")["controller.cif"], system)
    assert twin.ours(twin.cif.initial) == semantics.initial
    assert [item.kind for item in twin.cif.specification.automata].count("supervisor") == 0
    found = dict.fromkeys([semantics.initial, *twin.random_states(0, others)])
    queue = list(found)
    for state in queue:
        values = twin.theirs(state)
        assert twin.ours(values) == state
        assert twin.is_marked(values) == semantics.is_marked(state)
        is_bad = not all(invariant(values) for invariant in twin.cif.invariants)
        for event in system.events:
            name = twin.events[event.name]
            needs = all(predicate(values) for predicate in twin.cif.needs.get(name, ()))
            assert needs == semantics.condition(state, event.name), (state, event.name)
            try:
                targets, step = semantics.targets(state, event.name), twin.cif.step(values, name)
            except (TooManyChoicesError, TooManyValuationsError):
                return 0
            is_enabled = step.possible and not (event.is_controllable and step.leaves)
            assert is_enabled == semantics.enabled(state, event.name), (state, event.name)
            if is_enabled:
                assert {twin.ours(target) for target in step.targets} == targets, (state, event.name)
            is_bad = is_bad or (not event.is_controllable and step.possible and (step.leaves or not needs))
            if len(found) < reachable + others:
                queue += [target for target in sorted(targets, key=repr) if target not in found]
                found.update(dict.fromkeys(targets))
        assert is_bad == semantics.bad(state), state
        _assert_same_data(supervisor, twin, state, values)
    return len(queue)


def _assert_same_data(supervisor: Supervisor, twin: Twin, state: State, values: dict[Place, Any]) -> None:
    """Each data plant can go where a statement's condition holds, and to `none` where none does."""
    read = dict(zip(twin.places, state, strict=True))
    for name in dict.fromkeys(item.communication for item in supervisor.model.provides):
        plant = f"data_{name}"
        statements = supervisor.model.provides_for(name)
        holds = [
            item.condition is None
            or evaluate(item.condition, lambda a, v: read[Subject(a, v)], lambda a: str(read[Subject(a)])) is True
            for item in statements
        ]
        for place, applies in enumerate(holds, start=1):
            other = "none" if place > 1 or len(holds) == 1 else "provide_2"
            step = twin.cif.step({**values, (plant, ""): other}, f"{plant}.c_provide_{place}")
            assert step.possible == applies
            assert [target[plant, ""] for target in step.targets] == [f"provide_{place}"] * applies
        assert twin.cif.step({**values, (plant, ""): "provide_1"}, f"{plant}.c_none").possible == (not any(holds))
        assert twin.cif.marked[plant] == {"none", *(f"provide_{place + 1}" for place in range(len(holds)))}


def assert_same_control(supervisor: Supervisor, *, reachable: int, others: int = 0) -> int:
    """`supervisor.cif` is the controlled system: nothing but the supervisor keeps its controllable events back.

    Args and returns: as `assert_same_problem`.
    """
    system = to_automata(supervisor.model, supervisor.deployment)
    semantics = Semantics(system)
    added = state_predicates(system, supervisor.added)
    twin = Twin(generate(supervisor, "cif")["supervisor.cif"], system)
    assert [item.name for item in twin.cif.specification.automata if item.kind == "supervisor"] == ["sup"]
    assert not twin.cif.needs and not twin.cif.invariants
    assert twin.cif.alphabets["sup"] == {name for name, controllable in twin.cif.events.items() if controllable}
    found = dict.fromkeys([semantics.initial, *twin.random_states(1, others)])
    queue = list(found)
    for state in queue:
        values = twin.theirs(state)
        for event in system.events:
            try:
                targets = semantics.targets(state, event.name)
                step = twin.cif.step(values, twin.events[event.name])
            except (TooManyChoicesError, TooManyValuationsError):
                return 0
            if event.is_controllable:
                is_allowed = semantics.condition(state, event.name)
                if event.name in added:
                    is_allowed = is_allowed and added[event.name](state)
                targets = targets if is_allowed else frozenset()
                assert not step.leaves, (state, event.name)
            assert {twin.ours(target) for target in step.targets} == targets, (state, event.name)
            if len(found) < reachable + others:
                queue += [target for target in sorted(targets, key=repr) if target not in found]
                found.update(dict.fromkeys(targets))
    return len(queue)
