"""The checked model: the description of a robot with every name bound and every type known.

The supervisor file contains these frozen values, so they are msgspec structures with constrained names. Everything is
listed in *source order*: the order of the robot file's text, with an imported component at its import.
"""

from enum import StrEnum
from typing import Annotated, Literal

import msgspec

from robosc.expressions import Expression, Name, ScopedName, Type, Unary, Value

Identifier = Annotated[str, msgspec.Meta(max_length=255)]
"""The name of a topic, service or action; any text that fits, escaped wherever it is printed."""

MAXIMUM_DEPTH = 100_000
"""Messages that a queue may be asked to keep."""

MAXIMUM_AGE = 86_400.0 * 365
"""Seconds that a sensor may be asked to stay fresh: a year."""

MAXIMUM_VISITS = 50
"""Visits that a mission, and each of its detours, may have; a strategy has a mode for each of them."""

EventName = Annotated[str, msgspec.Meta(pattern=r"^[A-Za-z_][A-Za-z_0-9]*\.[A-Za-z_][A-Za-z_0-9]*\Z", max_length=511)]
"""`<communication>.<kind>` or `<Component>.tau_<n>`."""


class CommunicationKind(StrEnum):
    """The four ways in which a component speaks; direction as the component sees it."""

    INCOMING_MESSAGE = "incoming message"
    OUTGOING_MESSAGE = "outgoing message"
    SERVICE = "service"
    ACTION = "action"


class EventKind(StrEnum):
    """Kind of event on a communication."""

    REQUEST = "request"
    RESPONSE = "response"
    FEEDBACK = "feedback"
    ERROR = "error"
    CANCEL = "cancel"
    RESET = "reset"


EVENT_KINDS: dict[CommunicationKind, tuple[EventKind, ...]] = {
    CommunicationKind.INCOMING_MESSAGE: (EventKind.REQUEST,),
    CommunicationKind.OUTGOING_MESSAGE: (EventKind.RESPONSE,),
    CommunicationKind.SERVICE: (EventKind.REQUEST, EventKind.RESPONSE, EventKind.ERROR, EventKind.RESET),
    CommunicationKind.ACTION: (
        EventKind.REQUEST,
        EventKind.RESPONSE,
        EventKind.FEEDBACK,
        EventKind.ERROR,
        EventKind.CANCEL,
        EventKind.RESET,
    ),
}
"""The events of each kind of communication."""

ISSUED_KINDS = frozenset({EventKind.REQUEST, EventKind.CANCEL, EventKind.RESET})
"""The kinds that an executor issues and a supervisor may disable. (As a layer, cancel is the caller's: see
`to_automata`.)"""


class Deployment(StrEnum):
    """Deployment of a supervisor: it decides itself, or it filters an existing controller."""

    CONTROLLER = "controller"
    LAYER = "layer"


class Property(msgspec.Struct, frozen=True, gc=False):
    """A named part of an object."""

    name: Name
    type: Type


class ObjectDefinition(msgspec.Struct, frozen=True, gc=False):
    """A record type of the robot (`Twist`) or of a library (`Library.Twist`)."""

    name: ScopedName
    properties: tuple[Property, ...]


class EnumRule(msgspec.Struct, frozen=True, gc=False):
    """A rule: the enum has `value` if `condition` (over `Received` data of the source type) is true."""

    condition: Expression
    value: Name


class EnumDefinition(msgspec.Struct, frozen=True, gc=False):
    """Conversion of a received datum to one of finitely many names: the first true rule, else `default`."""

    name: ScopedName
    source: Type
    values: tuple[Name, ...]
    rules: tuple[EnumRule, ...]
    default: Name


class Interface(msgspec.Struct, frozen=True, gc=False):
    """A middleware type: `Twist` from the ROS package `geometry_msgs`."""

    type: Name
    package: Name


Quality = Literal["reliable", "best_effort", "sensor", "latched"]
"""Transport of a message: delivery guaranteed; the newest only; as sensors do; also to those that come later."""


class Communication(msgspec.Struct, frozen=True, gc=False, omit_defaults=True):
    """A message, service or action.

    Attributes:
        name: Its name, unique in the robot.
        component: The component that declares it.
        kind: Kind of communication.
        identifier: Topic, service or action name.
        request: Type of what the robot's controller sends (incoming message, service, action).
        response: Type of what comes back (outgoing message, service, action).
        feedback: Type of an action's feedback.
        interface: The middleware type, if linked.
        quality: Transport of a message, if the model says so; `QUALITIES` and `effective_quality` have the rest.
        depth: Number of messages that are kept for a slow receiver, if the model says so.
        max_age: Seconds after which an outgoing message that was not seen again is stale.
        frame: Frame with which the header of an incoming message, or an action's request, is stamped.
        when: Condition for the requests on a shared identifier that are this one, in a supervision layer.
        is_when_default: True if those are the all-default ones, their header apart.
    """

    name: Name
    component: Name
    kind: CommunicationKind
    identifier: Identifier
    request: Type | None = None
    response: Type | None = None
    feedback: Type | None = None
    interface: Interface | None = None
    quality: Quality | None = None
    depth: Annotated[int, msgspec.Meta(ge=1, le=MAXIMUM_DEPTH)] | None = None
    max_age: Annotated[float, msgspec.Meta(gt=0, le=MAXIMUM_AGE)] | None = None
    frame: Annotated[str, msgspec.Meta(max_length=255)] | None = None
    when: Expression | None = None
    is_when_default: bool = False

    @property
    def has_condition(self) -> bool:
        """True if a supervision layer recognizes it by a condition."""
        return self.when is not None or self.is_when_default

    @property
    def effective_quality(self) -> Quality:
        """Transport in effect: as the model says, else like a sensor if sensor_msgs has its type, else reliable."""
        if self.quality is not None:
            return self.quality
        is_sensor = self.interface is not None and self.interface.package == "sensor_msgs"
        return "sensor" if is_sensor and self.kind is CommunicationKind.OUTGOING_MESSAGE else "reliable"

    @property
    def effective_depth(self) -> int:
        """Number of messages that are kept: as the model says, else 5 for sensors and 10 for others, 1 if latched."""
        if self.depth is not None:
            return self.depth
        return {"sensor": 5, "latched": 1}.get(self.effective_quality, 10)

    def event(self, kind: EventKind) -> str:
        """The event's name, e.g. `move.request`."""
        return f"{self.name}.{kind}"

    @property
    def events(self) -> tuple[str, ...]:
        """Its events, in the order of `EVENT_KINDS`."""
        return tuple(self.event(kind) for kind in EVENT_KINDS[self.kind])

    def received_type(self, kind: EventKind) -> Type | None:
        """Type of the data that an event of `kind` carries to the controller, or None."""
        return {EventKind.RESPONSE: self.response, EventKind.FEEDBACK: self.feedback}.get(kind)


class Variable(msgspec.Struct, frozen=True, gc=False):
    """A variable of a behaviour.

    Attributes:
        name: Its name, unique among the behaviour's states and variables.
        type: Boolean, integer, double, string or enum.
        initial: The value it starts at.
        is_synthesis: True if it takes part in synthesis; else it is code-only.
    """

    name: Name
    type: Type
    initial: Value
    is_synthesis: bool


class State(msgspec.Struct, frozen=True, gc=False):
    """A state of a behaviour: a location of the component's automaton."""

    name: Name
    is_initial: bool
    is_marked: bool


class Update(msgspec.Struct, frozen=True, gc=False):
    """`variable := expression`, reading the state before the event."""

    variable: Name
    expression: Expression


class Transition(msgspec.Struct, frozen=True, gc=False):
    """A transition of a behaviour.

    Attributes:
        source: The state it stands in, or None if it stands in every state.
        event: Event name.
        guard: Condition of a tau transition, or None.
        updates: Assignments, all at once.
        target: State gone to, or None to stay.
    """

    source: Name | None
    event: EventName
    guard: Expression | None
    updates: tuple[Update, ...]
    target: Name | None


class Behaviour(msgspec.Struct, frozen=True, gc=False):
    """The automaton of a component as written."""

    variables: tuple[Variable, ...]
    states: tuple[State, ...]
    transitions: tuple[Transition, ...]

    @property
    def initial(self) -> str:
        """Name of the initial state."""
        return next(state.name for state in self.states if state.is_initial)


class Component(msgspec.Struct, frozen=True, gc=False):
    """A part of the robot; imported ones carry their local name."""

    name: Name
    behaviour: Behaviour | None = None


class RequirementForm(StrEnum):
    """`R needs E` or `E disables R`."""

    NEEDS = "needs"
    DISABLES = "disables"


class Requirement(msgspec.Struct, frozen=True, gc=False):
    """A state-event requirement on the requests of some communications, as written."""

    communications: tuple[Name, ...]
    form: RequirementForm
    expression: Expression

    @property
    def condition(self) -> Expression:
        """Condition that must be true for a request: E, or `not E` for `disables`."""
        return self.expression if self.form is RequirementForm.NEEDS else Unary("not", self.expression)


class Invariant(msgspec.Struct, frozen=True, gc=False):
    """A state invariant: `requirement always expression`, or `requirement never expression`."""

    is_never: bool
    expression: Expression

    @property
    def condition(self) -> Expression:
        """Condition that must be true in every state."""
        return Unary("not", self.expression) if self.is_never else self.expression


class GoalForm(StrEnum):
    """Form of a goal or an assumption, by its words."""

    ALWAYS_EVENTUALLY = "always eventually"
    LEADS_TO = "leads to"
    ONCE = "once"


class Goal(msgspec.Struct, frozen=True, gc=False, omit_defaults=True):
    """A condition that the robot is to reach; it is looked at in stable states.

    Attributes:
        form: Form: it is to hold again and again, after each trigger, or at least once.
        condition: Condition that is to hold.
        trigger: The condition before `leads to`; None in the other forms.
    """

    form: GoalForm
    condition: Expression
    trigger: Expression | None = None

    @property
    def expressions(self) -> tuple[Expression, ...]:
        """Its expressions, in the order of the text."""
        return (self.condition,) if self.trigger is None else (self.trigger, self.condition)


class Assumption(msgspec.Struct, frozen=True, gc=False, omit_defaults=True):
    """A condition that the surroundings of the robot bring about; it is looked at in stable states.

    Attributes:
        form: Form: it holds again and again, or after each trigger; never `ONCE`.
        condition: Condition that holds then.
        trigger: The condition before `leads to`; None in the other form.
        is_allowed: True if the robot itself may keep it from coming true.
    """

    form: GoalForm
    condition: Expression
    trigger: Expression | None = None
    is_allowed: bool = False

    @property
    def expressions(self) -> tuple[Expression, ...]:
        """Its expressions, in the order of the text."""
        return (self.condition,) if self.trigger is None else (self.trigger, self.condition)


class Detour(msgspec.Struct, frozen=True, gc=False):
    """Visits that come before the others of a mission once a condition holds.

    Attributes:
        trigger: Condition that begins the detour, wherever the mission is.
        visits: Conditions that are to hold, one after the other; at least one.
    """

    trigger: Expression
    visits: tuple[Expression, ...]

    @property
    def expressions(self) -> tuple[Expression, ...]:
        """Its expressions, in the order of the text."""
        return (self.trigger, *self.visits)


class Mission(msgspec.Struct, frozen=True, gc=False, omit_defaults=True):
    """Conditions that the robot is to reach one after the other, round after round.

    Attributes:
        name: Name, unique among the missions of a robot.
        visits: Conditions that are to hold, one after the other; at least one, at most `MAXIMUM_VISITS`.
        condition: The condition behind `while`: the mission is asked for as long as it holds. None for always.
        detours: Detours, in source order.
    """

    name: Name
    visits: tuple[Expression, ...]
    condition: Expression | None = None
    detours: tuple[Detour, ...] = ()

    @property
    def expressions(self) -> tuple[Expression, ...]:
        """Its expressions, in the order of the text."""
        first = () if self.condition is None else (self.condition,)
        return (*first, *self.visits, *(part for item in self.detours for part in item.expressions))

    @property
    def all_visits(self) -> tuple[Expression, ...]:
        """Its visits, then those of each detour; a strategy has a mode for each of them."""
        return (*self.visits, *(visit for item in self.detours for visit in item.visits))


class Preference(msgspec.Struct, frozen=True, gc=False):
    """Requests that a strategy chooses rather than others, where both lead to its goals.

    Attributes:
        preferred: Names of the communications whose requests are chosen.
        others: Names of those whose requests come after them.
    """

    preferred: tuple[Name, ...]
    others: tuple[Name, ...]


class ObjectValue(msgspec.Struct, frozen=True, gc=False, tag_field="node", tag="object"):
    """Data given property by property; a missing property keeps the middleware's default."""

    properties: tuple[tuple[Name, "ProvidedValue"], ...]


ProvidedValue = ObjectValue | Expression


class Provide(msgspec.Struct, frozen=True, gc=False):
    """Data for a request: the first statement of a communication whose condition is true."""

    communication: Name
    value: ProvidedValue
    condition: Expression | None


class Bound(msgspec.Struct, frozen=True, gc=False):
    """Bounds of one number of a request.

    Attributes:
        path: Properties that lead to it; nothing for a request that is a number itself.
        low: The lower bound: of the type of the number, as the other is.
        high: The upper bound; never below the lower one.
    """

    path: tuple[Name, ...]
    low: int | float
    high: int | float


class Limit(msgspec.Struct, frozen=True, gc=False):
    """Bounds into which numbers of a request are moved, unless the condition is false."""

    communication: Name
    bounds: tuple[Bound, ...]
    condition: Expression | None


class Model(msgspec.Struct, frozen=True, gc=False, omit_defaults=True):
    """A checked robot.

    Its encoded form has fields for goals, assumptions, missions, preferences and limits only if needed.
    """

    name: Name
    components: tuple[Component, ...]
    communications: tuple[Communication, ...]
    enums: tuple[EnumDefinition, ...]
    objects: tuple[ObjectDefinition, ...]
    requirements: tuple[Requirement, ...]
    provides: tuple[Provide, ...]
    invariants: tuple[Invariant, ...]
    goals: tuple[Goal, ...] = ()
    assumptions: tuple[Assumption, ...] = ()
    missions: tuple[Mission, ...] = ()
    preferences: tuple[Preference, ...] = ()
    limits: tuple[Limit, ...] = ()

    @property
    def has_goals(self) -> bool:
        """True if the robot is to achieve something, so that a controller needs a strategy: a goal or a mission."""
        return bool(self.goals or self.missions)

    def component(self, name: str) -> Component:
        """The component called `name` (KeyError if there is none)."""
        return _named(self.components, name)

    def communication(self, name: str) -> Communication:
        """The communication called `name` (KeyError if there is none)."""
        return _named(self.communications, name)

    def enum(self, name: str) -> EnumDefinition:
        """The enum called `name` (KeyError if there is none)."""
        return _named(self.enums, name)

    def object(self, name: str) -> ObjectDefinition:
        """The object type called `name` (KeyError if there is none)."""
        return _named(self.objects, name)

    def requirements_on(self, communication: str) -> tuple[Requirement, ...]:
        """The requirements on one communication, in source order."""
        return tuple(item for item in self.requirements if communication in item.communications)

    def provides_for(self, communication: str) -> tuple[Provide, ...]:
        """The provide statements of one communication, in source order."""
        return tuple(item for item in self.provides if item.communication == communication)

    def limits_for(self, communication: str) -> tuple[Limit, ...]:
        """The limits of one communication, in source order."""
        return tuple(item for item in self.limits if item.communication == communication)

    @property
    def taus(self) -> tuple[str, ...]:
        """The tau events, in source order."""
        return tuple(
            transition.event
            for component in self.components
            if component.behaviour
            for transition in component.behaviour.transitions
            if is_tau(transition.event)
        )


def is_tau(event: str) -> bool:
    """Return True if an event of the model is a tau event (`<Component>.tau_<n>`)."""
    return event.rpartition(".")[2].startswith("tau_")


def _named[Item: Component | Communication | EnumDefinition | ObjectDefinition](
    items: tuple[Item, ...], name: str
) -> Item:
    for item in items:
        if item.name == name:
            return item
    raise KeyError(name)


__all__ = [
    "EVENT_KINDS",
    "ISSUED_KINDS",
    "Assumption",
    "Behaviour",
    "Bound",
    "Communication",
    "CommunicationKind",
    "Component",
    "Deployment",
    "Detour",
    "EnumDefinition",
    "EnumRule",
    "EventKind",
    "Goal",
    "GoalForm",
    "Interface",
    "Invariant",
    "Limit",
    "Mission",
    "Model",
    "ObjectDefinition",
    "ObjectValue",
    "Preference",
    "Property",
    "Provide",
    "ProvidedValue",
    "Requirement",
    "RequirementForm",
    "State",
    "Transition",
    "Update",
    "Variable",
    "is_tau",
]
