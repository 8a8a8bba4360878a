"""The slow twin of what CIF says of states: how a model begins, what is marked, what its invariants demand."""

from collections.abc import Iterator
from typing import TypeGuard

from robosc.cif import syntax
from robosc.cif.parser import parse
from robosc.source import SourceFile
from support.cif_meaning import ROOT, Instance, Meaning, State

DEFAULTS = {"int": 0, "bool": False}


class Predicates:
    """Predicates of a model.

    Attributes:
        meaning: Meaning of its expressions.
    """

    def __init__(self, text: str) -> None:
        self.meaning = Meaning(text)
        self._bodies: list[tuple[Instance, tuple[syntax.Declaration, ...]]] = [
            (automaton, automaton.component.body) for automaton in self.meaning.automata.values() if automaton.component
        ]
        root = parse(SourceFile("m.cif", text)).body
        groups = [item.body for item in root if isinstance(item, syntax.Component) and not item.is_automaton]
        self._bodies += [(ROOT, body) for body in (root, *groups)]

    def _holds(self, nodes: tuple[syntax.Expression, ...], state: State, here: Instance) -> bool:
        return all(self.meaning.value(node, state, here) for node in nodes)

    def _hold(self, word: str, state: State) -> bool:
        """Return True if all predicates of components hold, and those of the current locations."""
        found: list[bool] = []
        for here, body in self._bodies:
            for item in body:
                if isinstance(item, syntax.Predicates) and item.word == word:
                    found.append(self._holds(item.predicates, state, here))
                elif _is_current(item, state, here):
                    mine = [part.predicates for part in item.predicates if part.word == word]
                    found.append(bool(mine) and all(self._holds(part, state, here) for part in mine))
        return all(found)

    def is_initial(self, state: State) -> bool:
        """Return True if the model may begin in a state."""
        for here, body in self._bodies:
            for item in body:
                if not isinstance(item, syntax.Discrete) or item.is_any:
                    continue
                mine = self.meaning.value(syntax.Name((item.name.text,), syntax.Root.HERE, item.name.at), state, here)
                default = tuple(DEFAULTS[part.kind] for part in item.type.parts) or DEFAULTS.get(item.type.kind)
                values = [self.meaning.value(value, state, here) for value in item.values] or [default]
                if mine not in values:
                    return False
        return self._hold("initial", state) and self.holds("plant", state)

    def is_marked(self, state: State) -> bool:
        """Return True if a state is marked."""
        return self._hold("marked", state)

    def _invariants(self, role: str, state: State) -> Iterator[tuple[Instance, syntax.Invariant]]:
        """Yield the invariants that speak of a state: those of locations speak of them alone."""
        for here, body in self._bodies:
            for item in body:
                if isinstance(item, syntax.Invariant) and item.role == role:
                    yield here, item
                elif _is_current(item, state, here):
                    yield from ((here, part) for part in item.invariants if part.role == role)

    def holds(self, role: str, state: State) -> bool:
        """Return True if all state invariants of plants, or of requirements, hold."""
        return all(self.meaning.value(item.predicate, state, here) for here, item in self._invariants(role, state)
                   if item.form is syntax.InvariantForm.STATE)  # fmt: skip

    def allows(self, role: str, event: str, state: State) -> bool:
        """Return True if all event invariants of plants, or of requirements, allow an event."""
        for here, item in self._invariants(role, state):
            if event in map(str, item.events):
                is_true = self.meaning.value(item.predicate, state, here)
                if is_true is (item.form is syntax.InvariantForm.DISABLES):
                    return False
        return True


def _is_current(item: syntax.Declaration, state: State, here: Instance) -> TypeGuard[syntax.LocationDeclaration]:
    """Return True if an item is the current location of the automaton it is declared in."""
    return isinstance(item, syntax.LocationDeclaration) and item.name is not None and item.name.text == state[here.path]
