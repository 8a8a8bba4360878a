"""Distributions of ROS 2 that a model fits, as far as the definitions that come with RoboSC say."""

from collections.abc import Iterator
from functools import cache

from robosc.interfaces import DISTRIBUTIONS, Distribution, Field, Part
from robosc.interfaces.catalogue import Catalogue, FoundInterfaces
from robosc.model.interfaces import KINDS, parts_by_event
from robosc.model.structure import Communication, Deployment, Model
from robosc.targets.ros.topics import Shape, shapes_of


def fits(model: Model, deployment: Deployment) -> tuple[tuple[Distribution, tuple[str, ...]], ...]:
    """The distributions of ROS 2 from old to new, each with what it lacks of what a node needs, in words.

    Types of packages whose definitions do not come with RoboSC are taken to fit.

    Args:
        model: Model of the node.
        deployment: Deployment of the node.
    """
    found = sorted((item for item in DISTRIBUTIONS if item.version == 2), key=lambda item: item.codename)
    return tuple((item, _lacking(model, deployment, _catalogue(item))) for item in found)


@cache
def _catalogue(distribution: Distribution) -> Catalogue:
    return Catalogue(distribution, FoundInterfaces({}))


def _lacking(model: Model, deployment: Deployment, catalogue: Catalogue) -> tuple[str, ...]:
    texts = (text for item in model.communications for text in _lacking_of(model, item, deployment, catalogue))
    return tuple(dict.fromkeys(texts))


def _lacking_of(model: Model, item: Communication, deployment: Deployment, catalogue: Catalogue) -> Iterator[str]:
    interface = item.interface
    if interface is None or not catalogue.knows(interface.package):
        return
    if catalogue.definition(KINDS[item.kind], interface.package, interface.type) is None:
        yield f"no {interface.package}/{interface.type}"
        return
    shapes = shapes_of(model, item, deployment)
    for event, (_, part) in parts_by_event(item, catalogue).items():
        for path in _unknown(shapes[f"{item.name}.{event}"], part, catalogue):
            yield f"no field {path} in {interface.package}/{interface.type}"


def _unknown(shape: Shape, part: Part, catalogue: Catalogue) -> Iterator[str]:
    """Yield the paths of properties that are no fields, or fields of another kind."""
    for name, inner in shape.items() if isinstance(shape, dict) else ():
        field = part.fields.get(name)
        if field is None or not _is_alike(inner, field):
            yield name
            continue
        element = inner[0] if isinstance(inner, list) else inner
        message = catalogue.message(field.type) if field.is_message else None
        if message is not None:
            yield from (f"{name}.{path}" for path in _unknown(element, message, catalogue))


def _is_alike(shape: Shape, field: Field) -> bool:
    """Return True if both are arrays, or both messages, or both plain values."""
    element = shape[0] if isinstance(shape, list) else shape
    return isinstance(shape, list) == (field.array is not None) and isinstance(element, dict) == field.is_message
