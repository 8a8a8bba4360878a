"""Specification to automata: locations, edges, invariants and predicates of every component.

If-updates and assignments of several variables become conditional expressions. An invariant of a location becomes an
implication. Algebraic variables and constants are replaced by their expressions where they are used.
"""

from dataclasses import replace

import msgspec

from robosc.automata import (
    Assignment,
    Automaton,
    DiscreteVariable,
    Edge,
    Event,
    EventCondition,
    Role,
    System,
    SystemPlaces,
)
from robosc.automata.environment import environment_variable
from robosc.automata.structure import InputVariable
from robosc.cif import syntax
from robosc.cif.scopes import Entity, Scope, Scopes
from robosc.cif.terms import ERROR, Term, conditional, logic, negation, tuple_parts
from robosc.cif.types import CifType, fits, overlaps
from robosc.cif.typing import NAMELESS, Typing
from robosc.expressions import (
    TRUE,
    Binary,
    BooleanType,
    EnumType,
    Expression,
    IntegerType,
    Type,
    Value,
    VariableRead,
    conjunction,
    default_value,
    domain,
    leaves,
)
from robosc.source import Location

MAXIMUM_VALUES = 2**20
"""Values of a variable's type beyond which it is refused."""


class Exclusion(msgspec.Struct, frozen=True):
    """An event that is allowed only where a condition is true."""

    event: Entity
    condition: Expression
    role: str
    at: Location


class Lowering(msgspec.Struct):
    """Parts of a system, gathered component by component.

    Attributes:
        scopes: Components of the specification.
        typing: Meaning of their expressions.
        events: Events with their names.
        automata: Automata.
        places: Places of the automata, by their names.
        inputs: Values that the environment gives to input variables.
        exclusions: Event exclusions of plants and requirements.
        invariants: State invariants of requirements, with their places.
        plant_invariants: State invariants of plants.
        initial: Predicates on the initial states.
        marker: Predicates on the marked states.
        roles: Roles of automata and invariants, with their places.
        depends: Variables that the initial value of a variable reads, with the places where it does.
    """

    scopes: Scopes
    typing: Typing
    events: list[Event] = msgspec.field(default_factory=list)
    automata: list[Automaton] = msgspec.field(default_factory=list)
    places: dict[str, Location] = msgspec.field(default_factory=dict)
    inputs: list[InputVariable] = msgspec.field(default_factory=list)
    exclusions: list[Exclusion] = msgspec.field(default_factory=list)
    invariants: list[tuple[Expression, Location]] = msgspec.field(default_factory=list)
    plant_invariants: list[Expression] = msgspec.field(default_factory=list)
    initial: list[Expression] = msgspec.field(default_factory=list)
    marker: list[Expression] = msgspec.field(default_factory=list)
    roles: list[tuple[str, Location]] = msgspec.field(default_factory=list)
    depends: dict[tuple[str, str], dict[tuple[str, str], Location]] = msgspec.field(default_factory=dict)

    # Findings

    def error(self, code: str, message: str, location: Location, fix: str) -> None:
        """Report an error."""
        self.typing.error(code, message, location, fix)

    def unsupported(self, scope: Scope, message: str, location: Location, fix: str) -> None:
        """Report what synthesis does not take, unless it stands in a definition without an instance."""
        if scope.is_real:
            self.error("cif-unsupported", message, location, fix)

    def used(self, term: Term, scope: Scope, at: Location) -> Expression:
        """The expression of a term that is used; `true` after an error."""
        if not scope.is_real or not self.typing.usable(term, at):
            return TRUE
        return term.core

    # The whole

    def lowered(self, name: str) -> tuple[System, SystemPlaces]:
        """The system, with the places of its parts; of use only if no error is found."""
        for scope in self.scopes.scopes():
            self.scopes.check_arguments(scope)
            for entry in list(scope.entries.values()):
                if isinstance(entry, Entity):
                    self.typing.check(entry)
            for item in scope.body:
                self._declaration(item, scope)
            if scope.is_automaton:
                self._automaton(scope)
        self._check_initial_values()
        return self._system(name)

    def _system(self, name: str) -> tuple[System, SystemPlaces]:
        alphabet = frozenset[str]().union(*(item.alphabet for item in self.automata))
        is_controlled = self._is_controlled()
        conditions: dict[bool, list[tuple[EventCondition, Location]]] = {True: [], False: []}
        for item in self.exclusions:
            event = item.event.name
            if event not in alphabet:
                message = f"no automaton has '{event}' in its alphabet, so this excludes nothing"
                self.typing.findings.warning("cif-no-effect", message, item.at, "Remove it, or use the event.")
            elif item.condition != TRUE:
                conditions[item.role == "plant"].append((EventCondition(event, item.condition), item.at))
        if not any(item.role is Role.PLANT for item in self.automata) and not self.typing.findings.has_errors:
            self.error("cif-unsupported", "there is no plant automaton", self.scopes.root.at, "Add one.")
        system = System(
            name=name,
            events=tuple(self.events),
            automata=tuple(self.automata),
            inputs=tuple(self.inputs),
            conditions=tuple(item for item, _ in conditions[False]),
            invariants=tuple(item for item, _ in self.invariants),
            # No state is one that a supervisor excludes; against a requirement the system may begin.
            initial=conjunction(*self.initial, *(item for item, _ in self.invariants if is_controlled)),
            marker=conjunction(*self.marker),
            plant_conditions=tuple(item for item, _ in conditions[True]),
            plant_invariants=tuple(self.plant_invariants),
            is_controlled=is_controlled,
        )
        places = SystemPlaces(
            automata=self.places,
            conditions=tuple(at for _, at in conditions[False]),
            invariants=tuple(at for _, at in self.invariants),
            plant_conditions=tuple(at for _, at in conditions[True]),
        )
        return system, places

    def _is_controlled(self) -> bool:
        """Return True if there is a supervisor; then there must be no requirement."""
        is_controlled = any(role == "supervisor" for role, _ in self.roles)
        for role, at in self.roles if is_controlled else ():
            if role == "requirement":
                self.error("cif-unsupported", "this is a requirement, in a model that has a supervisor already", at,
                           "Leave out either: with a supervisor, nothing is synthesized.")  # fmt: skip
        return is_controlled

    # Declarations

    def _declaration(self, item: syntax.Declaration, scope: Scope) -> None:
        match item:
            case syntax.Event(name=name):
                self._event(item, scope.absolute(name.text), scope)
            case syntax.Input(name=name):
                self._input(item, scope.absolute(name.text), scope)
            case syntax.Continuous(name=name):
                self.unsupported(scope, f"'{scope.absolute(name.text)}' is a continuous variable", name.at,
                                 "Use a discrete variable.")  # fmt: skip
            case syntax.Predicates(word=word, predicates=predicates, at=at):
                term = self.typing.conjunction(predicates, scope)
                (self.initial if word == "initial" else self.marker).append(self.used(term, scope, at))
            case syntax.Invariant():
                self._invariant(item, scope, None)
            case syntax.Equation():
                self._equation(item, scope)
            case syntax.InputOutput(word="svgin", at=at):
                self.typing.findings.warning("cif-no-effect", "input from pictures is left aside", at, "Remove it.")

    def _event(self, item: syntax.Event, name: str, scope: Scope) -> None:
        if item.data is not None:
            self.unsupported(scope, f"'{name}' is a channel", item.name.at, "Use events without data.")
        if item.is_controllable is None:
            self.unsupported(scope, f"'{name}' is neither controllable nor uncontrollable", item.name.at,
                             "Write 'controllable' or 'uncontrollable' before it.")  # fmt: skip
        elif scope.is_real:
            self.events.append(Event(name, item.is_controllable))

    def _input(self, item: syntax.Input, name: str, scope: Scope) -> None:
        type_ = self._variable_type(item.name, item.type, scope)
        if type_ is not None and scope.is_real:
            made = environment_variable(name, type_)
            edges = tuple(replace(edge, event=name) for edge in made.automaton.edges)
            self.automata.append(replace(made.automaton, alphabet=frozenset({name}), edges=edges))
            self.places[name] = item.name.at
            self.events.append(Event(name, is_controllable=False))
            self.inputs.append(replace(made.received, event=name))

    def _variable_type(self, name: syntax.Identifier, written: syntax.Type, scope: Scope) -> Type | None:
        """The type of a variable; None if synthesis does not take it, which has been reported."""
        type_ = self.typing.type(written, scope)
        if type_.kind == "unknown":
            return None
        if not type_.is_finite:
            self.unsupported(scope, f"'{scope.absolute(name.text)}' has the type {type_}", name.at,
                             "Use a boolean, an enum or an integer with a range.")  # fmt: skip
            return None
        if type_.kind == "int" and type_.range[1] - type_.range[0] >= MAXIMUM_VALUES:
            message = f"'{scope.absolute(name.text)}' has more than {MAXIMUM_VALUES} values"
            self.error("cif-too-large", message, name.at, "Use a smaller range.")
            return None
        return core_type(type_)

    def _equation(self, item: syntax.Equation, scope: Scope) -> None:
        entry = scope.entries.get(item.name.text)
        is_there = isinstance(entry, Entity) and isinstance(entry.declaration, syntax.Algebraic | syntax.Continuous)
        if not is_there or item.name.text in scope.parameters:
            message = f"'{item.name.text}' is not an algebraic variable of this component"
            self.error("cif-structure", message, item.name.at,
                       "Declare it here, with 'alg'.")  # fmt: skip
        self.typing.term(item.value, scope)

    # Invariants

    def _invariant(self, item: syntax.Invariant, scope: Scope, place: Term | None) -> None:
        """Take an invariant; `place` is the location that it stands in."""
        predicate = self.typing.predicate(item.predicate, scope)
        events = [self._event_of(name, scope) for name in item.events]
        if item.role is None:
            self.unsupported(scope, "this invariant has no role", item.at,
                             "Write 'plant', 'requirement' or 'supervisor' before it.")  # fmt: skip
            return
        if scope.is_real:
            self.roles.append((item.role, item.at))
        if item.form is syntax.InvariantForm.DISABLES:
            predicate = negation(predicate)
        if place is not None:
            predicate = logic("=>", place, predicate)
        condition = self.used(predicate, scope, item.predicate.at)
        if not scope.is_real:
            return
        if item.form is syntax.InvariantForm.STATE:
            if item.role == "plant":
                self.plant_invariants.append(condition)
            else:
                self.invariants.append((condition, item.at))
            return
        for event in events:
            if event is not None:
                self.exclusions.append(Exclusion(event, condition, item.role, item.at))

    def _event_of(self, name: syntax.Name, scope: Scope) -> Entity | None:
        found = self.scopes.resolve(name, scope)
        if found is None:
            return None
        if isinstance(found, Entity) and isinstance(found.declaration, syntax.Event):
            return found
        self.scopes.wrong_kind(name, found, "an event")
        return None

    # Automata

    def _automaton(self, scope: Scope) -> None:
        places = [item for item in scope.body if isinstance(item, syntax.LocationDeclaration)]
        if len(places) > 1:
            for place in places:
                if place.name is None:
                    self.error("cif-structure", "a location without a name must be the only one", place.at,
                               "Name it.")  # fmt: skip
        if scope.role is None:
            self.unsupported(scope, f"the automaton '{scope.path}' has no role", scope.at,
                             "Make it a plant, a requirement or a supervisor.")  # fmt: skip
        elif scope.is_real:
            self.roles.append((scope.role, scope.at))
        variables = [self._variable(item, scope) for item in scope.body if isinstance(item, syntax.Discrete)]
        edges = [edge for place in places for item in place.edges for edge in self._edges(item, place, scope)]
        initial = [_name(place) for place in places if self._holds(place, "initial", scope, self.initial)]
        marked = [_name(place) for place in places if self._holds(place, "marked", scope, self.marker)]
        for place in places:
            for invariant in place.invariants:
                self._invariant(invariant, scope, self.typing.location(scope, place))
            for equation in place.equations:
                self._equation(equation, scope)
        alphabet, monitors = self._alphabets(scope, edges)
        if not scope.is_real:
            return
        self.places[scope.path] = scope.at
        self.automata.append(
            Automaton(
                name=scope.path,
                locations=tuple(_name(place) for place in places),
                initial=tuple(initial),
                marked=frozenset(marked),
                alphabet=alphabet,
                edges=tuple(edge for edge in edges if edge.event in alphabet),
                variables=tuple(item for item in variables if item is not None),
                role=Role.REQUIREMENT if scope.role in ("requirement", "supervisor") else Role.PLANT,
                monitors=monitors,
            )
        )

    def _alphabets(self, scope: Scope, edges: list[Edge]) -> tuple[frozenset[str], frozenset[str]]:
        """The alphabet of an automaton, and the events that it monitors."""
        found: dict[str, frozenset[str] | None] = {"alphabet": None, "monitor": None}
        used = frozenset(edge.event for edge in edges)
        for item in scope.body:
            if not isinstance(item, syntax.Alphabet):
                continue
            if found[item.word] is not None:
                self.error("cif-structure", f"there are two of '{item.word}' in '{scope.path}'", item.at,
                           "Join them.")  # fmt: skip
            entities = [(name, self._event_of(name, scope)) for name in item.events]
            names = frozenset(entity.name for _, entity in entities if entity is not None)
            whole = used if found["alphabet"] is None else found["alphabet"]
            if item.word == "monitor":
                for name, entity in entities:
                    if entity is not None and entity.name not in whole:
                        self.error("cif-structure", f"'{name}' is monitored and not in the alphabet", name.at,
                                   "Leave it out, or add it to the alphabet.")  # fmt: skip
                names = names & whole if item.events else whole
            elif used - names:
                missing = ", ".join(sorted(used - names))
                self.error("cif-structure", f"edges have events that the alphabet has not: {missing}", item.at,
                           "Add them to the alphabet.")  # fmt: skip
            found[item.word] = names
        alphabet = found["alphabet"]
        return used if alphabet is None else alphabet, found["monitor"] or frozenset()

    def _holds(self, place: syntax.LocationDeclaration, word: str, scope: Scope, predicates: list[Expression]) -> bool:
        """Return True if a location may be initial or marked; when it is, goes to the predicates."""
        found = [item for item in place.predicates if item.word == word]
        if not found:
            return False
        terms = [self.typing.conjunction(item.predicates, scope) for item in found]
        term = terms[0]
        for other in terms[1:]:
            term = logic("and", term, other)
        if term.is_static:
            return bool(term.value)
        condition = logic("=>", self.typing.location(scope, place), term)
        if scope.is_real and self.typing.usable(term, found[0].at):
            predicates.append(condition.core)
        return True

    def _variable(self, item: syntax.Discrete, scope: Scope) -> DiscreteVariable | None:
        type_ = self._variable_type(item.name, item.type, scope)
        terms = [(self.typing.term(value, scope), value.at) for value in item.values]
        wanted = self.typing.type(item.type, scope)
        if "unknown" in (wanted.kind, *(term.type.kind for term, _ in terms)):
            return None
        for term, at in terms:
            if not fits(term.type, wanted):
                self.typing.mismatch(f"{term.type} does not fit {wanted}", at)
                return None
        if type_ is None or not scope.is_real:
            return None
        if item.is_any:
            return DiscreteVariable(item.name.text, type_, tuple(domain(type_)))
        if not terms:
            first = wanted.names[0] if wanted.kind == "enum" else None
            return DiscreteVariable(item.name.text, type_, (default_value(type_, first),))
        if all(term.is_static for term, _ in terms):
            values: tuple[Value, ...] = tuple(dict.fromkeys(term.value for term, _ in terms))
            return DiscreteVariable(item.name.text, type_, values)
        # Each is asked, so that all that synthesis does not take is reported.
        usable = [self.typing.usable(term, at) for term, at in terms]
        if not all(usable):
            return None
        own = VariableRead(scope.path, item.name.text)
        equals = [Binary("=", own, term.core) for term, _ in terms]
        whole: Expression = equals[0]
        for other in equals[1:]:
            whole = Binary("or", whole, other)
        self.initial.append(whole)
        for term, at in terms:
            for leaf in leaves(term.core):
                if isinstance(leaf, VariableRead):
                    self.depends.setdefault((scope.path, item.name.text), {})[leaf.component, leaf.variable] = at
        return DiscreteVariable(item.name.text, type_, tuple(domain(type_)))

    def _check_initial_values(self) -> None:
        """Report initial values that go round in a circle."""
        finished = set[tuple[str, str]]()
        for start in self.depends:
            path: list[tuple[str, str]] = [start]
            iterators = [iter(self.depends[start].items())]
            while path:
                following = next(iterators[-1], None)
                if following is None:
                    finished.add(path.pop())
                    iterators.pop()
                elif following[0] in path:
                    self.error("cif-cycle", f"the initial value of '{'.'.join(following[0])}' is defined by itself",
                               following[1], "Break the circle.")  # fmt: skip
                elif following[0] not in finished and following[0] in self.depends:
                    path.append(following[0])
                    iterators.append(iter(self.depends[following[0]].items()))

    # Edges

    def _edges(self, item: syntax.Edge, place: syntax.LocationDeclaration, scope: Scope) -> list[Edge]:
        guard = self.used(self.typing.conjunction(item.guards, scope), scope, item.at)
        assigned = self._updates(item.updates, scope)
        updates = tuple(Assignment(name, self.used(term, scope, at)) for name, (term, at) in assigned.items())
        target = self._target(item, place, scope)
        if not item.events:
            self.unsupported(scope, "this edge has no event, which means 'tau'", item.at, "Give it an event.")
        found = []
        for event in item.events:
            if event.name is None:
                self.unsupported(scope, "this edge has the event 'tau'", event.at, "Give it an event of its own.")
                continue
            entity = self._event_of(event.name, scope)
            if event.value is not None:
                self.typing.term(event.value, scope)
            if event.use:
                word = "sends" if event.use == "!" else "receives"
                self.unsupported(scope, f"this edge {word} data of a channel", event.at, "Use events without data.")
            elif entity is not None:
                found.append(Edge(_name(place), entity.name, target, guard, updates))
        return found

    def _target(self, item: syntax.Edge, place: syntax.LocationDeclaration, scope: Scope) -> str:
        if item.target is None:
            return _name(place)
        entry = None if item.target.text in scope.parameters else scope.entries.get(item.target.text)
        if not isinstance(entry, Entity) or not isinstance(entry.declaration, syntax.LocationDeclaration):
            message = f"'{item.target.text}' is not a location of this automaton"
            self.error("cif-unknown-name", message, item.target.at, "Write the name of one of its locations.")
        return item.target.text

    def _updates(self, items: tuple[syntax.Update, ...], scope: Scope) -> dict[str, tuple[Term, Location]]:
        """The new value of every variable that is assigned."""
        found: dict[str, tuple[Term, Location]] = {}
        for item in items:
            if isinstance(item, syntax.Assignment):
                term = self.typing.term(item.value, scope)
                made = self._assigned(item.address, term, scope)
            else:
                made = self._if_update(item, scope)
            for name, (term, at) in made.items():
                if name in found:
                    self.error("cif-assignment", f"'{name}' is assigned twice", at, "Assign it once.")
                found[name] = (term, at)
        return found

    def _if_update(self, item: syntax.IfUpdate, scope: Scope) -> dict[str, tuple[Term, Location]]:
        branches = [(self.typing.conjunction(guards, scope), self._updates(updates, scope))
                    for guards, updates in item.branches]  # fmt: skip
        otherwise = self._updates(item.otherwise, scope)
        found: dict[str, tuple[Term, Location]] = {}
        for name in dict.fromkeys(name for part in (*(part for _, part in branches), otherwise) for name in part):
            entry = scope.entries[name]
            assert isinstance(entry, Entity)  # noqa: S101 - a variable of this automaton
            old = (self.typing.entity(entry), item.at)
            term, at = otherwise.get(name, old)
            for guard, part in reversed(branches):
                new, at = part.get(name, (old[0], at))
                kinds = (guard.type.kind, new.type.kind, term.type.kind)
                term = ERROR if "unknown" in kinds else conditional(guard, new, term, old[0].type)
            found[name] = (term, at)
        return found

    def _assigned(self, address: syntax.Expression, term: Term, scope: Scope) -> dict[str, tuple[Term, Location]]:
        """The variables of an address, with their values."""
        match address:
            case syntax.Group(items=items, at=at):
                return self._several(items, term, scope, at)
            case syntax.Index(base=base, index=index, at=at):
                self.unsupported(scope, "this assigns a part of a variable", at, "Assign the whole variable.")
                self.typing.term(index, scope)
                self._assigned(base, ERROR, scope)
                return {}
            case syntax.Name():
                return self._one(address, term, scope)
        raise AssertionError(address)

    def _several(
        self, items: tuple[syntax.Expression, ...], term: Term, scope: Scope, at: Location
    ) -> dict[str, tuple[Term, Location]]:
        if term.type.kind == "tuple" and len(term.type.parts) == len(items):
            parts = tuple_parts(term)
        else:
            if term.type.kind != "unknown":
                self.typing.mismatch(f"{term.type} has not {len(items)} parts", at)
            parts = tuple(ERROR for _ in items)
        found: dict[str, tuple[Term, Location]] = {}
        for item, part in zip(items, parts, strict=True):
            for name, value in self._assigned(item, part, scope).items():
                if name in found:
                    self.error("cif-assignment", f"'{name}' is assigned twice", value[1], "Assign it once.")
                found[name] = value
        return found

    def _one(self, name: syntax.Name, term: Term, scope: Scope) -> dict[str, tuple[Term, Location]]:
        entity = self.scopes.resolve(name, scope)
        if entity is None:
            return {}
        is_variable = isinstance(entity, Entity) and isinstance(entity.declaration, syntax.Discrete | syntax.Continuous)
        if not is_variable or not isinstance(entity, Entity):
            self.scopes.wrong_kind(name, entity, "a discrete variable")
            return {}
        if entity.scope is not scope:
            message = f"'{name}' is a variable of '{entity.scope.path}', which alone may assign it"
            self.error("cif-assignment", message, name.at, "Let that automaton assign it on an edge of the same event.")
            return {}
        own = self.typing.entity(entity)
        if "unknown" in (own.type.kind, term.type.kind) or isinstance(entity.declaration, syntax.Continuous):
            return {}
        if not overlaps(term.type, own.type):
            self.typing.mismatch(f"{term.type} does not fit {own.type}", name.at)
            return {}
        # A variable that synthesis does not take has been reported where it is declared.
        return {} if own.problems else {entity.identifier.text: (term, name.at)}


def core_type(type_: CifType) -> Type:
    """The type of the automata for a finite one."""
    match type_.kind:
        case "bool":
            return BooleanType()
        case "enum":
            return EnumType(type_.name, type_.names)
        case _:
            return IntegerType(*type_.range)


def _name(place: syntax.LocationDeclaration) -> str:
    return NAMELESS if place.name is None else place.name.text
