"""Check that a supervisor from outside is consistent.

Decoding checks shapes, sizes and identifiers. This module checks references between the parts, so that no later stage
meets a name, type or event that does not exist. The verifier, not this module, checks that the supervisor is *correct*
for a model.
"""

import re
from collections.abc import Iterable, Iterator, Mapping, Set
from contextlib import contextmanager
from math import isfinite

import msgspec
from msgspec.structs import replace

from robosc.automata.structure import System
from robosc.errors import InvalidExpressionError, InvalidSupervisorError
from robosc.expressions import (
    ArrayType,
    BooleanType,
    DoubleType,
    EnumType,
    Expression,
    IntegerType,
    NoneType,
    ObjectType,
    Received,
    StateTest,
    Type,
    VariableRead,
    is_finite,
    leaves,
    type_text,
)
from robosc.expressions.inference import Scope, has_type, is_assignable
from robosc.model.preferences import contradiction
from robosc.model.structure import (
    MAXIMUM_VISITS,
    Assumption,
    Behaviour,
    Communication,
    CommunicationKind,
    Component,
    Deployment,
    EnumDefinition,
    EventKind,
    Goal,
    GoalForm,
    Limit,
    Mission,
    Model,
    ObjectDefinition,
    ObjectValue,
    Provide,
    ProvidedValue,
    Transition,
    Update,
    Variable,
    is_tau,
)
from robosc.source import visible
from robosc.supervisor.diagram import Domains, diagram_domains
from robosc.supervisor.diagram import validate as validate_diagram
from robosc.supervisor.structure import AddedCondition, Certificate, DecisionDiagram, Supervisor

_TAU = re.compile(r"tau_[1-9][0-9]{0,8}\Z")
_COUNT = re.compile(r"[1-9][0-9]{0,3999}\Z|0\Z")
_MAXIMUM_TEXT = 1000

_DATA = {
    CommunicationKind.INCOMING_MESSAGE: (True, False, False),
    CommunicationKind.OUTGOING_MESSAGE: (False, True, False),
    CommunicationKind.SERVICE: (True, True, False),
    CommunicationKind.ACTION: (True, True, True),
}
"""Flags for request, response and feedback: True if it carries data."""


class _Names(msgspec.Struct, frozen=True):
    """Items that are looked up again and again, by name.

    Attributes:
        scope: Names that expressions may use.
        communications: Every communication.
        sources: The type that each enum is made from.
    """

    scope: Scope
    communications: Mapping[str, Communication]
    sources: Mapping[str, Type]


def validate(supervisor: Supervisor) -> None:
    """Do nothing if every part of a supervisor fits every other.

    Args:
        supervisor: Decoded with its types' constraints; expressions at most some hundreds of operators deep.

    Raises:
        InvalidSupervisorError: Two parts do not fit; one sentence that says where.
    """
    model = supervisor.model
    with _at("the supervisor file is inconsistent"):
        names = _Names(
            _validated_types(model),
            {communication.name: communication for communication in model.communications},
            {enum.name: enum.source for enum in model.enums},
        )
        _validate_communications(model, names)
        for component in model.components:
            with _at(f"component {component.name}"):
                _validate_component(component, names)
        _validate_requirements(model, names)
        _validate_goals(model, names)
        _validate_missions(model, names)
        for number, provide in enumerate(model.provides, start=1):
            with _at(f"provide statement {number} (for {provide.communication})"):
                _validate_provide(provide, names)
        for number, limit in enumerate(model.limits, start=1):
            with _at(f"limit {number} (of {limit.communication})"):
                _validate_limit(limit, names)
        _validate_synthesis_variables(model, names)
        _validate_certificate(supervisor.certificate, has_modules=bool(supervisor.modules))
        _validate_modules(supervisor)
        if supervisor.certificate.deployment is not supervisor.deployment:
            raise InvalidSupervisorError("the certificate is for another deployment than the supervisor")
        if supervisor.added:
            validate_added(supervisor.added, supervisor.executable.automata)
        _validate_strategy(supervisor)


@contextmanager
def _at(place: str) -> Iterator[None]:
    """Say where an inconsistency is that is found inside."""
    try:
        yield
    except (InvalidSupervisorError, InvalidExpressionError) as error:
        raise InvalidSupervisorError(f"{place}: {visible(str(error))}") from None


def _require_unique(names: Iterable[str], what: str) -> None:
    """Names differ in more than case."""
    seen: set[str] = set()
    for name in names:
        if name.lower() in seen:
            raise InvalidSupervisorError(f"two {what} are called {name}")
        seen.add(name.lower())


def _validated_types(model: Model) -> Scope:
    """The names that expressions may use; definitions of types are consistent."""
    _require_unique([*(enum.name for enum in model.enums), *(object_.name for object_ in model.objects)], "data types")
    _require_unique((component.name for component in model.components), "components")
    behaviours = [(component.name, component.behaviour) for component in model.components if component.behaviour]
    scope = Scope(
        variables={(name, item.name): item.type for name, behaviour in behaviours for item in behaviour.variables},
        states=frozenset((name, state.name) for name, behaviour in behaviours for state in behaviour.states),
        enums={enum.name: EnumType(enum.name, enum.values) for enum in model.enums},
        enum_values={enum.name: frozenset(enum.values) for enum in model.enums},
        objects={object_.name: {item.name: item.type for item in object_.properties} for object_ in model.objects},
    )
    for object_ in model.objects:
        with _at(f"object type {object_.name}"):
            _validate_object(object_, scope)
    _require_no_cycle(scope)
    for enum in model.enums:
        with _at(f"enum {enum.name}"):
            _validate_enum(enum, scope)
    return scope


def _validate_type(type_: Type, scope: Scope) -> None:
    """A type is as its definition says, and a range is not empty."""
    while isinstance(type_, ArrayType):
        type_ = type_.element
    match type_:
        case IntegerType(low=low, high=high):
            if (low is None) != (high is None) or (low is not None and high is not None and low > high):
                raise InvalidSupervisorError("an integer has no range or one with both ends, the lower one first")
        case EnumType(name=name):
            if scope.enums.get(name) != type_:
                raise InvalidSupervisorError(f"there is no enum {name} with those values")
        case ObjectType(name=name):
            if name not in scope.objects:
                raise InvalidSupervisorError(f"there is no object type {name}")


def _validate_object(object_: ObjectDefinition, scope: Scope) -> None:
    _require_unique((item.name for item in object_.properties), "properties")
    for item in object_.properties:
        with _at(f"property {item.name}"):
            _validate_type(item.type, scope)


def _require_no_cycle(scope: Scope) -> None:
    """No object holds itself, however deep: types are taken away once all that they hold are."""
    holds = {name: _objects_in(properties.values()) for name, properties in scope.objects.items()}
    held_by: dict[str, list[str]] = {name: [] for name in holds}
    for name, inner in holds.items():
        for other in inner:
            held_by[other].append(name)
    left = {name: len(inner) for name, inner in holds.items()}
    free = [name for name, count in left.items() if count == 0]
    while free:
        name = free.pop()
        del left[name]
        for holder in held_by[name]:
            left[holder] -= 1
            if left[holder] == 0:
                free.append(holder)
    if left:
        # Each name that is left holds another one that is left, so the walk comes back at last.
        name, passed = min(left), set[str]()
        while name not in passed:
            passed.add(name)
            name = min(other for other in holds[name] if other in left)
        raise InvalidSupervisorError(f"object type {name} holds itself")


def _objects_in(types: Iterable[Type]) -> set[str]:
    """Names of the object types among some types, those in arrays included."""
    names = set()
    for type_ in types:
        while isinstance(type_, ArrayType):
            type_ = type_.element
        if isinstance(type_, ObjectType):
            names.add(type_.name)
    return names


def _validate_enum(enum: EnumDefinition, scope: Scope) -> None:
    _validate_type(enum.source, scope)
    if isinstance(enum.source, EnumType | ArrayType):
        raise InvalidSupervisorError(f"an enum cannot be made from {type_text(enum.source)}")
    _require_unique(enum.values, "values")
    if {rule.value for rule in enum.rules} | {enum.default} != set(enum.values):
        raise InvalidSupervisorError("its values are not those of its rules and its default")
    for number, rule in enumerate(enum.rules, start=1):
        with _at(f"rule {number}"):
            if any(not isinstance(leaf, Received) and _is_read(leaf) for leaf in leaves(rule.condition)):
                raise InvalidSupervisorError("a rule reads received data only")
            _require_boolean(rule.condition, scope, enum.source)


def _is_read(leaf: Expression) -> bool:
    """Return True if a leaf reads the state of a component."""
    return isinstance(leaf, VariableRead | StateTest)


def _require_boolean(condition: Expression, scope: Scope, received: Type | None = None) -> None:
    type_ = scope.infer(condition, received)
    if not isinstance(type_, BooleanType):
        raise InvalidSupervisorError(f"a condition is {type_text(type_)}, not boolean")


def _validate_communications(model: Model, names: _Names) -> None:
    _require_unique((communication.name for communication in model.communications), "communications")
    components = {component.name for component in model.components}
    for communication in model.communications:
        with _at(f"communication {communication.name}"):
            if communication.component not in components:
                raise InvalidSupervisorError(f"there is no component {communication.component}")
            _validate_data(communication, names)
            _validate_options(communication, names)


_REQUESTED_KINDS = (CommunicationKind.INCOMING_MESSAGE, CommunicationKind.SERVICE, CommunicationKind.ACTION)

_OPTIONS: dict[str, tuple[CommunicationKind, ...]] = {
    "quality": (CommunicationKind.INCOMING_MESSAGE, CommunicationKind.OUTGOING_MESSAGE),
    "depth": (CommunicationKind.INCOMING_MESSAGE, CommunicationKind.OUTGOING_MESSAGE),
    "max_age": (CommunicationKind.OUTGOING_MESSAGE,),
    "frame": (CommunicationKind.INCOMING_MESSAGE, CommunicationKind.ACTION),
    "when": _REQUESTED_KINDS,
}
"""The kinds of communication that each option suits."""


def _validate_options(communication: Communication, names: _Names) -> None:
    for option, kinds in _OPTIONS.items():
        if getattr(communication, option) is not None and communication.kind not in kinds:
            raise InvalidSupervisorError(f"{option} does not suit its kind")
    if communication.frame is not None and communication.interface is None:
        raise InvalidSupervisorError("what is stamped needs a middleware type")
    if communication.is_when_default and (communication.when is not None or communication.request is None):
        raise InvalidSupervisorError("it has another condition, or no request, beside the all-default message")
    if communication.when is not None:
        without_state = replace(names.scope, variables={}, states=frozenset())
        if not isinstance(without_state.infer(communication.when, communication.request), BooleanType):
            raise InvalidSupervisorError("its condition is not boolean")


def _validate_data(communication: Communication, names: _Names) -> None:
    """The types of what is sent and received, and the middleware type where one is needed."""
    types = (communication.request, communication.response, communication.feedback)
    if tuple(type_ is not None for type_ in types) != _DATA[communication.kind]:
        raise InvalidSupervisorError(f"its data is not that of a kind of {communication.kind}")
    for type_ in types:
        if type_ is None:
            continue
        _validate_type(type_, names.scope)
        if isinstance(type_, ArrayType):
            raise InvalidSupervisorError("an array stands outside an object")
        source = names.sources[type_.name] if isinstance(type_, EnumType) else type_
        if isinstance(source, ObjectType) and communication.interface is None:
            raise InvalidSupervisorError("an object needs a middleware type")
    if len(communication.events) > 1 and communication.interface is None:
        raise InvalidSupervisorError(
            f"{'an action' if communication.feedback else 'a service'} needs a middleware type"
        )


def _validate_component(component: Component, names: _Names) -> None:
    behaviour = component.behaviour
    if behaviour is None:
        return
    states = [state.name for state in behaviour.states]
    _require_unique([*states, *(variable.name for variable in behaviour.variables)], "states or variables")
    if sum(state.is_initial for state in behaviour.states) != 1:
        raise InvalidSupervisorError("it has not exactly one initial state")
    for variable in behaviour.variables:
        with _at(f"variable {variable.name}"):
            _validate_variable(variable, names.scope)
    known_states = frozenset(states)
    for number, transition in enumerate(behaviour.transitions, start=1):
        with _at(f"transition {number} (on {transition.event})"):
            _validate_transition(transition, component.name, known_states, names)
    _require_unique((item.event for item in behaviour.transitions if is_tau(item.event)), "tau transitions")
    _require_deterministic(behaviour)


def _validate_variable(variable: Variable, scope: Scope) -> None:
    _validate_type(variable.type, scope)
    if isinstance(variable.type, NoneType | ObjectType | ArrayType):
        raise InvalidSupervisorError(f"a variable cannot be {type_text(variable.type)}")
    if not has_type(variable.initial, variable.type):
        raise InvalidSupervisorError(f"its initial value is not {type_text(variable.type)}")
    if variable.is_synthesis and not is_finite(variable.type):
        raise InvalidSupervisorError(f"{type_text(variable.type)} is not finite, so it cannot take part in synthesis")


def _validate_transition(transition: Transition, component: str, states: Set[str], names: _Names) -> None:
    for name in (transition.source, transition.target):
        if name is not None and name not in states:
            raise InvalidSupervisorError(f"there is no state {name}")
    if is_tau(transition.event):
        _validate_tau(transition, component, names.scope)
        return
    received = _received(transition, names)
    if transition.guard is not None:
        raise InvalidSupervisorError("only a tau transition has a guard")
    _require_unique((update.variable for update in transition.updates), "updated variables")
    for update in transition.updates:
        with _at(f"update of {update.variable}"):
            _validate_update(update, component, received, names.scope)


def _validate_tau(transition: Transition, component: str, scope: Scope) -> None:
    owner, _, number = transition.event.partition(".")
    if owner != component or not _TAU.match(number):
        raise InvalidSupervisorError(f"no tau event of {component} is called so")
    if transition.updates:
        raise InvalidSupervisorError("a tau transition updates nothing")
    if transition.guard is not None:
        _require_boolean(transition.guard, scope)


def _received(transition: Transition, names: _Names) -> Type | None:
    """Return the type of the data that the event of a transition carries to the controller."""
    name, _, kind = transition.event.partition(".")
    communication = names.communications.get(name)
    if communication is None or transition.event not in communication.events or kind == EventKind.RESET:
        raise InvalidSupervisorError("there is no such event for a behaviour")
    if transition.updates and communication.kind is CommunicationKind.INCOMING_MESSAGE:
        raise InvalidSupervisorError("the request of an incoming message updates nothing")
    return communication.received_type(EventKind(kind))


def _validate_update(update: Update, component: str, received: Type | None, scope: Scope) -> None:
    target = scope.variables.get((component, update.variable))
    if target is None:
        raise InvalidSupervisorError("there is no such variable")
    type_ = scope.infer(update.expression, received)
    if not is_assignable(type_, target):
        raise InvalidSupervisorError(f"{type_text(type_)} does not fit {type_text(target)}")


def _require_deterministic(behaviour: Behaviour) -> None:
    """At most one transition on a request or cancel applies in a state."""
    sources: dict[str, set[str | None]] = {}
    for transition in behaviour.transitions:
        if transition.event.rpartition(".")[2] not in (EventKind.REQUEST, EventKind.CANCEL):
            continue
        taken = sources.setdefault(transition.event, set())
        if transition.source in taken or (taken and (transition.source is None or None in taken)):
            raise InvalidSupervisorError(f"two transitions on {transition.event} apply in one state")
        taken.add(transition.source)


def _request_type(name: str, names: _Names) -> Type:
    """Return the type of the data sent with the request of the communication called `name`."""
    communication = names.communications.get(name)
    if communication is None:
        raise InvalidSupervisorError(f"there is no communication {name}")
    if communication.request is None:
        raise InvalidSupervisorError(f"{name} has no request")
    return communication.request


def _validate_requirements(model: Model, names: _Names) -> None:
    for number, requirement in enumerate(model.requirements, start=1):
        with _at(f"requirement {number}"):
            for name in requirement.communications:
                _request_type(name, names)
            _require_boolean(requirement.expression, names.scope)
    for number, invariant in enumerate(model.invariants, start=1):
        with _at(f"invariant {number}"):
            _require_boolean(invariant.expression, names.scope)


def _validate_goals(model: Model, names: _Names) -> None:
    for number, goal in enumerate(model.goals, start=1):
        with _at(f"goal {number}"):
            _validate_aim(goal, names)
    for number, assumption in enumerate(model.assumptions, start=1):
        with _at(f"assumption {number}"):
            if assumption.form is GoalForm.ONCE:
                raise InvalidSupervisorError("an assumption has not the form 'once'")
            _validate_aim(assumption, names)


def _validate_aim(aim: Goal | Assumption, names: _Names) -> None:
    """A trigger stands in the one form that has it; conditions are boolean, and read no received data."""
    if (aim.trigger is not None) != (aim.form is GoalForm.LEADS_TO):
        raise InvalidSupervisorError("the form 'leads to' has a trigger, and no other form has one")
    for expression in aim.expressions:
        _require_boolean(expression, names.scope)


def _validate_missions(model: Model, names: _Names) -> None:
    """Missions have names of their own and visits; preferences are about requests, and do not contradict each other."""
    _require_unique((mission.name for mission in model.missions), "missions")
    for mission in model.missions:
        with _at(f"mission {mission.name}"):
            if not mission.visits or not all(detour.visits for detour in mission.detours):
                raise InvalidSupervisorError("a mission and each of its detours need a visit")
            if max(map(len, (mission.visits, *(detour.visits for detour in mission.detours)))) > MAXIMUM_VISITS:
                raise InvalidSupervisorError(f"a mission and each of its detours have at most {MAXIMUM_VISITS} visits")
            for expression in mission.expressions:
                _require_boolean(expression, names.scope)
    for number, preference in enumerate(model.preferences, start=1):
        with _at(f"preference {number}"):
            for name in (*preference.preferred, *preference.others):
                _request_type(name, names)
    if contradiction(model.preferences):
        raise InvalidSupervisorError("the preferences contradict each other")


def _validate_provide(provide: Provide, names: _Names) -> None:
    _validate_provided(provide.value, _request_type(provide.communication, names), names)
    if provide.condition is not None:
        _require_boolean(provide.condition, names.scope)


def _validate_provided(value: ProvidedValue, type_: Type, names: _Names) -> None:
    """Data fits a type, property by property; for an enum, the type that it is made from is sent."""
    wanted = names.sources[type_.name] if isinstance(type_, EnumType) else type_
    if not isinstance(value, ObjectValue):
        given = names.scope.infer(value)
        if not is_assignable(given, wanted):
            raise InvalidSupervisorError(f"{type_text(given)} does not fit {type_text(wanted)}")
        return
    if not isinstance(wanted, ObjectType):
        raise InvalidSupervisorError(f"an object does not fit {type_text(wanted)}")
    properties = names.scope.objects[wanted.name]
    _require_unique((name for name, _ in value.properties), "properties")
    for name, inner in value.properties:
        with _at(f"property {name}"):
            if name not in properties:
                raise InvalidSupervisorError(f"{wanted.name} has no such property")
            _validate_provided(inner, properties[name], names)


def _validate_limit(limit: Limit, names: _Names) -> None:
    if limit.condition is not None:
        _require_boolean(limit.condition, names.scope)
    if len({bound.path for bound in limit.bounds}) < len(limit.bounds):
        raise InvalidSupervisorError("two bounds are of one number")
    for bound in limit.bounds:
        type_ = _request_type(limit.communication, names)
        for name in bound.path:
            properties = names.scope.objects[type_.name] if isinstance(type_, ObjectType) else {}
            if name not in properties:
                raise InvalidSupervisorError(f"there is no property {name}")
            type_ = properties[name]
        wanted = {DoubleType: float, IntegerType: int}.get(type(type_))
        if wanted is None or {type(bound.low), type(bound.high)} != {wanted}:
            raise InvalidSupervisorError(f"bounds of {type_text(type_)} are no numbers of its kind")
        if not (isfinite(bound.low) and isfinite(bound.high) and bound.low <= bound.high):
            raise InvalidSupervisorError("no number is within its bounds")


def _validate_synthesis_variables(model: Model, names: _Names) -> None:
    """Check that all that synthesis reads is in synthesis and finite.

    That is all that guards, requirements, goals, assumptions, missions, data conditions and synthesis variables read.
    """
    variables = {
        (component.name, variable.name): variable
        for component in model.components
        if component.behaviour
        for variable in component.behaviour.variables
    }
    for expression, received in _synthesis_expressions(model, variables, names):
        for leaf in leaves(expression):
            if isinstance(leaf, VariableRead) and not variables[leaf.component, leaf.variable].is_synthesis:
                raise InvalidSupervisorError(
                    f"{leaf.component}.{leaf.variable} is read in synthesis but does not take part in it"
                )
            if isinstance(leaf, Received) and not is_finite(names.scope.received_type(leaf, received)):
                raise InvalidSupervisorError("a synthesis variable is updated from received data that is not finite")


def _synthesis_expressions(
    model: Model, variables: Mapping[tuple[str, str], Variable], names: _Names
) -> Iterator[tuple[Expression, Type | None]]:
    """Every expression that synthesis works on, with the type of the received data it may read."""
    for requirement in model.requirements:
        yield requirement.expression, None
    for invariant in model.invariants:
        yield invariant.expression, None
    aims: tuple[Goal | Assumption | Mission, ...] = (*model.goals, *model.assumptions, *model.missions)
    for aim in aims:
        yield from ((expression, None) for expression in aim.expressions)
    for provide in model.provides:
        if provide.condition is not None:
            yield provide.condition, None
    for component in model.components:
        for transition in component.behaviour.transitions if component.behaviour else ():
            if transition.guard is not None:
                yield transition.guard, None
            for update in transition.updates:
                if variables[component.name, update.variable].is_synthesis:
                    yield update.expression, _received(transition, names)


def _validate_modules(supervisor: Supervisor) -> None:
    if not supervisor.modules:
        return
    model = supervisor.model
    names = {item.name for item in supervisor.executable.automata.automata}
    for module in supervisor.modules:
        if (
            not names.issuperset(module.automata)
            or max(module.requirements, default=-1) >= len(model.requirements)
            or max(module.invariants, default=-1) >= len(model.invariants)
        ):
            raise InvalidSupervisorError("a module has automata or requirements that the model does not have")
        if not _COUNT.match(module.states) or module.states == "0":
            raise InvalidSupervisorError("the number of states of a module is not a positive decimal number")


def _validate_certificate(certificate: Certificate, *, has_modules: bool) -> None:
    texts = [("method", certificate.method), ("engine version", certificate.engine_version)]
    if certificate.controller is not None:
        texts.append(("method of the controller's properties", certificate.controller.method))
    for name, text in texts:
        if len(text) > _MAXIMUM_TEXT or not text.isprintable():
            raise InvalidSupervisorError(
                f"certificate: the {name} is not one line of at most {_MAXIMUM_TEXT} characters"
            )
    if not _COUNT.match(certificate.states) or (certificate.states == "0" and not has_modules):
        raise InvalidSupervisorError("certificate: the number of states is not a positive decimal number")
    if certificate.transitions is not None and not _COUNT.match(certificate.transitions):
        raise InvalidSupervisorError("certificate: the number of transitions is not a decimal number")


def _validate_strategy(supervisor: Supervisor) -> None:
    """Check that a strategy is there exactly where a controller has goals, and that it chooses among requests."""
    strategy, model = supervisor.strategy, supervisor.model
    is_needed = model.has_goals and supervisor.deployment is Deployment.CONTROLLER
    if (strategy is not None) is not is_needed:
        raise InvalidSupervisorError(
            "a strategy belongs to a controller with goals or missions, and to no other supervisor"
        )
    if (supervisor.certificate.goals is not None) is not is_needed:
        raise InvalidSupervisorError("the certificate speaks of goals exactly where there is a strategy")
    if strategy is None:
        return
    if len(strategy.modes) != len(model.goals) + sum(len(mission.all_visits) for mission in model.missions):
        raise InvalidSupervisorError("the strategy has not one mode for each goal and each visit of a mission")
    requests = set(supervisor.executable.requests)
    domains = diagram_domains(supervisor.executable.remembering_automata)
    for number, mode in enumerate(strategy.modes, start=1):
        seen: set[tuple[str, bool]] = set()
        for item, before in zip(mode, (None, *mode), strict=False):
            with _at(f"mode {number} of the strategy"):
                if item.event not in requests:
                    raise InvalidSupervisorError(f"there is no request {item.event[:80]!a}")
                if before is not None and before.is_meanwhile and not item.is_meanwhile:
                    raise InvalidSupervisorError("what is requested meanwhile, for other goals, stands last")
                if (item.event, item.is_meanwhile) in seen:
                    raise InvalidSupervisorError(f"{item.event} stands twice")
                seen.add((item.event, item.is_meanwhile))
                validate_condition(item.condition, domains)


def validate_added(added: Iterable[AddedCondition], system: System) -> None:
    """Do nothing if conditions are added to controllable events, each once, by diagrams over what there is.

    Raises:
        InvalidSupervisorError: They are not.
    """
    controllable = {event.name for event in system.events if event.is_controllable}
    domains = diagram_domains(system)
    seen: set[str] = set()
    for item in added:
        # An event that there is not may have any text as its name.
        with _at(f"condition added to {item.event if item.event in controllable else ascii(item.event[:80])}"):
            if item.event not in controllable:
                raise InvalidSupervisorError("there is no such controllable event")
            if item.event in seen:
                raise InvalidSupervisorError("it stands twice")
            seen.add(item.event)
            validate_condition(item.condition, domains)


def validate_condition(condition: DecisionDiagram, domains: Domains) -> None:
    """Do nothing if a diagram is one over what there is; raises InvalidSupervisorError."""
    try:
        validate_diagram(condition, domains)
    except ValueError as error:
        raise InvalidSupervisorError(visible(str(error))) from None
