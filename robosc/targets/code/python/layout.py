"""Names of everything of a model in the generated class."""

from dataclasses import dataclass

from robosc.automata.executable import CALLED_KINDS, ExecutableSystem
from robosc.automata.plants import communication_plant_name
from robosc.expressions import Type
from robosc.model.received import converted_paths
from robosc.model.structure import EVENT_KINDS, CommunicationKind, EventKind, Model
from robosc.supervisor import Supervisor
from robosc.targets.code.python.naming import PythonNamer

PROTOCOL_NAMES = (
    "changed_requests",
    "changes",
    "choose",
    "conjuncts",
    "description",
    "enabled",
    "enabled_requests",
    "enabled_silent",
    "limits",
    "location",
    "matches",
    "mode",
    "observe",
    "provide",
    "read",
    "recall",
    "receive",
    "remembered",
    "requirements",
    "restart",
    "signature",
    "situation",
    "state",
    "step",
)
"""The members of `StrategicSystem`."""


@dataclass(frozen=True, slots=True)
class Layout:
    """Names of attributes, methods and functions.

    Attributes:
        supervisor: Supervisor that is generated.
        locations: Attribute of each automaton's location: components by name, `service s`, `action a`.
        variables: Attribute and type of each variable, by component and variable.
        methods: Method by (purpose, event or communication); purposes are `allow`, `read`, `step`,
            `provide`, `requirements`, `conjuncts`, `matches` and `limits` where there are any; and `receive` with an
            identifier.
        converters: Function that makes each enum out of received data.
        memory: Attribute of each place of the memory of goals, by its name.
    """

    supervisor: Supervisor
    locations: dict[str, str]
    variables: dict[tuple[str, str], tuple[str, Type]]
    methods: dict[tuple[str, str], str]
    converters: dict[str, str]
    memory: dict[str, str]

    @property
    def model(self) -> Model:
        """The model."""
        return self.supervisor.model

    def named(self, purpose: str) -> list[str]:
        """Events, communications or identifiers that have a method for a purpose."""
        return [subject for found, subject in self.methods if found == purpose]

    @property
    def executable(self) -> ExecutableSystem:
        """Executable system of the model."""
        return self.supervisor.executable


def make_layout(supervisor: Supervisor) -> Layout:
    """Choose all names, in source order, so that the same supervisor gives the same names."""
    model = supervisor.model
    members = PythonNamer(PROTOCOL_NAMES)
    locations, variables = {}, {}
    for component in model.components:
        if component.behaviour is None:
            continue
        locations[component.name] = members.name(f"{component.name}__state")
        for variable in component.behaviour.variables:
            attribute = members.name(f"{component.name}__{variable.name}")
            variables[component.name, variable.name] = (attribute, variable.type)
    for item in model.communications:
        if item.kind in CALLED_KINDS:
            locations[communication_plant_name(item)] = members.name(f"{item.name}__location")
    methods, converters = _method_names(supervisor, members), _converter_names(model)
    return Layout(supervisor, locations, variables, methods, converters, _memory_names(supervisor, members))


def _memory_names(supervisor: Supervisor, members: PythonNamer) -> dict[str, str]:
    places = () if supervisor.strategy is None else supervisor.executable.obligations.places
    return {place.name: members.name(place.name.replace(" ", "_")) for place in places}


def _method_names(supervisor: Supervisor, members: PythonNamer) -> dict[tuple[str, str], str]:
    model = supervisor.model
    methods = {}
    for event in supervisor.executable.events.values():
        read = ["read"] if converted_paths(model, event.name) else []
        for purpose in (*(["allow"] if event.is_issued else read), "step"):
            methods[purpose, event.name] = members.name(f"{purpose}_{event.name.replace('.', '_')}")
    for item in model.communications:
        if EventKind.REQUEST in EVENT_KINDS[item.kind]:
            purposes = ["provide"] if model.provides_for(item.name) else []
            purposes += ["requirements", "conjuncts"] if model.requirements_on(item.name) else []
            for purpose in purposes:
                methods[purpose, item.name] = members.name(f"{purpose}_{item.name}")
        if item.when is not None:
            methods["matches", item.name] = members.name(f"matches_{item.name}")
        if model.limits_for(item.name):
            methods["limits", item.name] = members.name(f"limits_{item.name}")
    for item in model.communications:
        if item.kind is CommunicationKind.OUTGOING_MESSAGE and ("receive", item.identifier) not in methods:
            methods["receive", item.identifier] = members.name(f"receive_{item.identifier.strip('/')}")
    return methods


def _converter_names(model: Model) -> dict[str, str]:
    functions = PythonNamer()
    return {item.name: functions.name(f"convert_{item.name}") for item in model.enums}
