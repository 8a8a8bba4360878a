"""Changes between two versions of a model, in sentences for the person who has just saved its file."""

from collections import Counter
from collections.abc import Iterator, Mapping

from robosc.pipeline.supervisors import Supervisor
from robosc.pipeline.systems import SystemSupervisor
from robosc_view.watched_model import SynthesizedModel

MAXIMUM_CHANGES = 30
"""Sentences that are reported; of more the rest is counted."""


def model_changes(before: SynthesizedModel, after: SynthesizedModel) -> tuple[str, ...]:
    """Return the changes of states, events, conditions of the supervisor and findings."""
    old, new = _synthesized(before), _synthesized(after)
    found = [*_sizes(old, new), *_events(old, new), *_conditions(old, new), *_findings(before.findings, after.findings)]
    if not found:
        return ("nothing that the supervisor does has changed",)
    more = len(found) - MAXIMUM_CHANGES
    return (*found[:MAXIMUM_CHANGES], *((f"and {more} changes more",) if more > 0 else ()))


type _Synthesized = Supervisor | SystemSupervisor


def _synthesized(model: SynthesizedModel) -> _Synthesized:
    made = model.supervisor
    return made if isinstance(made, SystemSupervisor) else Supervisor.of(made)


def _sizes(old: _Synthesized, new: _Synthesized) -> Iterator[str]:
    if old.states != new.states:
        yield f"{new.states} states, which were {old.states}"


def _events(old: _Synthesized, new: _Synthesized) -> Iterator[str]:
    before, after = ([event.name for event in made.system.events] for made in (old, new))
    for word, there, elsewhere in (("new", after, before), ("gone", before, after)):
        names = [name for name in there if name not in elsewhere]
        if names:
            yield f"{word}: {', '.join(names)}"


def _conditions(old: _Synthesized, new: _Synthesized) -> Iterator[str]:
    before, after = _needs(old), _needs(new)
    for event in dict.fromkeys((*before, *after)):
        was, now = before.get(event, ""), after.get(event, "")
        if was != now:
            sentence = (
                f"the supervisor adds to {event}: {now}" if now else f"the supervisor adds nothing more to {event}"
            )
            yield f"{sentence}{f' (before: {was})' if was else ''}"


def _needs(made: _Synthesized) -> Mapping[str, str]:
    """The conditions that a supervisor adds and that forbid anything, by event."""
    return {event: condition.text for event, condition in made.conditions.items() if condition.text != "true"}


def _findings(before: tuple[str, ...], after: tuple[str, ...]) -> Iterator[str]:
    for word, more, less in (("new finding", after, before), ("no longer found", before, after)):
        for finding, count in (Counter(more) - Counter(less)).items():
            yield f"{word}: {finding}{f' ({count} times)' if count > 1 else ''}"
