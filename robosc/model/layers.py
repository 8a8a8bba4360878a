"""Statements that a model must make to become a supervision layer."""

from collections.abc import Iterable

from robosc.errors import Diagnostic, RelatedPlace, Severity
from robosc.model.places import Places
from robosc.model.structure import Communication, CommunicationKind, Model

_CONTROLLER_CODES = frozenset({"empty-frame", "not-stamped"})
"""Codes of findings about what a controller sends: a layer passes on what comes to it."""


def without_controller_findings(diagnostics: Iterable[Diagnostic]) -> tuple[Diagnostic, ...]:
    """The findings about a model that mean something for a layer."""
    return tuple(item for item in diagnostics if item.code not in _CONTROLLER_CODES)


def confusable(model: Model) -> tuple[tuple[Communication, Communication], ...]:
    """Pairs of incoming messages on one identifier that a layer could not distinguish."""
    shared: dict[str, list[Communication]] = {}
    for item in model.communications:
        if item.kind is CommunicationKind.INCOMING_MESSAGE:
            shared.setdefault(item.identifier, []).append(item)
    return tuple((item, items[-1]) for items in shared.values() for item in items[:-1] if item.when is None)


def layer_findings(model: Model, places: Places) -> tuple[Diagnostic, ...]:
    """Errors about incoming messages on one identifier that a layer could not distinguish."""
    return tuple(
        Diagnostic(
            Severity.ERROR,
            "ambiguous-layer-topic",
            f"a message on '{item.identifier}' may be '{item.name}' or '{other.name}'",
            places.communications[item.name],
            f"Say when it is '{item.name}': write 'when: CONDITION' over 'value' in its list.",
            (RelatedPlace(f"'{other.name}' is here", places.communications[other.name]),),
        )
        for item, other in confusable(model)
    )
