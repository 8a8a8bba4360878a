"""The definition of a robot by its source: components, automata, communications; foreign ones are checked.

The topic `/state` of generated nodes and the bridge's service send the definition in the same words.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any

import msgspec

from robosc.documentation.diagram import label
from robosc.model.structure import CommunicationKind, Model
from robosc.supervisor import Supervisor
from robosc.targets.ros.state_topic import state_topic
from robosc_view.graphs import Arrow, Node, layout
from robosc_view.reports import CommunicationInfo, LogSpan, SourceKind

MAXIMUM_COMPONENTS = 2000
MAXIMUM_STATES = 100_000
"""Maximum number of states of one component."""

_Name = Annotated[str, msgspec.Meta(max_length=600)]
_Names = Annotated[tuple[_Name, ...], msgspec.Meta(max_length=100_000)]
Table = Mapping[str, Mapping[str, Mapping[str, int]]]
"""Number of the transition by event, component and the state that it is taken in."""

_CONTROLLABLE = frozenset({"request", "cancel", "reset"})


class DefinitionError(ValueError):
    """The definition from a source is invalid; one sentence."""


class ShapeTransition(msgspec.Struct, frozen=True):
    """A transition of a state."""

    next: _Name
    id: Annotated[int, msgspec.Meta(ge=0, le=2**31)]
    type: _Name
    communication: _Name

    @property
    def event(self) -> str:
        """Name of the event in the log; empty for a silent step."""
        return f"{self.communication}.{self.type}" if self.communication else ""


class ShapeState(msgspec.Struct, frozen=True):
    """A state of a behaviour."""

    name: _Name
    initial: bool
    transitions: Annotated[tuple[ShapeTransition, ...], msgspec.Meta(max_length=100_000)]


class ShapeBehaviour(msgspec.Struct, frozen=True):
    """A behaviour."""

    variables: _Names
    states: Annotated[tuple[ShapeState, ...], msgspec.Meta(max_length=MAXIMUM_STATES)]


class ShapeComponent(msgspec.Struct, frozen=True):
    """A component."""

    name: _Name
    messages: _Names
    services: _Names
    actions: _Names
    behaviour: ShapeBehaviour | None = None


class Shape(msgspec.Struct, frozen=True):
    """Part of the topic `/state` that is called `definition`."""

    name: _Name
    components: Annotated[tuple[ShapeComponent, ...], msgspec.Meta(max_length=MAXIMUM_COMPONENTS)]


def shape_of(value: Any) -> Shape:
    """Return a definition from plain values.

    Raises:
        DefinitionError: The values are no definition.
    """
    try:
        return msgspec.convert(value, Shape)
    except (msgspec.ValidationError, RecursionError) as error:
        raise DefinitionError(f"the robot's definition is malformed: {str(error)[:300]}") from error


@dataclass(frozen=True, slots=True)
class DrawnAutomaton:
    """An automaton without a model, as it is drawn.

    Attributes:
        role: `plant`, `requirement`, `supervisor` or `input variable`.
        nodes: Its locations; none where it is not drawn because too much is.
        arrows: Its edges.
    """

    role: str
    nodes: Sequence[Node]
    arrows: Sequence[Arrow]


@dataclass(frozen=True)
class Robot:
    """A robot as a source defines it.

    Attributes:
        source: Kind of source from which it comes.
        version: Version of the program that reports it; empty: not known.
        is_layer: True if its supervisor is a supervision layer.
        shape: Components and automata.
        communications: Its communications.
        table: Transitions that each event takes.
        supervisor: Supervisor with its model; None: not known.
        can_command: True if it can be stopped and commanded through the source.
        log: The log that is replayed; None: it is live.
        scene: Walls and line on the floor, and the way of a recorded run, for the map; None: not known.
        play: Events that a page can take, with the data that they carry; None: the robot is not stepped by hand.
        automata: Components by name that are automata without a model.
    """

    source: SourceKind
    version: str
    is_layer: bool
    shape: Shape
    communications: tuple[CommunicationInfo, ...]
    table: Table
    supervisor: Supervisor | None
    can_command: bool
    log: LogSpan | None = None
    scene: Mapping[str, Any] | None = None
    play: Mapping[str, Any] | None = None
    automata: Mapping[str, DrawnAutomaton] = field(default_factory=dict)

    @property
    def requests(self) -> tuple[str, ...]:
        """Every request, in the model's order."""
        incoming = str(CommunicationKind.OUTGOING_MESSAGE)
        return tuple(f"{item.name}.request" for item in self.communications if item.kind != incoming)


def robot_of(
    supervisor: Supervisor,
    source: SourceKind,
    *,
    version: str,
    channels: Mapping[str, str] | None = None,
    can_command: bool,
    log: LogSpan | None = None,
    scene: Mapping[str, Any] | None = None,
    play: Mapping[str, Any] | None = None,
) -> Robot:
    """Return the robot of a supervisor.

    Args:
        supervisor: Supervisor with its model.
        source: Kind of source from which it comes.
        version: Version of the program that reports it.
        channels: Channel that each communication is mapped to; None: not known.
        can_command: True if it can be stopped and commanded.
        log: The log that is replayed.
        scene: Scene for the map.
        play: Events that a page can take.
    """
    model = supervisor.model
    topic = state_topic(model)
    return Robot(
        source=source,
        version=version,
        is_layer=supervisor.deployment == "layer",
        shape=shape_of(topic.definition),
        communications=tuple(
            CommunicationInfo(
                item.name, item.component, str(item.kind), item.identifier, (channels or {}).get(item.name, "")
            )
            for item in model.communications
        ),
        table={event: dict(parts) for event, parts in topic.transitions.items()},
        supervisor=supervisor,
        can_command=can_command,
        log=log,
        scene=scene,
        play=play,
    )


def communications_of(shape: Shape) -> tuple[CommunicationInfo, ...]:
    """Return the communications that a definition names; the direction of messages follows from its transitions."""
    received = {
        transition.communication
        for component in shape.components
        if component.behaviour
        for state in component.behaviour.states
        for transition in state.transitions
        if transition.type == "response"
    }
    found = []
    for component in shape.components:
        for name in component.messages:
            kind = CommunicationKind.OUTGOING_MESSAGE if name in received else CommunicationKind.INCOMING_MESSAGE
            found.append(CommunicationInfo(name, component.name, str(kind), ""))
        found += [
            CommunicationInfo(name, component.name, str(CommunicationKind.SERVICE), "") for name in component.services
        ]
        found += [
            CommunicationInfo(name, component.name, str(CommunicationKind.ACTION), "") for name in component.actions
        ]
    return tuple(found)


def table_of(shape: Shape) -> Table:
    """Return the transitions each event takes, as far as a definition shows: silent steps have no names in it."""
    table: dict[str, dict[str, dict[str, int]]] = {}
    for component in shape.components:
        for state in component.behaviour.states if component.behaviour else ():
            for transition in state.transitions:
                if transition.event:
                    by_state = table.setdefault(transition.event, {}).setdefault(component.name, {})
                    by_state.setdefault(state.name, transition.id)
    return table


def definition_text(robot: Robot) -> str:
    """Return the message `definition`; every automaton is laid out, which takes time."""
    model = None if robot.supervisor is None else robot.supervisor.model
    message = {
        "type": "definition",
        "robot": robot.shape.name,
        "version": robot.version,
        "deployment": "automata" if robot.automata else "layer" if robot.is_layer else "controller",
        "source": str(robot.source),
        "can_command": robot.can_command,
        # Commands need the token of the server's start.
        "has_token": robot.can_command,
        "components": [
            {
                "name": item.name,
                "role": "" if drawn is None else drawn.role,
                "is_left_out": drawn is not None and not drawn.nodes,
                "communications": [*item.messages, *item.services, *item.actions],
                "graph": layout(drawn.nodes, drawn.arrows)
                if drawn is not None
                else None
                if item.behaviour is None
                else _graph(item.name, item.behaviour, model),
            }
            for item in robot.shape.components
            for drawn in (robot.automata.get(item.name),)
        ],
        "communications": [
            {
                "name": item.name,
                "component": item.component,
                "kind": item.kind,
                "identifier": item.identifier,
                "channel": item.channel,
            }
            for item in robot.communications
        ],
        "requests": list(robot.requests),
        "log": None
        if robot.log is None
        else {"begin_s": robot.log.begin_s, "end_s": robot.log.end_s, "count": robot.log.count},
        "scene": robot.scene,
        "play": robot.play,
    }
    return json.dumps(message, allow_nan=False, separators=(",", ":"))


def _graph(component: str, behaviour: ShapeBehaviour, model: Model | None) -> dict[str, Any] | None:
    names = {state.name for state in behaviour.states}
    marked, labels = _of_model(component, model)
    nodes = [Node(state.name, state.initial, state.name in marked) for state in behaviour.states]
    arrows = [
        Arrow(item.id, state.name, item.next, labels.get((state.name, place)) or item.event or "silent", _kind(item))
        for state in behaviour.states
        for place, item in enumerate(state.transitions)
        if item.next in names
    ]
    return layout(nodes, arrows)


def _kind(item: ShapeTransition) -> str:
    if not item.communication:
        return "silent"
    return "controllable" if item.type in _CONTROLLABLE else "uncontrollable"


def _of_model(component: str, model: Model | None) -> tuple[set[str], dict[tuple[str, int], str]]:
    """Marked states, and what transitions say by state and place in it: a definition has neither."""
    found = None if model is None else next((item for item in model.components if item.name == component), None)
    if found is None or found.behaviour is None:
        return set(), {}
    behaviour = found.behaviour
    labels: dict[tuple[str, int], str] = {}
    for state in behaviour.states:
        own: Sequence[Any] = [item for item in behaviour.transitions if item.source == state.name]
        everywhere = [item for item in behaviour.transitions if item.source is None]
        for place, item in enumerate((*own, *everywhere)):
            labels[state.name, place] = label(item)
    return {state.name for state in behaviour.states if state.is_marked}, labels
