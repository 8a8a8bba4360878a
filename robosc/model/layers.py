"""What a model must say to become a supervision layer (language B.13)."""

from robosc.errors import Diagnostic, RelatedPlace, Severity
from robosc.model.places import Places
from robosc.model.structure import Communication, CommunicationKind, Model


def layer_findings(model: Model, places: Places) -> tuple[Diagnostic, ...]:
    """Incoming messages on one identifier that a layer could not tell apart."""
    shared: dict[str, list[Communication]] = {}
    for item in model.communications:
        if item.kind is CommunicationKind.INCOMING_MESSAGE:
            shared.setdefault(item.identifier, []).append(item)
    return tuple(
        Diagnostic(
            Severity.ERROR,
            "ambiguous-layer-topic",
            f"a message on '{item.identifier}' may be '{item.name}' or '{items[-1].name}'",
            places.communications[item.name],
            f"Say when it is '{item.name}': write 'when: CONDITION' over 'value' in its list.",
            (RelatedPlace(f"'{items[-1].name}' is here", places.communications[items[-1].name]),),
        )
        for items in shared.values()
        for item in items[:-1]
        if item.when is None
    )
