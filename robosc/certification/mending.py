"""Mends of a model in which synthesis has to forbid what is wanted: one transition that leads elsewhere.

A mend is proposed only where synthesis of the mended model, and the check of its controller, show that it helps and
that all that could happen before still can.
"""

from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from itertools import islice

import msgspec

from robosc.automata import ExecutableSystem
from robosc.controller_properties import check_controller
from robosc.errors import NodeLimitError
from robosc.model.structure import Behaviour, Deployment, EventKind, Model, Transition
from robosc.synthesis import EngineOptions, SynthesisStatus, synthesize
from robosc.synthesis.questions import Questions

MAXIMUM_TRIALS = 6
"""Mends that are tried for one finding: each takes a synthesis."""

_WORDS = {
    EventKind.REQUEST: "request to",
    EventKind.RESPONSE: "response from",
    EventKind.ERROR: "error from",
    EventKind.FEEDBACK: "feedback from",
    EventKind.CANCEL: "cancel to",
}


class Mend(msgspec.Struct, frozen=True):
    """A transition that leads elsewhere, or that was not there.

    Attributes:
        component: Its component.
        state: The state that it leaves.
        event: Its event.
        target: The state that it is to lead to.
        before: The transition that is there now, or None.
    """

    component: str
    state: str
    event: str
    target: str
    before: Transition | None

    def __str__(self) -> str:
        name, _, kind = self.event.rpartition(".")
        what = f"on {_WORDS[EventKind(kind)]} {name}"
        where = f"in state '{self.state}' of {self.component}"
        if self.before is None or self.before.source is None:
            return f"Write '{what} goto {self.target}' {where}"
        if self.before.target is None:
            return f"Add 'goto {self.target}' to '{what}' {where}"
        return f"Write 'goto {self.target}' instead of 'goto {self.before.target}' at '{what}' {where}"

    def applied(self, model: Model) -> Model:
        """Return the mended model."""
        component = model.component(self.component)
        behaviour = component.behaviour or Behaviour((), (), ())
        updates = () if self.before is None else self.before.updates
        new = Transition(self.state, self.event, None, updates, self.target)
        kept = (item for item in behaviour.transitions if not (item.source == self.state and item.event == self.event))
        mended = msgspec.structs.replace(behaviour, transitions=(*kept, new))
        components = (
            msgspec.structs.replace(item, behaviour=mended) if item is component else item for item in model.components
        )
        return msgspec.structs.replace(model, components=tuple(components))


def mends(model: Model, event: str, stands: Iterable[tuple[str, str]]) -> Iterator[Mend]:
    """Yield mends for what an event leads to, the most natural ones first.

    Args:
        model: The model.
        event: The event of a service or action.
        stands: Components with the state that each is in before the event.
    """
    communication = event.rpartition(".")[0]
    for name, state in stands:
        behaviour = model.component(name).behaviour
        if behaviour is None:
            continue
        before = _taken(behaviour, state, event)
        others = (_taken(behaviour, state, f"{communication}.{kind}") for kind in _WORDS if kind != EventKind.REQUEST)
        targets = [item.target for item in others if item is not None and item.target is not None]
        targets += [behaviour.initial, *(item.name for item in behaviour.states if item.is_marked)]
        for target in dict.fromkeys(targets):
            if target != state and (before is None or target != before.target):
                yield Mend(name, state, event, target, before)


def _taken(behaviour: Behaviour, state: str, event: str) -> Transition | None:
    """Return the transition on an event that is taken in a state; its own goes before that of every state."""
    found = [item for item in behaviour.transitions if item.event == event and item.source in (state, None)]
    return next((item for item in found if item.source == state), found[0] if found else None)


def working_mend(
    model: Model,
    event: str,
    stands: Iterable[tuple[str, str]],
    wanted: str,
    deployment: Deployment,
    *,
    engine: str | EngineOptions = "auto",
    should_stop: Callable[[], bool] = lambda: False,
) -> Mend | None:
    """Return the first mend with which synthesis allows what is wanted, or None if none was found.

    Args:
        model: The model.
        event: The event after which something is wrong.
        stands: Components with the state that each is in before the event.
        wanted: The request or cancel that is to be allowed.
        deployment: Deployment of the supervisor.
        engine: Name of the engine for decision diagrams, or more about it.
        should_stop: Function called before each step; once true, the work ends.

    Raises:
        SynthesisCancelled: `should_stop` became true.
    """
    candidates = list(islice(mends(model, event, stands), MAXIMUM_TRIALS))
    with suppress(NodeLimitError):
        dead = _dead_events(model, deployment, engine, should_stop)[0] if candidates else frozenset()
        for item in candidates:
            mended = item.applied(model)
            still_dead, forbidden = _dead_events(mended, deployment, engine, should_stop)
            if still_dead <= dead and wanted not in still_dead | forbidden:
                return item
    return None


def _dead_events(
    model: Model, deployment: Deployment, engine: str | EngineOptions, should_stop: Callable[[], bool]
) -> tuple[frozenset[str], frozenset[str]]:
    """Return the events that never happen under a model's supervisor, and the cancels that it forbids."""
    executable = ExecutableSystem(model, deployment)
    events = tuple(item.name for item in executable.automata.events)
    found = synthesize(executable.automata, engine=engine, questions=Questions(events=events), should_stop=should_stop)
    if found.status is SynthesisStatus.EMPTY:
        return frozenset(events), frozenset(events)
    checked = check_controller(executable, found.added, is_nonblocking=False, should_stop=should_stop)
    forbidden = {item.event for item in checked.forbidden}
    if checked.cancels == "not checked" or checked.livelock is not None:
        forbidden.update(events)
    return frozenset(item.event for item in found.answers.never), frozenset(forbidden)
