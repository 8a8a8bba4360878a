"""Names in C for all parts of a model, and their C types."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

from robosc.automata.executable import CALLED_KINDS, ExecutableSystem
from robosc.automata.goal_memory import MEMORY
from robosc.automata.plants import PLANT_LOCATIONS, communication_plant_name
from robosc.errors import InternalError
from robosc.execution.interpreter import describe
from robosc.execution.runtime.protocol import Description
from robosc.execution.runtime.settings import default_release_identifiers
from robosc.expressions import (
    ArrayType,
    BooleanType,
    DoubleType,
    EnumType,
    IntegerType,
    NoneType,
    ObjectType,
    StringType,
    Type,
)
from robosc.model.structure import Communication, CommunicationKind, Deployment, EventKind, Model
from robosc.supervisor import Supervisor
from robosc.targets.code.c.naming import CNamer, prefix_for
from robosc.targets.code.c.text import declared

# Names of the engine itself after the prefix.
_ENGINE_NAMES = """
    t ACTION_COUNT AIM_COUNT ASSUMPTION_COUNT COMMUNICATION_COUNT CONJUNCT_COUNT EVENT_COUNT H LIMIT_COUNT
    MISSION_COUNT NO_COMMUNICATIONS NO_EVENT NO_EVENTS NO_NUMBERS NO_SOURCES NO_TOPICS NUMBER_COUNT RECEIVED_COUNT
    REQUEST_COUNT REQUIREMENT_COUNT SENSOR_COUNT SERVICE_COUNT SET_COUNT SILENT_COUNT STALE_COUNT TIMES TOPIC_COUNT
    UNCONTROLLABLE_DATA UNKNOWN_ELEMENT UNKNOWN_INTEGER VISIT_COUNT WHEN_COUNT acting_t approached call_failed
    call_t callbacks_t cancel_refused cancel_t cancelling cancelling_t chosen communication_name communication_t
    counters_t default_settings detour enabled end_t event_name event_t fault fault_t goal_accepted goal_ended
    goal_t init item_t log_t mission mission_t number_name number_t on_unknown_t outcome_t policy_t refusal_t
    request_t restart sensor_t sent_t set_t settings_t source_name source_t standing standing_t start state_t status
    status_t stop tick topic_name topic_t watch
""".split()


# Purposes of functions that are named after an identifier.
_TOPIC_PURPOSES = frozenset({"receive", "request", "recognizes"})


@dataclass
class Layout:
    """Names of one generated unit.

    Attributes:
        supervisor: Supervisor that is generated.
        prefix: Beginning of every global name.
        description: Its static part, as every executor knows it.
        events: Enumerator of each event.
        communications: Enumerator of each communication.
        topics: Enumerator of each identifier of incoming messages.
        received_topics: Enumerator of each identifier of outgoing messages, in source order.
        locations: Member of the state that holds each automaton's location.
        location_names: Enumerator of each location, by automaton and location.
        variables: Member and type of each variable, by component and variable.
        values: Enumerator of each value of an enum.
        converters: Function that makes each enum out of received data.
        properties: Member of each property, by object and property.
        numbers: Enumerator of each number that a layer may move, by communication and path.
        request_members: Member of a request's union for each communication.
        mode: Member of the state for the goal that is approached; empty where there is no strategy.
    """

    supervisor: Supervisor
    prefix: str
    description: Description
    mode: str = ""
    events: dict[str, str] = field(default_factory=dict)
    communications: dict[str, str] = field(default_factory=dict)
    topics: dict[str, str] = field(default_factory=dict)
    received_topics: dict[str, str] = field(default_factory=dict)
    locations: dict[str, str] = field(default_factory=dict)
    location_names: dict[tuple[str, str], str] = field(default_factory=dict)
    variables: dict[tuple[str, str], tuple[str, Type]] = field(default_factory=dict)
    values: dict[tuple[str, str], str] = field(default_factory=dict)
    converters: dict[str, str] = field(default_factory=dict)
    properties: dict[tuple[str, str], str] = field(default_factory=dict)
    numbers: dict[tuple[str, tuple[str, ...]], str] = field(default_factory=dict)
    request_members: dict[str, str] = field(default_factory=dict)
    _namer: CNamer = field(default_factory=CNamer)
    _functions: dict[tuple[str, str], str] = field(default_factory=dict)
    _types: dict[str, str] = field(default_factory=dict)

    @property
    def model(self) -> Model:
        """The model."""
        return self.supervisor.model

    @property
    def is_layer(self) -> bool:
        """True if a supervision layer is generated, not a controller."""
        return self.supervisor.deployment is Deployment.LAYER

    @property
    def upper(self) -> str:
        """Beginning of every enumerator and macro."""
        return self.prefix.upper()

    @property
    def executable(self) -> ExecutableSystem:
        """Executable system of the model."""
        return self.supervisor.executable

    @property
    def requests(self) -> tuple[Communication, ...]:
        """Communications with a request, in source order: their numbers in a decision."""
        return tuple(item for item in self.model.communications if item.kind is not CommunicationKind.OUTGOING_MESSAGE)

    def of_kind(self, kind: CommunicationKind) -> tuple[Communication, ...]:
        """Communications of one kind, in source order."""
        return tuple(item for item in self.model.communications if item.kind is kind)

    @cached_property
    def batches(self) -> Mapping[str, list[Communication]]:
        """The outgoing messages of each identifier that has any, in source order."""
        found: dict[str, list[Communication]] = {}
        for item in self.of_kind(CommunicationKind.OUTGOING_MESSAGE):
            found.setdefault(item.identifier, []).append(item)
        return found

    @property
    def releases(self) -> tuple[str, ...]:
        """Identifiers whose last message keeps acting, unless the settings say otherwise."""
        return default_release_identifiers(self.description)

    def function(self, purpose: str, name: str) -> str:
        """The static or public function for a purpose and an event, communication or identifier."""
        key = (purpose, name)
        if key not in self._functions:
            word = _topic_word(name) if purpose in _TOPIC_PURPOSES else name
            self._functions[key] = self._namer.name(f"{self.prefix}_{purpose}_{word}")
        return self._functions[key]

    def raw(self, type_: Type) -> str:
        """The C type of received data as it comes; an enum comes as what it is made from."""
        match type_:
            case BooleanType():
                return "bool"
            case IntegerType():
                return "int64_t"
            case DoubleType():
                return "double"
            case StringType():
                return "const char *"
            case EnumType(name=name):
                return self.raw(self.model.enum(name).source)
            case ObjectType(name=name):
                return self._type("object", name)
            case ArrayType(element=element):
                return self._type("array", self._word(element))
            case NoneType():
                raise InternalError("none has no C type")
        raise InternalError(f"no C type for {type_!r}")

    def raw_element(self, type_: Type) -> str:
        """The C type of an array's element, which may be unknown even if it is a boolean."""
        return "int8_t" if isinstance(type_, BooleanType) else self.raw(type_)

    def _word(self, type_: Type) -> str:
        match type_:
            case EnumType(name=name):
                return self._word(self.model.enum(name).source)
            case ObjectType(name=name):
                return name
            case ArrayType(element=element):
                return f"array_of_{self._word(element)}"
            case _:
                return {"bool": "boolean", "int64_t": "integer", "double": "double"}.get(self.raw(type_), "string")

    def _type(self, kind: str, word: str) -> str:
        key = f"{kind} {word}"
        if key not in self._types:
            part = {"object": "data", "array": "array_of"}[kind]
            self._types[key] = self._namer.name(f"{self.prefix}_{part}_{word}_t")
        return self._types[key]

    def is_by_pointer(self, type_: Type) -> bool:
        """Return True if received data of a type is handed over by its address."""
        if isinstance(type_, EnumType):
            return self.is_by_pointer(self.model.enum(type_.name).source)
        return isinstance(type_, ObjectType | ArrayType)

    def parameter(self, type_: Type, name: str) -> str:
        """The declaration of a parameter that takes received data."""
        raw = self.raw(type_)
        if self.is_by_pointer(type_):
            return f"const {raw} *{name}"
        return declared(raw, name)

    def source(self, type_: Type) -> Type:
        """Return the type as which received data of a type comes: an enum's source, else the type itself."""
        return self.model.enum(type_.name).source if isinstance(type_, EnumType) else type_


def width(count: int) -> str:
    """The smallest unsigned type for numbers below `count`."""
    return "uint8_t" if count <= 2**8 else "uint16_t" if count <= 2**16 else "uint32_t"


def make_layout(supervisor: Supervisor, prefix: str | None = None) -> Layout:
    """Choose all names, in source order, so that the same supervisor gives the same names."""
    model = supervisor.model
    layout = Layout(supervisor, prefix or prefix_for(model.name), describe(supervisor))
    engine = {f"{start}_{name}" for start in (layout.prefix, layout.upper) for name in _ENGINE_NAMES}
    layout._namer = CNamer(frozenset(engine))
    name, upper = layout._namer.name, layout.upper
    for event in supervisor.executable.events:
        layout.events[event] = name(f"{upper}_EVENT_{event.replace('.', '_')}")
    for item in model.communications:
        layout.communications[item.name] = name(f"{upper}_COMMUNICATION_{item.name}")
        if item.kind is CommunicationKind.INCOMING_MESSAGE and item.identifier not in layout.topics:
            layout.topics[item.identifier] = name(f"{upper}_TOPIC_{_topic_word(item.identifier)}")
        if item.kind is CommunicationKind.OUTGOING_MESSAGE and item.identifier not in layout.received_topics:
            layout.received_topics[item.identifier] = name(f"{upper}_SOURCE_{_topic_word(item.identifier)}")
    for enum in model.enums:
        for value in enum.values:
            layout.values[enum.name, value] = name(f"{upper}_VALUE_{enum.name}_{value}")
        layout.converters[enum.name] = name(f"{layout.prefix}_convert_{enum.name}")
    _name_state(layout)
    for limit in model.limits:
        for bound in limit.bounds:
            key = (limit.communication, bound.path)
            if key not in layout.numbers:
                layout.numbers[key] = name("_".join((upper, "NUMBER", limit.communication, *bound.path)))
    requests = CNamer(frozenset({"nothing"}))
    layout.request_members = {item.name: requests.member(item.name) for item in layout.requests}
    for item_ in model.objects:
        members = CNamer()
        for part in item_.properties:
            layout.properties[item_.name, part.name] = members.member(part.name)
    return layout


def _topic_word(identifier: str) -> str:
    return "".join(char if char.isascii() and char.isalnum() else "_" for char in identifier).strip("_") or "topic"


def _name_state(layout: Layout) -> None:
    members = CNamer()
    name = layout._namer.name
    for component, behaviour in layout.executable.behaviours:
        layout.locations[component] = members.name(f"at_{component}")
        for state in behaviour.states:
            layout.location_names[component, state.name] = name(f"{layout.upper}_STATE_{component}_{state.name}")
        for variable in behaviour.variables:
            member = members.name(f"v_{component}_{variable.name}")
            layout.variables[component, variable.name] = (member, variable.type)
    for item in layout.model.communications:
        if item.kind in CALLED_KINDS:
            plant = communication_plant_name(item)
            layout.locations[plant] = members.name(f"at_{item.name}")
            for location in PLANT_LOCATIONS[item.kind]:
                layout.location_names[plant, location] = name(f"{layout.upper}_AT_{item.name}_{location}")
    if layout.supervisor.strategy is not None:
        for place in layout.executable.obligations.places:
            member = members.name(place.name.replace(" ", "_"))
            layout.variables[MEMORY, place.name] = (member, BooleanType())
        layout.mode = members.name("mode")


def sharing(model: Model, kind: CommunicationKind, identifier: str) -> tuple[Communication, ...]:
    """Return the communications that a request on an identifier may be in a supervision layer.

    They go up to the first that needs no condition.
    """
    found = []
    for item in model.communications:
        if item.kind is kind and item.identifier == identifier:
            found.append(item)
            if not item.has_condition:
                break
    return tuple(found)


def groups(model: Model, kind: CommunicationKind) -> tuple[tuple[Communication, ...], ...]:
    """The communications of each identifier of a kind that a request there may be."""
    identifiers = dict.fromkeys(item.identifier for item in model.communications if item.kind is kind)
    return tuple(sharing(model, kind, identifier) for identifier in identifiers)


def read_by_layer(model: Model, group: tuple[Communication, ...]) -> tuple[Communication, ...]:
    """Those of a group whose data a layer looks at: to recognize them, or to move their numbers."""
    return tuple(item for item in group if item.when is not None or model.limits_for(item.name))


def request_data(item: Communication) -> Type | None:
    """Type of the data that a request carries, which `when` and limits read; None without data."""
    return None if isinstance(item.request, NoneType) else item.request


def data_that_comes(layout: Layout) -> tuple[Type, ...]:
    """The types of all data that is handed over, in the order of the events."""
    model = layout.model
    found = [event.received for event in layout.executable.events.values() if not event.is_issued]
    if layout.is_layer:
        kinds = (CommunicationKind.INCOMING_MESSAGE, CommunicationKind.SERVICE, CommunicationKind.ACTION)
        found += [
            request_data(item)
            for kind in kinds
            for group in groups(model, kind)
            for item in read_by_layer(model, group)
        ]
    return tuple(type_ for type_ in found if type_ is not None)


def event_data(model: Model, event: str) -> Type | None:
    """Type of the data that an event of a communication carries to the controller, if any."""
    name, _, kind = event.rpartition(".")
    type_ = model.communication(name).received_type(EventKind(kind))
    return None if isinstance(type_, NoneType) else type_
