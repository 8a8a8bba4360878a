"""Builds and checks the behaviour of a component."""

from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Set
from itertools import islice

import msgspec
from msgspec.structs import replace

from robosc.errors import RelatedPlace
from robosc.expressions import (
    ArrayType,
    Constant,
    DoubleType,
    EnumType,
    EnumValue,
    Expression,
    NoneType,
    ObjectType,
    Type,
    Value,
    default_value,
    type_text,
)
from robosc.language import syntax
from robosc.language.words import spelled
from robosc.model.expression_checker import ExpressionChecker
from robosc.model.findings import MAXIMUM_CHOICES, Findings
from robosc.model.scope import ComponentNames, Scope
from robosc.model.structure import (
    Behaviour,
    Communication,
    CommunicationKind,
    EventKind,
    State,
    Transition,
    Update,
    Variable,
    is_tau,
)
from robosc.model.typed import may_leave
from robosc.model.types import Types
from robosc.model.units import Part, unique
from robosc.source import Location

_KINDS: dict[CommunicationKind, frozenset[EventKind]] = {
    CommunicationKind.INCOMING_MESSAGE: frozenset({EventKind.REQUEST}),
    CommunicationKind.OUTGOING_MESSAGE: frozenset({EventKind.RESPONSE}),
    CommunicationKind.SERVICE: frozenset({EventKind.REQUEST, EventKind.RESPONSE, EventKind.ERROR}),
    CommunicationKind.ACTION: frozenset(set(EventKind) - {EventKind.RESET}),
}
"""Kinds of events that a behaviour can react to."""

_PREPOSITIONS = {
    EventKind.REQUEST: "to",
    EventKind.RESPONSE: "from",
    EventKind.FEEDBACK: "from",
    EventKind.ERROR: "from",
}


_MAXIMUM_SHOWN = 10
"""Names that one finding lists."""


class BehaviourTree(msgspec.Struct, frozen=True):
    """A behaviour as written, sorted into its parts.

    Attributes:
        part: The component.
        location: Place where the behaviour begins.
        variables: Its variables.
        states: Its states.
        transitions: Every transition in the order of the text, with the state it stands in.
    """

    part: Part
    location: Location
    variables: tuple[syntax.Variable, ...]
    states: tuple[syntax.State, ...]
    transitions: tuple[tuple[syntax.State | None, syntax.Transition], ...]


def behaviour_tree(part: Part, findings: Findings) -> BehaviourTree | None:
    """The behaviour of a component, or None; more than one is an error."""
    found = [item for item in part.tree.items if isinstance(item, syntax.Behaviour)]
    if not found:
        return None
    for other in found[1:]:
        findings.error(
            "multiple-behaviours",
            f"the component '{part.tree.name.text}' has more than one behaviour",
            other.location,
            "Merge them into one behaviour, or make a component of each.",
            RelatedPlace("the first behaviour stands here", found[0].location),
        )
    items = found[0].items
    transitions: list[tuple[syntax.State | None, syntax.Transition]] = []
    for item in items:
        if isinstance(item, syntax.State):
            transitions += [(item, transition) for transition in item.transitions]
        elif not isinstance(item, syntax.Variable):
            transitions.append((None, item))
    return BehaviourTree(
        part,
        found[0].location,
        tuple(item for item in items if isinstance(item, syntax.Variable)),
        tuple(item for item in items if isinstance(item, syntax.State)),
        tuple(transitions),
    )


def component_names(part: Part, tree: BehaviourTree | None, types: Types, findings: Findings) -> ComponentNames:
    """Return the names that can be read of a component.

    Reports names that are given twice and types no variable can have.
    """
    if tree is None:
        return ComponentNames(part.name, frozenset(), {})
    _unique_names(tree, findings)
    variables: dict[str, Type | None] = {}
    for variable in tree.variables:
        variables.setdefault(variable.name.text, _variable_type(variable, part, types, findings))
    declared = {variable.name.text: variable.type.location for variable in reversed(tree.variables)}
    names = [*(state.name for state in tree.states), *(variable.name for variable in tree.variables)]
    places = {name.text: name.location for name in reversed(names)}
    return ComponentNames(part.name, frozenset(state.name.text for state in tree.states), variables, declared, places)


def _unique_names(tree: BehaviourTree, findings: Findings) -> None:
    unique([state.name for state in tree.states], "duplicate-state", "state", findings)
    unique([variable.name for variable in tree.variables], "duplicate-variable", "variable", findings)
    states = {state.name.text.casefold(): state.name for state in tree.states}
    for variable in tree.variables:
        state = states.get(variable.name.text.casefold())
        if state is not None:
            findings.error(
                "duplicate-variable",
                f"'{variable.name.text}' is the name of a state too",
                variable.name.location,
                "Rename the variable or the state.",
                RelatedPlace("the state stands here", state.location),
            )


def _variable_type(variable: syntax.Variable, part: Part, types: Types, findings: Findings) -> Type | None:
    if isinstance(variable.type, syntax.ArrayType):
        # A sharper word than 'arrays only inside objects': no variable can hold one at all.
        _no_object_variable(variable, findings)
        return None
    found = types.resolve(variable.type, part.unit)
    if isinstance(found, ObjectType | ArrayType | NoneType):
        _no_object_variable(variable, findings)
        return None
    return found


def _no_object_variable(variable: syntax.Variable, findings: Findings) -> None:
    findings.error(
        "object-variable",
        f"the variable '{variable.name.text}' cannot hold an object, an array or nothing",
        variable.type.location,
        "Make a variable of each property that is needed.",
    )


_OPPOSITE = {
    CommunicationKind.INCOMING_MESSAGE: CommunicationKind.OUTGOING_MESSAGE,
    CommunicationKind.OUTGOING_MESSAGE: CommunicationKind.INCOMING_MESSAGE,
}


class Uses(msgspec.Struct, frozen=True):
    """Uses of communications in a robot, as written.

    Attributes:
        commanded: Names of those that requirements, provide statements and limits name.
        reactions: Kinds of the events that behaviours react to, of each that they name.
    """

    commanded: Collection[str]
    reactions: Mapping[str, Set[str]]


def uses_of(trees: Iterable[BehaviourTree], items: Iterable[syntax.Item]) -> Uses:
    """The uses of communications in some behaviours, and in the items of some files."""
    commanded: set[str] = set()
    for item in items:
        match item:
            case syntax.Requirement(communications=names):
                commanded.update(name.text for name in names)
            case syntax.Provide(communication=name) | syntax.Limit(communication=name):
                commanded.add(name.text)
    reactions = defaultdict[str, set[str]](set)
    for tree in trees:
        for _, transition in tree.transitions:
            if isinstance(transition, syntax.CommunicationTransition):
                reactions[transition.communication.text].add(transition.kind)
    return Uses(commanded, reactions)


class BehaviourBuilder:
    """Builder of one behaviour.

    Args:
        tree: The behaviour as written.
        scope: Names in it.
        communications: Every communication of the robot by name.
        defaults: Default value of an uninitialised variable, for each enum type.
        findings: Findings to which faults are reported.
        unknown_communication: Function called for a name that no communication has.
        uses: Uses of the communications in the robot.
    """

    def __init__(
        self,
        tree: BehaviourTree,
        scope: Scope,
        communications: Mapping[str, Communication],
        defaults: Mapping[str, str],
        findings: Findings,
        unknown_communication: Callable[[syntax.Name], None],
        uses: Uses,
    ) -> None:
        self._tree = tree
        self._uses = uses
        self._scope = scope
        self._communications = communications
        self._defaults = defaults
        self._findings = findings
        self._unknown_communication = unknown_communication
        self._taus = 0
        self._turned: set[str] = set()
        self._states_by_name = {state.name.text: state for state in tree.states}

    def build(self) -> Behaviour:
        """The behaviour, as far as it is sound; every variable still counted as code-only."""
        states = self._states()
        variables = tuple(self._variables())
        transitions = tuple(self._transitions())
        behaviour = Behaviour(variables, states, transitions)
        # A transition with an unknown name may lead anywhere.
        targets = zip(transitions, self._tree.transitions, strict=False)
        is_whole = all((item.target is None) == (tree.target is None) for item, (_, tree) in targets)
        if is_whole and len(transitions) == len(self._tree.transitions):
            self._check_graph(behaviour)
        self._check_determinism()
        return behaviour

    # States and variables

    def _states(self) -> tuple[State, ...]:
        initial = [state for state in self._tree.states if state.is_initial]
        component = self._tree.part.tree.name.text
        if not initial:
            self._findings.error(
                "no-initial-state",
                f"the behaviour of '{component}' has no initial state",
                self._tree.states[0].name.location if self._tree.states else self._tree.location,
                "Write 'initial' before this state or the one that it starts in."
                if self._tree.states
                else "Write a state, with 'initial' before it.",
            )
        for other in initial[1:]:
            self._findings.error(
                "multiple-initial-states",
                f"the behaviour of '{component}' has more than one initial state",
                other.name.location,
                "Remove 'initial' before this state or before the other one.",
                RelatedPlace("the first initial state stands here", initial[0].name.location),
            )
        return tuple(State(state.name.text, state.is_initial, state.is_marked) for state in self._tree.states)

    def _variables(self) -> Iterator[Variable]:
        for tree in self._tree.variables:
            type_ = self._scope.own.variables.get(tree.name.text) if self._scope.own else None
            if type_ is not None:
                yield Variable(tree.name.text, type_, self._initial(tree, type_), is_synthesis=False)

    def _initial(self, tree: syntax.Variable, type_: Type) -> Value:
        default = default_value(type_, self._defaults.get(type_.name) if isinstance(type_, EnumType) else None)
        if tree.initial is None:
            return default
        # Only literals, constants and enum values can stand here, so no component or variable is in sight.
        scope = replace(self._scope, components={}, own=None)
        checker = ExpressionChecker(scope, self._findings)
        because = RelatedPlace(f"'{tree.name.text}' is declared as {type_text(type_)} here", tree.type.location)
        typed = checker.fitting(tree.initial, type_, because)
        if typed is None or not isinstance(typed.expression, Constant | EnumValue):
            return default
        if may_leave(typed.type, type_):
            self._findings.error(
                "type-mismatch",
                f"the initial value lies outside {type_text(type_)}",
                tree.initial.location,
                "Start with a value of the range.",
            )
            return default
        value = typed.expression.value
        return float(value) if isinstance(type_, DoubleType) else value

    # Transitions

    def _transitions(self) -> Iterator[Transition]:
        for state, tree in self._tree.transitions:
            source = None if state is None else state.name.text
            target = self._target(tree.target)
            if isinstance(tree, syntax.TauTransition):
                self._taus += 1
                event = f"{self._tree.part.name}.tau_{self._taus}"
                guard = None if tree.guard is None else self._checker(None).condition(tree.guard)
                yield Transition(source, event, guard, (), target)
                continue
            found = self._event(tree)
            if found is not None:
                communication, kind = found
                updates = self._updates(tree, communication, kind)
                yield Transition(source, communication.event(kind), None, updates, target)

    def _checker(self, received: Type | None, sender: str = "") -> ExpressionChecker:
        return ExpressionChecker(self._scope.with_received(received, sender), self._findings)

    def _target(self, name: syntax.Name | None) -> str | None:
        if name is None:
            return None
        if name.text not in self._states_by_name:
            self._findings.unknown("state", name.text, name.location, self._likeliest_states())
            return None
        self._findings.bindings.bind(name, self._states_by_name[name.text].name.location)
        return name.text

    def _likeliest_states(self) -> Iterable[str]:
        """The states; if they are few, one that nothing leads to first: it is likeliest to be meant by what is none."""
        if len(self._states_by_name) > MAXIMUM_CHOICES:
            return self._states_by_name
        led_to = {tree.target.text for _, tree in self._tree.transitions if tree.target is not None}
        led_to |= {name for name, state in self._states_by_name.items() if state.is_initial}
        return sorted(self._states_by_name, key=lambda name: name in led_to)

    def _event(self, tree: syntax.CommunicationTransition) -> tuple[Communication, EventKind] | None:
        communication = self._communications.get(tree.communication.text)
        self._findings.bindings.bind_communication(tree.communication)
        if communication is None:
            self._unknown_communication(tree.communication)
            return None
        kind = EventKind(tree.kind)
        if kind not in _KINDS[communication.kind]:
            if communication.name in self._turned or self._is_turned(communication):
                self._report_turned(communication)
                return None
            allowed = ", ".join(item for item in EventKind if item in _KINDS[communication.kind])
            self._findings.error(
                "wrong-result-kind",
                f"{_article(communication.kind)} has no {kind}; it has {allowed}",
                tree.location,
                f"Use {allowed}{self._other_direction(communication)}.",
            )
            return None
        preposition = _PREPOSITIONS.get(kind)
        if preposition is not None and tree.preposition.text != preposition:
            self._findings.warning(
                "wrong-preposition",
                f"'{kind}' goes with '{preposition}'",
                tree.preposition.location,
                f"Write 'on {kind} {preposition} {communication.name}'.",
            )
        return communication, kind

    def _is_turned(self, communication: Communication) -> bool:
        """Return True if all transitions on a message would be right if it went in the other direction, as it seems to.

        What requirements and provide statements name is sent to the component, and nothing else is.
        """
        opposite = self._suiting(communication)
        if opposite is None or communication.component != self._tree.part.name or self._tree.part.is_imported:
            return False
        is_commanded = communication.name in self._uses.commanded
        return is_commanded == (opposite is CommunicationKind.INCOMING_MESSAGE)

    def _suiting(self, communication: Communication) -> CommunicationKind | None:
        """The other direction of a message, if all reactions to it would be right then."""
        opposite = _OPPOSITE.get(communication.kind)
        reactions = self._uses.reactions[communication.name]
        return opposite if opposite is not None and reactions <= {*_KINDS[opposite]} else None

    def _other_direction(self, communication: Communication) -> str:
        """Return the advice to declare a message in the other direction, if that is possible."""
        opposite = self._suiting(communication)
        return "" if opposite is None else f", or make it {_article(opposite)}: directions are the component's"

    def _report_turned(self, communication: Communication) -> None:
        """Report the direction of a message once."""
        if communication.name in self._turned:
            return
        self._turned.add(communication.name)
        is_incoming = communication.kind is CommunicationKind.INCOMING_MESSAGE
        right, used = ("outgoing", "response") if is_incoming else ("incoming", "request")
        self._findings.error(
            "wrong-result-kind",
            f"{_article(communication.kind)} has no {used}, on which the behaviour of "
            f"'{self._tree.part.tree.name.text}' reacts; did you mean '{right}'?",
            self._findings.bindings.communications[communication.name],
            f"Write '{right} message': directions are the component's, so what a sensor sends is outgoing, and what "
            "moves a motor is incoming.",
        )

    def _updates(
        self, tree: syntax.CommunicationTransition, communication: Communication, kind: EventKind
    ) -> tuple[Update, ...]:
        if tree.updates and communication.kind is CommunicationKind.INCOMING_MESSAGE:
            self._findings.error(
                "update-on-incoming",
                "a request of an incoming message can update nothing",
                tree.updates[0].target.location,
                "Update on something that is received, or use a service.",
            )
        if kind is EventKind.REQUEST and any(_reads_value(update.value) for update in tree.updates):
            asked = communication.name
            self._findings.error(
                "no-value-here",
                "'value' is the received data, and a request brings none",
                tree.location,
                f"Write 'on response from {asked}' instead of 'on request to {asked}'.",
            )
            return ()
        checker = self._checker(communication.received_type(kind), communication.name)
        updates: dict[str, Update] = {}
        places: dict[str, Location] = {}
        for update in tree.updates:
            name = self._updated(update.target)
            if name is None:
                continue
            if name in places:
                self._findings.error(
                    "duplicate-assignment",
                    f"'{name}' is assigned twice in one transition",
                    update.target.location,
                    "Keep one of the assignments: all of them happen at once.",
                    RelatedPlace("it is assigned here first", places[name]),
                )
                continue
            places[name] = update.target.location
            expression = self._assigned(update, name, checker)
            if expression is not None:
                updates[name] = Update(name, expression)
        return tuple(updates.values())

    def _updated(self, access: syntax.Access) -> str | None:
        """The variable of this behaviour that an access names: `v` or `OwnComponent.v`."""
        own = self._scope.own
        names = [access.root, *access.steps]
        if access.root is not None and len(names) == 2 and own is not None:
            component = self._scope.components.get(access.root.text)
            if component is not None and component.name == own.name:
                self._findings.bindings.bind(access.root, self._scope.component_places.get(access.root.text))
                names = names[1:]
        name = names[0]
        if own is None or len(names) != 1 or not isinstance(name, syntax.Name) or name.text not in own.variables:
            known = sorted(own.variables)[:_MAXIMUM_SHOWN] if own else []
            wanted = name.text if isinstance(name, syntax.Name) and len(names) == 1 else "this"
            near = self._findings.near(wanted, own.variables) if own else None
            self._findings.error(
                "update-out-of-scope",
                f"'{wanted}' is not a variable of this behaviour" + (f"; did you mean '{near}'?" if near else ""),
                access.location,
                f"Write '{spelled(near)}'."
                if near
                else "Assign a variable of this behaviour" + (f": {', '.join(known)}." if known else "."),
            )
            return None
        self._findings.bindings.bind(name, own.places.get(name.text))
        return name.text

    def _assigned(self, update: syntax.Update, name: str, checker: ExpressionChecker) -> Expression | None:
        type_ = self._scope.own.variables[name] if self._scope.own else None
        if type_ is None:
            checker.infer(update.value)
            return None
        own = self._scope.own
        place = own.declared.get(name) if own else None
        because = RelatedPlace(f"'{name}' is declared as {type_text(type_)} here", place) if place else None
        typed = checker.fitting(update.value, type_, because)
        if typed is None:
            return None
        if may_leave(typed.type, type_):
            self._findings.warning(
                "may-leave-range",
                f"the value can leave the range of '{name}', {type_text(type_)}",
                update.value.location,
                "Widen the range of the variable, or narrow what is assigned.",
            )
        return typed.expression

    # Rules about the whole

    def _check_graph(self, behaviour: Behaviour) -> None:
        """From every reachable state a marked state must be reachable."""
        # Transitions of every state leave from one more place, which every state leads to.
        everywhere = ""
        steps: dict[str, set[str]] = {everywhere: set(), **{state.name: {everywhere} for state in behaviour.states}}
        for transition in behaviour.transitions:
            if transition.target is not None:
                steps[transition.source or everywhere].add(transition.target)
        initial = [state.name for state in behaviour.states if state.is_initial]
        reachable = closure(initial[:1], steps)
        backwards: dict[str, set[str]] = {name: set() for name in steps}
        for source, targets in steps.items():
            for target in targets:
                backwards[target].add(source)
        coreachable = closure([state.name for state in behaviour.states if state.is_marked], backwards)
        for tree in self._tree.states:
            name = tree.name.text
            if name in reachable and name not in coreachable:
                self._findings.error(
                    "marked-unreachable",
                    f"from the state '{name}' no marked state can be reached",
                    tree.name.location,
                    "Mark the states in which the component may rest, or add a way back to one.",
                )

    def _check_determinism(self) -> None:
        """Two transitions on one event in one state."""
        everywhere: dict[str, syntax.CommunicationTransition] = {}
        found: dict[tuple[str | None, str], syntax.CommunicationTransition] = {}
        for state, tree in self._tree.transitions:
            if isinstance(tree, syntax.TauTransition):
                continue
            event = f"{tree.kind} {tree.communication.text}"
            key = (state.name.text if state else None, event)
            other = found.get(key)
            if other is not None:
                self._nondeterministic(tree, other)
            found.setdefault(key, tree)
            if state is None:
                everywhere.setdefault(event, tree)
        for (state_name, event), tree in found.items():
            if state_name is not None and event in everywhere:
                self._nondeterministic(tree, everywhere[event])

    def _nondeterministic(self, tree: syntax.CommunicationTransition, other: syntax.CommunicationTransition) -> None:
        related = RelatedPlace("the other transition stands here", other.location)
        message = f"two transitions react to {tree.kind} of '{tree.communication.text}' in one state"
        if tree.kind in (EventKind.REQUEST, EventKind.CANCEL):
            self._findings.error(
                "nondeterministic-request", message, tree.location, "Keep one of the transitions.", related
            )
        else:
            self._findings.warning(
                "nondeterministic-event",
                f"{message}: synthesis counts both, at run time the state's own comes first",
                tree.location,
                "Keep one of the transitions.",
                related,
            )


def closure(start: list[str], steps: Mapping[str, set[str]]) -> set[str]:
    """Return the states that can be reached."""
    found, frontier = set(start), list(start)
    while frontier:
        for target in steps[frontier.pop()]:
            if target not in found:
                found.add(target)
                frontier.append(target)
    return found


def partial_updates(tree: BehaviourTree, behaviour: Behaviour, findings: Findings) -> None:
    """Note code-only variables that a communication updates in some states but not in others."""
    code_only = {variable.name for variable in behaviour.variables if not variable.is_synthesis}
    updated: dict[tuple[str, str], set[str | None]] = {}
    for transition in behaviour.transitions:
        if is_tau(transition.event):
            continue
        for update in transition.updates:
            if update.variable in code_only:
                updated.setdefault((update.variable, transition.event), set()).add(transition.source)
    places = {variable.name.text: variable.name.location for variable in tree.variables}
    for (variable, event), sources in updated.items():
        if None not in sources and len(sources) < len(behaviour.states):
            # Only as many as are shown are looked for: there may be thousands of states, and of events.
            missing = islice((state.name for state in behaviour.states if state.name not in sources), _MAXIMUM_SHOWN)
            shown = [*missing, *(["..."] if len(behaviour.states) - len(sources) > _MAXIMUM_SHOWN else [])]
            findings.note(
                "partial-update",
                f"'{variable}' is updated on {event} only in some states, not in {', '.join(shown)}: it can be stale",
                places[variable],
                "Write the update in the behaviour itself, outside the states, if it should always happen.",
            )


def _article(text: str) -> str:
    return f"{'an' if text[0] in 'aeiou' else 'a'} {text}"


def _reads_value(tree: object) -> bool:
    """Return True if an expression reads received data."""
    stack = [tree]
    while stack:
        node = stack.pop()
        if isinstance(node, syntax.Access) and node.root is None:
            return True
        if isinstance(node, tuple):
            stack += node
        elif isinstance(node, msgspec.Struct):
            stack += [getattr(node, name) for name in node.__struct_fields__]
    return False
