"""Specification to automata: locations, edges, invariants and predicates of every component.

If-updates and assignments of several variables become conditional expressions. An invariant of a location becomes an
implication. Algebraic variables and constants are replaced by their expressions where they are used.
"""

from contextlib import nullcontext
from dataclasses import replace

import msgspec

from robosc.automata import (
    Automaton,
    DiscreteVariable,
    Event,
    EventCondition,
    Role,
    System,
    SystemPlaces,
    as_controlled,
)
from robosc.automata.environment import environment_variable
from robosc.automata.structure import InputVariable
from robosc.cif import syntax
from robosc.cif.circles import report_circles
from robosc.cif.edges import Channels, Edges, data_type, event_of, place_name
from robosc.cif.function_bodies import check_function
from robosc.cif.scopes import Alias, Entity, Scope, allows
from robosc.cif.terms import Term, flat, logic, negation, retyped, truth
from robosc.cif.types import CifType, fits, is_equal
from robosc.cif.usage import Usage
from robosc.cif.warnings import Exclusion, Reading, warn
from robosc.expressions import (
    FALSE,
    TRUE,
    BooleanType,
    EnumType,
    Expression,
    IntegerType,
    Type,
    Unary,
    VariableRead,
    conjunction,
    default_value,
    domain,
)
from robosc.source import Location

MAXIMUM_VALUES = 2**20
"""Values of a variable's type beyond which it is refused."""


class Lowering(Usage):
    """Parts of a system, gathered component by component.

    Attributes:
        channels: Senders and receivers of channels.
        events: Events with their names.
        automata: Automata.
        places: Places of the automata, by their names.
        inputs: Values that the environment gives to input variables.
        exclusions: Event exclusions of plants and requirements.
        invariants: State invariants of requirements, with their places.
        plant_invariants: State invariants of plants.
        plant_places: Their places.
        initial: Predicates on the initial states.
        marker: Predicates on the marked states.
        roles: Roles of automata and invariants, with their places.
        never: Channels that have nobody at one of their ends.
        event_places: Place of the declaration of each event.
    """

    channels: Channels = msgspec.field(default_factory=Channels)
    events: list[Event] = msgspec.field(default_factory=list)
    automata: list[Automaton] = msgspec.field(default_factory=list)
    places: dict[str, Location] = msgspec.field(default_factory=dict)
    inputs: list[InputVariable] = msgspec.field(default_factory=list)
    exclusions: list[Exclusion] = msgspec.field(default_factory=list)
    invariants: list[tuple[Expression, Location]] = msgspec.field(default_factory=list)
    plant_invariants: list[Expression] = msgspec.field(default_factory=list)
    plant_places: list[Location] = msgspec.field(default_factory=list)
    initial: list[Expression] = msgspec.field(default_factory=list)
    marker: list[Expression] = msgspec.field(default_factory=list)
    never: list[Entity] = msgspec.field(default_factory=list)
    event_places: dict[str, Location] = msgspec.field(default_factory=dict)
    roles: list[tuple[str, Location]] = msgspec.field(default_factory=list)

    # The whole

    def lowered(self, name: str) -> tuple[System, SystemPlaces]:
        """The system, with the places of its parts; of use only if no error is found."""
        self.channels.gather(self)
        for scope in self.scopes.scopes():
            for entry in list(scope.entries.values()):
                if isinstance(entry, Entity):
                    self.typing.check(entry)
                elif isinstance(entry, Alias):
                    self._argument(entry)
            for item in scope.body:
                self._declaration(item, scope)
            if scope.is_automaton:
                self._automaton(scope)
        report_circles(self.typing)
        self.never += self.channels.settle(self, self.automata)
        system, places = self._system(name)
        if not self.typing.findings.has_errors:
            warn(Reading(system, places, self.exclusions, self.plant_reads, self.plant_places, self.event_places,
                         self.scopes, self.never), self.typing.findings)  # fmt: skip
        return system, places

    def _system(self, name: str) -> tuple[System, SystemPlaces]:
        alphabet = frozenset[str]().union(*(item.alphabet for item in self.automata))
        is_controlled = self._is_controlled()
        conditions: dict[bool, list[tuple[EventCondition, Location]]] = {True: [], False: []}
        conditions[True] += [(EventCondition(item.name, FALSE), item.at) for item in self.never]
        for item in self.exclusions:
            event = item.event.name
            if event not in alphabet:
                message = f"no automaton has '{event}' in its alphabet, so this excludes nothing"
                self.typing.findings.warning("cif-no-effect", message, item.at, "Remove it, or use the event.")
            elif item.condition != TRUE:
                conditions[item.role == "plant"].append((EventCondition(event, item.condition), item.at))
        # A supervisor alone says what happens, too.
        has_plant = is_controlled or any(item.role is Role.PLANT for item in self.automata)
        if not (self.automata and has_plant) and not self.typing.findings.has_errors:
            self.error("cif-unsupported", "there is no plant automaton", self.scopes.root.at, "Add one.")
        system = System(
            name=name,
            events=tuple(self.events),
            automata=tuple(self.automata),
            inputs=tuple(self.inputs),
            conditions=tuple(item for item, _ in conditions[False]),
            invariants=tuple(item for item, _ in self.invariants),
            initial=conjunction(*self.initial),
            marker=conjunction(*self.marker),
            plant_conditions=tuple(item for item, _ in conditions[True]),
            plant_invariants=tuple(self.plant_invariants),
        )
        places = SystemPlaces(
            automata=self.places,
            conditions=tuple(at for _, at in conditions[False]),
            invariants=tuple(at for _, at in self.invariants),
            plant_conditions=tuple(at for _, at in conditions[True]),
            events=self.event_places,
        )
        # A supervisor excludes initial states, too; against a requirement the system may begin.
        return as_controlled(system) if is_controlled else system, places

    def _is_controlled(self) -> bool:
        """Return True if there is a supervisor; then there must be no requirement."""
        is_controlled = any(role == "supervisor" for role, _ in self.roles)
        for role, at in self.roles if is_controlled else ():
            if role == "requirement":
                self.error("cif-unsupported", "this is a requirement, in a model that has a supervisor already", at,
                           "Leave out either: with a supervisor, nothing is synthesized.")  # fmt: skip
        return is_controlled

    # Declarations

    def _argument(self, alias: Alias) -> None:
        """Check what is given for a parameter, used or not: an event must be as the parameter says."""
        found, parameter, argument = self.scopes.target(alias), alias.parameter, alias.argument
        is_event = isinstance(found, Entity) and isinstance(found.declaration, syntax.Event)
        if not is_event or not isinstance(found, Entity) or not isinstance(argument, syntax.Name):
            return
        assert isinstance(found.declaration, syntax.Event)  # noqa: S101 - asked above
        # An argument that is a parameter itself is known by its declaration alone.
        given, _ = self.scopes.parameter(argument, alias.argument_scope)
        is_controllable = found.declaration.is_controllable if given is None else given.is_controllable
        if parameter.is_controllable not in (None, is_controllable):
            word = "controllable" if parameter.is_controllable else "uncontrollable"
            self.error("cif-arguments", f"'{argument}' is not {word}, as '{parameter.name.text}' must be", argument.at,
                       f"Give a {word} event, or leave the word out of the parameter.")  # fmt: skip
        for use in "!?~" if given is not None else "":
            if given is not None and allows(parameter, use) and not allows(given, use):
                self.error("cif-arguments", f"'{argument}' does not allow the use '{use}', as '{parameter.name.text}' "
                           "does", argument.at, "Give both the same flags.")  # fmt: skip
        wanted = None if parameter.type is None else self.typing.type(parameter.type, alias.scope.parent or alias.scope)
        type_ = data_type(self.typing, argument, found, alias.argument_scope)
        if wanted is not None and (type_ is None or not is_equal(type_, wanted)):
            has = f"data of type {type_}" if type_ else "no data"
            message = f"'{argument}' has {has}, and '{parameter.name.text}' takes {wanted}"
            self.error("cif-arguments", message, argument.at, "Give an event with data of that type.")

    def _declaration(self, item: syntax.Declaration, scope: Scope) -> None:
        match item:
            case syntax.Event(name=name):
                self._event(item, scope.absolute(name.text), scope)
            case syntax.Input(name=name):
                self._input(item, scope.absolute(name.text), scope)
            case syntax.Continuous(name=name, value=value, derivative=derivative):
                for part in (value, derivative):
                    if part is not None:
                        self.typing.real(part, scope)
                self.unsupported(scope, f"'{scope.absolute(name.text)}' is a continuous variable", name.at,
                                 "Use a discrete variable.")  # fmt: skip
            case syntax.Predicates(word=word, predicates=predicates, at=at):
                term = self.typing.conjunction(predicates, scope)
                found = self.initial if word == "initial" else self.marker
                found.append(self.used_by(scope.role, term, scope, at))
            case syntax.Invariant():
                self._invariant(item, scope, None)
            case syntax.Equation():
                self._equation(item, scope)
            case syntax.Function():
                check_function(self.typing, item, scope)
            case syntax.InputOutput(word="svgin", at=at):
                self.typing.findings.warning("cif-no-effect", "input from pictures is left aside", at, "Remove it.")

    def _event(self, item: syntax.Event, name: str, scope: Scope) -> None:
        if item.is_controllable is None:
            self.unsupported(scope, f"'{name}' is neither controllable nor uncontrollable", item.name.at,
                             "Write 'controllable' or 'uncontrollable' before it.")  # fmt: skip
        elif scope.is_real:
            self.events.append(Event(name, item.is_controllable))
            self.event_places[name] = item.name.at

    def _input(self, item: syntax.Input, name: str, scope: Scope) -> None:
        written = self.typing.type(item.type, scope)
        if not self._is_variable(item.name, written, scope, has_fields=False):
            return
        type_ = core_type(written)
        if scope.is_real:
            made = environment_variable(name, type_)
            edges = tuple(replace(edge, event=name) for edge in made.automaton.edges)
            self.automata.append(replace(made.automaton, alphabet=frozenset({name}), edges=edges))
            self.places[name] = item.name.at
            self.events.append(Event(name, is_controllable=False))
            self.inputs.append(replace(made.received, event=name))

    def _is_variable(self, name: syntax.Identifier, type_: CifType, scope: Scope, *, has_fields: bool = True) -> bool:
        """Return True if synthesis takes a variable of a type; report what it does not take."""
        if type_.kind == "unknown":
            return False
        if not type_.is_finite or (type_.kind == "tuple" and not has_fields):
            self.unsupported(scope, f"'{scope.absolute(name.text)}' has the type {type_}", name.at,
                             "Use a boolean, an enum or an integer with a range.")  # fmt: skip
            return False
        if type_.kind == "tuple":
            return all(self._is_variable(name, part, scope) for part in type_.parts)
        if type_.kind == "int" and type_.range[1] - type_.range[0] >= MAXIMUM_VALUES:
            message = f"'{scope.absolute(name.text)}' has more than {MAXIMUM_VALUES} values"
            self.error("cif-too-large", message, name.at, "Use a smaller range.")
            return False
        return True

    def _equation(self, item: syntax.Equation, scope: Scope) -> None:
        entry = None if item.name.text in scope.parameters else scope.entries.get(item.name.text)
        wanted = syntax.Continuous if item.is_derivative else syntax.Algebraic
        if not isinstance(entry, Entity) or not isinstance(entry.declaration, wanted):
            what = "a continuous" if item.is_derivative else "an algebraic"
            message = f"'{item.name.text}' is not {what} variable of this component"
            self.error("cif-structure", message, item.name.at, "Declare it here, with 'alg'.")
        if item.is_derivative:
            self.typing.real(item.value, scope)

    # Invariants

    def _invariant(self, item: syntax.Invariant, scope: Scope, place: Term | None) -> None:
        """Take an invariant; `place` is the location that it stands in."""
        predicate = self.typing.predicate(item.predicate, scope)
        events = [event_of(self.scopes, name, scope) for name in item.events]
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
        condition = self.used_by(item.role, predicate, scope, item.predicate.at)
        if not scope.is_real:
            return
        if item.form is syntax.InvariantForm.DISABLES and isinstance(condition, Unary) and place is None:
            # The form of `disables`, so that texts have it as it was written.
            condition = Unary("not", Unary("holds", condition.operand))
        if item.form is syntax.InvariantForm.STATE:
            if item.role == "plant":
                self.plant_invariants.append(condition)
                self.plant_places.append(item.at)
            else:
                self.invariants.append((condition, item.at))
            return
        for event in events:
            if event is not None:
                self.exclusions.append(Exclusion(event, condition, item.role, item.at))

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
        discrete = [item for item in scope.body if isinstance(item, syntax.Discrete)]
        variables = [variable for item in discrete for variable in self._variables(item, scope)]
        reader = Edges(self, scope, self.channels)
        edges = [edge for place in places for item in place.edges for edge in reader.read(item, place)]
        initial = [place_name(place) for place in places if self._holds(place, "initial", scope, self.initial)]
        marked = [place_name(place) for place in places if self._holds(place, "marked", scope, self.marker)]
        for place in places:
            for invariant in place.invariants:
                self._invariant(invariant, scope, self.typing.location(scope, place))
            for equation in place.equations:
                self._equation(equation, scope)
        alphabet, monitors = self._alphabets(scope, frozenset(reader.events))
        for name in sorted(alphabet & reader.channels):
            self.error("cif-structure", f"'{scope.path}' is an end of the channel '{name}', and has it in its alphabet",
                       scope.at, "Let another automaton do either.")  # fmt: skip
        alphabet |= reader.channels
        if not scope.is_real:
            return
        self.places[scope.path] = scope.at
        self.automata.append(
            Automaton(
                name=scope.path,
                locations=tuple(place_name(place) for place in places),
                initial=tuple(initial),
                marked=frozenset(marked),
                alphabet=alphabet,
                edges=tuple(edge for edge in edges if edge.event in alphabet),
                variables=tuple(variables),
                role=Role.REQUIREMENT if scope.role in ("requirement", "supervisor") else Role.PLANT,
                monitors=monitors,
            )
        )

    def _alphabets(self, scope: Scope, used: frozenset[str]) -> tuple[frozenset[str], frozenset[str]]:
        """The alphabet of an automaton, and the events that it monitors."""
        found: dict[str, frozenset[str] | None] = {"alphabet": None, "monitor": None}
        lists = [item for item in scope.body if isinstance(item, syntax.Alphabet)]
        # A monitored event is in the alphabet, wherever that stands.
        for item in sorted(lists, key=lambda item: item.word):
            if found[item.word] is not None:
                self.error("cif-structure", f"there are two of '{item.word}' in '{scope.path}'", item.at,
                           "Join them.")  # fmt: skip
            entities = [(name, event_of(self.scopes, name, scope)) for name in item.events]
            for name in item.events if item.word == "alphabet" else ():
                parameter, _ = self.scopes.parameter(name, scope)
                if parameter is not None and not allows(parameter, "~"):
                    self.error("cif-arguments", f"the flags of the parameter '{name}' do not allow this use", name.at,
                               "Add the flag '~' to it.")  # fmt: skip
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
        entry = scope.entries.get(place.name.text) if place.name is not None and word == "initial" else None
        node = entry if isinstance(entry, Entity) else scope
        with self.typing.depending(node) if word == "initial" else nullcontext():
            terms = [self.typing.conjunction(item.predicates, scope) for item in found]
        if node is not scope:
            # The beginning of an automaton depends on which locations are initial.
            self.typing.depends.setdefault(scope, {})[node] = found[0].at
        term = terms[0]
        for other in terms[1:]:
            term = logic("and", term, other)
        if term.is_static:
            return bool(term.value)
        condition = logic("=>", self.typing.location(scope, place), term)
        if scope.is_real and self.typing.usable(term, found[0].at):
            self.used_by(scope.role, term, scope, found[0].at)
            predicates.append(condition.core)
        return True

    def _variables(self, item: syntax.Discrete, scope: Scope) -> list[DiscreteVariable]:
        """The variables of a declaration: one, or one for each field of a tuple."""
        wanted = self.typing.type(item.type, scope)
        is_variable = self._is_variable(item.name, wanted, scope)
        entry = scope.entries.get(item.name.text)
        # Another thing of this name has been reported.
        is_own = isinstance(entry, Entity) and entry.declaration is item
        self.typing.has_distributions = True
        with self.typing.depending(entry if isinstance(entry, Entity) else scope):
            terms = [(self.typing.term(value, scope, wanted), value.at) for value in item.values]
        self.typing.has_distributions = False
        if "unknown" in (wanted.kind, *(term.type.kind for term, _ in terms)):
            return []
        for term, at in terms:
            if not fits(term.type, wanted):
                self.typing.mismatch(f"{term.type} does not fit {wanted}", at)
                return []
        if not is_variable or not scope.is_real or not isinstance(entry, Entity) or not is_own:
            return []
        own = self.typing.entity(entry)
        if own.type.kind == "unknown":
            return []
        terms = [(retyped(term, wanted), at) for term, at in terms]
        found = [(old.expression, old.type) for old in flat(own)]
        parts = [(read.variable, type_) for read, type_ in found if isinstance(read, VariableRead)]
        is_static = all(term.is_static for term, _ in terms)
        if not item.is_any and is_static and (len(terms) < 2 or len(parts) == 1):
            spread = [[part.value for part in flat(term)] for term, _ in terms]
            if not terms:
                spread = [[default_value(core_type(type_), type_.names[0] if type_.names else None)
                           for _, type_ in parts]]  # fmt: skip
            columns = [tuple(dict.fromkeys(column)) for column in zip(*spread, strict=True)]
            return [DiscreteVariable(name, core_type(type_), values)
                    for (name, type_), values in zip(parts, columns, strict=True)]  # fmt: skip
        if not item.is_any:
            # Each is asked, so that all that synthesis does not take is reported.
            usable = [self.typing.usable(part, at) for term, at in terms for part in flat(term)]
            if not all(usable):
                return []
            self._begins(item, scope, own, terms)
        types = [(name, core_type(type_)) for name, type_ in parts]
        return [DiscreteVariable(name, type_, tuple(domain(type_))) for name, type_ in types]

    def _begins(self, item: syntax.Discrete, scope: Scope, own: Term, terms: list[tuple[Term, Location]]) -> None:
        """Let a variable begin with one of several values, which may be those of other variables."""
        whole = truth(False)
        for term, at in terms:
            whole = logic("or", whole, self.typing.equality(own, term, at))
        self.initial.append(self.used_by(scope.role, whole, scope, item.name.at))


def core_type(type_: CifType) -> Type:
    """The type of the automata for a finite one."""
    match type_.kind:
        case "bool":
            return BooleanType()
        case "enum":
            return EnumType(type_.name, type_.names)
        case _:
            return IntegerType(*type_.range)
