"""The slow twin of the CIF front end: one step of a small model, worked out on the syntax tree itself.

It knows what the random models of the tests have: automata at the root, in groups and as instances of definitions,
with parameters of every kind; events of the root, channels among them; variables of `int[0..2]`, `bool` and tuples of
both; constants, guards, updates and monitors.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import product
from operator import add, eq, le, lt, mod, mul, sub
from typing import Any

from robosc.cif import syntax
from robosc.cif.parser import parse
from robosc.source import SourceFile
from support.cif_constants_twin import constants

State = Mapping[str, Any]
"""Location of each automaton by its name, value of each variable by `automaton.variable`, of a field by `..._field`."""


@dataclass
class Instance:
    """An automaton.

    Attributes:
        path: Its absolute name; empty for the root, in which arguments are written.
        component: Text that is written of it.
        arguments: Argument of each parameter.
        fields: Fields of each variable that is a tuple.
    """

    path: str
    component: syntax.Component | None = None
    arguments: dict[str, syntax.Expression] = field(default_factory=dict)
    fields: dict[str, tuple[str, ...]] = field(default_factory=dict)

    @property
    def places(self) -> list[syntax.LocationDeclaration]:
        return [item for item in self.component.body if isinstance(item, syntax.LocationDeclaration)]  # type: ignore[union-attr]

    @property
    def names(self) -> set[str]:
        """Names of its variables and locations."""
        body = self.component.body if self.component is not None else ()
        return {item.name.text for item in body
                if isinstance(item, syntax.Discrete | syntax.LocationDeclaration) and item.name}  # fmt: skip


@dataclass(frozen=True)
class Step:
    """Effect of an event in a state.

    Attributes:
        is_allowed: Every requirement automaton allows it.
        targets: The states that plants and requirements lead to.
        leaves: A variable may leave its range.
    """

    is_allowed: bool
    targets: list[dict[str, Any]]
    leaves: bool


ROOT = Instance("")

OPERATORS: Mapping[str, Callable[[Any, Any], Any]] = {
    "and": lambda a, b: a and b, "or": lambda a, b: a or b, "=>": lambda a, b: not a or b, "<=>": eq, "<": lt, "<=": le,
    "+": add, "-": sub, "*": mul, "mod": mod,
}  # fmt: skip


class Meaning:
    """Meaning of a model.

    Attributes:
        automata: Automata by name.
    """

    def __init__(self, text: str) -> None:
        body = parse(SourceFile("m.cif", text)).body
        self.automata: dict[str, Instance] = {}
        self._definitions: dict[str, syntax.Component] = {}
        self._gather(body, "", {})
        written = [line for line in text.splitlines() if line.startswith("const ")]
        self._constants = constants("\n".join(written))
        self._sent: Any = None

    def _gather(self, body: tuple[syntax.Declaration, ...], path: str, around: dict[str, syntax.Expression]) -> None:
        """Gather automata; `around` has the arguments of the instance that the body is of."""
        for item in body:
            match item:
                case syntax.Component(parameters=None, is_automaton=True):
                    self._add(Instance(path + item.name.text, item, around))
                case syntax.Component(parameters=None):
                    self._gather(item.body, f"{path}{item.name.text}.", around)
                case syntax.Component():
                    self._definitions[item.name.text] = item
                case syntax.Instance():
                    definition = self._definitions[item.definition.parts[-1]]
                    names = [parameter.name.text for parameter in definition.parameters or ()]
                    here, given = path + item.name.text, {**around, **dict(zip(names, item.arguments, strict=True))}
                    if definition.is_automaton:
                        self._add(Instance(here, definition, given))
                    else:
                        self._gather(definition.body, f"{here}.", given)

    def _add(self, made: Instance) -> None:
        assert made.component is not None
        for item in made.component.body:
            if isinstance(item, syntax.Discrete) and item.type.fields:
                made.fields[item.name.text] = tuple(name.text for name in item.type.fields)
        self.automata[made.path] = made

    # Steps

    def targets(self, state: State, event: str, *, is_controllable: bool) -> tuple[bool, list[dict[str, Any]]]:
        """Return whether every requirement allows an event, and the states that plants and requirements lead to."""
        step = self.step(state, event)
        return step.is_allowed, [] if is_controllable and step.leaves else step.targets

    def step(self, state: State, event: str) -> Step:
        """Return what an event does in a state."""
        allowed, choices = True, []
        takes_part = False
        ends: dict[str, list[tuple[Instance, syntax.Edge, syntax.EdgeEvent]]] = {"!": [], "?": []}
        for automaton in self.automata.values():
            mine = [(edge, item) for edge, item in self._edges(automaton, state, event)
                    if all(self.value(guard, state, automaton) for guard in edge.guards)]  # fmt: skip
            for edge, item in mine:
                if item.use:
                    ends[item.use].append((automaton, edge, item))
            if event not in self._alphabet(automaton):
                continue
            is_monitored = any(isinstance(item, syntax.Alphabet) for item in automaton.component.body)  # type: ignore[union-attr]
            takes_part = True
            if mine:
                choices.append([(automaton, edge, item) for edge, item in mine])
            elif automaton.component.role == "plant" and not is_monitored:  # type: ignore[union-attr]
                return Step(allowed, [], leaves=False)
            elif not is_monitored:
                allowed = False
        if self._is_channel(event):
            takes_part = True
            choices = [ends["!"], ends["?"], *choices]
        found, leaves = [], False
        for choice in product(*choices):
            target = dict(state)
            sent = [(automaton, item) for automaton, _, item in choice if item.use == "!"]
            for automaton, edge, item in choice:
                self._sent = self.value(sent[0][1].value, state, sent[0][0]) if item.use == "?" else None
                target[automaton.path] = edge.target.text if edge.target else state[automaton.path]
                target.update(self._updates(edge.updates, state, automaton))
            is_inside = all(isinstance(value, bool | str) or 0 <= value <= 2 for value in target.values())
            leaves = leaves or not is_inside
            if is_inside:
                found.append(target)
        return Step(allowed, found if takes_part else [], leaves)

    def _is_channel(self, event: str) -> bool:
        return any(item.use and self._event(item.name, automaton) == event for automaton in self.automata.values()
                   for place in automaton.places for edge in place.edges for item in edge.events)  # fmt: skip

    def _event(self, name: syntax.Name | None, automaton: Instance) -> str:
        return str(automaton.arguments.get(str(name), name))

    def _alphabet(self, automaton: Instance) -> set[str]:
        return {self._event(item.name, automaton) for place in automaton.places for edge in place.edges
                for item in edge.events if not item.use}  # fmt: skip

    def _edges(self, automaton: Instance, state: State, event: str) -> Iterator[tuple[syntax.Edge, syntax.EdgeEvent]]:
        for place in automaton.places:
            if place.name and place.name.text == state[automaton.path]:
                yield from ((edge, item) for edge in place.edges for item in edge.events
                            if self._event(item.name, automaton) == event)  # fmt: skip

    # Updates

    def _updates(self, updates: tuple[syntax.Update, ...], state: State, automaton: Instance) -> dict[str, Any]:
        found: dict[str, Any] = {}
        for update in updates:
            if isinstance(update, syntax.IfUpdate):
                for guards, part in (*update.branches, ((), update.otherwise)):
                    if all(self.value(guard, state, automaton) for guard in guards):
                        found.update(self._updates(part, state, automaton))
                        break
            else:
                found.update(self._assigned(update.address, self.value(update.value, state, automaton), automaton))
        return found

    def _assigned(self, address: syntax.Expression, value: Any, automaton: Instance) -> dict[str, Any]:
        match address:
            case syntax.Group(items=items):
                parts = [self._assigned(item, part, automaton) for item, part in zip(items, value, strict=True)]
                return {name: part for found in parts for name, part in found.items()}
            case syntax.Index(base=base, index=index):
                fields = automaton.fields[str(base)]
                name = fields[int(index.value)] if isinstance(index, syntax.Literal) else str(index)
                return {f"{automaton.path}.{base}_{name}": value}
        whole = f"{automaton.path}.{address}"
        names = automaton.fields.get(str(address))
        if names is None:
            return {whole: value}
        return {f"{whole}_{name}": part for name, part in zip(names, value, strict=True)}

    # Values

    def _read(self, state: State, automaton: Instance, name: str) -> Any:
        path = automaton.path
        if name in automaton.fields:
            return tuple(state[f"{path}.{name}_{item}"] for item in automaton.fields[name])
        return state[f"{path}.{name}"] if f"{path}.{name}" in state else state[path] == name

    def _automaton(self, parts: tuple[str, ...], here: Instance) -> Instance:
        """The automaton that a name means: a parameter, an automaton beside this one, or one of the root."""
        given = here.arguments.get(parts[0])
        if isinstance(given, syntax.Name):
            return self.automata[".".join((*given.parts, *parts[1:]))]
        around = here.path.rpartition(".")[0]
        beside = ".".join((around, *parts)) if around else ".".join(parts)
        return self.automata[beside] if beside in self.automata else self.automata[".".join(parts)]

    def value(self, node: syntax.Expression | None, state: State, here: Instance | str) -> Any:
        """The value of an expression in a state, written in an automaton."""
        here = self.automata[here] if isinstance(here, str) else here
        match node:
            case syntax.Literal(value=value):
                return value
            case syntax.Special(word="?"):
                return self._sent
            case syntax.Name(parts=(single,)):
                if single in here.names:
                    return self._read(state, here, single)
                if single in here.arguments:
                    return self.value(here.arguments[single], state, ROOT)
                return state[single] if single in state else self._constants[single]
            case syntax.Name(parts=(*path, last)):
                return self._read(state, self._automaton(tuple(path), here), last)
            case syntax.Unary(operator="not", operand=operand):
                return not self.value(operand, state, here)
            case syntax.Group(items=items):
                return tuple(self.value(item, state, here) for item in items)
            case syntax.Index(base=base, index=index):
                return self._element(base, index, state, here)
            case syntax.If(branches=branches, otherwise=otherwise):
                for guards, then in branches:
                    if all(self.value(guard, state, here) for guard in guards):
                        return self.value(then, state, here)
                return self.value(otherwise, state, here)
            case syntax.Switch():
                return self._switch(node, state, here)
            case syntax.Binary(operator=operator, left=left, right=right):
                a, b = self.value(left, state, here), self.value(right, state, here)
                if operator in ("=", "!="):
                    return (a == b) is (operator == "=")
                return OPERATORS[operator](a, b)
        raise AssertionError(node)

    def _element(self, base: syntax.Expression, index: syntax.Expression, state: State, here: Instance) -> Any:
        """A field of a variable that is a tuple; constants of other kinds are indexed by literals."""
        values = self.value(base, state, here)
        if isinstance(index, syntax.Literal):
            return dict(values)[index.value] if isinstance(values, frozenset) else values[int(index.value)]
        return values["ab".index(str(index))]

    def _switch(self, node: syntax.Switch, state: State, here: Instance) -> Any:
        automaton = None
        if isinstance(node.subject, syntax.Special):
            automaton = here
        elif isinstance(node.subject, syntax.Name):
            try:
                automaton = self._automaton(node.subject.parts, here)
            except KeyError:
                automaton = None
        for key, then in node.cases:
            if automaton is not None:
                is_it = state[automaton.path] == str(key)
            else:
                is_it = self.value(node.subject, state, here) == self.value(key, state, here)
            if is_it:
                return self.value(then, state, here)
        assert node.otherwise is not None
        return self.value(node.otherwise, state, here)
