"""Order in which a strategy tries requests: that of the source, refined by the preferences of the model."""

from collections.abc import Iterable, Sequence

from robosc.model.structure import EventKind, Preference


def preferred_order(requests: Sequence[str], preferences: Iterable[Preference]) -> tuple[str, ...]:
    """Return requests so that preferred ones come first: of those with nothing left before them, the first in source.

    Args:
        requests: Events of requests, in source order.
        preferences: Preferences, which are no circle.

    Raises:
        ValueError: They are one.
    """
    before: dict[str, set[str]] = {event: set() for event in requests}
    for item in preferences:
        for other in item.others:
            before[f"{other}.{EventKind.REQUEST}"] |= {f"{name}.{EventKind.REQUEST}" for name in item.preferred}
    left, found = list(requests), list[str]()
    while left:
        event = next((item for item in left if before[item].isdisjoint(left)), None)
        if event is None:
            raise ValueError(f"the preferences of {', '.join(left)} contradict each other")
        left.remove(event)
        found.append(event)
    return tuple(found)
