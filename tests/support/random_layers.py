"""Random robots for supervision layers: several messages on one identifier, distinguished by conditions."""

from random import Random

import msgspec

from robosc.expressions import Binary, Constant, Expression, Received
from robosc.model.structure import Communication, CommunicationKind, Deployment
from robosc.supervisor import Supervisor
from support.execution import supervisor_of
from support.failing import made, model_files
from support.random_controllers import SAMPLE, random_robot

_INCOMING = CommunicationKind.INCOMING_MESSAGE


def random_layer(dice: Random) -> Supervisor:
    """A random robot, its incoming messages on few identifiers and distinguished by conditions."""
    model = random_robot(dice.randrange(2**32)).model
    found: list[Communication] = []
    for item in model.communications:
        if item.kind is _INCOMING:
            for letter in "xy"[: dice.choice((1, 1, 2))]:
                identifier = dice.choice(("/wheels", "/arm"))
                name = item.name if letter == "x" else f"{item.name}{letter}"
                copy = msgspec.structs.replace(item, name=name, identifier=identifier, request=SAMPLE)
                found.append(msgspec.structs.replace(copy, when=_condition(dice)))
        else:
            found.append(item)
    last = {item.identifier: item.name for item in found if item.kind is _INCOMING}
    is_open = dice.random() < 0.7
    communications = tuple(
        msgspec.structs.replace(item, when=None) if is_open and item.name == last.get(item.identifier) else item
        for item in found
    )
    layer = msgspec.structs.replace(model, communications=communications)
    made("random_layer", None, lambda: model_files(layer))
    return supervisor_of(layer, Deployment.LAYER)


def _condition(dice: Random) -> Expression:
    part = Received((dice.choice(("n", "m")),))
    left = dice.choice((part, part, Binary("/", Constant(6), part)))
    return Binary(dice.choice((">", "<", "=")), left, Constant(dice.choice((0, 1, 3))))
