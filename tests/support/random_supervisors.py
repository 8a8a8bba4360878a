"""Random small supervisors, and the data that a careless or hostile world could send them.

The models are well typed, as the checker would have them, but make no sense; the added conditions are
random decision diagrams. Everything that a target must be able to write down occurs.
"""

import math
from array import array
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from random import Random
from types import SimpleNamespace
from typing import Any

from msgspec import structs

from robosc.automata import System, to_automata
from robosc.automata.state import subject_domain, subjects
from robosc.expressions import (
    ArrayPart,
    ArrayType,
    Binary,
    BooleanType,
    Call,
    Conditional,
    Constant,
    DoubleType,
    Element,
    EnumType,
    EnumValue,
    Expression,
    IntegerType,
    NoneType,
    ObjectType,
    Quantifier,
    Received,
    Reduction,
    StateTest,
    StringType,
    Type,
    Unary,
    Value,
    VariableRead,
    domain,
    is_finite,
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
    ObjectValue,
    Property,
    Provide,
    Requirement,
    RequirementForm,
    State,
    Transition,
    Update,
    Variable,
)
from robosc.supervisor import AddedCondition, Certificate, DecisionDiagram, DecisionNode, Supervisor
from support.failing import made, model_files

CERTIFICATE = Certificate(
    engine_version="0.0.0",
    bundle_sha256="0" * 64,
    deployment=Deployment.CONTROLLER,
    method="not at all",
    safe="not checked",
    controllable="not checked",
    nonblocking="not checked",
    maximally_permissive="not checked",
    states="0",
    transitions=None,
)

BOOLEAN: Type = BooleanType()
DOUBLE: Type = DoubleType()
STRING: Type = StringType()
INTEGER: Type = IntegerType()
NONE: Type = NoneType()
RANGE: Type = IntegerType(-2, 5)
OBJECT: Type = ObjectType("Sample")
INNER: Type = ObjectType("Inner")
KIND = EnumType("Kind", ("small", "large"))

KIND_DEFINITION = EnumDefinition(
    "Kind",
    RANGE,
    KIND.values,
    (EnumRule(Binary("<", Binary("/", Constant(6), Received()), Constant(2)), "large"),),
    "small",
)

OBJECTS = (
    ObjectDefinition(
        "Sample",
        (
            Property("level", RANGE),
            Property("count", INTEGER),
            Property("number", DOUBLE),
            Property("flag", BOOLEAN),
            Property("text", STRING),
            Property("numbers", ArrayType(DOUBLE)),
            Property("inner", INNER),
            Property("kind", KIND),
            Property("items", ArrayType(INNER)),
            Property("levels", ArrayType(RANGE)),
            Property("kinds", ArrayType(KIND)),
            Property("grid", ArrayType(ArrayType(INTEGER))),
        ),
    ),
    ObjectDefinition("Inner", (Property("class", DOUBLE), Property("self", INTEGER), Property("mood", KIND))),
)

_PATHS: dict[Type, list[tuple[tuple[str | int, ...], Type]]] = {
    OBJECT: [
        (("level",), RANGE),
        (("count",), INTEGER),
        (("number",), DOUBLE),
        (("flag",), BOOLEAN),
        (("text",), STRING),
        (("numbers", 0), DOUBLE),
        (("numbers", 2), DOUBLE),
        (("inner", "class"), DOUBLE),
        (("inner", "self"), INTEGER),
        (("kind",), KIND),
        (("kinds", 0), KIND),
        (("kinds", 2), KIND),
        (("items", 1, "mood"), KIND),
        (("items", 0, "self"), INTEGER),
        (("levels", 1), RANGE),
    ],
}

_ARRAYS: list[tuple[str, Type]] = [
    ("numbers", DOUBLE),
    ("items", INNER),
    ("levels", RANGE),
    ("kinds", KIND),
    ("grid", ArrayType(INTEGER)),
]
"""The arrays of an object, with the types of their elements."""

# Names that would break careless code: keywords, built-ins, our own, and pairs that look alike.
COMPONENT_NAMES = ("class", "self", "A", "A__state", "None", "__init__")
VARIABLE_NAMES = ("state", "values", "x", "lambda", "__x", "skipped", "data")
STATE_NAMES = ("idle", "True", "enabled", "idle_")
MESSAGE_NAMES = ("import", "step", "m", "m_request", "_", "print", "read", "async")


@dataclass(frozen=True, slots=True)
class _World:
    """Subjects that expressions may refer to."""

    variables: tuple[tuple[str, Variable], ...]
    states: tuple[tuple[str, str], ...]
    received: Type | None = None
    is_finite: bool = False

    def finite(self) -> "_World":
        """Return the subjects that take part in synthesis: only its own variables and finite data."""
        return replace(self, variables=tuple(item for item in self.variables if item[1].is_synthesis), is_finite=True)


def _kin(type_: Type) -> object:
    """Types that may stand for each other in an expression."""
    return "integer" if isinstance(type_, IntegerType) else type_


def _leaves(world: _World, type_: Type) -> list[Expression]:
    found: list[Expression] = [
        VariableRead(component, variable.name)
        for component, variable in world.variables
        if _kin(variable.type) == _kin(type_)
    ]
    if type_ == BOOLEAN:
        found += [StateTest(component, state) for component, state in world.states]
    if world.received is not None:
        paths = _PATHS.get(world.received, [((), world.received)])
        fitting = [(path, inner) for path, inner in paths if _kin(inner) == _kin(type_)]
        reads = [Received(path) for path, inner in fitting if is_finite(inner) or not world.is_finite]
        found += reads * 3
    return found


def _part(dice: Random, array: Received | Element) -> ArrayPart:
    return ArrayPart(array) if dice.random() < 0.4 else ArrayPart(array, dice.randint(0, 4), dice.randint(0, 4))


def _reduced(dice: Random, world: _World, type_: Type) -> Expression | None:
    """A number that is made of an array, if there is one."""
    if world.received != OBJECT or world.is_finite:
        return None
    if type_ == DOUBLE:
        return Reduction(dice.choice(["min", "max"]), _part(dice, Received(("numbers",))))
    name = dice.choice(["numbers", "items", "levels", "levels", "grid"])
    if name == "levels":
        return Reduction(dice.choice(["min", "max"]), _part(dice, Received((name,))))
    return Reduction("length", ArrayPart(Received((name,))))


def _quantified(dice: Random, world: _World) -> Expression | None:
    """A condition about an array's elements, if there is an array."""
    if world.received != OBJECT or world.is_finite:
        return None
    name, element = dice.choice(_ARRAYS)
    condition: Expression
    match element:
        case ArrayType():
            inner = Binary(">", Element(0), Binary("+", Element(0), Constant(dice.choice([0, 1]))))
            least = Reduction("min", _part(dice, Element(0)))
            condition = Quantifier("any", _part(dice, Element(0)), inner)
            condition = Binary("or", condition, Binary("<", least, Constant(3)))
        case EnumType():
            condition = Binary("=", Element(0), _constant(dice, KIND))
        case ObjectType():
            mood = Binary("=", Element(0, ("mood",)), _constant(dice, KIND))
            condition = Binary(dice.choice(["and", "or"]), mood, Binary("<", Element(0, ("class",)), Constant(0.5)))
        case _:
            condition = Binary(dice.choice(["<", "=", ">="]), Element(0), _constant(dice, element))
    return Quantifier(dice.choice(["any", "all"]), _part(dice, Received((name,))), condition)


def _constant(dice: Random, type_: Type) -> Expression:
    match type_:
        case BooleanType():
            return Constant(dice.random() < 0.5)
        case IntegerType():
            return Constant(dice.choice([0, 1, -1, 3, 2**31 - 1, -(2**31)]))
        case DoubleType():
            return Constant(dice.choice([0.0, 0.4, -1.5, 1e300, 1e-7]))
        case EnumType(name=name, values=values):
            return EnumValue(name, dice.choice(values))
        case _:
            return Constant(dice.choice(["", "a", "it's", '"""\n\\', "\udc80é"]))


def _expression(dice: Random, world: _World, type_: Type, depth: int) -> Expression:
    """A well-typed expression."""
    leaves = _leaves(world, type_)
    if depth == 0 or dice.random() < 0.2:
        return dice.choice(leaves) if leaves and dice.random() < 0.7 else _constant(dice, type_)

    def below(inner: Type) -> Expression:
        return _expression(dice, world, inner, depth - 1)

    if not isinstance(type_, BooleanType | IntegerType | DoubleType):
        if dice.random() < 0.6:
            return _expression(dice, world, type_, 0)
        return Conditional(below(BOOLEAN), below(type_), below(type_))
    if isinstance(type_, BooleanType):
        quantified = _quantified(dice, world) if dice.random() < 0.3 else None
        return quantified or _condition(dice, world, below)
    shape = dice.random()
    if shape < 0.12:
        reduced = _reduced(dice, world, type_)
        if reduced is not None:
            return reduced
    if shape < 0.35:
        return _called(dice, type_, below)
    if dice.random() < 0.2:
        return Unary("-", below(type_))
    if type_ == DOUBLE:
        left, right = dice.choice([(DOUBLE, DOUBLE), (INTEGER, INTEGER), (DOUBLE, INTEGER)])
        operator = "/" if left == INTEGER else dice.choice("+-*/")
        return Binary(operator, below(left), below(right))  # type: ignore[arg-type]
    return Binary(dice.choice("+-*"), below(INTEGER), below(INTEGER))  # type: ignore[arg-type]


def _called(dice: Random, type_: Type, below: Callable[[Type], Expression]) -> Expression:
    """A function of numbers, or a conditional number."""
    kind = DOUBLE if type_ == DOUBLE else INTEGER
    match dice.randrange(5):
        case 0:
            return Call("double" if kind == DOUBLE else "integer", (below(dice.choice([DOUBLE, INTEGER])),))
        case 1:
            return Call("abs", (below(kind),))
        case 2:
            return Call("clamp", (below(kind), below(kind), below(kind)))
        case 3:
            return Call(dice.choice(["min", "max"]), (below(kind), below(kind)))
        case _:
            return Conditional(below(BOOLEAN), below(kind), below(kind))


def _condition(dice: Random, world: _World, below: Callable[[Type], Expression]) -> Expression:
    enums = [variable.type for _, variable in world.variables if isinstance(variable.type, EnumType)]
    enums += [KIND] * (world.received == OBJECT)
    match dice.randrange(6):
        case 5:
            return Conditional(below(BOOLEAN), below(BOOLEAN), below(BOOLEAN))
        case 0:
            return Unary(dice.choice(["not", "holds"]), below(BOOLEAN))
        case 1 | 2:
            return Binary(dice.choice(["or", "and", "implies", "=", "!="]), below(BOOLEAN), below(BOOLEAN))
        case 3:
            left, right = dice.choice([(INTEGER, INTEGER), (DOUBLE, DOUBLE), (INTEGER, DOUBLE)])
            return Binary(dice.choice(["=", "!=", "<", "<=", ">", ">="]), below(left), below(right))
        case _:
            kind = dice.choice(enums) if enums and dice.random() < 0.6 else STRING
            return Binary(dice.choice(["=", "!="]), below(kind), below(kind))


def _enums(dice: Random) -> tuple[EnumDefinition, ...]:
    result = [KIND_DEFINITION]
    for name in ("Level", "Library.convert")[: dice.randint(0, 2)]:
        source = dice.choice([OBJECT, OBJECT, DOUBLE, INTEGER, RANGE, BOOLEAN, STRING])
        choices = dice.sample(["low", "high", "None"], dice.randint(1, 3))
        rules = tuple(
            EnumRule(_expression(dice, _World((), (), source), BOOLEAN, 2), dice.choice(choices))
            for _ in range(dice.randint(0, 3))
        )
        default = dice.choice(choices)
        values = tuple(dict.fromkeys([*(rule.value for rule in rules), default]))
        result.append(EnumDefinition(name, source, values, rules, default))
    return tuple(result)


def _types(enums: Sequence[EnumDefinition]) -> list[Type]:
    return [BOOLEAN, DOUBLE, STRING, INTEGER, RANGE, *(EnumType(enum.name, enum.values) for enum in enums)]


def _communication(dice: Random, name: str, component: str, enums: Sequence[EnumDefinition]) -> Communication:
    kind = dice.choice([*CommunicationKind, *[CommunicationKind.OUTGOING_MESSAGE] * 2])
    received = [NONE, OBJECT, *_types(enums), *[EnumType(enum.name, enum.values) for enum in enums] * 3]
    is_outgoing, is_incoming = kind is CommunicationKind.OUTGOING_MESSAGE, kind is CommunicationKind.INCOMING_MESSAGE
    return Communication(
        name=name,
        component=component,
        kind=kind,
        identifier=dice.choice(["/a", "/b/c", name, 'it\'s "x"\n\\']),
        request=None if is_outgoing else dice.choice([NONE, OBJECT, BOOLEAN, DOUBLE, INTEGER, STRING]),
        response=None if is_incoming else dice.choice(received),
        feedback=dice.choice(received) if kind is CommunicationKind.ACTION else None,
    )


def _with_conditions(dice: Random, communications: Sequence[Communication]) -> tuple[Communication, ...]:
    """The communications, most incoming messages with a condition (`when`) over what arrives."""
    found = []
    for item in communications:
        if item.kind is CommunicationKind.INCOMING_MESSAGE and item.request != NONE and dice.random() < 0.8:
            type_ = dice.choice([item.request, OBJECT, KIND, RANGE]) if item.request != OBJECT else OBJECT
            assert type_ is not None
            condition = _expression(dice, _World((), (), type_), BOOLEAN, 3)
            found.append(structs.replace(item, request=type_, when=condition))
        else:
            found.append(item)
    return tuple(found)


def _variable(dice: Random, name: str, enums: Sequence[EnumDefinition]) -> Variable:
    kinds = [EnumType(enum.name, enum.values) for enum in enums]
    type_ = dice.choice([*_types(enums), *kinds * 3])
    if is_finite(type_):
        return Variable(name, type_, dice.choice(list(domain(type_))), dice.random() < 0.6)
    initials: dict[Type, list[Value]] = {INTEGER: [0, 2**31 - 1], DOUBLE: [0.0, -2.5], STRING: ["", "it's"]}
    return Variable(name, type_, dice.choice(initials[type_]), False)


def random_supervisor(seed: int) -> Supervisor:
    """A supervisor of a random model; the same for the same seed."""
    dice = Random(seed)
    enums = _enums(dice)
    names = dice.sample(COMPONENT_NAMES, dice.randint(1, 3))
    messages = dice.sample(MESSAGE_NAMES, len(MESSAGE_NAMES))
    communications = tuple(
        _communication(dice, messages.pop(), component, enums) for component in names for _ in range(dice.randint(0, 2))
    )
    communications = _with_conditions(Random(f"{seed} when"), communications)
    variables = {
        name: tuple(_variable(dice, item, enums) for item in dice.sample(VARIABLE_NAMES, dice.randint(0, 3)))
        for name in names
    }
    states = {name: dice.sample(STATE_NAMES, dice.randint(1, 3)) for name in names}
    world = _World(
        tuple((name, variable) for name in names for variable in variables[name]),
        tuple((name, state) for name in names for state in states[name]),
    )
    components = tuple(
        Component(name, _behaviour(dice, name, states[name], variables[name], communications, world)) for name in names
    )
    requested = [item for item in communications if item.kind is not CommunicationKind.OUTGOING_MESSAGE]
    model = Model(
        name="Robot",
        components=(*components, Component("Bare")),
        communications=communications,
        enums=enums,
        objects=OBJECTS,
        requirements=_requirements(dice, requested, world),
        provides=_provides(dice, requested, world),
        invariants=(),
    )
    made("random_supervisor", seed, lambda: model_files(model))
    deployment = dice.choice(list(Deployment))
    return Supervisor(model, deployment, _added(dice, to_automata(model, deployment)), CERTIFICATE)


def _behaviour(
    dice: Random,
    name: str,
    states: Sequence[str],
    variables: Sequence[Variable],
    communications: Sequence[Communication],
    world: _World,
) -> Behaviour:
    transitions: list[Transition] = []
    for item in communications:
        for event in item.events:
            kind = event.rpartition(".")[2]
            if kind == EventKind.RESET or dice.random() < 0.4:
                continue
            # Two transitions on one request or cancel in one state are an error of the model.
            mixed = [] if kind in (EventKind.REQUEST, EventKind.CANCEL) else [(states[0], None), (states[0], states[0])]
            for source in dice.choice([(None,), tuple(states), tuple(states[:1]), *mixed]):
                transitions.append(_transition(dice, item, event, source, states, variables, world))
    for number in range(dice.randint(0, 2)):
        guard = _expression(dice, world.finite(), BOOLEAN, 2) if dice.random() < 0.7 else None
        source, target = dice.choice([None, *states]), dice.choice([None, *states])
        transitions.append(Transition(source, f"{name}.tau_{number + 1}", guard, (), target))
    return Behaviour(
        tuple(variables),
        tuple(State(state, place == 0, dice.random() < 0.5) for place, state in enumerate(states)),
        tuple(transitions),
    )


def _transition(
    dice: Random,
    communication: Communication,
    event: str,
    source: str | None,
    states: Sequence[str],
    variables: Sequence[Variable],
    world: _World,
) -> Transition:
    received = communication.received_type(EventKind(event.rpartition(".")[2]))
    reading = replace(world, received=None if received == NONE else received)
    updates = []
    if communication.kind is not CommunicationKind.INCOMING_MESSAGE:
        for variable in dice.sample(variables, dice.randint(0, len(variables))):
            scope = reading.finite() if variable.is_synthesis else reading
            type_ = dice.choice([DOUBLE, INTEGER]) if variable.type == DOUBLE else variable.type
            updates.append(Update(variable.name, _expression(dice, scope, type_, dice.randint(0, 2))))
    return Transition(source, event, None, tuple(updates), dice.choice([None, *states]))


def _requirements(dice: Random, requested: Sequence[Communication], world: _World) -> tuple[Requirement, ...]:
    names = [item.name for item in requested]
    return tuple(
        Requirement(
            tuple(dice.sample(names, dice.randint(1, min(2, len(names))))),
            dice.choice(list(RequirementForm)),
            _expression(dice, world.finite(), BOOLEAN, 3),
        )
        for _ in range(dice.randint(0, 3) if names else 0)
    )


def _provides(dice: Random, requested: Sequence[Communication], world: _World) -> tuple[Provide, ...]:
    result = []
    for item in requested:
        for _ in range(dice.randint(0, 2)):
            condition = _expression(dice, world.finite(), BOOLEAN, 1) if dice.random() < 0.5 else None
            if item.request == OBJECT:
                inner = ObjectValue((("self", _expression(dice, world, INTEGER, 1)),))
                value = ObjectValue((("number", _expression(dice, world, DOUBLE, 2)), ("inner", inner)))
                result.append(Provide(item.name, value, condition))
            elif item.request is not None and item.request != NONE:
                result.append(Provide(item.name, _expression(dice, world, item.request, 2), condition))
    return tuple(result)


def _added(dice: Random, system: System) -> tuple[AddedCondition, ...]:
    controllable = [event.name for event in system.events if event.is_controllable]
    return tuple(AddedCondition(event, random_diagram(dice, system)) for event in controllable if dice.random() < 0.4)


def random_diagram(dice: Random, system: System) -> DecisionDiagram:
    """A random ordered diagram; nodes that decide nothing and equal nodes may occur."""
    nodes: list[DecisionNode] = []
    for subject in reversed(subjects(system)):
        size = len(subject_domain(system, subject))
        if size < 2 or dice.random() < 0.3:
            continue
        starts = (0, *sorted(dice.sample(range(1, size), dice.randint(1, min(2, size - 1)))))
        children = tuple(dice.randrange(len(nodes) + 2) for _ in starts)
        nodes.append(DecisionNode(subject.automaton, subject.variable, starts, children))
    return DecisionDiagram(tuple(nodes), len(nodes) + 1)


_SCALARS = (
    *(0, 1, -1, 3, 5, 6, 7, 9, 100, 2**31 - 1, 2**31, -(2**31), 10**400),
    *(0.4, -0.5, 1.0, 1e308, math.nan, math.inf, -math.inf),
    *(None, True, False, "", "a", "it's", "\udc80é"),
)


class Trap:
    """An object whose attributes are not what they seem."""

    numbers = 5
    text = b"bytes"
    flag = 1
    level = True


def random_data(dice: Random) -> Any:
    """Anything that may come with an event."""
    kind = dice.random()
    if kind < 0.35:
        return dice.choice(_SCALARS)
    if kind < 0.5:
        return dice.choice(([], {}, Trap(), object(), b"bytes", 3, {"level": 3}))
    fields = {
        "level": dice.choice(_SCALARS) if dice.random() < 0.2 else dice.randint(-9, 9),
        "kind": dice.choice(_SCALARS),
        "count": dice.choice(_SCALARS),
        "number": dice.choice(_SCALARS),
        "flag": dice.choice(_SCALARS) if dice.random() < 0.2 else dice.random() < 0.5,
        "text": dice.choice(_SCALARS),
        "numbers": dice.choice(
            [
                [dice.choice(_SCALARS) for _ in range(dice.randint(0, 4))],
                array("f", [dice.uniform(-1, 1) for _ in range(dice.randint(0, 4))]),
                dice.choice([None, "text", {0: 1.0}, {5: 1.0}, {"a": 1}, 3]),
            ]
        ),
        "items": [
            dice.choice([{"class": dice.choice(_SCALARS), "mood": dice.choice(_SCALARS)}, None, Trap()])
            for _ in range(dice.randint(0, 3))
        ],
        "levels": dice.choice([[dice.choice(_SCALARS) for _ in range(dice.randint(0, 4))], b"bytes", "no", None]),
        "kinds": [dice.choice(_SCALARS) for _ in range(dice.randint(0, 4))],
        "grid": dice.choice([[[1, 2], [], [2**31 - 1]], [[dice.choice(_SCALARS)], None], [3], {}]),
        "inner": dice.choice([{"class": dice.choice(_SCALARS), "self": dice.choice(_SCALARS)}, None, 3]),
    }
    kept = {name: value for name, value in fields.items() if dice.random() < 0.9}
    return kept if dice.random() < 0.5 else SimpleNamespace(**kept)
