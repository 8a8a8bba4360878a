"""Random limits for a random robot, and requests that are the all-default ones."""

from collections.abc import Iterator
from random import Random

import msgspec

from robosc.expressions import Binary, Constant, DoubleType, Expression, IntegerType, ObjectType, StateTest, Type
from robosc.model.structure import Bound, Communication, Limit, Model, ObjectValue, Provide
from robosc.supervisor import Supervisor
from support.execution import supervisor_of
from support.random_controllers import SAMPLE
from support.random_layers import random_layer

_UNKNOWN = Binary("<", Binary("/", Constant(1), Constant(0)), Constant(1))


def limited_robot(supervisor: Supervisor, dice: Random) -> Supervisor:
    """The supervisor of a robot whose requests have limits; it adds what it added before."""
    limits = tuple(
        Limit(item.name, tuple(_bounds(dice, paths)), _condition(dice, supervisor.model))
        for item in supervisor.model.communications
        if (paths := tuple(_numbers(supervisor.model, item.request)))
        for _ in range(dice.choice((0, 1, 2, 3)))
    )
    return msgspec.structs.replace(supervisor, model=msgspec.structs.replace(supervisor.model, limits=limits))


def with_defaults(supervisor: Supervisor, dice: Random) -> Supervisor:
    """The supervisor of a robot some of whose requests are the all-default ones instead of having a condition."""

    def changed(item: Communication) -> Communication:
        if item.when is None or dice.random() < 0.6:
            return item
        return msgspec.structs.replace(item, when=None, is_when_default=True)

    model = supervisor.model
    model = msgspec.structs.replace(model, communications=tuple(map(changed, model.communications)))
    return msgspec.structs.replace(supervisor, model=model)


def _numbers(model: Model, type_: Type | None, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], bool]]:
    """Yield the numbers of a datum: their paths, and whether they are integers."""
    match type_:
        case DoubleType() | IntegerType():
            yield path, isinstance(type_, IntegerType)
        case ObjectType(name=name):
            for item in model.object(name).properties:
                yield from _numbers(model, item.type, (*path, item.name))


def _bounds(dice: Random, paths: tuple[tuple[tuple[str, ...], bool], ...]) -> Iterator[Bound]:
    for path, is_integer in dice.sample(paths, dice.randint(1, min(2, len(paths)))):
        low, high = sorted(dice.choices((-2, 0, 0, 1, 3) if is_integer else (-0.5, 0.0, 0.0, 0.25, 1.5), k=2))
        yield Bound(path, low, high)


def _condition(dice: Random, model: Model) -> Expression | None:
    kind = dice.random()
    if kind < 0.2:
        return None
    if kind < 0.3:
        return _UNKNOWN
    read = [item.expression for item in model.requirements]
    if read and kind < 0.6:
        return dice.choice(read)
    behaviours = [(item.name, item.behaviour) for item in model.components if item.behaviour is not None]
    if not behaviours:
        return None
    name, behaviour = dice.choice(behaviours)
    return StateTest(name, dice.choice(behaviour.states).name)


def limited_controller(dice: Random) -> Supervisor:
    """A supervisor that adds nothing to a random robot whose messages have data, some of it given, and limits."""
    model = random_layer(dice).model
    provides = tuple(
        Provide(item.name, _given(dice), _condition(dice, model))
        for item in model.communications
        if item.request == SAMPLE
        for _ in range(dice.choice((0, 1, 2)))
    )
    return limited_robot(supervisor_of(msgspec.structs.replace(model, provides=provides)), dice)


def _given(dice: Random) -> ObjectValue:
    names = dice.sample(("n", "m"), dice.randint(0, 2))
    unknown = Binary("/", Constant(1), Constant(0))
    return ObjectValue(
        tuple((name, unknown if dice.random() < 0.1 else Constant(dice.choice((-3, 0, 1, 2, 4)))) for name in names)
    )
