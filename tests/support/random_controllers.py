"""Random small robots whose controllers often have a fault: silent steps without end, orders that matter, tasks never
completed.

Components have a few states with taus between them, guarded by each other's states and variables; a robot has some of
every kind of communication, also two messages on one topic and actions whose requirements turn.
"""

from dataclasses import dataclass
from random import Random

import msgspec

from robosc.automata import to_automata
from robosc.expressions import (
    Binary,
    BooleanType,
    Constant,
    EnumType,
    EnumValue,
    Expression,
    IntegerType,
    NoneType,
    ObjectType,
    Received,
    StateTest,
    Unary,
    VariableRead,
)
from robosc.model.structure import (
    Behaviour,
    Communication,
    CommunicationKind,
    Component,
    Deployment,
    EnumDefinition,
    EnumRule,
    EventKind,
    Model,
    ObjectDefinition,
    Property,
    Requirement,
    RequirementForm,
    State,
    Transition,
    Update,
    Variable,
)
from robosc.supervisor import Supervisor
from robosc.synthesis import SynthesisStatus, synthesize
from support.execution import supervisor_of
from support.failing import made, model_files

NONE, BOOLEAN, SAMPLE = NoneType(), BooleanType(), ObjectType("Sample")

OBJECT = ObjectDefinition("Sample", (Property("n", IntegerType()), Property("m", IntegerType())))


def _enum(name: str, part: str) -> EnumDefinition:
    """Unknown for 0, small for 1, large for 6."""
    rule = Binary("<", Binary("/", Constant(6), Received((part,))), Constant(2))
    return EnumDefinition(name, SAMPLE, ("small", "large"), (EnumRule(rule, "large"),), "small")


ENUMS = (_enum("First", "n"), _enum("Second", "m"))

_LARGE = Binary("<", Binary("/", Constant(6), Received(("n",))), Constant(2))
ONE_FIELD = (
    tuple(
        EnumDefinition(name, SAMPLE, ("small", "large"), (EnumRule(rule, "large"),), "small")
        for name, rule in (
            ("First", Binary(">", Received(("n",)), Constant(3))),
            ("Second", Unary("not", Binary("<=", Received(("n",)), Constant(0)))),
        )
    ),
    (
        EnumDefinition("First", SAMPLE, ("small", "large"), (EnumRule(_LARGE, "large"),), "small"),
        EnumDefinition("Second", SAMPLE, ("small", "large"), (EnumRule(_LARGE, "small"),), "large"),
    ),
)
"""Two enums of one field: with 0, 1 and 6 all is said that they can be together."""
TYPES = tuple(EnumType(item.name, item.values) for item in ENUMS)


@dataclass
class _Part:
    """A component under way."""

    name: str
    states: list[str]
    variables: dict[str, Variable]
    transitions: list[Transition]


def random_controller(
    seed: int, *, is_plain: bool = False, enums: tuple[EnumDefinition, ...] = ENUMS
) -> Supervisor | None:
    """Return the supervisor of a random robot, the same for the same seed; None if there is none.

    Args:
        seed: Seed that decides everything else.
        is_plain: True if the robot has no taus and no actions.
        enums: The rules of its two enums.
    """
    model = msgspec.structs.replace(_model(Random(seed), is_plain), enums=enums)
    made("random_controller", seed, lambda: model_files(model))
    result = synthesize(to_automata(model, Deployment.CONTROLLER))
    if result.status is SynthesisStatus.EMPTY:
        return None
    return supervisor_of(model, added=result.added)


def random_robot(seed: int) -> Supervisor:
    """A supervisor that adds nothing to a random robot: it may be blocking, but has no range to leave."""
    model = _model(Random(seed), is_plain=False)
    made("random_robot", seed, lambda: model_files(model))
    return supervisor_of(model)


def _model(dice: Random, is_plain: bool) -> Model:
    parts = [
        _Part(f"P{number}", [f"s{place}" for place in range(dice.randint(2, 3))], {}, [])
        for number in range(dice.randint(2, 3))
    ]
    communications: list[Communication] = []
    for number in range(dice.randint(2, 4)):
        _add_communication(dice, number, dice.choice(parts), communications, 6 if is_plain else 7)
    for part in parts:
        for number in range(0 if is_plain else dice.choice((0, 1, 1, 2, 3))):
            source, target = dice.sample(part.states, 2)
            place = None if dice.random() < 0.1 else source
            guard = None if dice.random() < 0.2 else _condition(dice, parts)
            part.transitions.append(Transition(place, f"{part.name}.tau_{number + 1}", guard, (), target))
        _react(dice, part, communications)
    requested = [item.name for item in communications if item.kind is not CommunicationKind.OUTGOING_MESSAGE]
    actions = [item.name for item in communications if item.kind is CommunicationKind.ACTION]
    requirements = [
        Requirement((name,), dice.choice(list(RequirementForm)), _condition(dice, parts))
        for name in [*actions, *dice.sample(requested, dice.randint(0, min(1, len(requested))))]
    ]
    return Model(
        name="Robot",
        components=tuple(_component(dice, part) for part in parts),
        communications=tuple(communications),
        enums=ENUMS,
        objects=(OBJECT,),
        requirements=tuple(requirements),
        provides=(),
        invariants=(),
    )


def _add_communication(dice: Random, number: int, part: _Part, found: list[Communication], kinds: int) -> None:
    kind = CommunicationKind
    name = f"c{number}"
    match dice.randrange(kinds):
        case 0 | 1:
            found.append(Communication(name, part.name, kind.INCOMING_MESSAGE, f"/{name}", request=NONE))
        case 2:
            found.append(Communication(name, part.name, kind.OUTGOING_MESSAGE, f"/{name}", response=NONE))
        case 3:
            found.append(Communication(name, part.name, kind.OUTGOING_MESSAGE, f"/{name}", response=BOOLEAN))
        case 4:
            for letter, type_ in zip("ab", TYPES, strict=True):
                found.append(
                    Communication(f"{name}{letter}", part.name, kind.OUTGOING_MESSAGE, f"/{name}", response=type_)
                )
        case 5:
            found.append(Communication(name, part.name, kind.SERVICE, f"/{name}", request=NONE, response=NONE))
        case _:
            action = Communication(name, part.name, kind.ACTION, f"/{name}", request=NONE, response=NONE, feedback=NONE)
            found.append(action)


def _react(dice: Random, part: _Part, communications: list[Communication]) -> None:
    """Transitions of a component on events of communications, its own and others'."""
    for item in communications:
        for event in item.events:
            kind = EventKind(event.rpartition(".")[2])
            share = 0.6 if item.component == part.name else 0.15
            if kind is EventKind.RESET or dice.random() > share:
                continue
            if kind is EventKind.RESPONSE and item.response not in (NONE, None):
                variable = Variable(f"v{len(part.variables)}", item.response or BOOLEAN, _first(item), True)
                part.variables[variable.name] = variable
                update = Update(variable.name, Received())
                part.transitions.append(Transition(None, event, None, (update,), None))
                continue
            sources = dice.sample(part.states, dice.randint(1, len(part.states)))
            for source in sources:
                part.transitions.append(Transition(source, event, None, (), dice.choice([None, *part.states])))
            if kind in (EventKind.RESPONSE, EventKind.ERROR) and dice.random() < 0.2:
                # Two transitions on one event: the executor takes one of them.
                part.transitions.append(Transition(None, event, None, (), dice.choice(part.states)))


def _first(item: Communication) -> bool | str:
    return False if item.response == BOOLEAN else "small"


def _condition(dice: Random, parts: list[_Part]) -> Expression:
    part = dice.choice(parts)
    found: Expression = StateTest(part.name, dice.choice(part.states))
    readable = [(item.name, variable) for item in parts for variable in item.variables.values()]
    if readable and dice.random() < 0.5:
        name, variable = dice.choice(readable)
        found = VariableRead(name, variable.name)
        if isinstance(variable.type, EnumType):
            found = Binary("=", found, EnumValue(variable.type.name, dice.choice(variable.type.values)))
    if dice.random() < 0.4:
        found = Unary("not", found)
    if dice.random() < 0.25:
        found = Binary(dice.choice(("and", "or")), found, _condition(dice, parts))
    return found


def _component(dice: Random, part: _Part) -> Component:
    states = tuple(State(name, place == 0, dice.random() < 0.2) for place, name in enumerate(part.states))
    if not any(state.is_marked for state in states):
        place = dice.randrange(len(states))
        states = tuple(State(item.name, item.is_initial, at == place) for at, item in enumerate(states))
    return Component(part.name, Behaviour(tuple(part.variables.values()), states, tuple(part.transitions)))
