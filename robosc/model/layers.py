"""Statements that a model must make to become a supervision layer."""

from collections.abc import Iterable, Iterator

from robosc.errors import Diagnostic, RelatedPlace, Severity
from robosc.model.places import Places
from robosc.model.structure import Communication, CommunicationKind, Interface, Model

_CONTROLLER_CODES = frozenset({"empty-frame", "not-stamped"})
"""Codes of findings about what a controller sends: a layer passes on what comes to it."""

_VELOCITIES = (Interface("Twist", "geometry_msgs"), Interface("TwistStamped", "geometry_msgs"))
"""Interfaces of messages that keep acting after they were sent."""

_WORDS = {CommunicationKind.INCOMING_MESSAGE: "a message on", CommunicationKind.SERVICE: "a call of"}


def without_controller_findings(diagnostics: Iterable[Diagnostic]) -> tuple[Diagnostic, ...]:
    """The findings about a model that mean something for a layer."""
    return tuple(item for item in diagnostics if item.code not in _CONTROLLER_CODES)


def sharing_requests(model: Model) -> tuple[tuple[Communication, ...], ...]:
    """The communications of each topic, service and action that comes from an existing controller, in source order."""
    shared: dict[tuple[CommunicationKind, str], list[Communication]] = {}
    for item in model.communications:
        if item.request is not None:
            shared.setdefault((item.kind, item.identifier), []).append(item)
    return tuple(map(tuple, shared.values()))


def layer_findings(model: Model, places: Places) -> tuple[Diagnostic, ...]:
    """Errors about requests on one identifier that a layer could not distinguish."""
    return tuple(
        Diagnostic(
            Severity.ERROR,
            "ambiguous-layer-topic",
            f"{_WORDS.get(item.kind, 'a goal of')} '{item.identifier}' may be '{item.name}' or '{sharing[-1].name}'",
            places.communications[item.name],
            f"Say when it is '{item.name}': write 'when: CONDITION' over 'value' in its list.",
            (RelatedPlace(f"'{sharing[-1].name}' is here", places.communications[sharing[-1].name]),),
        )
        for sharing in sharing_requests(model)
        for item in sharing[:-1]
        if not item.has_condition
    )


def layer_warnings(model: Model, places: Places) -> Iterator[Diagnostic]:
    """Yield warnings about messages that let motion through as what stops the robot.

    Where every other message of the identifier is the all-default one, the last stands for all motion, as a message
    does that is alone on its identifier.
    """
    for sharing in sharing_requests(model):
        *others, last = sharing
        if not others or last.interface not in _VELOCITIES:
            continue
        if last.is_when_default or all(item.is_when_default for item in others):
            continue
        if last.has_condition and any(item.is_when_default for item in others):
            continue
        what = "that its condition is true of" if last.has_condition else "that is none of the others"
        yield Diagnostic(
            Severity.WARNING,
            "layer-passes-motion",
            f"a supervision layer lets any velocity {what} through as '{last.name}'",
            places.communications[last.name],
            f"Write 'when: default' in the list of '{last.name}' if it stops the robot.",
            (RelatedPlace(f"'{others[-1].name}' comes before it", places.communications[others[-1].name]),),
        )
