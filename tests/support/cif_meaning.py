"""The slow twin of the CIF front end: one step of a small model, worked out on the syntax tree itself.

It knows automata at the root with events of the root, variables of `int[0..2]` and `bool`, guards, updates and
monitors, which is what the random models of the tests have.
"""

from collections.abc import Iterator, Mapping
from itertools import product
from typing import Any

from robosc.cif import syntax
from robosc.cif.parser import parse
from robosc.source import SourceFile

State = Mapping[str, Any]
"""Location of each automaton by its name, value of each variable by `automaton.variable`."""


class Meaning:
    """Meaning of a model.

    Attributes:
        automata: Automata by name.
    """

    def __init__(self, text: str) -> None:
        body = parse(SourceFile("m.cif", text)).body
        self.automata = {item.name.text: item for item in body if isinstance(item, syntax.Component)}

    def targets(self, state: State, event: str, *, is_controllable: bool) -> tuple[bool, list[dict[str, Any]]]:
        """Return whether every requirement allows an event, and the states that plants and requirements lead to."""
        allowed, choices = True, []
        takes_part = False
        for name, automaton in self.automata.items():
            if event not in self._alphabet(automaton):
                continue
            edges = [edge for edge in self._edges(automaton, state[name], event)
                     if all(self.value(guard, state, name) for guard in edge.guards)]  # fmt: skip
            is_monitored = any(isinstance(item, syntax.Alphabet) for item in automaton.body)
            takes_part = True
            if edges:
                choices.append([(name, edge) for edge in edges])
            elif automaton.role == "plant" and not is_monitored:
                return allowed, []
            elif not is_monitored:
                allowed = False
        found, leaves = [], not takes_part
        for choice in product(*choices):
            target = dict(state)
            for name, edge in choice:
                target[name] = edge.target.text if edge.target else state[name]
                target.update(self._updates(edge.updates, state, name))
            is_inside = all(isinstance(value, bool | str) or 0 <= value <= 2 for value in target.values())
            leaves = leaves or not is_inside
            if is_inside:
                found.append(target)
        return allowed, [] if not takes_part or (is_controllable and leaves) else found

    def _alphabet(self, automaton: syntax.Component) -> set[str]:
        return {str(event.name) for place in self._places(automaton) for edge in place.edges for event in edge.events}

    def _places(self, automaton: syntax.Component) -> list[syntax.LocationDeclaration]:
        return [item for item in automaton.body if isinstance(item, syntax.LocationDeclaration)]

    def _edges(self, automaton: syntax.Component, location: str, event: str) -> Iterator[syntax.Edge]:
        for place in self._places(automaton):
            if place.name and place.name.text == location:
                yield from (edge for edge in place.edges for item in edge.events if str(item.name) == event)

    def _updates(self, updates: tuple[syntax.Update, ...], state: State, name: str) -> dict[str, Any]:
        found: dict[str, Any] = {}
        for update in updates:
            if isinstance(update, syntax.IfUpdate):
                for guards, part in (*update.branches, ((), update.otherwise)):
                    if all(self.value(guard, state, name) for guard in guards):
                        found.update(self._updates(part, state, name))
                        break
            elif isinstance(update.address, syntax.Group):
                values = self.value(update.value, state, name)
                for address, value in zip(update.address.items, values, strict=True):
                    found[f"{name}.{address}"] = value
            else:
                found[f"{name}.{update.address}"] = self.value(update.value, state, name)
        return found

    def value(self, node: syntax.Expression, state: State, name: str) -> Any:
        """The value of an expression in a state, written in an automaton."""
        match node:
            case syntax.Literal(value=value):
                return value
            case syntax.Name(parts=(single,)):
                return state[f"{name}.{single}"] if f"{name}.{single}" in state else state[name] == single
            case syntax.Name(parts=(automaton, last)):
                return state[f"{automaton}.{last}"] if f"{automaton}.{last}" in state else state[automaton] == last
            case syntax.Unary(operator="not", operand=operand):
                return not self.value(operand, state, name)
            case syntax.Group(items=items):
                return tuple(self.value(item, state, name) for item in items)
            case syntax.If(branches=branches, otherwise=otherwise):
                for guards, then in branches:
                    if all(self.value(guard, state, name) for guard in guards):
                        return self.value(then, state, name)
                return self.value(otherwise, state, name)
            case syntax.Switch(subject=syntax.Name() as subject, cases=cases, otherwise=other):
                for key, then in cases:
                    if state[str(subject)] == str(key):
                        return self.value(then, state, name)
                assert other is not None
                return self.value(other, state, name)
            case syntax.Binary(operator=operator, left=left, right=right):
                a, b = self.value(left, state, name), self.value(right, state, name)
                return {"and": a and b, "or": a or b, "=>": not a or b, "<=>": a == b, "=": a == b, "!=": a != b,
                        "<": a < b, "<=": a <= b, "+": a + b, "-": a - b, "*": a * b,
                        "mod": a % b if b else None}[operator]  # fmt: skip
        raise AssertionError(node)
